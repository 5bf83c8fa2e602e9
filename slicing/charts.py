"""Layers unrolled: charts in which a layer's region is a flat one, and the way back onto the exact surface.

    for island in islands(layer):                  # connected regions, shapely
        line = island.chart.lift(flat)             # (n, 2) in the chart, mm -> (n, 3) on the surface

Planes, cylinders and cones unroll isometrically: lengths and widths in the chart are those on the surface. A
profile that is turned is unrolled as the cone through the ends of its range: lengths along the profile are exact,
lengths round the axis come out at the chart's length or less (`stretch` says by how much), so that what is spaced
in the chart is never spaced wider on the surface; within one straight segment of the profile it is exact as well.

A region that goes right round (a ring) has a periodic chart: x and x + period are the same place. There a cylinder is
exact still; on cones and profiles the chart is as long everywhere as the widest parallel.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from slicing.clip import region_of
from slicing.intersect import Curve
from slicing.layers import Layer
from slicing.part import Floats, PartError
from slicing.surfaces import Cone, Cylinder, Plane, Revolved

PROFILE_MM = 1e-4  # sagitta of a profile's sampled arcs; lifted points are put onto the exact surface
STRAIGHT = 1e-6  # slopes below this count as a cylinder's
LEAST_AREA_MM2 = 1e-6
CHUNK = 2_000_000


@dataclass(frozen=True, eq=False)
class FlatChart:
    """A plane, along its own axes.

    Attributes:
        surface: the plane.
    """

    surface: Plane
    period = None
    stretch = (1.0, 1.0)

    def flat(self, points: Floats) -> Floats:
        """Coordinates (n, 2) of points (n, 3), mm."""
        return self.surface.unrolled(points)

    def lift(self, flat: Floats) -> Floats:
        """Points (n, 3) at coordinates (n, 2)."""
        u, v = self.surface.axes()
        return np.asarray(self.surface.point) + flat[:, :1] * u + flat[:, 1:] * v

    def spacing(self, tolerance_mm: float) -> float:
        """How far apart points of a straight line may lie."""
        return math.inf


@dataclass(frozen=True, eq=False)
class RoundChart:
    """A surface about an axis, unrolled as a cone (a cylinder where slope is 0).

    Attributes:
        surface: what is unrolled.
        meridian: (k, 3) arc length, r and z along the profile, mm, upwards.
        slope: growth of the cone's radius with arc length.
        radius: the cone's radius at arc length 0, mm.
        angle: azimuth of the chart's second axis, rad.
        period: length of the way round, mm; None where the region does not go right round.
        stretch: least and greatest ratio of lengths round the axis in the chart to those on the surface.
    """

    surface: Cylinder | Cone | Revolved
    meridian: Floats
    slope: float
    radius: float
    angle: float
    period: float | None
    stretch: tuple[float, float]

    @classmethod
    def around(cls, surface: Cylinder | Cone | Revolved, loops: Sequence[Floats], ring: bool) -> RoundChart:
        """The chart for a region.

        Args:
            surface: what it lies on.
            loops: (n, 3) points of its outer borders, mm.
            ring: whether it goes right round.

        Returns:
            The chart.
        """
        points = np.concatenate(loops)
        meridian = _meridian(surface, points)
        angles = np.unwrap(np.arctan2(*(points[:, :2] - surface.axis_point).T[::-1]))
        middle = 0.0 if ring else 0.5 * float(angles.min() + angles.max())
        bare = cls(surface, meridian, 0.0, 1.0, middle, None, (1.0, 1.0))
        s = bare._along(points)
        centre = 0.5 * float(s.min() + s.max())
        meridian = meridian - [centre, 0.0, 0.0]
        low, high = float(s.min()) - centre, float(s.max()) - centre
        inner = meridian[(meridian[:, 0] > low) & (meridian[:, 0] < high)]
        at = np.concatenate([[low], inner[:, 0], [high]])
        r = np.concatenate([_at(meridian, np.array([low]))[0], inner[:, 1], _at(meridian, np.array([high]))[0]])
        slope = 0.0 if ring or high - low < 1e-9 else float(r[-1] - r[0]) / (high - low)
        slope = slope if abs(slope) > STRAIGHT else 0.0
        # never narrower than the surface: spacing in the chart is at most spacing on the surface
        radius = float((r - slope * at).max())
        ratio = (radius + slope * at) / np.maximum(r, 1e-9)
        period = 2 * math.pi * radius if ring else None
        return cls(surface, meridian, slope, radius, middle, period, (float(ratio.min()), float(ratio.max())))

    def _along(self, points: Floats) -> Floats:
        """Arc length (n,) of the meridian's nearest points."""
        r = np.hypot(points[:, 0] - self.surface.axis_point[0], points[:, 1] - self.surface.axis_point[1])
        start, step = self.meridian[:-1], np.diff(self.meridian, axis=0)
        low, high = np.zeros(len(start)), step[:, 0].copy()
        low[0], high[-1] = -np.inf, np.inf
        out = np.empty(len(points))
        size = max(CHUNK // len(start), 1)
        for first in range(0, len(points), size):
            rows = slice(first, first + size)
            dr, dz = r[rows, None] - start[:, 1], points[rows, 2, None] - start[:, 2]
            t = np.clip((dr * step[:, 1] + dz * step[:, 2]) / step[:, 0], low, high)
            away = (dr - t * step[:, 1] / step[:, 0]) ** 2 + (dz - t * step[:, 2] / step[:, 0]) ** 2
            best = np.argmin(away, axis=1)
            out[rows] = start[best, 0] + t[np.arange(len(best)), best]
        return out

    def flat(self, points: Floats) -> Floats:
        """Coordinates (n, 2) of a curve's points (n, 3), unwrapped along the curve, mm."""
        turn = np.unwrap(np.arctan2(*(points[:, :2] - self.surface.axis_point).T[::-1])) - self.angle
        turn -= 2 * np.pi * np.round(0.5 * (turn.min() + turn.max()) / (2 * np.pi))
        s = self._along(points)
        across = self.radius + self.slope * s
        roll = turn * self.slope
        x = across * turn * np.sinc(roll / np.pi)
        y = s - 0.5 * across * self.slope * turn**2 * np.sinc(0.5 * roll / np.pi) ** 2
        return np.stack([x, y], axis=1)

    def lift(self, flat: Floats) -> Floats:
        """Points (n, 3) on the surface at coordinates (n, 2)."""
        if self.slope == 0.0:
            turn, s = flat[:, 0] / self.radius, flat[:, 1]
        else:
            apex, side = self.radius / self.slope, math.copysign(1.0, self.slope)
            along = flat[:, 1] + apex
            s = side * np.hypot(flat[:, 0], along) - apex
            turn = np.arctan2(side * flat[:, 0], side * along) / self.slope
        r, z = _at(self.meridian, s)
        x, y = self.surface.axis_point
        points = np.stack([x + r * np.cos(turn + self.angle), y + r * np.sin(turn + self.angle), z], axis=1)
        return on_surface(self.surface, points) if isinstance(self.surface, Revolved) else points

    def spacing(self, tolerance_mm: float) -> float:
        """How far apart points of a straight line may lie for chords to stay within a tolerance."""
        if isinstance(self.surface, Revolved):
            return min(0.1, 10 * tolerance_mm)  # its profile may have corners
        return 1.8 * math.sqrt(2 * tolerance_mm * max(float(self.meridian[:, 1].min()), 0.1))


Chart = FlatChart | RoundChart


def _meridian(surface: Cylinder | Cone | Revolved, points: Floats) -> Floats:
    """Arc length, r and z of a surface's profile over the range of points."""
    low, high = float(points[:, 2].min()), float(points[:, 2].max())
    if isinstance(surface, Revolved):
        chain = surface.chain(PROFILE_MM)
        r, z = chain.r, chain.z
        if not math.isnan(chain.slope[0]):
            r, z = np.append(r[0] - chain.slope[0], r), np.append(z[0] - 1.0, z)
        if not math.isnan(chain.slope[1]):
            r, z = np.append(r, r[-1] + chain.slope[1]), np.append(z, z[-1] + 1.0)
    else:
        z = np.array([low, high if high > low + 1e-6 else low + 1.0])
        r = surface.radius + (surface.slope * z if isinstance(surface, Cone) else 0.0 * z)
    s = np.append(0.0, np.cumsum(np.hypot(np.diff(r), np.diff(z))))
    kept = np.append(True, np.diff(s) > 1e-9)
    return np.stack([s, r, z], axis=1)[kept]


def _at(meridian: Floats, s: Floats) -> tuple[Floats, Floats]:
    """Radii and heights at arc lengths; the first and last segment run on."""
    k = np.clip(np.searchsorted(meridian[:, 0], s) - 1, 0, len(meridian) - 2)
    step = meridian[k + 1] - meridian[k]
    share = (s - meridian[k, 0]) / step[:, 0]
    return meridian[k, 1] + share * step[:, 1], meridian[k, 2] + share * step[:, 2]


def on_surface(surface: Cylinder | Cone | Revolved | Plane, points: Floats) -> Floats:
    """Points (n, 3) near a surface put onto it along its normals."""
    for _ in range(3):
        points = points - surface.distance(points)[:, None] * surface.normals(points)
    return points


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


def islands(layer: Layer) -> list[Island]:
    """The connected regions of a layer, each in its chart.

    Args:
        layer: the layer.

    Returns:
        One island an outer border; one for all rings together.

    Raises:
        PartError: the region holds a pole of its surface, where there is no way round.
    """
    import shapely

    surface = layer.surface
    closed = [curve for curve in layer.curves if curve.closed]
    if isinstance(surface, Plane):
        chart = FlatChart(surface)
        region = region_of([chart.flat(curve.points) for curve in closed])
        parts = [part for part in shapely.get_parts(region) if part.geom_type == "Polygon"]
        return [Island(chart, part) for part in parts if part.area > LEAST_AREA_MM2]
    rings = [curve for curve in closed if curve.winding]
    if sum(curve.winding for curve in rings):
        raise PartError(
            f"layer {layer.index}: runs over the end of its body, where it cannot be unrolled;"
            " only pattern contour can be laid there"
        )
    found: list[Island] = []
    for curve in closed:
        if not curve.winding and not curve.hole:
            around = RoundChart.around(surface, [curve.points], ring=False)
            found.append(Island(around, shapely.Polygon(around.flat(curve.points)).buffer(0)))
    if rings:
        found.append(_ring(RoundChart.around(surface, [curve.points for curve in rings], ring=True), rings))
    for curve in closed:
        if curve.hole and not curve.winding:
            found = [_with_hole(island, curve) for island in found]
    return [island for island in found if island.area_mm2 > LEAST_AREA_MM2]


def _ring(chart: RoundChart, rings: Sequence[Curve]) -> Island:
    flats = [chart.flat(curve.points) for curve in rings]
    borders = tuple(flat if curve.winding > 0 else flat[::-1] for curve, flat in zip(rings, flats, strict=True))
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
    """The island without a hole, if it lies in it."""
    import shapely
    from shapely import affinity

    chart = island.chart
    assert isinstance(chart, RoundChart)
    hole = shapely.Polygon(chart.flat(curve.points)).buffer(0)
    if chart.period is not None:
        island = replace(island, holes=(*island.holes, hole))
        return island.repeated(0.0)
    turns = 2 * math.pi * chart.radius if chart.slope == 0.0 else 0.0
    for k in (0, 1, -1) if turns else (0,):
        moved = affinity.translate(hole, k * turns)
        if island.region.intersects(moved):
            return replace(island, region=island.region.difference(moved))
    return island
