"""Which shapes of a composed cell are checked against which: contact bits, and pairs that MuJoCo would leave out.

    set_contact_bits(assembly)                  # everything against everything, but for the wire on the part
    pair_tool_with_arm(assembly)                # the tool against the links that MuJoCo leaves out

Pieces are distinguished by the bodies they belong to, never by what a shape is called.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from slicing import Code, Warning

from ..arrays import Ints
from ..errors import InputError
from ..mjcf.finite_numbers import require_finite
from .absent_shapes import link_of_body
from .composition import BodyOwner, CellAssembly, one_line

# contact bits: the wire may touch the part and nothing else
SOLID, WIRE = 1, 2
ROUND_SHAPES = tuple(
    int(t)
    for t in (
        mujoco.mjtGeom.mjGEOM_SPHERE,
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        mujoco.mjtGeom.mjGEOM_CYLINDER,
        mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    )
)
OFF_AXIS = 1e-4  # m, and rad: what a shape that turns about the last joint's own axis may be off it
TOUCHING = 1e-3  # m: nearer than this, two shapes that never move against each other may touch
AT_FLANGE = 1e-3  # m: a shape that begins this near the flange's face is bolted onto it
TURNS = 25  # angles of the last joint at which the arm's own shapes are checked
FAR_AWAY = 10.0  # m


def set_contact_bits(assembly: CellAssembly) -> None:
    """Let everything collide but the wire with the part; a model's own bits say only which shapes collide."""
    wires = assembly.wires
    for geom in assembly.world.geoms:
        if not (geom.contype or geom.conaffinity):
            continue
        piece = assembly.piece.get(geom.parent.name, BodyOwner.SURROUNDINGS)
        if piece is BodyOwner.TOOL and geom.name in wires:
            geom.contype, geom.conaffinity = WIRE, 0
        elif piece in (BodyOwner.SUPPORT, BodyOwner.PART):
            geom.contype, geom.conaffinity = SOLID, SOLID
        else:
            geom.contype, geom.conaffinity = SOLID, SOLID | WIRE


def pair_tool_with_arm(assembly: CellAssembly) -> None:
    """Name the pairs of the tool and the arm that MuJoCo leaves out though they move against each other.

    MuJoCo leaves out a body and the one that carries it, and what the model excludes; the tool is welded to the arm's
    last link, so that its pairs with the link before would never be tested. Shapes of the last link itself count as
    tool where they stand out beyond the flange. To be called before the positioner is added.

    Raises:
        InputError: the arm and its tool do not compile, or a number of theirs is none.
    """
    case, world = assembly.case, assembly.world
    joints = [world.joint(assembly.name(BodyOwner.ROBOT, "joints", name)) for name in case.robot.joints]
    if None in joints:
        return  # cell.scene.compose says which
    try:
        model = world.copy().compile()
    except ValueError as error:
        raise InputError(f"{case.path}: the robot with its tool does not compile: {one_line(error)}") from None
    require_finite(model, str(case.path))
    wrist = _ToolPairs(model, assembly, tuple(model.joint(joint.name).id for joint in joints))
    left_out = []
    for tool, arm in wrist.unseen():
        fixed = wrist.bolted_on(tool, arm)
        if fixed and not wrist.touch(tool, arm):
            continue
        if (fixed and wrist.is_disc(tool)) or (not wrist.of_tool[tool] and wrist.always_touch(tool, arm)):
            left_out.append(" - ".join(model.geom(g).name for g in (arm, tool)))
            continue
        names = model.geom(tool).name, model.geom(arm).name
        world.add_pair(name="~".join(names), geomname1=names[0], geomname2=names[1])
    _pair_links(wrist)
    if left_out:
        text = (
            f"robot.model: {', '.join(left_out)} touch at every angle of {case.robot.joints[-1]}: collisions of these "
            "shapes at the flange with each other are not checked"
        )
        assembly.warnings.append(Warning(Code.PAIR_LEFT_OUT, text))


