"""Planes with an outward side, along which layers are laid on one another.

plane = Plane((20.0, 0.0, 0.0), (1.0, 0.0, 0.0))
plane.distance(points)           # signed, mm, positive on the outward side
plane.lifted(plane.unrolled(points))
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..mesh.solid import Bools, Floats
from .offsets import GRAZING_RAD, Offsets, farthest_turn


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
    is_flat = True

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

    def height_over(self, other: Plane) -> float:
        """How far outside a parallel plane it lies, mm."""
        return -float(self.distance(np.array([other.point]))[0])

    def may_reach(self, height: Floats, below_mm: float, half_mm: npt.ArrayLike) -> Bools:
        """Which points may be corners of a triangle that reaches below an offset.

        Args:
            height: (n,) of the points over the plane, mm.
            below_mm: of the offset.
            half_mm: half the length of the triangles' sides at most; it does not matter: triangles are flat.
        """
        return np.asarray(height <= below_mm)

    def away_from(self, axis_point: tuple[float, float], middle: float, half: float) -> tuple[float, float]:
        """Least and greatest distance from an axis that it has within a sector about it, mm.

        Args:
            axis_point: of the axis.
            middle: angle of the sector's middle, rad.
            half: half the sector's angle, rad.
        """
        away = -float(self.distance(np.array([[*axis_point, 0.0]]))[0])
        if away <= 0:  # beyond the axis: anything may be
            return -math.inf, math.inf
        turn = farthest_turn(self.normal, middle, half)
        return away, away / math.cos(turn) if turn < GRAZING_RAD else math.inf

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
        """As schema rbam-slices/1 writes it."""
        return {
            "kind": "plane",
            "point": [float(v) for v in self.point],
            "normal": [float(v) for v in self.normal],
        }
