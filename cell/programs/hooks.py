"""Hooks: lines of a program where the arc and the layers start and end, written from templates and recognised again.

Use:

    hook_lines(["ARC_ON ( ) ;bead {bead}"], {"bead": 3.0})       # ["ARC_ON ( ) ;bead 3"]
    hook_patterns(Happens.ARC_ON, ["ARC_ON ( ) ;bead {bead}"])   # that line is an arc on, with its bead

The fields are those of the case's ``controller.hooks``; a template with another is refused where the case is read.
"""

from __future__ import annotations

import re
import string
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from ..case.controller_section import HOOK_FIELDS, TEXT_FIELDS
from .program import EventKind

_NUMBER = r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?"


@dataclass(frozen=True)
class HookPattern:
    """How an event is recognised.

    Attributes:
        happens: what it is.
        lines: the lines it is written in, the first of which tells it; the others follow it and move nothing.
        whole: whether a line has to be the pattern from its beginning to its end.
    """

    happens: EventKind
    lines: tuple[re.Pattern[str], ...]
    whole: bool = False

    def match(self, text: str, line: int = 0) -> dict[str, str | float] | None:
        """The fields of a line that has the pattern, None where it has not."""
        found = self.lines[line].fullmatch(text) if self.whole else self.lines[line].search(text)
        if found is None:
            return None
        return {name: _value(name, value) for name, value in found.groupdict().items() if value is not None}

    def begins(self, text: str) -> int:
        """Where in a line the pattern begins that it has."""
        found = self.lines[0].search(text)
        return 0 if found is None else found.start()


def hook_lines(templates: Sequence[str], fields: Mapping[str, str | float]) -> list[str]:
    """The lines of a hook.

    Args:
        templates: with fields.
        fields: their values; what is missing is -1 or a dash.

    Returns:
        ASCII lines.
    """
    empty: dict[str, str | float] = {name: "-" if name in TEXT_FIELDS else -1.0 for name in HOOK_FIELDS}
    values = {name: _shown(value) for name, value in (empty | dict(fields)).items()}
    return [template.format_map(values) for template in templates]


def hook_patterns(happens: EventKind, templates: Sequence[str]) -> list[HookPattern]:
    """How the lines of a hook are recognised.

    Args:
        happens: what the hook is of.
        templates: its lines; none: it is not written, and cannot be recognised.

    Returns:
        One pattern, or none.
    """
    if not templates:
        return []
    return [HookPattern(happens, tuple(map(_pattern_of, templates)), whole=True)]


def _pattern_of(template: str) -> re.Pattern[str]:
    seen: set[str] = set()
    pieces = []
    for text, name, _, _ in string.Formatter().parse(template.strip()):
        pieces.append(re.escape(text))
        if name is None:
            continue
        kind = r"[A-Za-z0-9_.\-]+" if name in TEXT_FIELDS else rf"\s*{_NUMBER}"
        pieces.append(f"(?P={name})" if name in seen else f"(?P<{name}>{kind})")
        seen.add(name)
    return re.compile("".join(pieces), re.IGNORECASE)


def _shown(value: str | float) -> str | float | int:
    """A value as a template takes it: whole numbers without decimals, texts of letters, digits, _, dots and dashes."""
    if isinstance(value, str):
        return re.sub(r"[^A-Za-z0-9_.\-]", "_", value) or "-"
    return int(value) if float(value).is_integer() and abs(value) < 1e15 else _Real(value)


class _Real(float):
    """A number that is written with seven digits where the template does not say."""

    def __format__(self, spec: str) -> str:
        if spec.endswith("d"):
            return format(round(self), spec)
        return format(float(self), spec or ".7g")


def _value(name: str, text: str) -> str | float:
    if name in TEXT_FIELDS:
        return text
    try:
        return float(text)
    except ValueError:
        return text
