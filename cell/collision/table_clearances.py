"""What stands on the table against the cell around it: pairs in which the arm has no part.

    checker = TableChecker(scene, reach=0.05)
    c = checker.clearances(tables, deposits_laid)            # tables (m, 2) rad; deposits laid so far (m,)

Of the arm nothing is checked here, and nothing but penetration is wrong: the gap between a positioner and its own
pedestal is its manufacturer's choice. The workpiece is checked against the tilting part of the positioner as well,
which carries what carries it, so that MuJoCo leaves the pair out. Metres and radians.
"""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from ..scene.scene import Scene
from .checker import NEVER, Checker
from .clearances import Clearances
from .proofs.motion_bounds import joint_travel_bound

DEGENERATE = -1e-6  # m: MuJoCo's distance of shapes whose centres fall together is 0


def on_table(scene: Scene) -> NDArray[np.bool_]:
    """Whether a geom moves with the table: with E1, or E2 where that is the only axis, (ngeom,)."""
    return _carried(scene, 0) | _carried(scene, 1)


def with_table_axes(scene: Scene) -> Scene:
    """The scene with E1 and E2 as further axes of the arm: its configurations have them after the arm's joints."""
    return replace(scene, arm_qpos=np.concatenate([scene.arm_qpos, scene.table_qpos]))


def _carried(scene: Scene, axis: int) -> NDArray[np.bool_]:
    model = scene.model
    root = int(model.jnt_bodyid[scene.table_joints[axis]])
    carried = np.zeros(model.nbody, dtype=bool)
    for body in range(1, model.nbody):  # parents come first
        carried[body] = body == root or carried[model.body_parentid[body]]
    out: NDArray[np.bool_] = carried[model.geom_bodyid]
    return out


TABLE_REACH = 5e-3  # m: of a table by itself it is only asked whether it touches anything


def table_alone(scene: Scene, table: tuple[float, float], deposits_laid: int | None = None) -> Clearances:
    """Clearances of the table and what stands on it from the cell around, without the arm.

    Every verdict asks this, and whatever screens poses or changes for one: they cannot disagree.

    Args:
        scene: the composed cell.
        table: E1, E2, rad.
        deposits_laid: deposits laid so far; all where left out.

    Returns:
        Clearances of one row; below 0 the pose is infeasible.
    """
    return tables_alone(scene, np.array([table]), deposits_laid)


def tables_alone(scene: Scene, tables: Floats, deposits_laid: int | None = None) -> Clearances:
    """The same at many poses of the table.

    Args:
        scene: the composed cell.
        tables: E1 and E2, (m, 2), rad.
        deposits_laid: deposits laid so far; all where left out.

    Returns:
        Clearances, a row a pose.
    """
    laid = np.full(len(tables), scene.n_deposits if deposits_laid is None else deposits_laid)
    return TableChecker(scene, TABLE_REACH).clearances(tables, laid)


class TableChecker:
    """Collision detection of a scene's table, wherever it is turned; see ``cell.collision.checker.Checker``."""

    def __init__(self, scene: Scene, reach: float) -> None:
        """Prepare the model.

        Args:
            scene: the composed cell.
            reach: distances are known out to here, m.
        """
        self.scene, self.reach = scene, reach
        moves = on_table(scene)
        bits = np.where(scene.arm_geom, 0, scene.contact_bits).astype(scene.contact_bits.dtype)
        table = replace(scene, arm_qpos=scene.table_qpos, arm_geom=moves, contact_bits=bits)
        # pairs named in the model are the arm's own
        self._checker = Checker(table, (0.0, 0.0), reach, pair_gap=NEVER)
        self._data = mujoco.MjData(scene.model)
        hits = bits.any(axis=0)
        # what turns with no axis against the work does not come nearer to it
        self._tilt = np.flatnonzero(hits & moves & ~_carried(scene, 1) & scene.has_axis.all())
        # the positioner's own parts turn in one another; what is put onto its table does not
        self._work = np.flatnonzero(hits & scene.put_on_table)

    def travel_bound(self, radius: Floats, a: Floats, b: Floats) -> Floats:
        """How far anything on the table can travel on steps, (m,), m."""
        return joint_travel_bound(radius, a, b)

    def bend_bound(self, radius: Floats, turn: Floats) -> Floats:
        """None: arcs are what the travel is bounded by, wherever they begin, (m,)."""
        return np.zeros(len(turn))

    def clearances(self, tables: Floats, deposits_laid: Ints) -> Clearances:
        """The nearest pair at every table pose.

        Args:
            tables: E1 and E2, (m, 2), rad.
            deposits_laid: deposits already laid, (m,).

        Returns:
            Clearances.
        """
        poses, back = np.unique(np.column_stack([tables, deposits_laid]), axis=0, return_inverse=True)
        laid = poses[:, 2].astype(np.int64)
        found = self._checker.clearances(poses[:, :2], laid)
        for i, pose in enumerate(poses):
            self._against_tilt(found, i, pose[:2], int(laid[i]))
        return found.rows(back.ravel())

    def _against_tilt(self, found: Clearances, i: int, table: Floats, laid: int) -> None:
        """Lower a clearance to that of pairs which MuJoCo leaves out, where they are nearer.

        The workpiece from the tilting part, and the positioner's own shapes with a held joint between them.
        """
        model, data, own = self.scene.model, self._data, self.scene.lost_on_table
        work = self._work[self.scene.deposit_of_geom[self._work] < laid]
        if not (len(work) and len(self._tilt)) and not len(own):
            return
        data.qpos[self.scene.table_qpos] = table
        mujoco.mj_kinematics(model, data)
        apart = np.linalg.norm(data.geom_xpos[work][:, None] - data.geom_xpos[self._tilt], axis=2)
        apart -= model.geom_rbound[work][:, None] + model.geom_rbound[self._tilt]
        near = [(int(work[k]), int(self._tilt[m])) for k, m in np.argwhere(apart <= self.reach).tolist()]
        ends = np.zeros(6)
        for g, t in [*near, *own.tolist()]:
            distance = mujoco.mj_geomDistance(model, data, g, t, self.reach, ends)
            if distance == 0.0:
                distance = DEGENERATE
            if distance < min(self.reach, found.distance[i]):
                found.distance[i], found.pair[i] = distance, (g, t)
                found.position[i] = (ends[:3] + ends[3:]) / 2
