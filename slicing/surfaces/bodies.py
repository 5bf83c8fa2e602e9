"""The central body that sub-volumes stand on: a cylinder, a cone or another body of revolution, axis along z.

    body = CylindricalBody(20.0)                                              # a cylinder of radius 20 mm
    body = ConicalBody(20.0, half_angle_deg=15.0)                  # 20 mm at z = 0, growing upwards
    body = RevolvedBody(((20.0, 0.0), (20.0, 30.0), (28.0, 50.0)))   # (r, z) points of its profile
    body.surface                                                   # what layer 0 lies on
    require_fit("conical", body)                                   # PartError if strategy and body do not fit

What a profile may be, and how it goes on beyond its ends: `slicing.surfaces.profile`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Self, get_args

from ..mesh.solid import FARTHEST_MM, PartError
from ..parameters import Strategy
from .profile import Profile
from .surfaces import Cone, Cylinder, Revolved

STRATEGIES = get_args(Strategy)
ON_AXIS_MM = 1e-6
STRAIGHT = 1e-4  # rad between two pieces of a profile: none
ROUNDED = 5e-6  # of a profile's greatest radius: its points are rounded


def _require_near(key: str, *values_mm: float) -> None:
    """Refuse numbers beyond any part's coordinates: their squares leave no digits, or overflow."""
    farthest = max(values_mm, key=abs, default=0.0)
    if abs(farthest) > FARTHEST_MM:
        raise PartError(f"{key}: {farthest:g} mm is too far; at most {FARTHEST_MM:g} mm are taken")


def _require_axis(axis_xy_mm: tuple[float, float]) -> None:
    if len(axis_xy_mm) != 2 or not all(math.isfinite(v) for v in axis_xy_mm):
        raise PartError(f"axis_xy_mm: {axis_xy_mm} is not a point; two finite numbers are needed")
    _require_near("axis_xy_mm", *axis_xy_mm)


class BodyOfRevolution:
    """What most bodies answer; those that answer otherwise say so.

    Attributes:
        off_mm: largest distance of the real surface from the body's where a sub-volume stands.
        takes_end_faces: whether its surface can be carried on over its end faces.
    """

    off_mm = 0.0
    takes_end_faces = False

    @property
    def rounding_mm(self) -> float:
        """How far its surface may lie beside the real one because its points are rounded."""
        return 0.0

    @property
    def has_grooves(self) -> bool:
        """Whether places of its surface face one another, as in a groove or beside a step."""
        return False

    @property
    def closes_ends(self) -> tuple[bool, bool]:
        """Whether its surface goes round its lower end to the axis, and round its upper one."""
        return False, False

    def with_end_faces(self, low: bool, high: bool) -> Self:
        """The body whose surface goes round its ends as well, where it can be carried on.

        Args:
            low: whether round the lower end.
            high: whether round the upper one.
        """
        return self

    def as_cylinder(self) -> CylindricalBody:
        """Itself, if it is a cylinder.

        Raises:
            PartError: it is not.
        """
        raise PartError(f"{self}: a cylinder is needed as the body")


@dataclass(frozen=True)
class CylindricalBody(BodyOfRevolution):
    """A cylinder about an axis parallel to z.

    Attributes:
        radius_mm: its radius.
        axis_xy_mm: where the axis is.
        off_mm: largest distance of the real surface from it where a sub-volume stands (on a drafted hub).
    """

    radius_mm: float
    axis_xy_mm: tuple[float, float] = (0.0, 0.0)
    off_mm: float = 0.0
    kind = "cylinder"

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius_mm) and self.radius_mm > 0):
            raise PartError(f"radius_mm: {self.radius_mm} is not a body's radius; a number above 0 is needed")
        _require_near("radius_mm", self.radius_mm)
        _require_axis(self.axis_xy_mm)

    @property
    def surface(self) -> Cylinder:
        """Its surface."""
        return Cylinder((float(self.axis_xy_mm[0]), float(self.axis_xy_mm[1])), float(self.radius_mm))

    def as_cylinder(self) -> CylindricalBody:
        """Itself."""
        return self

    def __str__(self) -> str:
        return f"radius {self.radius_mm:g} mm"


