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
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..mesh.solid import Floats
from .profile import Profile, ProfileChain
from .rays import across_axis, marched

FAR_MM = 1e5  # an apex farther away than this from z = 0 is none
STEP_MM = 1e-9  # to either side of a height, so that a step there is seen


class Offsets(ABC):
    """What planes, cylinders, cones and profiles answer alike: which surfaces are offsets of one another.

    Attributes:
        is_straight: whether it is the same at every height of its axis, as planes and cylinders are.
        bends: whether it may have corners, as profiles have.
    """

    is_straight = True
    bends = False

    @property
    def ends(self) -> tuple[bool, bool]:
        """Whether it meets its axis at its lower end, and at its upper one."""
        return False, False

    @property
    @abstractmethod
    def family(self) -> object:
        """What the surface and its offsets have in common."""

    def is_offset_of(self, other: Offsets) -> bool:
        """Whether the other surface is this one, so far inward or outward."""
        return self.family == other.family

    def facing(self, axis_point: tuple[float, float]) -> tuple[Floats, Floats] | None:
        """The straight line of the surface that faces an axis: a point (2,) of the plane through both, and its normal.

        None where thickness over an axis is the same along the whole surface.
        """
        return None


@dataclass(frozen=True)
class Cylinder(Offsets):
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

    @property
    def family(self) -> object:
        """What its offsets have in common with it."""
        return self.axis_point

    @property
    def level(self) -> float:
        """How far out it lies among its offsets, mm."""
        return self.radius

    def radius_at(self, z: Floats) -> Floats:
        """Radius (n,) at heights (n,), mm."""
        return np.full(len(z), self.radius)

    def ray_distance(self, points: Floats, normals: Floats) -> Floats:
        """Distance (n,) from points (n, 3), going against unit normals (n, 3), to the outermost crossing, mm.

        It is inf where the ray passes by.
        """
        return across_axis(points, normals, self.axis_point, np.full(len(points), self.radius))

    def facing(self, axis_point: tuple[float, float]) -> tuple[Floats, Floats]:
        """The ruling that faces an axis: a point (2,) of the plane through both, and its normal."""
        origin = np.asarray(self.axis_point)
        return origin, np.asarray(axis_point) - origin

    def profile_between(self, low: float, high: float, sagitta_mm: float) -> tuple[Floats, Floats]:
        """Radii and heights (2,) of its profile between two heights; `sagitta_mm` does not matter: it is straight."""
        z = np.array([low, high])
        return self.radius_at(z), z

    def lifted(self, flat: Floats) -> Floats:
        """Points (n, 3) at unrolled coordinates (n, 2)."""
        (x, y), r = self.axis_point, self.radius
        return np.stack([x + r * np.cos(flat[:, 0] / r), y + r * np.sin(flat[:, 0] / r), flat[:, 1]], axis=1)

    @property
    def turn_mm(self) -> float:
        """Length of a whole turn in unrolled coordinates."""
        return 2 * math.pi * self.radius

    def to_dict(self) -> dict[str, Any]:
        """As the contract rbam-slices/1 writes it."""
        return {
            "kind": "cylinder",
            "axis_point": [float(v) for v in self.axis_point],
            "radius": float(self.radius),
        }


@dataclass(frozen=True)
class Plane(Offsets):
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

    @property
    def family(self) -> object:
        """What its offsets have in common with it."""
        return self.normal

    @property
    def level(self) -> float:
        """How far out it lies among its offsets, mm."""
        return float(np.dot(self.point, self.normal))

    def ray_distance(self, points: Floats, normals: Floats) -> Floats:
        """Distance (n,) from points (n, 3), going against unit normals (n, 3), mm; inf along the plane."""
        towards = normals @ np.asarray(self.normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(np.abs(towards) > 1e-12, self.distance(points) / towards, np.inf)

    def facing(self, axis_point: tuple[float, float]) -> tuple[Floats, Floats]:
        """The line that faces an axis: a point (2,) of the plane through both, and its normal."""
        return np.asarray(axis_point), np.asarray(self.normal[:2])

    def lifted(self, flat: Floats) -> Floats:
        """Points (n, 3) at unrolled coordinates (n, 2)."""
        u, v = self.axes()
        return np.asarray(self.point) + flat[:, :1] * u + flat[:, 1:] * v

    @property
    def turn_mm(self) -> float:
        """Length of a whole turn in unrolled coordinates: there is none."""
        return 0.0

    def to_dict(self) -> dict[str, Any]:
        """As the contract rbam-slices/1 writes it."""
        return {
            "kind": "plane",
            "point": [float(v) for v in self.point],
            "normal": [float(v) for v in self.normal],
        }


@dataclass(frozen=True)
class Cone(Offsets):
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
        slope = self.slope
        if self.radius > FAR_MM * abs(slope):  # no apex to reckon from
            return ProfileChain(np.array([self.radius]), np.zeros(1), (slope, slope))
        ends = (math.nan, slope) if slope > 0 else (slope, math.nan)
        return ProfileChain(np.zeros(1), np.array([-self.radius / slope]), ends)

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
            return across_axis(points, normals, self.axis_point, _widest_at(self, points[:, 2]))
        return marched(points, normals, self)

    def profile_between(self, low: float, high: float, sagitta_mm: float) -> tuple[Floats, Floats]:
        """Radii and heights (2,) of its profile between two heights; `sagitta_mm` does not matter: it is straight."""
        z = np.array([low, high])
        return self.radius + self.slope * z, z

    def to_dict(self) -> dict[str, Any]:
        """As the contract rbam-slices/1 writes it; `radius` is that at z = 0."""
        return {
            "kind": "cone",
            "axis_point": [float(v) for v in self.axis_point],
            "radius": float(self.radius),
            "half_angle_deg": float(self.half_angle_deg),
        }


@dataclass(frozen=True)
class Revolved(Offsets):
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
            return across_axis(points, normals, self.axis_point, _widest_at(self, points[:, 2]))
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
        """As the contract rbam-slices/1 writes it: profile points are [r, z]."""
        return {
            "kind": "revolved",
            "axis_point": [float(v) for v in self.axis_point],
            "profile": [[float(r), float(z)] for r, z in self.profile],
            "offset": float(self.offset_mm),
        }


def _widest_at(surface: Cone | Revolved, z: Floats) -> Floats:
    """Radius (n,) of a surface of revolution at heights, at a step the greater of the two."""
    return np.maximum(surface.radius_at(z - STEP_MM), surface.radius_at(z + STEP_MM))


Round = Cylinder | Cone | Revolved
Surface = Cylinder | Plane | Cone | Revolved
