"""Statements of KRL as data.

Use:

    Statement("assign", 12, (Variable("I"), Constant(3)))

What ``value`` holds goes by ``op``: see ``Statement``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..program import EventKind
from .expressions import Component, Element, Expression, Variable

Point = Expression | dict[str, float]


@dataclass(frozen=True, slots=True)
class MotionStatement:
    """A motion as it is written.

    Attributes:
        word: PTP, LIN, CIRC, with S before it of the newer ones, and _REL behind it; SPL.
        points: where to, and of circles the auxiliary point before; numbers alone as a mapping.
        blends: C_PTP, C_DIS, ..
        frame: of relative motions: #BASE or #TOOL.
        angle: of circles, CA.
        settings: of WITH: what is assigned for this motion alone.
        spline: whether it stands in a spline block.
    """

    word: str
    points: tuple[Point, ...]
    blends: frozenset[str] = frozenset()
    frame: str = "#BASE"
    angle: Expression | None = None
    settings: tuple[tuple[Expression, Expression], ...] = ()
    spline: bool = False


@dataclass(frozen=True, slots=True)
class RecognisedEvent:
    """An event as it is recognised.

    Attributes:
        kind: what.
        fields: read from the line.
        at: now, or at the start or end of the motion that follows (TRIGGER).
    """

    kind: EventKind
    fields: dict[str, str | float]
    at: str = "now"


@dataclass(frozen=True, slots=True)
class Declaration:
    """A variable as it is declared.

    Attributes:
        kind: of the variable: REAL, FRAME, ..
        name: in capitals.
        array: whether it has indices.
        element: which of them the value is for, as lines of .dat files give it; empty: of the whole.
        value: its first, None where it has none.
        everywhere: whether all programs know it (GLOBAL).
    """

    kind: str
    name: str
    array: bool
    element: tuple[Expression, ...]
    value: Expression | None
    everywhere: bool = False


@dataclass(frozen=True, slots=True)
class Statement:
    """A statement.

    Attributes:
        op: move (MotionStatement), assign (target, value), call (FunctionCall, whether it may be missing), event
            (Happening), declare (Declarations), if (condition), for (variable, from, to, step), while, repeat
            (condition), loop, switch (value, cases), exit, return (value or None), wait (seconds), stop (a word that
            ends the advance run), harmless_stop (likewise, for no time that counts), inner (names of functions called
            in a line that is passed over), signal (outputs by name), forget (arguments that a line that is passed
            over may set), triggered (a sub-program and its arguments), switched (an output that is not known), floats
            (a variable that a trigger sets, and what to say of it), continue, spline (settings, blends), structure
            (name, types of its components), refused (a text), pass (a kind).
        line: from 1.
        value: see op.
        body: of blocks.
        other: of if: what ELSE holds.
    """

    op: str
    line: int
    value: Any = None
    body: tuple[Statement, ...] = ()
    other: tuple[Statement, ...] = ()


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a sub-program: its name, and whether it stands for the caller's variable (OUT)."""

    name: str
    out: bool


@dataclass(frozen=True, eq=False)
class ModulePart:
    """A sub-program or function, or the data of a .dat file.

    Attributes:
        name: in capitals.
        kind: DEF, DEFFCT or DEFDAT.
        line: where it starts.
        parameters: in order.
        body: its statements.
        everywhere: whether other files may call it by its name (GLOBAL).
        returns: type of what a function gives back.
    """

    name: str
    kind: str
    line: int
    parameters: tuple[Parameter, ...]
    body: tuple[Statement, ...]
    everywhere: bool = False
    returns: str | None = None


@dataclass(frozen=True, eq=False)
class ParsedFile:
    """A file.

    Attributes:
        path: of it.
        index: into the program's files.
        parts: by their names.
        passed: lines that were passed over, by kind.
    """

    path: Path
    index: int
    parts: dict[str, ModulePart]
    passed: dict[str, int] = field(default_factory=dict)

    @property
    def first(self) -> str:
        """The part that carries the file's name, or else its first."""
        stem = self.path.stem.upper()
        return stem if stem in self.parts else next(iter(self.parts), "")


def set_in(body: tuple[Statement, ...]) -> set[str]:
    """Names of variables of the program's own that statements set."""
    found: set[str] = set()
    for one in body:
        if one.op == "assign":
            target = one.value[0]
            while isinstance(target, (Component, Element)):
                target = target.of
            if isinstance(target, Variable) and not target.name.startswith("$"):
                found.add(target.name)
        found |= set_in(one.body) | set_in(one.other)
    return found
