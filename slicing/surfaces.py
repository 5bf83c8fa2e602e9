"""The surfaces that layers lie on: cylinders parallel to z and planes. Both know their outward side.

The outward normal is the direction of deposition: material is laid from the inside outward.

    body = Cylinder((0.0, 0.0), 20.0)
    body.distance(points)            # signed, mm, positive outside
    body.normals(points)             # unit, away from the axis
    body.to_dict()                   # {"kind": "cylinder", "axis_point": [0.0, 0.0], "radius": 20.0}
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from slicing.part import Floats


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
        return np.hypot(points[:, 0] - self.axis_point[0], points[:, 1] - self.axis_point[1]) - self.radius

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


Surface = Cylinder | Plane
