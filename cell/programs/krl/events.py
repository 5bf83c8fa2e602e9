"""Events in the lines of a program: arcs and layers, recognised by the patterns of the controller.

Use:

    reader = EventReader(controller)
    reader.of_comment(";process_on", where)   # RecognisedEvent(Happens.ARC_ON, {})

A hook of several lines is recognised by its first; the others, which the first expects, are taken with it.
"""

from __future__ import annotations

import re

from ..controller import Controller
from ..hooks import HookPattern
from ..program import SourceLine
from .lexing import refuse, without_comment
from .statements import RecognisedEvent
from .triggers import done_by

_DISTANCE = re.compile(r"\bDISTANCE\s*=\s*([01])\b", re.IGNORECASE)
_ONSTART = re.compile(r"\bONSTART\b", re.IGNORECASE)
_PATH = re.compile(r"\bPATH\s*=\s*([-+]?[\d.]+)", re.IGNORECASE)
_DELAY = re.compile(r"\bDELAY\s*=\s*([-+]?[\d.]+)", re.IGNORECASE)


class EventReader:
    """The patterns, and the lines of a hook that still have to come."""

    def __init__(self, controller: Controller) -> None:
        self._patterns = controller.patterns
        self._open: tuple[HookPattern, int, RecognisedEvent] | None = None

    def follows(self, line: str) -> bool:
        """Whether a line is the next one of a hook that has begun."""
        if self._open is None:
            return False
        pattern, place, happening = self._open
        fields = pattern.match(line, place)
        if fields is None:
            self._open = None
            return False
        happening.fields.update(fields)
        self._open = (pattern, place + 1, happening) if place + 1 < len(pattern.lines) else None
        return True

    def close(self) -> None:
        """No line that comes now belongs to a hook that has begun: the arm moves."""
        self._open = None

    def of_comment(self, line: str, where: SourceLine) -> RecognisedEvent | None:
        """The event of a comment, None where it is none.

        Raises:
            InputError: a pattern fits what may be a statement that has been made a comment.
        """
        return self._found(line, "now", where)

    def of_statement(self, line: str, where: SourceLine) -> RecognisedEvent | None:
        """The event of a call, an assignment or a trigger with its comment, None where it is none.

        Raises:
            InputError: as of a comment; or a pattern fits a text in quotation marks alone.
        """
        if not re.match(r"\s*TRIGGER\b", line, re.IGNORECASE):
            return self._found(line, "now", where)
        distance, path, delay = _DISTANCE.search(line), _PATH.search(line), _DELAY.search(line)
        at = "start" if _ONSTART.search(line) or (distance is not None and distance.group(1) == "0") else "end"
        found = self._found(line, at, where) or self._found(done_by(line), at, where)
        if found is not None:
            for name, match in (("path_mm", path), ("delay_ms", delay)):
                value = _plain(match.group(1)) if match is not None else None
                if value is not None and value != 0:
                    found.fields[name] = value
        return found

    def _found(self, line: str, at: str, where: SourceLine) -> RecognisedEvent | None:
        for pattern in self._patterns:
            fields = pattern.match(line)
            if fields is not None:
                _refuse_what_does_not_run(pattern, line, where)
                found = RecognisedEvent(pattern.happens, fields, at)
                self._open = (pattern, 1, found) if len(pattern.lines) > 1 else None
                return found
        return None


def _refuse_what_does_not_run(pattern: HookPattern, line: str, where: SourceLine) -> None:
    """Refuse a pattern that fits where nothing runs: in a statement made a comment, or in a text."""
    begins, comment = pattern.begins(line), len(without_comment(line)[0])
    if pattern.whole or begins == comment:
        return
    if begins > comment and re.search(r"[=(]", line[comment:]):
        what = "a comment that may be a statement: let the pattern begin with ; if it counts"
    elif begins < comment and line.count('"', 0, begins) % 2:
        what = "a text: let the pattern begin with the statement if it counts"
    else:
        return
    raise refuse(where, f"the pattern of {pattern.happens.value} fits {what}")


def _plain(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
