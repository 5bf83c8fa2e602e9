"""Separating planes that are fixed to a link of the arm and move with it.

    held = CarriedPlanes(links).over(poses, bends, pairs, clusters)       # of each pair at each sample of its cluster

Over a curved part, a plane that is fixed in the world separates the torch from the part for a few millimetres of its
path only. A plane fixed to the torch turns with it, as the part's surface does. How far a shape that stands still
reaches over the plane is the scalar product of its corners with the normal in each configuration. Seen from the link,
this shape moves on a curve. Its distance from the straight line between its places at the ends of a step is bounded by
the one measured half-way and by the third derivative. Metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ...arrays import Ints
from ..near_pairs import NearPairs
from .link_poses import ArmLinks, LinkPoses, as_seen, seen_from
from .motion_bounds import OFF_PARABOLA
from .step_clusters import StepClusters


@dataclass(frozen=True, eq=False)
class PairsBelow:
    """Pairs of a shape of the arm and what stands still.

    Attributes:
        cluster: whose they are, (p,).
        geom: the shape of the arm, (p,).
        other: what stands still, (p,).
        normal: from that towards the shape in the sample that was checked, base frame, (p, 3).
    """

    cluster: Ints
    geom: Ints
    other: Ints
    normal: Floats


def pairs_below(links: ArmLinks, near: NearPairs, which: Ints) -> PairsBelow:
    """Pairs of the arm and what stands still."""
    geom, owner = near.geom[which], links.owner[near.geom[which]]
    swap = owner[:, 1] > owner[:, 0]
    a, b = np.where(swap, geom[:, 1], geom[:, 0]), np.where(swap, geom[:, 0], geom[:, 1])
    # from what is on the other side towards the shape
    normal = np.where(swap[:, None], near.normal[which], -near.normal[which]) @ links.T_world_base[:3, :3]
    return PairsBelow(near.row[which], a, b, normal)


class StepBends:
    """How the world moves as it is seen from links, between the ends of steps and half-way."""

    def __init__(self, poses: LinkPoses, halfway: LinkPoses, step: Ints, turn: Floats) -> None:
        """Prepare.

        Args:
            poses: at the samples.
            halfway: in the middles of the steps.
            step: the steps by their first samples, (k,).
            turn: of each joint on each, (k, n), rad.
        """
        self._poses, self._halfway, self._step = poses, halfway, step
        self._turn = turn
        self._of = np.full(len(poses.p), -1)
        self._of[step] = np.arange(len(step))
        self._known: dict[int, tuple[Floats, Floats, Floats]] = {}

    def steps_after(self, sample: Ints) -> Ints:
        """The steps that begin at samples; -1 where none does."""
        return self._of[sample]

    def seen_from(self, link: int) -> tuple[Floats, Floats, Floats]:
        """How the world moves as it is seen from a link.

        Returns:
            By how much the link's axes (3, 3, k) and, as it sees it, the world's origin (3, k) are off the middle of
            those at the ends half-way; and the cube of all that the joints up to the link turn, (k,).
        """
        if link not in self._known:
            axes, half = self._poses.axes[:, :, link], self._halfway.axes[:, :, link]
            at, there = (seen_from(each.axes[:, :, link], each.place[:, link]) for each in (self._poses, self._halfway))
            a, b = self._step, self._step + 1
            skew = half - (axes.take(a, axis=-1) + axes.take(b, axis=-1)) / 2
            off = (at.take(a, axis=-1) + at.take(b, axis=-1)) / 2 - there
            self._known[link] = skew, off, self._turn[:, : link + 1].sum(axis=1) ** 3
        return self._known[link]


class CarriedPlanes:
    """Planes on one checker's arm."""

    def __init__(self, links: ArmLinks) -> None:
        """Prepare.

        Args:
            links: the arm.
        """
        self._links = links
        self._length = float(np.linalg.norm(links.chain.origins[:, :3, 3], axis=1).sum())

    def over(
        self, poses: LinkPoses, bends: StepBends, pairs: PairsBelow, clusters: StepClusters
    ) -> tuple[Ints, Ints, Floats]:
        """Distances of pairs at the samples of their clusters, reduced by what may be missing between the samples.

        Args:
            poses: at the samples.
            bends: of the steps.
            pairs: the pairs; none of the others is endless.
            clusters: of the steps.

        Returns:
            Pair, place among the clusters' samples, and distance over its plane at least on the cluster's steps that
            begin or end there, (c,) each, m.
        """
        links = self._links
        joint = links.owner[pairs.geom]
        normal = seen_from(poses.axes_of(joint, clusters.at[pairs.cluster]), pairs.normal.T)
        above = -links.reach(pairs.geom, -normal)
        which, at = clusters.samples_of(pairs.cluster)
        sample, link = clusters.sample[at], joint[which]
        outward = as_seen(poses.axes_of(link, sample), normal.take(which, axis=1))
        below = links.reach(pairs.other[which], outward)
        below -= np.einsum("xk,xk->k", outward, poses.places_of(link, sample))
        bent = np.zeros(len(pairs.cluster))
        np.maximum.at(bent, which, self._bent(bends, pairs, which, sample))
        return which, at, above[which] - below - bent[which]

    def _bent(self, bends: StepBends, pairs: PairsBelow, which: Ints, sample: Ints) -> Floats:
        """How far any point of a pair's other shape is off a straight line, seen from the shape's link, (c,), m."""
        links, out = self._links, np.zeros(len(which))
        step = bends.steps_after(sample)
        each_shape, of_shape = np.unique(pairs.other, return_inverse=True)
        shapes = [links.shape(g) for g in each_shape.tolist()]
        middle = np.array([shape.middle for shape in shapes]).reshape(-1, 3)[of_shape]
        size = np.array([shape.size for shape in shapes])[of_shape]
        furthest = np.linalg.norm(middle, axis=1) + size + self._length
        joint = links.owner[pairs.geom]
        for j in np.unique(joint).tolist():
            mine = np.flatnonzero((joint[which] == j) & (step >= 0))
            skew, off, cube = (each.take(step[mine], axis=-1) for each in bends.seen_from(j))
            of = which[mine]
            moved = off + seen_from(skew, middle.T.take(of, axis=1))
            moved = np.sqrt(np.einsum("xk,xk->k", moved, moved))
            turned = np.sqrt(np.einsum("cxk,cxk->k", skew, skew)) * size[of]
            out[mine] = moved + turned + OFF_PARABOLA * furthest[of] * cube
        return out
