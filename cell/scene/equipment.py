"""The pieces of a cell, put into one MjSpec: surroundings, robot with its tool, positioner, part, fixtures.

    assembly = CellAssembly(surroundings(case), case)
    held = add_robot(assembly)
    held = add_positioner(assembly)
    add_part(assembly, shape); add_fixture(assembly, fixture)

Every piece keeps its own names where it can (``cell.mjcf.names``); which piece a shape belongs to is known by its body.
World frame, metres; ``cell.scene.compose`` compiles what comes of it.
"""

from __future__ import annotations

import difflib
import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from ik.chain import Floats
from slicing import Code, Warning

from ..case.cell_sections import NO_TABLE
from ..case.files import model_path
from ..case.sections import Case
from ..errors import InputError
from ..mjcf.asset_files import settle_files
from ..mjcf.fitted_shapes import settle_fits
from ..mjcf.held_joints import HeldJoints, check_planned, hold
from ..mjcf.held_settings import OwnPlaces
from ..mjcf.names import attach, name_all
from ..mjcf.torch import TorchDimensions, shape_torch
from ..units import METRES_PER_MM
from .calibration import calibrated
from .composition import BodyOwner, CellAssembly, one_line

UNUSED = ("unused/E1", "unused/E2")  # joints of axes that a positioner does not have
ROOT, PLATE = "fixed_table", "fixed_table_plate"  # bodies of a table without axes
DRIVEN = ("actuators", "sensors", "tendons", "equalities", "keys", "tuples", "texts", "skins")
VISUAL_SETTINGS = ("global_", "headlight", "map", "quality", "rgba", "scale")
SIZES = (
    "memory",
    "nkey",
    "nemax",
    "njmax",
    "nconmax",
    "nstack",
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


def _load(case: Case, name: str, what: str) -> mujoco.MjSpec:
    """A shipped model by name, or any MJCF by its path."""
    path = model_path(case, name)
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise InputError(f"{path}: is not an MJCF that MuJoCo can read: {one_line(error)}") from None
    _require_unscaled(spec, path)
    settle_files(spec, path)
    # bodies that are fused and shapes that are dropped would be missed where the model is compiled by itself: what is
    # known of a site or a shape is known in the frame of its own body. Masses do not matter here.
    spec.compiler.fusestatic = spec.compiler.discardvisual = False
    spec.compiler.settotalmass = -1.0
    return spec


def _require_unscaled(spec: mujoco.MjSpec, path: Path) -> None:
    """Refuse frames with a scale: what the cell puts into them, the torch or the part, would be scaled as well.

    Raises:
        InputError: a frame has one.
    """
    for frame in spec.frames:
        if not np.array_equal(frame.scale, np.ones(3)):
            factors = " ".join(f"{factor:g}" for factor in frame.scale)
            raise InputError(
                f"{path}: a frame {frame.name or 'without a name'} has scale {factors}, which is not supported; save "
                'the model with scaled numbers (savecompiled="true" of its compiler, and MuJoCo\'s compile)'
            )


def _prepared(assembly: CellAssembly, spec: mujoco.MjSpec, what: str) -> mujoco.MjSpec:
    """A model with all that is named and nothing that only a simulation needs."""
    gone = []
    pairs = list(spec.pairs) if what == "positioner" else []  # of the arm's pairs alone a motion is asked
    gone += [f"{len(pairs)} contact pair(s)"] if pairs else []
    gone += [f"{len(spec.flexes)} flex(es)"] if len(spec.flexes) else []
    if gone:
        text = (
            f"{what}.model: {' and '.join(gone)} left out of the cell: collisions that only they name are not checked"
        )
        assembly.warnings.append(Warning(Code.MODEL_ELEMENT_LEFT_OUT, text))
    for kind in (*DRIVEN, "flexes"):  # names in them would have to follow; kinematics and contacts need none
        for element in list(getattr(spec, kind)):
            spec.delete(element)
    _let_collide(spec)
    for pair in pairs:
        spec.delete(pair)
    _with_the_cells_options(spec, assembly.world)
    for body in spec.bodies:
        body.mocap = False  # what a user drags in a viewer stays where it is drawn
    for eye in (*spec.cameras, *spec.lights):
        if eye.targetbody:
            eye.targetbody, eye.mode = "", mujoco.mjtCamLight.mjCAMLIGHT_FIXED
    name_all(spec, what)
    settle_fits(spec, what)
    return spec


def _let_collide(spec: mujoco.MjSpec) -> None:
    """Let shapes that contact pairs name collide like any other: MuJoCo asks no contact bits of these.

    How far an axis carries something, and what moves with which link, is asked of shapes with contact bits alone.
    """
    named = {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}
    for geom in spec.geoms:
        if geom.name in named and not (geom.contype or geom.conaffinity):
            geom.contype = geom.conaffinity = 1


def _with_the_cells_options(spec: mujoco.MjSpec, world: mujoco.MjSpec) -> None:
    """Give a model the cell's options, looks and sizes: MuJoCo keeps the cell's, and says so of each that differs."""
    looks = ((getattr(spec.visual, name), getattr(world.visual, name)) for name in VISUAL_SETTINGS)
    for own, cells in ((spec.option, world.option), *looks):
        for name in (n for n in dir(cells) if not n.startswith("_")):
            value = getattr(cells, name)
            if not callable(value) and name != "authored":
                setattr(own, name, value)
    for name in SIZES:
        setattr(spec, name, getattr(world, name))


def _put(
    assembly: CellAssembly, child: mujoco.MjSpec, piece: BodyOwner, parent: mujoco.MjsBody, pos: Floats, quat: Floats
) -> None:
    """Attach a prepared model to a body.

    Shapes in its worldbody get a body of their own: in a body of another piece they would take part in what that one's
    excludes say.
    """
    what = piece.name.lower()
    own_origin = piece is BodyOwner.ROBOT and assembly.case.robot.base == "world"
    # the world of a model is its own: what it excludes from that says nothing of this cell's floor
    of_world = [e for e in child.excludes if "world" in (e.bodyname1, e.bodyname2)]
    holds = [(e.bodyname1, e.bodyname2) for e in of_world]
    for exclude in of_world:
        child.delete(exclude)
    world = assembly.world
    if len(child.worldbody.geoms) or own_origin:
        parent = parent.add_body(name=what, pos=pos, quat=quat)
        assembly.piece[what] = piece
        frame = parent.add_frame()
    else:
        frame, holds = parent.add_frame(pos=pos, quat=quat), []
    names = assembly.names[piece] = attach(world, child, f"{what}/", frame)
    names.bodies["world"] = parent.name
    assembly.piece.update(dict.fromkeys((n for own, n in names.bodies.items() if own != "world"), piece))
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


def quaternion_about(rotation_deg: tuple[float, float, float]) -> Floats:
    """A quaternion of turns about x, y and z."""
    quat = np.zeros(4)
    mujoco.mju_euler2Quat(quat, np.deg2rad(rotation_deg), "XYZ")
    return quat


def add_robot(assembly: CellAssembly) -> HeldJoints:
    """Attach the arm and its tool.

    Returns:
        The arm's home, and where the joints stand that are not planned.

    Raises:
        InputError: there is no such model, or its flange or the tool's dimensions are not as the case says.
    """
    case, world = assembly.case, assembly.world
    robot = _load(case, case.robot.model, "robot")
    held = hold(robot, case.robot.joints, _own_places(case, "robot"))
    check_planned(held, case.robot.joints, _own_places(case, "robot"))
    if robot.site(case.robot.flange) is None:
        raise InputError(f"{case.path}: robot.flange: {case.robot.model} has no site named {case.robot.flange!r}")
    _prepared(assembly, robot, "robot")
    pos, quat = _stands_at(robot, case.robot.flange, "robot")
    place = np.array(case.robot.position_mm) * METRES_PER_MM
    _put(assembly, robot, BodyOwner.ROBOT, world.worldbody, place, quaternion_about(case.robot.rotation_deg))
    assembly.held |= {assembly.name(BodyOwner.ROBOT, "bodies", name) for name in held.bodies}
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
    _own_numerics(tool, "tool")
    _prepared(assembly, tool, "tool")
    flange = world.site(assembly.name(BodyOwner.ROBOT, "sites", case.robot.flange))
    _put(assembly, tool, BodyOwner.TOOL, flange.parent, pos, quat)
    return replace(held, warnings=(*held.warnings, *held_by_tool.warnings))


def _own_numerics(spec: mujoco.MjSpec, what: str) -> None:
    """Set figures of a model apart from the arm's, whose speeds and accelerations they would be taken for."""
    for numeric in list(spec.numerics):
        numeric.name = f"{what}_{numeric.name}"


def _own_places(case: Case, section: str) -> OwnPlaces:
    given = getattr(case, section)
    return OwnPlaces(section, given.model, str(case.path), given.held_deg, given.held_mm)


def _dimension_problem(error: Exception) -> str:
    text = str(error)
    if isinstance(error, TypeError):
        known = list(TorchDimensions.__dataclass_fields__)
        match = re.search(r"'(\w+)'", text)
        wrong = match.group(1) if match else text
        near = difflib.get_close_matches(wrong, known, n=1, cutoff=0.5)
        return f"{wrong}: unknown key; " + (f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}")
    return text


def add_positioner(assembly: CellAssembly) -> HeldJoints:
    """Attach the positioner where the case puts it.

    Axes that it does not have are joints that nothing hangs on, so that every cell has two: :data:`UNUSED`. A table
    without any stands on a body of its own with both, so that it is checked against the floor and what stands on it.

    Returns:
        Where its joints stand that are not planned.

    Raises:
        InputError: there is no such model, or it has no site for the table.
    """
    case, world, given = assembly.case, assembly.world, assembly.case.positioner
    if given.model == NO_TABLE:
        positioner = mujoco.MjSpec()
        positioner.worldbody.add_site(name=given.table)
    else:
        positioner = _load(case, given.model, "positioner")
    held = hold(positioner, given.joints, _own_places(case, "positioner"))
    if positioner.site(given.table) is None:
        raise InputError(f"{case.path}: positioner.table: {given.model} has no site named {given.table!r}")
    check_planned(held, given.joints, _own_places(case, "positioner"))
    _own_numerics(positioner, "positioner")
    _prepared(assembly, positioner, "positioner")
    place, quat = np.array(given.position_mm) * METRES_PER_MM, quaternion_about(given.rotation_deg)
    place, quat = calibrated(assembly, positioner, place, quat)
    assembly.table = _stands_at(positioner, given.table, "positioner")
    root = world.worldbody
    if not given.joints:
        root = root.add_body(name=ROOT, pos=place, quat=quat)
        place, quat = np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
    assembly.piece[ROOT] = assembly.piece[PLATE] = BodyOwner.POSITIONER
    _put(assembly, positioner, BodyOwner.POSITIONER, root, place, quat)
    assembly.held |= {assembly.name(BodyOwner.POSITIONER, "bodies", name) for name in held.bodies}
    if not given.joints:
        pos, quat = assembly.table
        plate = world.site(assembly.name(BodyOwner.POSITIONER, "sites", given.table)).parent
        plate = plate.add_body(name=PLATE, pos=pos, quat=quat)
        _still(plate, UNUSED, world.default)
        assembly.table = (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
        held = replace(held, warnings=(*held.warnings, *_without_shape(case)))
    elif len(given.joints) == 1:
        _still(world.worldbody.add_body(name="unused"), UNUSED, world.default)
    return held


def _still(body: mujoco.MjsBody, joints: tuple[str, ...], plain: mujoco.MjsDefault) -> None:
    """Give a body joints that nothing ever moves, of the cell's own defaults."""
    for name, axis in zip(joints, ((1, 0, 0), (0, 0, 1)), strict=True):
        body.add_joint(default=plain, name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
    # MuJoCo wants mass and inertia of what moves, and writes them where their place is given as well
    body.explicitinertial, body.mass, body.inertia = True, 1.0, (1.0, 1.0, 1.0)
    body.ipos, body.iquat = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)


def _without_shape(case: Case) -> tuple[Warning, ...]:
    if case.positioner.model != NO_TABLE:
        return ()
    return (
        Warning(
            Code.TABLE_WITHOUT_SHAPE,
            "positioner: none: the cell has no table; add what carries the part to fixtures, or give a model with "
            "joints: []",
        ),
    )


def leave_out_table(assembly: CellAssembly) -> None:
    """Leave out pairs of a fixed table and what stands on it: as on one that turns, it touches it by design."""
    world = assembly.world
    if assembly.case.positioner.joints:
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
