"""Which points of a finely sampled curve become targets: few, within a tolerance, not too close together.

    (chosen,) = chosen_points([BeadLine(points, closed=True, tolerance_mm=0.3)], min_segment_mm=3.0)

Targets are always points of the curve, so that they lie on it exactly. In this order of importance:

1. No segment (straight from target to target) is shorter than min_segment, unless the loop is too small for a
   closed polygon of three such segments; then it gets three targets a third of its length apart.
2. The curve stays within chord_tolerance of each segment. Where the two conflict (a blade's edge, rounder
   than min_segment can follow) the least segment wins: it is what the robot can do.
3. Corners sharper than CORNER_DEG are targets, the sharpest first, as far as rule 1 allows.
4. As few targets as a greedy walk from the seam finds.
"""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..mesh.solid import Bools, Floats, Ints
from .chord_error import error, errors_through
from .greedy_walk import PolylineStretches, greedy_points

CORNER_DEG = 30.0
SPACING_MM = 0.02  # points of the fine curve closer than this are thinned out first
ALIKE_MM = 1e-6  # errors that rounding may change
FEW_POINTS = 8  # points of so small a curve are not thinned out
LEAST_TARGETS = 3  # of a closed bead, so that it goes round


@dataclass(frozen=True, eq=False)
class BeadLine:
    """A bead's fine curve.

    Attributes:
        points: (n, 3) mm; of a closed one the first is not repeated.
        closed: whether it ends where it starts, at its first point.
        tolerance_mm: greatest distance of the fine curve from a segment.
        stops: numbers of points that are targets whatever their distance.
    """

    points: Floats
    closed: bool
    tolerance_mm: float
    stops: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class _PointsToWalk:
    """Points to walk along, from stop to stop or all the way round.

    Attributes:
        number: (m,) of the points in their line, thinned.
        line: (m, 3) or, all the way round, (m + 1, 3) with the first point once more.
        fixed: places in it that are targets.
        round: whether it goes all the way round.
    """

    number: Ints
    line: Floats
    fixed: list[int]
    round: bool


def chosen_points(lines: Sequence[BeadLine], min_segment_mm: float) -> list[Ints]:
    """Choose the targets of beads, all of them in step.

    Args:
        lines: their fine curves.
        min_segment_mm: least distance between successive targets; an open bead shorter than that has its two ends.

    Returns:
        By line the numbers of the chosen points in the order of travel: of open ones both ends, of closed ones the
        first point and not once more.
    """
    runs = [list(_runs(line, min_segment_mm)) for line in lines]
    walked = iter(_walked([(run, line.tolerance_mm) for line, some in zip(lines, runs, strict=True) for run in some],
                          min_segment_mm))  # fmt: skip
    out = []
    for line, some in zip(lines, runs, strict=True):
        found: list[int] = []
        for run in some:
            places = next(walked)
            if run.round and len(places) < LEAST_TARGETS:
                places = _thirds(run.line)
            found += run.number[np.array(places, dtype=np.int64)].tolist()
        if not line.closed:
            found.append(len(line.points) - 1)
        out.append(np.array(found, dtype=np.int64))
    return out


def _runs(line: BeadLine, min_segment_mm: float) -> Iterator[_PointsToWalk]:
    """What of a line is walked by itself."""
    n = len(line.points)
    if line.closed and not line.stops:
        number = _thinned(line.points)
        loop = line.points[np.append(number, number[0])]
        yield _PointsToWalk(number, loop, _corners(loop, min_segment_mm), True)
        return
    points = np.concatenate([line.points, line.points[:1]]) if line.closed else line.points
    last_one = len(points) - 1
    for first, last in pairwise(sorted({0, last_one, *(k for k in line.stops if 0 <= k <= last_one)})):
        if last == first + 1:  # nothing between them
            yield _PointsToWalk(np.array([first % n, last % n]), points[first : last + 1], [0], False)
            continue
        number = np.arange(first, last + 1)
        number = number[_thinned_open(points[number])]
        own = points[number]
        yield _PointsToWalk(number % n, own, _corners(own, min_segment_mm), False)


