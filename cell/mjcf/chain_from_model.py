"""From a compiled model to arrays: which joints are the arm's, and its chain for the solvers.

    cell = Scene(...)                       # cell.scene.compose
    chain = chain_of(cell.model, ["A1", ..., "A6"], tcp="tcp", base="base_link")

The chain's base frame is the named base body's ($ROBROOT of a KUKA arm). Metres, radians.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from ik.chain import Chain, Floats

from ..errors import InputError
from ..rigid import inverse, pose
from .model_names import require

TABLE_AXES = ("E1", "E2")
AXES = (6, 7)  # joints of an arm: a search that samples the roll needs six at least


def chain_of(
    model: mujoco.MjModel,
    joints: Sequence[str],
    tcp: str,
    base: str,
    max_speed: Floats | None = None,
) -> Chain:
    """The serial chain from a base body to the TCP.

    Args:
        model: the compiled scene.
        joints: names of the arm's hinge joints, from the base on.
        tcp: site at the wire's end.
        base: body whose frame is the chain's base.
        max_speed: joint speed limits, rad/s; unknown where left out.

    Returns:
        The chain; its forward kinematics is that of the model.

    Raises:
        InputError: a name is missing, a joint is no hinge or has no limits, or the joints are not in series.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = 0.0
    mujoco.mj_kinematics(model, data)
    check_names(joints)
    ids = [require(model, "joint", name, "robot.joints") for name in joints]
    _check_series(model, ids, require(model, "site", tcp, "tool.tcp"))
    world_base = require(model, "body", base, "robot.base")
    parent = pose(data.xpos[world_base], data.xmat[world_base])
    origins, axes = [], []
    for j in ids:
        body = model.jnt_bodyid[j]
        # a joint's frame: its anchor, with the orientation of its body
        here = pose(data.xanchor[j], data.xmat[body])
        origins.append(inverse(parent) @ here)
        # of two joints in one body the second's own zero may turn the body against the first
        axis = here[:3, :3].T @ data.xaxis[j]
        axes.append(axis / np.linalg.norm(axis))
        parent = here
    site = require(model, "site", tcp, "tool.tcp")
    return Chain(
        origins=np.array(origins),
        axes=np.array(axes),
        T_last_tcp=inverse(parent) @ pose(data.site_xpos[site], data.site_xmat[site]),
        lower=model.jnt_range[ids, 0].copy(),
        upper=model.jnt_range[ids, 1].copy(),
        max_speed=np.full(len(ids), np.inf) if max_speed is None else np.asarray(max_speed, dtype=float),
        names=tuple(joints),
    )


def check_base(model: mujoco.MjModel, base: str, joints: Sequence[int]) -> None:
    """Refuse a base that one of the planned joints moves.

    Raises:
        InputError: which joint it is.
    """
    body = require(model, "body", base, "robot.base")
    while body:
        moved = [j for j in joints if int(model.jnt_bodyid[j]) == body]
        if moved:
            raise InputError(
                f"robot.base: body {base} is moved by joint {model.joint(moved[0]).name}; "
                "it must be a body that stands still"
            )
        body = int(model.body_parentid[body])


def check_names(joints: Sequence[str]) -> None:
    """Refuse lists in which a joint is named twice, or as the table's axes are.

    Raises:
        InputError: which.
    """
    table = next((name for name in joints if name in TABLE_AXES), None)
    if table is not None:
        raise InputError(
            f"robot.joints: {table} is what an axis of the table is called in cases, motions and programs; rename the "
            "arm's joint in its model"
        )
    twice = next((name for name in joints if list(joints).count(name) > 1), None)
    if twice is not None:
        raise InputError(f"robot.joints: {twice} is listed twice")


def check_count(joints: Sequence[str]) -> None:
    """Refuse arms with too few joints or too many.

    Raises:
        InputError: how many there are, and how many are allowed.
    """
    if len(joints) not in AXES:
        raise InputError(
            f"robot.joints: has {len(joints)} joints; six or seven are needed: fewer cannot reach a point with a "
            "given wire direction and roll"
        )


def _check_series(model: mujoco.MjModel, ids: Sequence[int], site: int) -> None:
    for j in ids:
        name = model.joint(j).name
        slide = model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE
        if model.jnt_type[j] != mujoco.mjtJoint.mjJNT_HINGE:
            raise InputError(
                f"robot.joints: {name} is not a hinge; only revolute joints are planned"
                + (" (leave a track out of the list: robot.held_mm sets where it stands)" if slide else "")
            )
        low, high = np.rad2deg(model.jnt_range[j])
        if low > high or (low == high and low != 0.0):
            raise InputError(f"robot.joints: {name}'s range {low:g} .. {high:g} deg is empty; low < high is needed")
        if not model.jnt_limited[j] or low == high:
            raise InputError(f"robot.joints: {name} has no joint limits in its MJCF; a range is needed")
    bodies = [int(model.jnt_bodyid[j]) for j in ids]
    for before, after, body, next_body in zip(ids, ids[1:], bodies, bodies[1:], strict=False):
        if body == next_body and after < before:
            first, second = model.joint(after).name, model.joint(before).name
            raise InputError(f"robot.joints: {first} comes before {second} in their body; list it first")
    for child, ancestor in zip([*bodies[1:], int(model.site_bodyid[site])], bodies, strict=True):
        body = child
        while body not in (ancestor, 0):
            body = int(model.body_parentid[body])
        if body == 0:
            raise InputError(
                "robot.joints: must be listed from the base to the flange: each moves the next, the last "
                "one moves the TCP"
            )
