"""Cylinders about axes parallel to z.

body = Cylinder((0.0, 0.0), 20.0)
body.distance(points)            # signed, mm, positive outside
body.normals(points)             # unit, away from the axis
body.to_dict()                   # {"kind": "cylinder", "axis_point": [0.0, 0.0], "radius": 20.0}
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..mesh.solid import Bools, Floats
from .offsets import GRAZING_RAD, AboutAxis, farthest_turn
from .profile import ProfileChain
from .rays import across_axis


@dataclass(frozen=True)
class Cylinder(AboutAxis):
    """A cylinder whose axis is parallel to z.

    Attributes:
        axis_point: (x, y) of the axis, mm, part frame.
        radius: mm.
    """

    axis_point: tuple[float, float]
    radius: float
    kind = "cylinder"
    slope = 0.0  # growth of the radius with z

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

    def chain(self, sagitta_mm: float) -> ProfileChain:
        """Its profile from the point at z = 0; `sagitta_mm` does not matter: it is exact."""
        return ProfileChain(np.array([self.radius]), np.zeros(1), (0.0, 0.0))

    def may_reach(self, height: Floats, below_mm: float, half_mm: npt.ArrayLike) -> Bools:
        """Which points may be corners of a triangle that reaches into an offset.

        A triangle with all corners outside may dip into it as far as a side can, or hold the whole circle.

        Args:
            height: (n,) of the points over the surface, mm.
            below_mm: of the offset.
            half_mm: half the length of the triangles' sides at most; one number, or (n,).
        """
        half, away, inner = np.asarray(half_mm), height + self.radius, max(self.radius + below_mm, 0.0)
        return np.asarray((away * away <= inner**2 + half * half) | (away <= 2.0 * half))

    def radius_at(self, z: Floats) -> Floats:
        """Radius (n,) at heights (n,), mm."""
        return np.full(len(z), self.radius)

    @property
    def widest(self) -> float:
        """Its radius: it is as wide everywhere."""
        return self.radius

    def least_distance(self, triangles: Floats) -> float:
        """Least distance from triangles (n, 3, 3), their insides too, mm; 0 where they reach inside."""
        xy = triangles[:, :, :2] - self.axis_point
        start, along = xy, np.roll(xy, -1, axis=1) - xy
        length2 = (along**2).sum(axis=2)
        t = np.clip(-(start * along).sum(axis=2) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
        nearest = float(np.sqrt(((start + t[..., None] * along) ** 2).sum(axis=2).min()))
        turn = start[..., 0] * along[..., 1] - start[..., 1] * along[..., 0]
        if ((turn > 0).all(axis=1) | (turn < 0).all(axis=1)).any():
            return 0.0  # the axis passes through a face
        return max(nearest - self.radius, 0.0)

    def away_from(self, axis_point: tuple[float, float], middle: float, half: float) -> tuple[float, float]:
        """Least and greatest distance from an axis that it has within a sector about it, mm.

        It is nearest straight across from its own axis, and ever farther away to either side.

        Args:
            axis_point: of the axis.
            middle: angle of the sector's middle, rad.
            half: half the sector's angle, rad.
        """
        across = (axis_point[0] - self.axis_point[0], axis_point[1] - self.axis_point[1], 0.0)
        turn, apart = farthest_turn(across, middle, half), math.hypot(*across)
        away, far = abs(self.radius - apart), self.radius + apart
        if turn < GRAZING_RAD and apart < self.radius:
            sine = apart * math.sin(turn)
            # |far e - apart| = radius, without the difference of like numbers that a great radius brings
            square = (self.radius - sine) * (self.radius + sine)
            far = (self.radius - apart) * (self.radius + apart) / (math.sqrt(square) + apart * math.cos(turn))
        return away, far

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
        """As schema rbam-slices/1 writes it."""
        return {
            "kind": "cylinder",
            "axis_point": [float(v) for v in self.axis_point],
            "radius": float(self.radius),
        }
