"""Which configurations of a target lead to configurations of the next one, and what stops the others.

    kept = true_edges(bead, nodes, i, edges)          # those whose motion ends where they do
    why = why_none_leads_on(bead, nodes, i, cost)     # Failure(Kind.JOINT_LIMIT, measure=12.3, axis="A6")

Motions are tracked along the bead without collision checks. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ik.bead_path import Edge
from ik.chain import Floats
from ik.joint_turns import SLACK
from ik.singularity import margins

from ...arrays import Ints
from ...failure import Failure, Kind
from ..configurations import Nodes
from .edge_check import SearchedBead
from .edge_tracking import SAME_CONFIGURATION, EdgePoses, along, thinnest

GRID = np.linspace(0.0, 1.0, 9)  # places at which a way is begun to be tracked: closer where joints turn fast
MOST_WAYS = 600  # tracked together


@dataclass(frozen=True, eq=False)
class _TrackedMoves:
    """Motions that were tracked.

    Attributes:
        total: how far every joint turns, (w, j), rad; NaN where the arm cannot follow.
        low: least and
        high: greatest turn on the way, (w, j), rad.
        margin: least singularity margins between the ends, (w, 4).
    """

    total: Floats
    low: Floats
    high: Floats
    margin: Floats


def _track(bead: SearchedBead, i: int, roll: Floats, q: Floats) -> _TrackedMoves:
    """Follow ways from a target to the next: rolls at both ends (w, 2), configurations at the first (w, j)."""
    parts = []
    for first in range(0, len(q), MOST_WAYS):
        some = slice(first, first + MOST_WAYS)
        n = len(q[some])
        ways = EdgePoses.of(bead.placed, np.full(n, i), roll[some])
        edge, t = np.repeat(np.arange(n), len(GRID)), np.tile(GRID, n)
        edge, t, out = along(bead.context.solver, ways, q[some], edge, t)
        margin = margins(bead.context.solver.chain, bead.context.solver.geometry, out)
        margin[(t <= 0) | (t >= 1)] = np.inf
        at = np.searchsorted(edge, np.arange(n))
        last = np.append(at[1:], len(edge)) - 1
        turned = out - q[some][edge]
        step = np.abs(np.diff(out, axis=0, prepend=out[:1])).max(axis=1)
        step[at] = 0.0
        jumps = np.maximum.reduceat(np.where(np.isnan(step), np.inf, step), at) > 1.0
        total = np.where(jumps[:, None], np.nan, turned[last])
        parts.append(
            _TrackedMoves(
                total,
                np.fmin.reduceat(turned, at, axis=0),
                np.fmax.reduceat(turned, at, axis=0),
                np.fmin.reduceat(margin, at, axis=0),
            )
        )
    names = ("total", "low", "high", "margin")
    return _TrackedMoves(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def true_edges(bead: SearchedBead, nodes: Nodes, i: int, edges: Collection[Edge]) -> set[Edge]:
    """Edges along which the arm keeps its configuration, its limits and its margins.

    Args:
        bead: the bead.
        nodes: candidates of its targets.
        i: target that the edges leave.
        edges: their nodes.

    Returns:
        Those of them that hold, collisions aside.
    """
    every = sorted(edges)
    if not every:
        return set()
    at = np.array(every)  # (e, 2, 3)
    # configurations that differ by whole turns lead the same way
    _, first, which = np.unique(
        np.column_stack([at[:, 0, :2], at[:, 1, 0]]), axis=0, return_index=True, return_inverse=True
    )
    one = at[first]
    tracked = _track(bead, i, nodes.rolls[one[:, :, 0]], nodes.q[i][tuple(one[:, 0].T)])
    chain = bead.context.solver.chain
    q0, q1 = nodes.q[i][tuple(at[:, 0].T)], nodes.q[i + 1][tuple(at[:, 1].T)]
    w = which.reshape(-1)
    good = np.abs(q1 - q0 - tracked.total[w]).max(axis=1) <= SAME_CONFIGURATION
    good &= (q0 + tracked.low[w] >= chain.lower - SLACK).all(axis=1)
    good &= (q0 + tracked.high[w] <= chain.upper + SLACK).all(axis=1)
    good &= (tracked.margin[w] >= bead.context.limits.values(bead.context.solver.geometry is not None)).all(axis=1)
    return {every[k] for k in np.flatnonzero(good)}


def why_none_leads_on(bead: SearchedBead, nodes: Nodes, i: int, cost: Floats) -> Failure | None:
    """What stops the way that gets furthest, of those that leave a target's usable configurations at a steady roll.

    Args:
        bead: the bead.
        nodes: candidates of its targets.
        i: the target.
        cost: of the nodes as they are known by now, (t, r, g, k); infinite where they are of no use.

    Returns:
        The failure; None where nothing is known.
    """
    at = np.argwhere(np.isfinite(cost[i]))
    if not len(at):
        return None
    at = at[np.linspace(0, len(at) - 1, min(len(at), MOST_WAYS)).round().astype(np.int64)]
    q = nodes.q[i][tuple(at.T)]
    tracked = _track(bead, i, np.repeat(nodes.rolls[at[:, :1]], 2, axis=1), q)
    chain, solver = bead.context.solver.chain, bead.context.solver
    least = bead.context.limits.values(solver.geometry is not None)
    thin = (tracked.margin < least).any(axis=1)
    lost = np.isnan(tracked.total).any(axis=1)
    over = np.fmax(chain.lower - q - tracked.low, q + tracked.high - chain.upper)
    outside = (over > SLACK).any(axis=1)
    whole = ~(thin | lost | outside)
    hit = _in_the_way(bead, i, q[whole] + tracked.total[whole])
    if hit is not None:
        return hit
    only = np.flatnonzero(outside & ~thin & ~lost)
    if len(only):
        k = int(only[np.argmin(over[only].max(axis=1))])
        j = int(np.argmax(over[k]))
        return Failure(
            Kind.JOINT_LIMIT,
            measure=round(float(np.rad2deg(over[k, j])), 3),
            axis=chain.names[j],
            roll_deg=round(float(np.rad2deg(nodes.rolls[at[k, 0]])), 3),
        )
    if thin.any():
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(least > 0, tracked.margin / least, np.inf).min(axis=1)
        k = int(np.argmax(np.where(thin, share, -np.inf)))
        return thinnest(tracked.margin[k : k + 1], least)
    return Failure(Kind.UNREACHABLE) if lost.all() else None


def _in_the_way(bead: SearchedBead, i: int, q: Floats) -> Failure | None:
    """What is in the way at the next target of configurations (m, j) that ways end in, the one with most room."""
    if not len(q):
        return None
    context = bead.context
    deposits_laid: Ints = np.full(len(q), bead.deposits_before[i + 1])
    found = context.screen.clearances(bead.placed.axes(q, np.full(len(q), i + 1)), deposits_laid)
    k = int(np.argmax(found.distance))
    free: NDArray[np.bool_] = found.distance >= context.settings.clearance
    return None if free.any() else context.describe(found, k)
