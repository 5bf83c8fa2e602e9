"""Clearances of the whole cell in many configurations, from MuJoCo's own collision detection.

    checker = Checker(scene, table, reach=0.02)       # metres out to which clearances are known
    c = checker.clearances(q, deposits_laid)                  # q (m, n) rad; deposits laid so far (m,)
    c.distance, c.pair, c.position

What counts is everything that the arm is not meant to touch: itself and its torch, the cell, the table, the body of the
part, and the deposits that are laid (later ones are still in the air). The wire may touch the part; what
stands on the table against the cell around it is the table's own affair. Distances are signed: negative is a
penetration. Metres.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from itertools import repeat
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from ..errors import InputError
from .arm_poses import ArmPoses, as_slice
from .broad_phase import BroadPhase
from .clearances import Clearances
from .model_copies import Switched, lent
from .near_pairs import NearPairs
from .proofs.motion_bounds import CoupledBounds, MotionBounds, joint_travel_bound

if TYPE_CHECKING:
    from ..scene.scene import Scene

FURTHER, LEAST_FAR = 1.05, 5e-4  # of the last distance, m: how far to search first
MAYBE_PENETRATES = 0.01  # share of how far is looked: of small shapes that penetrate MuJoCo is off by up to 0.4 % of it
COARSER = 1.2  # from one distance that is looked out to to the next: to set it costs as much as to look
STEPS_TOGETHER = 5_000  # that are bounded together: each takes some 4 kB meanwhile
NEVER = -1e3  # m, as the gap of named pairs: they are not reported
AWAY = 1e4  # m
CONTACTS = 20  # that cost as much as a configuration without any
MANY_GEOMS = 1000  # geoms, from which MuJoCo's kinematics of all of them costs more than ours of the arm


def _named_pairs(scene: Scene) -> tuple[int, ...]:
    """Shapes without which no pair that the model names is ever met: where they are away, none is.

    A gap silences pairs that are apart, not those that penetrate. Of each pair it is a shape that counts for nothing in
    this scene; of two such the one that is in more pairs, which for other scenes of the model is the same one mostly.
    """
    inert = (scene.contact_bits == 0).all(axis=0).tolist()
    ones, others = scene.model.pair_geom1.tolist(), scene.model.pair_geom2.tolist()
    count = Counter(ones + others)
    pairs = zip(ones, others, strict=True)
    named = {max(pair, key=lambda geom: (inert[geom], count[geom])) for pair in pairs}
    return tuple(sorted(geom for geom in named if inert[geom]))


@dataclass
class QueryCount:
    """How many configurations were asked about: what a search costs, on any machine.

    Attributes:
        count: so far.
        contacts: that were found in them; of a configuration deep in something there are dozens, which cost more than
            the configuration itself.
    """

    count: int = 0
    contacts: int = 0

    @property
    def work(self) -> float:
        """What it costs, in configurations with hardly a contact."""
        return self.count + self.contacts / CONTACTS


class Checker:
    """Collision detection of one scene at one table pose; one for each thread, the scene may be shared."""

    scene: Scene
    table: tuple[float, float]
    reach: float
    asked: QueryCount
    _switched: Switched  # what collides is set in it; lent as long as a look lasts
    moving = 2  # of two things that get nearer to one another so many may be parts of the arm

    def __init__(
        self,
        scene: Scene,
        table: tuple[float, float],
        reach: float,
        without: Collection[int] = (),
        *,
        pair_gap: float | None = None,
        beside: Checker | None = None,
    ) -> None:
        """Prepare the model.

        Args:
            scene: the composed cell.
            table: E1 and E2, rad.
            reach: distances are known out to here, m.
            without: deposits that do not count, laid or not.
            pair_gap: NEVER where the pairs that the model names do not count; the reach where it is not given.
            beside: another one of the same scene, table and pair gap, in the same thread, whose data of MuJoCo's this
                one works with as well.
        """
        self.scene = scene
        self.table = table
        self.reach = reach
        self.without = tuple(without)
        self.asked = QueryCount()
        self._data: mujoco.MjData = mujoco.MjData(scene.model) if beside is None else beside._data
        self._data.qpos[scene.table_qpos] = table
        self.pair_gap = pair_gap
        self._hard = scene.contact_bits.any(axis=0).astype(np.float64)
        self._hard_body = np.zeros(scene.model.nbody)
        np.maximum.at(self._hard_body, scene.model.geom_bodyid, self._hard)
        self._away = np.array(() if pair_gap is None else _named_pairs(scene), dtype=np.int64)
        self._places_away = np.zeros((len(self._away), 3))
        self._places_away[:, 2] = AWAY * (1 + self._away)  # far from each other as well
        self._stand()  # what stands on the table stays there
        # where the table's axes move as well, all of it has to follow
        arm_alone = len(scene.arm_qpos) == scene.chain.n
        self._poses = ArmPoses(scene) if scene.model.ngeom > MANY_GEOMS and arm_alone else None
        self._broad_phase = BroadPhase.of(scene, self._data, self._poses) if arm_alone else None
        self._room: Floats = np.zeros(0)
        self._arm_body = np.zeros(scene.model.nbody, dtype=bool)
        self._arm_body[scene.model.geom_bodyid[scene.arm_geom]] = True
        self._body_contype = scene.body_contype
        self._ignored = np.isin(scene.deposit_of_geom, list(without))
        self._swept: MotionBounds | CoupledBounds | None = None
        self._far = -1.0
        self._qpos, self._arm_qpos = self._data.qpos, as_slice(scene.arm_qpos)

    def __reduce__(self) -> tuple[Any, ...]:
        """How a checker is pickled for another process: by its scene, from which it is made again there."""
        return _made, (self.scene, self.table, self.reach, self.without, self.pair_gap)

    def travel_bound(self, radius: Floats, a: Floats, b: Floats) -> Floats:
        """How far anything can travel towards anything on steps: what clearances at their ends are compared with.

        Args:
            radius: from ``cell.collision.proofs.reach_radii.radii``, (n,), m.
            a: where each step begins, (m, n), rad.
            b: where it ends, (m, n), rad.

        Returns:
            (m,), m.
        """
        bounds = self._bounds(radius)
        if bounds is None:
            return joint_travel_bound(radius, a, b)
        some = [
            bounds.bound(a[i : i + STEPS_TOGETHER], b[i : i + STEPS_TOGETHER], self.moving)
            for i in range(0, max(len(a), 1), STEPS_TOGETHER)
        ]
        return np.concatenate(some)

    def bend_bound(self, radius: Floats, turn: Floats) -> Floats:
        """How much the ways of things towards one another bend: their greatest second derivative on steps.

        A quadratic form of the turns. What it has for the sum of two motions beyond what it has for each is by how much
        one moves anything otherwise, at most, once the joints have turned by the other.

        Args:
            radius: from ``cell.collision.proofs.reach_radii.radii``, (n,), m.
            turn: of each joint on each step, no less than 0, (m, n), rad.

        Returns:
            (m,), m.
        """
        bounds = self._bounds(radius)
        return np.zeros(len(turn)) if bounds is None else bounds.bend(turn, self.moving)

    def _bounds(self, radius: Floats) -> MotionBounds | CoupledBounds | None:
        """Bounds that know where a step leads; None of what moves by arcs alone."""
        n, axes = self.scene.chain.n, len(self.scene.arm_qpos)
        if axes >= n and self._swept is None:
            arm = replace(self.scene, arm_qpos=self.scene.arm_qpos[:n])
            self._swept = MotionBounds(arm, radius) if axes == n else CoupledBounds(arm, radius)
        return self._swept

    def clearances(
        self, q: Floats, deposits_laid: Ints, met: Callable[[int, Ints, Floats], None] | None = None
    ) -> Clearances:
        """The nearest pair of every configuration.

        Args:
            q: configurations of the arm, (m, n), rad.
            deposits_laid: number of deposits already laid, (m,).
            met: called for every configuration in which something is near: its row, and ids (k, 2) and signed distances
                (k,), m, of all pairs that were found. It may keep none of these arrays.

        Returns:
            Clearances.
        """
        out = Clearances.none(len(q))
        far = self.reach  # what is near would be found by looking all the way, and everything behind it as well
        for i in self._each(q, deposits_laid):
            if count := self._collide(far):
                contact = self._data.contact
                distance = contact.dist
                k = int(distance.argmin())
                if 0.0 <= distance[k] < MAYBE_PENETRATES * self._far:  # it may penetrate: from near by this is known
                    count += self._collide(FURTHER * float(distance[k]) + LEAST_FAR)
                    k = int((distance := (contact := self._data.contact).dist).argmin())
                self.asked.contacts += count
                out.distance[i], out.pair[i], out.position[i] = distance[k], contact.geom[k], contact.pos[k]
                if met is not None:
                    met(i, contact.geom, distance)
                far = FURTHER * max(float(distance[k]), 0.0) + LEAST_FAR  # the next one is often alike
            else:
                far = self.reach
        return out

    def pairs_within(self, q: Floats, deposits_laid: Ints, far: Floats | float) -> NearPairs:
        """All pairs that come within some distance.

        Args:
            q: configurations of the arm, (m, n), rad.
            deposits_laid: number of deposits already laid, (m,).
            far: the distance in each, (m,), or one for all, m; it may be more than the reach.

        Returns:
            The pairs; every other is further apart.

        Raises:
            InputError: there are more of them than MuJoCo has room for.
        """
        found, out_to = [], np.broadcast_to(far, len(q))
        order = np.argsort(out_to, kind="stable")  # to set how far is looked costs as much as to look
        distances = out_to[order].tolist()
        for k in self._each(q[order], deposits_laid[order]):
            if count := self._look(distances[k]):
                self.asked.contacts += count
                c, i = self._data.contact, int(order[k])
                found.append((i, c.geom.copy(), c.dist.copy(), c.frame.reshape(-1, 9).copy(), c.pos.copy()))
        return NearPairs.of(found)

    def _each(self, q: Floats, deposits_laid: Ints) -> Iterator[int]:
        """Bring the arm into one configuration after the other, with what is laid by then: the row of each."""
        self.asked.count += len(q)
        with lent(self.scene.model) as self._switched:
            self._far = -1.0  # somebody else has had the copy meanwhile
            order = np.argsort(deposits_laid, kind="stable")
            some, laid, before = q[order], deposits_laid[order].tolist(), None
            rooms = repeat(self._room) if self._broad_phase is None else self._broad_phase.rooms(some)
            for i, now, room, _ in zip(order.tolist(), laid, rooms, self._put(some), strict=False):
                if now != before:
                    self._lay(before := now, arm_alone=True)
                self._room = room
                yield i
        if self._data.warning[mujoco.mjtWarning.mjWARN_CONTACTFULL].number:
            # pairs were left out: the nearest may be among them
            raise InputError(f"{self.scene.case.path}: more contacts at once than MuJoCo has room for")

    @property
    def ignored(self) -> Ints:
        """Geoms of deposits that do not count, laid or not, (k,)."""
        return np.flatnonzero(self._ignored)

    def nearest_pairs(self, q: Floats, deposits_laid: Ints) -> NearPairs:
        """Of every configuration the nearest pair, and others that are nearly as near.

        Args:
            q: configurations of the arm, (m, n), rad.
            deposits_laid: number of deposits already laid, (m,).

        Returns:
            The pairs; none of a configuration in which nothing is within the reach.
        """
        found, far = [], self.reach
        for i in self._each(q, deposits_laid):
            if count := self._collide(far):
                self.asked.contacts += count
                c = self._data.contact
                found.append((i, c.geom.copy(), c.dist.copy(), c.frame.reshape(-1, 9).copy(), c.pos.copy()))
                far = FURTHER * max(float(c.dist.min()), 0.0) + LEAST_FAR
            else:
                far = self.reach
        return NearPairs.of(found)

    def posed(self) -> mujoco.MjData:
        """MuJoCo's own data at the table's pose: of what does not move with the arm."""
        return self._data

    def of_tool(self, pair: Ints) -> NDArray[np.bool_]:
        """Whether a pair is what moves with the TCP against what is no part of the arm: alike in every configuration.

        Args:
            pair: ids of two geoms each, (m, 2); -1 where there is none.

        Returns:
            (m,) booleans.
        """
        tool, arm = self.scene.tool_geom[pair], self.scene.arm_geom[pair]
        alike: NDArray[np.bool_] = (tool[:, 0] & ~arm[:, 1]) | (tool[:, 1] & ~arm[:, 0])
        return alike & (pair >= 0).all(axis=1)

    def _collide(self, far: float) -> int:
        """Find what is near: first out to some distance, then further as long as there is nothing; how many pairs."""
        far = self._coarser(far)
        while True:
            count = self._look(far)
            if count or far == self.reach:
                return count
            far = self._coarser(2.0 * far)

    def _look(self, far: float) -> int:
        """Find all pairs out to some distance; how many."""
        self._look_out_to(far)
        if self._broad_phase is not None:
            self._broad_phase.select(self._switched.body_conaffinity, self._room, far)
        mujoco.mj_collision(self._switched.model, self._data)
        return int(self._data.ncon)

    def _coarser(self, far: float) -> float:
        """One of a few distances, at least as far; the reach is the furthest."""
        if far >= self.reach:
            return self.reach
        return self.reach * COARSER ** -math.floor(math.log(self.reach / far, COARSER) + 1e-9)

    def _look_out_to(self, far: float) -> None:
        """Set how far MuJoCo looks, m."""
        if far == self._far:
            return
        self._far = far
        switched = self._switched
        # it reports a pair out to the sum of its geoms' gaps, and of bodies further apart than this it reports none
        np.multiply(self._hard, far / 2, out=switched.geom_gap)
        np.multiply(self._hard_body, far / 2, out=switched.body_margin)
        switched.pair_gap.fill(far if self.pair_gap is None else self.pair_gap)

    def _put(self, q: Floats) -> Iterator[None]:
        """Bring the arm into one configuration after the other."""
        if self._poses is not None:
            yield from self._poses.put(self._data, q)
            return
        qpos, arm = self._qpos, self._arm_qpos
        for row in q:
            qpos[arm] = row
            self._stand()
            yield

    def _stand(self) -> None:
        """Have all of the cell stand as its joints do, but for shapes that are to be far from everything."""
        mujoco.mj_kinematics(self.scene.model, self._data)
        if len(self._away):
            self._data.geom_xpos[self._away] = self._places_away

    def _lay(self, deposits_laid: int, *, arm_alone: bool) -> None:
        """Let the deposits below a number collide, and no others: what is not there yet costs nothing.

        Nor does what stands on the table against the cell around it, if it is only the arm that moves.
        """
        scene, switched = self.scene, self._switched
        there = (scene.deposit_of_geom < deposits_laid) & ~self._ignored
        hits = there & scene.arm_geom if arm_alone else there
        # a pair collides where one's contype meets the other's conaffinity: the arm's own meet all there is
        switched.geom_contype[:] = np.where(hits, scene.contact_bits[0], 0)
        switched.geom_conaffinity[:] = np.where(there, scene.contact_bits[1], 0)
        switched.body_conaffinity[:] = scene.body_conaffinity
        switched.body_contype[:] = np.where(self._arm_body, self._body_contype, 0) if arm_alone else self._body_contype


def _made(
    scene: Scene, table: tuple[float, float], reach: float, without: tuple[int, ...], pair_gap: float | None
) -> Checker:
    """A checker where it was sent to."""
    return Checker(scene, table, reach, without, pair_gap=pair_gap)
