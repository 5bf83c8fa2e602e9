"""Where the arm comes from to each chunk of a part, said before any chunk is planned.

    lost, q_before = beginnings(context, chunks)

The end of the part's first bead is known from a quick search that does not follow the arm from target to target. From
there on, the arm is followed from chunk to chunk: at the last target before each, in the free configuration that is
nearest to where it was before. So neighbours begin in one configuration, as they would if each were planned after the
other. Radians and metres.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ik.chain import Floats

from ..planning.configurations import nodes_at_rolls
from ..planning.context import Context
from ..planning.edges.edge_check import UNLIMITED_SPEED, SearchedBead
from ..planning.part_plan import first_bead
from ..planning.station_search import Ends, StationSearch
from .chunking import Chunk

TRIED_TOGETHER = 8  # configurations at a time


def beginnings(context: Context, chunks: Sequence[Chunk]) -> tuple[bool, list[Floats | None]]:
    """Whether the first bead is lost, and where the arm comes from to each chunk after the first.

    Args:
        context: what the part is planned with.
        chunks: of the part, in order; two at least.

    Returns:
        Whether the part is known to be lost by its first bead; and for each chunk after the first a configuration,
        (j,), rad, None where none is known.
    """
    lost, q = _end_of_first_bead(context, chunks[0], 1 / len(chunks))
    found: list[Floats | None] = []
    before = [chunk.firsts[0] - 1 for chunk in chunks[1:]]
    nodes = nodes_at_rolls(
        context.solver, context.placed.rows(before), context.window, context.settings.roll_step, context.limits
    )
    for i, of_target, cost in zip(before, nodes.q, nodes.cost, strict=True):
        some = np.isfinite(cost)
        q = _nearest(context, i, of_target[some], cost[some], q)
        found.append(q)
    return lost, found


def _end_of_first_bead(context: Context, chunk: Chunk, share: float) -> tuple[bool, Floats | None]:
    """Whether the first bead is lost, and where it is expected to end, (j,), rad; None where nothing is known of it.

    A bead of which a quick search finds no path is planned as its chunk will plan it.
    """
    firsts, start = chunk.firsts, context.span.start
    stop = firsts[1] if len(firsts) > 1 else chunk.stop
    bead = SearchedBead.of(context, firsts[0], stop)
    if StationSearch.suits(bead):
        path = StationSearch(bead, context.settings.roll_step, Ends(start)).cheapest_path()
        if path is not None:
            return False, path[2][-1]
    plan = first_bead(context, firsts[0], stop, start, share)
    if plan is None:
        return False, start
    return not plan.whole, plan.stretches[-1].q_targets[-1] if plan.stretches else start


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
