"""Beads and travels put together to one timed motion, which is replayed and written as a program.

    motion.t_s, motion.q, motion.arc, motion.target       # one row a sample
    motion.columns(), motion.rows_deg()                   # the table that --motion writes

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
from ..failure import Failure, FailurePlace, Where
from ..job.job import speeds
from ..motion.deposition_speed import KEPT_SHARE, HeldSpeed, note_stretches, over_stretches
from ..motion.motion import NO_MOVE, Motion
from ..timing.time_law import PathRows, TimeLaw, time_paths, time_stops
from ..units import METRES_PER_MM
from .edges.blended_check import bead_corners, bead_path, travel_corners, travel_path
from .travels.timed_travels import AskedTravel, TimedRows, limits_of, on_the_part, retracted, timed_travels

if TYPE_CHECKING:
    from ..job.job import Job
    from .context import Context
    from .edges.edge_check import Stretch
    from .travels.home import HomeTravels
    from .travels.travel import TravelPath

EXACT_STOP = 1e-5  # m: a controller that rounds corners over less stops in them
TICK = 2e-6  # s that every row takes at least: a motion file has six decimals, and its time rises at every row


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
    travels: tuple[TravelPath, ...]
    before: tuple[int, int] | None = None
    home: HomeTravels | None = None

    @property
    def led_to(self) -> list[tuple[int, int, Stretch, TravelPath]]:
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
    pieces: list[TimedRows] = []
    first, final = run.stretches[0].first, run.stretches[-1].stop
    out, back = (None, None) if run.home is None else (run.home.out, run.home.back)
    ways = [] if out is None else [AskedTravel(out.q, first, begins=True)]
    ways += [AskedTravel(way.q, after.first, _dwell(job, before, after.first)) for before, _, after, way in run.led_to]
    ways += [] if back is None else [AskedTravel(back.q, final - 1, ends=True)]
    travels = iter(timed_travels(job, ways))
    last, home_s = 0.0, 0.0
    if out is not None:
        from_home, last = next(travels)
        pieces.append(from_home)
        home_s += float(from_home.dt.sum()) + last
    for k, bead in enumerate(_timed_beads(job, run.stretches)):
        if k >= len(run.stretches) - len(run.travels):
            travel, last = next(travels)
            pieces.append(travel)
        pieces.append(_bead(job, bead, last, held_speed))
    if back is not None:
        to_home, _ = next(travels)
        pieces.append(to_home)
        home_s += float(to_home.dt.sum())
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
        bead=job.targets.bead[where],
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


def with_home_travels(job: Job, motion: Motion, out: Floats | None, back: Floats | None) -> Motion:
    """A motion with another travel to its first bead and from its last one.

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
    pieces = [TimedRows(motion.q[rows], np.diff(motion.t_s[rows], prepend=np.nan), 0, motion.target[rows])]
    arcs = [motion.arc[rows]]
    if out is not None:
        ((piece, step),) = timed_travels(job, [AskedTravel(out, int(motion.target[first]), begins=True)])
        pieces[0].dt[0] = step
        pieces.insert(0, piece)
        arcs.insert(0, np.zeros(len(piece.q), dtype=motion.arc.dtype))
    else:
        pieces[0].dt[0] = motion.t_s[0]
    if back is not None:
        ((piece, _),) = timed_travels(job, [AskedTravel(back, int(motion.target[last]), ends=True)])
        pieces.append(piece)
        arcs.append(np.zeros(len(piece.q), dtype=motion.arc.dtype))
    dt, where = (np.concatenate([getattr(piece, name) for piece in pieces]) for name in ("dt", "target"))
    return replace(
        motion,
        t_s=_times(dt),
        q=np.concatenate([piece.q[:, :n] for piece in pieces]),
        table=np.tile(motion.table[0], (len(where), 1)),
        arc=np.concatenate(arcs),
        bead=job.targets.bead[where],
        layer=job.targets.layer[where],
        target=where,
    )


def home_travel_time(job: Job, way: Floats, target: int, *, begins: bool) -> float:
    """Duration of a travel to the first bead (begins), or from the last one, s."""
    ((piece, step),) = timed_travels(job, [AskedTravel(way, target, begins=begins, ends=not begins)])
    return float(piece.dt.sum()) + (step if begins else 0.0)


