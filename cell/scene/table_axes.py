"""Which joints of a composed cell are the table's E1 (tilt) and E2 (turn), and which it does not have.

    joints, has_axis = table_axes(model, names, table, case)

A positioner has two axes, one or none. One alone is E1 or E2 by its name, or else by what it does: about the table's
own normal it turns, otherwise it tilts.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from ..case.sections import Case
from ..errors import InputError
from ..mjcf.model_names import require
from .equipment import UNUSED

TURNS = np.cos(np.pi / 4)  # of the angle between an axis and the table's normal: nearer to it, the axis turns


def table_axes(
    model: mujoco.MjModel, names: Sequence[str], table: int, case: Case
) -> tuple[list[int], NDArray[np.bool_]]:
    """The table's joints.

    Args:
        model: the composed cell.
        names: what the case's joints of the positioner are called in it.
        table: id of the table's site.
        case: says what they are called there.

    Returns:
        The joints that are E1 and E2, two numbers; whether the positioner has them, (2,).

    Raises:
        InputError: a joint is no hinge, or does not carry the table, or they are not in order.
    """
    joints = [require(model, "joint", name, "positioner.joints") for name in names]
    _check(model, joints, table, case)
    if len(joints) == 2:
        return joints, np.array([True, True])
    unused = [int(model.joint(name).id) for name in UNUSED]
    if not joints:
        return unused, np.array([False, False])
    at = {"E1": 0, "E2": 1}.get(case.positioner.joints[0], int(_turns(model, joints[0], table)))
    unused[at] = joints[0]
    return unused, np.arange(2) == at


def _turns(model: mujoco.MjModel, joint: int, table: int) -> bool:
    """Whether a joint turns the table about its normal rather than tilting it."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    normal = data.site_xmat[table].reshape(3, 3)[:, 2]
    return bool(abs(data.xaxis[joint] @ normal) > TURNS)


def _check(model: mujoco.MjModel, joints: list[int], table: int, case: Case) -> None:
    body = int(model.site_bodyid[table])
    above: list[int] = []  # joints that carry the table, the outermost first
    while body:
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        above += range(first + count - 1, first - 1, -1)
        body = int(model.body_parentid[body])
    for name, joint in zip(case.positioner.joints, joints, strict=True):
        where = f"{case.path}: positioner.joints: {name}"
        if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_HINGE:
            raise InputError(f"{where} is not a hinge; only hinges are supported")
        if joint not in above:
            raise InputError(f"{where} does not turn the table (site {case.positioner.table})")
    if len(joints) == 2 and above.index(joints[0]) < above.index(joints[1]):
        raise InputError(
            f"{case.path}: positioner.joints: {case.positioner.joints[1]} carries {case.positioner.joints[0]}; "
            "list the joint that carries the other first (tilt, then turn)"
        )
    outer, inner = (*case.positioner.joints, "", "")[:2]
    if len(joints) == 2 and (outer == "E2" or inner == "E1"):
        raise InputError(
            f"{case.path}: positioner.joints: {outer} carries {inner}, so it is E1 in a case, in reports and in "
            "programs; rename the joints in the model"
        )
