"""Where the arm comes from to each chunk of a part, said before any chunk is planned.

    q_before = beginnings(context, chunks)

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
from ..planning.station_search import Ends, StationSearch
from .chunking import Chunk

TRIED_TOGETHER = 8  # configurations at a time


def beginnings(context: Context, chunks: Sequence[Chunk]) -> list[Floats | None]:
    """Where the arm comes from to each chunk after the first.

    Args:
        context: what the part is planned with.
        chunks: of the part, in order; two at least.

    Returns:
        For each a configuration, (j,), rad, None where none is known.
    """
    first, stop = chunks[0].firsts[0], [*chunks[0].firsts[1:], chunks[0].stop][0]
    end = _end_of_quick_search(context, first, stop)
    ends = [chunk.firsts[0] - 1 for chunk in chunks[1:]]
    some = ends if end is not None else [stop - 1, *ends]
    nodes = nodes_at_rolls(
        context.solver, context.placed.rows(some), context.window, context.settings.roll_step, context.limits
    )
    q, found = context.span.start if end is None else end, []
    for i, of_target, cost in zip(some, nodes.q, nodes.cost, strict=True):
        allowed = np.isfinite(cost)
        q = _nearest(context, i, of_target[allowed], cost[allowed], q)
        found.append(q)
    return found[-len(ends) :]


def _end_of_quick_search(context: Context, first: int, stop: int) -> Floats | None:
    """Where a bead ends on the path that a quick search of it finds, (j,), rad; None where it finds none."""
    bead = SearchedBead.of(context, first, stop)
    if not StationSearch.suits(bead):
        return None
    path = StationSearch(bead, context.settings.roll_step, Ends(context.span.start)).cheapest_path()
    return None if path is None else path[2][-1]


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
