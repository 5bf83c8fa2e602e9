"""Beads that fill a flat region: rounds along its border, and one bead along the middle of thin places.

    strokes = contour_rounds(island, 2.5, pitch_mm=3.75, width_mm=5.0, rounds=None)      # in its chart

The border of the region is the edge of the material ("edge") or the centre line of the outermost bead ("centre"):
the first round runs half a width inside it, or on it. Every further round runs a pitch = width * (1 - overlap) inside
the one before. `contour_parallel` goes on until nothing is left. Where a core remains that is wider than what the last
round covers, one more round is laid half a pitch inside it, and a bead along its middle if it is long and narrow.
`zigzag` lays parallel lines inside the rounds (`slicing.beads.zigzag`).

Where the region is thinner than one and a half pitches, one bead runs along its middle: the excess metal of two beads
would be more than the metal that one bead lacks. Where the region is narrower than a bead, the bead is wider than the
region. A place too small even for that gets its border as a bead. Both are marked `thin`. In walls of a few beads the
distance of the rounds is fitted to the wall (`fitted_pitch`). Rounds of a ring close round the body.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ..mesh.solid import Floats
from .middle_lines import distances, middle_lines
from .regions import Island

ROUND_MM = 0.002  # sagitta of the rounds about inner corners
SMOOTH_MM = 0.002  # rounds are simplified to this
NARROW = 0.2  # short places with less room than this share of a width are left
ONE_BEAD = 1.5  # walls thinner than so many pitches get one bead along the middle: two would lay more metal too much
SHORT = 1.0  # places shorter than so many widths do not count as walls
MOST_FITTED = 12  # beads across up to which their distance is fitted to the wall
FITTED = 1e-3  # share of a width to which a wall's width is found
SLIVER = 0.02  # share of a width: half of what is no round's region any more
LEAST_FITTED = 0.5  # share of the pitch that a fitted distance keeps
THIN_MM = 0.02  # nearer to a border than half a width by more than this, a bead stands out
LEAST_GAP = 0.02  # uncovered areas below this share of width² are left as they are


@dataclass(frozen=True, eq=False)
class Stroke:
    """The centre line of a bead in a chart.

    Attributes:
        line: (n, 2) mm; a closed one does not repeat its first point.
        closed: whether it ends where it starts.
        hole: whether it runs round a hole.
        kind: "contour" for rounds along the border, "infill" for what fills them.
        shift: a whole turn (period, 0) for a closed stroke that goes right round, else (0, 0).
        thin: whether the place is narrower than the bead.
        corners: numbers of points where straight lines end.
    """

    line: Floats
    closed: bool
    hole: bool
    kind: str
    shift: tuple[float, float] = (0.0, 0.0)
    thin: bool = False
    corners: tuple[int, ...] = ()


def contour_rounds(
    island: Island, first_mm: float, pitch_mm: float, width_mm: float, rounds: int | None, fills: bool = True
) -> Iterator[Stroke]:
    """Rounds along the border of an island, from the outside inward.

    Args:
        island: what to fill.
        first_mm: how far inside the border the first one runs.
        pitch_mm: distance of the next from it.
        width_mm: of the beads.
        rounds: how many; None fills the whole island.
        fills: whether what the rounds leave between each other, or between them and what fills the rest a pitch
            inside the last one, gets beads of its own.

    Yields:
        The outermost round as contours, the others as infill (all as contours where rounds is given).
    """
    x0, y0, x1, y1 = island.region.bounds
    island = island.repeated(0.5 * min(x1 - x0, y1 - y0) + _beyond(island, width_mm))
    inset, k = wide_part(island.region, first_mm, pitch_mm, width_mm), 0
    while not inset.is_empty and (rounds is None or k < rounds):
        kind = "contour" if k == 0 or rounds is not None else "infill"
        yield from _loops(inset, island, kind)
        k += 1
        after = inner_part(island.region, first_mm + k * pitch_mm)
        if fills:
            after = _rooms(_without_narrow(after, 0.5 * pitch_mm, width_mm), 0.5 * pitch_mm, width_mm)
            between = list(_between_rounds(island, inset, after, pitch_mm, width_mm))
            yield from between
            yield from _core(island, inset, after, pitch_mm, width_mm, between)
        inset = after


def wide_part(region: Any, first_mm: float, pitch_mm: float, width_mm: float) -> Any:
    """Where the first round of a region runs: not where one bead along the middle fits the wall better than two.

    Args:
        region: shapely, mm.
        first_mm: how far inside the border the first round runs.
        pitch_mm: what a bead fills of a wall's thickness.
        width_mm: of the beads.

    Returns:
        The region inset by first_mm, without places where the region is thinner than ONE_BEAD pitches.
    """
    return _without_narrow(inner_part(region, first_mm), ONE_BEAD * pitch_mm - 2.0 * first_mm, width_mm)


def _without_narrow(inset: Any, least_mm: float, width_mm: float) -> Any:
    """A region without its places thinner than least_mm, unless they are short; what is left stays as it is."""
    import shapely

    if least_mm <= 0.0 or inset.is_empty:
        return inset
    opened = inset.buffer(-0.5 * least_mm).buffer(0.5 * least_mm + 1e-3, join_style="mitre")
    narrow = [part for part in shapely.get_parts(inset.difference(opened)) if part.geom_type == "Polygon"]
    narrow = [part for part in narrow if 0.5 * part.length > SHORT * width_mm]
    if not narrow:
        return inset
    return only_areas(inset.difference(shapely.union_all(narrow).buffer(1e-3)))


def _greatest_width(region: Any, most_mm: float, width_mm: float) -> float:
    """Greatest width of a region, mm; at most most_mm."""
    region = region.simplify(FITTED * width_mm)
    low, high = 0.0, most_mm
    if not region.buffer(-0.5 * high, quad_segs=4).is_empty:
        return most_mm
    while high - low > FITTED * width_mm:
        middle = 0.5 * (low + high)
        if region.buffer(-0.5 * middle, quad_segs=4).is_empty:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def _rooms(region: Any, least_mm: float, width_mm: float) -> Any:
    """The polygons of a region that are wider than least_mm somewhere, or compact and no mere slivers."""
    import shapely

    parts = shapely.get_parts(region)
    wide = ~shapely.is_empty(shapely.buffer(parts, -0.5 * least_mm))
    short = 0.5 * shapely.length(parts) <= SHORT * width_mm
    dots = short & ~shapely.is_empty(shapely.buffer(parts, -SLIVER * width_mm))
    return region if wide.all() else shapely.union_all(parts[wide | dots])


def fitted_pitch(island: Island, first_mm: float, pitch_mm: float, width_mm: float) -> tuple[float, int]:
    """The distance of rounds at which a whole number of beads fits an island, where that is a wall.

    As many beads go across its widest place as lay the metal nearest to what fills it, at most a width apart.

    Args:
        island: what to fill.
        first_mm: how far inside the border the first round runs.
        pitch_mm: what a bead fills.
        width_mm: of the beads.

    Returns:
        The distance, mm, and the number of beads across the widest place.
    """
    _, y0, _, y1 = island.region.bounds
    most = (MOST_FITTED + 1) * pitch_mm
    across = _greatest_width(island.repeated(min(y1 - y0, most)).region, most, width_mm)
    if across < ONE_BEAD * pitch_mm:
        return pitch_mm, 1
    room = across - 2.0 * first_mm
    count = max(round(across / pitch_mm), math.ceil(room / width_mm - 1e-6) + 1, 2)
    if count > MOST_FITTED:
        return pitch_mm, count
    return max(room / (count - 1), LEAST_FITTED * pitch_mm), count


def _beyond(island: Island, width_mm: float) -> float:
    """How far beyond its middle period a ring has to be repeated, mm: erosion ends at half the ring's height."""
    _, y0, _, y1 = island.region.bounds
    return 4.0 * min(width_mm, y1 - y0)


