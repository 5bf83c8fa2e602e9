"""What the axes' drives can do: speeds and accelerations of the arm and of the table.

    d = drives(scene)
    d.speed, d.acceleration                   # (j + 2,) rad/s and rad/s^2: the arm's joints, then E1, E2

A case's own figures win over those in the models' MJCF (numeric ``max_speed_deg_s`` and ``max_accel_deg_s2``). Where no
acceleration is given, an axis is assumed to reach full speed in half a second, which is slow for an industrial arm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ik.chain import Floats

from ..errors import InputError

if TYPE_CHECKING:
    from .scene import Scene

RAMP_S = 0.5  # to full speed, where nothing is known
TABLE = "positioner_"  # before the names of the positioner's numerics in a composed cell


@dataclass(frozen=True, eq=False)
class Drives:
    """Limits of all axes.

    Attributes:
        names: of the axes: the arm's joints, E1, E2.
        speed: (j + 2,), rad/s; infinite where unknown, which the arm's are not.
        acceleration: (j + 2,), rad/s^2.
        assumed: names of axes whose acceleration is assumed.
    """

    names: tuple[str, ...]
    speed: Floats
    acceleration: Floats
    assumed: tuple[str, ...]

    @property
    def arm_speed(self) -> Floats:
        """Of the arm's joints, (j,), rad/s."""
        return self.speed[:-2]

    @property
    def arm_acceleration(self) -> Floats:
        """Of the arm's joints, (j,), rad/s^2."""
        return self.acceleration[:-2]


def drives(scene: Scene) -> Drives:
    """The drives of a composed cell.

    Args:
        scene: the cell.

    Returns:
        Their limits.

    Raises:
        InputError: a list has the wrong length, or a figure that is not above 0.
    """
    robot, positioner = scene.case.robot, scene.case.positioner
    n = scene.chain.n
    has = scene.has_axis
    table_speed = _of_table(scene, "max_speed_deg_s", positioner.max_speed_deg_s, "max_speed_deg_s")
    speed = np.concatenate([scene.chain.max_speed, np.full(2, np.inf)])
    if table_speed is not None:
        speed[n:][has] = table_speed
    arm = _found(scene, "robot.max_acceleration_deg_s2", robot.max_acceleration_deg_s2, "max_accel_deg_s2", n)
    given = positioner.max_acceleration_deg_s2
    table = _of_table(scene, "max_acceleration_deg_s2", given, "max_accel_deg_s2")
    names = (*scene.chain.names, "E1", "E2")
    acceleration = speed / RAMP_S
    assumed = np.ones(n + 2, dtype=bool)
    for part, values in ((np.arange(n), arm), (n + np.flatnonzero(has), table)):
        if values is not None:
            acceleration[part], assumed[part] = values, False
    assumed[n:] &= has
    return Drives(names, speed, acceleration, tuple(np.array(names)[assumed].tolist()))


def _of_table(scene: Scene, key: str, given: Sequence[float] | None, numeric: str) -> Floats | None:
    """A limit of the axes that the positioner has."""
    return _found(scene, f"positioner.{key}", given, TABLE + numeric, int(scene.has_axis.sum()))


def _found(scene: Scene, key: str, given: Sequence[float] | None, numeric: str, n: int) -> Floats | None:
    """A limit in rad from the case, or else from the model."""
    path = scene.case.path
    if given is not None:
        if len(given) != n:
            raise InputError(f"{path}: {key}: has {len(given)} values for {n} joints")
        return np.deg2rad(np.asarray(given, dtype=float))
    try:
        values = np.asarray(scene.model.numeric(numeric).data, dtype=float)
    except KeyError:
        return None
    if len(values) > n > 0:
        own = f"the model's own (numeric {numeric.removeprefix(TABLE)}) has {len(values)} values for {n} joint(s)"
        raise InputError(f"{path}: {key}: {own}: give {n} here")
    if len(values) != n or not np.all((values > 0) & np.isfinite(values)):
        raise InputError(f"{path}: {key}: the model's own (numeric {numeric.removeprefix(TABLE)}) needs {n} above 0")
    return np.deg2rad(values)
