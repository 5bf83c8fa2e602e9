"""Frames of a cell that do not move against one another: the tool on the arm's flange, the part on the table.

Use:

    T_flange_tcp(scene)                       # the torch, as $TOOL
    T_table_part(scene)                       # the part on the table's faceplate, as a coupled $BASE

Metres.
"""

from __future__ import annotations

import mujoco

from ik.chain import Floats

from ..rigid import inverse, pose
from .scene import Scene


def T_flange_tcp(scene: Scene) -> Floats:
    """The TCP in the arm's flange, (4, 4), m."""
    return _between(scene, "flange", "tcp")


def T_table_part(scene: Scene) -> Floats:
    """The part's frame in the table's faceplate, (4, 4), m."""
    return _between(scene, "table", "part")


def _between(scene: Scene, one: str, other: str) -> Floats:
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    a, b = (pose(data.site_xpos[scene.sites[name]], data.site_xmat[scene.sites[name]]) for name in (one, other))
    return inverse(a) @ b
