"""One configuration per target along a bead, none of them a jump.

Nodes are target x roll x configuration; an edge joins neighbouring targets where the roll moves at most one sample (or
as far as :class:`Allowance` says), no joint moves further than is allowed, and the joints are fast enough for the
deposition. A dynamic programme finds the cheapest path; where there is none it says between which targets the path is
cut::

    runs = best_runs(q, cost, times, speed, circular=True)
    for run in runs:                       # stretches with one continuous path, in order
        run.start, run.nodes               # nodes (t, 3): roll, branch, whole turns of every target

A branch of the closed form is never left inside a run. Radians.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .chain import Floats
from .roll import wrap

Ints = NDArray[np.int64]
Origins = NDArray[np.int32]
ROLL_COST = 0.05  # s a sample: a steady torch is better than a swinging one
OTHERS = (
    0.5  # of the time each joint needs, on top of the slowest joint's: what moves along for nothing is worth sparing
)
SHIFTS = np.array([0, -1, 1])  # samples of the roll between neighbours; no change is preferred
LARGEST_STEP = np.deg2rad(60.0)  # a flip of wrist, elbow or shoulder turns some joint further
COSTLY = 10.0  # s: what is tried last, a large turn of a joint or a speed that is not held
TOGETHER = 1 << 16  # prices of moves that are worked out at once
KEPT_BYTES = 100_000_000  # of prices that are kept for the next search
SPANS = np.array([1, 2, 3, 5, 8, 13, 21, 34, 55, 89])  # samples that the roll may change by where it turns freely
Edge = tuple[tuple[int, int, int], tuple[int, int, int]]


@dataclass(frozen=True, eq=False)
class Run:
    """A stretch of targets with one continuous path.

    Attributes:
        start: first target.
        nodes: (t, 3): sample of the roll, branch, whole turns of each target.
        cost: what the way costs.
    """

    start: int
    nodes: Ints
    cost: float

    @property
    def stop(self) -> int:
        """One past the last target."""
        return self.start + len(self.nodes)


@dataclass(frozen=True, eq=False)
class Allowance:
    """Moves of the roll that an edge may make at a cost.

    Attributes:
        usual_step: a joint that moves further makes an edge expensive, (t - 1,), rad.
        usual_time: edges whose joints take longer are expensive, (t - 1,), s.
        rolls: samples of the roll, ascending, (r,), rad; None: the roll moves one sample at most.
        turn: most that the roll may move, rad.
        turn_price: of moving it, s/rad.
    """

    usual_step: Floats
    usual_time: Floats
    rolls: Floats | None = None
    turn: float = 0.0
    turn_price: float = 0.0

    def shifts(self) -> tuple[Ints, Floats]:
        """Samples that the roll may change by, (s,), and what each costs at the sample it leads to, (s, r), s."""
        if self.rolls is None:
            return SHIFTS, ROLL_COST * np.abs(SHIFTS)[:, None] + np.zeros(1)
        count = len(self.rolls)
        spans = SPANS[count // 2 >= SPANS]
        shifts = np.concatenate([[0], np.stack([-spans, spans], axis=1).ravel()]) if count > 1 else SHIFTS[:1]
        turn = np.abs(wrap(self.rolls - self.rolls[(np.arange(count) - shifts[:, None]) % count]))
        price = np.where(turn <= self.turn + 1e-9, self.turn_price * turn, np.inf)
        some = np.isfinite(price).any(axis=1)
        return shifts[some], price[some]


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
    allowance: Allowance | None = None,
    known: KnownMoves | None = None,
) -> list[Run]:
    """The cheapest paths along a bead, in as few runs as possible.

    Args:
        q: configurations, (t, r, g, k, n), rad; NaN where there is none.
        cost: cost of a node, (t, r, g, k); infinite where it is not allowed.
        times: time the deposition takes from target i to i + 1, (t - 1,), s.
        speed: joint speed limits, (n,), rad/s.
        largest_step: most that any joint may move between neighbours, rad; of each pair where they differ, (t - 1,).
        circular: whether the first and the last roll are neighbours.
        blocked: edges that turned out impossible: ends of them by their first target.
        start_cost: added to the nodes of the first target, (r, g, k).
        allowance: what edges may do at a price; None: nothing.
        known: what searches of the same configurations with the same limits have worked out, to which is added what is
            worked out here; None: nothing.

    Returns:
        Runs in order. Targets without any node belong to no run; two runs that touch are cut for want of an edge.
    """
    blocked = blocked or {}
    largest = np.broadcast_to(largest_step, (len(q) - 1,))
    allowance = allowance or Allowance(largest, times)
    usual = allowance.usual_step, allowance.usual_time
    shifts, turning = allowance.shifts() if q.shape[1] > 1 else (SHIFTS[:1], np.zeros((1, 1)))
    usable = np.isfinite(cost) & np.isfinite(q).all(axis=-1)
    price = np.moveaxis(np.where(usable, cost, np.inf), 1, -1)
    nodes = np.moveaxis(q, (1, -1), (-1, 1))  # (t, n, g, k, r): the roll, along which all are alike, runs fastest
    limits = _Limits(speed, times, largest, *usual, shifts, turning, circular)
    passing = _Passing(nodes, price, limits, known)
    runs: list[Run] = []
    here = price[0] if start_cost is None else price[0] + np.nan_to_num(np.moveaxis(start_cost, 0, -1), nan=np.inf)
    start = 0
    back: list[Origins] = []
    for i in range(1, len(q) + 1):
        open_here = np.isfinite(here)
        if i < len(q) and open_here.any():
            arrived, origin = passing.edge(i - 1, here, blocked.get(i - 1, set()))
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
class _Limits:
    """What edges have to keep; see :func:`best_runs`. Times and steps are of every edge, (t - 1,)."""

    speed: Floats
    time: Floats
    largest_step: Floats
    usual_step: Floats
    usual_time: Floats
    shifts: Ints
    turning: Floats
    circular: bool


@dataclass(frozen=True, eq=False)
class _EdgePrices:
    """What the moves of neighbouring edges of the bead cost: of a few nodes each, many are priced at once.

    Attributes:
        start: the first of the edges.
        stop: one past the last.
        kept: branches open at both ends, and the turns of theirs open at the first and at the second.
        price: of the moves, (e, g, k1, shift, k0, r); infinite where an edge is not allowed.
        expensive: what is added where it is, (e, g, k1, shift, k0, r); None where none is expensive.
    """

    start: int
    stop: int
    kept: tuple[Ints, Ints, Ints]
    price: Floats
    expensive: Floats | None

    def has(self, i: int, here: Floats, there: Floats) -> bool:
        """Whether an edge is among them with all that leads from nodes to nodes: their costs (g, k, r)."""
        if not self.start <= i < self.stop:
            return False
        a, b = (np.any(np.isfinite(cost), axis=-1) for cost in (here, there))  # (g, k)
        both = np.any(a, axis=1) & np.any(b, axis=1)
        needed = both, np.any(a[both], axis=0), np.any(b[both], axis=0)
        return all(np.isin(np.flatnonzero(n), some).all() for n, some in zip(needed, self.kept, strict=True))

    @classmethod
    def none(cls) -> _EdgePrices:
        """Of no edge."""
        no = np.zeros(0, dtype=np.int64)
        return cls(0, 0, (no, no, no), np.zeros(0), None)

    @classmethod
    def of(cls, nodes: Floats, ends: tuple[Floats, Floats], some: slice, limits: _Limits) -> _EdgePrices:
        """Price some edges.

        Args:
            nodes: configurations of all targets, (t, n, g, k, r), rad.
            ends: cost of what the edges begin in and end in, (e, g, k, r); infinite where nothing does.
            some: which edges.
            limits: of all edges.
        """
        a, b = (np.any(np.isfinite(end), axis=-1) for end in ends)  # (e, g, k)
        g = np.flatnonzero(np.any(np.any(a, axis=2) & np.any(b, axis=2), axis=0))
        k0, k1 = (np.flatnonzero(np.any(end[:, g], axis=(0, 1))) for end in (a, b))
        kept = g, k0, k1
        if not len(g):
            return cls(some.start, some.stop, kept, np.zeros(0), None)
        # (n, e, g, k1, shift, k0, r): turns of the same branch alone
        q0, q1 = (np.swapaxes(nodes[s], 0, 1) for s in (some, slice(some.start + 1, some.stop + 1)))
        from_q = _shifted(q0[:, :, g[:, None], k0], limits.shifts, limits.circular)[:, :, :, None]
        to_q = q1[:, :, g[:, None], k1][:, :, :, :, None, None]
        needed, total, furthest = _moves(from_q, to_q, limits.speed)
        time, largest, step, usual = (
            u[some].reshape(-1, 1, 1, 1, 1, 1)
            for u in (limits.time, limits.largest_step, limits.usual_step, limits.usual_time)
        )
        allowed = (furthest <= largest) & (needed <= time)  # NaN compares false
        price = np.where(allowed, move_price(needed, total), np.inf)
        over = allowed & ((furthest > step) | (needed > usual))
        if not over.any():
            return cls(some.start, some.stop, kept, price, None)
        late = np.maximum(needed[over] / np.broadcast_to(usual, over.shape)[over] - 1.0, 0.0)
        expensive = np.zeros(price.shape)
        expensive[over] = COSTLY + COSTLY * late
        return cls(some.start, some.stop, kept, price, expensive)

    def forward(self, i: int, here: Floats, forbidden: set[Edge], limits: _Limits) -> tuple[Floats, Origins]:
        """Cost of arriving at every node of the edge's second target, and where from (g, k, r; a flat index)."""
        shape, (g, k0, k1) = here.shape, self.kept
        best, origin = np.full(shape, np.inf), np.zeros(shape, dtype=np.int32)
        if not len(g):
            return best, origin
        rolls, shifts = shape[-1], limits.shifts
        came = _shifted(here[g[:, None], k0], shifts, limits.circular)
        came += limits.turning[:, None, :]
        price = self.price[i - self.start] + came[:, None]
        if self.expensive is not None:
            price += self.expensive[i - self.start]
        _forbid(price, forbidden, self.kept, shifts)
        price = price.reshape(len(g), len(k1), -1, rolls)
        choice = np.argmin(price, axis=2)
        where = g[:, None], k1
        best[where] = price.min(axis=2)
        shift, k = np.divmod(choice, len(k0))
        r = (np.arange(rolls) - shifts[shift]) % rolls
        origin[where] = np.ravel_multi_index((np.broadcast_to(g[:, None, None], r.shape), k0[k], r), shape)
        return best, origin


