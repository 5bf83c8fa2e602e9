"""YAML as case files are read: 10:50:5 is a text, as in YAML 1.2, and not 39005, its value to the base of 60.

    yaml.load(text, Loader=Loader)

A grid written without quotes would be another one otherwise, without a word.
"""

from __future__ import annotations

import re
from typing import Any

import yaml

_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_COLONS = "tag:yaml.org,2002:str", re.compile(r"^[-+]?[\d.]+(:[-+]?[\d.]+)+$")


class Loader(_Base):
    """PyYAML's safe loader, without numbers to the base of 60."""

    yaml_implicit_resolvers = {  # noqa: RUF012 (PyYAML's own name and kind)
        **_Base.yaml_implicit_resolvers,
        **{first: [_COLONS, *_Base.yaml_implicit_resolvers.get(first, [])] for first in "-+.0123456789"},
    }