def corners(job: Job, context: Context, run: RunBeads) -> dict[int, Failure]:
    """Where a free motion comes too near to something once its corners are rounded.

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
        stop = int(rows[retracted(job, on_the_part(job, path.q))])
        failure = travel_corners(context, way.q, way.at_least, int(context.laid[last]), [stop])
        if failure is not None:
            failures[first] = failure.at(FailurePlace(Where.TRAVEL, from_target=last, to_target=first))
    return failures


@dataclass(frozen=True, eq=False)
class _TimedBead:
    """A bead and when its rows are passed.

    Attributes:
        stretch: the bead.
        s: length of the TCP's way to each row, (m,), m.
        at: rows at which targets are passed, but for the last the first of each edge.
        law: its time law; None of a bead of one row.
    """

    stretch: Stretch
    s: Floats
    at: Ints
    law: TimeLaw | None


def _timed_beads(job: Job, stretches: Sequence[Stretch]) -> list[_TimedBead]:
    """Beads with their time laws, which are worked out together where they are run without a stop."""
    blend, cap = job.case.process.blend_mm * METRES_PER_MM, speeds(job)
    beads: list[_TimedBead] = []
    asked: list[PathRows] = []
    for stretch in stretches:
        path, edge = bead_path(stretch, blend), stretch.edge[:-1]
        at = np.append(np.flatnonzero(np.diff(edge, prepend=-1)), len(stretch.q) - 1)
        law = None
        if blend < EXACT_STOP and len(edge):
            law = time_stops(path.q, path.s, *limits_of(job, path.q), cap=cap[edge], stops=at)
        elif len(edge):
            asked.append(PathRows(path.q, path.s, cap[edge], blend))
        beads.append(_TimedBead(stretch, path.s, at, law))
    laws = iter(time_paths(asked, *limits_of(job, asked[0].q)) if asked else ())
    return [replace(bead, law=next(laws)) if bead.law is None and len(bead.s) > 1 else bead for bead in beads]


def _bead(job: Job, bead: _TimedBead, dt_before: float, held_speed: HeldSpeed) -> TimedRows:
    """A bead's rows; notes in ``held_speed`` how fast it is."""
    process, stretch, law = job.case.process, bead.stretch, bead.law
    q, target = stretch.axes, stretch.edge + (stretch.fraction >= 1.0)
    dt = np.array([dt_before])
    if law is not None:
        s, at, edge, cap = bead.s, bead.at, stretch.edge[:-1], speeds(job)
        dt = np.append(dt, np.diff(law.t))
        asked = np.concatenate([[0.0], np.cumsum(np.diff(s) / cap[edge])])
        note_stretches(held_speed, np.append(edge[at[:-1]], edge[-1]), s[at], over_stretches(s, law.t, asked))
        for a, b in pairwise(at.tolist()):
            i = int(stretch.edge[a])
            held_speed.asked_s[i], held_speed.taken_s[i] = (s[b] - s[a]) / cap[i], law.t[b] - law.t[a]
            if held_speed.asked_s[i] < KEPT_SHARE * held_speed.taken_s[i] or held_speed.least[i] < KEPT_SHARE:
                joint, held_speed.by[i] = law.cause(s[a], s[b])
                held_speed.axis[i] = job.drives.names[joint]
    q, target, dt = _merged(q, target, dt)
    for wait, k in ((process.arc_on_s, 0), (process.arc_off_s, -1)):
        if wait > 0:
            q = np.insert(q, k % len(q), q[k], axis=0)
            target = np.insert(target, k % len(target), target[k])
            dt = np.insert(dt, 1 if k == 0 else len(dt), wait)
    return TimedRows(q, dt, 1, target)


def _merged(q: Floats, target: Ints, dt: Floats) -> tuple[Floats, Ints, Floats]:
    """Rows without those that the next one repeats: targets at one place are passed at one time."""
    again = np.append(np.abs(np.diff(q, axis=0)).max(axis=1, initial=0.0) <= NO_MOVE, False)
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
