"""A clearance proved along a motion from few configurations, by planes that separate two shapes.

    proofs = proofs_of(checker)                      # None where the table moves as well
    proved = proofs.along(q, step, laid, wanted, bend)    # steps of q (m, n) rad, wanted and bend m
    proved.kept, proved.seen                         # what is kept on each, and what was seen where it was looked

Two shapes that are apart in one configuration are separated by a plane across the line between their nearest points.
The plane stays where it is, in the world or on the link nearer to the base, and the other shape moves: how far it stays
on its side is a product of its corners with the plane's normal, which many configurations take in one array. A pair
that is no nearer than ``far`` there approaches by its travel at most.

Between two samples a point of the arm is off the straight line between its places there by an eighth of its greatest
second derivative at most (``motion_bounds``): what holds at both ends holds between them, less that.
A proof holds whatever plane it uses. One thing is taken from the collision engine, as everywhere: a pair that it does
not report is no nearer than ``far``. Metres, radians.
"""

from __future__ import annotations

import weakref
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ...arrays import Ints
from ..checker import COARSER, Checker
from ..clearances import Clearances
from ..near_pairs import NearPairs
from ..pair_groups import PairGroupChecker, pair_groups
from .carried_planes import CarriedPlanes, PairsBelow, StepBends, pairs_below
from .covered_pairs import covered_pairs
from .link_poses import ArmLinks, LinkPoses
from .motion_bounds import OFF_PARABOLA, change_of_curvature, curvature
from .reach_radii import radii
from .shared_planes import ONE_PLANE, SeparatingPlanes, SharedPlanes
from .sheet_pieces import SheetPieces
from .step_clusters import StepClusters, gather_steps

SPACINGS = (0.2, 0.1, 0.05, 0.02, 0.0)  # m of travel between the samples that are checked, one after the other
FEW_SHAPES = 100  # that stand still, beyond which looks as far out as the widest spacing asks for cost too much
BEYOND_STILL, BEYOND_ITSELF = 0.16, 0.2  # m: how much further than what is wanted is looked out to at most
COVERED = 2  # spacings at which what is laid is taken as a whole first, where it has many shapes
ROOM = 2e-3  # m that is looked further out than the arm's travel asks for: what is between samples is taken off
LESS = 1e-8  # m, of rounding


@dataclass(frozen=True, eq=False)
class ProvedSteps:
    """What is proved of steps of a motion.

    Attributes:
        kept: no pair is nearer than this on each, (k,), m.
        seen: nearest pairs at the samples that were checked, (m,); nothing at all others.
    """

    kept: Floats
    seen: Clearances


@dataclass(frozen=True, eq=False)
class _SeenClusters:
    """What was seen at the samples of clusters that were checked.

    Attributes:
        near: pairs there.
        far: distance out to which was looked, (c,), m.
        travel: how far any point of the arm is at most from where it is there, at the samples, (t,), m; of two that
            both may move twice that.
        within: those of the samples at which it is little enough for something to be proved, ascending, (w,).
    """

    near: NearPairs
    far: Floats
    travel: Floats
    within: Ints