@dataclass(frozen=True, eq=False)
class _KeptArray:
    """An array as few of whose values as there are that differ from all others."""

    shape: tuple[int, ...]
    others: float
    index: NDArray[np.int32]
    values: Floats

    @classmethod
    def of(cls, array: Floats, others: float) -> _KeptArray:
        index = np.flatnonzero(array != others).astype(np.int32)
        return cls(array.shape, others, index, array.ravel()[index])

    def array(self) -> Floats:
        out = np.full(self.shape, self.others)
        out.ravel()[self.index] = self.values
        return out

    @property
    def nbytes(self) -> int:
        return self.index.nbytes + self.values.nbytes


@dataclass(frozen=True, eq=False)
class _PassedEdge:
    """An edge as a search has passed it.

    Attributes:
        here: cost of being at the nodes of its first target, (g, k, r).
        there: which nodes of its second target were allowed, (g, k, r).
        forbidden: moves that were blocked.
        arrived: cost of arriving at the nodes of its second target, (g, k, r).
        origin: where from, (g, k, r); a flat index.
    """

    here: Floats
    there: NDArray[np.bool_]
    forbidden: frozenset[Edge]
    arrived: Floats
    origin: Origins

    def is_passed_alike(self, here: Floats, there: Floats, forbidden: set[Edge]) -> bool:
        """Whether a search passes it so once more: with costs (g, k, r) of nodes and moves that are blocked."""
        return (
            self.forbidden == forbidden
            and np.array_equal(self.here, here)
            and not (np.isfinite(there) & ~self.there).any()
        )

    @property
    def nbytes(self) -> int:
        return self.here.nbytes + self.there.nbytes + self.arrived.nbytes + self.origin.nbytes


