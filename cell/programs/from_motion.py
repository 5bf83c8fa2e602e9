"""The program of a checked motion: which moves a controller has to make so that it runs that motion.

    written = program_of_motion(job, motion, frames)
    written.program                           # cell.programs.program.Program
    written.row                               # (m,) the motion's row at which each move ends
    written.points, written.rows              # points, and of how many rows they were made

Beads are lines of the TCP in the part's frame on the table's flange. Ways between them are lines where the TCP goes
straight, and moves of all axes where those do: on both the controller's interpolation is what was checked. The first
move is one of axes to the motion's first row. Metres, radians, seconds.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from slicing import Code, Warning

from ..arrays import Ints
from ..case.sections import Case
from ..job.job import Job, speeds
from ..motion.deposition_speed import KEPT_SHARE
from ..motion.motion import NO_MOVE, Motion
from ..rigid import inverse
from ..scene.site_frames import T_flange_tcp
from ..units import METRES_PER_MM
from .cell_controller import ProgramFrames
from .cell_frames import tables_seen_from_base
from .orientation import pose_of
from .program import Event, EventKind, MoveKind, Moves, Program
from .running.external_axes import endless_axes
from .running.interpolation import angles_between, turned_shares

WINDOW_S = 2.0  # over which points are counted
LINE_BYTES = 100  # of a point's line
SPEED_STEP = 1e-5  # m/s: the digits of a speed
TRAVEL_STEP = 1e-4  # likewise of ways with the arc off
MOST_LINE_SPEED = 2.0  # m/s of a line: what a controller takes
FIRST_SHARE = 0.1  # of the axes' speed to the first point, from wherever the arm is
SAME_RETRACTION = 1e-6  # m, likewise of where the torch is drawn back to
JOINT_LINE = 1e-6  # rad that rows may be off the straight line of all axes
# of an endless axis, and of the TCP on a line, in a move: from 180 deg on it would go the other way
MOST_TURN = float(np.deg2rad(120.0))
WAIT = 1e-4  # s: rows at one place that last longer are a wait


@dataclass(frozen=True)
class PointThinning:
    """How far a program's way may be off the motion's rows for having fewer points.

    Attributes:
        chord: of the TCP, m.
        angle: of the TCP's orientation and of every axis, rad.
        corner: a bead that turns by more than this keeps the point, rad.
        turn: of the TCP on a line at most, rad.
    """

    chord: float
    angle: float
    corner: float = float(np.deg2rad(10.0))
    turn: float = MOST_TURN

    @classmethod
    def of(cls, case: Case) -> PointThinning:
        """What a case asks for, at most half of what its checks allow: a thinned bead is to pass them."""
        asked, checks = case.controller.thinning, case.checks
        chord = min(asked.chord_mm, checks.off_bead_mm / 2) * METRES_PER_MM
        return cls(chord, float(np.deg2rad(min(asked.angle_deg, checks.off_wire_deg / 2))))


@dataclass(frozen=True, eq=False)
class ProgramOfMotion:
    """What was made of a motion.

    Attributes:
        program: the program.
        row: row of the motion at which each move ends, (m,).
        rows: how many rows the motion has.
        thinning: what it was thinned by.
        points_a_second: most points that a second of welding takes, over ``WINDOW_S``.
        warnings: what a controller may not manage, typed.
    """

    program: Program
    row: Ints
    rows: int
    thinning: PointThinning
    points_a_second: float
    warnings: tuple[Warning, ...]

    @property
    def points(self) -> int:
        """Points of the program."""
        return len(self.row)


def program_of_motion(
    job: Job, motion: Motion, frames: ProgramFrames, thinning: PointThinning | None = None
) -> ProgramOfMotion:
    """Make a program of a motion.

    Args:
        job: the job of the motion.
        motion: the checked motion.
        frames: from ``cell.programs.cell_controller.frames_of``: the program's name, tool and base.
        thinning: left out: the case's.

    Returns:
        The program.
    """
    thinning = PointThinning.of(job.case) if thinning is None else thinning
    made = _Made(job, motion, thinning, frames)
    made.all()
    program = Program(frames.program, made.moves(), tuple(made.events), (frames.tool,), (frames.base,))
    row = np.array(made.row)
    most = _points_a_second(motion.t_s[row[made.in_bead()]])
    warnings = (*_size_warnings(job.case, len(row), most), *_cut_beads(job.case, made.events))
    return ProgramOfMotion(program, row, len(motion.t_s), thinning, most, warnings)


def _points_a_second(t: Floats) -> float:
    if not len(t):
        return 0.0
    count = np.searchsorted(t, t + WINDOW_S) - np.arange(len(t))
    return float(count.max() / WINDOW_S)


def _cut_beads(case: Case, events: Sequence[Event]) -> tuple[Warning, ...]:
    """What is said of beads that have more points than a module may have: their modules go on with the arc on."""
    on, off = ([e.before for e in events if e.kind == kind] for kind in (EventKind.ARC_ON, EventKind.ARC_OFF))
    most = max((b - a for a, b in zip(on, off, strict=False)), default=0)
    if most <= case.controller.points_a_module:
        return ()
    text = (
        f"program: a bead has {most} points and goes on in another module with the arc on; no bead is cut where "
        f"controller.points_a_module is at least {most} (now {case.controller.points_a_module})"
    )
    return (Warning(Code.PROGRAM_BEAD_CUT, text),)


def _size_warnings(case: Case, points: int, most: float) -> tuple[Warning, ...]:
    limits, found = case.controller, []
    if most > limits.points_a_second:
        text = f"program: up to {most:.1f} points a second inside beads; above {limits.points_a_second:g} "
        text += (
            "(controller.points_a_second) a controller may slow down; coarser sampling or wider thinning "
            "gives fewer points"
        )
        found.append(Warning(Code.PROGRAM_DENSE, text))
    needed = points * LINE_BYTES / 2**20
    if needed > limits.memory_mb:
        text = f"program: {points} points take about {needed:.1f} MB; the controller has {limits.memory_mb:g} MB for "
        found.append(Warning(Code.PROGRAM_MEMORY, f"{text}programs (controller.memory_mb)"))
    return tuple(found)


@dataclass(eq=False)
class _Made:
    """A program while it is made; rows of the motion in, moves and events out."""

    job: Job
    motion: Motion
    thinning: PointThinning
    frames: ProgramFrames
    events: list[Event] = field(default_factory=list)
    row: list[int] = field(default_factory=list)
    kind: list[int] = field(default_factory=list)
    speed: list[float] = field(default_factory=list)
    share: list[float] = field(default_factory=list)
    blend: list[float] = field(default_factory=list)

    def __post_init__(self) -> None:
        motion, scene = self.motion, self.job.scene
        tables = tables_seen_from_base(scene, motion.table)
        to_tool = inverse(T_flange_tcp(scene)) @ self.frames.tool.T_flange_tcp
        base = self.frames.base
        self.T = inverse(tables @ base.T if base.coupled else base.T) @ scene.chain.forward(motion.q) @ to_tool
        self.axes = np.concatenate([motion.q, motion.table], axis=1)
        self.dt = np.diff(motion.t_s)
        self.still = np.abs(np.diff(self.axes, axis=0)).max(axis=1) <= NO_MOVE
        self.tcp_speed = np.linalg.norm(np.diff(self.T[:, :3, 3], axis=0), axis=1) / self.dt
        limit = np.where(np.isfinite(self.job.drives.speed), self.job.drives.speed, np.inf)
        self.axis_use = (np.abs(np.diff(self.axes, axis=0)) / self.dt[:, None] / limit).max(axis=1)
        self.bead_speed = self._bead_speeds()
        own = self.job.case.controller.blend_mm
        self.blend_mm = self.job.case.process.blend_mm if own is None else own
        if not self.job.case.controller.advance:  # without an advance run no corner is rounded
            self.blend_mm = 0.0

    def _bead_speeds(self) -> Floats:
        """Speed that each step is written with inside a bead, (m - 1,), m/s.

        The deposition speed of its target; where the motion is slowed down, what it reaches there.
        """
        asked = speeds(self.job)[self.motion.target[:-1]]
        out = asked.copy()
        weld = np.flatnonzero(self.motion.welding & ~self.still)
        if len(weld):
            edge = np.concatenate([[True], (np.diff(self.motion.target[weld]) != 0) | (np.diff(weld) > 1)])
            first = np.flatnonzero(edge)
            reached = np.maximum.reduceat(self.tcp_speed[weld], first)
            slow = reached < KEPT_SHARE * asked[weld[first]]
            out[weld] = np.repeat(np.where(slow, reached, asked[weld[first]]), np.diff([*first, len(weld)]))
        return np.maximum(np.round(out / SPEED_STEP), 1) * SPEED_STEP

    def all(self) -> None:
        """Everything, in order."""
        self._move(0, MoveKind.AXES, share=min(FIRST_SHARE, whole_percent(self.job.case.controller.axis_speed_percent)))
        arc = self.motion.arc
        at, layer = 0, None
        if not arc[0]:
            at = self._until(np.flatnonzero(arc)[0] if arc.any() else len(arc) - 1, 0, first_layer=True)
        while at < len(arc) - 1 or (arc[at] and layer is None):
            if not arc[at]:
                at = self._until(self._next_arc(at), at)
                continue
            layer = int(self.motion.layer[at])
            at = self._bead(at)
            if at >= len(arc) - 1:
                break
            at = self._until(self._next_arc(at + 1), at)

    def _next_arc(self, at: int) -> int:
        """The next row with the arc on, or the last."""
        found = np.flatnonzero(self.motion.arc[at:])
        return at + int(found[0]) if len(found) else len(self.motion.arc) - 1

    def _fields(self, row: int) -> dict[str, str | float]:
        t, i = self.job.targets, int(self.motion.target[row])
        return {
            "bead": int(self.motion.called[0][row]),
            "layer": int(self.motion.layer[row]),
            "sub_volume": t.sub_volume[t.sub_volume_index[i]],
            "target": int(self.motion.called[1][row]),
        }

    def _event(self, kind: EventKind, row: int, seconds: float = 0.0, **more: float) -> None:
        fields = {} if kind == EventKind.WAIT else {**self._fields(row), **more}
        self.events.append(Event(kind, len(self.row), seconds, fields))

    def _move(
        self, row: int, kind: MoveKind, *, speed: float = np.nan, share: float = np.nan, blend: float = 0.0
    ) -> None:
        self.row.append(row)
        self.kind.append(kind)
        self.speed.append(speed)
        self.share.append(share)
        self.blend.append(blend)

    def _until(self, end: int, at: int, *, first_layer: bool = False) -> int:
        """A way with the arc off from row ``at`` to row ``end``."""
        leads_to_bead = bool(self.motion.arc[end])
        new = leads_to_bead and (first_layer or self._other_layer(at, end))
        if new:
            if not first_layer:
                self._event(EventKind.LAYER_END, at)
            self._event(EventKind.LAYER_START, end)
        elif not leads_to_bead and self.motion.arc[at]:
            self._event(EventKind.LAYER_END, at)
        begin = at
        near = self._near_a_bead(at, end)
        waits = np.flatnonzero(self.still[at:end]) + at
        for w in [*waits.tolist(), end]:
            turns = begin + 1 + np.flatnonzero(np.diff(near[begin - at : w - at]))
            for stop in [*turns.tolist(), w]:
                self._travel(begin, stop, slow=begin < stop and bool(near[begin - at]))
                begin = stop
            if w < end and self.dt[w] > WAIT:
                self._event(EventKind.WAIT, w, float(self.dt[w]))
            begin = w + 1
        return end

    def _near_a_bead(self, at: int, end: int) -> NDArray[np.bool_]:
        """Which steps of a way with the arc off leave or approach a bead within the retraction, (end - at,).

        There the checked motion is held to the speed of travels; farther off the axes alone limit it.
        """
        p = self.T[at : end + 1, :3, 3]
        near = self.job.case.process.retract_mm * METRES_PER_MM + SAME_RETRACTION
        leaving = np.logical_and.accumulate(np.linalg.norm(p[1:] - p[0], axis=1) <= near)
        arriving = np.logical_and.accumulate(np.linalg.norm(p[:-1] - p[-1], axis=1)[::-1] <= near)[::-1]
        out: NDArray[np.bool_] = (leaving & bool(self.motion.arc[at])) | (arriving & bool(self.motion.arc[end]))
        return out

    def _other_layer(self, at: int, end: int) -> bool:
        t, a, b = self.job.targets, int(self.motion.target[at]), int(self.motion.target[end])
        return bool(t.layer[a] != t.layer[b] or t.sub_volume_index[a] != t.sub_volume_index[b])

    def _travel(self, first: int, last: int, *, slow: bool) -> None:
        """A way without a stop; ``slow`` where the speed of travels near a bead holds."""
        at = first
        while at < last:
            straight = _farthest(self._on_line, at, last)
            joint = _farthest(self._on_axes, at, last)
            steps = slice(at, max(straight, joint))
            if straight > joint or (straight == joint and straight > at + 1):
                speed = min(float(self.tcp_speed[steps].max()), MOST_LINE_SPEED)
                self._move(straight, MoveKind.LINEAR, speed=max(round(speed / TRAVEL_STEP), 1) * TRAVEL_STEP)
                at = straight
            else:
                self._move(joint, MoveKind.AXES, share=self._axis_share(slice(at, joint), slow=slow))
                at = joint

    def _bead(self, first: int) -> int:
        """A bead from its first row with the arc on; the last such row."""
        arc, bead = self.motion.arc, self.motion.bead
        others = np.flatnonzero((arc[first:] != 1) | (bead[first:] != bead[first]))
        last = first + int(others[0]) - 1 if len(others) else len(arc) - 1
        self._event(EventKind.ARC_ON, first, speed_mm_s=float(self.bead_speed[first]) / METRES_PER_MM)
        kept = self._kept(first, last)
        at = first
        for stop in kept:
            if self.still[at] and stop == at + 1:
                if self.dt[at] > WAIT:
                    self._event(EventKind.WAIT, at, float(self.dt[at]))
                at = stop
                continue
            while at < stop:
                to = _farthest(self._on_line, at, stop)
                done = bool(self.still[to:last].all())  # nothing but a wait comes after
                blend = 0.0 if done else self.blend_mm * METRES_PER_MM
                self._move(to, MoveKind.LINEAR, speed=float(self.bead_speed[at]), blend=blend)
                at = to
        self._event(EventKind.ARC_OFF, last)
        return last

    def _kept(self, first: int, last: int) -> list[int]:
        """Rows of a bead at which a point has to stand: waits, changes of speed, corners, the end."""
        rows = np.arange(first, last)
        still = self.still[rows]
        speed = self.bead_speed[rows]
        way = np.diff(self.T[first : last + 1, :3, 3], axis=0)
        size = np.linalg.norm(way, axis=1)
        unit = way / np.maximum(size, NO_MOVE)[:, None]
        turn = np.arccos(np.clip((unit[1:] * unit[:-1]).sum(axis=1), -1, 1))
        corner = (turn > self.thinning.corner) & (size[1:] > 1e-6) & (size[:-1] > 1e-6)
        change = (np.abs(np.diff(speed)) > SPEED_STEP / 2) | (still[1:] != still[:-1]) | corner | still[1:]
        return [*(first + 1 + np.flatnonzero(change)).tolist(), last]

    def _axis_share(self, steps: slice, *, slow: bool) -> float:
        """The share of their speed that the axes have on a move, in whole percent."""
        use, most = self.axis_use[steps], whole_percent(self.job.case.controller.axis_speed_percent)
        percent = np.ceil(use.max() * 100 - 1e-6)
        if slow:
            limit = self.job.case.process.travel_speed_mm_s * METRES_PER_MM
            fastest = (self.tcp_speed[steps] / np.maximum(use, NO_MOVE)).max()  # m/s, at full speed of the axes
            percent = min(percent, np.floor(limit / max(fastest, NO_MOVE) * 100 + 1e-6))
        return float(np.clip(percent / 100, 0.01, most))

    def _on_line(self, a: int, b: int) -> bool:
        """Whether the rows between two lie on the line of the TCP from one to the other."""
        inner = slice(a + 1, b)
        p, start, end = self.T[inner, :3, 3], self.T[a], self.T[b]
        way = end[:3, 3] - start[:3, 3]
        length = float(way @ way)
        if length < NO_MOVE**2:
            return False
        share = np.clip((p - start[:3, 3]) @ way / length, 0.0, 1.0)
        if (np.diff(share) < 0).any():
            return False
        limits, table = self.thinning, self.motion.table
        if self._turns_too_far(a, b) or angles_between(start[:3, :3], end[:3, :3]) > limits.turn:
            return False
        if (np.linalg.norm(p - start[:3, 3] - share[:, None] * way, axis=1) > limits.chord).any():
            return False
        external = np.abs(table[a] + share[:, None] * (table[b] - table[a]) - table[inner])
        R = turned_shares(start[:3, :3], end[:3, :3], share)
        return bool(
            (external <= limits.angle).all() and (angles_between(R, self.T[inner, :3, :3]) <= limits.angle).all()
        )

    def _on_axes(self, a: int, b: int) -> bool:
        """Whether the rows between two lie on the straight line of all axes from one to the other."""
        inner = self.axes[a + 1 : b]
        way = self.axes[b] - self.axes[a]
        length = float(way @ way)
        if length < NO_MOVE**2:
            return False
        share = np.clip((inner - self.axes[a]) @ way / length, 0.0, 1.0)
        if self._turns_too_far(a, b):
            return False
        off = np.abs(self.axes[a] + share[:, None] * way - inner).max(axis=1)
        return bool((off <= JOINT_LINE).all() and (np.diff(share) >= 0).all())

    def in_bead(self) -> list[int]:
        """Moves that end with the arc on."""
        return [k for k, row in enumerate(self.row) if self.motion.arc[row] and self.kind[k] == MoveKind.LINEAR]

    def moves(self) -> Moves:
        """As columns."""
        row, kind = np.array(self.row), np.array(self.kind, dtype=np.int64)
        m, section = len(row), self.job.case.controller
        linear = kind == MoveKind.LINEAR
        joints = np.where(linear[:, None], np.nan, self.motion.q[row])
        pose = np.full((m, 6), np.nan)
        pose[linear] = pose_of(self.T[row[linear]])
        return replace(
            Moves.empty(m, self.motion.q.shape[1]),
            kind=kind,
            joints=joints,
            pose=pose,
            # an axis that the positioner has not is none of the controller's either
            external=np.where(self.job.scene.has_axis, self.motion.table[row], np.nan),
            tool=np.zeros(m, dtype=np.int64),
            base=np.zeros(m, dtype=np.int64),
            speed=np.array(self.speed),
            turn_speed=np.where(linear, np.deg2rad(section.turn_speed_deg_s), np.nan),
            acceleration=np.where(linear, section.acceleration_mm_s2 * METRES_PER_MM, np.nan),
            axis_share=np.array(self.share),
            axis_acceleration=np.where(linear, np.nan, whole_percent(section.axis_acceleration_percent)),
            external_share=np.full(m, whole_percent(section.external_speed_percent)),
            blend=np.array(self.blend),
        )

    def _turns_too_far(self, a: int, b: int) -> bool:
        """Whether an endless axis turns so far from one row to another that a controller may go the other way."""
        turn = np.abs(self.motion.table[b] - self.motion.table[a])
        return bool((turn[endless_axes(self.job.scene)] > MOST_TURN).any())


def whole_percent(percent: float) -> float:
    """A share of the axes' speed or acceleration as a controller holds it: whole percents, at least one."""
    return max(math.floor(percent + 1e-9), 1) / 100


def _farthest(fits: Callable[[int, int], bool], first: int, last: int) -> int:
    """The farthest row that a move from ``first`` can end at, doubling and halving; at least the next."""
    good, step = first + 1, 1
    bad = last + 1
    while good < last:
        to = min(good + step, last)
        if not fits(first, to):
            bad = to
            break
        good, step = to, 2 * step
    while bad - good > 1:
        middle = (good + bad) // 2
        if fits(first, middle):
            good = middle
        else:
            bad = middle
    return good
