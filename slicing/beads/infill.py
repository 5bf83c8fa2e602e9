"""Beads that fill a flat region: rounds along its border, and lines to and fro.

    strokes = zigzag(island, 6.25, 1.0, pitch_mm=3.75, width_mm=5.0, angle_deg=0.0)      # in its chart

The border of the region is the edge of the material ("edge") or the centre line of the outermost bead ("centre"):
the first round runs half a width inside it, or on it, and every further one a pitch = width * (1 - overlap) inside the
one before. `contour_parallel` goes on so until nothing is left; where a core wider than what the last round covers
remains, one more round is laid half a pitch inside it, and a bead along its middle where it is long and narrow.
`zigzag` lays its lines inside the given number of rounds, spread evenly at no more than a pitch, and joins the end of
each to the next: straight where that stays within the lines' region, else along its border; where that is too long a
way, a new bead begins.

Where the region is thinner than one and a half pitches, one bead runs along its middle: two would lie on one another
and lay more metal too much than one lays too little. Where it is narrower than a bead that bead stands out by what is
missing; a place too small even for that gets the border itself as a bead. Both are marked `thin`. In walls of some
beads the rounds' distance is fitted to the wall (`fitted_pitch`).

Rings are filled without a seam: rounds close round the body; lines at an angle are spread so that they meet themselves
after a turn, and lines along the way round (angles whose rise on a turn is less than a pitch count as such) close.
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
NUDGE = 1e-3  # outermost lines run this share of a width inside the border
LONGEST_JOINT = 3.0  # times the pitch
OVER = 0.1  # lines run this share of a width further into the rounds about them than they must
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
        after = _inset(island.region, first_mm + k * pitch_mm)
        if fills:
            after = _rooms(_without_narrow(after, 0.5 * pitch_mm, width_mm), 0.5 * pitch_mm, width_mm)
            between = list(_between_rounds(island, inset, after, pitch_mm, width_mm))
            yield from between
            yield from _core(island, inset, after, pitch_mm, width_mm, between)
        inset = after


def wide_part(region: Any, first_mm: float, pitch_mm: float, width_mm: float) -> Any:
    """Where the first round of a region runs: not where one bead along the middle lays the metal better than two.

    Args:
        region: shapely, mm.
        first_mm: how far inside the border the first round runs.
        pitch_mm: what a bead fills of a wall's thickness.
        width_mm: of the beads.

    Returns:
        The region inset by first_mm, without places where the region is thinner than ONE_BEAD pitches.
    """
    return _without_narrow(_inset(region, first_mm), ONE_BEAD * pitch_mm - 2.0 * first_mm, width_mm)


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
    return _areas(inset.difference(shapely.union_all(narrow).buffer(1e-3)))


def _greatest_width(region: Any, most_mm: float, width_mm: float) -> float:
    """Width of a region at its widest place, mm; most_mm where it is wider than that."""
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
    """How far beyond a ring's middle period beads there see, mm: what is eroded is gone at half the ring's height."""
    _, y0, _, y1 = island.region.bounds
    return 4.0 * min(width_mm, y1 - y0)


def _inset(region: Any, by_mm: float) -> Any:
    """The region's points at least so far inside its border."""
    import shapely

    if by_mm <= 0.0:
        return region
    quarter = max(math.ceil(0.25 * math.pi / math.acos(max(1.0 - ROUND_MM / by_mm, 0.5))), 4)
    inner = region.buffer(-by_mm, quad_segs=quarter)
    return _areas(shapely.simplify(inner, SMOOTH_MM))


def _areas(geometry: Any) -> Any:
    """A geometry without its parts that are no polygons."""
    import shapely

    parts = shapely.get_parts(geometry)
    return shapely.union_all([part for part in parts if part.geom_type == "Polygon" and part.area > 1e-9])


def _between_rounds(island: Island, inset: Any, after: Any, pitch_mm: float, width_mm: float) -> Iterator[Stroke]:
    """What a round and the next leave between them, where it is long and wide enough for a bead of its own."""
    import shapely

    rest = _inset(inset, 0.5 * pitch_mm).difference(after.buffer(0.5 * pitch_mm * (1 + 1e-3) + 1e-3))
    for part in shapely.get_parts(rest):
        if part.geom_type != "Polygon" or part.buffer(-0.25 * pitch_mm).is_empty:
            continue
        strokes = list(_along_middle(part, island, width_mm, "infill"))
        if sum(_whole(stroke).length for stroke in strokes) > width_mm:
            yield from strokes