def inner_part(region: Any, by_mm: float) -> Any:
    """The region's points at least so far inside its border."""
    import shapely

    if by_mm <= 0.0:
        return region
    quarter = max(math.ceil(0.25 * math.pi / math.acos(max(1.0 - ROUND_MM / by_mm, 0.5))), 4)
    inner = region.buffer(-by_mm, quad_segs=quarter)
    return only_areas(shapely.simplify(inner, SMOOTH_MM))


def only_areas(geometry: Any) -> Any:
    """A geometry without its parts that are no polygons."""
    import shapely

    parts = shapely.get_parts(geometry)
    return shapely.union_all([part for part in parts if part.geom_type == "Polygon" and part.area > 1e-9])


def _between_rounds(island: Island, inset: Any, after: Any, pitch_mm: float, width_mm: float) -> Iterator[Stroke]:
    """Gaps between a round and the next that are long and wide enough for a bead of their own."""
    import shapely

    rest = inner_part(inset, 0.5 * pitch_mm).difference(after.buffer(0.5 * pitch_mm * (1 + 1e-3) + 1e-3))
    for part in shapely.get_parts(rest):
        if part.geom_type != "Polygon" or part.buffer(-0.25 * pitch_mm).is_empty:
            continue
        strokes = list(_along_middle(part, island, width_mm, "infill"))
        if sum(_whole(stroke).length for stroke in strokes) > width_mm:
            yield from strokes


