"""The pieces of a cell, put into one MjSpec: surroundings, robot with its tool, positioner, part, fixtures.

    world = surroundings(case)
    held = add_robot(world, case)
    held = add_positioner(world, case); add_part(world, case, shape); add_fixture(world, case, fixture)

Every piece keeps its own names. World frame, metres; ``cell.scene`` compiles what comes of it.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from ik.chain import Floats
from slicing.warning import Code, Warning

from .config import MODELS_DIR, is_path
from .contacts import SOLID, WIRE
from .deposit import PartShape
from .errors import InputError
from .held_joints import Held, OwnPlaces, check_planned, hold, resolved
from .place import METRES_PER_MM
from .sections import NO_TABLE, Case, Fixture
from .torch import TorchDimensions, shape_torch

ROBOT, TOOL, POSITIONER = "robot/", "tool/", "positioner/"
UNUSED = ("unused/E1", "unused/E2")  # joints of axes that a positioner does not have
ROOT, PLATE = "fixed_table", "fixed_table_plate"  # bodies of a table without axes
MANY_PIECES = 256  # of the part in one body
UNIT = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 25.4e-3}
COLOUR = {
    "support": (0.42, 0.44, 0.47, 1.0),
    "body": (0.62, 0.65, 0.69, 1.0),
    "part": (0.36, 0.62, 0.86, 1.0),
    "deposit": (0.36, 0.62, 0.86, 0.35),
    "fixture": (0.55, 0.50, 0.40, 1.0),
}


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
        raise InputError(f"{path}: not an MJCF that MuJoCo reads: {one_line(error)}") from None
    for mesh in spec.meshes:
        if mesh.file:  # found wherever the scene is compiled
            mesh.file = str((path.parent / spec.meshdir / mesh.file).resolve())
    return spec


def one_line(error: Exception) -> str:
    """MuJoCo's messages, which span several lines, in one."""
    return " ".join(str(error).split())


def _drop_keys(spec: mujoco.MjSpec) -> None:
    # keyframes of several models would clash, and none of them covers the whole cell
    for key in list(spec.keys):
        spec.delete(key)


def _quat(rotation_deg: tuple[float, float, float]) -> Floats:
    quat = np.zeros(4)
    mujoco.mju_euler2Quat(quat, np.deg2rad(rotation_deg), "XYZ")
    return quat


