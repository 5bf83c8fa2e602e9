"""The cell as one MuJoCo model, composed from a case: robot, tool, positioner, support, part, fixtures.

    scene = compose(case, part)               # part: cell.deposit.PartShape
    scene.model, scene.chain                  # MuJoCo's model, the arm as arrays
    scene.T_base_part(E1, E2)                 # where the part is, seen from the arm
    standalone_xml(scene)                     # one MJCF that plain MuJoCo loads

Every model keeps its own names, so that a user can swap any of them and bind other names in the case file. World frame:
z up, metres.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Chain, Floats
from ik.roll import wrap

from .config import MODELS_DIR, Case, Fixture, is_path
from .deposit import PartShape
from .errors import InputError
from .place import METRES_PER_MM
from .robot import chain_of, inverse, pose, require
from .torch import TorchDimensions, shape_torch

# contact bits: the wire may touch the part and nothing else
SOLID, WIRE = 1, 2
ROBOT, TOOL, POSITIONER = "robot/", "tool/", "positioner/"
UNIT = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 25.4e-3}
COLOUR = {
    "support": (0.42, 0.44, 0.47, 1.0),
    "body": (0.62, 0.65, 0.69, 1.0),
    "part": (0.36, 0.62, 0.86, 1.0),
    "deposit": (0.36, 0.62, 0.86, 0.35),
    "fixture": (0.55, 0.50, 0.40, 1.0),
}


@dataclass(frozen=True, eq=False)
class Scene:
    """A compiled cell.

    Attributes:
        case: what it was made from.
        model: MuJoCo's model.
        spec: what it was compiled from.
        chain: the arm with its tool, base frame = the robot's base body.
        arm_qpos: places of the arm's joints in qpos, (n,).
        table_qpos: places of E1, E2 in qpos, (2,).
        table_range: their ranges, (2, 2), rad.
        home: the arm's rest configuration, (n,), rad.
        deposit_of_geom: number of the deposit a geom stands for, -1 for all else, (ngeom,).
        n_deposits: how many deposits the part has.
        arm_geom: whether a geom belongs to the arm or its tool, (ngeom,).
    """

    case: Case
    model: mujoco.MjModel
    spec: mujoco.MjSpec
    chain: Chain
    arm_qpos: NDArray[np.int64]
    table_qpos: NDArray[np.int64]
    table_range: Floats
    home: Floats
    deposit_of_geom: NDArray[np.int64]
    n_deposits: int
    arm_geom: NDArray[np.bool_]

    def T_base_part(self, E1: float, E2: float) -> Floats:
        """Pose of the part in the arm's base frame.

        Args:
            E1: tilt, rad.
            E2: turn, rad.

        Returns:
            (4, 4), m.
        """
        data = mujoco.MjData(self.model)
        data.qpos[self.table_qpos] = E1, E2
        mujoco.mj_kinematics(self.model, data)
        base = require(self.model, "body", self.case.robot.base, "robot.base")
        site = self.model.site("part").id
        return inverse(pose(data.xpos[base], data.xmat[base])) @ pose(
            data.site_xpos[site], data.site_xmat[site]
        )

    def T_world_base(self) -> Floats:
        """Pose of the arm's base frame in the world, (4, 4), m."""
        data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, data)
        base = require(self.model, "body", self.case.robot.base, "robot.base")
        return pose(data.xpos[base], data.xmat[base])

    def check_table(self, E1: float, E2: float) -> None:
        """Refuse table angles (rad) that the positioner does not have.

        Raises:
            InputError: which axis, its range.
        """
        for name, value, (low, high) in zip(("E1", "E2"), (E1, E2), self.table_range, strict=True):
            if not low - 1e-9 <= value <= high + 1e-9:
                turn = (
                    "; the same angle a turn on is inside"
                    if any(low <= value + k * 2 * np.pi <= high for k in (-1, 1))
                    else ""
                )
                low_deg, high_deg, deg = np.rad2deg([low, high, value])
                raise InputError(
                    f"{name} = {deg:g} deg is outside the positioner's range {low_deg:g} .. {high_deg:g} deg{turn}"
                )

    def geom_name(self, geom: int) -> str:
        """What a geom is called in reports."""
        name = self.model.geom(geom).name
        return name or f"{self.model.body(self.model.geom_bodyid[geom]).name} (geom {geom})"


