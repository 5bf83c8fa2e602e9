"""Which layers have to be laid before which: those that leave the torch no room at others' targets once they are there.

    needs = locked_layers(job, poses)         # poses: one a sub-volume, E1, E2 rad
    needs[1][0, 3]                            # layer 0 of sub-volume 1 has to come before this layer of sub-volume 3

Found at single targets, each with all of its configurations at the rolls that a check tries first: with everything of
the other sub-volumes there, and where that locks the torch out with less and less of them. What is found is an order
to try; the check of it is another matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..collision.checker import Checker
from ..job.job import Job
from ..planning.configurations import nodes_at_rolls
from ..planning.context import settings_of
from ..processes.worker import Tick
from ..scene.placement import place_targets
from .layer_order import NEVER
from .parallel_poses import pool_for_poses
from .table_turn import Angles

ROOM_TO_SPARE = 1e-3  # m beyond the clearance asked for: a bead's way is narrower than its targets
FEW_CONFIGURATIONS = 24  # configurations with which less and less is tried
CHEAP = 8  # configurations that are checked first: most targets are free in one of them


def locked_layers(job: Job, poses: Sequence[Angles | None]) -> list[Ints]:
    """Which layers of others may not be there yet when a layer is laid.

    Args:
        job: from ``cell.job.job.prepare``, its layers in any order.
        poses: where each sub-volume can be laid as long as the others are not there; None: nowhere.

    Returns:
        Of each sub-volume (its layers, sub-volumes): the first layer of each other one that may not be there before;
        ``NEVER`` where all may be.
    """
    return pool_for_poses(job).run(_needs_of, job, list(enumerate(poses)))


def _needs_of(job: Job, one: tuple[int, Angles | None], _: Tick) -> Ints:
    """What the layers of one sub-volume need, (layers, sub-volumes)."""
    own, pose = one
    needs = np.full((job.layers[own], len(job.layers)), NEVER)
    if pose is not None and len(job.layers) > 1:
        _Neighbours(job, own, pose).note(needs)
    return needs


class _Neighbours:
    """Checks one sub-volume with more or less of the others there."""

    def __init__(self, job: Job, own: int, pose: Angles) -> None:
        self.job, self.own, self.pose = job, own, pose
        self.placed = place_targets(job.targets, job.scene.T_base_part(*pose))
        self.most = max(job.layers)
        self.clearance = settings_of(job).clearance + ROOM_TO_SPARE
        # of every deposit the sub-volume and the layer
        self.sub_volume = np.full(job.shape.n_deposits, -1)
        self.layer = np.zeros(job.shape.n_deposits, dtype=np.int64)
        for k, numbers in enumerate(job.deposits):
            self.sub_volume[numbers], self.layer[numbers] = k, np.arange(len(numbers))

    def note(self, needs: Ints) -> None:
        """Write down what each layer needs, (layers, sub-volumes)."""
        t = self.job.targets
        for m in range(len(needs)):
            targets = np.flatnonzero((t.sub_volume_index == self.own) & (t.layer == m))
            if not len(targets):
                continue
            blocked = self._blocked(targets, m)
            if not blocked:
                continue
            for a in range(needs.shape[1]):
                if a == self.own:
                    continue
                alone = self._checker(m, a)
                for q in blocked:
                    needs[m, a] = min(needs[m, a], self._first_in_the_way(alone, q, len(self.job.deposits[a])))

    def _blocked(self, targets: Ints, m: int) -> list[Floats]:
        """Of targets that are free without others and not with all of them: a few configurations that are free so."""
        found = []
        some = [q for q in self._configurations(targets) if len(q)]
        if not some:
            return []
        # nearly all are free in the cheapest one
        first = self._among_all.clearances(np.array([q[0] for q in some]), np.full(len(some), m))
        for q in (some[k] for k in np.flatnonzero(first.distance < self.clearance).tolist()):
            if self._free(self._among_all, q[:CHEAP], m):
                continue
            alone = q[self._alone.clearances(q, np.full(len(q), m)).distance >= self.clearance]
            if len(alone) and not self._free(self._among_all, alone, m):
                found.append(alone[:FEW_CONFIGURATIONS])
        return found

    @cached_property
    def _among_all(self) -> Checker:
        """Collision detection with all of the others, and as many of the own layers as are asked for."""
        return self._own_growing(others=-1)

    @cached_property
    def _alone(self) -> Checker:
        """The same with none of the others."""
        return self._own_growing(others=10 * self.most)

    def _own_growing(self, others: int) -> Checker:
        geom = self.job.scene.deposit_of_geom
        deposit = np.maximum(geom, 0)
        number = np.where(self.sub_volume[deposit] == self.own, self.layer[deposit], others)
        number = np.where(geom < 0, geom, number)
        return Checker(replace(self.job.scene, deposit_of_geom=number), self.pose, self.clearance)

    def _configurations(self, targets: Ints) -> list[Floats]:
        """Configurations of targets inside limits and margins, the cheapest first."""
        job = self.job
        step = settings_of(job).roll_step
        nodes = nodes_at_rolls(job.solver, self.placed.rows(targets), job.window, step, job.singularity_limits)
        found = []
        for k in range(len(targets)):
            allowed = np.isfinite(nodes.cost[k])
            found.append(nodes.q[k][allowed][np.argsort(nodes.cost[k][allowed], kind="stable")])
        return found

    def _checker(self, m: int, other: int) -> Checker:
        """Collision detection with the layers below m, and as many of another sub-volume as are asked for."""
        scene = self.job.scene
        geom = scene.deposit_of_geom
        deposit = np.maximum(geom, 0)
        sub_volume, layer = self.sub_volume[deposit], self.layer[deposit]
        absent = 10 * self.most
        number = np.where(sub_volume == other, layer, absent)
        number = np.where(sub_volume == self.own, np.where(layer < m, -1, absent), number)
        number = np.where(geom < 0, -1, number)
        return Checker(replace(scene, deposit_of_geom=number), self.pose, self.clearance)

    def _free(self, checker: Checker, q: Floats, deposits_laid: int) -> bool:
        """Whether any of some configurations keeps the clearance."""
        found = checker.clearances(q, np.full(len(q), deposits_laid))
        return bool((found.distance >= self.clearance).any())

    def _first_in_the_way(self, checker: Checker, q: Floats, layers: int) -> int:
        """The first layer of a sub-volume that leaves none of some configurations free; ``NEVER`` where none does."""
        if self._free(checker, q, layers):
            return NEVER
        free, blocked = 0, layers
        while blocked - free > 1:
            middle = (free + blocked) // 2
            free, blocked = (middle, blocked) if self._free(checker, q, middle) else (free, middle)
        return free
