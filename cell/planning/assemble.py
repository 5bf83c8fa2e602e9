"""A motion as data: what replay shows and what a program is written from.

    motion.t_s, motion.q, motion.arc, motion.target       # one row a sample
    motion.columns(), motion.rows_deg()                   # the contract of --motion

Times are the fastest that the axes' speeds and accelerations allow, on beads under the deposition speed; every bead and
every travel starts and ends at rest (see ``cell.timing.time_law``). Radians and seconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..failure import Failure, Place, Where
from ..job.job import speeds
from ..motion.deposition_speed import HELD, HeldSpeed, note_stretches, over_stretches
from ..motion.motion import STANDING, Motion
from ..rigid import inverse
from ..scene.table_kinematics import TableKinematics
from ..timing.time_law import time_path, time_stops, time_travel
from ..units import METRES_PER_MM
from .blended_check import bead_corners, bead_path, travel_corners, travel_path

if TYPE_CHECKING:
    from ..job.job import Job
    from .context import Context
    from .edge_check import Stretch
    from .travels.home import HomeWays
    from .travels.travel import TravelWay

EXACT_STOP = 1e-5  # m: a controller that rounds corners over less stops in them
TICK = 2e-6  # s that every row takes at least: a motion file has six decimals, and its time rises at every row


@dataclass(frozen=True, eq=False)
class _Piece:
    """Rows of a bead or a travel, with their times from the row before on."""

    q: Floats
    dt: Floats
    arc: int
    target: Ints


@dataclass(frozen=True, eq=False)
class RunBeads:
    """Beads that are run one after the other, with the ways to them.

    Attributes:
        stretches: one a bead, in order.
        travels: to each of them; none to the first of the part, and none at all of a part that is lost.
        before: first and last target of the bead before the first; None where that is the part's first.
        home: the ways from home to the first and from the last back, those that belong here; None where the part is
            not run from home.
    """

    stretches: tuple[Stretch, ...]
    travels: tuple[TravelWay, ...]
    before: tuple[int, int] | None = None
    home: HomeWays | None = None

    @property
    def led_to(self) -> list[tuple[int, int, Stretch, TravelWay]]:
        """The beads that a travel leads to: first and last target of the bead before, the bead, and the travel."""
        if not self.travels:
            return []
        ends = [(stretch.first, stretch.stop - 1) for stretch in self.stretches[:-1]]
        ends = ends if self.before is None else [self.before, *ends]
        after = self.stretches[len(self.stretches) - len(self.travels) :]
        return [(*end, start, way) for end, start, way in zip(ends, after, self.travels, strict=True)]


@dataclass(frozen=True, eq=False)
class TimedBeads:
    """Beads and the ways to them with their times.

    Attributes:
        q: rows, (m, j), rad, or (m, j + 2) with E1 and E2.
        dt: time from the row before to each, (m,), s.
        arc: 1 while welding, (m,).
        target: as of :class:`cell.motion.motion.Motion`, (m,).
        first: the first target.
        held_speed: of the targets from there on.
        home_s: of the ways from home and back among them, s.
    """

    q: Floats
    dt: Floats
    arc: Ints
    target: Ints
    first: int
    held_speed: HeldSpeed
    home_s: float


def timed(job: Job, run: RunBeads) -> TimedBeads:
    """Give beads and the ways to them their times.

    Args:
        job: the job.
        run: what is run.

    Returns:
        Their rows.
    """
    held_speed = HeldSpeed.unknown(len(job.targets))
    pieces: list[_Piece] = []
    last, home_s = 0.0, 0.0
    first, final = run.stretches[0].first, run.stretches[-1].stop
    if run.home is not None and run.home.out is not None:
        out, last = _travel(job, run.home.out[0], 0.0, first, begins=True)
        pieces.append(out)
        home_s += float(out.dt.sum()) + last
    if len(run.travels) < len(run.stretches):
        pieces.append(_bead(job, run.stretches[0], last, held_speed))
    for before, _, stretch, way in run.led_to:
        travel, last = _travel(job, way.q, _dwell(job, before, stretch.first), stretch.first)
        pieces += [travel, _bead(job, stretch, last, held_speed)]
    if run.home is not None and run.home.back is not None:
        back, _ = _travel(job, run.home.back[0], 0.0, final - 1, ends=True)
        pieces.append(back)
        home_s += float(back.dt.sum())
    return TimedBeads(
        q=np.concatenate([piece.q for piece in pieces]),
        dt=np.concatenate([piece.dt for piece in pieces]),
        arc=np.concatenate([np.full(len(piece.q), piece.arc) for piece in pieces]),
        target=np.concatenate([piece.target for piece in pieces]),
        first=first,
        held_speed=held_speed.rows(first, final),
        home_s=home_s,
    )


def assemble(job: Job, table: tuple[float, float], parts: Sequence[TimedBeads], *, from_home: bool) -> Motion:
    """Put all beads and travels of a part together.

    Args:
        job: the job.
        table: E1, E2, rad, of a table that stands; where it moves the rows say.
        parts: in order.
        from_home: whether it begins or ends at home.

    Returns:
        The motion.
    """
    held_speed = HeldSpeed.unknown(len(job.targets))
    for part in parts:
        held_speed.put(part.first, part.held_speed)
    where = np.concatenate([part.target for part in parts])
    rows, n = np.concatenate([part.q for part in parts]), job.scene.chain.n
    dt = np.concatenate([part.dt for part in parts])
    return Motion(
        t_s=_times(dt),
        q=rows[:, :n],
        table=rows[:, n:] if rows.shape[1] > n else np.tile(table, (len(rows), 1)),
        arc=np.concatenate([part.arc for part in parts]),
        bead=job.targets.path[where],
        layer=job.targets.layer[where],
        target=where,
        names=job.scene.chain.names,
        held_speed=held_speed,
        home_s=sum(part.home_s for part in parts) if from_home else None,
        order=job.order,
    )


def _times(dt: Floats) -> Floats:
    """When each row is passed, (m,), s, from how long each takes; the time rises at every row."""
    return np.asarray(np.cumsum(np.concatenate([[0.0], np.maximum(dt[1:], TICK)])) + dt[0])


def with_ways(job: Job, motion: Motion, out: Floats | None, back: Floats | None) -> Motion:
    """A motion that comes to its first bead, and leaves its last one, on other ways.

    Args:
        job: the job.
        motion: of beads at one pose of the table, with the ways to them and from them.
        out: rows of the way to the first bead, (m, j), rad, from rest to the bead's first row; None: as it is.
        back: rows of the way from the last bead's last row on, likewise.

    Returns:
        The motion; its beads and the travels between them take the times that they took.
    """
    n, weld = job.scene.chain.n, np.flatnonzero(motion.arc)
    first, last = int(weld[0]), int(weld[-1])
    rows = slice(first if out is not None else 0, last + 1 if back is not None else len(motion.t_s))
    pieces = [_Piece(motion.q[rows], np.diff(motion.t_s[rows], prepend=np.nan), 0, motion.target[rows])]
    arcs = [motion.arc[rows]]
    if out is not None:
        piece, step = _travel(job, out, 0.0, int(motion.target[first]), begins=True)
        pieces[0].dt[0] = step
        pieces.insert(0, piece)
        arcs.insert(0, np.zeros(len(piece.q), dtype=motion.arc.dtype))
    else:
        pieces[0].dt[0] = motion.t_s[0]
    if back is not None:
        piece, _ = _travel(job, back, 0.0, int(motion.target[last]), ends=True)
        pieces.append(piece)
        arcs.append(np.zeros(len(piece.q), dtype=motion.arc.dtype))
    dt, where = (np.concatenate([getattr(piece, name) for piece in pieces]) for name in ("dt", "target"))
    return replace(
        motion,
        t_s=_times(dt),
        q=np.concatenate([piece.q[:, :n] for piece in pieces]),
        table=np.tile(motion.table[0], (len(where), 1)),
        arc=np.concatenate(arcs),
        bead=job.targets.path[where],
        layer=job.targets.layer[where],
        target=where,
    )


def way_time(job: Job, way: Floats, target: int, *, begins: bool) -> float:
    """How long a way to the first bead (begins), or from the last one, takes, s."""
    piece, step = _travel(job, way, 0.0, target, begins=begins, ends=not begins)
    return float(piece.dt.sum()) + (step if begins else 0.0)


def corners(job: Job, context: Context, run: RunBeads) -> dict[int, Failure]:
    """Where a motion that is free comes too near to something once it is run, its corners rounded.

    Args:
        job: the job.
        context: what it was planned with.
        run: beads, and travels planned so that their rounded corners are free as well.

    Returns:
        Why, by the target on the way to which it is.
    """
    failures = bead_corners(context, job.case.process.blend_mm * METRES_PER_MM, run.stretches)
    for before, last, after, way in run.led_to:
        first = after.first
        if not _dwell(job, before, first):
            continue
        # a stop on the way leaves other corners to be rounded than the planner knew
        path, rows = travel_path(way.q)
        stop = int(rows[_retracted(job, _on_the_part(job, path.q))])
        failure = travel_corners(context, way.q, way.at_least, int(context.laid[last]), [stop])
        if failure is not None:
            failures[first] = failure.at(Place(Where.TRAVEL, from_target=last, to_target=first))
    return failures


def _bead(job: Job, stretch: Stretch, dt_before: float, held_speed: HeldSpeed) -> _Piece:
    """A bead's rows; notes in ``held_speed`` how fast it is."""
    process = job.case.process
    q, target = stretch.axes, stretch.edge + (stretch.fraction >= 1.0)
    dt = np.array([dt_before])
    if len(q) > 1:
        path = bead_path(stretch, process.blend_mm * METRES_PER_MM)
        s = path.s
        edge, cap = stretch.edge[:-1], speeds(job)
        limits = _limits(job, q)
        at = np.append(np.flatnonzero(np.diff(edge, prepend=-1)), len(q) - 1)
        if path.zone < EXACT_STOP:
            law = time_stops(q, s, *limits, cap=cap[edge], stops=at)
        else:
            law = time_path(q, s, *limits, cap=cap[edge], zone=path.zone)
        dt = np.append(dt, np.diff(law.t))
        asked = np.concatenate([[0.0], np.cumsum(np.diff(s) / cap[edge])])
        note_stretches(held_speed, np.append(edge[at[:-1]], edge[-1]), s[at], over_stretches(s, law.t, asked))
        for a, b in pairwise(at.tolist()):
            i = int(stretch.edge[a])
            held_speed.asked_s[i], held_speed.taken_s[i] = (s[b] - s[a]) / cap[i], law.t[b] - law.t[a]
            if held_speed.asked_s[i] < HELD * held_speed.taken_s[i] or held_speed.least[i] < HELD:
                joint, held_speed.by[i] = law.cause(s[a], s[b])
                held_speed.axis[i] = job.drives.names[joint]
    q, target, dt = _merged(q, target, dt)
    for wait, k in ((process.arc_on_s, 0), (process.arc_off_s, -1)):
        if wait > 0:
            q = np.insert(q, k % len(q), q[k], axis=0)
            target = np.insert(target, k % len(target), target[k])
            dt = np.insert(dt, 1 if k == 0 else len(dt), wait)
    return _Piece(q, dt, 1, target)