def _core(
    island: Island, inset: Any, after: Any, pitch_mm: float, width_mm: float, laid: Sequence[Stroke]
) -> Iterator[Stroke]:
    """The core that a round, the next and the beads between them leave uncovered: room for one more round."""
    import shapely

    bare = inner_part(inset, 0.5 * width_mm).difference(after.buffer(0.5 * width_mm))
    if laid and not bare.is_empty:
        lines = [_whole(stroke, k * (island.chart.period or 0.0)) for stroke in laid for k in _periods(island)]
        bare = bare.difference(shapely.union_all(lines).buffer(0.5 * width_mm))
    bare = [part for part in shapely.get_parts(bare) if part.area > LEAST_GAP * width_mm**2]
    if not bare:
        return
    near = shapely.union_all(bare).buffer(0.5 * width_mm)
    for stroke in _loops(inner_part(inset, 0.5 * pitch_mm), island, "infill"):
        line = _whole(stroke)
        if near.covers(line):
            yield stroke
            continue
        pieces = [p for p in shapely.get_parts(line.intersection(near)) if p.geom_type == "LineString"]
        pieces = [piece for piece in pieces if not piece.is_empty]
        for part in shapely.get_parts(shapely.line_merge(shapely.MultiLineString(pieces))):
            if part.length > 0.25 * width_mm:
                yield Stroke(np.asarray(part.coords), False, False, "infill")


def _periods(island: Island) -> range:
    """Numbers of the periods that a ring's region has; of others the one."""
    half = island.periods // 2
    return range(-half, half + 1)


def _whole(stroke: Stroke, by_mm: float = 0.0) -> Any:
    """A stroke as a line, with the way back to its start where it is closed."""
    import shapely

    loop = np.concatenate([stroke.line, stroke.line[:1] + stroke.shift]) if stroke.closed else stroke.line
    return shapely.LineString(loop + np.array([by_mm, 0.0]))


def _loops(region: Any, island: Island, kind: str) -> list[Stroke]:
    """The borders of a region as closed strokes, the region on their left."""
    import shapely
    from shapely.geometry.polygon import orient

    found: list[Stroke] = []
    period = island.chart.period
    for polygon in shapely.get_parts(region):
        if polygon.geom_type != "Polygon" or polygon.area <= 1e-9:
            continue
        for hole, ring in ((False, orient(polygon).exterior), *((True, r) for r in orient(polygon).interiors)):
            loop = np.asarray(ring.coords)[:-1]
            if period is None:
                found.append(Stroke(loop, True, hole, kind))
            else:
                found += _of_one_period(loop, hole, kind, period, region.bounds)
    return found


def _of_one_period(
    loop: Floats, hole: bool, kind: str, period: float, bounds: tuple[float, float, float, float]
) -> list[Stroke]:
    """The strokes of the middle period of a border that repeats."""
    ends = (loop[:, 0] < bounds[0] + 1e-6) | (loop[:, 0] > bounds[2] - 1e-6)
    if not ends.any():
        mine = -0.5 * period <= loop[:, 0].min() < 0.5 * period
        return [Stroke(loop, True, hole, kind)] if mine else []
    found = []
    turned = np.roll(loop, -int(np.flatnonzero(ends)[0]), axis=0)
    ends = (turned[:, 0] < bounds[0] + 1e-6) | (turned[:, 0] > bounds[2] - 1e-6)
    marks = np.append(np.flatnonzero(ends), len(turned))
    for first, last in pairwise(marks.tolist()):
        run = turned[np.arange(first, last + 1) % len(turned)]
        if abs(run[-1, 0] - run[0, 0]) > 1.5 * period:
            found.append(_one_turn(run, kind, period))
    return found


