"""Where a cell has the positioner that a program names, seen from the arm's base.

Use:

    T_base_root(job)                          # where the positioner stands
    tables_seen_from_base(scene, tables)      # (m, 2) rad -> (m, 4, 4): the table's flange in $ROBROOT

Metres and radians.
"""

from __future__ import annotations

import mujoco

from ik.chain import Floats

from ..job.job import Job
from ..rigid import inverse, pose
from ..scene.calibration import frame_from_mm_deg
from ..scene.scene import Scene


def T_base_root(job: Job) -> Floats:
    """Where the positioner stands in the arm's base, (4, 4), m: its measured root, or its model's outermost body."""
    scene, calibration = job.scene, job.case.positioner.calibration
    if calibration is not None:
        return inverse(scene.T_world_base()) @ frame_from_mm_deg(calibration.root_mm_deg)
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    body = int(scene.model.site_bodyid[scene.sites["table"]])
    while scene.model.body_parentid[body] > 0:
        body = int(scene.model.body_parentid[body])
    return inverse(scene.T_world_base()) @ pose(data.xpos[body], data.xmat[body])


def tables_seen_from_base(scene: Scene, tables: Floats) -> Floats:
    """The table's flange in the arm's base frame.

    Args:
        scene: the cell.
        tables: E1, E2, (m, 2), rad.

    Returns:
        (m, 4, 4), m.
    """
    return scene.Ts_base_site("table", tables)