def _limits(job: Job, rows: Floats) -> tuple[Floats, Floats]:
    """Speeds and accelerations of the axes that rows have: the arm's, or the table's as well."""
    drives = job.drives
    if rows.shape[1] > job.scene.chain.n:
        return drives.speed, drives.acceleration
    return drives.arm_speed, drives.arm_acceleration


def _on_the_part(job: Job, rows: Floats) -> Floats:
    """Where the TCP is, (m, 3), m: seen from the part where the table moves, else from the base."""
    n = job.scene.chain.n
    Ts = job.scene.chain.forward(rows[:, :n])
    if rows.shape[1] > n:
        Ts = inverse(TableKinematics.of(job.scene).poses(rows[:, n:])) @ Ts
    return np.asarray(Ts[:, :3, 3])


def _merged(q: Floats, target: Ints, dt: Floats) -> tuple[Floats, Ints, Floats]:
    """Rows without those that the next one repeats: targets at one place are passed at one time."""
    again = np.append(np.abs(np.diff(q, axis=0)).max(axis=1, initial=0.0) <= STANDING, False)
    if not again.any() or again.sum() > len(q) - 2:
        return q, target, dt
    kept = np.flatnonzero(~again)
    first = np.concatenate([[0], kept[:-1] + 1])
    return q[kept], target[kept], np.add.reduceat(dt, first)


