"""Separating planes fixed in the world or on a link nearer to the base, each shared by many pairs of one shape.

    planes = SharedPlanes(links).between(poses, clusters, pairs, distance)
    SharedPlanes(links).over(poses, planes, which, sample)         # how far shapes are on their side of them

Base frame, metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ...arrays import Ints
from .carried_planes import PairsBelow
from .link_poses import ArmLinks, LinkPoses, as_seen, seen_from
from .step_clusters import StepClusters

ONE_PLANE = 2e-4  # m: shapes that reach no further over a plane than this share it


@dataclass(frozen=True, eq=False)
class SeparatingPlanes:
    """Planes, each between a shape of the arm and the shapes on its other side.

    Attributes:
        cluster: whose they are, (p,).
        geom: the shape of the arm, (p,).
        frame: joint with whose link the plane moves, (p,), or ``WORLD`` of ``link_poses``.
        normal: in that frame, towards the shape, (p, 3).
        offset: how far what is on the other side reaches along it, (p,), m.
    """

    cluster: Ints
    geom: Ints
    frame: Ints
    normal: Floats
    offset: Floats


class SharedPlanes:
    """Planes beside one checker's arm."""

    def __init__(self, links: ArmLinks, one_plane: float = ONE_PLANE) -> None:
        """Prepare.

        Args:
            links: the arm.
            one_plane: shapes that reach no further over a plane than this share it, m.
        """
        self._links, self._one_plane = links, one_plane

    def between(
        self, poses: LinkPoses, clusters: StepClusters, pairs: PairsBelow, distance: Floats
    ) -> SeparatingPlanes:
        """Planes between pairs: one for all that a shape of the arm has on the other side, where one will do."""
        links = self._links
        a, b, cluster, normal = pairs.geom, pairs.other, pairs.cluster, pairs.normal.copy()
        frame = links.owner[b]
        on_link = np.flatnonzero(frame >= 0)
        axes = poses.axes_of(frame[on_link], clusters.at[cluster[on_link]])
        normal[on_link] = seen_from(axes, normal[on_link].T).T
        order = np.lexsort((distance, frame, a, cluster))
        a, b, cluster, frame, normal = a[order], b[order], cluster[order], frame[order], normal[order]
        new = np.append(True, (np.diff(cluster) != 0) | (np.diff(a) != 0) | (np.diff(frame) != 0))[: len(a)]
        leads = np.flatnonzero(new)
        leader = leads[np.cumsum(new) - 1] if len(leads) else leads
        under = links.reach(b, normal[leader].T)
        shares = under <= under[leader] + self._one_plane
        offset = np.full(len(a), -np.inf)
        np.maximum.at(offset, leader[shares], under[shares])
        alone = np.flatnonzero(~shares)
        offset[alone] = links.reach(b[alone], normal[alone].T)
        kept = np.flatnonzero(new | ~shares)
        kept = kept[np.argsort(a[kept], kind="stable")]  # those of a shape together
        return SeparatingPlanes(cluster[kept], a[kept], frame[kept], normal[kept], offset[kept])

    def over(self, poses: LinkPoses, planes: SeparatingPlanes, which: Ints, sample: Ints) -> Floats:
        """How far shapes are on their side of planes at samples, (c,), m."""
        geom, frame = planes.geom[which], planes.frame[which]
        normal, joint = np.ascontiguousarray(planes.normal.T).take(which, axis=1), self._links.owner[geom]
        off = poses.places_of(joint, sample)
        link = np.flatnonzero(frame >= 0)
        if len(link):
            axes = poses.axes_of(frame[link], sample[link])
            normal[:, link] = as_seen(axes, normal[:, link])
            off[:, link] -= poses.places_of(frame[link], sample[link])
        own = seen_from(poses.axes_of(joint, sample), normal)
        over: Floats = np.einsum("xk,xk->k", normal, off) - planes.offset[which] - self._links.reach(geom, -own)
        return over
