"""Pieces of curve that follow one another, put together to closed curves.

    curves = assembled(start, end, samples)          # of one surface
    curves_by_level(start, end, level, levels, samples)     # of many surfaces at once

Pieces carry the names of the nodes that they run between; neighbours agree on those, so no distance is ever
compared. Everything but the walk from piece to piece is done on whole arrays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.solid import Floats, Ints
from .ellipse_arcs import Samples

SAME_POINT_MM = 1e-5  # points of a loop closer than this are one
MANY_PIECES = 5000  # from here on a walk from piece to piece in Python is slower than scipy's


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve on a layer's surface, sampled on the exact curve.

    Attributes:
        points: (n, 3) mm, part frame; a closed curve does not repeat its first point.
        closed: the last point is joined to the first.
        hole: the curve bounds a hole (it runs clockwise seen from outside).
        area_mm2: signed area to the left of the curve on its surface, exact (not that of the polyline). For a
            loop that winds round the axis: minus the integral of z along the arc length, so that sums over a
            layer still hold.
        winding: turns about the axis of its surface (0 but for rings).
    """

    points: Floats
    closed: bool
    hole: bool
    area_mm2: float = 0.0
    winding: int = 0

    @property
    def length_mm(self) -> float:
        """Length of the polyline, mm."""
        ends = np.roll(self.points, -1, axis=0) if self.closed else self.points[1:]
        steps = ends - self.points[: len(ends)]
        return float(np.sqrt((steps**2).sum(axis=1)).sum())


def assembled(start: Ints, end: Ints, samples: Samples) -> list[Curve]:
    """Curves of pieces that follow one another, on one surface.

    Args:
        start: (p,) node each piece starts at, as `chain` takes it.
        end: (p,) node each piece ends at.
        samples: points along the pieces.

    Returns:
        Closed curves; loops smaller than the rounding are dropped.
    """
    return curves_by_level(start, end, np.zeros(len(start), dtype=np.int64), 1, samples)[0]


def curves_by_level(start: Ints, end: Ints, level: Ints, levels: int, samples: Samples) -> list[list[Curve]]:
    """Curves of pieces on many surfaces.

    Args:
        start: (p,) node each piece starts at, as `chain` takes it; nodes of different surfaces differ.
        end: (p,) node each piece ends at.
        level: (p,) number of the surface each piece lies on.
        levels: how many surfaces there are.
        samples: points along the pieces.

    Returns:
        For every surface its closed curves, in the order of their first pieces; loops smaller than the
        rounding are dropped.
    """
    found: list[list[Curve]] = [[] for _ in range(levels)]
    if len(start) == 0:
        return found
    order, first = cycles(_following(start, end))
    count = np.diff(samples.first)[order]
    begin = np.append(0, np.cumsum(count))
    rows = np.repeat(samples.first[order] - begin[:-1], count) + np.arange(begin[-1])
    columns = np.stack([column.take(rows) for column in samples.points.T])
    edges = begin[np.append(first, len(order))]  # where each loop's points begin, and the end
    points, edges = _distinct(columns, edges)
    area = np.add.reduceat(samples.area[order], first).tolist()
    winding = np.rint(np.add.reduceat(samples.turn[order], first) / (2 * np.pi)).astype(np.int64).tolist()
    rows_of = zip(level[order[first]].tolist(), edges[:-1].tolist(), edges[1:].tolist(), area, winding, strict=True)
    for place, low, high, signed, turns in rows_of:
        if high - low >= 3:  # else smaller than the rounding: not a curve
            found[place].append(Curve(points[low:high], True, turns == 0 and signed < 0, signed, turns))
    return found


def chain(start: Ints, end: Ints) -> list[Ints]:
    """Loops of pieces: each piece is followed by the one that starts where it ends.

    Args:
        start: (p,) node each piece starts at; -1 for a piece that is a loop by itself.
        end: (p,) node each piece ends at. Every node is the start of as many pieces as it is the end of.

    Returns:
        One array of piece numbers a loop.
    """
    if len(start) == 0:
        return []
    order, first = cycles(_following(start, end))
    return np.split(order, first[1:])


