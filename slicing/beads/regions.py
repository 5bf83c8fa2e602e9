"""A layer's region as islands: each in a chart of its own, where it is flat.

    for island in islands(layer):                  # connected regions, shapely
        line = island.chart.lift(flat)             # (n, 2) in the chart, mm -> (n, 3) on the surface

Which chart (`slicing.surfaces.charts`): planes their own, whatever goes round the axis one that repeats, what lies
over the body's end the map of that pole, all else the surface unrolled. Beside the pole the one that distorts less is
taken.

A region that runs far down from a pole (a cap over a shaft's end and its sides) is longer round the axis in the pole's
map than on the body. If the distortion is too large, and an end and a ring would both be distorted less, it is divided
at a parallel (`RegionOverlap`); the pieces overlap so far that their outermost beads are neighbours.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..curves.loops import Curve
from ..layers.layer import Layer
from ..layers.outside_body import region_of
from ..layers.poles import round_about
from ..mesh.solid import Floats, PartError
from ..surfaces.charts import Chart, FlatChart, PoleChart, RoundChart
from ..surfaces.surfaces import Cone, Cylinder, Plane, Revolved, Round

LEAST_AREA_MM2 = 1e-6
MOST_STRETCH = 1.25  # a region over a pole is divided where parallels come out longer
BETTER = 0.9  # and what is left of that is less than this share of it
DOUBTFUL_RAD = 0.5 * math.pi  # borders with steps so far round the axis pass by the pole


@dataclass(frozen=True)
class RegionOverlap:
    """Overlap of the pieces of a divided region.

    Attributes:
        over_mm: how far each reaches over the cut.
        width_mm: of the beads; narrower pieces are not cut off.
    """

    over_mm: float
    width_mm: float


@dataclass(frozen=True, eq=False)
class Island:
    """A part of a layer's region in a chart.

    Attributes:
        chart: the way to and from the surface.
        region: shapely geometry in the chart, mm; of a ring `periods` of them, the middle one about x = 0.
        periods: how often a ring's region is repeated; 1 for others.
        borders: (n, 2) a ring's winding borders, one period each, running towards growing x.
        holes: holes within a ring, shapely.
    """

    chart: Chart
    region: Any
    periods: int = 1
    borders: tuple[Floats, ...] = ()
    holes: tuple[Any, ...] = ()

    @property
    def area_mm2(self) -> float:
        """In the chart."""
        return float(self.region.area) / self.periods

    def repeated(self, reach_mm: float) -> Island:
        """The same island, a ring's region so long that its ends are farther than reach_mm from the middle period."""
        period = self.chart.period
        if period is None:
            return self
        count = 3 + 2 * math.ceil(reach_mm / period)
        region = _ring_region(period, self.borders, self.holes, count)
        return replace(self, region=region, periods=count)


def islands(layer: Layer, overlap: RegionOverlap | None = None) -> list[Island]:
    """The connected regions of a layer, each in its chart.

    Args:
        layer: the layer.
        overlap: how pieces meet where a region over a pole is divided; None: it is not.

    Returns:
        One island an outer border, or a piece of its region; one for all rings together.

    Raises:
        PartError: the region goes round an end that its surface does not have, or over both ends at once.
    """
    return ISLANDS[type(layer.surface)](layer, layer.surface, overlap)


def _flat_islands(layer: Layer, plane: Plane, overlap: RegionOverlap | None) -> list[Island]:
    """The regions of a plane, in its own coordinates."""
    chart = FlatChart(plane)
    region = region_of([chart.flat(curve.points) for curve in layer.curves if curve.closed])
    return [Island(chart, part) for part in _polygons(region)]


