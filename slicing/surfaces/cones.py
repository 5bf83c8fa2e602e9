"""Cones about axes parallel to z.

cone = Cone((0.0, 0.0), 20.0, half_angle_deg=15.0)     # 20 mm at z = 0, growing upwards
cone.offset(1.73)                                    # as far out along its normals, the apex moved along the axis
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..mesh.solid import Floats
from .cylinders import Cylinder
from .offsets import AboutAxis
from .profile import ProfileChain
from .rays import across_axis, marched, widest_at

FAR_MM = 1e5  # an apex farther away than this from z = 0 is none


@dataclass(frozen=True)
class Cone(AboutAxis):
    """A cone about an axis parallel to z: the nappe on which the radius is positive.

    Attributes:
        axis_point: (x, y) of the axis, mm, part frame.
        radius: at z = 0, mm; below 0 where the apex lies above a cone that widens upwards.
        half_angle_deg: between the axis and the rulings, within -90 .. 90 (exclusive): above 0 the radius
            grows with z, below 0 it shrinks, 0 is a cylinder.
    """

    axis_point: tuple[float, float]
    radius: float
    half_angle_deg: float
    kind = "cone"
    is_straight = False

    @property
    def slope(self) -> float:
        """Growth of the radius with z."""
        return math.tan(math.radians(self.half_angle_deg))

    def offset(self, by_mm: float) -> Cone:
        """The cone by_mm further out along the normals: the same angle, the apex moved along the axis."""
        return replace(self, radius=self.radius + by_mm / math.cos(math.radians(self.half_angle_deg)))

    def normals(self, points: Floats) -> Floats:
        """Outward unit normals (n, 3) at points (n, 3)."""
        out = Cylinder(self.axis_point, 1.0).normals(points) * math.cos(math.radians(self.half_angle_deg))
        out[:, 2] = -math.sin(math.radians(self.half_angle_deg))
        return out

    def distance(self, points: Floats) -> Floats:
        """Signed distance (n,) to the rulings' lines, mm, positive outside.

        Beyond the apex, where the nearest point would be the apex itself, it is still the distance to the
        ruling's line: which offset of the cone the point lies on.
        """
        r = np.hypot(points[:, 0] - self.axis_point[0], points[:, 1] - self.axis_point[1])
        return (r - self.radius - self.slope * points[:, 2]) * math.cos(math.radians(self.half_angle_deg))

    def unrolled(self, points: Floats) -> Floats:
        """Isometric coordinates (n, 2) of a curve's points, mm: the sector that the cone unrolls to.

        The ruling at angle 0 is the second axis, its point at z = 0 the origin; for half angle 0 they are the
        cylinder's arc length and z. Successive points are less than half a turn apart.
        """
        x, y = points[:, 0] - self.axis_point[0], points[:, 1] - self.axis_point[1]
        half = math.radians(self.half_angle_deg)
        sine, r, turn = math.sin(half), np.hypot(x, y), np.unwrap(np.arctan2(y, x))
        # r sin(turn sine) / sine and r (1 - cos(turn sine)) / sine, both safe at sine = 0
        across = r * turn * np.sinc(turn * sine / np.pi)
        sag = 0.5 * r * sine * turn**2 * np.sinc(0.5 * turn * sine / np.pi) ** 2
        return np.stack([across, points[:, 2] / math.cos(half) - sag], axis=1)

    def chain(self, sagitta_mm: float) -> ProfileChain:
        """Its profile from the apex on; `sagitta_mm` does not matter: it is exact."""
        slope, apex = self.slope, self.apex_z
        if apex is None:
            return ProfileChain(np.array([self.radius]), np.zeros(1), (slope, slope))
        ends = (math.nan, slope) if slope > 0 else (slope, math.nan)
        return ProfileChain(np.zeros(1), np.array([apex]), ends)

    @property
    def apex_z(self) -> float | None:
        """Height of the apex, mm; None where it is too far away to be reckoned from."""
        return None if self.radius > FAR_MM * abs(self.slope) else -self.radius / self.slope

    def ruling_from_apex(self, radius: float) -> tuple[Floats, Floats] | None:
        """Radii and heights (2,) of a ruling from the apex out to a radius, mm; None where the apex is far away."""
        apex = self.apex_z
        return None if apex is None else (np.array([0.0, radius]), apex + np.array([0.0, radius / self.slope]))

    @property
    def family(self) -> object:
        """What its offsets have in common with it."""
        return self.axis_point, self.half_angle_deg

    @property
    def level(self) -> float:
        """How far out it lies among its offsets, mm."""
        return self.radius * math.cos(math.radians(self.half_angle_deg))

    @property
    def ends(self) -> tuple[bool, bool]:
        """Whether its apex is its lower end, and its upper one."""
        return self.slope > 0, self.slope < 0

    def radius_at(self, z: Floats) -> Floats:
        """Radius (n,) at heights (n,), mm; 0 beyond the apex."""
        return self.chain(1e-3).radius_at(z)

    def ray_distance(self, points: Floats, normals: Floats) -> Floats:
        """Distance (n,) from points (n, 3), going against unit normals (n, 3), mm; inf where the ray passes by."""
        if (normals[:, 2] == 0.0).all():
            return across_axis(points, normals, self.axis_point, widest_at(self, points[:, 2]))
        return marched(points, normals, self)

    def profile_between(self, low: float, high: float, sagitta_mm: float) -> tuple[Floats, Floats]:
        """Radii and heights (2,) of its profile between two heights; `sagitta_mm` does not matter: it is straight."""
        z = np.array([low, high])
        return self.radius + self.slope * z, z

    def to_dict(self) -> dict[str, Any]:
        """As schema rbam-slices/1 writes it; `radius` is that at z = 0."""
        return {
            "kind": "cone",
            "axis_point": [float(v) for v in self.axis_point],
            "radius": float(self.radius),
            "half_angle_deg": float(self.half_angle_deg),
        }