def table_angles(scene: Scene, E1_deg: float, E2_deg: float) -> tuple[float, float]:
    """Table angles as the positioner takes them.

    Args:
        scene: the cell.
        E1_deg: tilt.
        E2_deg: turn; a turn that is outside the axis' range is taken as the same direction inside it if there is one.

    Returns:
        E1, E2, rad.

    Raises:
        InputError: the positioner has no such angle.
    """
    E1, E2 = np.deg2rad([E1_deg, E2_deg])
    low, high = scene.table_range[1]
    if not low <= E2 <= high:
        same = [E2 + k * 2 * np.pi for k in (-1, 1) if low <= E2 + k * 2 * np.pi <= high]
        E2 = same[0] if same else E2
    scene.check_table(E1, E2)
    return float(E1), float(E2)


def compose(case: Case, part: PartShape) -> Scene:
    """Build the cell.

    Args:
        case: the case.
        part: shapes of the part, part frame, mm.

    Returns:
        The compiled scene.

    Raises:
        InputError: a model file is missing or does not compile, or a name the case binds is not in it.
    """
    world = _surroundings(case)
    home = _add_robot(world, case)
    _add_positioner(world, case)
    _add_part(world, case, part)
    for fixture in case.fixtures:
        _add_fixture(world, case, fixture)
    _set_contact_bits(world, case)
    _pair_tool_with_forearm(world, case)
    try:
        model = world.compile()
    except ValueError as error:
        raise InputError(f"{case.path}: the scene does not compile: {_one_line(error)}") from None
    return _bind(world, model, case, part, home)


def _bind(
    world: mujoco.MjSpec, model: mujoco.MjModel, case: Case, part: PartShape, home: dict[str, float]
) -> Scene:
    arm_joints = [require(model, "joint", name, "robot.joints") for name in case.robot.joints]
    table_joints = [require(model, "joint", name, "positioner.joints") for name in case.positioner.joints]
    tool_root = int(model.jnt_bodyid[arm_joints[0]])
    arm_geom = np.array([_descends(model, int(b), tool_root) for b in model.geom_bodyid], dtype=bool)
    chain = chain_of(model, case.robot.joints, case.tool.tcp, case.robot.base, _speeds(model, case))
    rest = np.array([home.get(name, 0.0) for name in case.robot.joints])
    names = [model.geom(i).name for i in range(model.ngeom)]
    deposits = [int(n.split("/")[1]) if n.startswith("deposit/") else -1 for n in names]
    return Scene(
        case=case,
        model=model,
        spec=world,
        chain=chain,
        arm_qpos=model.jnt_qposadr[arm_joints].astype(np.int64),
        table_qpos=model.jnt_qposadr[table_joints].astype(np.int64),
        table_range=model.jnt_range[table_joints].copy(),
        home=np.clip(rest, chain.lower, chain.upper),
        deposit_of_geom=np.array(deposits, dtype=np.int64),
        n_deposits=part.n_deposits,
        arm_geom=arm_geom,
    )


def _descends(model: mujoco.MjModel, body: int, root: int) -> bool:
    while body not in (0, root):
        body = int(model.body_parentid[body])
    return body == root


def _speeds(model: mujoco.MjModel, case: Case) -> Floats:
    n = len(case.robot.joints)
    if case.robot.max_speed_deg_s is not None:
        speeds = np.array(case.robot.max_speed_deg_s)
        if len(speeds) != n:
            raise InputError(f"{case.path}: robot.max_speed_deg_s: has {len(speeds)} values for {n} joints")
        return np.deg2rad(speeds)
    try:
        speeds = np.asarray(model.numeric("max_speed_deg_s").data)
    except KeyError:
        raise InputError(
            f"{case.path}: robot.max_speed_deg_s: needed, since the robot's MJCF has no numeric max_speed_deg_s"
        ) from None
    if len(speeds) != n or not np.all(speeds > 0):
        raise InputError(f"{case.path}: the robot's numeric max_speed_deg_s needs {n} positive values")
    return np.deg2rad(speeds)


