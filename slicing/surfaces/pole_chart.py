"""The end of a body of revolution as a map of its pole shows it.

    chart = PoleChart.around(surface, [border], side=1)      # 1: the upper end
    line = chart.lift(flat)                              # (n, 2) in the chart, mm -> (n, 3) on the surface

Every point is at its distance along the profile, in its direction. A flat end is exact; elsewhere no parallel is longer
on the surface than in the chart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..mesh.solid import Floats
from .meridians import apart, feet, from_pole, on_surface, point_at, share_left
from .surfaces import Round

FINE_CUT = 256  # chords in a quarter of a parallel
ANNULI = 64  # by which areas on a dome are summed


@dataclass(frozen=True, eq=False)
class PoleChart:
    """The end of a body of revolution, laid flat: every point at its distance from the pole, in its direction.

    Attributes:
        surface: what is unrolled.
        meridian: (k, 3) arc length from the pole, r and z along the profile, mm.
        side: 1 at the upper end, -1 at the lower, which is seen from below.
        stretch: least and greatest ratio of lengths round the axis in the chart to those on the surface.
    """

    surface: Round
    meridian: Floats
    side: int
    stretch: tuple[float, float]
    period = None
    bends = True  # over a tip
    turn_mm = 0.0

    @classmethod
    def around(cls, surface: Round, loops: Sequence[Floats], side: int, whole: bool = True) -> PoleChart:
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
        bare = cls(surface, from_pole(surface, points, side), side, (1.0, 1.0))
        s = feet(bare.meridian, *apart(surface, points), 0.0)
        low, high = 0.0 if whole else float(s.min()), float(s.max())
        at = bare.meridian[(bare.meridian[:, 0] > low) & (bare.meridian[:, 0] < high), 0]
        ratio = bare.longer(np.concatenate([[max(low, 1e-6)], at, [max(high, 1e-6)]]))
        return replace(bare, stretch=(float(ratio.min()), float(ratio.max())))

    def radii(self, s: Floats) -> Floats:
        """Distances (n,) from the axis at distances from the pole."""
        return point_at(self.meridian, s)[0]

    def longer(self, s: Floats) -> Floats:
        """How much longer parallels (n,) are in the chart than on the surface, at distances from the pole."""
        return s / np.maximum(self.radii(s), 1e-12)

    def flat(self, points: Floats) -> Floats:
        """Coordinates (n, 2) of points (n, 3), mm."""
        r, z = apart(self.surface, points)
        grown = feet(self.meridian, r, z, 0.0) / np.where(r > 0, r, 1.0)
        return (points[:, :2] - self.surface.axis_point) * np.stack([grown, self.side * grown], axis=1)

    def flat_each(self, points: Floats) -> Floats:
        """Coordinates (n, 2) of points (n, 3) of several curves, mm."""
        return self.flat(points)

    def lift(self, flat: Floats) -> Floats:
        """Points (n, 3) on the surface at coordinates (n, 2)."""
        s = np.hypot(flat[:, 0], flat[:, 1])
        r, z = point_at(self.meridian, s)
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
        return share_left(1.0 / self.longer(np.maximum(np.hypot(flat[:, 0], flat[:, 1]), 1e-6)), flat, ways)

    def within(self, s: float) -> Any:
        """What lies up to a distance from the pole, mm, as a shapely geometry in the chart."""
        import shapely

        return shapely.Point(0.0, 0.0).buffer(s, FINE_CUT)

    def area(self, region: Any) -> float:
        """Area on the surface of a region in the chart (shapely), mm²: annulus by annulus."""
        import shapely

        if region.is_empty:
            return 0.0
        far = float(np.hypot(*shapely.get_coordinates(region).T).max())
        at = np.linspace(0.0, far, ANNULI + 1)
        if self.longer(at[1:]).max() < 1.0 + 1e-9:
            return float(region.area)
        up_to = [0.0, *(float(region.intersection(self.within(s)).area) for s in at[1:-1]), float(region.area)]
        return float((np.diff(up_to) / self.longer(0.5 * (at[1:] + at[:-1]))).sum())
