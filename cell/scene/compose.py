"""The cell as one MuJoCo model, composed from a case: robot, tool, positioner, support, part, fixtures.

    scene = compose(case, part)               # part: slicing.deposits.part_shape.PartShape
    scene.model, scene.chain                  # MuJoCo's model, the arm as arrays
    scene.T_base_part(E1, E2)                 # rad; where the part is, seen from the arm

``cell.scene.standalone`` writes it as one MJCF that plain MuJoCo loads.
What the model is compiled from takes two to three times the memory of the model, and is not kept. Every model keeps its
own names where it can, so that a user can swap any of them and bind other names in the case file;
what a shape belongs to is known by its number, never by its name. World frame: z up, metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Chain, Floats
from slicing import Code, PartShape, Warning

from ..case.files import require_cell_files
from ..case.sections import Case
from ..errors import InputError
from ..freed_memory import give_back
from ..mjcf.chain_from_model import chain_of, check_base, check_count, check_names
from ..mjcf.detection import lean_cylinders, make_detectable
from ..mjcf.finite_numbers import require_finite
from ..mjcf.held_joints import HeldJoints
from ..mjcf.model_names import require
from ..mjcf.wire_end import check_wire_end
from ..progress import phase
from .absent_shapes import links_without_shapes, tiny_links, wire_warnings
from .composition import BodyOwner, CellAssembly, one_line
from .contacts import lost_on_table, pair_tool_with_arm, set_contact_bits
from .equipment import add_positioner, add_robot, leave_out_table
from .part_contact import part_contact_warnings, sunk
from .scene import Scene
from .table_axes import table_axes
from .workpiece import MANY_PIECES, add_fixture, add_part
from .world import surroundings

MANY_VERTICES = 50_000  # of meshes, from which what was needed to compile them is worth giving back


@phase("composing the cell")
def compose(case: Case, part: PartShape, together: int = MANY_PIECES) -> Scene:
    """Build the cell.

    Args:
        case: the case.
        part: shapes of the part, part frame, mm.
        together: shapes of the part in one body of the model.

    Returns:
        The compiled scene.

    Raises:
        InputError: a model file is missing or does not compile, or a name the case binds is not in it.
    """
    require_cell_files(case)
    scene = _compiled(put_together(case, part, together), part)
    if scene.model.nmeshvert > MANY_VERTICES:
        give_back()
    return scene


def _compiled(cell: Uncompiled, part: PartShape) -> Scene:
    """The cell's model, and what all in it is.

    Raises:
        InputError: it does not compile, or a name the case binds is not in it.
    """
    pieces, case = cell.pieces, cell.pieces.case
    try:
        model = pieces.world.compile()
    except ValueError as error:
        raise InputError(f"{case.path}: the scene does not compile: {one_line(error)}") from None
    require_finite(model, str(case.path))
    lean_cylinders(model)
    scene = _bind(pieces, model, part, cell.arm.home)
    told = (*cell.arm.warnings, *cell.table.warnings, *_without_home(case, scene, cell.arm))
    return replace(scene, warnings=(*scene.warnings, *told, *part_contact_warnings(scene, part), *sunk(scene)))


@dataclass(frozen=True, eq=False)
class Uncompiled:
    """A cell that is put together and not compiled yet.

    Attributes:
        pieces: the cell, and what belongs to what.
        arm: what was made of the robot.
        table: what was made of the positioner.
    """

    pieces: CellAssembly
    arm: HeldJoints
    table: HeldJoints


def put_together(case: Case, part: PartShape, together: int = MANY_PIECES) -> Uncompiled:
    """Put the cell together, as of :func:`compose`.

    Raises:
        InputError: a model file is missing or cannot be used, or a name the case binds is not in it.
    """
    pieces = CellAssembly(surroundings(case), case)
    check_names(case.robot.joints)
    arm = add_robot(pieces)
    check_count(case.robot.joints)
    pair_tool_with_arm(pieces)
    table = add_positioner(pieces)
    add_part(pieces, part, together)
    for fixture in case.fixtures:
        add_fixture(pieces, fixture)
    leave_out_table(pieces)
    set_contact_bits(pieces)
    make_detectable(pieces.world, case)
    return Uncompiled(pieces, arm, table)


def _bind(pieces: CellAssembly, model: mujoco.MjModel, part: PartShape, home: dict[str, float]) -> Scene:
    case = pieces.case
    robot = [pieces.name(BodyOwner.ROBOT, "joints", name) for name in case.robot.joints]
    table = [pieces.name(BodyOwner.POSITIONER, "joints", name) for name in case.positioner.joints]
    arm_joints = [require(model, "joint", name, "robot.joints") for name in robot]
    sites = _sites(pieces, model)
    table_joints, has_axis = table_axes(model, table, sites["table"], case)
    wire_geom = np.array([model.geom(g).name in pieces.wires for g in range(model.ngeom)])
    wire_end = check_wire_end(model, sites["tcp"], wire_geom, case)
    tool_root = int(model.jnt_bodyid[arm_joints[0]])
    arm_geom = np.array([_descends(model, int(b), tool_root) for b in model.geom_bodyid], dtype=bool)
    last = [b for b in range(model.nbody) if _descends(model, b, int(model.jnt_bodyid[arm_joints[-1]]))]
    base = pieces.name(BodyOwner.ROBOT, "bodies", case.robot.base)
    chain = chain_of(model, robot, model.site(sites["tcp"]).name, base, _speeds(model, case))
    chain = replace(chain, names=tuple(case.robot.joints))
    check_base(model, base, [*arm_joints, *table_joints])
    there = [joint for joint, has in zip(table_joints, has_axis, strict=True) if has]
    rest = _rest(case, chain, home)
    body_piece = np.array([pieces.piece.get(model.body(b).name, BodyOwner.SURROUNDINGS) for b in range(model.nbody)])
    on_table = np.array([model.body(b).name in pieces.on_table for b in range(model.nbody)])
    piece = body_piece[model.geom_bodyid].astype(np.int64)
    deposits = np.full(model.ngeom, -1, dtype=np.int64)
    for geom in np.flatnonzero(piece == BodyOwner.PART):
        kind, *number = model.geom(geom).name.split("/")
        deposits[geom] = int(number[0]) if kind == "deposit" else -1
    return Scene(
        case=case,
        model=model,
        part=part,
        chain=chain,
        arm_qpos=model.jnt_qposadr[arm_joints].astype(np.int64),
        table_qpos=model.jnt_qposadr[table_joints].astype(np.int64),
        table_range=_table_range(model, table_joints, has_axis),
        has_axis=has_axis,
        home=np.clip(np.zeros(chain.n), chain.lower, chain.upper) if rest is None else rest,
        has_home=rest is not None,
        deposit_of_geom=deposits,
        n_deposits=part.n_deposits,
        contact_bits=np.array([model.geom_contype, model.geom_conaffinity]),
        body_contype=model.body_contype.copy(),
        body_conaffinity=model.body_conaffinity.copy(),
        arm_geom=arm_geom,
        tool_geom=arm_geom & np.isin(model.geom_bodyid, last),
        piece_of_geom=piece,
        wire_geom=wire_geom,
        put_on_table=np.isin(piece, (BodyOwner.SUPPORT, BodyOwner.PART)) | on_table[model.geom_bodyid],
        arm_joints=np.array(arm_joints, dtype=np.int64),
        table_joints=np.array(table_joints, dtype=np.int64),
        base_body=require(model, "body", base, "robot.base"),
        sites=sites,
        lost_on_table=lost_on_table(pieces, model, table_joints),
        warnings=(
            *pieces.warnings,
            *links_without_shapes(model, arm_joints, there, piece),
            *tiny_links(model, arm_joints, piece),
            *wire_warnings(model, wire_geom),
            *wire_end,
        ),
    )


def _sites(pieces: CellAssembly, model: mujoco.MjModel) -> dict[str, int]:
    """Ids of the sites that the case binds, and of the part's."""
    case = pieces.case
    tcp = "tool.tcp (the wire's end, z along the wire)"
    return {
        "flange": require(model, "site", pieces.name(BodyOwner.ROBOT, "sites", case.robot.flange), "robot.flange"),
        "tcp": require(model, "site", pieces.name(BodyOwner.TOOL, "sites", case.tool.tcp), tcp),
        "table": require(
            model, "site", pieces.name(BodyOwner.POSITIONER, "sites", case.positioner.table), "positioner"
        ),
        "part": model.site("part").id,
    }