def _one_turn(run: Floats, kind: str, period: float) -> Stroke:
    """A period of a line that runs on from period to period, as a stroke right round."""
    back = run[-1, 0] < run[0, 0]
    run = run[::-1] if back else run
    cuts = []
    for x in (-0.5 * period, 0.5 * period):
        k = int(np.flatnonzero((run[:-1, 0] < x) & (run[1:, 0] >= x))[-1])  # the last passage: the same one in both
        share = (x - run[k, 0]) / (run[k + 1, 0] - run[k, 0])
        cuts.append((k, run[k] + share * (run[k + 1] - run[k])))
    (begin, start), (end, _) = cuts
    line = np.concatenate([start[None], run[begin + 1 : end + 1]])
    if not back:
        return Stroke(line, True, False, kind, (period, 0.0))
    line = np.concatenate([line[:1] + np.array([period, 0.0]), line[:0:-1]])
    return Stroke(line, True, False, kind, (-period, 0.0))


def narrow_places(island: Island, first_mm: float, width_mm: float, pitch_mm: float) -> Iterator[Stroke]:
    """One bead along the middle of every place that the first round leaves out: too thin for it, or for two beads.

    Args:
        island: what to fill.
        first_mm: how far inside the border the first round runs.
        width_mm: of the beads.
        pitch_mm: what a bead fills.

    Yields:
        Strokes; where the island has no room for any bead and no middle line, its border.
    """
    import shapely

    island = island.repeated(_beyond(island, width_mm))
    wide = wide_part(island.region, first_mm, pitch_mm, width_mm)
    rest = island.region.difference(wide.buffer(first_mm * (1 + 1e-3) + 1e-3, quad_segs=32))
    for part in shapely.get_parts(rest):
        if part.geom_type != "Polygon":
            continue
        if not wide.is_empty and part.area < LEAST_GAP * width_mm**2:
            continue
        if not wide.is_empty and part.length < 4 * width_mm and part.buffer(-NARROW * width_mm).is_empty:
            continue  # what a round bead leaves in a corner
        lines = list(_along_middle(part, island, width_mm, "contour"))
        for stroke in lines:
            if stroke.closed or wide.is_empty or _whole(stroke).length > 0.5 * width_mm:
                yield stroke
        if not lines and wide.is_empty and _in_one_period(part, island):
            yield from (replace(s, thin=True) for s in _loops(part, island, "contour"))


def _in_one_period(part: Any, island: Island) -> bool:
    """Whether a part of a ring's repeated region is the one of it that counts; others always are."""
    period = island.chart.period
    around = period is not None and part.bounds[2] - part.bounds[0] > 1.5 * period
    return period is None or around or -0.5 * period <= part.bounds[0] < 0.5 * period


def _along_middle(part: Any, island: Island, width_mm: float, kind: str) -> Iterator[Stroke]:
    """Strokes along the middle of a part of an island's region; closed ones all run the same way round."""
    import shapely

    if not _in_one_period(part, island):
        return
    period, border = island.chart.period, island.region.boundary
    around = period is not None and part.bounds[2] - part.bounds[0] > 1.5 * period
    for line, closed in middle_lines(part, width_mm):
        thin = bool(distances(line, border).min() < 0.5 * width_mm - THIN_MM)
        if around and period is not None and not closed:
            ahead = line if line[-1, 0] > line[0, 0] else line[::-1]
            low, high = ahead[:, 0].min(), ahead[:, 0].max()
            if low < -0.5 * period and high >= 0.5 * period:
                yield replace(_one_turn(ahead, kind, period), thin=thin)
                continue
            if not -0.5 * period <= low < 0.5 * period:  # a piece of the way round, in another period
                continue
        back = not shapely.LinearRing(line).is_ccw if closed else tuple(line[-1]) < tuple(line[0])
        yield Stroke(line[::-1] if back else line, closed, False, kind, thin=thin)
