"""How far any point of the arm gets on a step: a bound that knows where the step leads.

    swept = MotionBounds(scene, radius)
    swept.bound(a, b)             # (m,) m: of the arm's points against anything, the arm itself among it

The sum over the joints of what each can move its farthest point by is many times too much where they work against one
another, as along a bead, which the torch goes slowly while the wrist turns. Where both ends of a step are known, a
point x is off the straight line between its places there by t (1 - t) / 2 of the greatest |x''| at most, and that is
less than the sum over all pairs of joints i, k of |dq_i| |dq_k| times the radius about the outer one. Metres, radians.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import mujoco
import numpy as np

from ik.chain import Floats

if TYPE_CHECKING:
    from ..scene.scene import Scene


def joint_travel_bound(radius: Floats, a: Floats, b: Floats) -> Floats:
    """The sum over the joints of the arc that the farthest point can describe about each, (m,), m."""
    way: Floats = (np.abs(b - a) * radius).sum(axis=1)
    return way


class MotionBounds:
    """Bounds for one scene's arm."""

    def __init__(self, scene: Scene, radius: Floats) -> None:
        """Prepare.

        Args:
            scene: the composed cell.
            radius: from ``cell.collision.reach_radii.radii``, (n,), m.
        """
        model, chain = scene.model, scene.chain
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        self.chain, self.radius = chain, radius
        joint = {int(body): i for i, body in enumerate(model.jnt_bodyid[scene.arm_joints])}
        R, p = chain.frames(data.qpos[scene.arm_qpos][None])
        base = scene.T_world_base()
        owner, centre, size = [], [], []
        for g in np.flatnonzero(scene.arm_geom & scene.contact_bits.any(axis=0)):
            body = int(model.geom_bodyid[g])
            while body not in joint:
                body = int(model.body_parentid[body])
            i = joint[body]
            at = base[:3, :3].T @ (data.geom_xpos[g] - base[:3, 3])
            owner.append(i)
            centre.append(R[0, i].T @ (at - p[0, i]))
            size.append(float(model.geom_rbound[g]))
        self._joint = np.array(owner, dtype=np.int64)
        self._centre, self._size = np.array(centre).reshape(-1, 3), np.array(size)

    def bound(self, a: Floats, b: Floats) -> Floats:
        """The most by which two things can get nearer to one another on the way, both ends' shares added up.

        Args:
            a: where each step begins, (m, n), rad.
            b: where it ends, (m, n), rad.

        Returns:
            (m,), m: if the clearances at a step's ends add up to more, nothing touches on it.
        """
        turn = np.abs(b - a)
        joints = joint_travel_bound(self.radius, a, b)
        if not len(a):
            return joints
        (Ra, pa), (Rb, pb) = self.chain.frames(a), self.chain.frames(b)
        dR, dp = Rb - Ra, pb - pa
        # the chord of a turn, of what is 1 from its centre
        chord = np.linalg.norm(dR, axis=(2, 3)) / np.sqrt(2.0)
        straight = np.zeros(len(a))
        for j in range(self.chain.n):
            mine = self._joint == j
            if mine.any():
                away = np.linalg.norm(dp[:, j, :, None] + dR[:, j] @ self._centre[mine].T, axis=1)
                straight = np.maximum(straight, (away + chord[:, j, None] * self._size[mine]).max(axis=1))
        bow = (turn * self.radius * (2 * np.cumsum(turn, axis=1) - turn)).sum(axis=1)
        # two parts of the arm may both move, one towards the other
        return np.minimum(joints, 2 * (straight + bow / 4))