class KnownMoves:
    """What is known of a bead that is searched again and again with ever fewer nodes and moves.

    That is what moves cost that have been priced, and how each edge was passed last: up to the first node or move that
    is left out since, a search goes as the one before.
    """

    def __init__(self, most_bytes: int = KEPT_BYTES) -> None:
        """Know nothing yet.

        Args:
            most_bytes: that are kept of either.
        """
        self._edges: dict[int, tuple[_EdgePrices, _KeptArray, _KeptArray | None]] = {}
        self._passed: dict[int, _PassedEdge] = {}
        self._bytes_left = self._bytes_left_of_passed = most_bytes

    def passed(self, i: int, here: Floats, there: Floats, forbidden: set[Edge]) -> tuple[Floats, Origins] | None:
        """What came of an edge when it was passed last, as of ``_EdgePrices.forward``; None where it was not alike."""
        last = self._passed.get(i)
        return (
            (last.arrived, last.origin) if last is not None and last.is_passed_alike(here, there, forbidden) else None
        )

    def keep_passed(
        self, i: int, here: Floats, there: Floats, forbidden: set[Edge], found: tuple[Floats, Origins]
    ) -> None:
        """Keep how an edge is passed in place of how it was, as far as there is room."""
        one = _PassedEdge(here, np.isfinite(there), frozenset(forbidden), *found)
        last = self._passed.get(i)
        room = one.nbytes - (0 if last is None else last.nbytes)
        if room <= self._bytes_left_of_passed:
            self._bytes_left_of_passed -= room
            self._passed[i] = one

    def of_edge(self, i: int, here: Floats, there: Floats) -> _EdgePrices | None:
        """Prices of an edge with all that leads from nodes to nodes; None where they are not known."""
        if i not in self._edges:
            return None
        bare, price, expensive = self._edges[i]
        if not bare.has(i, here, there):
            return None
        return replace(bare, price=price.array(), expensive=None if expensive is None else expensive.array())

    def keep(self, edges: _EdgePrices) -> None:
        """Keep some, as far as there is room."""
        price = _KeptArray.of(edges.price, np.inf)
        expensive = None if edges.expensive is None else _KeptArray.of(edges.expensive, 0.0)
        room = price.nbytes + (0 if expensive is None else expensive.nbytes)
        if room <= self._bytes_left:
            self._bytes_left -= room
            bare = replace(edges, price=np.zeros(0), expensive=None)
            self._edges.update((i, (bare, price, expensive)) for i in range(edges.start, edges.stop))