def _dwell(job: Job, before: int, after: int) -> float:
    """Wait between two targets' beads, s."""
    t = job.targets
    same = t.sub_volume_index[before] == t.sub_volume_index[after]
    return job.case.process.dwell_s if same and t.layer[before] != t.layer[after] else 0.0


def _travel(
    job: Job, way: Floats, wait: float, leads_to: int, *, begins: bool = False, ends: bool = False
) -> tuple[_Piece, float]:
    """A travel's rows between its ends, and the time of its last step.

    The ends are the beads' own rows, but for what the motion begins or ends with: there they are the travel's.
    """
    limits = _limits(job, way)
    moves = np.abs(np.diff(way, axis=0)).max(axis=1) > STANDING
    moves[-1] |= not moves.any()
    way = np.concatenate([way[:1], way[1:-1][moves[:-1]], way[-1:]])
    if len(way) == 2:
        way = np.insert(way, 1, way.mean(axis=0), axis=0)  # a row with the arc off
    p = _on_the_part(job, way)
    cap = _near_the_part(job, way, p, leaves=not begins, arrives=not ends)
    if wait > 0:
        k = _retracted(job, p)
        leave = time_travel(way[: k + 1], *limits, cap=cap[:k])
        arrive = time_travel(way[k:], *limits, cap=cap[k:])
        way, dt = np.insert(way, k, way[k], axis=0), np.concatenate([leave, [wait], arrive])
    else:
        dt = time_travel(way, *limits, cap=cap)
    if begins:
        way, dt = np.concatenate([way[:1], way]), np.concatenate([[0.0], dt])
    if ends:
        way, dt = np.concatenate([way, way[-1:]]), np.concatenate([dt, [0.0]])
    return _Piece(way[1:-1], dt[:-1], 0, np.full(len(way) - 2, leads_to)), float(dt[-1])


