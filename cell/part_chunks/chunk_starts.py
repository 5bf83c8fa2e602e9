"""Where the arm comes from to each chunk of a part, said before any chunk is planned.

    known, q_before = beginnings(context, chunks)

The part's first bead is planned, at no more cost than as one of its chunk. From its end on, the arm is followed from
chunk to chunk: at the last target before each, in the free configuration that is nearest to where it was before. So
neighbours begin in one configuration, as they would if each were planned after the other. Radians and metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ik.chain import Floats

from ..planning.bead_runs import BeadRun, KnownBead
from ..planning.configurations import nodes_at_rolls
from ..planning.context import Context
from ..planning.edges.edge_check import UNLIMITED_SPEED
from ..planning.part_plan import known_bead
from .chunking import Chunk

TRIED_TOGETHER = 8  # configurations at a time


def beginnings(context: Context, chunks: Sequence[Chunk]) -> tuple[KnownBead | None, list[Floats | None]]:
    """The first bead, and where the arm comes from to each chunk.

    Args:
        context: what the part is planned with.
        chunks: of the part, in order; two at least.

    Returns:
        The plan of the first bead, None where it is postponed; and for each chunk a configuration, (j,), rad, None
        where none is known.
    """
    first, start = chunks[0], context.span.start
    known = _first_bead(context, first.firsts, first.stop, 1 / len(chunks))
    stretches = () if known is None else known.bead.stretches
    q = stretches[-1].q_targets[-1] if stretches else start
    found: list[Floats | None] = [start]
    before = [chunk.firsts[0] - 1 for chunk in chunks[1:]]
    nodes = nodes_at_rolls(
        context.solver, context.placed.rows(before), context.window, context.settings.roll_step, context.limits
    )
    for i, of_target, cost in zip(before, nodes.q, nodes.cost, strict=True):
        some = np.isfinite(cost)
        q = _nearest(context, i, of_target[some], cost[some], q)
        found.append(q)
    return known, found


def with_first_bead(context: Context, run: BeadRun) -> BeadRun:
    """The first chunk with its first bead planned, as :func:`beginnings` plans it.

    Args:
        context: what the part is planned with.
        run: the chunk.

    Returns:
        The chunk, to be planned.
    """
    known = _first_bead(context, run.firsts, run.stop, run.share)
    return replace(run, known=known, lost=is_lost(known))


def is_lost(known: KnownBead | None) -> bool:
    """Whether the part is lost by its first bead."""
    return known is not None and not known.bead.whole


def _first_bead(context: Context, firsts: Sequence[int], stop: int, share: float) -> KnownBead | None:
    """The first bead of the part, and of its first chunk."""
    stop = firsts[1] if len(firsts) > 1 else stop
    return known_bead(context, firsts[0], stop, context.span.start, share)


def _nearest(context: Context, i: int, q: Floats, cost: Floats, q_before: Floats | None) -> Floats | None:
    """Of configurations (m, j) of a target the free one that is reached first; with none, whence it would have been."""
    if q_before is not None:
        speed = context.solver.chain.max_speed
        cost = cost + (np.abs(q - q_before) / np.where(np.isfinite(speed), speed, UNLIMITED_SPEED)).max(axis=1)
    q = q[np.argsort(cost, kind="stable")]
    for k in range(0, len(q), TRIED_TOGETHER):
        tried = q[k : k + TRIED_TOGETHER]
        axes = context.placed.axes(tried, np.full(len(tried), i))
        seen = context.screen.clearances(axes, np.full(len(tried), context.deposits_before[i]))
        free = np.flatnonzero(seen.distance >= context.settings.clearance)
        if len(free):
            return np.asarray(tried[free[0]])
    return q_before
