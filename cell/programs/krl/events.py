"""Events in the lines of a program: arcs and layers, recognised by the patterns of the controller.

Use:

    reader = EventReader(controller)
    reader.of_comment(";process_on")          # RecognisedEvent(Happens.ARC_ON, {})

A hook of several lines is recognised by its first; the others, which the first expects, are taken with it.
"""

from __future__ import annotations

import re

from ..controller import Controller
from ..hooks import HookPattern
from .statements import RecognisedEvent
from .triggers import done_by

_DISTANCE = re.compile(r"\bDISTANCE\s*=\s*([01])\b", re.IGNORECASE)
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

    def of_comment(self, line: str) -> RecognisedEvent | None:
        """The event of a comment, None where it is none."""
        return self._found(line, "now")

    def of_statement(self, line: str) -> RecognisedEvent | None:
        """The event of a call, an assignment or a trigger with its comment, None where it is none."""
        if not re.match(r"\s*TRIGGER\b", line, re.IGNORECASE):
            return self._found(line, "now")
        distance, path, delay = _DISTANCE.search(line), _PATH.search(line), _DELAY.search(line)
        at = "start" if distance is not None and distance.group(1) == "0" else "end"
        found = self._found(line, at) or self._found(done_by(line), at)
        if found is not None:
            for name, match in (("path_mm", path), ("delay_ms", delay)):
                value = _plain(match.group(1)) if match is not None else None
                if value is not None and value != 0:
                    found.fields[name] = value
        return found

    def _found(self, line: str, at: str) -> RecognisedEvent | None:
        for pattern in self._patterns:
            fields = pattern.match(line)
            if fields is not None:
                found = RecognisedEvent(pattern.happens, fields, at)
                self._open = (pattern, 1, found) if len(pattern.lines) > 1 else None
                return found
        return None


def _plain(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None
