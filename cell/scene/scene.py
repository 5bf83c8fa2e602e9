"""A composed cell: MuJoCo's model, the arm as arrays, and what every geom belongs to.

Use:

    scene.model, scene.chain                  # MuJoCo's model, the arm as arrays
    scene.T_base_part(E1, E2)                 # where the part is, seen from the arm
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Chain, Floats
from slicing import PartShape, Warning

from ..case.sections import Case
from ..errors import InputError
from ..rigid import inverse, pose
from .composition import BodyOwner


@dataclass(frozen=True, eq=False)
class Scene:
    """A compiled cell.

    Attributes:
        case: what it was made from.
        model: MuJoCo's model.
        part: shapes of the part that stands in it.
        chain: the arm with its tool, base frame = the robot's base body.
        arm_qpos: places of the arm's joints in qpos, (n,).
        table_qpos: places of E1, E2 in qpos, (2,).
        table_range: their ranges, (2, 2), rad; infinite of an endless axis, 0 .. 0 of one that is not there.
        home: the arm's rest configuration, (n,), rad.
        has_home: whether it is known: a program begins and ends there.
        deposit_of_geom: number of the deposit a geom stands for, -1 for all else, (ngeom,).
        n_deposits: how many deposits the part has.
        contact_bits: contype and conaffinity of every geom, (2, ngeom).
        body_contype: the bodies' own, (nbody,); as the geoms'.
        body_conaffinity: likewise.
        arm_geom: whether a geom belongs to the arm or its tool, (ngeom,).
        tool_geom: whether it moves with the TCP: the tool and the arm's last link, (ngeom,).
        piece_of_geom: what each geom belongs to, (ngeom,): 0 surroundings, 1 robot, 2 tool, 3 positioner, 4 support,
            5 part, 6 fixture.
        wire_geom: whether it is the tool's wire, (ngeom,).
        put_on_table: whether it is the part, its support or a fixture on the table, (ngeom,).
        arm_joints: ids of the arm's joints, (n,).
        table_joints: ids of E1, E2, (2,); those of an axis that is not there never move.
        has_axis: whether the positioner has E1, E2, (2,).
        base_body: id of the arm's base body.
        sites: ids of the sites flange, tcp, table and part.
        lost_on_table: shapes of the positioner that MuJoCo leaves out for a joint between that is held, (k, 2).
        warnings: what is left out of the cell or not checked, one line each.
    """

    case: Case
    model: mujoco.MjModel
    part: PartShape
    chain: Chain
    arm_qpos: NDArray[np.int64]
    table_qpos: NDArray[np.int64]
    table_range: Floats
    home: Floats
    has_home: bool
    deposit_of_geom: NDArray[np.int64]
    n_deposits: int
    contact_bits: NDArray[np.int32]
    body_contype: NDArray[np.int32]
    body_conaffinity: NDArray[np.int32]
    arm_geom: NDArray[np.bool_]
    tool_geom: NDArray[np.bool_]
    piece_of_geom: NDArray[np.int64]
    wire_geom: NDArray[np.bool_]
    put_on_table: NDArray[np.bool_]
    arm_joints: NDArray[np.int64]
    table_joints: NDArray[np.int64]
    has_axis: NDArray[np.bool_]
    base_body: int
    sites: dict[str, int]
    lost_on_table: NDArray[np.int64]
    warnings: tuple[Warning, ...] = ()

    @property
    def start(self) -> Floats | None:
        """Where a program begins and ends, (n,), rad; None where no home is known."""
        return self.home if self.has_home else None

    def Ts_base_site(self, site: str, tables: Floats) -> Floats:
        """Pose of a site in the arm's base frame at many table angles, from MuJoCo's own kinematics.

        Args:
            site: "table" or "part".
            tables: E1, E2, (m, 2), rad; of those that repeat each is computed once.

        Returns:
            (m, 4, 4), m.
        """
        still = len(tables) > 0 and bool((tables == tables[0]).all())
        one = tables[:1], np.zeros(len(tables), dtype=np.int64)
        poses, which = one if still else np.unique(tables, axis=0, return_inverse=True)
        data = mujoco.MjData(self.model)
        out = np.empty((len(poses), 4, 4))
        at = self.sites[site]
        for i, angles in enumerate(poses):
            data.qpos[self.table_qpos] = angles
            mujoco.mj_kinematics(self.model, data)
            out[i] = pose(data.site_xpos[at], data.site_xmat[at])
        seen: Floats = (inverse(self.T_world_base()) @ out)[which.ravel()]
        return seen

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
        base, site = self.base_body, self.sites["part"]
        return inverse(pose(data.xpos[base], data.xmat[base])) @ pose(data.site_xpos[site], data.site_xmat[site])

    def T_world_base(self) -> Floats:
        """Pose of the arm's base frame in the world, (4, 4), m."""
        return self._T_world_base.copy()

    @cached_property
    def _T_world_base(self) -> Floats:
        data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, data)
        base = self.base_body
        return pose(data.xpos[base], data.xmat[base])

    def check_table(self, E1: float, E2: float) -> None:
        """Refuse table angles that the positioner does not have.

        Args:
            E1: tilt, rad.
            E2: turn, rad.

        Raises:
            InputError: which axis, its range.
        """
        for k, (name, value, (low, high)) in enumerate(zip(("E1", "E2"), (E1, E2), self.table_range, strict=True)):
            if not low - 1e-9 <= value <= high + 1e-9:
                if not self.has_axis[k]:
                    has = ", ".join(self.case.positioner.joints) or "none"
                    raise InputError(
                        f"{name} = {np.rad2deg(value):g} deg: this positioner has no such axis and stands at 0 "
                        f"(positioner.joints: {has})"
                    )
                same = (value + turns * 2 * np.pi for turns in (-1, 1))
                turn = "".join(f"; equals {np.rad2deg(v):g} deg, which is inside" for v in same if low <= v <= high)
                low_deg, high_deg, deg = np.rad2deg([low, high, value])
                raise InputError(
                    f"{name} = {deg:g} deg is outside the positioner's range {low_deg:g} .. {high_deg:g} deg{turn}"
                )

    def geom_name(self, geom: int) -> str:
        """What a geom is called in reports: a piece of a fixture by the fixture.

        Args:
            geom: its number in the scene's model.
        """
        if geom not in self._names:
            body = self.model.body(self.model.geom_bodyid[geom]).name
            name = mujoco.mj_id2name(self.model, mujoco.mjtObj.mjOBJ_GEOM, geom)
            is_piece = self.piece_of_geom[geom] == BodyOwner.FIXTURE
            self._names[geom] = body.split("/")[1] if is_piece else name or f"{body} (geom {geom})"
        return self._names[geom]

    @cached_property
    def _names(self) -> dict[int, str]:
        """Names of geoms that have been asked for."""
        return {}


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


def case_table(case: Case, scene: Scene) -> tuple[float, float]:
    """Table angles of a case: those of an axis that stands, and any angle of an axis that the table's mode moves.

    What a case says of an axis that moves means nothing, and need not be in the axis' range: 0 where it is left out.

    Args:
        case: the case.
        scene: its cell.

    Returns:
        E1, E2, rad; of an axis that moves and has no such angle the end of its range that is nearest to it.

    Raises:
        InputError: an axis that stands has no such angle.
    """
    table = case.table
    moves = () if table.mode == "fixed" else table.axes or ("E1", "E2")
    angles = []
    for name, deg, (low, high) in zip(
        ("E1", "E2"), (table.E1_deg, table.E2_deg), np.rad2deg(scene.table_range).tolist(), strict=True
    ):
        has = any(low <= deg + turn <= high for turn in (0, -360, 360))
        angles.append(deg if has or name not in moves else min(max(deg, low), high))
    return table_angles(scene, angles[0], angles[1])