def _round_islands(layer: Layer, surface: Round, overlap: RegionOverlap | None) -> list[Island]:
    """The regions of what goes round an axis: beside its ends, right round, and over each end."""
    import shapely

    closed = [curve for curve in layer.curves if curve.closed]
    lower, rings, upper = round_about(layer)
    found: list[Island] = []
    for curve in closed:
        if not curve.winding and not curve.hole:
            beside = _chart_beside(surface, curve.points)
            loop = beside.flat(curve.points)
            if _twice_area(loop) < 0.0:
                raise PartError(
                    f"layer {layer.index}: runs over both ends of the body; it cannot be filled in one piece"
                )
            found.append(Island(beside, shapely.Polygon(loop).buffer(0)))
    if rings:
        found += _rings(surface, [(curve.points, curve.winding) for curve in rings])
    for border, side in ((lower, -1), (upper, 1)):
        if border is not None:
            over = PoleChart.around(surface, [border.points], side)
            found.append(Island(over, shapely.Polygon(over.flat(border.points)).buffer(0)))
    for curve in closed:
        if curve.hole and not curve.winding:
            found = [_with_hole(island, curve) for island in found]
    if overlap is not None:
        found = [piece for island in found for piece in _divided(island, overlap)]
    return [island for island in found if island.area_mm2 > LEAST_AREA_MM2]


ISLANDS: dict[type, Callable[..., list[Island]]] = {
    Plane: _flat_islands,
    Cylinder: _round_islands,
    Cone: _round_islands,
    Revolved: _round_islands,
}


def _chart_beside(surface: Round, points: Floats) -> RoundChart | PoleChart:
    """The chart that distorts a region least that holds no pole."""
    best: RoundChart | PoleChart = RoundChart.around(surface, [points], ring=False)
    turn = np.abs(np.diff(np.arctan2(*(points[[*range(len(points)), 0], :2] - surface.axis_point).T[::-1])))
    doubtful = bool((np.minimum(turn, 2 * math.pi - turn) > DOUBTFUL_RAD).any())
    if best.stretch[1] < 1.0 + 1e-6 and not doubtful:
        return best
    for end, side in zip(surface.ends, (-1, 1), strict=True):
        if end:
            other = PoleChart.around(surface, [points], side, whole=False)
            if doubtful or other.stretch[1] < BETTER * best.stretch[1]:
                best, doubtful = other, False
    return best


def _polygons(region: Any) -> list[Any]:
    import shapely

    return [p for p in shapely.get_parts(region) if p.geom_type == "Polygon" and p.area > LEAST_AREA_MM2]


def _twice_area(loop: Floats) -> float:
    after = np.roll(loop, -1, axis=0)
    return float((loop[:, 0] * after[:, 1] - loop[:, 1] * after[:, 0]).sum())


def _divided(island: Island, overlap: RegionOverlap) -> list[Island]:
    """The pieces of a region over a pole whose parallels would come out too long, or the region as it is."""
    import shapely

    chart = island.chart
    if not isinstance(chart, PoleChart) or chart.stretch[1] <= MOST_STRETCH:  # only maps of a pole are divided
        return [island]
    far = float(np.hypot(*shapely.get_coordinates(island.region).T).max())
    cut = _best_cut(chart, far, 2.0 * overlap.width_mm)
    if cut is None:
        return [island]
    inner = island.region.intersection(chart.within(cut + overlap.over_mm))
    rest = _polygons(island.region.difference(chart.within(max(cut - overlap.over_mm, 1e-3))))
    if not rest or any(piece.buffer(-0.5 * overlap.width_mm).is_empty for piece in rest):
        return [island]
    own = replace(chart, stretch=(chart.stretch[0], float(chart.longer(_up_to(chart, cut + overlap.over_mm)).max())))
    return [Island(own, piece) for piece in _polygons(inner)] + [_recharted(chart, piece) for piece in rest]


def _up_to(chart: PoleChart, far: float) -> Floats:
    """Distances (n,) from the pole up to one, at which the profile's points are among them."""
    knots = chart.meridian[:, 0]
    return np.unique(np.concatenate([knots[(knots > 0.0) & (knots < far)], np.linspace(0.0, far, 257)[1:]]))


def _best_cut(chart: PoleChart, far: float, least: float) -> float | None:
    """The distance from the pole at which the worse of the end's and the ring's stretch is least.

    Args:
        chart: the pole's.
        far: distance of the region's farthest point, mm.
        least: how far the cut stays from the pole and from there, mm.
    """
    at = _up_to(chart, far)
    r, end = chart.radii(at), np.maximum.accumulate(chart.longer(at))
    ring = np.maximum.accumulate(r[::-1])[::-1] / np.maximum(np.minimum.accumulate(r[::-1])[::-1], 1e-9)
    worse = np.where((at > least) & (at < far - least), np.maximum(end, ring), np.inf)
    best = int(np.argmin(worse))
    return float(at[best]) if worse[best] < BETTER * end[-1] else None


