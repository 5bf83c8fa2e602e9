"""TRIGGERs: what is done at a point of the motion, as statements.

Use:

    trigger_statements("TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[3]=TRUE", where, None)     # passed over

When a trigger fires is not followed, so that what it does may not change how the arm moves. Arcs and layers are taken
at the point at which its motion starts or ends.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from ..program import EventKind, SourceLine
from .expressions import Cursor, Expression, arguments
from .inner_calls import called_in
from .lexing import quoted, refuse, tokens
from .setting import HARMLESS, OF_TABLE, OUTPUTS
from .statements import RecognisedEvent, Statement
from .values.evaluation import FloatingValue

PASSED = "triggers that are not a known event"
CALLS = "triggers whose sub-programs are not run"
_DONE = re.compile(r"\bDO\b\s*(.*?)\s*(?:\bPRIO\s*=[^;]*)?(;.*)?$", re.IGNORECASE)
# ArcTech's own distances, in its data, are not known: it is taken to be at its point
_COMPUTED = re.compile(r"\bPATH\s*=\s*ArcGetPath\b|\bDELAY\s*=(?!\s*[-+]?[\d.]+(\s|$))", re.IGNORECASE)
_PLACE_COMPUTED = re.compile(
    r"\bPATH\s*=(?!\s*ArcGetPath\b)(?!\s*[-+]?[\d.]+\s*(ONSTART|DELAY|DO|$))|\bDISTANCE\s*=(?!\s*[01]\s+(DELAY|DO)\b)",
    re.IGNORECASE,
)
_PLAIN_OUTPUT = re.compile(r"\$OUT(_C)?\s*\[\s*\d+\s*\]\s*=\s*(TRUE|FALSE)\s*(;|$)", re.IGNORECASE)
_WHEN = re.compile(r"\bWHEN\b|\bArcGet\w+\s*\(", re.IGNORECASE)
_NAME = re.compile(r"([A-Za-z_$][A-Za-z0-9_$]*)(?:\s*(?:\[[^\]]*\]|\.\s*\w+))*\s*(=|\()")


def done_by(line: str) -> str:
    """What a trigger does, with the comment behind it; empty where that is not said."""
    found = _DONE.search(line)
    return "" if found is None else found.group(1) + (f" {found.group(2)}" if found.group(2) else "")


def trigger_statements(text: str, where: SourceLine, event: RecognisedEvent | None) -> Iterator[Statement]:
    """What a trigger stands for, beside the event that it is.

    Args:
        text: of the statement, without its comment.
        where: it stands.
        event: it is, None where it is none.

    Yields:
        Statements.

    Raises:
        InputError: it says nothing to do.
    """
    number = where.number
    asked = called_in(_WHEN.sub("", text[: text.upper().find(" DO ")]))
    if asked:
        yield Statement("inner", number, asked)
    if event is not None and _PLACE_COMPUTED.search(text):
        yield Statement(
            "refused", number, f"a TRIGGER with a computed PATH or DISTANCE: {event.kind.value} is not followed"
        )
        return
    if event is not None:
        if event.kind in (EventKind.ARC_ON, EventKind.ARC_OFF):
            yield from _off_its_point(event, text, number)
        return
    found = _NAME.match(done_by(text))
    if found is None:
        raise refuse(where, f"TRIGGER with an unknown statement: {quoted(text)}")
    name, sign = found.group(1).upper(), found.group(2)
    inner = called_in(done_by(text)) if sign == "=" or name == "PULSE" else ()
    if inner:
        yield Statement("doubt", number, (CALLS, f"a TRIGGER calls {quoted(inner[0])}, which is not run"))
    if sign == "=" and name in OUTPUTS and _PLAIN_OUTPUT.match(done_by(text)) is None:
        yield Statement("switched", number)
    if name == "PULSE" or (sign == "=" and name in HARMLESS - OF_TABLE):
        yield Statement("pass", number, PASSED)
    elif sign == "(":
        yield Statement("triggered", number, (name, _arguments(done_by(text), where)))
    elif name.startswith("$"):
        yield Statement("refused", number, f"a TRIGGER sets {quoted(name)}: the time at which it does so is not known")
    else:
        unknown = FloatingValue(f"{quoted(name)} is set by the TRIGGER of line {number}")
        yield Statement("floats", number, (name, unknown))


def _arguments(text: str, where: SourceLine) -> tuple[Expression | None, ...]:
    cursor = Cursor(tokens(text.split(";", 1)[0], where), where)
    cursor.need_name("a sub-program")
    cursor.need("(")
    return arguments(cursor)


def _off_its_point(event: RecognisedEvent, text: str, number: int) -> Iterator[Statement]:
    """A trigger of the arc that does not fire at its point."""
    path, delay = (float(event.fields.get(name, 0.0)) for name in ("path_mm", "delay_ms"))
    word = event.kind.value
    if path:
        yield Statement("refused", number, f"a TRIGGER with PATH = {path:g} mm: {word} off a point is not followed")
    elif delay or _COMPUTED.search(text):
        when = f"DELAY = {delay:g} ms" if delay else "a computed PATH or DELAY"
        doubt = f"a TRIGGER with {when}: {word} is taken to be at its point"
        yield Statement("doubt", number, ("triggers off their point", doubt))