def _pair_links(wrist: _ToolPairs) -> None:
    """Name the pairs of links that MuJoCo takes for a body and the one that carries it, though they are not.

    So they are where a body has several joints, and where a joint between is held: a hose that swings on a link, or the
    third axis of seven. What touches at every angle that is checked is left out and reported.
    """
    assembly, left_out = wrist.assembly, []
    for outer, inner in wrist.unseen_links():
        names = wrist.model.geom(outer).name, wrist.model.geom(inner).name
        if wrist.always_touch(outer, inner):
            left_out.append(" - ".join(reversed(names)))
        else:
            assembly.world.add_pair(name="~".join(names), geomname1=names[0], geomname2=names[1])
    if left_out:
        text = (
            f"robot.model: {', '.join(left_out)} touch at every angle between them: their collision with each "
            "other is not checked"
        )
        assembly.warnings.append(Warning(Code.PAIR_LEFT_OUT, text))


def lost_on_table(assembly: CellAssembly, model: mujoco.MjModel, axes: Sequence[int]) -> Ints:
    """Shapes of the positioner that MuJoCo takes for neighbours only because a joint between them is held.

    Args:
        assembly: what the cell was compiled from.
        model: the compiled cell.
        axes: ids of E1 and E2.

    Returns:
        Ids, (k, 2): what turns with E2, and what E1 alone moves.
    """
    weld = _weld_of_models(model, assembly.held)
    link = link_of_body(model, axes)[model.geom_bodyid]
    hard = (model.geom_contype | model.geom_conaffinity) != 0
    own = np.array([assembly.piece.get(model.body(b).name) is BodyOwner.POSITIONER for b in model.geom_bodyid])
    tilts, turns = (np.flatnonzero(hard & own & (link == model.jnt_bodyid[axis])).tolist() for axis in axes)
    pairs = [
        (turn, tilt)
        for turn, tilt in product(turns, tilts)
        if _neighbours(model, turn, tilt, model.body_weldid)
        and not _neighbours(model, turn, tilt, weld)
        and not _excluded(model, turn, tilt)
    ]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _weld_of_models(model: mujoco.MjModel, held: Collection[str]) -> NDArray[np.int64]:
    """By body the one that it is welded to while the joints that were taken from these bodies move, (nbody,)."""
    weld = np.zeros(model.nbody, dtype=np.int64)
    for body in range(1, model.nbody):  # parents come first
        moves = model.body_weldid[body] == body or model.body(body).name in held
        weld[body] = body if moves else weld[model.body_parentid[body]]
    return weld


def _excluded(model: mujoco.MjModel, one: int, other: int) -> bool:
    """Whether a model excludes the bodies of two geoms."""
    a, b = sorted((int(model.geom_bodyid[one]), int(model.geom_bodyid[other])))
    return (a << 16) + b in model.exclude_signature


def _neighbours(model: mujoco.MjModel, one: int, other: int, weld: NDArray[np.int32] | NDArray[np.int64]) -> bool:
    """Whether of two geoms one's body carries the other's; of bodies that are welded, any of them."""
    a, b = (int(weld[model.geom_bodyid[geom]]) for geom in (one, other))
    above = [int(weld[model.body_parentid[body]]) for body in (a, b)]
    return 0 not in (a, b) and (a == above[1] or b == above[0])


def left_out(model: mujoco.MjModel, one: int, other: int) -> bool:
    """Whether MuJoCo leaves a pair of geoms out; see "collision detection: selection" in its documentation."""
    return _excluded(model, one, other) or _neighbours(model, one, other, model.body_weldid)


