"""Profiles turned about axes parallel to z, and their true offsets.

    surface = Revolved((0.0, 0.0), ((20.0, 0.0), (20.0, 30.0), (28.0, 50.0)))     # (r, z) points
    surface.offset(1.73).distance(points)                                       # signed, mm, positive outside

What a profile may be, and how it goes on beyond its ends: `slicing.surfaces.profile`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..mesh.solid import Floats
from .cylinders import Cylinder
from .offsets import AboutAxis
from .profile import Profile, ProfileChain
from .rays import across_axis, marched, widest_at


@dataclass(frozen=True)
class Revolved(AboutAxis):
    """The offset of a polyline profile rotated about an axis parallel to z (see `slicing.surfaces.profile`).

    Attributes:
        axis_point: (x, y) of the axis, mm, part frame.
        profile: (r, z) points, mm, as `Profile.of` takes them.
        offset_mm: how far outside the profile the surface lies, along the normals; not below 0.
    """

    axis_point: tuple[float, float]
    profile: tuple[tuple[float, float], ...]
    offset_mm: float = 0.0
    kind = "revolved"
    is_straight = False
    bends = True

    def offset(self, by_mm: float) -> Revolved:
        """The surface by_mm further out."""
        return replace(self, offset_mm=self.offset_mm + by_mm)

    def _meridian(self, points: Floats) -> tuple[Floats, Floats]:
        return np.hypot(points[:, 0] - self.axis_point[0], points[:, 1] - self.axis_point[1]), points[:, 2]

    def normals(self, points: Floats) -> Floats:
        """Outward unit normals (n, 3) at points (n, 3)."""
        flat = Profile.of(self.profile).normals(*self._meridian(points))
        out = Cylinder(self.axis_point, 1.0).normals(points) * flat[:, :1]
        out[:, 2] = flat[:, 1]
        return out

    def distance(self, points: Floats) -> Floats:
        """Signed distance (n,), mm, positive outside."""
        return Profile.of(self.profile).distance(*self._meridian(points)) - self.offset_mm

    def unrolled(self, points: Floats) -> Floats:
        """Arc length along the parallel, and z (n, 2), mm: an order of the points, not an isometry."""
        angle = np.arctan2(points[:, 1] - self.axis_point[1], points[:, 0] - self.axis_point[0])
        r, z = self._meridian(points)
        return np.stack([r * np.unwrap(angle), z], axis=1)

    def chain(self, sagitta_mm: float) -> ProfileChain:
        """Its profile; round corners as chords that stray inward by sagitta_mm at most."""
        return Profile.of(self.profile).offset_chain(self.offset_mm, sagitta_mm)

    @property
    def family(self) -> object:
        """What its offsets have in common with it."""
        return self.axis_point, self.profile

    @property
    def level(self) -> float:
        """How far out it lies among its offsets, mm."""
        return self.offset_mm

    @property
    def ends(self) -> tuple[bool, bool]:
        """Whether its profile is closed on the axis at its lower end, and at its upper one."""
        below, above = self.chain(1.0).slope
        return math.isnan(below), math.isnan(above)

    def radius_at(self, z: Floats) -> Floats:
        """Radius (n,) at heights (n,), mm; 0 where there is nothing."""
        return self.chain(1e-3).radius_at(z)

    def ray_distance(self, points: Floats, normals: Floats) -> Floats:
        """Distance (n,) from points (n, 3), going against unit normals (n, 3), mm; inf where the ray passes by."""
        if (normals[:, 2] == 0.0).all() and self.offset_mm == 0.0:
            return across_axis(points, normals, self.axis_point, widest_at(self, points[:, 2]))
        return marched(points, normals, self)

    def profile_between(self, low: float, high: float, sagitta_mm: float) -> tuple[Floats, Floats]:
        """Radii and heights (k,) of its whole profile, and a little beyond where it has no end."""
        chain = self.chain(sagitta_mm)
        r, z = chain.r, chain.z
        if not math.isnan(chain.slope[0]):
            r, z = np.append(r[0] - chain.slope[0], r), np.append(z[0] - 1.0, z)
        if not math.isnan(chain.slope[1]):
            r, z = np.append(r, r[-1] + chain.slope[1]), np.append(z, z[-1] + 1.0)
        return r, z

    def to_dict(self) -> dict[str, Any]:
        """As schema rbam-slices/1 writes it: profile points are [r, z]."""
        return {
            "kind": "revolved",
            "axis_point": [float(v) for v in self.axis_point],
            "profile": [[float(r), float(z)] for r, z in self.profile],
            "offset": float(self.offset_mm),
        }
