"""Greedy walks along many stretches of polylines at once: how far the next segment of each may reach.

    walked = greedy_points(PolylineStretches(columns, begin, end, tolerance_mm, size2), min_segment_mm=3.0)

Every stretch is walked by itself: from its beginning the segment reaches as far as doubling, then halving finds the
line to stay within the tolerance of it, but no less than the least segment; the next one begins there. All stretches
take each step together, and all that they ask for in a step is examined in one go. Where rounding could decide, the
exact distance (`slicing.targets.chord_error.error`) does, so that what else is walked along changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..mesh.solid import Bools, Floats, Ints
from .chord_error import error

SLACK, ROUNDING = 1e-9, 1e-14  # of the squared tolerance, of the squared size: nearer than this `error` decides
SAME_DISTANCE = 1e-9  # relative: distances that rounding may change
POINTS_FIRST = 4  # points of a long segment that are examined before all of them are
MANY_POINTS = 200_000


@dataclass(frozen=True, eq=False)
class PolylineStretches:
    """Stretches of polylines, all points in one table.

    Attributes:
        columns: (3, n) coordinates of all lines' points, one line after the other, mm; each in one piece.
        begin: (s,) where each stretch begins.
        end: (s,) its last point.
        tolerance_mm: (s,) how far its line may stray from a segment.
        size2: (s,) squared size of its line, mm².
        at_once: points that are examined in one go: bounds the memory.
    """

    columns: Floats
    begin: Ints
    end: Ints
    tolerance_mm: Floats
    size2: Floats
    at_once: int = MANY_POINTS


def greedy_points(stretches: PolylineStretches, min_segment_mm: float) -> list[list[int]]:
    """Where the segments of each stretch begin.

    Args:
        stretches: what to walk along.
        min_segment_mm: least length of a segment but the last one of a stretch.

    Returns:
        By stretch the numbers of points, its beginning first, its end not among them.
    """
    chosen = [[k] for k in stretches.begin.tolist()]
    rows, at = np.arange(len(chosen)), stretches.begin.copy()
    while len(rows):
        to = _farthest(stretches, rows, at)
        short = np.flatnonzero((to < stretches.end[rows]) & ~_far(stretches.columns, at, to, min_segment_mm))
        for k in short.tolist():
            i, j, end = int(at[k]), int(to[k]), int(stretches.end[rows[k]])
            away = stretches.columns[:, j:end] - stretches.columns[:, i : i + 1]
            far = (away**2).sum(axis=0) >= min_segment_mm**2
            to[k] = j + int(np.argmax(far)) if far.any() else end
        on = to < stretches.end[rows]
        rows, at = rows[on], to[on]
        for row, k in zip(rows.tolist(), at.tolist(), strict=True):
            chosen[row].append(k)
    return chosen


def _far(columns: Floats, i: Ints, j: Ints, min_segment_mm: float) -> Bools:
    """Whether two points are farther apart than the least segment by more than rounding."""
    away2 = sum((column.take(j) - column.take(i)) ** 2 for column in columns)
    return np.asarray(away2 > (1.0 + SAME_DISTANCE) * min_segment_mm**2)


def _farthest(stretches: PolylineStretches, rows: Ints, at: Ints) -> Ints:
    """A last point (k,) for the segments of some stretches: doubling, then halving."""
    end = stretches.end[rows]
    good, reach = at + 1, np.full(len(rows), 2)
    growing = np.flatnonzero(at + reach < end)
    while len(growing):
        to = at[growing] + reach[growing]
        fits = _within(stretches, rows[growing], at[growing], to)
        growing, to = growing[fits], to[fits]
        good[growing] = to
        reach[growing] *= 2
        growing = growing[at[growing] + reach[growing] < end[growing]]
    bad = np.minimum(at + reach, end)
    last = np.flatnonzero(bad == end)
    last = last[_within(stretches, rows[last], at[last], end[last])]
    good[last], bad[last] = end[last], end[last]
    while len(left := np.flatnonzero(bad - good > 1)):
        middle = (good[left] + bad[left]) // 2
        fits = _within(stretches, rows[left], at[left], middle)
        good[left[fits]], bad[left[~fits]] = middle[fits], middle[~fits]
    return good


def _within(stretches: PolylineStretches, rows: Ints, i: Ints, j: Ints) -> Bools:
    """Whether lines stay within their tolerance of the segments from i to j."""
    out = np.ones(len(rows), dtype=bool)
    tolerance2 = stretches.tolerance_mm[rows] ** 2
    slack2 = SLACK * tolerance2 + ROUNDING * stretches.size2[rows]
    many = np.flatnonzero(j - i > 2 * POINTS_FIRST)
    if len(many):  # most that do not fit are found out by a few points
        step = (j[many] - i[many])[:, None] * np.arange(1, POINTS_FIRST + 1) // (POINTS_FIRST + 1)
        of = np.repeat(np.arange(len(many)), POINTS_FIRST)
        few = _off2(stretches.columns, i[many], j[many], of, (i[many, None] + step).ravel())
        out[many] = few.reshape(-1, POINTS_FIRST).max(axis=1) <= tolerance2[many] + slack2[many]
    left = np.flatnonzero(out & (j - i > 1))
    ends = np.cumsum((j - i - 1)[left])
    for low, high in _chunks(ends, stretches.at_once):
        some = left[low:high]
        count = (j - i - 1)[some]
        first = np.cumsum(count) - count
        of = np.repeat(np.arange(len(some)), count)
        off2 = _off2(stretches.columns, i[some], j[some], of, np.arange(len(of)) - first[of] + i[some][of] + 1)
        worst = np.maximum.reduceat(off2, first)
        out[some] = worst <= tolerance2[some]
        for k in np.flatnonzero(np.abs(worst - tolerance2[some]) <= slack2[some]).tolist():
            row = some[k]
            # rows as the line itself has them: sums over other strides round differently
            own = np.ascontiguousarray(stretches.columns[:, int(i[row]) : int(j[row]) + 1].T)
            out[row] = error(own) <= stretches.tolerance_mm[rows[row]]
    return out


def _chunks(ends: Ints, at_once: int) -> list[tuple[int, int]]:
    """Ranges of rows that hold about ``at_once`` points each, from how many the rows up to each hold."""
    if len(ends) == 0:
        return []
    cuts = np.unique(np.searchsorted(ends, np.arange(at_once, int(ends[-1]), at_once)) + 1)
    bounds = [0, *cuts[cuts < len(ends)].tolist(), len(ends)]
    return list(pairwise(bounds))


def _off2(columns: Floats, i: Ints, j: Ints, of: Ints, number: Ints) -> Floats:
    """Squared distances (n,) of points from segments i - j, each from that of a row."""
    start = [columns[k].take(i) for k in range(3)]
    way = [columns[k].take(j) - start[k] for k in range(3)]
    length2 = way[0] ** 2 + way[1] ** 2 + way[2] ** 2
    off = [columns[k].take(number) - start[k].take(of) for k in range(3)]
    a = [way[k].take(of) for k in range(3)]
    share = off[0] * a[0] + off[1] * a[1] + off[2] * a[2]
    share /= np.where(length2 > 0, length2, np.inf).take(of)
    np.clip(share, 0.0, 1.0, out=share)
    return np.asarray(sum((off[k] - share * a[k]) ** 2 for k in range(3)))