def _core(
    island: Island, inset: Any, after: Any, pitch_mm: float, width_mm: float, laid: Sequence[Stroke]
) -> Iterator[Stroke]:
    """What a round, the next and what is laid between them leave uncovered: half a pitch inside the round, one more."""
    import shapely

    bare = _inset(inset, 0.5 * width_mm).difference(after.buffer(0.5 * width_mm))
    if laid and not bare.is_empty:
        lines = [_whole(stroke, k * (island.chart.period or 0.0)) for stroke in laid for k in _periods(island)]
        bare = bare.difference(shapely.union_all(lines).buffer(0.5 * width_mm))
    bare = [part for part in shapely.get_parts(bare) if part.area > LEAST_GAP * width_mm**2]
    if not bare:
        return
    near = shapely.union_all(bare).buffer(0.5 * width_mm)
    for stroke in _loops(_inset(inset, 0.5 * pitch_mm), island, "infill"):
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


def zigzag(
    island: Island, inside_mm: float, over_mm: float, pitch_mm: float, width_mm: float, angle_deg: float
) -> Iterator[Stroke]:
    """Lines to and fro.

    Args:
        island: what to fill.
        inside_mm: how far inside the border the outermost lines run.
        over_mm: how much nearer to the border than that their ends may come.
        pitch_mm: greatest distance between lines.
        width_mm: of the beads.
        angle_deg: of the lines against the chart's first axis (round the body; on planes across z).

    Yields:
        Open strokes, and closed ones where lines go right round.
    """
    import shapely

    angle = math.radians(angle_deg % 180.0)
    period = island.chart.period
    if period is None:
        for part in shapely.get_parts(_inset(island.region, inside_mm)):
            if part.geom_type == "Polygon" and part.area > 1e-9:
                room = part.buffer(over_mm, join_style="mitre")
                room = _areas(room.intersection(_inset(island.region, inside_mm - over_mm)))
                yield from _to_and_fro(room, _levels(part, angle, pitch_mm, width_mm), angle, pitch_mm)
        return
    rise = period * math.sin(angle)
    height = island.region.bounds[3] - island.region.bounds[1]
    if inside_mm - over_mm >= 0.5 * height:
        return
    if rise < pitch_mm:  # as good as along the way round
        island = island.repeated(inside_mm + period)
        region = _inset(island.region, inside_mm)
        if not region.is_empty:
            # lines beside a border that is not straight stay whole: there they may come nearer to it
            room = _inset(island.region, inside_mm - over_mm)
            yield from _right_round(room, _levels(region, 0.0, pitch_mm, width_mm), period, pitch_mm)
        return
    steps = math.ceil(rise / pitch_mm - 1e-9)
    reach = 0.5 * height * abs(math.cos(angle)) / math.sin(angle) + period + inside_mm
    region = _inset(island.repeated(reach).region, inside_mm - over_mm)
    middle = 0.5 * (island.region.bounds[1] + island.region.bounds[3]) * math.cos(angle)
    if not region.is_empty:
        levels = middle - 0.5 * rise + (np.arange(steps) + 0.5) * rise / steps
        yield from _to_and_fro(region, levels, angle, pitch_mm)


def _levels(part: Any, angle: float, pitch_mm: float, width_mm: float) -> Floats:
    """Distances of the lines from the origin: evenly spread, the outermost ones just inside the border."""
    import shapely

    across = shapely.get_coordinates(part) @ [-math.sin(angle), math.cos(angle)]
    low, high = float(across.min()), float(across.max())
    nudge = NUDGE * width_mm
    if high - low <= 4.0 * nudge:
        return np.array([0.5 * (low + high)])
    count = max(math.ceil((high - low - 2 * nudge) / pitch_mm - 1e-9), 1)
    return np.linspace(low + nudge, high - nudge, count + 1)