def surroundings(case: Case) -> mujoco.MjSpec:
    """An empty world: light, sky, and the floor if the case has one; no gravity."""
    world = mujoco.MjSpec()
    world.modelname = "cell"
    world.compiler.degree = False
    world.option.gravity = (0, 0, 0)  # kinematics and contacts alone: nothing is to fall
    world.stat.extent, world.stat.center = 3.4, (1.0, -0.1, 0.6)  # the same depth range whatever stands in the cell
    world.visual.headlight.ambient = (0.28, 0.28, 0.28)
    world.visual.headlight.diffuse = (0.30, 0.30, 0.30)
    world.visual.headlight.specular = (0.05, 0.05, 0.05)
    world.visual.map.znear = 0.005
    world.visual.quality.shadowsize = 8192
    world.visual.global_.offwidth, world.visual.global_.offheight = 2560, 1600
    world.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.97, 0.98, 0.99),
        rgb2=(0.80, 0.83, 0.86),
        width=256,
        height=1536,
    )
    world.add_texture(
        name="floor",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        mark=mujoco.mjtMark.mjMARK_EDGE,
        rgb1=(0.74, 0.75, 0.77),
        rgb2=(0.71, 0.72, 0.74),
        markrgb=(0.64, 0.65, 0.67),
        width=512,
        height=512,
    )
    textures = [""] * int(mujoco.mjtTextureRole.mjNTEXROLE)
    textures[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = "floor"
    dull = {"reflectance": 0.0, "specular": 0.0, "shininess": 0.0}
    world.add_material(name="floor", textures=textures, texrepeat=(1, 1), texuniform=True, **dull)
    body = world.worldbody
    sun = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
    body.add_light(
        type=sun,
        pos=(0.5, -1.4, 4.5),
        dir=(0.1, 0.25, -0.96),
        diffuse=(0.5,) * 3,
        specular=(0.15,) * 3,
        castshadow=True,
    )
    body.add_light(
        type=sun,
        pos=(-2, 3, 4),
        dir=(0.45, -0.6, -0.65),
        diffuse=(0.22, 0.23, 0.25),
        specular=(0,) * 3,
        castshadow=False,
    )
    if case.floor:
        body.add_geom(
            name="floor",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=(20, 20, 0.1),
            material="floor",
            contype=SOLID,
            conaffinity=SOLID | WIRE,
        )
    return world


def add_robot(world: mujoco.MjSpec, case: Case) -> Held:
    """Attach the arm and its tool.

    Returns:
        The arm's home, and where the joints stand that are not planned.

    Raises:
        InputError: there is no such model, or its flange or the tool's dimensions are not as the case says.
    """
    robot = _load(case, case.robot.model, "robot")
    held = hold(robot, case.robot.joints, _own_places(case, "robot"))
    _drop_keys(robot)
    flange = robot.site(case.robot.flange)
    if flange is None:
        raise InputError(f"{case.path}: robot.flange: {case.robot.model} has no site named {case.robot.flange!r}")
    tool = _load(case, case.tool.model, "tool")
    held_by_tool = hold(tool, (), _own_places(case, "tool"))
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
    check_planned(held, case.robot.joints, _own_places(case, "robot"))
    return replace(held, warnings=(*held.warnings, *held_by_tool.warnings))


def _own_places(case: Case, section: str) -> OwnPlaces:
    told = getattr(case, section)
    return OwnPlaces(section, told.model, str(case.path), told.held_deg, told.held_mm)


def _dimension_problem(error: Exception) -> str:
    text = str(error)
    if isinstance(error, TypeError):
        known = list(TorchDimensions.__dataclass_fields__)
        match = re.search(r"'(\w+)'", text)
        wrong = match.group(1) if match else text
        near = difflib.get_close_matches(wrong, known, n=1, cutoff=0.5)
        return f"{wrong}: unknown key; " + (f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}")
    return text


def add_positioner(world: mujoco.MjSpec, case: Case) -> Held:
    """Attach the positioner where the case puts it.

    Axes that it does not have are joints that nothing hangs on, so that every cell has two: :data:`UNUSED`. A table
    without any stands on a body of its own with both, so that it is held against the floor and what stands on it.

    Returns:
        Where its joints stand that are not planned.

    Raises:
        InputError: there is no such model, or it has no site for the table.
    """
    told = case.positioner
    if told.model == NO_TABLE:
        positioner = mujoco.MjSpec()
        positioner.worldbody.add_site(name=told.table)
    else:
        positioner = _load(case, told.model, "positioner")
    held = hold(positioner, told.joints, _own_places(case, "positioner"))
    _drop_keys(positioner)
    for numeric in list(positioner.numerics):
        numeric.name = f"positioner_{numeric.name}"
    site = positioner.site(told.table)
    if site is not None:
        quat = resolved(positioner, site)
        site.alt.type, site.quat = mujoco.mjtOrientation.mjORIENTATION_QUAT, quat
    root = world.worldbody if told.joints else world.worldbody.add_body(name=ROOT)
    frame = root.add_frame(pos=np.array(told.position_mm) * METRES_PER_MM, quat=_quat(told.rotation_deg))
    world.attach(positioner, frame=frame, prefix=POSITIONER)
    _own_names(world, POSITIONER)
    if site is None:
        raise InputError(f"{case.path}: positioner.table: {told.model} has no site named {told.table!r}")
    check_planned(held, told.joints, _own_places(case, "positioner"))
    if not told.joints:
        site = world.site(told.table)
        plate = site.parent.add_body(name=PLATE, pos=site.pos, quat=site.quat)
        plate.set_frame(site.frame) if site.frame is not None else None
        _still(plate, UNUSED)
        held = replace(held, warnings=(*held.warnings, *_without_shape(case, positioner)))
    elif len(told.joints) == 1:
        _still(world.worldbody.add_body(name="unused"), UNUSED)
    return held


def _still(body: mujoco.MjsBody, joints: tuple[str, ...]) -> None:
    """Give a body joints that nothing ever moves."""
    for name, axis in zip(joints, ((1, 0, 0), (0, 0, 1)), strict=True):
        body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
    # MuJoCo wants mass and inertia of what moves, and writes them where their place is given as well
    body.explicitinertial, body.mass, body.inertia = True, 1.0, (1.0, 1.0, 1.0)
    body.ipos, body.iquat = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)


