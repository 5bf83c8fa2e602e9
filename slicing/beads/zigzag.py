"""Beads that fill a flat region with parallel lines, joined at their ends.

    strokes = zigzag(island, 6.25, 1.0, pitch_mm=3.75, width_mm=5.0, angle_deg=0.0)      # in its chart

The lines lie inside the given number of rounds (`slicing.beads.infill`), spread evenly at no more than a given
distance. The end of each is joined to the next: by a straight line if that stays within the lines' region, else along
its border; if that is too long, a new bead begins. In a ring, lines at an angle are spread so that they meet themselves
after a turn. Lines along the way round close (angles whose rise in a turn is less than a pitch count as such).

The distance is the one at which the lines lay the metal that is left for them (`strokes_of_length`). Their joints, the
rounds that they run into, and rounding their number up give a surplus of metal. It is made up for by lines a little
farther apart, at most a bead's width, beyond which there would be gaps. Missing metal is made up for by closer lines.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ..mesh.solid import Floats
from .infill import Stroke, inner_part, only_areas
from .regions import Island

NUDGE = 1e-3  # outermost lines run this share of a width inside the border
LONGEST_JOINT = 3.0  # times the pitch
CLOSE = 0.03  # of the metal that is wanted: near enough
CLOSEST = 0.8  # of the pitch: lines are no nearer to one another
TRIES = 3  # of distances
OVER = 0.1  # lines run this share of a width further into the rounds about them than they must


def zigzag(
    island: Island, inside_mm: float, over_mm: float, pitch_mm: float, width_mm: float, angle_deg: float
) -> Iterator[Stroke]:
    """Parallel lines, joined to and fro.

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
        for part in shapely.get_parts(inner_part(island.region, inside_mm)):
            if part.geom_type == "Polygon" and part.area > 1e-9:
                room = part.buffer(over_mm, join_style="mitre")
                room = only_areas(room.intersection(inner_part(island.region, inside_mm - over_mm)))
                yield from _to_and_fro(room, _levels(part, angle, pitch_mm, width_mm), angle, pitch_mm)
        return
    rise = period * math.sin(angle)
    height = island.region.bounds[3] - island.region.bounds[1]
    if inside_mm - over_mm >= 0.5 * height:
        return
    if rise < pitch_mm:  # as good as along the way round
        island = island.repeated(inside_mm + period)
        region = inner_part(island.region, inside_mm)
        if not region.is_empty:
            # lines beside a border that is not straight stay whole: there they may come nearer to it
            room = inner_part(island.region, inside_mm - over_mm)
            yield from _right_round(room, _levels(region, 0.0, pitch_mm, width_mm), period, pitch_mm)
        return
    steps = math.ceil(rise / pitch_mm - 1e-9)
    reach = 0.5 * height * abs(math.cos(angle)) / math.sin(angle) + period + inside_mm
    region = inner_part(island.repeated(reach).region, inside_mm - over_mm)
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


def length_of(strokes: Sequence[Stroke]) -> float:
    """Length of strokes in their chart, mm."""
    total = 0.0
    for stroke in strokes:
        line = np.concatenate([stroke.line, stroke.line[:1] + stroke.shift]) if stroke.closed else stroke.line
        total += float(np.hypot(*np.diff(line, axis=0).T).sum())
    return total


def strokes_of_length(
    lines: Callable[[float], list[Stroke]], wanted_mm: float, pitch_mm: float, width_mm: float
) -> list[Stroke]:
    """The lines whose length is nearest to what is wanted.

    Args:
        lines: strokes, by the greatest distance of two of them, mm.
        wanted_mm: length of lines that lays the metal.
        pitch_mm: what a bead fills.
        width_mm: of a bead.

    Returns:
        The strokes.
    """
    apart, best = pitch_mm, lines(pitch_mm)
    got = length_of(best)
    if wanted_mm <= 0.0 or got <= 0.0:
        return best
    off = abs(got - wanted_mm)
    for _ in range(TRIES):
        before, apart = apart, min(max(apart * got / wanted_mm, CLOSEST * pitch_mm), width_mm)
        if off <= CLOSE * wanted_mm or apart == before:
            break
        tried = lines(apart)
        got = length_of(tried)
        if abs(got - wanted_mm) < off and got > 0.0:
            best, off = tried, abs(got - wanted_mm)
    return best