def _load(case: Case, name: str, what: str) -> mujoco.MjSpec:
    """A shipped model by name, or any MJCF by its path."""
    shipped = MODELS_DIR / name / f"{name}.xml"
    path = case.path_of(name) if is_path(name) else shipped
    if not path.is_file():
        known = sorted(p.parent.name for p in MODELS_DIR.glob("*/*.xml"))
        raise InputError(
            f"{case.path}: {what}.model: no file {path}; shipped models are {', '.join(known)}, anything else is a path"
        )
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise InputError(f"{path}: not an MJCF that MuJoCo reads: {_one_line(error)}") from None
    for mesh in spec.meshes:
        if mesh.file:  # found wherever the scene is compiled
            mesh.file = str((path.parent / spec.meshdir / mesh.file).resolve())
    return spec


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())


def _drop_keys(spec: mujoco.MjSpec) -> None:
    # keyframes of several models would clash, and none of them covers the whole cell
    for key in list(spec.keys):
        spec.delete(key)


def _quat(rotation_deg: tuple[float, float, float]) -> Floats:
    quat = np.zeros(4)
    mujoco.mju_euler2Quat(quat, np.deg2rad(rotation_deg), "XYZ")
    return quat


def _surroundings(case: Case) -> mujoco.MjSpec:
    world = mujoco.MjSpec()
    world.modelname = "cell"
    world.compiler.degree = False
    world.option.gravity = (0, 0, 0)  # kinematics and contacts alone: nothing is to fall
    world.visual.headlight.ambient = (0.35, 0.35, 0.35)
    world.visual.headlight.diffuse = (0.45, 0.45, 0.45)
    world.visual.headlight.specular = (0.1, 0.1, 0.1)
    world.visual.map.znear = 0.005
    world.visual.quality.shadowsize = 4096
    world.visual.global_.offwidth, world.visual.global_.offheight = 2560, 1600
    world.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.93, 0.94, 0.96),
        rgb2=(0.72, 0.76, 0.80),
        width=256,
        height=1536,
    )
    world.add_texture(
        name="floor",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        rgb1=(0.60, 0.62, 0.64),
        rgb2=(0.57, 0.59, 0.61),
        markrgb=(0.52, 0.54, 0.56),
        width=512,
        height=512,
    )
    textures = [""] * int(mujoco.mjtTextureRole.mjNTEXROLE)
    textures[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = "floor"
    world.add_material(name="floor", textures=textures, texrepeat=(1, 1), texuniform=True, reflectance=0.05)
    body = world.worldbody
    body.add_light(pos=(1.0, -2.5, 4.0), dir=(0.05, 0.5, -0.85), type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    if case.floor:
        body.add_geom(
            name="floor",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=(6, 6, 0.1),
            material="floor",
            contype=SOLID,
            conaffinity=SOLID | WIRE,
        )
    return world


def _add_robot(world: mujoco.MjSpec, case: Case) -> dict[str, float]:
    """Attach the arm and its tool; gives the angles of the arm's ``home`` keyframe by joint name."""
    robot = _load(case, case.robot.model, "robot")
    home = _home(robot)
    _drop_keys(robot)
    flange = robot.site(case.robot.flange)
    if flange is None:
        raise InputError(
            f"{case.path}: robot.flange: {case.robot.model} has no site named {case.robot.flange!r}"
        )
    tool = _load(case, case.tool.model, "tool")
    _drop_keys(tool)
    if case.tool.dimensions or case.tool.model == "cmt_torch":
        try:
            shape_torch(tool, TorchDimensions(**case.tool.dimensions))
        except (TypeError, ValueError) as error:
            raise InputError(f"{case.path}: tool.dimensions: {_dimension_problem(error)}") from None
    robot.attach(tool, site=flange, prefix=TOOL)
    frame = world.worldbody.add_frame(
        pos=np.array(case.robot.position_mm) * METRES_PER_MM, quat=_quat(case.robot.rotation_deg)
    )
    world.attach(robot, frame=frame, prefix=ROBOT)
    for prefix in (ROBOT, TOOL):
        _own_names(world, prefix)
    return home


def _dimension_problem(error: Exception) -> str:
    text = str(error)
    if isinstance(error, TypeError):
        import difflib
        import re

        known = list(TorchDimensions.__dataclass_fields__)
        match = re.search(r"'(\w+)'", text)
        wrong = match.group(1) if match else text
        near = difflib.get_close_matches(wrong, known, n=1, cutoff=0.5)
        return f"{wrong}: unknown key; " + (
            f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
        )
    return text


def _home(robot: mujoco.MjSpec) -> dict[str, float]:
    key = next((k for k in robot.keys if k.name == "home"), None)
    if key is None:
        return {}
    return {
        joint.name: float(wrap(np.array(value))) for joint, value in zip(robot.joints, key.qpos, strict=False)
    }


def _add_positioner(world: mujoco.MjSpec, case: Case) -> None:
    positioner = _load(case, case.positioner.model, "positioner")
    _drop_keys(positioner)
    for numeric in list(positioner.numerics):
        numeric.name = f"positioner_{numeric.name}"
    frame = world.worldbody.add_frame(
        pos=np.array(case.positioner.position_mm) * METRES_PER_MM, quat=_quat(case.positioner.rotation_deg)
    )
    world.attach(positioner, frame=frame, prefix=POSITIONER)
    _own_names(world, POSITIONER)


def _own_names(world: mujoco.MjSpec, prefix: str) -> None:
    """Give what was attached its own names back; defaults, materials and meshes keep the prefix and cannot clash."""
    named = (
        world.bodies,
        world.joints,
        world.geoms,
        world.sites,
        world.cameras,
        world.numerics,
        world.excludes,
        world.pairs,
    )
    for element in (e for group in named for e in group):
        element.name = element.name.removeprefix(prefix)
    for exclude in world.excludes:
        exclude.bodyname1, exclude.bodyname2 = (
            exclude.bodyname1.removeprefix(prefix),
            exclude.bodyname2.removeprefix(prefix),
        )
    for pair in world.pairs:
        pair.geomname1, pair.geomname2 = (
            pair.geomname1.removeprefix(prefix),
            pair.geomname2.removeprefix(prefix),
        )


def _on_table(world: mujoco.MjSpec, case: Case) -> tuple[mujoco.MjsBody, mujoco.MjsSite]:
    site = world.site(case.positioner.table)
    if site is None:
        raise InputError(
            f"{case.path}: positioner.table: {case.positioner.model} has no site named {case.positioner.table!r}"
        )
    return site.parent, site


def _add_part(world: mujoco.MjSpec, case: Case, part: PartShape) -> None:
    turn, table = _on_table(world, case)
    lift = 0.0
    fixed = turn.add_body(name="workpiece", pos=table.pos, quat=table.quat)
    if case.support is not None:
        radius, height = case.support.radius_mm * METRES_PER_MM, case.support.height_mm * METRES_PER_MM
        fixed.add_geom(
            name="support",
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=(radius, height / 2, 0),
            pos=(0, 0, height / 2),
            rgba=COLOUR["support"],
            group=3,
            contype=SOLID,
            conaffinity=SOLID,
        )
        fixed.add_geom(
            name="support_visual",
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=(radius, height / 2, 0),
            pos=(0, 0, height / 2),
            rgba=COLOUR["support"],
            group=2,
            contype=0,
            conaffinity=0,
        )
        lift = height
    place = np.array(case.part.position_mm) * METRES_PER_MM + (0.0, 0.0, lift)
    body = fixed.add_body(name="part", pos=place, quat=_quat((0.0, 0.0, case.part.rotation_deg)))
    body.add_site(name="part", size=(0.002, 0.002, 0.002), group=4)
    for name, mesh in part.visual.items():
        world.add_mesh(
            name=name,
            uservert=(mesh.vertices * METRES_PER_MM).ravel(),
            userface=mesh.faces.astype(np.int32).ravel(),
        )
        colour = COLOUR["body" if name == "body_visual" else "part"]
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            rgba=colour,
            group=2,
            contype=0,
            conaffinity=0,
        )
    for name, vertices in part.hulls.items():
        world.add_mesh(name=name, uservert=(vertices * METRES_PER_MM).ravel())
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            rgba=COLOUR["deposit" if name.startswith("deposit/") else "body"],
            group=3,
            contype=SOLID,
            conaffinity=SOLID,
        )


