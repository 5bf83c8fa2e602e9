"""One configuration per target along a bead, none of them a jump.

Nodes are target x roll x configuration; an edge joins neighbouring targets where the roll moves at most one sample, no
joint moves further than a motion without a flip does, and the joints are fast enough for the deposition. A dynamic
programme finds the cheapest way through; where there is none it says between which targets the way is cut::

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
OTHERS = (
    0.5  # of the time each joint needs, on top of the slowest joint's: what moves along for nothing is worth sparing
)
SHIFTS = np.array([0, -1, 1])  # samples of the roll between neighbours; standing still is preferred
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
    largest_step: float | Floats = LARGEST_STEP,
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
        largest_step: most that any joint may move between neighbours, rad; of each pair where they differ, (t - 1,).
        circular: whether the first and the last roll are neighbours.
        blocked: edges that turned out impossible: ends of them by their first target.
        start_cost: added to the nodes of the first target, (r, g, k).

    Returns:
        Runs in order. Targets without any node belong to no run; two runs that touch are cut for want of an edge.
    """
    blocked = blocked or {}
    largest = np.broadcast_to(largest_step, (len(q) - 1,))
    usable = np.isfinite(cost) & np.isfinite(q).all(axis=-1)
    price = np.moveaxis(np.where(usable, cost, np.inf), 1, -1)
    nodes = np.moveaxis(q, (1, -1), (-1, 1))  # (t, n, g, k, r): the roll, along which all are alike, runs fastest
    runs: list[Run] = []
    here = price[0] if start_cost is None else price[0] + np.nan_to_num(np.moveaxis(start_cost, 0, -1), nan=np.inf)
    start = 0
    back: list[Ints] = []
    for i in range(1, len(q) + 1):
        open_here = np.isfinite(here)
        if i < len(q) and open_here.any():
            ends = _Ends(nodes[i - 1], here, nodes[i], price[i])
            limits = _Limits(speed, float(times[i - 1]), float(largest[i - 1]), circular)
            arrived, origin = _forward(ends, limits, blocked.get(i - 1, set()))
            total = arrived + price[i]
            if np.isfinite(total).any():
                here = total
                back.append(origin)
                continue
        if open_here.any():
            runs.append(_trace(here, back, start))
        if i < len(q):
            here, start, back = price[i], i, []
    return runs


@dataclass(frozen=True, eq=False)
class _Ends:
    """Two neighbouring targets: configurations (n, g, k, r) and cost so far or to come (g, k, r)."""

    q0: Floats
    here: Floats
    q1: Floats
    price: Floats

    def shared(self) -> tuple[Ints, Ints, Ints]:
        """Groups open at both, and their standings open at the first and at the second."""
        a = np.any(np.isfinite(self.here), axis=-1)
        b = np.any(np.isfinite(self.price), axis=-1)
        g = np.flatnonzero(np.any(a, axis=1) & np.any(b, axis=1))
        return g, np.flatnonzero(a[g].any(axis=0)), np.flatnonzero(b[g].any(axis=0))


@dataclass(frozen=True, eq=False)
class _Limits:
    """What an edge has to keep; see :func:`best_runs`."""

    speed: Floats
    time: float
    largest_step: float
    circular: bool


def _forward(ends: _Ends, limits: _Limits, forbidden: set[Edge]) -> tuple[Floats, Ints]:
    """Cost of arriving at every node of the second target, and where from (g, k, r; a flat index of the same)."""
    shape = ends.here.shape
    best, origin = np.full(shape, np.inf), np.zeros(shape, dtype=np.int64)
    g, k0, k1 = ends.shared()
    if not len(g):
        return best, origin
    rolls = shape[-1]
    shifts = SHIFTS if rolls > 1 else SHIFTS[:1]
    # (n, g, k1, shift, k0, r): standings of the same group alone
    from_q = _shifted(ends.q0[:, g[:, None], k0], shifts, limits.circular)[:, :, None]
    to_q = ends.q1[:, g[:, None], k1][:, :, :, None, None]
    came = _shifted(ends.here[g[:, None], k0], shifts, limits.circular)
    came += ROLL_COST * np.abs(shifts)[:, None, None]
    needed, total, furthest = _moves(from_q, to_q, limits.speed)
    allowed = (furthest <= limits.largest_step) & (needed <= limits.time)  # NaN compares false
    price = np.where(allowed, move_price(needed, total) + came[:, None], np.inf)
    _forbid(price, forbidden, (g, k0, k1), shifts)
    price = price.reshape(len(g), len(k1), -1, rolls)
    choice = np.argmin(price, axis=2)
    where = g[:, None], k1
    best[where] = np.take_along_axis(price, choice[:, :, None], axis=2)[:, :, 0]
    shift, k = np.divmod(choice, len(k0))
    r = (np.arange(rolls) - shifts[shift]) % rolls
    origin[where] = np.ravel_multi_index((np.broadcast_to(g[:, None, None], r.shape), k0[k], r), shape)
    return best, origin


def _shifted(values: Floats, shifts: Ints, circular: bool) -> Floats:
    """Values (..., k, r) as seen from a roll ``shift`` samples on, (..., shift, k, r); infinite beyond an open end."""
    source = (np.arange(values.shape[-1]) - shifts[:, None]) % values.shape[-1]
    out = np.ascontiguousarray(np.swapaxes(values[..., source], -3, -2))
    if not circular:
        for i, s in enumerate(shifts):
            if s:
                out[..., i, :, 0 if s > 0 else -1] = np.inf
    return out


def move_price(slowest: Floats, total: Floats) -> Floats:
    """What a motion costs, s: the time of its slowest joint, and a share of the times of all joints added up."""
    return slowest + OTHERS * total


def _moves(from_q: Floats, to_q: Floats, speed: Floats) -> tuple[Floats, Floats, Floats]:
    """Time that the slowest joint needs and those of all added up, s; the furthest turn, rad; joints along axis 0."""
    furthest = np.abs(to_q[0] - from_q[0])
    needed = furthest / speed[0]
    total = needed.copy()
    for j in range(1, len(to_q)):
        move = np.abs(to_q[j] - from_q[j])
        np.maximum(furthest, move, out=furthest)
        move /= speed[j]
        total += move
        np.maximum(needed, move, out=needed)
    return needed, total, furthest


def _forbid(price: Floats, forbidden: set[Edge], kept: tuple[Ints, Ints, Ints], shifts: Ints) -> None:
    """Take edges out of the prices (g, k1, shift, k0, r) of the groups and standings that are kept."""
    g_at, k0_at, k1_at = ({int(v): i for i, v in enumerate(values)} for values in kept)
    rolls = price.shape[-1]
    for (r0, g, k0), (r1, _, k1) in forbidden:
        if g in g_at and k0 in k0_at and k1 in k1_at:
            for i, shift in enumerate(shifts):
                if (r0 + shift) % rolls == r1:
                    price[g_at[g], k1_at[k1], i, k0_at[k0], r1] = np.inf


def _trace(here: Floats, back: list[Ints], start: int) -> Run:
    """The way that ends cheapest, (g, k, r) followed back and reported as (r, g, k)."""
    by_roll = np.moveaxis(here, -1, 0)
    r, g, k = (int(v) for v in np.unravel_index(int(np.argmin(by_roll)), by_roll.shape))
    total = float(here[g, k, r])
    nodes = [(r, g, k)]
    for origin in reversed(back):
        g, k, r = (int(v) for v in np.unravel_index(int(origin[g, k, r]), here.shape))
        nodes.append((r, g, k))
    return Run(start, np.array(nodes[::-1], dtype=np.int64), total)
