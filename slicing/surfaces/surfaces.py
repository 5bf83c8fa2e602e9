"""The surfaces that layers lie on: planes, cylinders, cones and other surfaces of revolution about z.

All know their outward side; axes are parallel to z. The outward normal is the direction of deposition:
material is laid from the inside outward.

    body = Cylinder((0.0, 0.0), 20.0)
    body.distance(points)            # signed, mm, positive outside
    body.normals(points)             # unit, away from the axis
    body.to_dict()                   # {"kind": "cylinder", "axis_point": [0.0, 0.0], "radius": 20.0}
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..mesh.solid import Floats
from .profile import Profile, ProfileChain

FAR_MM = 1e5  # an apex farther away than this from z = 0 is none


@dataclass(frozen=True)
class Cylinder:
    """A cylinder whose axis is parallel to z.

    Attributes:
        axis_point: (x, y) of the axis, mm, part frame.
        radius: mm.
    """

    axis_point: tuple[float, float]
    radius: float
    kind = "cylinder"

    def offset(self, by_mm: float) -> Cylinder:
        """The cylinder about the same axis, by_mm further out."""
        return Cylinder(self.axis_point, self.radius + by_mm)

    def normals(self, points: Floats) -> Floats:
        """Outward unit normals (n, 3) at points (n, 3)."""
        out = np.zeros_like(points)
        radial = points[:, :2] - self.axis_point
        length = np.hypot(radial[:, 0], radial[:, 1])
        out[:, :2] = radial / np.where(length > 0, length, 1.0)[:, None]
        out[length == 0, 0] = 1.0  # on the axis every direction is as good
        return out

    def distance(self, points: Floats) -> Floats:
        """Signed distance (n,), mm, positive outside."""
        x, y = (points[:, k] - self.axis_point[k] for k in (0, 1))
        return np.sqrt(x * x + y * y) - self.radius  # several times faster than hypot

    def unrolled(self, points: Floats) -> Floats:
        """Arc length and height (n, 2) of a curve's points, unwrapped along the curve (no jump at ±180°).

        Args:
            points: (n, 3) successive points less than half a turn apart.

        Returns:
            (n, 2) mm: radius times the angle about the axis, and z.
        """
        angle = np.arctan2(points[:, 1] - self.axis_point[1], points[:, 0] - self.axis_point[0])
        return np.stack([self.radius * np.unwrap(angle), points[:, 2]], axis=1)

    def to_dict(self) -> dict[str, Any]:
        """As the contract rbam-slices/1 writes it."""
        return {
            "kind": "cylinder",
            "axis_point": [float(v) for v in self.axis_point],
            "radius": float(self.radius),
        }


@dataclass(frozen=True)
class Plane:
    """A plane with an outward side.

    Attributes:
        point: a point of it, mm, part frame.
        normal: unit outward normal.
    """

    point: tuple[float, float, float]
    normal: tuple[float, float, float]
    kind = "plane"

    def offset(self, by_mm: float) -> Plane:
        """The parallel plane by_mm further out."""
        x, y, z = (p + by_mm * n for p, n in zip(self.point, self.normal, strict=True))
        return Plane((x, y, z), self.normal)

    def normals(self, points: Floats) -> Floats:
        """Outward unit normals (n, 3) at points (n, 3)."""
        return np.broadcast_to(np.asarray(self.normal, dtype=np.float64), points.shape).copy()

    def distance(self, points: Floats) -> Floats:
        """Signed distance (n,), mm, positive on the outward side."""
        return (points - np.asarray(self.point)) @ np.asarray(self.normal, dtype=np.float64)

    def axes(self) -> tuple[Floats, Floats]:
        """Unit vectors (u, v) in the plane, u x v = normal; v is z projected into it where that exists."""
        n = np.asarray(self.normal, dtype=np.float64)
        up = np.array([0.0, 0.0, 1.0]) if abs(n[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
        u = np.cross(up, n)
        u /= np.linalg.norm(u)
        return u, np.cross(n, u)

    def unrolled(self, points: Floats) -> Floats:
        """Coordinates (n, 2) of points in the plane along `axes`, mm."""
        relative = points - np.asarray(self.point)
        return np.stack([relative @ axis for axis in self.axes()], axis=1)

    def to_dict(self) -> dict[str, Any]:
        """As the contract rbam-slices/1 writes it."""
        return {
            "kind": "plane",
            "point": [float(v) for v in self.point],
            "normal": [float(v) for v in self.normal],
        }


@dataclass(frozen=True)
class Cone:
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
        slope = self.slope
        if self.radius > FAR_MM * abs(slope):  # no apex to reckon from
            return ProfileChain(np.array([self.radius]), np.zeros(1), (slope, slope))
        ends = (math.nan, slope) if slope > 0 else (slope, math.nan)
        return ProfileChain(np.zeros(1), np.array([-self.radius / slope]), ends)

    def to_dict(self) -> dict[str, Any]:
        """As the contract rbam-slices/1 writes it; `radius` is that at z = 0."""
        return {
            "kind": "cone",
            "axis_point": [float(v) for v in self.axis_point],
            "radius": float(self.radius),
            "half_angle_deg": float(self.half_angle_deg),
        }


@dataclass(frozen=True)
class Revolved:
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

    def to_dict(self) -> dict[str, Any]:
        """As the contract rbam-slices/1 writes it: profile points are [r, z]."""
        return {
            "kind": "revolved",
            "axis_point": [float(v) for v in self.axis_point],
            "profile": [[float(r), float(z)] for r, z in self.profile],
            "offset": float(self.offset_mm),
        }


Round = Cylinder | Cone | Revolved
Surface = Cylinder | Plane | Cone | Revolved