def _add_fixture(world: mujoco.MjSpec, case: Case, fixture: Fixture) -> None:
    if fixture.on == "table":
        turn, table = _on_table(world, case)
        parent = turn.add_body(name=f"fixture_{fixture.name}_frame", pos=table.pos, quat=table.quat)
    else:
        parent = world.worldbody
    body = parent.add_body(
        name=f"fixture_{fixture.name}",
        pos=np.array(fixture.position_mm) * METRES_PER_MM,
        quat=_quat(fixture.rotation_deg),
    )
    options = {
        "name": fixture.name,
        "rgba": COLOUR["fixture"],
        "group": 3,
        "contype": SOLID,
        "conaffinity": SOLID | WIRE,
    }
    if fixture.box is not None:
        shape = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": np.array(fixture.box.size_mm) * METRES_PER_MM / 2}
    elif fixture.cylinder is not None:
        radius, height = fixture.cylinder.radius_mm, fixture.cylinder.height_mm
        shape = {
            "type": mujoco.mjtGeom.mjGEOM_CYLINDER,
            "size": np.array([radius, height / 2, 0]) * METRES_PER_MM,
        }
    else:
        shape = {
            "type": mujoco.mjtGeom.mjGEOM_MESH,
            "meshname": _fixture_mesh(world, case, fixture),
        }
    body.add_geom(**shape, **options)
    look = {**options, "name": f"{fixture.name}_visual", "group": 2, "contype": 0, "conaffinity": 0}
    body.add_geom(**shape, **look)


