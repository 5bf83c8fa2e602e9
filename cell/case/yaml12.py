"""YAML as case files are read: as YAML 1.2 has it where PyYAML's 1.1 differs, and bounded.

    content = load_yaml(text)

10:50:5 is a text, and not 39005, its value to the base of 60: a grid written without quotes would be another one
otherwise, without a word. on, off, yes and no are texts, and not true and false: a fixture's ``on: table`` would have
the key true. Where a switch is asked for they are understood as before. 010 is ten. A date without quotes is an error,
and so is a key that stands twice, since one of the two would be dropped. What grows beyond measure when its aliases are
filled in, refers to itself, or nests deeper than any case does, is refused before anything is made of it.
"""

from __future__ import annotations

import re
from collections.abc import Hashable
from typing import Any

import yaml

MOST_NODES = 200_000  # with aliases filled in
MOST_DEPTH = 40
MOST_DIGITS = 400  # of a whole number; more than any float has

_Base: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_TAG = "tag:yaml.org,2002:"
_KINDS = ("null", "bool", "int", "float", "str", "seq", "map")
_DROPPED = (f"{_TAG}bool", f"{_TAG}int")
_TRUTH = f"{_TAG}bool", re.compile(r"^(?:true|True|TRUE|false|False|FALSE)$")
_WHOLE = f"{_TAG}int", re.compile(r"^(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)$")
_COLONS = f"{_TAG}str", re.compile(r"^[-+]?[\d.]+(:[-+]?[\d.]+)+$")


class Loader(_Base):
    """PyYAML's safe loader with the types of JSON alone; see the module."""

    yaml_implicit_resolvers = {  # noqa: RUF012 (PyYAML's own name and kind)
        **{
            first: [kind for kind in kinds if kind[0] not in _DROPPED]
            for first, kinds in _Base.yaml_implicit_resolvers.items()
        },
        **{first: [_TRUTH] for first in "tTfF"},
        **{
            first: [_COLONS, _WHOLE, *(k for k in _Base.yaml_implicit_resolvers.get(first, []) if k[0] not in _DROPPED)]
            for first in "-+.0123456789"
        },
    }
    yaml_constructors = {  # noqa: RUF012
        tag: make
        for tag, make in _Base.yaml_constructors.items()
        if tag is None or tag in [f"{_TAG}{kind}" for kind in _KINDS]
    }

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        """A node's value; what its tag does not allow is an error of YAML, with its line."""
        try:
            return super().construct_object(node, deep)
        except (ValueError, LookupError, TypeError, AttributeError, OverflowError):
            said = str(getattr(node, "value", ""))[:40]
            problem = f"{said!r} is not of the type {str(node.tag).removeprefix(_TAG)}"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark) from None

    def construct_mapping(self, node: yaml.Node, deep: bool = False) -> dict[Hashable, Any]:
        """A mapping without repeated keys; its own keys replace those of a merge (<<)."""
        if isinstance(node, yaml.MappingNode):
            seen: set[str] = set()
            for key, _ in node.value:
                if not isinstance(key, yaml.ScalarNode) or key.tag.endswith(":merge"):
                    continue
                if key.value in seen:
                    problem = f"the key {key.value[:40]!r} is given twice"
                    if key.value.strip().lstrip("+-").replace(".", "").isdigit():
                        problem += "; numbers of a list stand in [ ]"
                    raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)
                seen.add(key.value)
        found: dict[Hashable, Any] = super().construct_mapping(node, deep)
        return found


def _whole(loader: Any, node: yaml.ScalarNode) -> int:
    text = loader.construct_scalar(node)
    if len(text) > MOST_DIGITS:
        raise ValueError(text)
    return int(text, 0 if text[:2] in ("0o", "0x") else 10)


def _date(_: Any, node: Any) -> None:
    problem = f"{node.value[:40]!r} would be read as a date; put it in quotes"
    raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)


Loader.add_constructor(f"{_TAG}int", _whole)
Loader.add_constructor(f"{_TAG}timestamp", _date)


def load_yaml(text: str) -> Any:
    """The content of a YAML text.

    Args:
        text: one document.

    Returns:
        What it holds: dicts, lists, texts, numbers, truth values, None.

    Raises:
        yaml.YAMLError: it is no YAML, a value does not go with its tag, or it goes beyond what a case can hold; the
            problem with its place.
    """
    _check_size(text)
    try:
        return yaml.load(text, Loader=Loader)
    except RecursionError:
        raise yaml.YAMLError(f"nests deeper than {MOST_DEPTH} levels") from None


def _check_size(text: str) -> None:
    """Count what the document holds once its aliases are filled in."""
    sizes: dict[str, int] = {}  # of what an anchor stands for
    open_: list[tuple[str | None, int]] = []  # collections not yet closed: anchor, nodes before it
    count = 0
    events: Any = yaml.parse(text, Loader=_Base)
    for event in events:
        anchor, mark = getattr(event, "anchor", None), event.start_mark
        if isinstance(event, yaml.AliasEvent):
            if any(name == anchor for name, _ in open_):
                raise yaml.composer.ComposerError(None, None, f"*{anchor} refers to itself", mark)
            count += sizes.get(str(anchor), 1)
        elif isinstance(event, yaml.CollectionStartEvent):
            open_.append((anchor, count))
            count += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            name, before = open_.pop()
            if name is not None:
                sizes[name] = count - before
        elif isinstance(event, yaml.ScalarEvent):
            count += 1
            if anchor is not None:
                sizes[anchor] = 1
        if count > MOST_NODES:
            problem = f"holds more than {MOST_NODES} values with its aliases filled in"
            raise yaml.composer.ComposerError(None, None, problem, mark)
        if len(open_) > MOST_DEPTH:
            problem = f"nests deeper than {MOST_DEPTH} levels"
            raise yaml.composer.ComposerError(None, None, problem, mark)
