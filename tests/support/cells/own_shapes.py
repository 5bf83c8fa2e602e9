"""Every shape of a composed cell, held against the model's own file: as large, and where that has it.

off = shapes_off(scene, case, q, table)      # m, {"robot": .., "tool": .., "positioner": ..}

Each model is compiled by itself and put where the case says; a shape is known by the box about it in the world.
"""

from __future__ import annotations

from itertools import product

import mujoco
import numpy as np

from cell.case.sections import Case
from cell.scene.composition import BodyOwner
from cell.scene.scene import Scene

from ..oracles.witness import Model, frame, held

GEOM = mujoco.mjtGeom
CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))


def boxes(model, data, geoms, T: np.ndarray) -> np.ndarray:
    """The box about each shape, its lowest and its highest corner, (k, 6), m; planes are left out."""
    out = []
    for g in geoms:
        R, p = T[:3, :3] @ data.geom_xmat[g].reshape(3, 3), T[:3, :3] @ data.geom_xpos[g] + T[:3, 3]
        kind, size = int(model.geom_type[g]), model.geom_size[g]
        if kind == int(GEOM.mjGEOM_PLANE):
            continue
        if kind in (int(GEOM.mjGEOM_MESH), int(GEOM.mjGEOM_BOX)):
            corners = CORNERS * size
            if kind == int(GEOM.mjGEOM_MESH):
                m = model.geom_dataid[g]
                corners = model.mesh_vert[model.mesh_vertadr[m] :][: model.mesh_vertnum[m]]
            at = corners @ R.T + p
            out.append(np.concatenate([at.min(axis=0), at.max(axis=0)]))
            continue
        reach = {
            int(GEOM.mjGEOM_SPHERE): np.full(3, size[0]),
            int(GEOM.mjGEOM_CAPSULE): size[0] + np.abs(R[:, 2]) * size[1],
            int(GEOM.mjGEOM_CYLINDER): size[0] * np.sqrt(np.maximum(1 - R[:, 2] ** 2, 0)) + np.abs(R[:, 2]) * size[1],
            int(GEOM.mjGEOM_ELLIPSOID): np.linalg.norm(R * size, axis=1),
        }[kind]
        out.append(np.concatenate([p - reach, p + reach]))
    return np.array(out).reshape(-1, 6)


def shapes_off(scene: Scene, case: Case, q, table) -> dict[str, float]:
    """How far any shape is from the nearest of its model's own, and these from the cell's, m; infinite by number."""
    model, data = scene.model, mujoco.MjData(scene.model)
    data.qpos[scene.arm_qpos], data.qpos[scene.table_qpos] = q, table
    mujoco.mj_kinematics(model, data)
    robot, tool, positioner = case.robot, case.tool, case.positioner
    arm = Model(case.path_of(robot.model), robot.joints, "robot", held=held(robot))
    torch = Model(case.path_of(tool.model), (), "tool", held=held(tool))
    stand = Model(case.path_of(positioner.model), positioner.joints, "table", held=held(positioner))
    arm.pose(q)
    torch.pose(())
    stand.pose([table[("E1", "E2").index(name)] for name in positioner.joints])
    T_robot = frame(robot.position_mm, robot.rotation_deg)
    places = {
        BodyOwner.ROBOT: (arm, T_robot),
        BodyOwner.TOOL: (torch, T_robot @ arm.site(robot.flange)),
        BodyOwner.POSITIONER: (stand, frame(positioner.position_mm, positioner.rotation_deg)),
    }
    hard, out = scene.contact_bits.any(axis=0), {}
    for piece, (own, T) in places.items():
        here = boxes(model, data, np.flatnonzero(hard & (scene.piece_of_geom == piece)), np.eye(4))
        there = boxes(own.model, own.data, [s.geom for s in own.solids], T)
        apart = np.abs(here[:, None] - there[None]).max(axis=-1)
        alike = len(here) == len(there)
        out[piece.name.lower()] = max(apart.min(axis=0).max(), apart.min(axis=1).max()) if alike else np.inf
    return out
