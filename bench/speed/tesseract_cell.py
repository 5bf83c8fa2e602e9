"""A composed cell written out for Tesseract: URDF, SRDF and plugins, with the shapes and pairs that MuJoCo collides.

    write_cell(scene, table, folder, libraries)   # cell.urdf, cell.srdf, plugins.yaml, hull_*.obj
    # group "manipulator" from base_link to tool0 (OPW), TCP frame "tcp", working frame "base"

The table stands still at its angles; no deposits. What MuJoCo does not test, the SRDF disables. Metres, radians.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree as ET

import mujoco
import numpy as np
import trimesh
import yaml
from scipy.spatial.transform import Rotation

from cell.rigid import inverse, pose
from cell.scene.scene import Scene
from ik.chain import Floats

# of the shipped arm; Source: models/kr70_r2100/README.md, the vendor's sheet
OPW = {"a1": 0.175, "a2": -0.050, "b": 0.0, "c1": 0.575, "c2": 0.890, "c3": 1.035, "c4": 0.185}
OFFSETS = (0.0, -np.pi / 2, 0.0, 0.0, 0.0, 0.0)
SIGNS = (-1, 1, 1, -1, 1, -1)
UPRIGHT = np.array([0.0, -np.pi / 2, 0.0, 0.0, 0.0, 0.0])  # where OPW's flange looks straight up

Partners = frozenset[int]


@dataclass
class Link:
    """Geoms of one body that collide with the same others."""

    name: str
    body: int
    geoms: list[int] = field(default_factory=list)


def write_cell(scene: Scene, table: tuple[float, float], folder: Path, libraries: Path) -> None:
    """Write the cell.

    Args:
        scene: the cell.
        table: E1, E2, rad.
        folder: where to.
        libraries: where Tesseract's plugins are.
    """
    model, chain = scene.model, scene.chain
    data = mujoco.MjData(model)
    data.qpos[scene.table_qpos] = table
    mujoco.mj_kinematics(model, data)
    base = int(model.body(scene.case.robot.base).id)
    T_world_base = pose(data.xpos[base], data.xmat[base])
    urdf = ET.Element("robot", name="cell")
    ET.SubElement(urdf, "link", name="base")
    frame_of = {}  # body -> its frame's name and pose in that frame
    arm = [int(model.jnt_bodyid[model.joint(name).id]) for name in chain.names]
    for j, body in enumerate(arm):
        parent = "base" if j == 0 else f"frame_{j}"
        name = f"frame_{j + 1}"
        ET.SubElement(urdf, "link", name=name)
        _joint(urdf, chain.names[j], parent, name, chain.origins[j])
        moving = urdf[-1]
        moving.set("type", "revolute")
        ET.SubElement(moving, "axis", xyz=_text(chain.axes[j]))
        limits = {"lower": chain.lower[j], "upper": chain.upper[j], "velocity": chain.max_speed[j], "effort": 1e3}
        ET.SubElement(moving, "limit", {k: repr(float(v)) for k, v in limits.items()})
        frame_of[body] = name, data.xanchor[model.joint(chain.names[j]).id]
    T_last_flange = inverse(_last_frame(chain.origins, chain.axes, UPRIGHT)) @ _flange_upright()
    T_flange_tcp = inverse(T_last_flange) @ chain.T_last_tcp
    for name, parent, T in [("tool0", f"frame_{len(arm)}", T_last_flange), ("tcp", "tool0", T_flange_tcp)]:
        ET.SubElement(urdf, "link", name=name)
        _joint(urdf, f"to_{name}", parent, name, T)
    links = _links(scene)
    for link in links:
        element = ET.SubElement(urdf, "link", name=link.name)
        carrier = link.body
        while carrier not in frame_of and carrier != 0:
            carrier = int(model.body_parentid[carrier])
        if carrier in frame_of:
            parent, anchor = frame_of[carrier]
            T_world_frame = np.eye(4)
            T_world_frame[:3, :3], T_world_frame[:3, 3] = data.xmat[carrier].reshape(3, 3), anchor
        else:
            parent, T_world_frame = "base", T_world_base
        _joint(urdf, f"to_{link.name}", parent, link.name, np.eye(4))
        for g in link.geoms:
            T = inverse(T_world_frame) @ pose(data.geom_xpos[g], data.geom_xmat[g])
            _collision(element, scene, g, T, folder)
    ET.ElementTree(urdf).write(folder / "cell.urdf")
    ET.ElementTree(_srdf(scene, links, folder)).write(folder / "cell.srdf")
    _plugins(folder, libraries)


def _last_frame(origins: Floats, axes: Floats, q: Floats) -> Floats:
    T = np.eye(4)
    for origin, axis, angle in zip(origins, axes, q, strict=True):
        turn = np.eye(4)
        turn[:3, :3] = Rotation.from_rotvec(axis * angle).as_matrix()
        T = T @ origin @ turn
    return T


def _flange_upright() -> Floats:
    T = np.eye(4)
    T[:3, 3] = OPW["a1"] + OPW["a2"], OPW["b"], OPW["c1"] + OPW["c2"] + OPW["c3"] + OPW["c4"]
    return T


def _joint(urdf: ET.Element, name: str, parent: str, child: str, T: Floats) -> None:
    joint = ET.SubElement(urdf, "joint", name=name, type="fixed")
    rpy = Rotation.from_matrix(T[:3, :3]).as_euler("xyz")
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "origin", xyz=_text(T[:3, 3]), rpy=_text(rpy))


def _text(values: Floats) -> str:
    return " ".join(repr(float(v)) for v in values)


def _links(scene: Scene) -> list[Link]:
    """All that counts but the deposits, grouped so that a pair of links is tested in full or not at all."""
    model = scene.model
    partners: dict[int, set[int]] = defaultdict(set)
    for a, b in zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True):
        partners[a].add(b)
        partners[b].add(a)
    groups: dict[tuple[int, int, int, Partners], Link] = {}
    for g in np.flatnonzero(scene.contact_bits.any(axis=0) & (scene.deposit_of_geom < 0)).tolist():
        body = int(model.geom_bodyid[g])
        contype, conaffinity = scene.contact_bits[:, g].tolist()
        key = body, contype, conaffinity, frozenset(partners[g])
        link = groups.setdefault(key, Link(f"{model.body(body).name}_{len(groups)}", body))
        link.geoms.append(g)
    return list(groups.values())


def _tested(scene: Scene, a: Link, b: Link) -> bool:
    """Whether MuJoCo tests two links: its filters of bodies, contact bits and named pairs."""
    model = scene.model
    g, h = a.geoms[0], b.geoms[0]
    named = set(zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True))
    if (g, h) in named or (h, g) in named:
        return True
    weld = [int(model.body_weldid[link.body]) for link in (a, b)]
    above = [int(model.body_weldid[model.body_parentid[w]]) for w in weld]
    low, high = sorted((a.body, b.body))
    related = 0 not in weld and (weld[0] == above[1] or weld[1] == above[0])
    excluded = (low << 16) + high in model.exclude_signature
    if weld[0] == weld[1] or related or excluded or not (scene.arm_geom[g] or scene.arm_geom[h]):
        return False
    (type_g, type_h), (meets_g, meets_h) = scene.contact_bits[:, [g, h]].tolist()
    return bool(type_g & meets_h or type_h & meets_g)


def _collision(link: ET.Element, scene: Scene, g: int, T: Floats, folder: Path) -> None:
    model = scene.model
    kind, size = mujoco.mjtGeom(model.geom_type[g]), model.geom_size[g]
    if kind == mujoco.mjtGeom.mjGEOM_PLANE:
        # URDF has none: a slab below it, as large as the cell
        T = T.copy()
        T[:3, 3] -= 0.5 * T[:3, 2]
        shape = ET.Element("box", size="8 8 1")
    elif kind == mujoco.mjtGeom.mjGEOM_BOX:
        shape = ET.Element("box", size=_text(2 * size))
    elif kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        shape = ET.Element("sphere", radius=repr(float(size[0])))
    elif kind in (mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_CAPSULE):
        tag = "cylinder" if kind == mujoco.mjtGeom.mjGEOM_CYLINDER else "capsule"
        shape = ET.Element(tag, radius=repr(float(size[0])), length=repr(float(2 * size[1])))
    elif kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = int(model.geom_dataid[g])
        first = int(model.mesh_vertadr[mesh])
        points = model.mesh_vert[first : first + int(model.mesh_vertnum[mesh])]
        file = folder / f"hull_{g}.obj"
        trimesh.convex.convex_hull(np.asarray(points, dtype=np.float64)).export(file)
        shape = ET.Element("convex_mesh", filename=file.as_uri(), convert="true")
    else:
        raise ValueError(f"geom {scene.geom_name(g)}: no URDF for {kind.name}")
    collision = ET.SubElement(link, "collision")
    rpy = Rotation.from_matrix(T[:3, :3]).as_euler("xyz")
    ET.SubElement(collision, "origin", xyz=_text(T[:3, 3]), rpy=_text(rpy))
    ET.SubElement(collision, "geometry").append(shape)


def _srdf(scene: Scene, links: list[Link], folder: Path) -> ET.Element:
    srdf = ET.Element("robot", name="cell", version="1.0.0")
    group = ET.SubElement(srdf, "group", name="manipulator")
    ET.SubElement(group, "chain", base_link="base", tip_link="tool0")
    plugins = (folder / "plugins.yaml").as_uri()
    ET.SubElement(srdf, "kinematics_plugin_config", filename=plugins)
    ET.SubElement(srdf, "contact_managers_plugin_config", filename=plugins)
    for i, a in enumerate(links):
        for b in links[:i]:
            if not _tested(scene, a, b):
                ET.SubElement(srdf, "disable_collisions", link1=a.name, link2=b.name, reason="Never")
    return srdf


def _plugins(folder: Path, libraries: Path) -> None:
    def library(name: str) -> str:
        return next(libraries.glob(f"lib{name}*.so")).name.removeprefix("lib").removesuffix(".so")

    opw = {"base_link": "base", "tip_link": "tool0"}
    params = {**OPW, "offsets": list(OFFSETS), "sign_corrections": list(SIGNS)}
    manager = {"class": "BulletDiscreteBVHManagerFactory"}
    cast = {"class": "BulletCastBVHManagerFactory"}
    document = {
        "kinematic_plugins": {
            "search_paths": [str(libraries)],
            "search_libraries": [library("tesseract_kinematics_opw_factory")],
            "inv_kin_plugins": {
                "manipulator": {
                    "default": "OPWInvKin",
                    "plugins": {"OPWInvKin": {"class": "OPWInvKinFactory", "config": {**opw, "params": params}}},
                }
            },
        },
        "contact_manager_plugins": {
            "search_paths": [str(libraries)],
            "search_libraries": [library("tesseract_collision_bullet_factories")],
            "discrete_plugins": {
                "default": "BulletDiscreteBVHManager",
                "plugins": {"BulletDiscreteBVHManager": manager},
            },
            "continuous_plugins": {"default": "BulletCastBVHManager", "plugins": {"BulletCastBVHManager": cast}},
        },
    }
    (folder / "plugins.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
