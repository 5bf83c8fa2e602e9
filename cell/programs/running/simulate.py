"""A program run as the controller would: a motion, each row with the move that it is on.

    run = run_program(program, job)
    run.motion, run.move                      # cell.motion.motion.Motion, (m,) number of the move
    run.line(row)                             # where that stands in the program's text

Assumed of the controller, beside what ``interpolation`` says: a PTP moves all axes in proportion, E1 and E2 with them;
on a line E1 and E2 run in proportion to the way; $VEL.CP is the TCP's speed in the base, which a coupled table carries
along; every axis keeps its own speed and acceleration, which slow the whole move down; C_DIS rounds a corner within its
distance, at most from half of the longer move at it; without it the arm stops in the point, as it does where the arc
goes on or off, where it waits, and between a PTP and a line (the corner that is left there is checked too). C_VEL
rounds within the way on which a controller of ``BRAKES`` slows to its share, C_PTP within its share of half the longer
way. Metres, radians, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ik.chain import Floats

from ...arrays import Ints
from ...failure import IN_ROWS, Failure, Kind
from ...job.build_order import BuildOrder
from ...job.job import Job
from ...motion.motion import NO_MOVE, Motion
from ...motion.motion_file import BlendedRows
from ...rigid import inverse
from ...timing.time_law import TimeLaw, time_path, time_stops, time_travel
from ..cell_frames import tables_seen_from_base
from ..program import EventKind, MoveKind, Program, SourceLine
from .corners import BRAKES, DEFAULT_SPEED, CornerSide, asked_distances, corner_reach, rounded_distances, share_of_axes
from .interpolation import angles_between
from .program_path import ProgramPath, interpolate_program

TURN_SPEED = np.deg2rad(200.0)  # of the TCP about itself (KUKA: DEF_VEL_ORI1)
EXACT_STOP = 1e-5  # m: corners that are rounded over less are stopped in
TICK = 2e-6  # s that every row takes at least
STOPS = (EventKind.ARC_ON, EventKind.ARC_OFF, EventKind.WAIT)


@dataclass(frozen=True, eq=False)
class SimulatedProgram:
    """A program as it is run.

    Attributes:
        program: the program.
        motion: rows; bead, layer and target are not known yet and 0.
        move: number of the move that each row is on, (m,).
        runs: rows between stops, and how their corners are rounded.
        weld: number of the stretch with the arc on that each row belongs to, (m,), -1 with the arc off.
        failures: what the arm cannot do, by the number of the move; the motion ends there.
        arc_faults: what is wrong with the order of arc on and arc off, by the number of the move.
        turned: greatest turn of the TCP from one end of a line to the other, rad.
        rounded: distance from its end at which the corner of every move may be rounded, (k,), m.
    """

    program: Program
    motion: Motion
    move: Ints
    runs: tuple[BlendedRows, ...]
    weld: Ints
    failures: dict[int, Failure]
    arc_faults: dict[int, Failure]
    turned: float
    rounded: Floats

    def line(self, row: int) -> SourceLine | None:
        """Where the move of a row stands in the text."""
        return self.program.line_of(int(self.move[row]))


def run_program(program: Program, job: Job) -> SimulatedProgram:
    """Run a program as the controller would.

    Args:
        program: the program.
        job: names the arm, its torch and its table.

    Returns:
        The motion, with what could not be run.

    Raises:
        InputError: it cannot be begun; one line.
    """
    path = interpolate_program(program, job)
    clock = _Clock(program, job, path)
    clock.all()
    return clock.result()


class _Clock:
    """Gives a path its times, and the events their places."""

    def __init__(self, program: Program, job: Job, path: ProgramPath) -> None:
        self.program, self.job, self.path, self.moves = program, job, path, program.moves
        drives = job.drives
        self.limits = drives.speed, drives.acceleration
        self.asked = asked_distances(self.moves)
        self.first = np.searchsorted(path.move, np.arange(len(self.moves) + 1))
        self.rows: list[tuple[Floats, Floats, Ints]] = []  # axes, seconds from the row before, move
        self.arc: list[Ints] = []
        self.count, self.on, self.stretch = 0, False, -1
        self.runs: list[BlendedRows] = []
        self.arc_faults: dict[int, Failure] = {}
        self.events: dict[int, list[Any]] = {}
        for event in program.events:
            self.events.setdefault(event.before, []).append(event)

    def all(self) -> None:
        """Every move and event, in order."""
        self._put(self.path.axes[:1], np.zeros(1), np.zeros(1, dtype=np.int64))
        if any(event.kind == EventKind.ARC_ON for event in self.events.get(0, ())):
            self.on, self.stretch = True, 0
            self.arc[-1] = np.zeros(1, dtype=np.int64)
            self.arc_faults[0] = Failure(Kind.PTP_WITH_ARC, place=IN_ROWS)
        i, end = 1, min([len(self.moves), *(k + 1 for k in self.path.failures)])
        while i < end:
            self._happen(i)
            j = min(self._run_end(i), end)
            self._run(i, j)
            i = j
        if self.path.failures:
            return
        self._happen(len(self.moves))
        if self.on:
            self.arc_faults[len(self.moves) - 1] = Failure(Kind.ARC_LEFT_ON, place=IN_ROWS)

    def _put(self, axes: Floats, dt: Floats, move: Ints) -> None:
        self.rows.append((axes, dt, move))
        self.arc.append(np.full(len(axes), self.stretch if self.on else -1))
        self.count += len(axes)

    def _still(self, seconds: float, move: int) -> None:
        """A row more at the same place."""
        self._put(self.rows[-1][0][-1:], np.array([seconds]), np.array([move]))

    def _happen(self, before: int) -> None:
        for event in self.events.get(before, ()):
            move = min(before, len(self.moves) - 1)
            if event.kind == EventKind.WAIT:
                self._still(event.seconds, move)
            elif event.kind == EventKind.ARC_ON:
                if self.on:
                    self.arc_faults.setdefault(move, Failure(Kind.ARC_ON_AGAIN, place=IN_ROWS))
                    continue
                if self.arc[-1][-1] >= 0:  # a row with the arc off between two stretches at one place
                    self._still(TICK, move)
                    self._still(TICK, move)
                self.on, self.stretch = True, self.stretch + 1
                self.arc[-1] = np.append(self.arc[-1][:-1], self.stretch)
            elif event.kind == EventKind.ARC_OFF:
                if not self.on:
                    self.arc_faults.setdefault(move, Failure(Kind.ARC_OFF_AGAIN, place=IN_ROWS))
                self.on = False

    def _stops(self, before: int) -> bool:
        """Whether the arm stops where the move that follows begins."""
        if self._exact(before - 1):
            return True
        return any(event.kind in STOPS for event in self.events.get(before, ()))

    def _exact(self, move: int) -> bool:
        """Whether the program has the arm stop at the end of a move."""
        return bool(self.moves.blend[move] <= EXACT_STOP and self.moves.blend_share[move] <= 0)

    def _run_end(self, i: int) -> int:
        """The move after the last of those that are run through without a stop."""
        moves, axes = self.moves, self.moves.kind == MoveKind.AXES
        j = i + 1
        while (
            j < len(moves)
            and axes[j] == axes[i]
            and not self._stops(j)
            and (axes[i] or (moves.tool[j] == moves.tool[i] and moves.base[j] == moves.base[i]))
        ):
            j += 1
        return j

    def _run(self, i: int, j: int) -> None:
        rows = np.arange(self.first[i], self.first[j])
        if not len(rows):
            return
        axes = np.concatenate([self.rows[-1][0][-1:], self.path.axes[rows]])
        # a point that repeats the one before takes no time
        moving = np.abs(np.diff(axes, axis=0)).max(axis=1) > NO_MOVE
        axes, rows = axes[np.append(True, moving)], rows[moving]
        if not len(rows):
            return
        move = self.path.move[rows]
        if self.moves.kind[i] == MoveKind.AXES:
            dt, s, zone = self._axes_times(axes, move)
        else:
            dt, s, zone = self._line_times(axes, move, rows)
        if j - i > 1 and zone > EXACT_STOP and len(rows) > 1:
            self.runs.append(BlendedRows(self.count - 1, self.count - 1 + len(rows), s, zone))
        self._put(axes[1:], np.maximum(dt, TICK), move)

    def _axes_times(self, axes: Floats, move: Ints) -> tuple[Floats, Floats, float]:
        """Seconds of the steps, joint way to every row, rad, and the zone of rounding in it."""
        speed, acceleration = self._limits(move)
        way = np.linalg.norm(np.diff(axes, axis=0), axis=1)
        s = np.concatenate([[0.0], np.cumsum(np.maximum(way, NO_MOVE))])
        ends = np.flatnonzero(np.append(np.diff(move) != 0, True))
        zone = 0.0
        if len(ends) > 1:  # as much of the joints' way as the TCP's distance takes at each corner
            p = self.job.scene.chain.forward(axes[:, :-2])[:, :3, 3]
            gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
            zones = []
            begins = np.concatenate([[0.0], s[ends + 1]])
            for n, k in enumerate(ends[:-1].tolist()):
                blend = float(self.moves.blend[move[k]])
                near = np.interp([gone[k + 1] - blend, gone[k + 1] + blend], gone, s)
                longer = max(begins[n + 1] - begins[n], begins[n + 2] - begins[n + 1])
                by_share = share_of_axes(self.moves, int(move[k]), int(move[k + 1])) * longer / 2
                zones.append(max(s[k + 1] - near[0], near[1] - s[k + 1], by_share))
            zone = min(max(zones), s[-1] / 2)
        if zone > 0:
            return time_travel(axes, speed, acceleration, zone=zone), s, zone
        return time_travel(axes, speed, acceleration), s, zone

    def _limits(self, move: Ints) -> tuple[Floats, Floats]:
        """Speeds and accelerations that the axes may have on some moves, (j + 2,): the least shares that are set."""
        n = self.job.scene.chain.n

        def least(share: Floats) -> float:
            set_ = share[move][np.isfinite(share[move])]
            return float(min(set_.min(initial=1.0), 1.0))

        speed, acceleration = (limit.copy() for limit in self.limits)
        if self.moves.kind[move[0]] == MoveKind.AXES:
            speed[:n] *= least(self.moves.axis_share)
            acceleration[:n] *= least(self.moves.axis_acceleration)
            acceleration[n:] *= min(least(self.moves.axis_acceleration), least(self.moves.external_acceleration))
        else:
            acceleration[n:] *= least(self.moves.external_acceleration)
        speed[n:] *= least(self.moves.external_share)
        return speed, acceleration

    def _line_times(self, axes: Floats, move: Ints, rows: Ints) -> tuple[Floats, Floats, float]:
        """Seconds of the steps, way of the TCP in the base to every row, m, and the zone of rounding in it."""
        T = np.concatenate([self.path.begins[move[0]][None], self.path.Ts_frame_tcp[rows]])
        p = T[:, :3, 3]
        way = np.linalg.norm(np.diff(p, axis=0), axis=1)
        step = np.maximum(way, NO_MOVE)
        asked = self.moves.speed[move]
        cap = np.where(np.isfinite(asked), asked, DEFAULT_SPEED)
        turn = np.abs(np.diff(axes, axis=0)).max(axis=1)
        # where the TCP hardly gets on, the turn of the tool sets the pace
        turns = np.nan_to_num(self.moves.turn_speed[move], nan=TURN_SPEED)
        cap = np.where(way < turn * 1e-6, step * turns / np.maximum(turn, NO_MOVE), cap)
        # and nowhere does the tool turn faster
        cap = np.minimum(cap, step * turns / np.maximum(angles_between(T[1:, :3, :3], T[:-1, :3, :3]), NO_MOVE))
        s = np.concatenate([[0.0], np.cumsum(step)])
        zone = self._zone(move, s, p)
        return self._law(axes, s, cap, move, zone), s, zone

    def _zone(self, move: Ints, s: Floats, p: Floats) -> float:
        """Distance over which the corners of a run are rounded: the widest at any of them."""
        ends = np.flatnonzero(np.append(np.diff(move) != 0, True))
        begins = np.concatenate([[0], ends + 1])
        length = np.diff(s[begins])
        asked = self.asked[move[ends[:-1]]]
        # on a circle the TCP comes within a distance of the corner earlier than the length of the arc says
        round_ = self.moves.kind[move[ends]] == MoveKind.CIRCULAR
        for n in np.flatnonzero(round_[:-1] | round_[1:]).tolist():
            corner = begins[n + 1]
            for at in (np.arange(corner, begins[n] - 1, -1), np.arange(corner, begins[n + 2] + 1)):
                side = CornerSide(np.abs(s[at] - s[corner]), np.linalg.norm(p[at] - p[corner], axis=1), 0.0)
                asked[n] = max(asked[n], side.within(float(self.asked[move[ends[n]]])))
        half = np.maximum(length[:-1], length[1:]) / 2
        return float(np.minimum(asked, half).max(initial=0.0))

    def _law(self, axes: Floats, s: Floats, cap: Floats, move: Ints, zone: float) -> Floats:
        """Seconds of every step of a run of lines."""
        speed, acceleration = self._limits(move)
        set_ = self.moves.acceleration[move][np.isfinite(self.moves.acceleration[move])]
        # the TCP's own acceleration is that of one more axis, which is the way itself
        axes = np.concatenate([axes, s[:, None]], axis=1)
        limits = np.append(speed, np.inf), np.append(acceleration, set_.min(initial=BRAKES))
        law: TimeLaw
        if zone > EXACT_STOP:
            law = time_path(axes, s, *limits, cap=cap, zone=zone)
        else:
            ends = np.flatnonzero(np.diff(move, append=-1) != 0) + 1
            law = time_stops(axes, s, *limits, cap=cap, stops=np.concatenate([[0], ends]))
        return np.diff(law.t)

    def _mixed_corners(self, axes: Floats, move: Ints) -> list[BlendedRows]:
        """Rounded corners between moves that are timed apart: a PTP and a line, or another tool or base.

        The arm is taken to stop there; where it does not, it leaves the corner, and that way is checked as well.
        """
        m = self.moves
        other = (m.kind[1:] == MoveKind.AXES) != (m.kind[:-1] == MoveKind.AXES)
        other |= (m.kind[1:] != MoveKind.AXES) & ((m.tool[1:] != m.tool[:-1]) | (m.base[1:] != m.base[:-1]))
        out = []
        begins = np.flatnonzero(np.diff(move)) + 1  # rows; moves that go nowhere have none
        for first, corner, stop in zip(np.append(1, begins), begins, np.append(begins[1:], len(move)), strict=False):
            last, k = int(move[corner - 1]), int(move[corner])
            between = range(last + 1, k + 1)
            if last < 1 or not other[last:k].any() or any(self._stops(j) for j in between):
                continue
            before = self._side(axes[first - 1 : corner][::-1], last)
            after = self._side(axes[corner - 1 : stop], k)
            reach = np.array([corner_reach(m, j - 1, k, before, after) for j in between]).max(axis=0)
            if reach.max() > 0:
                # the move behind the corner is stretched, so that the rounding reaches as far on either side
                zone, ends = np.maximum(reach, NO_MOVE).tolist()
                s = np.concatenate([before.s[-1] - before.s[::-1], before.s[-1] + after.s[1:] * zone / ends])
                out.append(BlendedRows(int(first) - 1, int(stop) - 1, s, zone))
        return out

    def _side(self, axes: Floats, k: int) -> CornerSide:
        """Move k from a corner outwards, all axes (m, j + 2) there and on, rad: see :class:`CornerSide`."""
        T = self.job.scene.chain.forward(axes[:, :-2])
        base = self.moves.base[k]
        if base >= 0 and self.program.bases[base].coupled:
            T = inverse(tables_seen_from_base(self.job.scene, axes[:, -2:])) @ T
        p = T[:, :3, 3]
        step = np.linalg.norm(np.diff(p, axis=0), axis=1)
        by_axes = self.moves.kind[k] == MoveKind.AXES or step.sum() <= EXACT_STOP  # a line that only turns the tool
        by = np.linalg.norm(np.diff(axes, axis=0), axis=1) if by_axes else step
        s = np.concatenate([[0.0], np.cumsum(np.maximum(by, NO_MOVE))])
        return CornerSide(s, np.linalg.norm(p - p[0], axis=1), float(step.sum()))

    def result(self) -> SimulatedProgram:
        """All rows."""
        axes, dt, move = (np.concatenate(some) for some in zip(*self.rows, strict=True))
        weld = np.concatenate(self.arc)
        if len(axes) == 1:  # a motion has two rows
            axes, dt, move, weld = (np.repeat(some, 2, axis=0) for some in (axes, dt, move, weld))
        n, none = self.job.scene.chain.n, np.zeros(len(axes), dtype=np.int64)
        t = np.concatenate([[0.0], np.cumsum(np.maximum(dt[1:], TICK))])
        arc = (weld >= 0).astype(np.int64)
        motion = Motion(t, axes[:, :n], axes[:, n:], arc, none, none, none, self.job.scene.chain.names)
        path = self.path
        self.runs += self._mixed_corners(axes, move)
        return SimulatedProgram(
            self.program,
            motion,
            move,
            tuple(self.runs),
            weld,
            path.failures,
            self.arc_faults,
            path.turned,
            rounded_distances(self.moves, path),
        )


def with_beads(
    run: SimulatedProgram, bead: Ints, layer: Ints, target: Ints, order: BuildOrder | None
) -> SimulatedProgram:
    """A run whose rows say which bead, layer and target they belong to, (m,) each."""
    return replace(run, motion=replace(run.motion, bead=bead, layer=layer, target=target, order=order))
