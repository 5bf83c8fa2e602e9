"""A composed cell beside its models' own files: whether each solid, site and axis is where its file alone has it.

wrong = differences(path_of_case)         # one line a solid, site or axis that is elsewhere, missing or too much

Each model is compiled by itself and put where the case says. Solids are compared by how far they reach in many
directions, whatever kinds of shapes they are. Metres.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import mujoco
import numpy as np

from cell.case.read import load_case
from cell.job.job import prepare
from cell.scene.composition import BodyOwner
from cell.scene.scene import Scene

from .witness import frame, frame_of, held

GEOM = mujoco.mjtGeom
SAME = 2e-5  # m, of single precision
WAYS = np.random.default_rng(0).normal(size=(80, 3))
WAYS /= np.linalg.norm(WAYS, axis=1)[:, None]


def reaches(model, data, g, T) -> np.ndarray:
    """How far a solid reaches in each direction of the world, (80,); of a plane where it is."""
    turn = T[:3, :3] @ data.geom_xmat[g].reshape(3, 3)
    place = T[:3, :3] @ data.geom_xpos[g] + T[:3, 3]
    own, size, kind = WAYS @ turn, model.geom_size[g], int(model.geom_type[g])
    if kind == GEOM.mjGEOM_PLANE:
        return np.concatenate([turn[:, 2], [turn[:, 2] @ place], np.full(76, 1e3)])
    if kind == GEOM.mjGEOM_MESH:
        mesh = model.geom_dataid[g]
        points = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]].astype(float)
        return (points @ own.T).max(axis=0) + WAYS @ place
    far = {
        int(GEOM.mjGEOM_SPHERE): lambda: np.full(len(own), size[0]),
        int(GEOM.mjGEOM_CAPSULE): lambda: size[0] + size[1] * np.abs(own[:, 2]),
        int(GEOM.mjGEOM_CYLINDER): lambda: size[0] * np.hypot(own[:, 0], own[:, 1]) + size[1] * np.abs(own[:, 2]),
        int(GEOM.mjGEOM_ELLIPSOID): lambda: np.linalg.norm(own * size, axis=1),
        int(GEOM.mjGEOM_BOX): lambda: np.abs(own) @ size,
    }[kind]()
    return far + WAYS @ place


class ModelByItself:
    """A model from its own file, its held joints where key home or the case has them."""

    def __init__(self, path, joints, places: dict[str, float]) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            self.model = m = mujoco.MjModel.from_xml_path(str(path))
        self.data = d = mujoco.MjData(m)
        hinges = np.isin(m.jnt_type, (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)))
        d.qpos[m.jnt_qposadr[hinges]] = 0.0
        if "home" in [m.key(k).name for k in range(m.nkey)]:
            d.qpos[:] = m.key("home").qpos
        for name, value in places.items():
            d.joint(name).qpos[0] = value
        self.qpos = [int(m.joint(name).qposadr[0]) for name in joints]
        named = {int(g) for g in (*m.pair_geom1, *m.pair_geom2)}
        self.solid = [g for g in range(m.ngeom) if m.geom_contype[g] or m.geom_conaffinity[g] or g in named]

    def pose(self, q) -> None:
        self.data.qpos[self.qpos] = q
        mujoco.mj_kinematics(self.model, self.data)

    def site(self, name: str) -> np.ndarray:
        found = self.data.site(name)
        return frame_of(found.xpos, found.xmat)


def differences(path: Path, poses: int = 3) -> list[str]:
    """What of a case's cell is not as its models' files have it, at random angles of all axes."""
    scene = prepare(load_case(path)).scene
    case, rng = scene.case, np.random.default_rng(3)
    arm = ModelByItself(case.path_of(case.robot.model), case.robot.joints, held(case.robot))
    tool = ModelByItself(case.path_of(case.tool.model), (), held(case.tool))
    table = ModelByItself(case.path_of(case.positioner.model), case.positioner.joints, held(case.positioner))
    data, found = mujoco.MjData(scene.model), []
    T_arm = frame(case.robot.position_mm, case.robot.rotation_deg)
    T_table = frame(case.positioner.position_mm, case.positioner.rotation_deg)
    for _ in range(poses):
        q = rng.uniform(scene.chain.lower, scene.chain.upper)
        E = rng.uniform(*np.clip(scene.table_range, -3.0, 3.0).T)
        data.qpos[scene.arm_qpos], data.qpos[scene.table_qpos] = q, E
        mujoco.mj_kinematics(scene.model, data)
        arm.pose(q)
        tool.pose(())
        table.pose(E[scene.has_axis])
        T_flange = T_arm @ arm.site(case.robot.flange)
        for piece, raw, T in (
            (BodyOwner.ROBOT, arm, T_arm),
            (BodyOwner.TOOL, tool, T_flange),
            (BodyOwner.POSITIONER, table, T_table),
        ):
            found += _solids(scene, data, piece, raw, T)
        T_site, lift = T_table @ table.site(case.positioner.table), case.support.height_mm
        sites = {
            "tcp": T_flange @ tool.site(case.tool.tcp),
            "table": T_site,
            "part": T_site @ frame(np.add(case.part.position_mm, (0, 0, lift)), (0, 0, case.part.rotation_deg)),
        }
        for name, T in sites.items():
            s = scene.sites[name]
            if np.abs(frame_of(data.site_xpos[s], data.site_xmat[s]) - T).max() > SAME:
                found.append(f"site {name} is elsewhere")
        support = data.geom("support")
        T = T_site @ frame((0, 0, lift / 2), (0, 0, 0))
        if np.abs(frame_of(support.xpos, support.xmat) - T).max() > SAME:
            found.append("the support is elsewhere")
        base = frame_of(data.xpos[scene.base_body], data.xmat[scene.base_body])
        if np.abs(base @ scene.chain.forward(q[None])[0] - sites["tcp"]).max() > SAME:
            found.append("the chain's TCP is elsewhere")
    return sorted(set(found))


def _solids(scene: Scene, data, piece: BodyOwner, raw: ModelByItself, T: np.ndarray) -> list[str]:
    mine = np.flatnonzero((scene.piece_of_geom == piece) & scene.contact_bits.any(axis=0)).tolist()
    there = np.array([reaches(scene.model, data, g, np.eye(4)) for g in mine]).reshape(-1, len(WAYS))
    found, used = [], set()
    for g in raw.solid:
        off = np.abs(there - reaches(raw.model, raw.data, g, T)).max(axis=1, initial=0.0)
        if not len(off) or off.min() > SAME:
            found.append(f"{piece.name}: {raw.model.geom(g).name or f'shape {g}'} is elsewhere")
        else:
            used.add(int(np.argmin(off)))
    return found + [f"{piece.name}: {scene.geom_name(g)} is too much" for i, g in enumerate(mine) if i not in used]
