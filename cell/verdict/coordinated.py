"""The verdict where the table moves along the beads: a way of the table first, the arm on it, and the whole judged.

    result = check_coordinated(prepare(case))
    result.motion.table                       # (m, 2) rad, row by row

Several ways of the table keep the deposition direction near to up: two solutions at each target, and what leans within
the cone. Those that no arm can make are left out by a look at a few targets of each; the best of the others are planned
whole, one after the other, until one holds. What fails on one way of the table may hold on another, so that nothing but
the angle off up is said to be proved. Radians and metres.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..coordination.table_check import table_in_the_way
from ..coordination.table_schedule import Schedule, TableMotion
from ..failure import Failure, Kind
from ..job.job import Job
from ..job.table_winding import freedom_of, upright_of
from ..motion.motion import Motion
from ..motion.motion_file import ReadMotion
from ..planning.configurations import nodes_at_rolls
from ..planning.context import Context
from ..processes.worker_pool import processor_time
from ..progress import Progress, phase
from ..rigid import is_beyond
from ..units import METRES_PER_MM
from ..verification.bead_samples import rows_of
from ..verification.blended_motion import sampled_runs, table_blend_collisions
from ..verification.collisions import table_collisions
from ..verification.laid_deposits import LaidDeposits
from .check import SpanVerdict, check_span, failed, off_upright, result_of
from .result import Result, TargetVerdict

LEANS = 4  # directions in which the table may lean where it does no good upright
LEAN = 0.5  # of the cone
COMPARED_TARGETS = 40  # targets at which ways of the table are compared
PLANNED_WHOLE = 3  # ways of the table that are planned whole


@dataclass(frozen=True, eq=False)
class _ScheduleTrial:
    """A way of the table, and what a look at it says.

    Attributes:
        way: of the table.
        blocked: targets at which the table itself is in the way.
        lost: targets at which no configuration of the arm is free, of those checked.
        seconds: that the table's slowest axis takes for the whole of it.
    """

    way: TableMotion
    blocked: int
    lost: int
    seconds: float


@phase("checking", spins=False)
def check_coordinated(job: Job, progress: Progress | None = None) -> Result:
    """Check every target, every bead and the way between them, the table moving along.

    Args:
        job: from ``cell.job.job.prepare``.
        progress: called with how far it is.

    Returns:
        The verdict, of the first way of the table that holds, or of the one that loses least.

    Raises:
        InputError: the positioner has no such angles.
    """
    begun = processor_time()
    least = freedom_of(job.case, job.scene).least_off(job.targets.normal)
    best: tuple[_ScheduleTrial, Context, SpanVerdict] | None = None
    for trial in _trials(job, impossible=bool(is_beyond(least, upright_of(job.case)).any())):
        context = Context.along(job, trial.way.tables)
        found = _judged(job, context, trial, least, progress)
        if best is None or _infeasible(found) < _infeasible(best[2]):
            best = trial, context, found
        if found.motion is not None:
            break
    assert best is not None
    trial, context, found = best
    made = result_of(job, context, (job.case.table.E1_deg, job.case.table.E2_deg), found)
    return replace(made, seconds=processor_time() - begun, mode="coordinated", moved=trial.way.tables)


def _infeasible(found: SpanVerdict) -> int:
    return sum(row.reason is not None for row in found.rows) if found.motion is None else -1


def _trials(job: Job, *, impossible: bool) -> list[_ScheduleTrial]:
    """Ways of the table worth planning, the most promising first; one where no way can keep it upright."""
    schedule = Schedule(freedom_of(job.case, job.scene), upright_of(job.case), job.drives.speed[-2:])
    trials: list[_ScheduleTrial] = []
    for side, aim in _aims(job, schedule):
        if aim is not None and any(not t.lost and not t.blocked for t in trials):
            break  # upright as it is
        trial = _schedule_trial(job, schedule, side, aim)
        if trial is not None and not any(np.allclose(t.way.tables, trial.way.tables, atol=1e-3) for t in trials):
            trials.append(trial)
        if impossible and trials:
            break
    upright = [t for t in trials if not is_beyond(t.way.off, schedule.upright).any()] or trials
    upright.sort(key=lambda t: (t.blocked, t.lost, t.seconds))
    return upright[: PLANNED_WHOLE if not impossible else 1]


def _aims(job: Job, schedule: Schedule) -> Iterator[tuple[int, Floats | None]]:
    """Solutions and directions to be exact, upright first."""
    yield 0, None
    yield 1, None
    up = job.scene.T_world_base()[2, :3]
    across = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    across /= np.linalg.norm(across)
    other, lean = np.cross(up, across), LEAN * schedule.upright
    for k in range(LEANS):
        angle = 2 * np.pi * k / LEANS
        towards = np.cos(angle) * across + np.sin(angle) * other
        for side in (0, 1):
            yield side, np.cos(lean) * up + np.sin(lean) * towards


def _schedule_trial(job: Job, schedule: Schedule, side: int, aim: Floats | None) -> _ScheduleTrial | None:
    """A way of the table with a first opinion on it."""
    t = job.targets
    length = np.linalg.norm(np.diff(t.position, axis=0), axis=1) * METRES_PER_MM
    way = schedule.along(t.normal, t.bead, length, side=side, aim=aim)
    speed = schedule.speed
    seconds = (
        float((np.abs(np.diff(way.tables, axis=0)) / speed).max(axis=1).sum()) if np.isfinite(speed).all() else 0.0
    )
    some = np.unique(np.linspace(0, len(t) - 1, COMPARED_TARGETS).round().astype(np.int64))
    blocked = len(table_in_the_way(job, way.tables))
    lost = len(some) if blocked else _lost(Context.along(job, way.tables), some)
    return _ScheduleTrial(way, blocked, lost, seconds)


def _lost(context: Context, some: Ints) -> int:
    """How many targets have no configuration that is free by itself."""
    nodes = nodes_at_rolls(
        context.solver, context.placed.rows(some), context.window, context.settings.roll_step, context.limits
    )
    lost = 0
    for k, i in enumerate(some.tolist()):
        at = np.argwhere(np.isfinite(nodes.cost[k]))
        at = at[np.argsort(nodes.cost[k][tuple(at.T)], kind="stable")]
        for first in range(0, len(at), 8):
            q = nodes.q[k][tuple(at[first : first + 8].T)]
            axes = context.placed.axes(q, np.full(len(q), i))
            found = context.screen.clearances(axes, np.full(len(q), context.deposits_before[i]))
            if (found.distance >= context.settings.clearance).any():
                break
        else:
            lost += 1
    return lost


def _judged(job: Job, context: Context, trial: _ScheduleTrial, least: Floats, progress: Progress | None) -> SpanVerdict:
    """The verdict on one way of the table."""
    if trial.blocked:
        met = table_in_the_way(job, trial.way.tables)
        at = np.array(sorted(met))
        near = np.abs(np.arange(len(least))[:, None] - at).argmin(axis=1)
        return SpanVerdict(tuple(failed(met[int(at[k])], i) for i, k in enumerate(near.tolist())))
    found = check_span(job, context, off_upright(job, context.placed), progress)
    rows = [row if row.failure is None else _not_proved(row) for row in found.rows]
    limit = upright_of(job.case)
    cannot = is_beyond(least, limit)
    for i in np.flatnonzero(is_beyond(trial.way.off, limit)).tolist():
        proved = bool(cannot[i])
        angle = _deg(least[i] if proved else trial.way.off[i])
        if proved or rows[i].reason is None:
            rows[i] = failed(Failure(Kind.GRAVITY, measure=angle, limit=_deg(limit), proved=proved), i, rows[i].q)
    if found.motion is not None and all(row.reason is None for row in rows):
        rows = _with_table_met(job, found.motion, rows)
    lost = any(row.reason is not None for row in rows)
    return replace(found, rows=tuple(rows), motion=None if lost else found.motion)


def _not_proved(row: TargetVerdict) -> TargetVerdict:
    """A verdict that was proved at the table's angles, but not at others."""
    assert row.failure is not None
    return replace(row, failure=replace(row.failure, proved=False))


def _with_table_met(job: Job, motion: Motion, rows: list[TargetVerdict]) -> list[TargetVerdict]:
    """The rows, with what the table itself meets in the motion as it is run, by the judge of any motion."""
    every = np.arange(len(motion.t_s))
    way, laid = rows_of(job, motion), LaidDeposits.of(job, motion, every, for_table=True)
    runs = list(sampled_runs(job, ReadMotion(motion, every + 1, ()), way, way))
    rounded = table_blend_collisions(job, runs, way, laid)
    for met in (*table_collisions(job, way, laid), *rounded):
        i = int(motion.target[met.to_row])
        if rows[i].reason is None:
            rows[i] = failed(met.failure, i, rows[i].q)
    return rows


def _deg(angle: float) -> float:
    return round(float(np.rad2deg(angle)), 3)
