"""Charts: a layer's surface unrolled, and the way back onto the exact surface.

    chart = RoundChart.around(surface, [border], ring=False)
    line = chart.lift(flat)                        # (n, 2) in the chart, mm -> (n, 3) on the surface

Planes, cylinders and cones unroll isometrically: lengths and widths in the chart are those on the surface. A
profile that is turned is unrolled as the cone through the ends of its range: lengths along the profile are exact,
lengths round the axis come out at the chart's length or less (`stretch` says by how much), so that what is spaced
in the chart is never spaced wider on the surface; within one straight segment of the profile it is exact as well.

A region that goes right round (a ring) has a periodic chart: x and x + period are the same place. There a cylinder is
exact still; on cones and profiles the chart is as long everywhere as the widest parallel.

Round the end of a body, its *pole*, `PoleChart` lays the surface flat as a map of the pole does: every point at its
distance along the profile, in its direction. A flat end is exact; elsewhere what holds for profiles holds here: no
parallel is longer than its distance from the pole says.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..mesh.solid import Floats
from .meridians import lengths_along, meridian_of, on_surface, point_at, share_left
from .planes import Plane
from .pole_chart import PoleChart
from .surfaces import Round

__all__ = ["Chart", "FlatChart", "PoleChart", "RoundChart"]

STRAIGHT = 1e-6  # slopes below this count as a cylinder's


@dataclass(frozen=True, eq=False)
class FlatChart:
    """A plane, along its own axes.

    Attributes:
        surface: the plane.
    """

    surface: Plane
    period = None
    stretch = (1.0, 1.0)
    bends = False
    turn_mm = 0.0

    def flat(self, points: Floats) -> Floats:
        """Coordinates (n, 2) of points (n, 3), mm."""
        return self.surface.unrolled(points)

    def flat_each(self, points: Floats) -> Floats:
        """Coordinates (n, 2) of points (n, 3) of several curves, mm."""
        return self.flat(points)

    def lift(self, flat: Floats) -> Floats:
        """Points (n, 3) at coordinates (n, 2)."""
        return self.surface.lifted(flat)

    def spacing(self, tolerance_mm: float) -> float:
        """How far apart points of a straight line may lie."""
        return math.inf

    def spacing_share(self, flat: Floats, ways: Floats) -> Floats:
        """Distance of neighbouring lines on the surface as a share (n,) of that in the chart."""
        return np.ones(len(flat))

    def area(self, region: Any) -> float:
        """Area on the surface of a region in the chart (shapely), mm²."""
        return float(region.area)


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

    surface: Round
    meridian: Floats
    slope: float
    radius: float
    angle: float
    period: float | None
    stretch: tuple[float, float]

    @classmethod
    def around(cls, surface: Round, loops: Sequence[Floats], ring: bool) -> RoundChart:
        """The chart for a region.

        Args:
            surface: what it lies on.
            loops: (n, 3) points of its outer borders, mm.
            ring: whether it goes right round.

        Returns:
            The chart.
        """
        points = np.concatenate(loops)
        meridian = meridian_of(surface, points)
        angles = np.unwrap(np.arctan2(*(points[:, :2] - surface.axis_point).T[::-1]))
        middle = 0.0 if ring else 0.5 * float(angles.min() + angles.max())
        bare = cls(surface, meridian, 0.0, 1.0, middle, None, (1.0, 1.0))
        s = bare._along(points)
        centre = 0.5 * float(s.min() + s.max())
        meridian = meridian - [centre, 0.0, 0.0]
        low, high = float(s.min()) - centre, float(s.max()) - centre
        inner = meridian[(meridian[:, 0] > low) & (meridian[:, 0] < high)]
        at = np.concatenate([[low], inner[:, 0], [high]])
        r = np.concatenate(
            [point_at(meridian, np.array([low]))[0], inner[:, 1], point_at(meridian, np.array([high]))[0]]
        )
        slope = 0.0 if ring or high - low < 1e-9 else float(r[-1] - r[0]) / (high - low)
        slope = slope if abs(slope) > STRAIGHT else 0.0
        # never narrower than the surface: spacing in the chart is at most spacing on the surface
        radius = float((r - slope * at).max())
        ratio = (radius + slope * at) / np.maximum(r, 1e-9)
        period = 2 * math.pi * radius if ring else None
        return cls(surface, meridian, slope, radius, middle, period, (float(ratio.min()), float(ratio.max())))

    @property
    def bends(self) -> bool:
        """Whether the surface may have corners."""
        return self.surface.bends

    @property
    def turn_mm(self) -> float:
        """How far one turn about the axis moves a shape in the chart; 0 where it turns it as well."""
        return 2 * math.pi * self.radius if self.slope == 0.0 else 0.0

    def _along(self, points: Floats) -> Floats:
        """Arc length (n,) of the meridian's nearest points."""
        return lengths_along(self.meridian, self.surface, points)

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

    def flat_each(self, points: Floats) -> Floats:
        """Coordinates (n, 2) of points (n, 3) of several curves, each by itself, mm; in a chart right round."""
        x, y = (points[:, k] - self.surface.axis_point[k] for k in range(2))
        turn = (np.arctan2(y, x) - self.angle + np.pi) % (2 * np.pi) - np.pi
        return np.stack([self.radius * turn, self._along(points)], axis=1)

    def lift(self, flat: Floats) -> Floats:
        """Points (n, 3) on the surface at coordinates (n, 2)."""
        if self.slope == 0.0:
            turn, s = flat[:, 0] / self.radius, flat[:, 1]
        else:
            apex, side = self.radius / self.slope, math.copysign(1.0, self.slope)
            along = flat[:, 1] + apex
            s = side * np.hypot(flat[:, 0], along) - apex
            turn = np.arctan2(side * flat[:, 0], side * along) / self.slope
        r, z = point_at(self.meridian, s)
        x, y = self.surface.axis_point
        points = np.stack([x + r * np.cos(turn + self.angle), y + r * np.sin(turn + self.angle), z], axis=1)
        return on_surface(self.surface, points) if self.surface.bends else points

    def spacing(self, tolerance_mm: float) -> float:
        """How far apart points of a straight line may lie for chords to stay within a tolerance."""
        if self.surface.bends:
            return min(0.1, 10 * tolerance_mm)  # its profile may have corners
        return 1.8 * math.sqrt(2 * tolerance_mm * max(float(self.meridian[:, 1].min()), 0.1))

    def spacing_share(self, flat: Floats, ways: Floats) -> Floats:
        """Distance of neighbouring lines on the surface as a share (n,) of that in the chart.

        Args:
            flat: (n, 2) places in the chart.
            ways: (n, 2) directions of the lines there, of any length.
        """
        if self.slope == 0.0:
            s, up = flat[:, 1], np.tile([0.0, 1.0], (len(flat), 1))
        else:
            up = flat + np.array([0.0, self.radius / self.slope])
            s = math.copysign(1.0, self.slope) * np.hypot(*up.T) - self.radius / self.slope
        r, _ = point_at(self.meridian, s)
        return share_left(r / np.maximum(self.radius + self.slope * s, 1e-9), up, ways)

    def area(self, region: Any) -> float:
        """Area on the surface of a region in the chart (shapely), mm²: piece by piece, as it is in their middles."""
        import shapely

        if self.surface.is_straight:
            return float(region.area)
        total = 0.0
        for part in shapely.get_parts(region):
            if part.area > 0.0:
                at = np.array([part.centroid.coords[0]])
                total += float(part.area * self.spacing_share(at, np.array([[0.0, 1.0]]))[0])
        return total


Chart = FlatChart | RoundChart | PoleChart
