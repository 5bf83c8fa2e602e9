"""What all surfaces that layers lie on answer, and what those that go round an axis answer besides.

Layers are often offsets of one surface: those have a `family` in common and differ by their `level`.

    Cylinder((0.0, 0.0), 20.0).is_offset_of(Cylinder((0.0, 0.0), 21.73))      # True
    Cylinder((0.0, 0.0), 20.0).axis_points, Plane(point, normal).axis_points     # ((0.0, 0.0),), ()
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Self, TypeGuard

from ..mesh.closest_point import least_over_triangles
from ..mesh.solid import Floats

GRAZING_RAD = 0.5 * (math.pi - 1e-3)  # a plane seen from an axis at more than this is taken to be endless


def farthest_turn(direction: Sequence[float], middle: float, half: float) -> float:
    """Greatest angle between a direction (x, y, ..) and those of a sector, rad, not less than half the sector's.

    Args:
        direction: of any length.
        middle: angle of the sector's middle, rad.
        half: half the sector's angle, rad.
    """
    return abs((middle - math.atan2(direction[1], direction[0]) + math.pi) % (2 * math.pi) - math.pi) + half


class Offsets(ABC):
    """What planes, cylinders, cones and profiles answer alike: which surfaces are offsets of one another.

    Attributes:
        is_flat: whether it is a plane.
        is_straight: whether it is the same at every height of its axis, as planes and cylinders are.
        bends: whether it may have corners, as profiles have.
    """

    is_flat = False
    is_straight = True
    bends = False

    @property
    def ends(self) -> tuple[bool, bool]:
        """Whether it meets its axis at its lower end, and at its upper one."""
        return False, False

    @property
    def axis_points(self) -> tuple[tuple[float, float], ...]:
        """Where the axis is that it goes round, (x, y), mm: one point; none for planes."""
        return ()

    @property
    @abstractmethod
    def family(self) -> object:
        """What the surface and its offsets have in common."""

    @property
    @abstractmethod
    def level(self) -> float:
        """How far out it lies among its offsets, mm."""

    @abstractmethod
    def distance(self, points: Floats) -> Floats:
        """Signed distance (n,) from points (n, 3), mm, positive outside."""

    def is_offset_of(self, other: Offsets) -> TypeGuard[Self]:
        """Whether the other surface is this one, so far inward or outward."""
        return self.family == other.family

    def facing(self, axis_point: tuple[float, float]) -> tuple[Floats, Floats] | None:
        """The straight line of the surface that faces an axis: a point (2,) of the plane through both, and its normal.

        None where thickness over an axis is the same along the whole surface.
        """
        return None


class AboutAxis(Offsets):
    """What goes round an axis parallel to z.

    Attributes:
        axis_point: (x, y) of the axis, mm, part frame.
    """

    axis_point: tuple[float, float]

    @property
    def axis_points(self) -> tuple[tuple[float, float], ...]:
        """Where its axis is, (x, y), mm."""
        return (self.axis_point,)

    @property
    def widest(self) -> float:
        """A radius that it does not exceed anywhere, mm; inf where none is known."""
        return math.inf

    @property
    def apex_z(self) -> float | None:
        """Height of the point in which all its rulings meet, mm; None where there is none."""
        return None

    def ruling_from_apex(self, radius: float) -> tuple[Floats, Floats] | None:
        """Radii and heights (2,) of the straight line from its apex out to a radius, mm; None where it has no apex."""
        return None

    def least_distance(self, triangles: Floats) -> float:
        """Least distance from triangles (n, 3, 3), their insides too, mm; 0 where they reach inside."""
        return least_over_triangles(triangles, self.distance)
