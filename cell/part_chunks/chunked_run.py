"""A plan that holds, run in time and checked as it is run, chunk by chunk.

    run = run_in_chunks(shared, chunks, PlanToRun(plan, home))
    run.motion, run.failures, run.clearance

Each chunk is run (``cell.part_chunks.chunk_run``), where that has not been done ahead, and what comes least is looked
for. A part in one chunk is checked as a whole. Radians, metres, seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..failure import Failure
from ..motion.deposition_speed import too_slow
from ..motion.motion import Motion
from ..planning.assemble import RunBeads, assemble
from ..planning.bead_runs import PartPlan
from ..planning.travels.home import HomeTravels
from ..processes.work_round import Aside
from ..processes.worker import Tick
from ..progress import Progress, counted_progress
from .chunk_run import ChunkRun, run_chunk
from .chunking import Chunk, Shared, pool_for_chunks
from .least_values import LeastValue, RunSamples, least_clearance, least_of
from .runs_ahead import RunsAhead


@dataclass(frozen=True, eq=False)
class PlanToRun:
    """A plan that holds.

    Attributes:
        plan: in which every bead is whole and every travel found.
        home: the ways from home and back.
        ahead: chunks that have been run as they were planned; None where none has.
    """

    plan: PartPlan
    home: HomeTravels | None
    ahead: RunsAhead | None = None


@dataclass(frozen=True, eq=False)
class PartRun:
    """What became of a plan when it was run.

    Attributes:
        motion: all of it.
        failures: what is wrong with it, by target.
        clearance: least clearance, m: on the way where nothing is wrong, else at the samples.
        singularity: least margin as a multiple of its limit, with its kind.
        sigma: smallest singular value of the scaled Jacobian.
    """

    motion: Motion
    failures: dict[int, Failure]
    clearance: LeastValue | None
    singularity: LeastValue | None
    sigma: float | None


def run_in_chunks(
    shared: Shared,
    chunks: Sequence[Chunk],
    planned: PlanToRun,
    progress: Progress | None = None,
    meanwhile: Callable[[], object] | None = None,
) -> PartRun:
    """Run a plan, its chunks side by side where there are workers.

    Args:
        shared: the part and what it was planned with.
        chunks: of the part.
        planned: what is run.
        progress: called with how far it is, where there are several chunks.
        meanwhile: what this process does first, while workers run chunks.

    Returns:
        What became of it.
    """
    job, context = shared.job, shared.context
    plan, home, ahead = planned.plan, planned.home, planned.ahead
    runs = _runs(chunks, plan, home)
    known = _nearest_known(runs)
    done = [None if ahead is None else ahead.run_of(k, run) for k, run in enumerate(runs)]
    items = [(run if one is None else one.samples, known) for run, one in zip(runs, done, strict=True)]
    with counted_progress(progress if len(runs) > 1 else None, "chunks run", len(runs)) as count:
        seen = pool_for_chunks(chunks).run(_run, shared, items, count, None, _BesideRuns(meanwhile))
    found = [one for was, (new, _) in zip(done, seen, strict=True) if (one := was or new) is not None]
    from_home = home is not None and (home.out is not None or home.back is not None)
    motion = assemble(job, context.checker.table, [one.rows for one in found], from_home=from_home)
    failures: dict[int, Failure] = {}
    for one in found:
        failures.update(one.row_failures)
    for one in found:
        failures.update(one.rounded)
    if motion.held_speed is not None:
        failures.update(too_slow(motion.held_speed, job.case.process.least_speed_share))
    near = [one.at_samples if failures else on_the_way for one, (_, on_the_way) in zip(found, seen, strict=True)]
    sigmas = [one.sigma for one in found if one.sigma is not None]
    return PartRun(
        motion=motion,
        failures=failures,
        clearance=min((least for least in near if least is not None), key=lambda least: least.value, default=None),
        singularity=least_of(context, (one.singularity for one in found)),
        sigma=min(sigmas, default=None),
    )


class _BesideRuns(Aside):
    """What this process does before it runs a chunk; who planned neighbours runs them, or nearly so."""

    both_ends = True

    def __init__(self, meanwhile: Callable[[], object] | None) -> None:
        self._meanwhile = meanwhile

    def __call__(self) -> None:
        if self._meanwhile is not None:
            self._meanwhile()


def _run(
    shared: Shared, item: tuple[RunBeads | RunSamples | None, float], tick: Tick
) -> tuple[ChunkRun | None, LeastValue | None]:
    """Run one chunk, if it has not been run, and look how near it comes on the way, if nothing is wrong with it."""
    found, (samples, known) = None, item
    if isinstance(samples, RunBeads):
        found = run_chunk(shared, samples)
        samples = found.samples
    on_the_way = None if samples is None else least_clearance(shared.context, samples, known)
    tick()
    return None if found is None else replace(found, samples=None), on_the_way


def _runs(chunks: Sequence[Chunk], plan: PartPlan, home: HomeTravels | None) -> list[RunBeads]:
    """The beads of each chunk with the travels to them, and the ways from home and back at the ends."""
    stretches = plan.stretches
    firsts = np.array([stretch.first for stretch in stretches])
    cuts = np.searchsorted(firsts, [chunk.firsts[0] for chunk in chunks]).tolist()
    runs: list[RunBeads] = []
    for a, b in zip(cuts, [*cuts[1:], len(stretches)], strict=True):
        ways = None
        if home is not None:
            ways = HomeTravels(home.out if a == 0 else None, home.back if b == len(stretches) else None)
        before = (stretches[a - 1].first, stretches[a - 1].stop - 1) if a else None
        runs.append(RunBeads(tuple(stretches[a:b]), plan.travels[max(a - 1, 0) : b - 1], before, ways))
    return runs


def _nearest_known(runs: Sequence[RunBeads]) -> float:
    """The least clearance at any sample: that of a chunk need not be looked for where it is more, m."""
    found = [s.clearances.distance.min() for run in runs for s in run.stretches]
    found += [way.clearances.distance.min() for run in runs for way in run.travels]
    return float(min(found, default=np.inf))