def _without_shape(case: Case, positioner: mujoco.MjSpec) -> tuple[Warning, ...]:
    if case.positioner.model != NO_TABLE:
        return ()
    return (
        Warning(
            Code.TABLE_WITHOUT_SHAPE,
            "positioner: none: nothing of a table is in the cell; what carries the part is to be among the fixtures, "
            "or a model with joints: []",
        ),
    )


def leave_out_table(world: mujoco.MjSpec, case: Case) -> None:
    """Leave out pairs of a fixed table and what stands on it: as on one that turns, it touches it by design."""
    if case.positioner.joints:
        return
    below: list[str] = []
    for k, body in enumerate([world.body(ROOT), *world.body(ROOT).find_all("body")]):
        if not body.name:
            body.name = f"{ROOT} {k}"
        below.append(body.name)
    on = [PLATE, *(body.name for body in world.body(PLATE).find_all("body"))]
    for one in set(below) - set(on):
        for other in on:
            world.add_exclude(bodyname1=one, bodyname2=other)


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
        name = element.name.removeprefix(prefix)
        try:
            element.name = name
        except ValueError:
            owner = prefix.rstrip("/")
            raise InputError(f"{owner}.model: its name {name!r} is another's in this cell already") from None
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


def _on_table(world: mujoco.MjSpec, case: Case, name: str) -> mujoco.MjsBody:
    """A new body in the table's frame."""
    if not case.positioner.joints:
        return world.body(PLATE).add_body(name=name)
    table = world.site(case.positioner.table)
    body = table.parent.add_body(name=name, pos=table.pos, quat=table.quat)
    if table.frame is not None:
        body.set_frame(table.frame)
    return body


def add_part(world: mujoco.MjSpec, case: Case, part: PartShape) -> None:
    """Put support and part onto the positioner's table, with a site ``part`` at the part's frame."""
    lift = 0.0
    fixed = _on_table(world, case, "workpiece")
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
    several = len(part.hulls) > MANY_PIECES
    holder = body
    for i, (name, vertices) in enumerate(part.hulls.items()):
        if several and i % MANY_PIECES == 0:
            # MuJoCo goes through every geom of a body that may be hit: what lies far off is left out body by body
            holder = body.add_body(name=f"pieces_{i // MANY_PIECES}")
        world.add_mesh(name=name, uservert=(vertices * METRES_PER_MM).ravel())
        holder.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            rgba=COLOUR["deposit" if name.startswith("deposit/") else "body"],
            group=3,
            contype=SOLID,
            conaffinity=SOLID,
        )


def add_fixture(world: mujoco.MjSpec, case: Case, fixture: Fixture) -> None:
    """Put a fixture onto the floor or the table.

    Raises:
        InputError: its mesh is missing.
    """
    if "/" in fixture.name or world.geom(fixture.name) is not None:
        raise InputError(f"{case.path}: fixtures: the name {fixture.name!r} is taken, or holds a /; choose another")
    parent = _on_table(world, case, f"fixture_{fixture.name}_frame") if fixture.on == "table" else world.worldbody
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