def _fixture_mesh(world: mujoco.MjSpec, case: Case, fixture: Fixture) -> str:
    path = Path(case.path_of(str(fixture.mesh)))
    if not path.is_file():
        raise InputError(f"{case.path}: fixtures.{fixture.name}.mesh: {path}: no such file")
    name = f"fixture_{fixture.name}_mesh"
    # its convex hull is what collides: it covers the fixture, holes and all
    world.add_mesh(name=name, file=str(path.resolve()), scale=[UNIT[fixture.units]] * 3)
    return name


def _set_contact_bits(world: mujoco.MjSpec, case: Case) -> None:
    """Everything may hit everything, but for the wire on the part (a model's own bits only say what collides)."""
    wires = set(case.tool.wire)
    part = {"support"}
    for geom in world.geoms:
        if not (geom.contype or geom.conaffinity):
            continue
        if geom.name in wires:
            geom.contype, geom.conaffinity = WIRE, 0
        elif geom.name in part or geom.name.startswith(("deposit/", "body/")):
            geom.contype, geom.conaffinity = SOLID, SOLID
        else:
            geom.contype, geom.conaffinity = SOLID, SOLID | WIRE


def _pair_tool_with_forearm(world: mujoco.MjSpec, case: Case) -> None:
    """Name the pairs of the tool and the link before the last.

    MuJoCo leaves out parent and child, and the tool is welded to the last link, so that its pairs with that link's parent
    would never be tested. What is bolted onto the flange itself turns about that link's own axis and stays out.
    """
    last = world.joint(case.robot.joints[-1])
    if last is None:
        return  # _bind says so
    flange_body, forearm = last.parent, last.parent.parent
    tool_geoms = [g for body in flange_body.bodies for g in _all_geoms(body) if g.contype or g.conaffinity]
    for mine in tool_geoms:
        if mine.name.endswith("_mount") or mine.name in case.tool.wire:
            continue
        for other in (g for g in forearm.geoms if g.contype or g.conaffinity):
            world.add_pair(name=f"{mine.name}~{other.name}", geomname1=mine.name, geomname2=other.name)


def _all_geoms(body: mujoco.MjsBody) -> list[mujoco.MjsGeom]:
    found = list(body.geoms)
    for child in body.bodies:
        found += _all_geoms(child)
    return found


def standalone_xml(scene: Scene) -> str:
    """The scene as one MJCF without other files: meshes are written into it.

    Args:
        scene: the composed cell.

    Returns:
        XML that plain MuJoCo loads.
    """
    import trimesh

    spec = scene.spec.copy()
    for mesh in spec.meshes:
        if not mesh.file:
            continue
        solid = trimesh.load_mesh(mesh.file, process=False)
        mesh.uservert = np.asarray(solid.vertices, dtype=np.float64).ravel()
        mesh.userface = np.asarray(solid.faces, dtype=np.int32).ravel()
        mesh.file = ""
    return str(spec.to_xml())
