"""Which points of a finely sampled curve become robot targets: few, true to it, not too close together.

    chosen = break_points(points, seam=0, chord_tolerance_mm=0.3, min_segment_mm=3.0)

Points are only ever chosen, never made up, so that targets lie on the exact curve. In this order of
importance:

1. No segment (straight from target to target) is shorter than min_segment, unless the loop is too small for a
   closed polygon of three such segments; then it gets three targets a third of its length apart.
2. The curve stays within chord_tolerance of each segment. Where the two conflict (a blade's edge, rounder
   than min_segment can follow) the least segment wins: it is what the robot can do.
3. Corners sharper than CORNER_DEG are targets, the sharpest first, as far as rule 1 allows.
4. As few targets as a greedy walk from the seam finds.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from slicing.part import Bools, Floats, Ints

CORNER_DEG = 30.0
SPACING_MM = 0.02  # points of the fine curve closer than this are thinned out first
LEAST_TARGETS = 3  # of a closed bead, so that it goes round


def break_points(points: Floats, seam: int, chord_tolerance_mm: float, min_segment_mm: float) -> Ints:
    """Choose the targets of one closed bead.

    Args:
        points: (n, 3) the fine curve, closed, the first point not repeated, mm.
        seam: where to start.
        chord_tolerance_mm: greatest distance of the fine curve from a segment.
        min_segment_mm: least distance between successive targets.

    Returns:
        Numbers of the chosen points in the order of travel, the seam first and not repeated.
    """
    order = np.roll(np.arange(len(points)), -seam)
    order = order[_thinned(points[order])]
    loop = np.concatenate([points[order], points[order[:1]]])
    n = len(order)
    fixed = _corners(loop, min_segment_mm)
    chosen = []
    for begin, end in zip(fixed, [*fixed[1:], n], strict=True):
        chosen += _section(loop, begin, end, chord_tolerance_mm, min_segment_mm)
    if len(chosen) < LEAST_TARGETS:
        chosen = _thirds(loop)
    return order[np.array(chosen, dtype=np.int64)]


def open_break_points(
    points: Floats, chord_tolerance_mm: float, min_segment_mm: float, stops: Sequence[int] = ()
) -> Ints:
    """Choose the targets of one open bead.

    Args:
        points: (n, 3) the fine curve from end to end, mm.
        chord_tolerance_mm: greatest distance of the fine curve from a segment.
        min_segment_mm: least distance between successive targets; a shorter bead has its two ends.
        stops: numbers of points that are targets whatever their distance.

    Returns:
        Numbers of the chosen points in the order of travel, both ends among them.
    """
    n = len(points)
    ends = sorted({0, n - 1, *(k for k in stops if 0 <= k < n)})
    chosen: list[int] = []
    for first, last in pairwise(ends):
        run = np.arange(first, last + 1)
        run = run[_thinned_open(points[run])]
        line = points[run]
        fixed = _corners(line, min_segment_mm)
        for begin, end in zip(fixed, [*fixed[1:], len(run) - 1], strict=True):
            chosen += run[_section(line, begin, end, chord_tolerance_mm, min_segment_mm)].tolist()
    return np.array([*chosen, n - 1], dtype=np.int64)


def _thinned_open(points: Floats) -> Ints:
    """The same as `_thinned`, both ends kept."""
    kept = _thinned(points)
    last = len(points) - 1
    if kept[-1] == last:
        return kept
    near = len(kept) > 1 and _distance(points[kept[-1]], points[last]) < SPACING_MM
    return np.append(kept[:-1] if near else kept, last)


def corner_flags(points: Floats) -> Bools:
    """Where a closed polyline (n, 3) turns by more than CORNER_DEG."""
    out = np.roll(points, -1, axis=0) - points
    out /= np.maximum(np.sqrt((out**2).sum(axis=1)), 1e-300)[:, None]
    return (out * np.roll(out, 1, axis=0)).sum(axis=1) < np.cos(np.radians(CORNER_DEG))


def _thinned(points: Floats) -> Ints:
    """Numbers of points at least about SPACING_MM apart; all of them on a very small curve."""
    length = np.append(0.0, np.cumsum(np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))))
    step = np.floor(length / SPACING_MM)
    kept = np.flatnonzero(np.append(True, np.diff(step) > 0))
    return kept if len(kept) >= 8 else np.arange(len(points))


def _distance(a: Floats, b: Floats) -> float:
    return float(np.sqrt(((a - b) ** 2).sum()))


def _corners(loop: Floats, min_segment_mm: float) -> list[int]:
    """The seam and the corners that keep min_segment from their neighbours, the sharpest taken first."""
    points = loop[:-1]
    n = len(points)
    out = np.diff(loop, axis=0)
    out /= np.maximum(np.sqrt((out**2).sum(axis=1)), 1e-300)[:, None]
    cosine = (out * np.roll(out, 1, axis=0)).sum(axis=1)
    sharp = np.flatnonzero(cosine < np.cos(np.radians(CORNER_DEG)))
    fixed = [0]
    for corner in sharp[np.argsort(np.round(cosine[sharp], 6), kind="stable")].tolist():
        at = bisect_left(fixed, corner)
        before, after = fixed[at - 1], fixed[at] if at < len(fixed) else n
        near = min(_distance(loop[before], loop[corner]), _distance(loop[corner], loop[after]))
        if corner not in (before, after % n) and near >= min_segment_mm:
            insort(fixed, corner)
    return fixed


def _error(loop: Floats, i: int, j: int) -> float:
    """Greatest distance of the curve from i to j from the segment between them."""
    if j <= i + 1:
        return 0.0
    between, a = loop[i + 1 : j] - loop[i], loop[j] - loop[i]
    length2 = float(a @ a)
    t = np.clip(between @ a / length2, 0.0, 1.0) if length2 > 0 else np.zeros(len(between))
    off = between - t[:, None] * a
    return float(np.sqrt((off * off).sum(axis=1).max()))


def _farthest(loop: Floats, i: int, end: int, tolerance: float) -> int:
    """A last point that the segment from i may reach: doubling, then halving."""
    good, reach = i + 1, 2
    while i + reach < end and _error(loop, i, i + reach) <= tolerance:
        good, reach = i + reach, 2 * reach
    bad = min(i + reach, end)
    if bad == end and _error(loop, i, end) <= tolerance:
        return end
    while bad - good > 1:
        middle = (good + bad) // 2
        if _error(loop, i, middle) <= tolerance:
            good = middle
        else:
            bad = middle
    return good


def _section(loop: Floats, begin: int, end: int, tolerance: float, min_segment: float) -> list[int]:
    """Break points from begin up to, not including, end."""
    chosen = [begin]
    while True:
        i = chosen[-1]
        j = _farthest(loop, i, end, tolerance)
        if j < end:
            far = np.flatnonzero(((loop[j:end] - loop[i]) ** 2).sum(axis=1) >= min_segment**2)
            j = j + int(far[0]) if len(far) else end
        if j >= end:
            break
        chosen.append(j)
    # the last segment may have come out short: move its start back, or drop it
    while len(chosen) > 1 and _distance(loop[chosen[-1]], loop[end]) < min_segment:
        before = chosen[-2]
        chosen.pop()
        moved = _between(loop, before, end, min_segment)
        if moved is not None:
            chosen.append(moved)
            break
    return chosen


def _between(loop: Floats, i: int, j: int, min_segment: float) -> int | None:
    """The point between i and j, min_segment from both, that serves both segments best."""
    inner = np.arange(i + 1, j)
    far = ((loop[inner] - loop[i]) ** 2).sum(axis=1) >= min_segment**2
    far &= ((loop[inner] - loop[j]) ** 2).sum(axis=1) >= min_segment**2
    inner = inner[far]
    if len(inner) == 0:
        return None
    inner = inner[:: max(1, len(inner) // 16)]
    errors = [max(_error(loop, i, int(k)), _error(loop, int(k), j)) for k in inner]
    return int(inner[int(np.argmin(errors))])


def _thirds(loop: Floats) -> list[int]:
    """Three points a third of the length apart, of a loop too small for more."""
    length = np.append(0.0, np.cumsum(np.sqrt((np.diff(loop, axis=0) ** 2).sum(axis=1))))
    n = len(loop) - 1
    second = int(np.clip(np.argmin(np.abs(length - length[-1] / 3)), 1, n - 2))
    third = int(np.clip(np.argmin(np.abs(length - 2 * length[-1] / 3)), second + 1, n - 1))
    return [0, second, third]