def _recharted(chart: PoleChart, piece: Any) -> Island:
    """A piece that does not hold the pole, from the pole's chart unrolled anew."""
    import shapely
    from shapely.geometry.polygon import orient

    piece = orient(piece)
    pole = shapely.Point(0.0, 0.0)
    lines = [chart.lift(np.asarray(ring.coords)[:-1]) for ring in (piece.exterior, *piece.interiors)]
    about = [bool(shapely.Polygon(ring).contains(pole)) for ring in (piece.exterior, *piece.interiors)]
    if about[0]:
        borders = [line for line, round_it in zip(lines, about, strict=True) if round_it]
        ring = RoundChart.around(chart.surface, borders, ring=True)
        island = _ring(ring, [(line, chart.side * (-1 if k else 1)) for k, line in enumerate(borders)])
    else:
        island_chart = RoundChart.around(chart.surface, lines[:1], ring=False)
        island = Island(island_chart, shapely.Polygon(island_chart.flat(lines[0])).buffer(0))
    for line, round_it in zip(lines[1:], about[1:], strict=True):
        if not round_it:
            island = _with_hole(island, Curve(line, True, True))
    return island


def _rings(surface: Round, rings: Sequence[tuple[Floats, int]]) -> list[Island]:
    """The region between borders that go round: right round the axis, or about a pole where that distorts less."""
    import shapely

    points = [border for border, _ in rings]
    chart = RoundChart.around(surface, points, ring=True)
    for end, side in zip(surface.ends, (-1, 1), strict=True):
        if end:
            over = PoleChart.around(surface, points, side, whole=False)
            if over.stretch[1] < BETTER * chart.stretch[1]:
                region = shapely.Polygon()
                for border in points:
                    region = region.symmetric_difference(shapely.Polygon(over.flat(border)).buffer(0))
                return [Island(over, part) for part in _polygons(region)]
    return [_ring(chart, rings)]


def _ring(chart: RoundChart, rings: Sequence[tuple[Floats, int]]) -> Island:
    """The region between borders, each with its turns about the axis."""
    flats = [(chart.flat(points), winding) for points, winding in rings]
    borders = tuple(flat if winding > 0 else flat[::-1] for flat, winding in flats)
    assert chart.period is not None
    return Island(chart, _ring_region(chart.period, borders, (), 3), 3, borders)


def _ring_region(period: float, borders: Sequence[Floats], holes: Sequence[Any], count: int) -> Any:
    """So many periods of the region between winding borders, holes left out."""
    import shapely
    from shapely import affinity

    low = min(float(border[:, 1].min()) for border in borders) - 1.0
    top = max(float(border[:, 1].max()) for border in borders) + 1.0
    half = count // 2
    region = shapely.Polygon()
    for border in borders:
        line = np.concatenate([border + np.array([k * period, 0.0]) for k in range(-half - 2, half + 3)])
        above = np.concatenate([line, [[line[-1, 0], top], [line[0, 0], top]]])
        region = region.symmetric_difference(shapely.Polygon(above).buffer(0))
    for hole in holes:
        copies = [affinity.translate(hole, k * period) for k in range(-half - 2, half + 3)]
        region = region.difference(shapely.union_all(copies))
    return region.intersection(shapely.box(-0.5 * count * period, low, 0.5 * count * period, top + 1.0))


def _with_hole(island: Island, curve: Curve) -> Island:
    """The island without a hole, if it lies in it; an island that lies in the hole stays as it is."""
    import shapely
    from shapely import affinity

    chart = island.chart
    hole = shapely.Polygon(chart.flat(curve.points)).buffer(0)
    if chart.period is not None:
        island = replace(island, holes=(*island.holes, hole))
        return island.repeated(0.0)
    for k in (0, 1, -1) if chart.turn_mm else (0,):
        moved = affinity.translate(hole, k * chart.turn_mm)
        if hole.area < island.region.area and island.region.intersects(moved):
            return replace(island, region=island.region.difference(moved))
    return island