def _near_the_part(job: Job, way: Floats, p: Floats, *, leaves: bool, arrives: bool) -> Floats:
    """Caps on the joints' speed where a travel retracts and approaches at the speed of the TCP asked for, (m - 1,)."""
    process = job.case.process
    near = process.retract_mm * METRES_PER_MM + STANDING
    leaving = np.logical_and.accumulate(np.linalg.norm(p[1:] - p[0], axis=1) <= near)
    arriving = np.logical_and.accumulate(np.linalg.norm(p[:-1] - p[-1], axis=1)[::-1] <= near)[::-1]
    step = np.maximum(np.linalg.norm(np.diff(p, axis=0), axis=1), STANDING)
    speed = process.travel_speed_mm_s * METRES_PER_MM * np.linalg.norm(np.diff(way, axis=0), axis=1) / step
    return np.where((leaving & leaves) | (arriving & arrives), np.maximum(speed, STANDING), np.inf)


def _retracted(job: Job, p: Floats) -> int:
    """The first sample of a travel that is off the part by the retraction, or else the farthest off."""
    off = np.linalg.norm(p - p[0], axis=1)[1:-1]
    far = np.flatnonzero(off >= job.case.process.retract_mm * METRES_PER_MM - STANDING)
    return 1 + (int(far[0]) if len(far) else int(np.argmax(off)))
