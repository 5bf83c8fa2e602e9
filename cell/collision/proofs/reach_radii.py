"""The farthest that any point carried by an axis can be from that axis: radii for bounds on the travel.

Use:

    radius = radii(scene)                     # of the arm's joints, (n,) m
    table_radii(scene)                        # of the table's axes, (2,) m
    all_radii(scene)                          # of the arm's joints, then of the table's axes, (n + 2,) m
    tool_radii(scene)                         # of what moves with the TCP, about the wire, (ngeom,) m
"""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from ik.chain import Floats

from ..arm_poses import joint_of_shapes
from .convex_shapes import convex_shape

if TYPE_CHECKING:
    from ...scene.scene import Scene


def radii(scene: Scene) -> Floats:
    """How far any point of the arm and its tool can be from each joint, whatever the joints after it do.

    Args:
        scene: the cell.

    Returns:
        (n,) m: of joint i the greater of what its own link holds and the way to the next joint plus that joint's.
    """
    model, chain = scene.model, scene.chain
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    anchors = data.xanchor[scene.arm_joints].copy()
    out, geoms = np.zeros(chain.n), np.flatnonzero(scene.arm_geom & scene.contact_bits.any(axis=0))
    for g, i in zip(geoms.tolist(), joint_of_shapes(scene, geoms).tolist(), strict=True):
        out[i] = max(out[i], float(np.linalg.norm(data.geom_xpos[g] - anchors[i]) + model.geom_rbound[g]))
    for i in range(chain.n - 2, -1, -1):
        out[i] = max(out[i], float(np.linalg.norm(chain.origins[i + 1, :3, 3])) + out[i + 1])
    return out


def table_radii(scene: Scene) -> Floats:
    """How far anything on the table can be from E1 and from E2, (2,), m; see ``radii``."""
    model = scene.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    joint = scene.table_joints.tolist()
    body = [int(model.jnt_bodyid[j]) for j in joint]
    out = np.zeros(2)
    for g in np.flatnonzero(scene.contact_bits.any(axis=0)):
        b = int(model.geom_bodyid[g])
        while b not in (0, *body):
            b = int(model.body_parentid[b])
        if b in body:
            axis = 1 if b == body[1] else 0  # of two in one body the second, which the first carries
            reach = float(np.linalg.norm(data.geom_xpos[g] - data.xanchor[joint[axis]]) + model.geom_rbound[g])
            out[axis] = max(out[axis], reach)
    apart = float(np.linalg.norm(data.xanchor[joint[1]] - data.xanchor[joint[0]]))
    out[0] = max(out[0], apart + out[1])
    return out


def all_radii(scene: Scene) -> Floats:
    """How far anything can be from each axis, the arm's and then the table's, (n + 2,), m."""
    return np.concatenate([radii(scene), table_radii(scene)])


_known: weakref.WeakKeyDictionary[Scene, Floats] = weakref.WeakKeyDictionary()


def tool_radii(scene: Scene) -> Floats:
    """How far from the wire's line each geom that moves with the TCP reaches; worked out once.

    Args:
        scene: the cell.

    Returns:
        (ngeom,) m: what a turn of the roll moves it by, a radian; infinite for all that does not move with the TCP.
    """
    if scene not in _known:
        _known[scene] = _tool_radii(scene)
    return _known[scene]


def _tool_radii(scene: Scene) -> Floats:
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_kinematics(model, data)
    tcp = scene.sites["tcp"]
    axis = data.site_xmat[tcp].reshape(3, 3)[:, 2]
    out = np.full(model.ngeom, np.inf)
    for g in np.flatnonzero(scene.tool_geom & scene.contact_bits.any(axis=0)).tolist():
        shape = convex_shape(model, g, data.geom_xmat[g].reshape(3, 3), data.geom_xpos[g])
        away = shape.points - data.site_xpos[tcp]
        off = np.linalg.norm(away - np.outer(away @ axis, axis), axis=1)
        out[g] = float(off.max()) + shape.ball + shape.disc
    return out