class _Passing:
    """Passes one edge of a bead after the other, with what is known of it."""

    def __init__(self, nodes: Floats, price: Floats, limits: _Limits, known: KnownMoves | None) -> None:
        """Prepare.

        Args:
            nodes: configurations, (t, n, g, k, r), rad.
            price: cost of a node, (t, g, k, r); infinite where it is not allowed.
            limits: of all edges.
            known: as of :func:`best_runs`.
        """
        self._nodes, self._price, self._limits, self._known = nodes, price, limits, known
        self._edges = _EdgePrices.none()
        moves = price[0].size * price.shape[2] * len(limits.shifts)  # of an edge
        self._together = max(TOGETHER // moves, 1)

    def edge(self, i: int, here: Floats, forbidden: set[Edge]) -> tuple[Floats, Origins]:
        """As of ``_EdgePrices.forward``."""
        known, there = self._known, self._price[i + 1]
        found = None if known is None else known.passed(i, here, there, forbidden)
        if found is not None:
            return found
        if i >= self._edges.stop:
            self._edges = self._priced(i, here)
        found = self._edges.forward(i, here, forbidden, self._limits)
        if known is not None:
            known.keep_passed(i, here, there, forbidden, found)
        return found

    def _priced(self, i: int, here: Floats) -> _EdgePrices:
        """Prices of an edge, and of as many after it as are priced at once."""
        price, known = self._price, self._known
        seen = None if known is None else known.of_edge(i, here, price[i + 1])
        if seen is None:
            some = slice(i, min(i + self._together, len(price) - 1))
            begun = here[None] if self._together == 1 else price[some]
            seen = _EdgePrices.of(self._nodes, (begun, price[some.start + 1 : some.stop + 1]), some, self._limits)
            if known is not None:
                known.keep(seen)
        return seen


def _shifted(values: Floats, shifts: Ints, circular: bool) -> Floats:
    """Values (..., k, r) as seen from a roll ``shift`` samples on, (..., shift, k, r); infinite beyond an open end."""
    source = (np.arange(values.shape[-1]) - shifts[:, None]) % values.shape[-1]
    out = np.ascontiguousarray(np.swapaxes(values[..., source], -3, -2))
    if not circular:
        for i, s in enumerate(shifts):
            if s:
                out[..., i, :, slice(None, s) if s > 0 else slice(s, None)] = np.inf
    return out


def move_price(slowest: Floats, total: Floats) -> Floats:
    """Cost of a motion, s: the time of its slowest joint, plus a share of the sum of all joints' times."""
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
    """Take edges out of the prices (g, k1, shift, k0, r) of the branches and turns that are kept."""
    g_at, k0_at, k1_at = ({int(v): i for i, v in enumerate(values)} for values in kept)
    rolls = price.shape[-1]
    for (r0, g, k0), (r1, _, k1) in forbidden:
        if g in g_at and k0 in k0_at and k1 in k1_at:
            for i, shift in enumerate(shifts):
                if (r0 + shift) % rolls == r1:
                    price[g_at[g], k1_at[k1], i, k0_at[k0], r1] = np.inf


def _trace(here: Floats, back: list[Origins], start: int) -> Run:
    """The way that ends cheapest, (g, k, r) followed back and reported as (r, g, k)."""
    by_roll = np.moveaxis(here, -1, 0)
    r, g, k = (int(v) for v in np.unravel_index(int(np.argmin(by_roll)), by_roll.shape))
    total = float(here[g, k, r])
    nodes = [(r, g, k)]
    for origin in reversed(back):
        g, k, r = (int(v) for v in np.unravel_index(int(origin[g, k, r]), here.shape))
        nodes.append((r, g, k))
    return Run(start, np.array(nodes[::-1], dtype=np.int64), total)
