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
from dataclasses import dataclass, replace

import numpy as np

from ..mesh.solid import Floats
from .surfaces import Cone, Cylinder, Plane, Revolved

PROFILE_MM = 1e-4  # sagitta of a profile's sampled arcs; lifted points are put onto the exact surface
STRAIGHT = 1e-6  # slopes below this count as a cylinder's
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
    bends = False

    def flat(self, points: Floats) -> Floats:
        """Coordinates (n, 2) of points (n, 3), mm."""
        return self.surface.unrolled(points)

    def lift(self, flat: Floats) -> Floats:
        """Points (n, 3) at coordinates (n, 2)."""
        return self.surface.lifted(flat)

    def spacing(self, tolerance_mm: float) -> float:
        """How far apart points of a straight line may lie."""
        return math.inf

    def spacing_share(self, flat: Floats, ways: Floats) -> Floats:
        """Distance of neighbouring lines on the surface as a share (n,) of that in the chart."""
        return np.ones(len(flat))


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
        r = np.concatenate([_at(meridian, np.array([low]))[0], inner[:, 1], _at(meridian, np.array([high]))[0]])
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
        r, _ = _at(self.meridian, s)
        return _share(r / np.maximum(self.radius + self.slope * s, 1e-9), up, ways)


@dataclass(frozen=True, eq=False)
class PoleChart:
    """The end of a body of revolution, laid flat: every point at its distance from the pole, in its direction.

    Attributes:
        surface: what is unrolled.
        meridian: (k, 3) arc length from the pole, r and z along the profile, mm.
        side: 1 at the upper end, -1 at the lower, which is seen from below.
        stretch: least and greatest ratio of lengths round the axis in the chart to those on the surface.
    """

    surface: Cone | Revolved
    meridian: Floats
    side: int
    stretch: tuple[float, float]
    period = None
    bends = True  # over a tip

    @classmethod
    def around(cls, surface: Cone | Revolved, loops: Sequence[Floats], side: int, whole: bool = True) -> PoleChart:
        """The chart for a region.

        Args:
            surface: what it lies on.
            loops: (n, 3) points of its outer borders, mm.
            side: 1 for the upper end of the body, -1 for the lower.
            whole: whether the region holds the pole.

        Returns:
            The chart.
        """
        points = np.concatenate(loops)
        bare = cls(surface, _from_pole(surface, points, side), side, (1.0, 1.0))
        s = _foot(bare.meridian, *_apart(surface, points), 0.0)
        low, high = 0.0 if whole else float(s.min()), float(s.max())
        at = bare.meridian[(bare.meridian[:, 0] > low) & (bare.meridian[:, 0] < high), 0]
        ratio = bare.longer(np.concatenate([[max(low, 1e-6)], at, [max(high, 1e-6)]]))
        return replace(bare, stretch=(float(ratio.min()), float(ratio.max())))

    def radii(self, s: Floats) -> Floats:
        """Distances (n,) from the axis at distances from the pole."""
        return _at(self.meridian, s)[0]

    def longer(self, s: Floats) -> Floats:
        """How much longer parallels (n,) are in the chart than on the surface, at distances from the pole."""
        return s / np.maximum(self.radii(s), 1e-12)

    def flat(self, points: Floats) -> Floats:
        """Coordinates (n, 2) of points (n, 3), mm."""
        r, z = _apart(self.surface, points)
        grown = _foot(self.meridian, r, z, 0.0) / np.where(r > 0, r, 1.0)
        return (points[:, :2] - self.surface.axis_point) * np.stack([grown, self.side * grown], axis=1)

    def lift(self, flat: Floats) -> Floats:
        """Points (n, 3) on the surface at coordinates (n, 2)."""
        s = np.hypot(flat[:, 0], flat[:, 1])
        r, z = _at(self.meridian, s)
        x, y = (flat * [1.0, self.side] * (r / np.where(s > 0, s, 1.0))[:, None] + self.surface.axis_point).T
        return on_surface(self.surface, np.stack([x, y, z], axis=1))

    def spacing(self, tolerance_mm: float) -> float:
        """How far apart points of a straight line may lie for chords to stay within a tolerance."""
        return min(0.1, 10 * tolerance_mm)

    def spacing_share(self, flat: Floats, ways: Floats) -> Floats:
        """Distance of neighbouring lines on the surface as a share (n,) of that in the chart.

        Args:
            flat: (n, 2) places in the chart.
            ways: (n, 2) directions of the lines there, of any length.
        """
        return _share(1.0 / self.longer(np.maximum(np.hypot(flat[:, 0], flat[:, 1]), 1e-6)), flat, ways)