@dataclass(frozen=True, eq=False)
class _ToolPairs:
    """The arm with its tool alone.

    Attributes:
        model: compiled.
        assembly: what it was compiled from.
        joints: ids of the arm's joints.
    """

    model: mujoco.MjModel
    assembly: CellAssembly
    joints: tuple[int, ...]

    @cached_property
    def moved_by(self) -> NDArray[np.int64]:
        """By geom, how many of the arm's joints move it."""
        model, bodies = self.model, set(self.model.jnt_bodyid[list(self.joints)].tolist())
        count = np.zeros(model.nbody, dtype=np.int64)
        for body in range(1, model.nbody):  # parents come first
            own = sum(int(model.jnt_bodyid[j]) == body for j in self.joints) if body in bodies else 0
            count[body] = count[model.body_parentid[body]] + own
        return count[model.geom_bodyid]

    @cached_property
    def weld_of_model(self) -> NDArray[np.int64]:
        """By body the one that it is welded to while all joints of the arm's model move, planned or not."""
        return _weld_of_models(self.model, self.assembly.held)

    @cached_property
    def of_tool(self) -> NDArray[np.bool_]:
        """Whether a geom is the tool's, by its body."""
        piece = [self.assembly.piece.get(self.model.body(b).name) for b in range(self.model.nbody)]
        of_tool = np.array([p is BodyOwner.TOOL for p in piece])
        return of_tool[self.model.geom_bodyid]

    @cached_property
    def flange(self) -> tuple[Floats, Floats]:
        """Its place and its z axis with all joints at zero, world, m."""
        site = self.model.site(self.assembly.name(BodyOwner.ROBOT, "sites", self.assembly.case.robot.flange)).id
        return self.data.site_xpos[site], self.data.site_xmat[site].reshape(3, 3)[:, 2]

    @cached_property
    def data(self) -> mujoco.MjData:
        """All joints at zero."""
        data = mujoco.MjData(self.model)
        data.qpos[self.model.jnt_qposadr[list(self.joints)]] = 0.0
        mujoco.mj_kinematics(self.model, data)
        return data

    def unseen(self) -> list[tuple[int, int]]:
        """Geoms of tool and arm that move against each other, but that MuJoCo does not hold against each other."""
        model = self.model
        hard = (model.geom_contype | model.geom_conaffinity) != 0
        robot = np.array([self.assembly.piece.get(model.body(b).name) is BodyOwner.ROBOT for b in model.geom_bodyid])
        last = len(self.joints)
        moved = np.flatnonzero(hard & (self.moved_by == last)).tolist()
        tools = [g for g in moved if self.of_tool[g] or self._beyond(g)]
        arms = np.flatnonzero(hard & robot & (self.moved_by < last)).tolist()
        return [(t, a) for t in tools for a in arms if left_out(model, t, a)]

    def unseen_links(self) -> list[tuple[int, int]]:
        """Geoms of the arm that MuJoCo takes for neighbours though they are not, but for unseen ones.

        They have two or more planned joints between them, or the model by itself has MuJoCo hold them against each
        other, which ends where a joint of it is held. What the model itself excludes stays excluded.
        """
        model, known, moved = self.model, set(self.unseen()), self.moved_by
        hard = (model.geom_contype | model.geom_conaffinity) != 0
        robot = [self.assembly.piece.get(model.body(b).name) is BodyOwner.ROBOT for b in model.geom_bodyid]
        of_body: dict[int, list[int]] = {}
        for geom in np.flatnonzero(hard & np.array(robot)).tolist():
            of_body.setdefault(int(model.geom_bodyid[geom]), []).append(geom)
        pairs = ((o, i) for o in of_body.values() for i in of_body.values() if moved[o[0]] > moved[i[0]])
        lost = [(o, i) for o, i in pairs if self._is_lost(o[0], i[0])]
        return [pair for o, i in lost for pair in product(o, i) if pair not in known]

    def _is_lost(self, outer: int, inner: int) -> bool:
        """Whether MuJoCo takes two geoms' bodies for neighbours though they are not, and the model excludes neither."""
        if self._excluded(outer, inner) or not left_out(self.model, outer, inner):
            return False
        apart = int(self.moved_by[outer] - self.moved_by[inner])
        return apart >= 2 or not self._neighbours(outer, inner, self.weld_of_model)

    def _excluded(self, one: int, other: int) -> bool:
        """Whether the model excludes the bodies of two geoms."""
        return _excluded(self.model, one, other)

    def _neighbours(self, one: int, other: int, weld: NDArray[np.int32] | NDArray[np.int64]) -> bool:
        """Whether of two geoms one's body carries the other's, bodies that are welded together counting as one."""
        return _neighbours(self.model, one, other, weld)

    def _span(self, geom: int) -> tuple[float, float]:
        """From where to where a geom reaches along the flange's z axis, from the flange on, m."""
        model, data = self.model, self.data
        at, z = self.flange
        turn = data.geom_xmat[geom].reshape(3, 3)
        centre = float((data.geom_xpos[geom] + turn @ model.geom_aabb[geom, :3] - at) @ z)
        half = float(np.abs(turn.T @ z) @ model.geom_aabb[geom, 3:])
        return centre - half, centre + half

    def _beyond(self, geom: int) -> bool:
        """Whether a shape of the last link stands out beyond the flange."""
        return self._span(geom)[1] > AT_FLANGE

    def bolted_on(self, tool: int, arm: int) -> bool:
        """Whether a shape is round about the last joint's axis, at the flange.

        Its distance to the link before is the same at every angle, so that no clearance can be kept or lost.
        """
        model, data = self.model, self.data
        if self.moved_by[arm] != len(self.joints) - 1 or int(model.geom_type[tool]) not in ROUND_SHAPES:
            return False
        low, high = self._span(tool)
        if low > AT_FLANGE or high < -AT_FLANGE:
            return False
        joint = self.joints[-1]
        axis, away = data.xaxis[joint], data.geom_xpos[tool] - data.xanchor[joint]
        if np.linalg.norm(np.cross(axis, away)) > OFF_AXIS:
            return False
        ball = int(model.geom_type[tool]) == int(mujoco.mjtGeom.mjGEOM_SPHERE)
        along = data.geom_xmat[tool].reshape(3, 3)[:, 2]
        round_about = model.geom_size[tool, 0] == model.geom_size[tool, 1] or int(model.geom_type[tool]) != int(
            mujoco.mjtGeom.mjGEOM_ELLIPSOID
        )
        return ball or (round_about and bool(np.linalg.norm(np.cross(axis, along)) <= OFF_AXIS))

    def touch(self, tool: int, arm: int) -> bool:
        """Whether two shapes touch with all joints at zero."""
        return mujoco.mj_geomDistance(self.model, self.data, tool, arm, FAR_AWAY, np.zeros(6)) <= TOUCHING

    def is_disc(self, geom: int) -> bool:
        """Whether a shape is a plate: a cylinder no higher than its radius.

        A plate on the flange turns freely there, so that a link that reaches into it is modelled too large.
        """
        radius, half = self.model.geom_size[geom, :2]
        return int(self.model.geom_type[geom]) == int(mujoco.mjtGeom.mjGEOM_CYLINDER) and bool(2 * half <= radius)

    def always_touch(self, tool: int, arm: int) -> bool:
        """Whether two shapes touch at every angle of the joints between them that is checked."""
        model, data = self.model, mujoco.MjData(self.model)
        between = self.joints[int(self.moved_by[arm]) :]
        turns = np.linspace(0, 1, TURNS)
        for joint in between:
            low, high = model.jnt_range[joint] if model.jnt_limited[joint] else (-np.pi, np.pi)
            for turn in low + turns * (high - low):
                data.qpos[model.jnt_qposadr[list(self.joints)]] = 0.0
                data.qpos[model.jnt_qposadr[joint]] = turn
                mujoco.mj_kinematics(model, data)
                if mujoco.mj_geomDistance(model, data, tool, arm, FAR_AWAY, np.zeros(6)) > 0.0:
                    return False
        return True
