"""Which triangles a level of parallel surfaces can meet: each triangle's interval of heights, found once.

Use:

    intervals = FaceIntervals.about(mesh, Cylinder((0.0, 0.0), 20.0))
    intervals.at(1.73)               # numbers of the triangles that may reach the cylinder of radius 21.73
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.solid import Floats, Ints, Mesh
from ..surfaces.surfaces import Surface

SLACK_MM = 2e-4  # more than any nudge of a level


@dataclass(frozen=True, eq=False)
class FaceIntervals:
    """Heights (m,), (m,) that the triangles may span over a surface."""

    low: Floats
    high: Floats

    @classmethod
    def about(cls, mesh: Mesh, surface: Surface) -> FaceIntervals:
        """Intervals of a mesh's triangles over a surface, from spheres around them (safe for all kinds)."""
        centres, radii = mesh.bounding_spheres
        height = surface.distance(centres)
        return cls(height - radii - SLACK_MM, height + radii + SLACK_MM)

    def at(self, height_mm: float) -> Ints:
        """Numbers of the triangles, ascending, that may reach the surface's offset by height_mm."""
        return self.between(height_mm, height_mm)

    def between(self, low_mm: float, high_mm: float) -> Ints:
        """Numbers of the triangles, ascending, that may hold points at heights low_mm .. high_mm."""
        return np.flatnonzero((self.low <= high_mm) & (self.high >= low_mm))
