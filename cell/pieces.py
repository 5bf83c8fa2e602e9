"""The pieces of a cell, put into one MjSpec: surroundings, robot with its tool, positioner, part, fixtures.

    pieces = Pieces(surroundings(case), case)
    held = add_robot(pieces)
    held = add_positioner(pieces)
    add_part(pieces, shape); add_fixture(pieces, fixture)

Every piece keeps its own names where it can (``cell.names``); which piece a shape belongs to is known by its body.
World frame, metres; ``cell.scene`` compiles what comes of it.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from ik.chain import Floats
from slicing.warning import Code, Warning

from .composition import Piece, Pieces, one_line
from .config import MODELS_DIR, is_path
from .contacts import SOLID, WIRE
from .convex_pieces import ConvexPieces, convex_pieces
from .deposit import PartShape
from .errors import InputError
from .held_joints import Held, OwnPlaces, check_planned, hold
from .names import attach, name_all
from .place import METRES_PER_MM
from .sections import NO_TABLE, Case, Fixture
from .torch import TorchDimensions, shape_torch

UNUSED = ("unused/E1", "unused/E2")  # joints of axes that a positioner does not have
ROOT, PLATE = "fixed_table", "fixed_table_plate"  # bodies of a table without axes
MANY_PIECES = 256  # of the part in one body
UNIT = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 25.4e-3}
DRIVEN = ("actuators", "sensors", "tendons", "equalities", "keys", "tuples", "texts", "skins")
SIZES = (
    "memory",
    "nuserdata",
    "nuser_actuator",
    "nuser_body",
    "nuser_cam",
    "nuser_geom",
    "nuser_jnt",
    "nuser_sensor",
    "nuser_site",
    "nuser_tendon",
)
MASSLESS = 1e-9  # kg, kg m2: what MuJoCo takes a moving body without mass for; kinematics needs none
FILLED = 0.01  # of a fixture's volume that its convex pieces may hold besides it without a word
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
    for hfield in spec.hfields:
        if hfield.file:
            hfield.file = str((path.parent / spec.meshdir / hfield.file).resolve())
    for texture in spec.textures:
        if texture.file:
            texture.file = str((path.parent / spec.texturedir / texture.file).resolve())
    return spec


def _prepared(pieces: Pieces, spec: mujoco.MjSpec, what: str) -> mujoco.MjSpec:
    """A model with all that is named and nothing that only a simulation needs."""
    gone = [f"{len(spec.equalities)} equality constraint(s)"] if len(spec.equalities) else []
    pairs = list(spec.pairs) if what == "positioner" else []  # of the arm's pairs alone a motion is asked
    gone += [f"{len(pairs)} contact pair(s)"] if pairs else []
    gone += [f"{len(spec.flexes)} flex(es)"] if len(spec.flexes) else []
    if gone:
        text = (
            f"{what}.model: {' and '.join(gone)} left out of the cell: what they couple stays where it is, "
            "and what they hold or name is not looked at"
        )
        pieces.warnings.append(Warning(Code.MODEL_ELEMENT_LEFT_OUT, text))
    for kind in (*DRIVEN, "flexes"):  # names in them would have to follow; kinematics and contacts need none
        for element in list(getattr(spec, kind)):
            spec.delete(element)
    for pair in pairs:
        spec.delete(pair)
    _with_the_cells_options(spec, pieces.world)
    for eye in (*spec.cameras, *spec.lights):
        if eye.targetbody:
            eye.targetbody, eye.mode = "", mujoco.mjtCamLight.mjCAMLIGHT_FIXED
    name_all(spec, what)
    return spec


def _with_the_cells_options(spec: mujoco.MjSpec, world: mujoco.MjSpec) -> None:
    """Give a model the cell's options and sizes: MuJoCo keeps the cell's, and says so of each that differs."""
    for name in (n for n in dir(spec.option) if not n.startswith("_")):
        value = getattr(world.option, name)
        if not callable(value) and name != "authored":
            setattr(spec.option, name, value)
    for name in SIZES:
        setattr(spec, name, getattr(world, name))


def _put(pieces: Pieces, child: mujoco.MjSpec, piece: Piece, parent: mujoco.MjsBody, pos: Floats, quat: Floats) -> None:
    """Attach a prepared model to a body.

    Shapes in its worldbody get a body of their own: in a body of another piece they would take part in what that one's
    excludes say.
    """
    what = piece.name.lower()
    holds = [(e.bodyname1, e.bodyname2) for e in child.excludes if "world" in (e.bodyname1, e.bodyname2)]
    world = pieces.world
    if len(child.worldbody.geoms):
        parent = parent.add_body(name=what, pos=pos, quat=quat)
        pieces.piece[what] = piece
        frame = parent.add_frame()
    else:
        frame, holds = parent.add_frame(pos=pos, quat=quat), []
    names = pieces.names[piece] = attach(world, child, f"{what}/", frame)
    names.bodies["world"] = parent.name
    pieces.piece.update(dict.fromkeys((n for own, n in names.bodies.items() if own != "world"), piece))
    for pair in holds:
        one, two = (names.bodies[name] for name in pair)
        world.add_exclude(bodyname1=one, bodyname2=two)


def _stands_at(spec: mujoco.MjSpec, site: str, what: str) -> tuple[Floats, Floats]:
    """Position and quaternion of a site in its body, whatever frames and angles the MJCF gives it by.

    Raises:
        InputError: the model does not compile.
    """
    try:
        model = spec.copy().compile()
    except ValueError as error:
        raise InputError(f"{what}.model: does not compile: {one_line(error)}") from None
    found = model.site(site).id
    return model.site_pos[found].copy(), model.site_quat[found].copy()


def _quat(rotation_deg: tuple[float, float, float]) -> Floats:
    quat = np.zeros(4)
    mujoco.mju_euler2Quat(quat, np.deg2rad(rotation_deg), "XYZ")
    return quat


def surroundings(case: Case) -> mujoco.MjSpec:
    """An empty world: light, sky, and the floor if the case has one; no gravity."""
    world = mujoco.MjSpec()
    world.modelname = "cell"
    world.compiler.degree = False
    world.compiler.boundmass = world.compiler.boundinertia = MASSLESS
    world.compiler.balanceinertia = True
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


def add_robot(pieces: Pieces) -> Held:
    """Attach the arm and its tool.

    Returns:
        The arm's home, and where the joints stand that are not planned.

    Raises:
        InputError: there is no such model, or its flange or the tool's dimensions are not as the case says.
    """
    case, world = pieces.case, pieces.world
    robot = _load(case, case.robot.model, "robot")
    held = hold(robot, case.robot.joints, _own_places(case, "robot"))
    check_planned(held, case.robot.joints, _own_places(case, "robot"))
    if robot.site(case.robot.flange) is None:
        raise InputError(f"{case.path}: robot.flange: {case.robot.model} has no site named {case.robot.flange!r}")
    _prepared(pieces, robot, "robot")
    pos, quat = _stands_at(robot, case.robot.flange, "robot")
    place = np.array(case.robot.position_mm) * METRES_PER_MM
    _put(pieces, robot, Piece.ROBOT, world.worldbody, place, _quat(case.robot.rotation_deg))
    tool = _load(case, case.tool.model, "tool")
    held_by_tool = hold(tool, (), _own_places(case, "tool"))
    if case.tool.dimensions or case.tool.model == "cmt_torch":
        try:
            shape_torch(tool, TorchDimensions(**case.tool.dimensions))
        except (TypeError, ValueError) as error:
            raise InputError(f"{case.path}: tool.dimensions: {_dimension_problem(error)}") from None
    for wire in case.tool.wire:
        if tool.geom(wire) is None:
            raise InputError(f"{case.path}: tool.wire: {case.tool.model} has no geom named {wire!r}")
    _prepared(pieces, tool, "tool")
    flange = world.site(pieces.name(Piece.ROBOT, "sites", case.robot.flange))
    _put(pieces, tool, Piece.TOOL, flange.parent, pos, quat)
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


def add_positioner(pieces: Pieces) -> Held:
    """Attach the positioner where the case puts it.

    Axes that it does not have are joints that nothing hangs on, so that every cell has two: :data:`UNUSED`. A table
    without any stands on a body of its own with both, so that it is held against the floor and what stands on it.

    Returns:
        Where its joints stand that are not planned.

    Raises:
        InputError: there is no such model, or it has no site for the table.
    """
    case, world, told = pieces.case, pieces.world, pieces.case.positioner
    if told.model == NO_TABLE:
        positioner = mujoco.MjSpec()
        positioner.worldbody.add_site(name=told.table)
    else:
        positioner = _load(case, told.model, "positioner")
    held = hold(positioner, told.joints, _own_places(case, "positioner"))
    if positioner.site(told.table) is None:
        raise InputError(f"{case.path}: positioner.table: {told.model} has no site named {told.table!r}")
    check_planned(held, told.joints, _own_places(case, "positioner"))
    for numeric in list(positioner.numerics):
        numeric.name = f"positioner_{numeric.name}"
    _prepared(pieces, positioner, "positioner")
    pieces.table = _stands_at(positioner, told.table, "positioner")
    root, place, quat = world.worldbody, np.array(told.position_mm) * METRES_PER_MM, _quat(told.rotation_deg)
    if not told.joints:
        root = root.add_body(name=ROOT, pos=place, quat=quat)
        place, quat = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    pieces.piece[ROOT] = pieces.piece[PLATE] = Piece.POSITIONER
    _put(pieces, positioner, Piece.POSITIONER, root, place, quat)
    if not told.joints:
        pos, quat = pieces.table
        plate = world.site(pieces.name(Piece.POSITIONER, "sites", told.table)).parent
        plate = plate.add_body(name=PLATE, pos=pos, quat=quat)
        _still(plate, UNUSED)
        pieces.table = (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
        held = replace(held, warnings=(*held.warnings, *_without_shape(case)))
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


def _without_shape(case: Case) -> tuple[Warning, ...]:
    if case.positioner.model != NO_TABLE:
        return ()
    return (
        Warning(
            Code.TABLE_WITHOUT_SHAPE,
            "positioner: none: nothing of a table is in the cell; what carries the part is to be among the fixtures, "
            "or a model with joints: []",
        ),
    )


def leave_out_table(pieces: Pieces) -> None:
    """Leave out pairs of a fixed table and what stands on it: as on one that turns, it touches it by design."""
    world = pieces.world
    if pieces.case.positioner.joints:
        return
    below: list[str] = []
    for k, body in enumerate([world.body(ROOT), *world.body(ROOT).find_all("body")]):
        if not body.name:
            body.name = f"{ROOT} {k}"
        below.append(body.name)
    on = [PLATE, *(body.name for body in world.body(PLATE).find_all("body"))]
    for one in sorted(set(below) - set(on)):
        for other in on:
            world.add_exclude(bodyname1=one, bodyname2=other)


def _table_body(pieces: Pieces) -> mujoco.MjsBody:
    """The body that holds the table's site; of a fixed table its plate."""
    told = pieces.case.positioner
    if not told.joints:
        return pieces.world.body(PLATE)
    return pieces.world.site(pieces.name(Piece.POSITIONER, "sites", told.table)).parent