def _pieces(region: Any, levels: Floats, angle: float) -> list[list[Floats]]:
    """By line its pieces (2, 2) within a region, each along the line's direction and in its order."""
    import shapely

    along, across = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    reach = shapely.get_coordinates(region) @ along
    ends = np.array([reach.min() - 1.0, reach.max() + 1.0])[:, None] * along
    lines = shapely.linestrings(levels[:, None, None] * across + ends)
    out = []
    for cut in shapely.intersection(lines, region):
        lines_in = [p for p in shapely.get_parts(cut) if p.geom_type == "LineString" and p.length > 1e-6]
        parts = [np.asarray(p.coords) for p in lines_in]
        parts = [p[[0, -1]] if (p[-1] - p[0]) @ along > 0 else p[[-1, 0]] for p in parts]
        out.append(sorted(parts, key=lambda p: float(p[0] @ along)))
    return out


def _to_and_fro(region: Any, levels: Floats, angle: float, pitch_mm: float) -> Iterator[Stroke]:
    """Lines joined at their ends as far as the joints stay inside."""
    yield from _joined(region, _pieces(region, levels, angle), pitch_mm)


def _joined(region: Any, rows: list[list[Floats]], pitch_mm: float) -> Iterator[Stroke]:
    """Pieces of lines joined into strokes: from the end of each to the nearest end on the next line."""
    import shapely

    grown = region.buffer(1e-4)
    shapely.prepare(grown)
    left = [list(row) for row in rows]
    for begin in range(len(left)):
        while left[begin]:
            chain = [(left[begin].pop(0), True)]
            for row in left[begin + 1 :]:
                at = chain[-1][0][-1]
                ends = [(float(np.hypot(*(p[e] - at))), i, e) for i, p in enumerate(row) for e in (0, 1)]
                near = min(ends, default=(math.inf, 0, 0))
                if near[0] > LONGEST_JOINT * pitch_mm:
                    break
                to = row[near[1]][near[2]]
                if not grown.covers(shapely.LineString([at, to])):
                    joint = _along_border(region, at, to, LONGEST_JOINT * pitch_mm)
                    if joint is None:
                        break
                    chain.append((joint, False))
                piece = row.pop(near[1])
                chain.append((piece if near[2] == 0 else piece[::-1], True))
            yield _stroke(chain)


def _stroke(chain: list[tuple[Floats, bool]]) -> Stroke:
    """Lines (True) and joints one after the other; the ends of the lines are corners."""
    first = np.cumsum([0, *(len(part) for part, _ in chain[:-1])]).tolist()
    corners = [k for k, (_, is_line) in zip(first, chain, strict=True) if is_line]
    return Stroke(
        np.concatenate([part for part, _ in chain]),
        False,
        False,
        "infill",
        corners=tuple(sorted({*corners, *(k + 1 for k in corners)})),
    )


def _along_border(region: Any, a: Floats, b: Floats, most_mm: float) -> Floats | None:
    """The inner points of the shorter way along the border between two points of it, if short enough."""
    import shapely
    from shapely.ops import substring

    for polygon in shapely.get_parts(region):
        for ring in (polygon.exterior, *polygon.interiors):
            if max(ring.distance(shapely.Point(p)) for p in (a, b)) > 1e-3:
                continue
            start, end = (ring.project(shapely.Point(p)) for p in (a, b))
            ahead = (end - start) % ring.length
            if min(ahead, ring.length - ahead) > most_mm:
                return None
            line = shapely.LineString(np.tile(np.asarray(ring.coords)[:-1], (3, 1)))
            forward = ahead <= ring.length - ahead
            way = substring(line, start, start + ahead) if forward else substring(line, end, end + ring.length - ahead)
            way = way if forward else way.reverse()
            return np.asarray(way.coords)[1:-1]
    return None


def _right_round(region: Any, levels: Floats, period: float, pitch_mm: float) -> Iterator[Stroke]:
    """Lines along the way round: closed where nothing is in the way, pieces joined to and fro elsewhere."""
    whole: list[Stroke] = []
    rows: list[list[Floats]] = []
    for level, row in zip(levels, _pieces(region, levels, 0.0), strict=True):
        if any(p[0, 0] < -0.75 * period and p[1, 0] > 0.75 * period for p in row):
            line = np.stack([np.linspace(-0.5, 0.5, 9)[:-1] * period, np.full(8, level)], axis=1)
            whole.append(Stroke(line, True, False, "infill", (period, 0.0)))
            rows.append([])
        else:
            rows.append([p for p in row if -0.5 * period <= p[0, 0] < 0.5 * period])
    yield from whole
    yield from _joined(region, rows, pitch_mm)


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
