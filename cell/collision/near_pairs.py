"""All pairs that come within some distance in many configurations, with the directions in which they are apart.

    near = checker.pairs_within(q, deposits_laid, far)       # q (m, n) rad, far m
    near.row, near.geom, near.distance, near.normal

Metres, world frame.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from .clearances import Clearances


@dataclass(frozen=True, eq=False)
class NearPairs:
    """Pairs in m configurations, one after the other.

    Attributes:
        row: configuration of each, ascending, (k,).
        geom: ids of the two, (k, 2).
        distance: signed, (k,), m.
        normal: from the first to the second, unit, (k, 3).
        position: where they are nearest, (k, 3), m.
    """

    row: Ints
    geom: Ints
    distance: Floats
    normal: Floats
    position: Floats

    def nearest(self, m: int) -> Clearances:
        """The nearest pair of each of m configurations."""
        out = Clearances.none(m)
        order = np.lexsort((self.distance, self.row))
        row, first = np.unique(self.row[order], return_index=True)
        k = order[first]
        out.distance[row], out.pair[row], out.position[row] = self.distance[k], self.geom[k], self.position[k]
        return out

    def joined(self, other: NearPairs) -> NearPairs:
        """These and others of the same configurations."""
        names = ("row", "geom", "distance", "normal", "position")
        each = [np.concatenate([getattr(self, name), getattr(other, name)]) for name in names]
        order = np.argsort(each[0], kind="stable")
        return NearPairs(*(one[order] for one in each))

    @classmethod
    def of(cls, found: list[tuple[int, Ints, Floats, Floats, Floats]]) -> NearPairs:
        """Of contacts by configuration: its row, ids, distances, frames (k, 9) and positions."""
        found.sort(key=lambda one: one[0])
        if not found:
            none = np.zeros((0, 3))
            return cls(np.zeros(0, dtype=np.int64), np.zeros((0, 2), dtype=np.int64), np.zeros(0), none, none)
        row = np.repeat([one[0] for one in found], [len(one[2]) for one in found])
        geom, distance, frame, position = (np.concatenate([one[i] for one in found]) for i in range(1, 5))
        return cls(row, geom.astype(np.int64), distance, frame[:, :3], position)