Chart = FlatChart | RoundChart | PoleChart


def meridian_of(surface: Cylinder | Cone | Revolved, points: Floats, sagitta_mm: float = PROFILE_MM) -> Floats:
    """A surface's profile, upwards.

    Args:
        surface: the surface.
        points: (n, 3) what of it is needed: cylinders and cones have no ends of their own.
        sagitta_mm: how far chords may stray from the arcs of offset profiles.

    Returns:
        (k, 3) arc length, r and z, mm; of profiles that are closed on the axis up to there.
    """
    low, high = float(points[:, 2].min()), float(points[:, 2].max())
    r, z = surface.profile_between(low, high if high > low + 1e-6 else low + 1.0, sagitta_mm)
    s = np.append(0.0, np.cumsum(np.hypot(np.diff(r), np.diff(z))))
    kept = np.append(True, np.diff(s) > 1e-9)
    return np.stack([s, r, z], axis=1)[kept]


def _from_pole(surface: Cone | Revolved, points: Floats, side: int) -> Floats:
    """Arc length from the pole, r and z of a surface's profile, as far as points lie on it."""
    if isinstance(surface, Cone):
        reach = max(float(_apart(surface, points)[0].max()), 1.0)
        z = -surface.radius / surface.slope + np.array([0.0, reach / surface.slope])
        r = np.array([0.0, reach])
        return np.stack([np.append(0.0, math.hypot(reach, z[1] - z[0])), r, z], axis=1)
    meridian = meridian_of(surface, points)
    if side > 0:
        meridian = meridian[::-1] * [-1.0, 1.0, 1.0] + [meridian[-1, 0], 0.0, 0.0]
    return meridian


def _apart(surface: Cylinder | Cone | Revolved, points: Floats) -> tuple[Floats, Floats]:
    """Distances (n,) of points from a surface's axis, and their heights (n,)."""
    return np.hypot(points[:, 0] - surface.axis_point[0], points[:, 1] - surface.axis_point[1]), points[:, 2]


def _foot(meridian: Floats, r: Floats, z: Floats, least: float) -> Floats:
    """Arc lengths (n,) of a meridian's nearest points; it runs on beyond its end, and down to `least`."""
    start, step = meridian[:-1], np.diff(meridian, axis=0)
    low, high = np.zeros(len(start)), step[:, 0].copy()
    low[0], high[-1] = least, np.inf
    out = np.empty(len(r))
    size = max(CHUNK // len(start), 1)
    for first in range(0, len(r), size):
        rows = slice(first, first + size)
        dr, dz = r[rows, None] - start[:, 1], z[rows, None] - start[:, 2]
        t = np.clip((dr * step[:, 1] + dz * step[:, 2]) / step[:, 0], low, high)
        away = (dr - t * step[:, 1] / step[:, 0]) ** 2 + (dz - t * step[:, 2] / step[:, 0]) ** 2
        best = np.argmin(away, axis=1)
        out[rows] = start[best, 0] + t[np.arange(len(best)), best]
    return out


def lengths_along(meridian: Floats, surface: Cylinder | Cone | Revolved, points: Floats) -> Floats:
    """Arc lengths (n,) of a meridian's points nearest to points (n, 3) of its surface."""
    return _foot(meridian, *_apart(surface, points), -math.inf)


def _at(meridian: Floats, s: Floats) -> tuple[Floats, Floats]:
    """Radii and heights at arc lengths; the first and last segment run on."""
    k = np.clip(np.searchsorted(meridian[:, 0], s) - 1, 0, len(meridian) - 2)
    step = meridian[k + 1] - meridian[k]
    share = (s - meridian[k, 0]) / step[:, 0]
    return meridian[k, 1] + share * step[:, 1], meridian[k, 2] + share * step[:, 2]


def _share(shorter: Floats, up: Floats, ways: Floats) -> Floats:
    """Share of the distance of lines that is left where lengths round the axis are so much shorter, (n,)."""
    along = (up * ways).sum(axis=1) ** 2
    across = (up[:, 0] * ways[:, 1] - up[:, 1] * ways[:, 0]) ** 2
    length2 = along + across
    with np.errstate(divide="ignore", invalid="ignore"):
        share = shorter / np.sqrt((along + shorter**2 * across) / length2)
    return np.asarray(np.where(length2 > 0, share, shorter))


def on_surface(surface: Cylinder | Cone | Revolved | Plane, points: Floats) -> Floats:
    """Points (n, 3) near a surface put onto it along its normals."""
    for _ in range(3):
        points = points - surface.distance(points)[:, None] * surface.normals(points)
    return points
