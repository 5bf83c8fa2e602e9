"""A robot program as data: moves, frames, speeds and events, in the order in which they run. No syntax stands here.

Writers and readers of a controller's language meet in this form, never in text::

    program.moves.kind                  # (m,) of MoveKind
    program.moves.pose[i]               # X Y Z in m and A B C in rad, in the base that holds
    program.events                      # arc on and off, layers, waits: each before a numbered move

Sub-programs are called and loops are run already: a program is one list. Frames: ``base`` is the arm's base ($ROBROOT);
a coupled base stands on the table's flange and moves with it. A B C are KUKA's: R = Rz(A) Ry(B) Rx(C). Metres, radians,
seconds.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum, StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints

ANYWHERE = 1.0  # m: a corner that is rounded anywhere within the moves at it, of which half at most is taken


class MoveKind(IntEnum):
    """How a move gets to its end."""

    AXES = 0  # all axes together, each at its own speed, arriving at one time (PTP)
    LINEAR = 1  # the TCP on a straight line in the base (LIN)
    CIRCULAR = 2  # the TCP on an arc of a circle in the base (CIRC)


class EventKind(StrEnum):
    """What an event is."""

    ARC_ON = "arc_on"
    ARC_OFF = "arc_off"
    LAYER_START = "layer_start"
    LAYER_END = "layer_end"
    WAIT = "wait"


@dataclass(frozen=True)
class SourceLine:
    """A line of a program's text.

    Attributes:
        file: its name.
        number: from 1.
    """

    file: str
    number: int

    def __str__(self) -> str:
        """As messages name it."""
        return f"{self.file}:{self.number}"


@dataclass(frozen=True)
class Event:
    """Something that happens where the move before it ends.

    Attributes:
        kind: what.
        before: number of the move that follows it; as many as there are moves at the end.
        seconds: of a wait.
        fields: what a hook was written with or read from: numbers of bead, layer, target, names.
            Of triggers also delay_ms and path_mm.
        line: where it stands, None where the program is not read from text.
    """

    kind: EventKind
    before: int
    seconds: float = 0.0
    fields: Mapping[str, str | float] = field(default_factory=dict)
    line: SourceLine | None = None


@dataclass(frozen=True, eq=False)
class ToolFrame:
    """A tool frame.

    Attributes:
        T_flange_tcp: (4, 4), m.
        number: in the controller's list, None where it is given literally.
        name: in the controller's list, empty where it has none.
    """

    T_flange_tcp: Floats
    number: int | None = None
    name: str = ""


@dataclass(frozen=True, eq=False)
class BaseFrame:
    """A base frame.

    Attributes:
        T: (4, 4), m: in the table's flange where it is coupled, else in the world frame of the controller.
        coupled: whether it moves with the external kinematic.
        number: in the controller's list, None where it is given literally.
        machine: index of MACHINE_DEF that it is coupled to, None where it is not.
        name: in the controller's list, empty where it has none.
        root: (4, 4), m: where the external kinematic stands in the controller's world, None where that is not known.
    """

    T: Floats
    coupled: bool
    number: int | None = None
    machine: int | None = None
    name: str = ""
    root: Floats | None = None


@dataclass(frozen=True, eq=False)
class Moves:
    """Moves, one a row.

    A move of axes to a pose (PTP to X Y Z A B C) has NaN joints and a pose; what its joints are depends on the arm.

    Attributes:
        kind: of ``MoveKind``, (m,).
        joints: the arm's axes, (m, j), rad; NaN of a move to a pose.
        pose: X Y Z A B C of the TCP in the base, (m, 6), m and rad; NaN of a move to joints.
        via: auxiliary point of a circular move, (m, 6), m and rad; NaN of all others. Where it has no A B C they are
            NaN: the controller takes none of them.
        arc_angle: signed angle of the circle that a circular move covers (CA), (m,), rad; NaN where it ends at its
            pose.
        external: E1, E2, (m, 2), rad; NaN of an axis that has never been given.
        status: of a move of axes to a pose (S), (m,); -1 where it is not given: the configuration stays.
        turn: of a move of axes to a pose (T), (m,); -1 where it is not given.
        tool: index into the program's tools, (m,); -1 where none holds.
        base: index into its bases, (m,); -1 where none holds.
        speed: of the TCP in the base of Cartesian moves, (m,), m/s; NaN of moves of axes and where it is never set.
        turn_speed: of the tool's orientation, the lower of its two, (m,), rad/s; NaN where it is not set.
        acceleration: of the TCP, (m,), m/s^2; NaN where it is not set.
        axis_share: of its full speed that every axis may use, (m,), 0 to 1; NaN where it is not set.
        axis_acceleration: share of its full acceleration that every axis may use, (m,); NaN where it is not set.
        external_acceleration: share of its full acceleration that every external axis may use, (m,); NaN likewise.
        external_share: of its full speed that every external axis may use, (m,); NaN where it is not set.
        blend: distance from the end at which the corner may be rounded, (m,), m; 0 stops exactly.
        blend_share: of a Cartesian move: of the speed at which the corner may be rounded (C_VEL); of a move of axes:
            of the way of the leading axis (C_PTP); (m,), 0 to 1; 0 where it may not.
        axes_corner: $APO.CPTP as it holds where the move stands, (m,), 0 to 1; NaN where it is not known. The corner
            before a move of axes may reach into it over that share of half its way.
        line_corner: $APO.CDIS likewise, (m,), m. A corner of C_PTP alone may reach so far into a line.
        file: index into the program's files, (m,); -1 where the program is not read from text.
        line: from 1, (m,); 0 where it is not read from text.
    """

    kind: Ints
    joints: Floats
    pose: Floats
    via: Floats
    arc_angle: Floats
    external: Floats
    status: Ints
    turn: Ints
    tool: Ints
    base: Ints
    speed: Floats
    turn_speed: Floats
    acceleration: Floats
    axis_share: Floats
    axis_acceleration: Floats
    external_acceleration: Floats
    external_share: Floats
    blend: Floats
    blend_share: Floats
    axes_corner: Floats
    line_corner: Floats
    file: Ints
    line: Ints

    @classmethod
    def empty(cls, n: int, axes: int = 6) -> Moves:
        """Rows to be filled in: every number NaN, no tool, no base, no line, exact stops, linear.

        Args:
            n: how many.
            axes: of the arm.

        Returns:
            The moves; ``dataclasses.replace`` puts columns in.
        """
        nan, none = np.full(n, np.nan), np.full(n, -1, dtype=np.int64)
        shapes = {"joints": axes, "pose": 6, "via": 6, "external": 2}
        columns: dict[str, Any] = {name: np.full((n, width), np.nan) for name, width in shapes.items()}
        columns |= {name: none.copy() for name in ("status", "turn", "tool", "base", "file")}
        columns |= {name: nan.copy() for name in ("arc_angle", "speed", "turn_speed", "acceleration", "axis_share")}
        columns |= {name: nan.copy() for name in ("axis_acceleration", "external_share", "external_acceleration")}
        columns |= {name: nan.copy() for name in ("axes_corner", "line_corner")}
        columns |= {name: np.zeros(n) for name in ("blend", "blend_share")}
        kind = np.full(n, int(MoveKind.LINEAR), dtype=np.int64)
        return cls(kind=kind, line=np.zeros(n, dtype=np.int64), **columns)

    @property
    def table_axes(self) -> NDArray[np.bool_]:
        """Which of the table's axes the program moves, (2,)."""
        return np.asarray(np.isfinite(self.external).any(axis=0))

    def __len__(self) -> int:
        return len(self.kind)


