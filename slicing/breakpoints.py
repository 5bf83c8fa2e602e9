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
from slicing.reach import Reach

CORNER_DEG = 30.0
SPACING_MM = 0.02  # points of the fine curve closer than this are thinned out first
SAME = 1e-9  # relative: distances that rounding may change
ALIKE_MM = 1e-6  # errors that rounding may change
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
    fixed, reach = _corners(loop, min_segment_mm), Reach(loop, chord_tolerance_mm)
    chosen = []
    for begin, end in zip(fixed, [*fixed[1:], n], strict=True):
        chosen += _section(reach, begin, end, min_segment_mm)
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
        fixed, reach = _corners(line, min_segment_mm), Reach(line, chord_tolerance_mm)
        for begin, end in zip(fixed, [*fixed[1:], len(run) - 1], strict=True):
            chosen += run[_section(reach, begin, end, min_segment_mm)].tolist()
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


def _section(reach: Reach, begin: int, end: int, min_segment: float) -> list[int]:
    """Break points from begin up to, not including, end."""
    loop, chosen = reach.line, [begin]
    while True:
        i = chosen[-1]
        j = reach.farthest(i, end)
        if j < end and not _far(loop, i, j, min_segment):
            far = np.flatnonzero(((loop[j:end] - loop[i]) ** 2).sum(axis=1) >= min_segment**2)
            j = j + int(far[0]) if len(far) else end
        if j >= end:
            break
        chosen.append(j)
    # the last segment may have come out short: move its start back, or drop it
    while len(chosen) > 1 and _distance(loop[chosen[-1]], loop[end]) < min_segment:
        before = chosen[-2]
        chosen.pop()
        moved = _between(reach, before, end, min_segment)
        if moved is not None:
            chosen.append(moved)
            break
    return chosen


def _far(loop: Floats, i: int, j: int, min_segment: float) -> bool:
    """Whether two points are farther apart than the least segment by more than rounding."""
    (ax, ay, az), (bx, by, bz) = loop[i].tolist(), loop[j].tolist()
    away2: float = (bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2
    return away2 > (1.0 + SAME) * min_segment**2


def _between(reach: Reach, i: int, j: int, min_segment: float) -> int | None:
    """The point between i and j, min_segment from both, that serves both segments best."""
    loop, inner = reach.line, np.arange(i + 1, j)
    far = ((loop[inner] - loop[i]) ** 2).sum(axis=1) >= min_segment**2
    far &= ((loop[inner] - loop[j]) ** 2).sum(axis=1) >= min_segment**2
    inner = inner[far]
    if len(inner) == 0:
        return None
    inner = inner[:: max(1, len(inner) // 16)]
    errors = reach.errors_through(i, inner, j)
    best = inner[errors <= errors.min() + ALIKE_MM]
    if len(best) > 1:  # on symmetric curves two are alike but for rounding
        exact = [max(reach.error(i, int(k)), reach.error(int(k), j)) for k in best]
        return int(best[int(np.argmin(exact))])
    return int(best[0])


def _thirds(loop: Floats) -> list[int]:
    """Three points a third of the length apart, of a loop too small for more."""
    length = np.append(0.0, np.cumsum(np.sqrt((np.diff(loop, axis=0) ** 2).sum(axis=1))))
    n = len(loop) - 1
    second = int(np.clip(np.argmin(np.abs(length - length[-1] / 3)), 1, n - 2))
    third = int(np.clip(np.argmin(np.abs(length - 2 * length[-1] / 3)), second + 1, n - 1))
    return [0, second, third]