@dataclass(frozen=True)
class ConicalBody(BodyOfRevolution):
    """A cone about an axis parallel to z, endless on the side on which it widens.

    Attributes:
        radius_mm: at z = 0; may be 0 or less where the apex lies at or above z = 0 of a cone that widens
            upwards (or at or below, of one that narrows).
        half_angle_deg: between the axis and the rulings, -90 .. 90 (exclusive); above 0 it widens upwards.
        axis_xy_mm: where the axis is.
    """

    radius_mm: float
    half_angle_deg: float
    axis_xy_mm: tuple[float, float] = (0.0, 0.0)
    kind = "cone"

    def __post_init__(self) -> None:
        if not (math.isfinite(self.half_angle_deg) and abs(self.half_angle_deg) < 90.0):
            raise PartError(f"half_angle_deg: {self.half_angle_deg} is not allowed; above -90 and below 90 is needed")
        if not math.isfinite(self.radius_mm) or (self.half_angle_deg == 0.0 and self.radius_mm <= 0):
            raise PartError(f"radius_mm: {self.radius_mm} is not a body's radius; a number above 0 is needed")
        _require_near("radius_mm", self.radius_mm)
        _require_axis(self.axis_xy_mm)

    @property
    def surface(self) -> Cone:
        """Its surface."""
        axis = (float(self.axis_xy_mm[0]), float(self.axis_xy_mm[1]))
        return Cone(axis, float(self.radius_mm), float(self.half_angle_deg))

    def __str__(self) -> str:
        return f"cone, radius {self.radius_mm:g} mm at z = 0, half angle {self.half_angle_deg:g}°"


@dataclass(frozen=True)
class RevolvedBody(BodyOfRevolution):
    """A profile turned about an axis parallel to z.

    Attributes:
        profile_mm: (r, z) points, upwards or downwards; z must not turn back (no undercuts).
        axis_xy_mm: where the axis is.
    """

    profile_mm: tuple[tuple[float, float], ...]
    axis_xy_mm: tuple[float, float] = (0.0, 0.0)
    kind = "revolved"
    takes_end_faces = True

    def __post_init__(self) -> None:
        if any(len(point) != 2 for point in self.profile_mm):
            raise PartError("profile_mm: every point is two numbers, (r, z) in mm")
        object.__setattr__(self, "profile_mm", tuple((float(r), float(z)) for r, z in self.profile_mm))
        _require_near("profile_mm", *(v for point in self.profile_mm for v in point))
        Profile.of(self.profile_mm)
        _require_axis(self.axis_xy_mm)

    @property
    def surface(self) -> Revolved:
        """Its surface."""
        return Revolved((float(self.axis_xy_mm[0]), float(self.axis_xy_mm[1])), self.profile_mm)

    @property
    def rounding_mm(self) -> float:
        """How far its surface may lie beside the real one because its points are rounded."""
        return ROUNDED * max(r for r, _ in self.profile_mm)

    @property
    def has_grooves(self) -> bool:
        """Whether its profile turns outwards anywhere."""
        low_first = self.profile_mm if self.profile_mm[0][1] <= self.profile_mm[-1][1] else self.profile_mm[::-1]
        ways = [(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(low_first)]
        return any(a[1] * b[0] - a[0] * b[1] > STRAIGHT * math.hypot(*a) * math.hypot(*b) for a, b in pairwise(ways))

    @property
    def closes_ends(self) -> tuple[bool, bool]:
        """Whether the profile is closed on the axis at its lower end, and at its upper one."""
        low, high = sorted((self.profile_mm[0], self.profile_mm[-1]), key=lambda point: point[1])
        return low[0] <= ON_AXIS_MM, high[0] <= ON_AXIS_MM

    def with_end_faces(self, low: bool, high: bool) -> RevolvedBody:
        """The profile, lowest point first, with its end faces.

        Args:
            low: whether with the lower one.
            high: whether with the upper one.
        """
        points = self.profile_mm if self.profile_mm[0][1] <= self.profile_mm[-1][1] else self.profile_mm[::-1]
        if low and points[0][0] > ON_AXIS_MM:
            points = ((0.0, points[0][1]), *points)
        if high and points[-1][0] > ON_AXIS_MM:
            points = (*points, (0.0, points[-1][1]))
        return RevolvedBody(points, self.axis_xy_mm)

    def __str__(self) -> str:
        return f"revolved profile of {len(self.profile_mm)} points"


Body = CylindricalBody | ConicalBody | RevolvedBody
BODY_NEEDED = {"cylindrical": "cylinder", "nonuniform": "cylinder", "conical": "cone", "revolved": "revolved"}
BODY_NAMES = {"cylinder": "a cylinder", "cone": "a cone", "revolved": "a revolved profile"}


def fits(strategy: str, body: Body) -> bool:
    """Whether a strategy is made for a kind of body; planar is for all.

    Args:
        strategy: its name, such as "nonuniform".
        body: the body.
    """
    return BODY_NEEDED.get(strategy, body.kind) == body.kind


def require_fit(strategy: str, body: Body) -> None:
    """Refuse a strategy that is not made for the body.

    Args:
        strategy: one of STRATEGIES.
        body: the body.

    Raises:
        PartError: the body is of another kind than the strategy needs.
    """
    if not fits(strategy, body):
        allowed = [s for s in STRATEGIES if fits(s, body)]
        raise PartError(
            f"strategy: {strategy} needs {BODY_NAMES[BODY_NEEDED[strategy]]} as its body, not {BODY_NAMES[body.kind]};"
            f" allowed on it: {', '.join(allowed)}"
        )
