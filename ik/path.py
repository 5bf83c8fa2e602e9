"""One configuration per target along a bead, none of them a jump.

Nodes are target x roll x configuration; an edge joins neighbouring targets where the roll moves at most one sample, no
joint moves further than a motion without a flip does, and the joints are fast enough for the deposition. A dynamic programme finds the cheapest way through; where there is none it says
between which targets the way is cut::

    runs = best_runs(q, cost, times, speed, circular=True)
    for run in runs:                       # stretches that can be run through, in order
        run.start, run.nodes               # nodes (t, 3): roll, group, standing of every target

A group (a branch of the closed form) is never left inside a run. Radians.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .chain import Floats

Ints = NDArray[np.int64]
ROLL_COST = 0.05  # s a sample: a steady torch is better than a swinging one
LARGEST_STEP = np.deg2rad(60.0)  # a flip of wrist, elbow or shoulder turns some joint further
Edge = tuple[tuple[int, int, int], tuple[int, int, int]]


@dataclass(frozen=True, eq=False)
class Run:
    """A stretch of targets with one way through.

    Attributes:
        start: first target.
        nodes: (t, 3): sample of the roll, group, standing of each target.
        cost: what the way costs.
    """

    start: int
    nodes: Ints
    cost: float

    @property
    def stop(self) -> int:
        """One past the last target."""
        return self.start + len(self.nodes)


def best_runs(
    q: Floats,
    cost: Floats,
    times: Floats,
    speed: Floats,
    *,
    largest_step: float = LARGEST_STEP,
    circular: bool,
    blocked: Mapping[int, set[Edge]] | None = None,
    start_cost: Floats | None = None,
) -> list[Run]:
    """The cheapest ways along a bead, in as few runs as possible.

    Args:
        q: configurations, (t, r, g, k, n), rad; NaN where there is none.
        cost: cost of standing at a node, (t, r, g, k); infinite where it is not allowed.
        times: time the deposition takes from target i to i + 1, (t - 1,), s.
        speed: joint speed limits, (n,), rad/s.
        largest_step: most that any joint may move between neighbours, rad.
        circular: whether the first and the last roll are neighbours.
        blocked: edges that turned out impossible: ends of them by their first target.
        start_cost: added to the nodes of the first target, (r, g, k).

    Returns:
        Runs in order. Targets without any node belong to no run; two runs that touch are cut for want of an edge.
    """
    runs: list[Run] = []
    here = cost[0] if start_cost is None else cost[0] + start_cost
    start = 0
    back: list[Ints] = []
    for i in range(1, len(q) + 1):
        ways = None
        if i < len(q) and np.isfinite(here).any():
            forbidden = (blocked or {}).get(i - 1, set())
            ways = _forward(here, q[i - 1], q[i], times[i - 1], speed, largest_step, circular, forbidden)
            total = ways[0] + cost[i]
            if np.isfinite(total).any():
                here = total
                back.append(ways[1])
                continue
        if np.isfinite(here).any():
            runs.append(_trace(here, back, start))
        if i < len(q):
            here, start, back = cost[i], i, []
    return runs


def _forward(
    here: Floats,
    q0: Floats,
    q1: Floats,
    time: float,
    speed: Floats,
    largest_step: float,
    circular: bool,
    forbidden: set[Edge],
) -> tuple[Floats, Ints]:
    """Cost of arriving at every node of the next target, and where from (roll shift, standing)."""
    best = np.full(q1.shape[:-1], np.inf)
    origin = np.zeros((*q1.shape[:-1], 2), dtype=np.int64)
    for shift in (0, -1, 1) if len(here) > 1 else (0,):
        came = np.roll(here, shift, axis=0)
        from_q = np.roll(q0, shift, axis=0)
        if shift and not circular:
            came[0 if shift > 0 else -1] = np.inf
        # (r, g, k_to, k_from, n): standings of the same group alone
        move = np.abs(q1[:, :, :, None] - from_q[:, :, None])
        needed = (move / speed).max(axis=-1)
        price = needed + came[:, :, None] + ROLL_COST * abs(shift)
        allowed = (move.max(axis=-1) <= largest_step) & (needed <= time)  # NaN compares false
        price = np.where(allowed, price, np.inf)
        _forbid(price, shift, forbidden, len(here))
        k = np.argmin(price, axis=-1)
        arrived = np.take_along_axis(price, k[..., None], axis=-1)[..., 0]
        better = arrived < best
        best = np.where(better, arrived, best)
        origin[better] = np.stack([np.full_like(k, shift), k], axis=-1)[better]
    return best, origin


def _forbid(price: Floats, shift: int, forbidden: set[Edge], rolls: int) -> None:
    for (r0, g, k0), (r1, _, k1) in forbidden:
        if (r0 + shift) % rolls == r1:
            price[r1, g, k1, k0] = np.inf


def _trace(here: Floats, back: list[Ints], start: int) -> Run:
    node = np.unravel_index(int(np.argmin(here)), here.shape)
    total = float(here[node])
    nodes = [tuple(int(v) for v in node)]
    for origin in reversed(back):
        r, g, k = nodes[-1]
        shift, k_from = origin[r, g, k]
        nodes.append(((r - int(shift)) % len(here), g, int(k_from)))
    return Run(start, np.array(nodes[::-1], dtype=np.int64), total)
