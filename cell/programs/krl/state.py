"""What the controller holds while a program runs, and the moves it has made.

Use:

    state = ControllerState(controller)
    state.tool, state.base                    # frames that hold now
    state.add(MoveKind.LINEAR, to, frozenset(), [0.0, 0.0], (0, 12))   # to a Destination, of file 0, line 12
    state.moves()                             # Moves

Metres and radians. Speeds are NaN until the program sets them.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..controller import Controller
from ..program import ANYWHERE, BaseFrame, Event, EventKind, MoveKind, Moves, ProgramWarning, SourceLine, ToolFrame
from .lexing import refuse

NAN = float("nan")
WIDTHS = {"pose": 6, "via": 6, "external": 2}
REALS = (
    *("arc_angle", "speed", "turn_speed", "acceleration", "axis_share", "axis_acceleration", "external_share"),
    "external_acceleration",
    *("blend", "blend_share", "axes_corner", "line_corner"),
)
WHOLE_COLUMNS = ("kind", "status", "turn", "tool", "base", "file", "line")


@dataclass
class Speeds:
    """What holds for the moves to come.

    Attributes:
        speed: of the TCP, m/s.
        turn_speeds: of the orientation, swivel and rotation, rad/s.
        acceleration: of the TCP, m/s^2.
        axis_share: of each axis, 0 to 1.
        axis_acceleration: likewise.
        external_share: of each external axis.
        external_acceleration: likewise.
        distance: $APO.CDIS, m.
        share: $APO.CVEL, 0 to 1.
        axes_share: $APO.CPTP, 0 to 1.
        advance: $ADVANCE.
        override: $OV_PRO, 0 to 1.
    """

    speed: float = NAN
    turn_speeds: dict[int, float] = field(default_factory=dict)
    acceleration: float = NAN
    axis_share: dict[int, float] = field(default_factory=dict)
    axis_acceleration: dict[int, float] = field(default_factory=dict)
    external_share: dict[int, float] = field(default_factory=dict)
    external_acceleration: dict[int, float] = field(default_factory=dict)
    distance: float = 0.003  # a real controller's DEF_APO_CDIS
    share: float = 1.0
    axes_share: float = 1.0
    advance: int = 3
    override: float = 1.0

    def copy(self) -> Speeds:
        """A copy that changes on its own."""
        return Speeds(
            self.speed,
            dict(self.turn_speeds),
            self.acceleration,
            dict(self.axis_share),
            dict(self.axis_acceleration),
            dict(self.external_share),
            dict(self.external_acceleration),
            self.distance,
            self.share,
            self.axes_share,
            self.advance,
            self.override,
        )


@dataclass
class Destination:
    """Where a move goes: as it is known when it is added.

    Attributes:
        joints: rad, all of them; None of a move to a pose.
        pose: X Y Z A B C, m and rad; None of a move to joints.
        via: of a circular move.
        angle: of a circular move, rad.
        status: S.
        turn: T.
        read: whether A B C of the pose were worked out: the controller may have others for the same orientation.
    """

    joints: list[float] | None = None
    pose: list[float] | None = None
    via: list[float] | None = None
    angle: float = NAN
    status: int = -1
    turn: int = -1
    read: bool = False


class ControllerState:
    """Frames, speeds, the position, and what has been made of them."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.speeds = Speeds()
        self.tool: ToolFrame | None = None
        self.base: BaseFrame | None = None
        # X Y Z A B C of both as the program gave them: other A B C can stand for the same orientation
        self.numbers: dict[str, dict[str, Any] | None] = {"$TOOL": None, "$BASE": None}
        self.joints: list[float] | None = None  # of the arm, None where they are not known
        self.pose: list[float] | None = None  # in the base and with the tool that hold, None where it is not known
        self.angles_read = False  # A B C of the pose were worked out, not given by the program
        self.external = [NAN, NAN]
        self.modes: dict[str, str] = {}  # of interpolation, where they have been set
        self.arc = False
        self.continues = False  # CONTINUE: the next stop of the advance run is none
        self.external_active: bool | None = None  # whether $ACT_EX_AX or BAS makes the table's axes count; None: unset
        self._burnt = 0  # moves when the arc went on
        self._stood = False  # it has waited since, for a time that is not known
        self._doubts: dict[str, list[int]] = {}  # first move and how many, by what it is
        self.events: list[Event] = []
        self.stands: list[int] = []  # moves before which it stands with the arc on, for a time that is not known
        self.tools: list[ToolFrame] = []
        self.bases: list[BaseFrame] = []
        self._waiting: list[Event] = []  # of the end of the next move
        self._tool, self._base = -1, -1
        self._known: dict[tuple[object, ...], int] = {}
        self._columns: dict[str, array[Any]] = {name: array("d") for name in ("joints", *WIDTHS, *REALS)}
        self._columns |= {name: array("q") for name in WHOLE_COLUMNS}

    def __len__(self) -> int:
        return len(self._columns["kind"])

    # -- frames --------------------------------------------------------------------------------------------------

    def set_tool(self, tool: ToolFrame | None) -> None:
        """Another tool: where the TCP is now is known no longer."""
        self.tool, self._tool, self.pose, self.numbers["$TOOL"] = tool, -1, None, None

    def set_base(self, base: BaseFrame | None) -> None:
        """Another base, likewise."""
        self.base, self._base, self.pose, self.numbers["$BASE"] = base, -1, None, None

    def _indices(self) -> tuple[int, int]:
        """The tool and the base that hold, among those that moves name."""
        if self._tool < 0 and self.tool is not None:
            key: tuple[object, ...] = ("tool", self.tool.number, self.tool.name, self.tool.T_flange_tcp.tobytes())
            self._tool = self._known.setdefault(key, len(self.tools))
            if self._tool == len(self.tools):
                self.tools.append(self.tool)
        if self._base < 0 and self.base is not None:
            base = self.base
            key = ("base", base.number, base.name, base.coupled, base.machine, base.T.tobytes())
            key += (None if base.root is None else base.root.tobytes(),)
            self._base = self._known.setdefault(key, len(self.bases))
            if self._base == len(self.bases):
                self.bases.append(base)
        return self._tool, self._base

    # -- moves ---------------------------------------------------------------------------------------------------

    def add(
        self, kind: MoveKind, to: Destination, blends: frozenset[str], external: list[float], where: tuple[int, int]
    ) -> None:
        """Add a move and go to its end.

        Args:
            kind: of it.
            to: where.
            blends: words of approximation.
            external: E1, E2 at its end, rad.
            where: file and line.
        """
        columns, speeds = self._columns, self.speeds
        if self._stood:
            self.stands.append(len(self))
            self._stood = False
        tool, base = self._indices()
        axes = kind == MoveKind.AXES
        distance, share = self._blend(axes, blends)
        columns["kind"].append(int(kind))
        columns["joints"].extend(to.joints or [NAN] * self.controller.axes)
        columns["pose"].extend(to.pose or [NAN] * 6)
        columns["via"].extend(to.via or [NAN] * 6)
        columns["external"].extend(external)
        values = (
            ("arc_angle", to.angle),
            ("status", to.status),
            ("turn", to.turn),
            ("tool", tool),
            ("base", base),
            ("speed", NAN if axes else speeds.speed * speeds.override),
            ("turn_speed", min(speeds.turn_speeds.values(), default=NAN)),
            ("acceleration", speeds.acceleration),
            ("axis_share", min(speeds.axis_share.values(), default=NAN) * speeds.override),
            ("axis_acceleration", min(speeds.axis_acceleration.values(), default=NAN)),
            ("external_acceleration", min(speeds.external_acceleration.values(), default=NAN)),
            ("external_share", min(speeds.external_share.values(), default=NAN) * speeds.override),
            ("blend", distance),
            ("blend_share", share),
            ("axes_corner", speeds.axes_share),
            ("line_corner", speeds.distance),
            ("file", where[0]),
            ("line", where[1]),
        )
        for name, value in values:
            columns[name].append(value)
        self.joints, self.pose, self.external, self.angles_read = to.joints, to.pose, list(external), to.read
        for event in self._waiting:
            self._happens(event.kind, event.fields, event.line, len(self))
        self._waiting = []

    def _blend(self, axes: bool, blends: frozenset[str]) -> tuple[float, float]:
        """Distance and share over which the corner at the end of a move is rounded."""
        speeds = self.speeds
        if not blends or speeds.advance == 0:
            return 0.0, 0.0
        distance = speeds.distance if "C_DIS" in blends else 0.0
        if axes and not blends <= {"C_PTP", "C_DIS"}:
            return ANYWHERE, 1.0
        if axes:
            return distance, speeds.axes_share if "C_PTP" in blends else 0.0
        if "C_DIS" in blends:
            return distance, 0.0
        if "C_VEL" in blends:
            return 0.0, speeds.share
        return ANYWHERE, 0.0  # C_ORI, C_SPL

    def held(self) -> Callable[[], None]:
        """What WITH may set for a while; called, it is set back."""
        speeds, tool, base = self.speeds.copy(), self.tool, self.base
        modes, numbers = self.modes.copy(), self.numbers.copy()

        def set_back() -> None:
            self.speeds, self.modes = speeds, modes
            if self.tool is not tool:
                self.set_tool(tool)
            if self.base is not base:
                self.set_base(base)
            self.numbers = numbers

        return set_back

    def round_last(self, blends: frozenset[str]) -> None:
        """The corner at the end of the move that was added last is rounded (ENDSPLINE C_SPL)."""
        if len(self):
            self._columns["blend"][-1], self._columns["blend_share"][-1] = self._blend(False, blends)

    def stop(self) -> None:
        """The advance run stops: the corner before it is not rounded, unless CONTINUE stands before."""
        kept, self.continues = self.continues, False
        if len(self) and not kept:
            self._columns["blend"][-1] = 0.0
            self._columns["blend_share"][-1] = 0.0

    def stand(self) -> None:
        """A stop for a time that is not known."""
        self.stop()
        self._stood = self.arc and len(self) > self._burnt

    # -- events --------------------------------------------------------------------------------------------------

    def wait(self, seconds: float, line: SourceLine) -> None:
        """A wait, at which the arm stands."""
        self.continues = False
        self.stop()
        self.events.append(Event(EventKind.WAIT, len(self), seconds=seconds, line=line))

    def happens(self, kind: EventKind, fields: dict[str, str | float], at: str, line: SourceLine) -> None:
        """An event now, or at the end of the move that follows."""
        if at == "end":
            self._waiting.append(Event(kind, len(self) + 1, fields=fields, line=line))
        else:
            self._happens(kind, fields, line, len(self))

    def _happens(self, kind: EventKind, fields: object, line: SourceLine | None, before: int) -> None:
        if kind in (EventKind.ARC_ON, EventKind.ARC_OFF):
            if self.arc == (kind == EventKind.ARC_ON) and not (self.arc and before > self._burnt):
                return  # it burns already, or does not: one of several lines that say so
            self.arc, self._stood, self._burnt = kind == EventKind.ARC_ON, False, before
        self.events.append(Event(kind, before, fields=fields, line=line))  # type: ignore[arg-type]

    def finish(self, where: SourceLine) -> None:
        """The program has ended."""
        if self._waiting:
            raise refuse(where, f"the trigger of {self._waiting[0].line} has no motion after it")

    def doubt(self, kind: str) -> None:
        """Note something that is no fault of the move that comes next, and may be a slip."""
        self._doubts.setdefault(kind, [len(self), 0])[1] += 1

    def doubts(self) -> tuple[ProgramWarning, ...]:
        """All of them."""
        last = max(len(self) - 1, 0)
        return tuple(ProgramWarning(kind, min(move, last), count) for kind, (move, count) in self._doubts.items())

    def moves(self) -> Moves:
        """All moves."""
        axes = self.controller.axes
        widths = {"joints": axes, **WIDTHS}
        columns: dict[str, Any] = {}
        for name, values in self._columns.items():
            column = np.array(values, dtype=np.int64 if name in WHOLE_COLUMNS else np.float64)
            columns[name] = column.reshape(-1, widths[name]) if name in widths else column
        return Moves(**columns)
