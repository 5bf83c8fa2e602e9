"""YAML as case files are read, where YAML 1.2 and PyYAML's 1.1 differ: as 1.2 has it.

    yaml.load(text, Loader=Loader)

10:50:5 is a text, and not 39005, its value to the base of 60: a grid written without quotes would be another one
otherwise, without a word. on, off, yes and no are texts, and not true and false: a fixture's ``on: table`` would have
the key true. Where a switch is asked for they are understood as before.
"""

from __future__ import annotations

import re
from typing import Any

import yaml

_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_BOOL = "tag:yaml.org,2002:bool"
_TRUTH = _BOOL, re.compile(r"^(?:true|True|TRUE|false|False|FALSE)$")
_COLONS = "tag:yaml.org,2002:str", re.compile(r"^[-+]?[\d.]+(:[-+]?[\d.]+)+$")


class Loader(_Base):
    """PyYAML's safe loader, without numbers to the base of 60 and with no other words for true and false."""

    yaml_implicit_resolvers = {  # noqa: RUF012 (PyYAML's own name and kind)
        **{
            first: [kind for kind in kinds if kind[0] != _BOOL]
            for first, kinds in _Base.yaml_implicit_resolvers.items()
        },
        **{first: [_TRUTH] for first in "tTfF"},
        **{first: [_COLONS, *_Base.yaml_implicit_resolvers.get(first, [])] for first in "-+.0123456789"},
    }
