"""A clearance proved along a motion from a few configurations, by planes that two shapes lie on either side of.

    proofs = proofs_of(checker)                      # None where the table moves as well
    proved = proofs.along(q, step, laid, wanted)     # steps of q (m, n) rad, wanted m
    proved.kept, proved.seen                         # what is kept on each, and what was seen where it was looked

What is apart in one configuration is told apart by a plane across the way between its nearest points. The plane stays
where it is, in the world or on the link nearer to the base, and the other shape moves: how far it stays on its side is
a product of its corners with the plane's normal, which many configurations take in one array. What is no nearer than
``far`` there has come nearer by its travel at most.

Between two samples a point of the arm is off the straight line between its places there by an eighth of its greatest
second derivative at most (``motion_bounds``): what holds at both ends holds between them, less that.
A plane proves what it proves whoever named it: of the collision engine only that is taken on trust that nothing is
nearer than ``far`` of what it does not report, as everywhere. Metres, radians.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ...arrays import Ints
from ..checker import Checker
from ..clearances import Clearances
from ..near_pairs import NearPairs
from ..pair_groups import PairGroup
from .convex_shapes import ConvexShape, convex_shape
from .motion_bounds import change_of_curvature, curvature
from .proof_cells import Cells, cells_of
from .reach_radii import radii

SPACINGS = (0.08, 0.04, 0.02, 0.01, 0.0)  # m of travel between the samples that are looked at, one after the other
BEYOND_STILL, BEYOND_ITSELF = 0.03, 0.1  # m: how much further than what is wanted is looked out to
LESS = 1e-8  # m, of rounding
ONE_PLANE = 2e-4  # m: shapes that reach no further over a plane than this share it
WORLD = -1


@dataclass(frozen=True, eq=False)
class ProvedSteps:
    """What is proved of steps of a motion.

    Attributes:
        kept: no pair is nearer than this on each, (k,), m.
        seen: nearest pairs at the samples that were looked at, (m,); nothing at all others.
    """

    kept: Floats
    seen: Clearances


@dataclass(frozen=True, eq=False)
class _LinkPoses:
    """Where the arm's links are at samples, base frame.

    Attributes:
        R: of the joints' frames, (m, n, 3, 3).
        p: (m, n, 3), m.
        centres: of the arm's shapes, (m, g, 3), m.
    """

    R: Floats
    p: Floats
    centres: Floats


@dataclass(frozen=True, eq=False)
class _Planes:
    """Planes, each between some shape of the arm and what is on its other side.

    Attributes:
        cell: whose they are, (p,).
        geom: the shape of the arm, (p,).
        frame: joint with whose link the plane moves, (p,), or WORLD.
        normal: in that frame, towards the shape, (p, 3).
        offset: how far what is on the other side reaches along it, (p,), m.
    """

    cell: Ints
    geom: Ints
    frame: Ints
    normal: Floats
    offset: Floats


class PlaneProofs:
    """Proofs for the arm of one checker, at a table that stands."""

    def __init__(
        self,
        checker: Checker,
        *,
        spacings: tuple[float, ...] = SPACINGS,
        beyond: tuple[float, float] = (BEYOND_STILL, BEYOND_ITSELF),
        one_plane: float = ONE_PLANE,
    ) -> None:
        """Prepare.

        Args:
            checker: of all pairs, of an arm at a table that stands.
            spacings: travel between samples that are looked at, one after the other, m.
            beyond: how much further than what is wanted is looked out to, of what stands still and the arm itself, m.
            one_plane: shapes that reach no further over a plane than this share it, m.
        """
        self._spacings, self._one_plane = spacings, one_plane
        scene = self._scene = checker.scene
        self._chain = scene.chain
        solid = scene.arm_geom & scene.contact_bits.any(axis=0)
        still = PairGroup(checker, itself=False)
        itself = PairGroup(checker, itself=True, beside=still)
        self._groups = ((still, 1.0, beyond[0]), (itself, 2.0, beyond[1]))
        self._radius = radii(scene)
        self._T_world_base = scene.T_world_base()
        self._owner, self._shapes = _arm_shapes(checker, solid)
        self._moving = np.flatnonzero(solid)
        self._centre = np.stack([self._shapes[g].middle for g in self._moving.tolist()])
        self._size = np.array([self._shapes[g].size for g in self._moving.tolist()])
        self._outer = _furthest_out(self._owner[self._moving], np.linalg.norm(self._centre, axis=1) + self._size)
        self._still: dict[int, ConvexShape] = {}
        self._data = checker.posed()

    def along(
        self, q: Floats, step: Ints, laid: Ints, wanted: Floats | float, bend: float, share: float = 0.0
    ) -> ProvedSteps:
        """Prove what can be proved.

        Args:
            q: samples, (m, n), rad.
            step: steps in question by their first samples, ascending, (k,).
            laid: deposits laid on each, (k,).
            wanted: clearance that is wanted, (k,) or one for all, m: where it is proved no more is asked for.
            bend: how much of it may be given for what is between samples, m; steps are divided until that is enough.
            share: of the least that is seen is wanted as well.

        Returns:
            What is proved of the steps.
        """
        if not len(step):
            return ProvedSteps(np.zeros(0), Clearances.none(len(q)))
        least = np.broadcast_to(np.asarray(wanted, dtype=float), len(step))
        rows = np.flatnonzero(np.bincount(step, minlength=len(q)) + np.bincount(step + 1, minlength=len(q)))
        if len(rows) < len(q):
            found = self.along(q[rows], np.searchsorted(rows, step), laid, least, bend, share)
            seen = Clearances.none(len(q))
            seen.put(rows, found.seen)
            return ProvedSteps(found.kept, seen)
        turn = np.abs(q[step + 1] - q[step])
        parts = np.maximum(np.ceil(np.sqrt(curvature(self._radius, turn) / 8 / bend)), 1).astype(np.int64)
        found = self._whole(q, step, laid, (least, share), parts > 1)
        nearest = share * float(found.seen.distance.min(initial=np.inf))
        least = np.maximum(least, nearest) if np.isfinite(nearest) else least
        near = np.minimum(found.seen.distance[step], found.seen.distance[step + 1])
        # what is too near at an end is no further off in the middle
        again = np.flatnonzero((found.kept < least) & (parts > 1) & (near >= least))
        if len(again):
            finer = self._in_parts(q, step[again], laid[again], (least[again], share), parts[again])
            found.kept[again] = np.maximum(found.kept[again], finer.kept)
            found.seen.nearer(np.arange(len(q)), finer.seen)
        return found

    def _bend(self, q: Floats, step: Ints, poses: _LinkPoses) -> Floats:
        """How far any point of the arm is off the straight line between its places at the ends of steps, (k,), m.

        That is measured half-way: elsewhere the second derivative is another one by the third at most.
        """
        turn = np.abs(q[step + 1] - q[step])
        halfway = self._poses((q[step] + q[step + 1]) / 2)
        off = halfway.centres - (poses.centres[step] + poses.centres[step + 1]) / 2
        skew = halfway.R - (poses.R[step] + poses.R[step + 1]) / 2
        # of what is 1 from its centre
        turned = np.sqrt((skew**2).sum(axis=(2, 3)))
        away = np.sqrt((off**2).sum(axis=2)) + turned[:, self._owner[self._moving]] * self._size
        measured = away.max(axis=1) + change_of_curvature(self._radius, turn) / 8
        return np.minimum(curvature(self._radius, turn) / 8, measured)

    def _bend_seen(self, q: Floats, step: Ints, link: int) -> Floats:
        """The same as it is seen from a link, from which only the joints after it turn."""
        turn = np.abs(q[step + 1] - q[step])[:, link + 1 :]
        return curvature(self._radius[link + 1 :], turn) / 8

    def _in_parts(self, q: Floats, step: Ints, laid: Ints, wanted: tuple[Floats, float], parts: Ints) -> ProvedSteps:
        """The same with steps divided into equal parts."""
        of = np.repeat(np.arange(len(step)), parts)
        first = np.cumsum(parts) - parts
        ends = np.append((np.diff(step) != 1), True)  # a run's last sample belongs to no further step
        shift = np.concatenate([[0], np.cumsum(ends)[:-1]])
        share = (np.arange(len(of)) - first[of]) / parts[of]
        finer = np.empty((len(of) + int(ends.sum()), q.shape[1]))
        at = np.arange(len(of)) + shift[of]
        finer[at] = q[step[of]] + share[:, None] * (q[step[of] + 1] - q[step[of]])
        last = (first + parts)[ends] + shift[ends]
        finer[last] = q[step[ends] + 1]
        found = self._whole(finer, at, laid[of], (wanted[0][of], wanted[1]), np.zeros(len(at), dtype=bool))
        seen = Clearances.none(len(q))
        sample = np.full(len(finer), -1)
        sample[at[first]], sample[last] = step, step[ends] + 1
        there = np.flatnonzero(sample >= 0)
        seen.put(sample[there], found.seen.rows(there))
        return ProvedSteps(np.minimum.reduceat(found.kept, first), seen)

    def _whole(
        self, q: Floats, step: Ints, laid: Ints, wanted: tuple[Floats, float], divisible: NDArray[np.bool_]
    ) -> ProvedSteps:
        """What is proved of steps as they are; of those that can be divided not all that could be."""
        kept, seen = np.full(len(step), np.inf), Clearances.none(len(q))
        poses = self._poses(q)
        places = poses.centres[:, self._outer].reshape(len(q), -1)
        bend = self._bend(q, step, poses)
        least = wanted[0]
        for group, share, beyond in self._groups:
            mine, at_ends = np.full(len(step), -np.inf), np.full(len(step), -np.inf)
            for spacing in self._spacings:
                nearest = wanted[1] * float(seen.distance.min())
                if np.isfinite(nearest):
                    least = np.maximum(wanted[0], nearest)
                # where both ends are far enough off, another look helps less than another sample between them
                open_ = np.flatnonzero((mine < least) & ~(divisible & (at_ends >= least)))
                if not len(open_):
                    break
                most = float(least[open_].max())
                cells, of = cells_of(places, step[open_], laid[open_], spacing, most + beyond)
                near = group.pairs_within(q[cells.at], cells.laid, cells.far)
                seen.nearer(cells.at, near.nearest(len(cells.at)))
                value, links = self._values(poses, cells, near, share, most)
                bent = share * bend[open_]
                for link in links:
                    bent = np.maximum(bent, self._bend_seen(q, step[open_], link))
                value = np.minimum(value[of], value[of + 1])
                at_ends[open_] = np.maximum(at_ends[open_], value)
                mine[open_] = np.maximum(mine[open_], value - bent)
            kept = np.minimum(kept, mine)
        return ProvedSteps(kept, seen)

    def _poses(self, q: Floats) -> _LinkPoses:
        R, p = self._chain.frames(q)
        joint = self._owner[self._moving]
        centres = np.empty((len(q), len(joint), 3))
        for j in np.unique(joint).tolist():
            mine = joint == j
            centres[:, mine] = self._centre[mine] @ np.swapaxes(R[:, j], -1, -2) + p[:, j, None]
        return _LinkPoses(R, p, centres)

    def _values(
        self, poses: _LinkPoses, cells: Cells, near: NearPairs, share: float, wanted: float
    ) -> tuple[Floats, list[int]]:
        """What the pairs keep at least at the samples of cells, (t,), m; and the links with which planes move."""
        travel = share * self._travel(poses, cells)
        most = np.zeros(len(cells.at))
        np.maximum.at(most, cells.cell, travel)
        # what stays far enough off by its travel alone needs no plane
        off = near.distance - most[near.row] >= wanted
        far = np.full(len(cells.at), cells.far)
        np.minimum.at(far, near.row[off], near.distance[off])
        out = far[cells.cell] - travel
        planes = self._planes(poses, cells, near, np.flatnonzero(~off))
        first = np.searchsorted(cells.cell, np.arange(len(cells.at) + 1))
        count = np.diff(first)[planes.cell]
        which = np.repeat(np.arange(len(planes.cell)), count)
        at = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count) + first[planes.cell][which]
        np.minimum.at(out, at, self._over(poses, planes, which, cells.sample[at]))
        return out - LESS, np.unique(planes.frame[planes.frame >= 0]).tolist()

    def _travel(self, poses: _LinkPoses, cells: Cells) -> Floats:
        """How far any point of the arm is at most from where it is at the sample that is looked at, (t,), m."""
        a, b = cells.sample, cells.at[cells.cell]
        # the chord of a turn, of what is 1 from its centre
        chord = np.sqrt(((poses.R[a] - poses.R[b]) ** 2).sum(axis=(2, 3)) / 2.0)
        away = np.sqrt(((poses.centres[a] - poses.centres[b]) ** 2).sum(axis=2))
        out: Floats = (away + chord[:, self._owner[self._moving]] * self._size).max(axis=1)
        return out

    def _planes(self, poses: _LinkPoses, cells: Cells, near: NearPairs, which: Ints) -> _Planes:
        """Planes between pairs: one for all that a shape of the arm has on the other side, where one will do."""
        geom, cell = near.geom[which], near.row[which]
        owner = self._owner[geom]
        swap = owner[:, 1] > owner[:, 0]
        a, b = np.where(swap, geom[:, 1], geom[:, 0]), np.where(swap, geom[:, 0], geom[:, 1])
        frame = np.minimum(owner[:, 0], owner[:, 1])
        # from what is on the other side towards the shape
        normal = np.where(swap[:, None], near.normal[which], -near.normal[which]) @ self._T_world_base[:3, :3]
        on_link = np.flatnonzero(frame >= 0)
        R = poses.R[cells.at[cell[on_link]], frame[on_link]]
        normal[on_link] = np.einsum("kij,ki->kj", R, normal[on_link])
        order = np.lexsort((near.distance[which], frame, a, cell))
        a, b, cell, frame, normal = a[order], b[order], cell[order], frame[order], normal[order]
        new = np.append(True, (np.diff(cell) != 0) | (np.diff(a) != 0) | (np.diff(frame) != 0))[: len(a)]
        leads = np.flatnonzero(new)
        leader = leads[np.cumsum(new) - 1] if len(leads) else leads
        under = self._reach(b, frame, normal[leader])
        shares = under <= under[leader] + self._one_plane
        offset = np.full(len(a), -np.inf)
        np.maximum.at(offset, leader[shares], under[shares])
        alone = np.flatnonzero(~shares)
        offset[alone] = self._reach(b[alone], frame[alone], normal[alone])
        kept = new | ~shares
        return _Planes(cell[kept], a[kept], frame[kept], normal[kept], offset[kept])

    def _reach(self, geom: Ints, frame: Ints, normal: Floats) -> Floats:
        """How far shapes reach along normals, each in the frame of its plane, (p,), m."""
        out = np.empty(len(geom))
        for g in np.unique(geom).tolist():
            mine = geom == g
            out[mine] = self._shape(g).support(normal[mine])
        return out

    def _shape(self, geom: int) -> ConvexShape:
        """A shape in the frame of its joint; of what stands still in the base frame."""
        if self._owner[geom] >= 0:
            return self._shapes[geom]
        if geom not in self._still:
            base = self._T_world_base
            R = base[:3, :3].T @ self._data.geom_xmat[geom].reshape(3, 3)
            p = base[:3, :3].T @ (self._data.geom_xpos[geom] - base[:3, 3])
            self._still[geom] = convex_shape(self._scene.model, geom, R, p)
        return self._still[geom]

    def _over(self, poses: _LinkPoses, planes: _Planes, which: Ints, sample: Ints) -> Floats:
        """How far shapes are on their side of planes at samples, (c,), m."""
        geom, frame, normal = planes.geom[which], planes.frame[which], planes.normal[which]
        joint = self._owner[geom]
        off = poses.p[sample, joint]
        link = np.flatnonzero(frame >= 0)
        if len(link):
            normal[link] = np.einsum("kij,kj->ki", poses.R[sample[link], frame[link]], normal[link])
            off[link] -= poses.p[sample[link], frame[link]]
        out = np.einsum("ki,ki->k", normal, off) - planes.offset[which]
        own = np.einsum("kij,ki->kj", poses.R[sample, joint], normal)
        for g in np.unique(geom).tolist():
            mine = geom == g
            out[mine] -= self._shapes[g].support(-own[mine])
        return out


_made: weakref.WeakKeyDictionary[Checker, PlaneProofs] = weakref.WeakKeyDictionary()


def proofs_of(checker: object) -> PlaneProofs | None:
    """The proofs of a checker, made once; None unless it is of all pairs, of an arm at a table that stands."""
    if not isinstance(checker, Checker) or isinstance(checker, PairGroup):
        return None
    if len(checker.scene.arm_qpos) != checker.scene.chain.n:
        return None
    if checker not in _made:
        _made[checker] = PlaneProofs(checker)
    return _made[checker]


def _furthest_out(joint: Ints, reach: Floats) -> Ints:
    """Of each link the shape that reaches furthest from its joint; joint and reach of each shape, (g,)."""
    order = np.lexsort((-reach, joint))
    return np.asarray(order[np.unique(joint[order], return_index=True)[1]])


def _arm_shapes(checker: Checker, solid: NDArray[np.bool_]) -> tuple[Ints, dict[int, ConvexShape]]:
    """Joint that carries each geom, (ngeom,), or WORLD, and the arm's shapes in the frames of their joints."""
    scene = checker.scene
    model, base = scene.model, scene.T_world_base()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    joint = {int(body): i for i, body in enumerate(model.jnt_bodyid[scene.arm_joints])}
    R, p = (x[0] for x in scene.chain.frames(data.qpos[scene.arm_qpos][None]))
    owner, shapes = np.full(model.ngeom, WORLD), {}
    for g in np.flatnonzero(solid).tolist():
        body = int(model.geom_bodyid[g])
        while body not in joint:
            body = int(model.body_parentid[body])
        i = owner[g] = joint[body]
        turn = (base[:3, :3] @ R[i]).T
        place = R[i].T @ (base[:3, :3].T @ (data.geom_xpos[g] - base[:3, 3]) - p[i])
        shapes[g] = convex_shape(model, g, turn @ data.geom_xmat[g].reshape(3, 3), place)
    return owner, shapes
