"""Places of points about the arm's solid shapes, to hold bounds on how far anything of the arm moves against."""

from __future__ import annotations

import mujoco
import numpy as np


def places(scene, q):
    """Places of points about the arm's solid shapes, (m, k, 3)."""
    model, data, out = scene.model, mujoco.MjData(scene.model), []
    arm = np.flatnonzero(scene.arm_geom & scene.contact_bits.any(axis=0))
    corners = np.concatenate([np.eye(3), -np.eye(3)])
    for row in q:
        data.qpos[scene.arm_qpos] = row
        mujoco.mj_kinematics(model, data)
        turned = data.geom_xmat[arm].reshape(-1, 3, 3) @ corners.T * model.geom_rbound[arm, None, None]
        out.append((data.geom_xpos[arm][:, :, None] + turned).transpose(0, 2, 1).reshape(-1, 3))
    return np.array(out)
