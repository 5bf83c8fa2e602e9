"""What is known about a part's body beforehand, and the axis it is taken to have.

axis = hinted_axis(mesh, BodyHint(radius_mm=20.0), skin, middle)
T_part_input, axis_xy_mm = decomposition_frame(axis, vertices)
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..mesh.solid import Floats, Mesh, PartError
from ..warning import Code, Warning
from .axis import Axis, find_axis
from .bands import LEAST_TURN
from .turned_faces import FEW_SIDES_RAD, HINTED_TURN, PartFaces

AXIS_SHARE = 1e-5  # of the extent: an axis this close to z, to the origin or to a hint is there
HINT_SHARE = 1e-2  # of the extent: how far a hint's axis may be off the one found
LEAST_SIDES = math.ceil(math.pi / FEW_SIDES_RAD)


@dataclass(frozen=True)
class BodyHint:
    """What is known about the body, in the input's frame; None for values that are to be found.

    An axis chooses among several: the fitted axis of the part is used where the two differ by rounding. A radius is
    used as given.

    Attributes:
        axis_point_mm: (x, y, z) of a point of its axis.
        axis_direction: of its axis, any length above 0.
        radius_mm: of the cylinder that the sub-volumes stand on.
    """

    axis_point_mm: tuple[float, float, float] | None = None
    axis_direction: tuple[float, float, float] | None = None
    radius_mm: float | None = None

    def __post_init__(self) -> None:
        for key in ("axis_point_mm", "axis_direction"):
            value = getattr(self, key)
            if value is not None and (len(value) != 3 or not all(math.isfinite(v) for v in value)):
                raise PartError(f"{key}: {value} is not allowed; three finite numbers are needed")
        if self.axis_direction is not None and math.hypot(*self.axis_direction) == 0:
            raise PartError("axis_direction: (0, 0, 0) is not a direction; a vector of length above 0 is needed")
        if self.radius_mm is not None and not (math.isfinite(self.radius_mm) and self.radius_mm > 0):
            raise PartError(f"radius_mm: {self.radius_mm} is not a body's radius; a number above 0 is needed")

    @property
    def point(self) -> Floats | None:
        """The point (3,), mm."""
        return None if self.axis_point_mm is None else np.array(self.axis_point_mm, dtype=np.float64)

    @property
    def direction(self) -> Floats | None:
        """The direction (3,), unit."""
        if self.axis_direction is None:
            return None
        return np.array(self.axis_direction, dtype=np.float64) / math.hypot(*self.axis_direction)


def hinted_axis(mesh: Mesh, hint: BodyHint, skin: PartFaces, middle: Floats) -> Axis:
    """The axis of a part, the hint's where it gives one.

    Args:
        mesh: the part; its name is for messages.
        hint: what is known.
        skin: its faces about middle.
        middle: (3,) mm.

    Returns:
        The axis, input frame.

    Raises:
        PartError: nothing is turned about an axis there, or the hint does not fit.
    """
    least_turn = LEAST_TURN if hint.radius_mm is None else HINTED_TURN
    point = None if hint.point is None else hint.point - middle
    axis = find_axis(skin, point, hint.direction, least_turn)
    if axis is None:
        given = " about the axis that the hint gives" if hint.axis_point_mm or hint.axis_direction else ""
        raise PartError(
            f"{mesh.name}: no round body found{given}; an outer cylinder or cone of at least {LEAST_SIDES} sides is"
            " needed; or give the sub-volumes as meshes of their own (part.sub_volumes) and part.body.radius_mm"
        )
    return _as_hinted(mesh, replace(axis, point=axis.point + middle), hint, (middle, skin.extent))


def _as_hinted(mesh: Mesh, axis: Axis, hint: BodyHint, size: tuple[Floats, float]) -> Axis:
    """The axis with the hint's own numbers: both given, they count as they stand; an error where they do not fit."""
    middle, extent = size
    slack, direction, point = max(AXIS_SHARE * extent, 2 * axis.spread_mm), axis.direction, axis.point
    point = point + ((middle - point) @ direction) * direction  # turn about the middle, not far away
    exact = hint.direction is not None and hint.point is not None
    off = 0.0
    if hint.direction is not None:
        towards = hint.direction if hint.direction @ direction > 0 else -hint.direction
        tilt = float(np.linalg.norm(np.cross(direction, towards)))
        if tilt > HINT_SHARE:
            raise PartError(
                f"{mesh.name}: axis_direction is {math.degrees(math.asin(min(tilt, 1.0))):.2f}° off the axis of the"
                f" round body found there, {tuple(round(float(v), 4) for v in direction)}"
            )
        if exact or tilt * extent <= slack:
            direction, off = towards, tilt * extent
    if hint.point is not None:
        away = hint.point - point
        shift = float(np.linalg.norm(away - (away @ direction) * direction))
        if shift > HINT_SHARE * extent:
            raise PartError(
                f"{mesh.name}: axis_point_mm {hint.axis_point_mm} is {shift:.3g} mm off the axis of the round body"
                f" found there, which passes through {tuple(round(float(v), 3) for v in point)}"
            )
        if exact or shift <= slack:
            point, off = hint.point, max(off, shift)
    if off <= 2 * slack:
        return replace(axis, point=point, direction=direction)
    line = (
        f"{mesh.name}: the given axis is {off:.3g} mm off the axis of the mesh, which passes through"
        f" {tuple(round(float(v), 4) for v in axis.point)} along {tuple(round(float(v), 6) for v in axis.direction)};"
        " the given axis is used"
    )
    return replace(axis, point=point, direction=direction, lines=(Warning(Code.BODY_AXIS, line),))


def decomposition_frame(axis: Axis, vertices: Floats) -> tuple[Floats, tuple[float, float]]:
    """The frame in which a part is taken apart: the input's, if the axis is parallel to z there.

    Args:
        axis: of the part, input frame.
        vertices: (n, 3) of the part, mm.

    Returns:
        T_part_input (4, 4), and where the axis is in the part frame (x, y), mm.
    """
    extent = float(np.ptp(vertices, axis=0).max())
    slack = max(AXIS_SHARE * extent, 2 * axis.spread_mm)
    if float(np.hypot(*axis.direction[:2])) * extent > slack:
        return axis.to_z, (0.0, 0.0)
    middle = 0.5 * (vertices[:, 2].min() + vertices[:, 2].max())
    x, y, _ = axis.point + axis.direction * (middle - axis.point[2]) / axis.direction[2]
    if math.hypot(x, y) <= slack:
        return np.eye(4), (0.0, 0.0)
    return np.eye(4), (round(float(x), 6), round(float(y), 6))