@dataclass(frozen=True)
class ProgramWarning:
    """Something that is no fault, and may be a slip.

    Attributes:
        kind: what, in words.
        move: the first that it is so of.
        count: of how many.
    """

    kind: str
    move: int
    count: int


@dataclass(frozen=True, eq=False)
class Program:
    """A program.

    Attributes:
        name: of its main module.
        moves: in the order in which they run.
        events: in the order in which they happen.
        tools: that moves name.
        bases: that moves name.
        files: names of the files read.
        passed_over: how often each kind of statement stood there that moves nothing and was passed over.
        doubts: what a reader finds and does not refuse.
        stands: moves before which the arm stands with the arc on, inside a bead, for a time that is not known.
    """

    name: str
    moves: Moves
    events: tuple[Event, ...]
    tools: tuple[ToolFrame, ...]
    bases: tuple[BaseFrame, ...]
    files: tuple[str, ...] = ()
    passed_over: Mapping[str, int] = field(default_factory=dict)
    doubts: tuple[ProgramWarning, ...] = ()
    stands: tuple[int, ...] = ()

    def line_of(self, move: int) -> SourceLine | None:
        """Where a move stands, None where the program is not read from text."""
        if self.moves.file[move] < 0:
            return None
        return SourceLine(self.files[int(self.moves.file[move])], int(self.moves.line[move]))