def _following(start: Ints, end: Ints) -> Ints:
    """The piece that comes after each piece, (p,)."""
    number = np.arange(len(start))
    owner = np.full(int(max(start.max(), end.max())) + 2, -1, dtype=np.int64)
    owner[start] = number
    alone = start < 0
    following = np.where(alone, number, owner[end])
    reached = np.zeros(len(start), dtype=bool)
    reached[following] = True
    if reached.all() and (following >= 0).all() and (alone | (owner[start] == number)).all():
        return following
    # an edge with more than two faces: several pieces start at one node, and each gets one that ends there
    by_start, by_end = np.argsort(start, kind="stable"), np.argsort(end, kind="stable")
    if not (start[by_start] == end[by_end]).all():
        raise AssertionError("the pieces of a curve do not close: the mesh is not closed")
    following = np.empty(len(start), dtype=np.int64)
    following[by_end] = by_start
    following[alone] = np.flatnonzero(alone)
    return following


def cycles(following: Ints) -> tuple[Ints, Ints]:
    """The cycles of a permutation.

    Args:
        following: (p,) what comes after each number.

    Returns:
        (p,) all numbers, cycle after cycle in their order, each from its least number on; and where each cycle
        begins.
    """
    if len(following) > MANY_PIECES:
        return _cycles_in_parallel(following)
    after, seen = following.tolist(), bytearray(len(following))
    order: list[int] = []
    first: list[int] = []
    append, begin = order.append, 0
    while begin >= 0:
        first.append(len(order))
        number = begin
        while not seen[number]:
            seen[number] = 1
            append(number)
            number = after[number]
        begin = seen.find(0, begin)
    return np.array(order, dtype=np.int64), np.array(first, dtype=np.int64)


def _cycles_in_parallel(following: Ints) -> tuple[Ints, Ints]:
    """The same without a Python loop: all cycles at once, breadth first from their least numbers, then sorted."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    n = len(following)
    graph = csr_array((np.ones(n), following.astype(np.int32), np.arange(n + 1, dtype=np.int32)), shape=(n, n))
    count, label = connected_components(graph)
    least = np.empty(count, dtype=np.int64)
    least[label[::-1]] = np.arange(n - 1, -1, -1)  # of equal places the last one written stays
    by_least = np.argsort(least)
    place = np.empty(count, dtype=np.int32)
    place[by_least] = np.arange(count)
    # one more number, which all cycles follow
    to = np.concatenate([following, least[by_least]]).astype(np.int32)
    rows = np.append(np.arange(n + 1), n + count).astype(np.int32)
    reached = breadth_first_order(csr_array((np.ones(n + count), to, rows), shape=(n + 1, n + 1)), n)[0][1:]
    # the fewer bytes, the faster it sorts
    of = place.astype(np.min_scalar_type(count))[label[reached]]
    order = reached[np.argsort(of, kind="stable")].astype(np.int64)
    return order, np.append(0, np.cumsum(np.bincount(of, minlength=count))[:-1])


def _distinct(columns: Floats, edges: Ints) -> tuple[Floats, Ints]:
    """Drop points that repeat their predecessor in their loop (crossings at a vertex).

    Args:
        columns: (3, n) points of all loops.
        edges: (l + 1,) where each loop begins, and the end.

    Returns:
        The points (m, 3) that are left, and where the loops begin among them.
    """
    length2 = np.zeros(columns.shape[1])
    for column in columns:
        step = np.diff(column, prepend=0.0)
        step[edges[:-1]] = column[edges[:-1]] - column[edges[1:] - 1]
        step *= step
        length2 += step
    kept = length2 > SAME_POINT_MM**2
    if kept.all():
        return np.ascontiguousarray(columns.T), edges
    left = np.flatnonzero(kept)
    return np.ascontiguousarray(columns.take(left, axis=1).T), np.append(0, np.cumsum(kept))[edges]
