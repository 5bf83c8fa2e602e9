"""One chunk of a plan run in time and checked as it is run.

    found = run_chunk(shared, run)
    found.rows, found.row_failures, found.rounded, found.samples

Rows are put in where beads need them, corners are rounded, rows get their times. How near it comes between samples is
asked for later, when it is known how near the rest of the part comes. Radians, metres, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..failure import Failure
from ..planning.assemble import RunBeads, TimedBeads, corners, timed
from ..planning.edges.densify import densified
from .chunking import Shared
from .least_values import LeastValue, RunSamples, least_margin, least_sigma, nearest_sample, samples_of


@dataclass(frozen=True, eq=False)
class ChunkRun:
    """What became of a chunk when it was run.

    Attributes:
        rows: with their times.
        row_failures: what is wrong with rows that were put in, by target.
        rounded: what is wrong with rounded corners, by target.
        samples: all of it; None where something is wrong or there is nothing.
        at_samples: least clearance at the samples.
        singularity: least margin.
        sigma: smallest singular value of the scaled Jacobian.
    """

    rows: TimedBeads
    row_failures: dict[int, Failure]
    rounded: dict[int, Failure]
    samples: RunSamples | None
    at_samples: LeastValue | None
    singularity: LeastValue | None
    sigma: float | None


def run_chunk(shared: Shared, run: RunBeads) -> ChunkRun:
    """Run one chunk.

    Args:
        shared: the part and what it was planned with.
        run: the chunk's beads and the ways to them.

    Returns:
        What became of it.
    """
    context = shared.context
    stretches, row_failures = densified(context, run.stretches)
    run = RunBeads(tuple(stretches), run.travels, run.before, run.home)
    rounded = corners(shared.job, context, run)
    samples = samples_of(context, run)
    return ChunkRun(
        rows=timed(shared.job, run),
        row_failures=row_failures,
        rounded=rounded,
        samples=None if row_failures or rounded else samples,
        at_samples=nearest_sample(context, samples),
        singularity=least_margin(context, stretches),
        sigma=least_sigma(context, stretches),
    )