def add_part(pieces: Pieces, part: PartShape) -> None:
    """Put support and part onto the positioner's table, with a site ``part`` at the part's frame."""
    case, world = pieces.case, pieces.world
    pos, quat = pieces.table
    lift = 0.0
    fixed = _table_body(pieces).add_body(name="workpiece", pos=pos, quat=quat)
    pieces.piece["workpiece"] = Piece.SUPPORT
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
    pieces.piece["part"] = Piece.PART
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
            pieces.piece[holder.name] = Piece.PART
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


def add_fixture(pieces: Pieces, fixture: Fixture) -> None:
    """Put a fixture onto the floor or the table.

    Raises:
        InputError: its mesh is missing, or its name is another's.
    """
    case, world = pieces.case, pieces.world
    if not fixture.name.strip() or not fixture.name.isprintable():
        raise InputError(f"{case.path}: fixtures: {fixture.name!r} is no name: one line of printable characters is")
    if "/" in fixture.name or world.geom(fixture.name) or world.body(f"fixture/{fixture.name}"):
        raise InputError(f"{case.path}: fixtures: the name {fixture.name!r} is taken, or holds a /; choose another")
    parent, name = world.worldbody, f"fixture/{fixture.name}"
    if fixture.on == "table":
        pos, quat = pieces.table
        parent = _table_body(pieces).add_body(name=f"{name}/frame", pos=pos, quat=quat)
        pieces.on_table.add(name)
    body = parent.add_body(
        name=name,
        pos=np.array(fixture.position_mm) * METRES_PER_MM,
        quat=_quat(fixture.rotation_deg),
    )
    pieces.piece[name] = Piece.FIXTURE
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
        for solid in _solids(pieces, fixture, shape):
            body.add_geom(**{**options, **solid})
    if fixture.mesh is None:
        body.add_geom(**shape, **options)
    look = {**options, "name": f"{name}/visual", "group": 2, "contype": 0, "conaffinity": 0}
    body.add_geom(**shape, **look)


