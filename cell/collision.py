"""Clearances of the whole cell in many configurations, from MuJoCo's own collision detection.

    checker = Checker(scene, table, reach=0.02)       # metres out to which clearances are known
    c = checker.clearances(q, stage)                  # q (m, n) rad, stage (m,) deposits laid so far
    c.distance, c.pair, c.position

What counts is everything that the arm is not meant to touch: itself and its torch, the cell, the table, the body of the
part, and the deposits laid before the given stage (later ones are still in the air). The wire may touch the part; what
stands on the table against the cell around it is the table's own affair. Distances are signed: negative is a
penetration. Metres.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

if TYPE_CHECKING:
    from .scene import Scene

Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Clearances:
    """The nearest pair of every configuration.

    Attributes:
        distance: least signed distance, (m,), m; infinite where nothing is within the checker's reach.
        pair: ids of the two geoms, (m, 2); -1 where there is none.
        position: where they are nearest, (m, 3), world, m; NaN where there is none.
    """

    distance: Floats
    pair: Ints
    position: Floats

    def __len__(self) -> int:
        return len(self.distance)

    def rows(self, index: Ints) -> Clearances:
        """Some of the configurations."""
        return Clearances(self.distance[index], self.pair[index], self.position[index])

    @classmethod
    def none(cls, m: int) -> Clearances:
        """M configurations with nothing near."""
        return cls(np.full(m, np.inf), np.full((m, 2), -1), np.full((m, 3), np.nan))


class Checker:
    """Collision detection of one scene at one table pose; not to be shared between threads."""

    scene: Scene
    table: tuple[float, float]
    reach: float

    def __init__(self, scene: Scene, table: tuple[float, float], reach: float, without: Collection[int] = ()) -> None:
        """Prepare the model.

        Args:
            scene: the composed cell.
            table: E1 and E2, rad.
            reach: distances are known out to here, m.
            without: deposits that do not count, laid or not.
        """
        self.scene = scene
        self.table = table
        self.reach = reach
        self._model = scene.model
        self._data = mujoco.MjData(scene.model)
        self._data.qpos[scene.table_qpos] = table
        # MuJoCo reports a pair out to the sum of its geoms' gaps
        self._geom_gap = np.where(scene.contact_bits.any(axis=0), reach / 2, 0.0)
        self._pair_gap = reach
        self._arm_body = np.zeros(scene.model.nbody, dtype=bool)
        self._arm_body[scene.model.geom_bodyid[scene.arm_geom]] = True
        self._body_contype = scene.body_contype
        self._ignored = np.isin(scene.deposit_of_geom, list(without))

    def clearances(self, q: Floats, stage: Ints) -> Clearances:
        """The nearest pair of every configuration.

        Args:
            q: configurations of the arm, (m, n), rad.
            stage: number of deposits already laid, (m,).

        Returns:
            Clearances.
        """
        model, data = self._model, self._data
        # the model is shared between checkers of different reach
        model.geom_gap[:], model.pair_gap[:] = self._geom_gap, self._pair_gap
        out = Clearances.none(len(q))
        arm = self.scene.arm_qpos
        for laid in np.unique(stage):
            self._lay(int(laid), arm_alone=True)
            for i in np.flatnonzero(stage == laid):
                data.qpos[arm] = q[i]
                mujoco.mj_kinematics(model, data)
                mujoco.mj_collision(model, data)
                if data.ncon:
                    contact = data.contact
                    k = int(np.argmin(contact.dist))
                    out.distance[i], out.pair[i], out.position[i] = contact.dist[k], contact.geom[k], contact.pos[k]
        return out

    def _lay(self, stage: int, *, arm_alone: bool) -> None:
        """Let the deposits below a number collide, and no others: what is not there yet costs nothing.

        Nor does what stands on the table against the cell around it, if it is only the arm that moves.
        """
        scene, model = self.scene, self._model
        there = (scene.deposit_of_geom < stage) & ~self._ignored
        hits = there & scene.arm_geom if arm_alone else there
        # a pair collides where one's contype meets the other's conaffinity: the arm's own meet all there is
        model.geom_contype[:] = np.where(hits, scene.contact_bits[0], 0)
        model.geom_conaffinity[:] = np.where(there, scene.contact_bits[1], 0)
        model.body_contype[:] = np.where(self._arm_body, self._body_contype, 0) if arm_alone else self._body_contype

    def table_alone(self) -> Clearances:
        """The nearest pair in which the arm has no part: what stands on the table against the cell around it.

        Returns:
            Clearances of one row, over all deposits.
        """
        scene = self.scene
        self._lay(scene.n_deposits, arm_alone=False)
        model, data = self._model, self._data
        model.geom_gap[:], model.pair_gap[:] = self._geom_gap, self._pair_gap
        data.qpos[scene.arm_qpos] = 0.0
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        out = Clearances.none(1)
        geom, distance = data.contact.geom, data.contact.dist
        ours = ~scene.arm_geom[geom].any(axis=1)
        if ours.any():
            k = int(np.argmin(np.where(ours, distance, np.inf)))
            out.distance[0], out.pair[0], out.position[0] = distance[k], geom[k], data.contact.pos[k]
        return out