def _walked(runs: Sequence[tuple[_PointsToWalk, float]], min_segment_mm: float) -> Iterator[list[int]]:
    """By run the places of its targets, its last point not among them."""
    if not runs:
        return
    first = np.cumsum([0, *(len(run.line) for run, _ in runs)])
    pieces = [list(pairwise([*run.fixed, len(run.line) - 1])) for run, _ in runs]
    of = np.repeat(np.arange(len(runs)), [len(some) for some in pieces])
    begin, end = (np.array([ends[k] for some in pieces for ends in some], dtype=np.int64) + first[of] for k in (0, 1))
    tolerance = np.array([tolerance_mm for _, tolerance_mm in runs])[of]
    size2 = np.array([float((np.ptp(run.line, axis=0) ** 2).sum()) for run, _ in runs])[of]
    columns = np.ascontiguousarray(np.concatenate([run.line for run, _ in runs]).T)
    walked = iter(greedy_points(PolylineStretches(columns, begin, end, tolerance, size2), min_segment_mm))
    for (run, _), some, base in zip(runs, pieces, first.tolist(), strict=False):
        places: list[int] = []
        for _, last in some:
            places += _ended(run.line, [k - base for k in next(walked)], last, min_segment_mm)
        yield places


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
    if len(points) < FEW_POINTS:
        return np.arange(len(points))
    way = points[1:] - points[:-1]
    step = np.zeros(len(points))
    np.floor(np.cumsum(np.sqrt(np.einsum("ij,ij->i", way, way))) / SPACING_MM, out=step[1:])
    kept = np.append(0, np.flatnonzero(step[1:] > step[:-1]) + 1)
    return kept if len(kept) >= FEW_POINTS else np.arange(len(points))


def _distance(a: Floats, b: Floats) -> float:
    return float(np.sqrt(((a - b) ** 2).sum()))


def _corners(loop: Floats, min_segment_mm: float) -> list[int]:
    """The seam and the corners that keep min_segment from their neighbours, the sharpest taken first."""
    points = loop[:-1]
    n = len(points)
    if n == 1:
        return [0]
    out = loop[1:] - loop[:-1]
    out /= np.maximum(np.sqrt(np.einsum("ij,ij->i", out, out)), 1e-300)[:, None]
    cosine = np.empty(n)
    cosine[0] = float(out[0] @ out[-1])
    np.einsum("ij,ij->i", out[1:], out[:-1], out=cosine[1:])
    sharp = np.flatnonzero(cosine < np.cos(np.radians(CORNER_DEG)))
    fixed = [0]
    for corner in sharp[np.argsort(np.round(cosine[sharp], 6), kind="stable")].tolist():
        at = bisect_left(fixed, corner)
        before, after = fixed[at - 1], fixed[at] if at < len(fixed) else n
        near = min(_distance(loop[before], loop[corner]), _distance(loop[corner], loop[after]))
        if corner not in (before, after % n) and near >= min_segment_mm:
            insort(fixed, corner)
    return fixed


def _ended(line: Floats, chosen: list[int], end: int, min_segment: float) -> list[int]:
    """A walk whose last segment may have come out short: its start moved back, or dropped."""
    while len(chosen) > 1 and _distance(line[chosen[-1]], line[end]) < min_segment:
        before = chosen[-2]
        chosen.pop()
        moved = _between(line, before, end, min_segment)
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
    errors = errors_through(loop, i, inner, j)
    best = inner[errors <= errors.min() + ALIKE_MM]
    if len(best) > 1:  # on symmetric curves two are alike but for rounding
        exact = [max(error(loop[i : k + 1]), error(loop[k : j + 1])) for k in best.tolist()]
        return int(best[int(np.argmin(exact))])
    return int(best[0])


def _thirds(loop: Floats) -> list[int]:
    """Three points a third of the length apart, of a loop too small for more."""
    length = np.append(0.0, np.cumsum(np.sqrt((np.diff(loop, axis=0) ** 2).sum(axis=1))))
    n = len(loop) - 1
    second = int(np.clip(np.argmin(np.abs(length - length[-1] / 3)), 1, n - 2))
    third = int(np.clip(np.argmin(np.abs(length - 2 * length[-1] / 3)), second + 1, n - 1))
    return [0, second, third]