def _fixture_mesh(world: mujoco.MjSpec, case: Case, fixture: Fixture) -> str:
    """Add a fixture's mesh; its name.

    Raises:
        InputError: there is no such file.
    """
    path = Path(case.path_of(str(fixture.mesh)))
    if not path.is_file():
        raise InputError(f"{case.path}: fixtures.{fixture.name}.mesh: {path}: no such file")
    name = f"fixture/{fixture.name}/mesh"
    world.add_mesh(name=name, file=str(path.resolve()), scale=[UNIT[fixture.units]] * 3)
    return name


def _solids(pieces: Pieces, fixture: Fixture, shape: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """What collides of a fixture's mesh, as options of geoms: itself where it is convex, else convex pieces."""
    case, world = pieces.case, pieces.world
    path = Path(case.path_of(str(fixture.mesh))).resolve()
    changed = path.stat()
    try:
        found = _cut_up(str(path), UNIT[fixture.units], changed.st_mtime_ns, changed.st_size)
    except ValueError as error:
        raise InputError(f"{case.path}: fixtures.{fixture.name}.mesh: {one_line(error)}") from None
    if found.excess > FILLED:
        more = "its convex hull counts, since it is not closed"
        if np.isfinite(found.excess):
            more = f"it counts with {100 * found.excess:.0f} % more than its volume, which fills some of its hollows"
        text = f"fixtures.{fixture.name}.mesh: {more}; several fixtures of simple shapes would be exact"
        pieces.warnings.append(Warning(Code.CONCAVE_FIXTURE, text))
    if len(found.pieces) == 1:
        yield {**shape, "name": fixture.name}
        return
    for number, vertices in enumerate(found.pieces, start=1):
        name = f"fixture/{fixture.name}/{number}"
        world.add_mesh(name=name, uservert=vertices.ravel())
        yield {**shape, "meshname": name, "name": name}


@lru_cache(maxsize=32)
def _cut_up(path: str, scale: float, *_changed: int) -> ConvexPieces:
    """A mesh file as convex pieces, m, as MuJoCo reads it.

    Raises:
        ValueError: MuJoCo does not read it.
    """
    import trimesh

    spec = mujoco.MjSpec()
    spec.add_mesh(name="mesh", file=path, scale=[scale] * 3)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="mesh")
    model = spec.compile()
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, model.mesh_quat[0])
    vertices = model.mesh_vert.astype(np.float64) @ turn.reshape(3, 3).T + model.mesh_pos[0]
    return convex_pieces(trimesh.Trimesh(vertices, model.mesh_face, process=False))
