"""The verdict at one pose of the table: can the arm weld every target, bead by bead, and what stops it where it cannot.

    result = check_fixed(prepare(case), E1_deg, E2_deg)
    result.feasible, result.reasons, result.failures

Of a large part that is lost not every target is checked (``cell.planning.infeasible_part``): those are neither
feasible nor infeasible, and their number is ``result.not_looked_at``.

A motion is called feasible if it was followed and checked between the targets as well; a target that is not feasible
carries the reason of its best candidate, and ``proved`` where every configuration it could have has been checked.
Radians and metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats
from slicing import Code, Warning

from ..collision.table_clearances import table_alone
from ..failure import Contact, Failure, Kind
from ..job.job import Job
from ..job.overhang_check import unsupported_targets
from ..motion.motion import Motion
from ..part_chunks.chunked_plan import plan_in_chunks
from ..part_chunks.chunked_run import PartRun, PlanToRun, run_in_chunks
from ..part_chunks.chunking import USUAL, Chunking, Shared
from ..part_chunks.least_values import LeastValue, least_margin, least_sigma, nearest_sample, samples_of
from ..planning.assemble import RunBeads
from ..planning.bead_runs import PartPlan
from ..planning.blocking_layers import with_lockouts
from ..planning.context import Context, Span
from ..planning.travels.home import HomeTravels, SpanEnds, with_home
from ..planning.travels.travel import STRAIGHT, straight_retracts
from ..processes.worker_pool import processor_time
from ..progress import Progress, phase
from ..rigid import is_beyond
from ..scene.placement import PlacedTargets
from ..scene.scene import table_angles
from ..units import METRES_PER_MM
from .result import Result, TargetVerdict


@phase("checking", spins=False)
def check_fixed(
    job: Job,
    E1_deg: float,
    E2_deg: float,
    progress: Progress | None = None,
) -> Result:
    """Check every target, every bead and the travels between them, with the table standing.

    Args:
        job: from ``cell.job.job.prepare``; what its case says of the table does not count.
        E1_deg: tilt of the table.
        E2_deg: turn of the table; a whole turn is added or subtracted if only that lies in the axis' range.
        progress: called with how far it is.

    Returns:
        The verdict.

    Raises:
        InputError: the positioner has no such angles.
        WorkerKilledError: a worker was killed.
    """
    begun = processor_time()
    asked, table = (E1_deg, E2_deg), table_angles(job.scene, E1_deg, E2_deg)
    context = Context.of(job, table)
    found = check_span(job, context, off_upright(job, context.placed), progress)
    return replace(result_of(job, context, asked, found), seconds=processor_time() - begun)


def result_of(job: Job, context: Context, asked: tuple[float, float], found: SpanVerdict) -> Result:
    """The verdict on a part that is checked as one span.

    Args:
        job: the part.
        context: of the whole job, at a pose of the table or with a table that moves along.
        asked: E1, E2 as asked for, deg.
        found: the verdict on all of its targets.
    """
    return Result(
        job=replace(job, warnings=(*job.warnings, *found.warnings)),
        asked=asked,
        table=context.checker.table,
        placed=context.placed,
        rows=found.rows,
        clearance=found.clearance,
        singularity=found.singularity,
        sigma=found.sigma,
        gravity=off_upright(job, context.placed),
        motion=found.motion,
    )


def off_upright(job: Job, placed: PlacedTargets) -> Floats:
    """Angle between the deposition direction of placed targets and up, (n,), rad."""
    up = job.scene.T_world_base()[2, :3]
    return np.asarray(np.arccos(np.clip(placed.normal @ up, -1.0, 1.0)))


@dataclass(frozen=True, eq=False)
class SpanVerdict:
    """The verdict on targets that are welded at one pose of the table.

    Attributes:
        rows: one a target of the span.
        motion: from where the arm comes from to where it goes; None where infeasible.
        clearance: as of :class:`Result`, and so
        singularity: and
        sigma: this.
        warnings: about the ways.
        ends: how it is come to and left, where it is feasible.
    """

    rows: tuple[TargetVerdict, ...]
    motion: Motion | None = None
    clearance: LeastValue | None = None
    singularity: LeastValue | None = None
    sigma: float | None = None
    warnings: tuple[Warning, ...] = ()
    ends: SpanEnds | None = None

    def __post_init__(self) -> None:
        """Hold that a motion is one of targets that are all feasible.

        Raises:
            RuntimeError: it is not: an error of the program.
        """
        wrong = [i for i, row in enumerate(self.rows) if row.reason is not None] if self.motion is not None else []
        if wrong:
            raise RuntimeError(f"a motion was made of a part of which {len(wrong)} targets are not feasible")


def check_span(
    job: Job, context: Context, gravity: Floats, progress: Progress | None = None, chunking: Chunking = USUAL
) -> SpanVerdict:
    """Check the targets of a context's span, at its pose of the table.

    Args:
        job: the whole part.
        context: of the job at a pose.
        gravity: angle of every target of the part off upright, (n,), rad.
        progress: called with how far it is.
        chunking: how a large part is cut for workers, whose number does not matter to what is found.

    Returns:
        The verdict.
    """
    table, span = context.checker.table, context.span
    moves = context.placed.moving is not None  # what it meets then is asked of all of its way
    blocked = None if moves else _table_in_the_way(job, table, context.done)
    if blocked is not None:
        return SpanVerdict(tuple(failed(blocked, i) for i in range(span.first, span.stop)))
    chunks, shared = chunking.chunks(job.targets, span), Shared.of(job, context)
    planned = plan_in_chunks(shared, chunks, progress, lambda: not _failures_aside(job, gravity, span))
    plan, home = with_home(context, with_lockouts(job, context, planned.plan), planned.home)
    aside = _failures_aside(job, gravity, span)
    rows: dict[int, TargetVerdict] = {}
    warnings: list[Warning] = []

    def judge() -> None:
        rows.update(_rows(plan, aside))
        warnings.extend(_short_retracts(context, plan, home))

    run: PartRun | None = None
    if plan.whole and not aside:
        run = run_in_chunks(shared, chunks, PlanToRun(plan, home, planned.ahead), progress, judge)
        rows.update((i, failed(failure, i, rows[i].q)) for i, failure in run.failures.items() if i in rows)
    else:
        judge()
    part, stretches = _as_far_as_run(plan, home), plan.stretches
    return SpanVerdict(
        rows=tuple(rows[i] for i in range(span.first, span.stop)),
        motion=None if run is None or run.failures else run.motion,
        clearance=nearest_sample(context, samples_of(context, part)) if run is None else run.clearance,
        singularity=least_margin(context, stretches) if run is None else run.singularity,
        sigma=least_sigma(context, stretches) if run is None else run.sigma,
        warnings=tuple(warnings),
        ends=None if run is None or run.failures or home is None else SpanEnds(stretches[0], stretches[-1], home),
    )


def _short_retracts(context: Context, plan: PartPlan, home: HomeTravels | None) -> list[Warning]:
    """A warning where the torch is drawn back straight by less than the case asks for."""
    stretches, asked = plan.stretches, context.settings.retract
    if len(plan.travels) != len(stretches) - 1:
        return []  # the part is infeasible, and its targets say why
    ends = [
        (way, s, at)
        for way, a, b in zip(plan.travels, stretches, stretches[1:], strict=False)
        for s, at in ((a, -1), (b, 0))
    ]
    if home is not None:
        ends += [(home.out, stretches[0], 0)] if home.out is not None else []
        ends += [(home.back, stretches[-1], -1)] if home.back is not None else []
    reached = zip(straight_retracts(context, ends), ends, strict=True)
    short = [(out, s.first if at == 0 else s.stop - 1) for out, (_, s, at) in reached if out < asked - STRAIGHT]
    if not short:
        return []
    least, target = min(short)
    text = (
        f"the torch is drawn back by less than process.retract_mm {asked / METRES_PER_MM:g} at {len(short)} ends of"
        f" beads, because no more is free: least {least / METRES_PER_MM:.1f} mm, at target {target}"
    )
    return [Warning(Code.SHORT_RETRACT, text)]


def _table_in_the_way(job: Job, table: tuple[float, float], deposits_laid: int) -> Failure | None:
    """A collision that no arm can help: the workpiece, as far as it is built by then, or the table in the cell."""
    found = table_alone(job.scene, table, deposits_laid)
    if found.distance[0] >= 0.0:
        return None
    contact = Contact(
        pair=tuple(job.scene.geom_name(int(g)) for g in found.pair[0]),
        world_xyz_mm=tuple(round(float(v) / METRES_PER_MM, 2) for v in found.position[0]),
        note="the table and what stands on it, in any pose of the arm",
    )
    distance = round(float(found.distance[0]) / METRES_PER_MM, 3)
    return Failure(Kind.COLLISION, measure=distance, limit=0.0, contact=contact, proved=True)


def failed(failure: Failure, i: int, q: Floats | None = None) -> TargetVerdict:
    """The verdict on a target, with its best attempt."""
    return TargetVerdict(failure.at(replace(failure.place, target=i)), None, q)


def _failures_aside(job: Job, gravity: Floats, span: Span) -> dict[int, Failure]:
    """What is wrong with targets of a span however they are planned, by their numbers."""
    found = {**job.wires_in_metal, **unsupported_targets(job)}
    steepest = job.case.checks.gravity_max_deg
    if steepest is not None:
        for i in np.flatnonzero(is_beyond(gravity, np.deg2rad(steepest))).tolist():
            angle_deg = round(float(np.rad2deg(gravity[i])), 3)
            found[i] = Failure(Kind.GRAVITY, measure=angle_deg, limit=steepest, proved=True)
    return {i: failure for i, failure in found.items() if span.first <= i < span.stop}


def _rows(plan: PartPlan, aside: dict[int, Failure]) -> dict[int, TargetVerdict]:
    """The verdicts on the targets of a plan, by their numbers; what is wrong aside counts where nothing else is."""
    rows: dict[int, TargetVerdict] = {}
    for bead in plan.beads:
        for stretch in bead.stretches:
            targets = range(stretch.first, stretch.stop)
            rows.update((i, TargetVerdict(None, q)) for i, q in zip(targets, stretch.q_targets, strict=True))
        rows.update((i, failed(m.failure, i, m.attempt)) for i, m in bead.target_failures.items())
        # of a bead that is cut there is no configuration
        known = {i: rows[i].q for i in bead.edge_failures if i in rows}
        rows.update((i, failed(failure, i, known.get(i))) for i, failure in bead.edge_failures.items())
    rows.update((i, TargetVerdict(None, None, looked_at=False)) for bead in plan.beads for i in bead.open)
    # at home the arm may be in the way whether the bead at its end was checked or not
    rows.update((i, failed(failure, i, rows[i].q)) for i, failure in plan.travel_failures.items())
    rows.update((i, failed(failure, i, rows[i].q)) for i, failure in aside.items() if rows[i].reason is None)
    return rows


def _as_far_as_run(plan: PartPlan, home: HomeTravels | None) -> RunBeads:
    """What there is of a plan that does not hold: its travels only where they are all there."""
    stretches = tuple(plan.stretches)
    travels = plan.travels if len(plan.travels) == len(stretches) - 1 else ()
    return RunBeads(stretches, travels, None, home)