def _rest(case: Case, chain: Chain, home: dict[str, float]) -> Floats | None:
    """The arm's home, from the case or else its MJCF's key; None where neither has one.

    Raises:
        InputError: it is outside the joint limits, or not one angle a joint.
    """
    given, where = case.robot.home_deg, "robot.home_deg"
    if given is not None and len(given) != chain.n:
        raise InputError(f"{case.path}: {where}: has {len(given)} values for {chain.n} joints")
    if given is None and not set(chain.names) <= home.keys():
        return None
    if given is None:
        where = f"robot.model: the key home of {case.robot.model} (robot.home_deg replaces it)"
    rest = np.array([home[name] for name in chain.names]) if given is None else np.deg2rad(given)
    for name, value, low, high in zip(chain.names, *np.rad2deg([rest, chain.lower, chain.upper]), strict=True):
        if not low - 1e-6 <= value <= high + 1e-6:
            raise InputError(f"{case.path}: {where}: {name} = {value:g} deg is outside {low:g} .. {high:g} deg")
    return np.clip(rest, chain.lower, chain.upper)


def _without_home(case: Case, scene: Scene, arm: HeldJoints) -> tuple[Warning, ...]:
    """What is not checked where no home is known."""
    if scene.has_home:
        return ()
    has = f"its keys are {', '.join(map(repr, arm.keys))}" if arm.keys else "it has no keys"
    return (
        Warning(
            Code.HOME_UNKNOWN,
            f"robot.home_deg: not given, and {case.robot.model} has no key home ({has}): the motion begins and ends at "
            "the part, and the ways from home and back are not checked",
        ),
    )


def _table_range(model: mujoco.MjModel, joints: list[int], has_axis: NDArray[np.bool_]) -> Floats:
    out: Floats = np.where(model.jnt_limited[joints, None] != 0, model.jnt_range[joints], (-np.inf, np.inf))
    out[~has_axis] = 0.0
    return out


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
    if len(speeds) != n or not np.all((speeds > 0) & np.isfinite(speeds)):
        raise InputError(f"{case.path}: the robot's numeric max_speed_deg_s needs {n} positive values")
    return np.deg2rad(speeds)
