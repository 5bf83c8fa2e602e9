"""Pieces of motions, or of sheets of motions, known at their corners, with a bound on the distance from the mean.

    pieces = SheetPieces(corner, laid, bend, turn)
    pieces.off(radius, link)         # (k,) m: how far anything is off the mean of its places at the corners

Metres, radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ...arrays import Ints
from .motion_bounds import curvature
from .step_clusters import StepClusters, cluster_order


@dataclass(frozen=True, eq=False)
class SheetPieces:
    """Pieces, each of c corners and with d sides.

    Attributes:
        corner: samples at its corners, (k, c).
        laid: deposits laid on each, (k,).
        bend: how far each joint is off the mean of the corners at most, (k, n), rad.
        turn: how far each joint turns along each side at most, (d, k, n), rad.
    """

    corner: Ints
    laid: Ints
    bend: Floats
    turn: Floats

    def off(self, radius: Floats, link: int = -1) -> Floats:
        """How far any point of the arm is off the mean of its places at the corners, seen from a link, (k,), m.

        Args:
            radius: from ``reach_radii.radii``, (n,), m.
            link: from which only the joints after it turn; -1: from the base.
        """
        r, after = radius[link + 1 :], slice(link + 1, None)
        curved = sum(curvature(r, side[:, after]) for side in self.turn)
        return np.asarray(self.bend[:, after] @ r + curved / 8)

    def rows(self, index: Ints) -> SheetPieces:
        """Some of the pieces."""
        return SheetPieces(self.corner[index], self.laid[index], self.bend[index], self.turn[:, index])

    def clusters(self, places: Floats, spacing: float) -> tuple[StepClusters, Ints]:
        """Gather pieces that lie close together, as ``step_clusters.gather_steps``.

        Returns:
            The clusters, and where among their samples the corners of each piece stand, (k, c).
        """
        order, begins, nearest = cluster_order(places[self.corner].mean(axis=1), self.laid, spacing)
        cluster = np.empty(len(order), dtype=np.int64)
        cluster[order] = np.repeat(np.arange(len(begins)), np.diff(np.append(begins, len(order))))
        key, of = np.unique(cluster[:, None] * len(places) + self.corner, return_inverse=True)
        of_cluster, sample = np.divmod(key, len(places))
        clusters = StepClusters(self.corner[nearest, 0], self.laid[nearest], of_cluster, sample)
        return clusters, of.reshape(self.corner.shape)
