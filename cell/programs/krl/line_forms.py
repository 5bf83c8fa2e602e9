"""The forms that a line of KRL can have, each as a statement.

Use:

    constant_move("LIN {X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0,E1 0.0} C_DIS")      # MotionStatement("LIN", ..)
    LineForms(()).statements("WAIT SEC 0.5", "WAIT SEC 0.5", where, events, False)   # [Statement("wait", ..)]
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Iterator

from ...errors import InputError
from ..program import SourceLine
from .events import EventReader
from .expressions import (
    Component,
    Constant,
    Cursor,
    Element,
    Expression,
    FunctionCall,
    Variable,
    arguments,
    expression,
)
from .inner_calls import called_in
from .lexing import quoted, refuse, tokens
from .statements import Declaration, MotionStatement, Statement
from .triggers import trigger_statements
from .values.evaluation import ImportedValue
from .values.value_types import structure

SPLINE_CIRCLES = frozenset(("SCIRC", "SCIRC_REL"))
CIRCLES = frozenset(("CIRC", "CIRC_REL")) | SPLINE_CIRCLES
LINES = frozenset(("LIN", "LIN_REL", "SLIN", "SLIN_REL", "SPL"))
MOTIONS = CIRCLES | LINES | {"PTP", "PTP_REL", "SPTP", "SPTP_REL"}
BLENDS = frozenset(("C_PTP", "C_DIS", "C_VEL", "C_ORI", "C_SPL"))
_TYPES = "INT REAL BOOL CHAR FRAME POS E6POS AXIS E6AXIS LOAD FDAT PDAT LDAT ADAT INERTIA EX_KIN ESYS"
TYPES = frozenset(_TYPES.split())
PASSED = {  # what moves nothing, by its first word
    "INTERRUPT": "interrupts",
    "EXT": "declarations of other modules",
    "EXTFCT": "declarations of other modules",
    "ENUM": "declarations of types",
    "SIGNAL": "declarations of signals",
    "CHANNEL": "declarations of signals",
    "PULSE": "outputs",
    "BRAKE": "BRAKE",
    "ANOUT": "analogue signals",
    "ANIN": "analogue signals",
    "DIGIN": "analogue signals",
    "CONST_VEL": "settings of splines",
    "ON_ERROR_PROCEED": "ON_ERROR_PROCEED",
    "CONFIRM": "CONFIRM",
}
EVALUATED = frozenset(("INTERRUPT", "PULSE", "ANOUT", "ANIN", "DIGIN", "CONST_VEL", "CONFIRM"))  # hold values
HARMLESS_LINES = "statements that the case calls harmless"
_STOPS = re.compile(r"\bDO\s+IR_STOPM\s*\(", re.IGNORECASE)  # the interrupt of the standard INI
FOREIGN_INTERRUPTS = "interrupts whose sub-programs are not run"
_MOVE = re.compile(r"(LIN|PTP|SLIN|SPTP|SPL)\s*\{([^{}\[\]\"';]*)\}\s*((?:C_[A-Z]+\s*){0,2})", re.IGNORECASE | re.ASCII)
_REAL = re.compile(r"[-+]?(?:\d{1,30}(?:\.\d{0,30})?|\.\d{1,30})(?:[eE][-+]?\d{1,3})?", re.ASCII)
_KINDS = ("FRAME", "POS", "E6POS", "AXIS", "E6AXIS")


def constant_move(line: str) -> MotionStatement | None:
    """A motion whose numbers stand in it, as nearly all lines are; None where the line is another."""
    match = _MOVE.fullmatch(line)
    if match is None:
        return None
    word, body, blends = match.groups()
    kind, colon, rest = body.partition(":")
    if colon:
        if kind.strip().upper() not in _KINDS:
            return None
        body = rest
    point: dict[str, float] = {}
    for piece in body.split(","):
        pair = piece.split()
        if len(pair) != 2 or _REAL.fullmatch(pair[1]) is None:
            return None
        name, value = sys.intern(pair[0].upper()), float(pair[1])
        if name in point or not math.isfinite(value):
            return None
        point[name] = value
    words = frozenset(blends.upper().split())
    return MotionStatement(word.upper(), (point,), words or _NONE) if words <= BLENDS else None


_NONE: frozenset[str] = frozenset()


class LineForms:
    """Lines as statements, given the patterns of what the case calls harmless."""

    def __init__(self, harmless: tuple[re.Pattern[str], ...]) -> None:
        self._harmless = harmless

    def statements(
        self,
        text: str,
        line: str,
        where: SourceLine,
        events: EventReader,
        *,
        spline: bool = False,
        of_hook: bool = False,
    ) -> Iterator[Statement]:
        """What a line that is no block stands for.

        Args:
            text: of the statement, without its comment.
            line: with it.
            where: it stands.
            events: to recognise arcs and layers.
            spline: whether it stands in a spline block.
            of_hook: whether it is a further line of a hook: what it calls may be missing.

        Yields:
            Statements; of kinds that move nothing ``pass``.

        Raises:
            InputError: it cannot be read.
        """
        word = re.split(r"[^A-Za-z0-9_$]", text, maxsplit=1)[0].upper()
        number = where.number
        if word in MOTIONS:
            events.close()
            yield Statement("move", number, _motion(word, Cursor(tokens(text, where), where), spline))
            return
        if word == "WAIT":
            yield from _inner(text[len(word) :] if _waits_for(text) else "", number)
        harmless = any(pattern.search(line) for pattern in self._harmless)
        if harmless and (word == "HALT" or (word == "WAIT" and _waits_for(text))):
            yield Statement("harmless_stop", number, HARMLESS_LINES)
            return
        if word in _SIMPLE:
            yield _SIMPLE[word](Cursor(tokens(text, where), where), number)
            return
        if word in ("DECL", "GLOBAL", "CONST", "STRUC") or (word in TYPES and _declares(text)):
            one = _declaration(text, where)
            if one.op == "structure":
                yield Statement("pass", number, "declarations of types")
            yield one
            return
        event = None if word == "INTERRUPT" or of_hook else events.of_statement(line, where)
        if event is not None:
            yield Statement("event", number, event)
        if event is None and harmless:
            yield Statement("pass", number, HARMLESS_LINES)
            yield from _forgotten(text, where)
            return
        if word == "TRIGGER":
            yield from trigger_statements(text, where, event)
            return
        if word == "TIME_BLOCK":
            yield Statement("refused", number, "TIME_BLOCK gives a spline block times, which are not followed")
            return
        if word in ("ANIN", "DIGIN") and re.match(r"\w+\s+ON\b", text, re.IGNORECASE):
            yield Statement("refused", number, f"{word} ON sets a variable over and over, which is not followed")
            return
        if word in PASSED:
            declared = word == "INTERRUPT" and " DECL " in text.upper()
            if word in EVALUATED and not declared:
                yield from _inner(text[len(word) :], number)
            if word == "SIGNAL":
                yield from _signal(text, where)
            if event is None:
                foreign = declared and not _STOPS.search(text)
                yield _foreign(number) if foreign else Statement("pass", number, PASSED[word])
            return
        yield from _call_or_assignment(text, where, of_hook or event is not None)

    def head(self, word: str, statement: str, where: SourceLine) -> object:
        """What the first line of a block says."""
        cursor = Cursor(tokens(statement, where), where)
        cursor.need(word)
        if word in ("LOOP", "REPEAT"):
            return None
        if word == "SPLINE":
            settings = _settings(cursor) if cursor.take("WITH") else ()
            cursor.need_end()
            return settings
        if word == "FOR":
            return _for(cursor)
        found = expression(cursor)
        if word == "IF":
            cursor.need("THEN")
        cursor.need_end()
        return found

    def labels(self, statement: str, where: SourceLine) -> tuple[Expression, ...]:
        """The values of a CASE."""
        cursor = Cursor(tokens(statement, where), where)
        cursor.need("CASE")
        found = [expression(cursor)]
        while cursor.take(","):
            found.append(expression(cursor))
        cursor.need_end()
        return tuple(found)

    def after_spline(self, statement: str, where: SourceLine) -> frozenset[str]:
        """How the end of a spline block is rounded."""
        cursor = Cursor(tokens(statement, where), where)
        cursor.need("ENDSPLINE")
        found = set()
        while (blend := cursor.take(*BLENDS)) is not None:
            found.add(blend)
        cursor.need_end()
        return frozenset(found)

    def until(self, statement: str, where: SourceLine) -> Expression:
        """The condition of UNTIL."""
        cursor = Cursor(tokens(statement, where), where)
        cursor.need("UNTIL")
        found = expression(cursor)
        cursor.need_end()
        return found


def _for(cursor: Cursor) -> tuple[str, Expression, Expression, Expression]:
    name = cursor.need_name("a variable")
    cursor.need("=")
    low = expression(cursor)
    cursor.need("TO")
    high = expression(cursor)
    step = expression(cursor) if cursor.take("STEP") else Constant(1)
    cursor.need_end()
    return name, low, high, step


def _settings(cursor: Cursor) -> tuple[tuple[Expression, Expression], ...]:
    """The assignments of WITH."""
    found = []
    while True:
        target = _target(cursor)
        cursor.need("=")
        found.append((target, expression(cursor)))
        if not cursor.take(","):
            return tuple(found)


def _target(cursor: Cursor) -> Expression:
    """What is assigned to: a variable with its indices and components."""
    found: Expression = Variable(cursor.need_name("a variable"))
    while cursor.token.text in ("[", ".") and cursor.token.kind == "op":
        if cursor.take("."):
            found = Component(found, cursor.need_name("a component"))
            continue
        cursor.need("[")
        indices = []
        while not cursor.take("]"):
            if not cursor.take(","):
                indices.append(expression(cursor))
        found = Element(found, tuple(indices))
    return found


def _motion(word: str, cursor: Cursor, spline: bool) -> MotionStatement:
    cursor.next()
    points = [expression(cursor)]
    if word in CIRCLES:
        cursor.need(",")
        points.append(expression(cursor))
    angle = None
    settings: tuple[tuple[Expression, Expression], ...] = ()
    blends, frame = set(), "#BASE"
    while not cursor.ended():
        if cursor.take(","):
            cursor.need("CA")
            angle = expression(cursor)
        elif cursor.take("CA"):
            angle = expression(cursor)
        elif cursor.take("WITH"):
            settings = _settings(cursor)
        elif (blend := cursor.take(*BLENDS)) is not None:
            blends.add(blend)
        elif cursor.token.kind == "enum" and cursor.token.text in ("#BASE", "#TOOL"):
            frame = cursor.next().text
        else:
            raise refuse(cursor.where, f"{word} is followed by the unknown word {quoted(cursor.token.text)}")
    return MotionStatement(word, tuple(points), frozenset(blends), frame, angle, settings, spline)


def _wait(cursor: Cursor, number: int) -> Statement:
    cursor.next()
    if cursor.take("SEC"):
        seconds = expression(cursor)
        cursor.need_end()
        return Statement("wait", number, seconds)
    cursor.need("FOR")
    return Statement("stop", number, "WAIT FOR")


def _exit(cursor: Cursor, number: int) -> Statement:
    cursor.next()
    cursor.need_end()
    return Statement("exit", number)


def _return(cursor: Cursor, number: int) -> Statement:
    cursor.next()
    return Statement("return", number, None if cursor.ended() else expression(cursor))


def _refused(text: str) -> Callable[[Cursor, int], Statement]:
    return lambda cursor, number: Statement("refused", number, text)


_SIMPLE: dict[str, Callable[[Cursor, int], Statement]] = {
    "WAIT": _wait,
    "IMPORT": lambda cursor, number: _imported(cursor, number),
    "EXIT": _exit,
    "RETURN": _return,
    "CONTINUE": lambda cursor, number: Statement("continue", number),
    "HALT": lambda cursor, number: Statement("stop", number, "HALT"),
    "GOTO": _refused("GOTO is not supported; use loops and conditions"),
    "RESUME": _refused("RESUME belongs to interrupts, which are not run"),
}


def _declares(text: str) -> bool:
    """Whether a line that starts with the name of a type declares: a name follows it."""
    return re.match(r"[A-Za-z0-9_$]+\s+[A-Za-z_$]", text) is not None


def _waits_for(text: str) -> bool:
    """Whether a WAIT waits for a condition, which is not followed."""
    return re.match(r"WAIT\s+FOR\b", text, re.IGNORECASE) is not None


def _inner(text: str, number: int) -> Iterator[Statement]:
    """Functions that a line calls which is not followed."""
    names = called_in(text)
    if names:
        yield Statement("inner", number, names)


_SIGNAL = re.compile(r"\bSIGNAL\s+(\w+)\s+\$OUT\s*\[\s*(\d+)\s*\]\s*(TO\b)?", re.IGNORECASE)


def _signal(text: str, where: SourceLine) -> Iterator[Statement]:
    """An output that is given a name."""
    found = _SIGNAL.search(text)
    if found is not None:
        place = None if found.group(3) else int(found.group(2))
        yield Statement("signal", where.number, {found.group(1).upper(): place})


def _forgotten(text: str, where: SourceLine) -> Iterator[Statement]:
    """Variables that a line sets, or gives to what it calls, which is not followed."""
    try:
        cursor = Cursor(tokens(text, where), where)
        target = _target(cursor)
        given = arguments(cursor) if cursor.take("(") else (target,) if cursor.take("=") else ()
    except InputError:
        return  # of a form of its own: no call and no assignment
    if given:
        yield Statement("forget", where.number, given)


def _imported(cursor: Cursor, number: int) -> Statement:
    """A variable that another file has."""
    cursor.next()
    name = cursor.need_name("a variable")
    if cursor.token.kind == "name" and cursor.token.text != "IS":
        name = cursor.need_name("a variable")
    imported = ImportedValue(f"{quoted(name)} is imported (IMPORT)")
    return Statement("declare", number, (Declaration("", name, False, (), Constant(imported)),))


def _foreign(number: int) -> Statement:
    """The declaration of an interrupt whose sub-program may move the arm."""
    return Statement("doubt", number, (FOREIGN_INTERRUPTS, "an interrupt is declared, whose sub-program is not run"))


def _declaration(text: str, where: SourceLine) -> Statement:
    cursor = Cursor(tokens(text, where), where)
    words = set()
    while (word := cursor.take("DECL", "GLOBAL", "CONST")) is not None:
        words.add(word)
    if cursor.token.text == "SIGNAL":
        return next(_signal(text, where), Statement("pass", where.number, PASSED["SIGNAL"]))
    if cursor.take("STRUC"):
        return Statement("structure", where.number, structure(cursor))
    if cursor.token.text in PASSED:
        foreign = cursor.token.text == "INTERRUPT" and not _STOPS.search(text)
        return _foreign(where.number) if foreign else Statement("pass", where.number, PASSED[cursor.token.text])
    kind = cursor.need_name("a type")
    found = []
    while True:
        name = cursor.need_name("a name")
        array, element = False, []
        if cursor.take("["):
            array = True
            while not cursor.take("]"):
                if not cursor.take(","):
                    element.append(expression(cursor))
        value = expression(cursor) if cursor.take("=") else None
        found.append(Declaration(kind, name, array, tuple(element), value, "GLOBAL" in words))
        if not cursor.take(","):
            break
    cursor.need_end()
    return Statement("declare", where.number, tuple(found))


def _call_or_assignment(text: str, where: SourceLine, known: bool) -> Iterator[Statement]:
    """A call or an assignment; ``known``: it is an event too, so that what it calls may be missing."""
    if re.fullmatch(r"[A-Za-z_$][A-Za-z0-9_$]*\s*:", text):
        yield Statement("pass", where.number, "labels")
        return
    cursor = Cursor(tokens(text, where), where)
    target = _target(cursor)
    if isinstance(target, Variable) and cursor.take("("):
        call = FunctionCall(target.name, arguments(cursor))
        if cursor.ended():
            yield Statement("call", where.number, (call, known))
            return
    elif cursor.take("="):
        value = expression(cursor)
        cursor.need_end()
        yield Statement("assign", where.number, (target, value))
        return
    raise refuse(where, f"is an unknown statement: {quoted(text)}")
