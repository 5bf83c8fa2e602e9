"""Poses of the arm's bodies and geoms in many configurations at once, put into MuJoCo's data in turn.

    poses = ArmPoses(scene)
    for _ in poses.put(data, q): ...          # data is as mj_kinematics would leave it, for the arm alone

MuJoCo's own kinematics computes every geom of the model, although only the arm moves and a part has thousands of
layers. Here poses are products of the joints' rotations about their axes at zero angles. World frame, metres, radians.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints

if TYPE_CHECKING:
    from ..scene.scene import Scene

CHUNK = 256  # configurations whose poses are held at once


class ArmPoses:
    """Kinematics of a scene's arm."""

    def __init__(self, scene: Scene) -> None:
        """Prepare.

        Args:
            scene: the composed cell.
        """
        model = scene.model
        data = mujoco.MjData(model)
        data.qpos[scene.arm_qpos] = 0.0
        mujoco.mj_kinematics(model, data)
        joints = scene.arm_joints
        self._axis = data.xaxis[joints].copy()
        self._anchor = data.xanchor[joints].copy()
        moved = joint_of_bodies(scene)
        bodies = np.flatnonzero(moved >= 0)
        geoms = np.flatnonzero((moved[model.geom_bodyid] >= 0) & scene.contact_bits.any(axis=0))  # what collides
        self._bodies, self._geoms = as_slice(bodies), as_slice(geoms)
        self._joint = np.concatenate([moved[bodies], moved[bodies], moved[model.geom_bodyid[geoms]]])
        place = np.concatenate([data.xpos[bodies], data.xipos[bodies], data.geom_xpos[geoms]])
        turn = np.concatenate([data.xmat[bodies], data.ximat[bodies], data.geom_xmat[geoms]]).reshape(-1, 3, 3)
        self._pose = np.concatenate([turn, place[:, :, None]], axis=2)  # (k, 3, 4)
        self._split = len(bodies)
        self._moved, self._place = moved[model.geom_bodyid], data.geom_xpos.copy()

    def put(self, data: mujoco.MjData, q: Floats) -> Iterator[None]:
        """Put the arm into one configuration after the other.

        Args:
            data: where to; what is not the arm's stays as it is.
            q: configurations, (m, n), rad.

        Yields:
            Once for each, with the arm in it.
        """
        b, g, k = self._bodies, self._geoms, self._split
        xpos, xipos, geom_xpos = data.xpos, data.xipos, data.geom_xpos
        xmat, ximat, geom_xmat = data.xmat, data.ximat, data.geom_xmat
        for first in range(0, len(q), CHUNK):
            for p, R in zip(*self._placed(q[first : first + CHUNK]), strict=True):
                xpos[b], xipos[b], geom_xpos[g] = p[:k], p[k : 2 * k], p[2 * k :]
                xmat[b], ximat[b], geom_xmat[g] = R[:k], R[k : 2 * k], R[2 * k :]
                yield

    def places(self, geoms: Ints, q: Floats) -> Floats:
        """Where geoms of the arm are.

        Args:
            geoms: ids, (g,); one that none of the joints carries stays where it is.
            q: configurations, (m, n), rad.

        Returns:
            (m, g, 3), m.
        """
        R, p = self._motions(q)
        out = np.broadcast_to(self._place[geoms], (len(q), len(geoms), 3)).copy()
        for j in range(q.shape[1]):
            mine = np.flatnonzero(self._moved[geoms] == j)
            turned = (R[:, j].reshape(-1, 3) @ self._place[geoms[mine]].T).reshape(len(q), 3, len(mine))
            out[:, mine] = np.swapaxes(turned, 1, 2) + p[:, j, None]
        return out

    def _placed(self, q: Floats) -> tuple[Floats, Floats]:
        """Positions (m, k, 3) and rotations (m, k, 9)."""
        R, p = self._motions(q)
        place, turn = np.empty((len(q), len(self._joint), 3)), np.empty((len(q), len(self._joint), 3, 3))
        for j in range(q.shape[1]):
            mine = np.flatnonzero(self._joint == j)
            # one product for all that moves with the joint: many small ones cost more than they compute
            out = R[:, j].reshape(-1, 3) @ np.moveaxis(self._pose[mine], 0, 1).reshape(3, -1)
            out = np.moveaxis(out.reshape(len(q), 3, len(mine), 4), 1, 2)
            place[:, mine], turn[:, mine] = out[..., 3] + p[:, j, None], out[..., :3]
        return place, turn.reshape(len(q), -1, 9)

    def _motions(self, q: Floats) -> tuple[Floats, Floats]:
        """Motion x -> R x + p, by each joint and those before it, of what it carries: (m, n, 3, 3), (m, n, 3) m."""
        a = self._axis
        K = np.zeros((len(a), 3, 3))
        K[:, 0, 1], K[:, 0, 2], K[:, 1, 2] = -a[:, 2], a[:, 1], -a[:, 0]
        K -= np.swapaxes(K, 1, 2)
        R = np.eye(3) + np.sin(q)[..., None, None] * K + (1 - np.cos(q))[..., None, None] * (K @ K)
        p = self._anchor - (R @ self._anchor[..., None])[..., 0]
        for j in range(1, q.shape[1]):
            p[:, j] = (R[:, j - 1] @ p[:, j, :, None])[..., 0] + p[:, j - 1]
            R[:, j] = R[:, j - 1] @ R[:, j]
        return R, p


def as_slice(index: NDArray[np.int64]) -> slice | NDArray[np.int64]:
    """Numbers as a slice if they are consecutive: writing to a slice takes a fifth of the time."""
    if len(index) and index[-1] - index[0] + 1 == len(index):
        return slice(int(index[0]), int(index[-1]) + 1)
    return index


def joint_of_bodies(scene: Scene) -> Ints:
    """The arm's joint that carries each body, (nbody,): the last of several in one body; -1 where none does."""
    model = scene.model
    own = {int(body): i for i, body in enumerate(model.jnt_bodyid[scene.arm_joints])}
    joint = np.full(model.nbody, -1, dtype=np.int64)
    for body in range(1, model.nbody):  # parents come first
        joint[body] = own.get(body, joint[model.body_parentid[body]])
    return joint


def joint_of_shapes(scene: Scene, geoms: Ints) -> Ints:
    """The arm's joint that carries each of some shapes of the arm, (k,).

    Raises:
        ValueError: one of them is carried by none.
    """
    joint = joint_of_bodies(scene)[scene.model.geom_bodyid[geoms]]
    if (joint < 0).any():
        raise ValueError("a shape of the arm that none of its joints carries")
    return joint