class PlaneProofs:
    """Proofs for the arm of one checker, at a table that stands."""

    def __init__(
        self,
        checker: Checker,
        *,
        spacings: tuple[float, ...] | None = None,
        beyond: tuple[float, float] = (BEYOND_STILL, BEYOND_ITSELF),
        one_plane: float = ONE_PLANE,
        covered: bool | None = None,
    ) -> None:
        """Prepare.

        Args:
            checker: of all pairs, of an arm at a table that stands.
            spacings: travel between samples that are checked, one after the other, m; what suits the scene where left
                out.
            beyond: how much further than what is wanted is looked out to at most, of what stands still and of the arm
                itself, m.
            one_plane: shapes that reach no further over a plane than this share it, m.
            covered: whether what is laid is taken as a whole first; where left out, if it may have many shapes.
        """
        still_shapes = checker.scene.contact_bits.any(axis=0) & ~checker.scene.arm_geom
        many = bool(still_shapes.sum() > FEW_SHAPES)
        self._covered = many if covered is None else covered
        suited = SPACINGS[1:] if many else SPACINGS
        self._spacings = suited if spacings is None else spacings
        still, itself = pair_groups(checker)
        self._groups = ((still, 1.0, beyond[0]), (itself, 2.0, beyond[1]))
        self._radius = radii(checker.scene)
        self._links = ArmLinks(checker)
        self._carried, self._shared = CarriedPlanes(self._links), SharedPlanes(self._links, one_plane)

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
        found, bent = self._whole(q, step, laid, (least, share), bend)
        nearest = share * float(found.seen.distance.min(initial=np.inf))
        least = np.maximum(least, nearest) if np.isfinite(nearest) else least
        near = np.minimum(found.seen.distance[step], found.seen.distance[step + 1])
        # what is too near at an end is no further off in the middle
        again = np.flatnonzero((found.kept < least) & (bent > bend) & (near >= least))
        if len(again):
            parts = np.ceil(np.sqrt(bent[again] / bend)).astype(np.int64)
            finer = self._in_parts(q, step[again], laid[again], (least[again], share), parts)
            found.kept[again] = np.maximum(found.kept[again], finer.kept)
            found.seen.nearer(np.arange(len(q)), finer.seen)
        return found

    def of_pieces(self, q: Floats, pieces: SheetPieces, wanted: float, spacings: Sequence[float]) -> Floats:
        """What is kept on pieces of which only the corners are samples.

        Args:
            q: samples, (m, n), rad.
            pieces: of k.
            wanted: clearance that is wanted, m: where it is proved no more is asked for.
            spacings: travel between samples that are checked, one after the other, m.

        Returns:
            No pair is nearer than this on each, (k,), m.
        """
        poses, bend = self._links.poses(q), pieces.off(self._radius)
        places, kept = self._links.places(poses), np.full(len(pieces.laid), np.inf)
        for group, share, beyond in self._groups:
            mine = np.full(len(kept), -np.inf)
            for spacing, covered in self._tries(group, spacings):
                open_ = np.flatnonzero((mine < wanted) & (kept >= wanted))
                if not len(open_):
                    break
                some = pieces.rows(open_)
                clusters, of = some.clusters(places, spacing)
                asked = (share, wanted, wanted + share * float(bend[open_].max()), beyond)
                near = group.nearest_pairs(q[clusters.at], clusters.laid) if covered else None
                look = self._look(group, q, poses, clusters, asked, near)
                value, _, frames = self._values(poses, clusters, look, wanted, None)
                off = np.maximum.reduce([share * bend[open_], *(some.off(self._radius, i) for i in frames)])
                mine[open_] = np.maximum(mine[open_], value[of].min(axis=1) - off)
            kept = np.minimum(kept, mine)
        return kept

    def _bend(self, poses: LinkPoses, halfway: LinkPoses, step: Ints, turn: Floats) -> Floats:
        """How far any point of the arm is off the straight line between its places at the ends of steps, (k,), m.

        That is measured half-way. The parabola through all three places is as far off at most, and the way off the
        parabola by the third derivative times |t (t - 1/2) (t - 1)| / 6, which is a ``OFF_PARABOLA`` at most.
        """
        away = self._links.off_middle(poses, halfway, step)
        measured = away + OFF_PARABOLA * change_of_curvature(self._radius, turn)
        return np.minimum(curvature(self._radius, turn) / 8, measured)

    def _bend_seen(self, turn: Floats, link: int) -> Floats:
        """The same as it is seen from a link, from which only the joints after it turn."""
        return curvature(self._radius[link + 1 :], turn[:, link + 1 :]) / 8

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
        found, _ = self._whole(finer, at, laid[of], (wanted[0][of], wanted[1]), np.inf)
        seen = Clearances.none(len(q))
        sample = np.full(len(finer), -1)
        sample[at[first]], sample[last] = step, step[ends] + 1
        there = np.flatnonzero(sample >= 0)
        seen.put(sample[there], found.seen.rows(there))
        return ProvedSteps(np.minimum.reduceat(found.kept, first), seen)

    def _whole(
        self, q: Floats, step: Ints, laid: Ints, wanted: tuple[Floats, float], most_bend: float
    ) -> tuple[ProvedSteps, Floats]:
        """What is proved of steps as they are, and what was taken off for what is between their ends, (k,), m.

        Where that is more than ``most_bend`` and is all that is missing, nothing more is checked.
        """
        kept, seen = np.full(len(step), np.inf), Clearances.none(len(q))
        turn, links = np.abs(q[step + 1] - q[step]), self._links
        poses, halfway = links.poses(q), links.poses((q[step] + q[step + 1]) / 2)
        places, bends = links.places(poses), StepBends(poses, halfway, step, turn)
        bend, least = self._bend(poses, halfway, step, turn), wanted[0]
        bent = bend.copy()
        for group, share, beyond in self._groups:
            mine, at_ends = np.full(len(step), -np.inf), np.full(len(step), -np.inf)
            tries = self._tries(group, self._spacings)
            for spacing, covered in tries:
                least = self._aim(wanted, seen)
                # where both ends are far enough off, another look helps less than another sample between them
                open_ = np.flatnonzero((mine < least) & ~((bent > most_bend) & (at_ends >= least)))
                if not len(open_):
                    break
                clusters, of = gather_steps(places, step[open_], laid[open_], spacing)
                near = group.nearest_pairs(q[clusters.at], clusters.laid) if covered else None
                if near is not None:
                    seen.nearer(clusters.at, near.nearest(len(clusters.at)))
                    least = self._aim(wanted, seen)
                most = float(least[open_].max())
                # what this look does not prove, the last one tells as well as it can
                lowest = -np.inf if (spacing, covered) == tries[-1] else float(least[open_].min())
                look = self._look(group, q, poses, clusters, (share, lowest, most, beyond), near)
                if near is None:
                    seen.nearer(clusters.at, look.near.nearest(len(clusters.at)))
                value, carried, frames = self._values(poses, clusters, look, most, None if group.itself else bends)
                off = np.maximum.reduce([share * bend[open_], *(self._bend_seen(turn[open_], i) for i in frames)])
                value, carried = (np.minimum(each[of], each[of + 1]) for each in (value, carried))
                at_ends[open_] = np.maximum(at_ends[open_], np.minimum(value, carried))
                mine[open_] = np.maximum(mine[open_], np.minimum(value - off, carried))
                bent[open_] = np.maximum(bent[open_], off)
            kept = np.minimum(kept, mine)
        return ProvedSteps(kept, seen), bent

    def _tries(self, group: PairGroupChecker, spacings: Sequence[float]) -> list[tuple[float, bool]]:
        """Spacings one after the other, and whether what is laid is taken as a whole there."""
        one_by_one = [(spacing, False) for spacing in spacings]
        if group.itself or not self._covered:
            return one_by_one
        return [(spacing, True) for spacing in spacings[:COVERED]] + one_by_one

    def _aim(self, wanted: tuple[Floats, float], seen: Clearances) -> Floats:
        """What is wanted, and a share of the least that was seen as well."""
        nearest = wanted[1] * float(seen.distance.min(initial=np.inf))
        return np.maximum(wanted[0], nearest) if np.isfinite(nearest) else wanted[0]

    def _look(
        self,
        group: PairGroupChecker,
        q: Floats,
        poses: LinkPoses,
        clusters: StepClusters,
        asked: tuple[float, float, float, float],
        seen: NearPairs | None = None,
    ) -> _SeenClusters:
        """Check the samples of clusters, as far out as the arm's travel in each asks for.

        Args:
            group: pairs that count.
            q: samples, (m, n), rad.
            poses: at the samples.
            clusters: of steps.
            asked: what counts of the arm's travel, what is wanted at least and at most, and how much further is looked
                at most, m.
            seen: pairs at those samples; where they are given, what is laid is taken as a whole.
        """
        share, least, wanted, beyond = asked
        travel = share * self._links.travel(poses, clusters.sample, clusters.at[clusters.cluster])
        most = np.zeros(len(clusters.at))
        np.maximum.at(most, clusters.cluster, travel)
        level = np.ceil(np.log(wanted + most + ROOM) / np.log(COARSER))
        far = np.minimum(COARSER**level, wanted + beyond)
        # what may come in from further away than was looked is too near: of such samples nothing is asked
        within = np.flatnonzero(far[clusters.cluster] - travel >= least)
        if seen is None:
            return _SeenClusters(group.pairs_within(q[clusters.at], clusters.laid, far), far, travel, within)
        others = group.pairs_within(q[clusters.at], np.zeros_like(clusters.laid), far)
        return _SeenClusters(others.joined(covered_pairs(self._links, poses, clusters, seen, far)), far, travel, within)

    def _values(
        self, poses: LinkPoses, clusters: StepClusters, look: _SeenClusters, wanted: float, bends: StepBends | None
    ) -> tuple[Floats, Floats, list[int]]:
        """What the pairs keep at least at the samples of clusters.

        Args:
            poses: at the samples.
            clusters: of steps.
            look: what was seen at the samples that were checked.
            wanted: what is wanted, m.
            bends: of the steps, where planes may be carried.

        Returns:
            What is kept at the samples, (t,), m; what those pairs keep on the steps to and from the samples whose
            planes are carried along, (t,), m; and the links with which the other planes move.
        """
        near, travel, within = look.near, look.travel[look.within], look.within
        out, carried = np.full(len(look.travel), -np.inf), np.full(len(look.travel), np.inf)
        clusters = StepClusters(clusters.at, clusters.laid, clusters.cluster[within], clusters.sample[within])
        most = np.full(len(clusters.at), -np.inf)
        np.maximum.at(most, clusters.cluster, travel)
        # what stays far enough off by its travel alone needs no plane
        off = near.distance - most[near.row] >= wanted
        far = look.far.copy()
        np.minimum.at(far, near.row[off], near.distance[off])
        out[within] = far[clusters.cluster] - travel
        which_pairs = np.flatnonzero(~off)
        below = pairs_below(self._links, near, which_pairs)
        planes = self._shared.between(poses, clusters, below, near.distance[which_pairs])
        which, at = clusters.samples_of(planes.cluster)
        over = self._shared.over(poses, planes, which, clusters.sample[at])
        if bends is not None:
            least = np.full(len(planes.cluster), np.inf)
            np.minimum.at(least, which, over)
            held = self._held(poses, clusters, (planes, least), below, (wanted, bends))
            np.minimum.at(carried, within[held[1]], held[2] - LESS)
            stay = ~held[0][which]
            at, over = at[stay], over[stay]
        np.minimum.at(out, within[at], over)
        return out - LESS, carried, np.unique(planes.frame[planes.frame >= 0]).tolist()

    def _held(
        self,
        poses: LinkPoses,
        clusters: StepClusters,
        known: tuple[SeparatingPlanes, Floats],
        pairs: PairsBelow,
        asked: tuple[float, StepBends],
    ) -> tuple[NDArray[np.bool_], Ints, Floats]:
        """Planes that still and others that are carried along, where that is better.

        Returns:
            Planes in place of which others are carried, (p,); places among the samples, and what is held there.
        """
        (planes, least), (wanted, bends) = known, asked
        key, of_pair = (each.cluster * len(self._links.owner) + each.geom for each in (planes, pairs))
        keys = np.setdiff1d(key[least < wanted], of_pair[self._endless(pairs.other)])
        mine = np.flatnonzero(np.isin(of_pair, keys))
        if not len(mine):
            return np.zeros(len(key), dtype=bool), mine, np.zeros(0)
        some = PairsBelow(pairs.cluster[mine], pairs.geom[mine], pairs.other[mine], pairs.normal[mine])
        which, at, value = self._carried.over(poses, bends, some, clusters)
        still, moving = np.full(len(keys), np.inf), np.full(len(keys), np.inf)
        there = np.isin(key, keys)
        np.minimum.at(still, np.searchsorted(keys, key[there]), least[there])
        of = np.searchsorted(keys, of_pair[mine])[which]
        np.minimum.at(moving, of, value)
        better = moving > still
        taken = better[of]
        return np.isin(key, keys[better]), at[taken], value[taken]

    def _endless(self, geom: Ints) -> NDArray[np.bool_]:
        """Which shapes have no end, (k,)."""
        each, of = np.unique(geom, return_inverse=True)
        return np.array([self._links.shape(g).endless for g in each.tolist()], dtype=bool)[of]


_made: weakref.WeakKeyDictionary[Checker, PlaneProofs] = weakref.WeakKeyDictionary()


def has_proofs(checker: object) -> bool:
    """Whether a checker has such proofs: it checks all pairs, and the table stands."""
    if not isinstance(checker, Checker) or isinstance(checker, PairGroupChecker):
        return False
    return len(checker.scene.arm_qpos) == checker.scene.chain.n


def proofs_of(checker: object) -> PlaneProofs | None:
    """The proofs of a checker, made once, when they are asked for first; None where there are none."""
    if not isinstance(checker, Checker) or not has_proofs(checker):
        return None
    if checker not in _made:
        _made[checker] = PlaneProofs(checker)
    return _made[checker]
