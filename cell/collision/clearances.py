"""Least clearances of many configurations, as every collision detection here returns them.

Use:

    nearest = checker.clearances(q, deposits_laid)    # checker: SeesClearances; q (m, n) rad
    nearest.distance, nearest.pair            # (m,) m and (m, 2) ids of geoms
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ik.chain import Floats

from ..arrays import Ints


class SeesClearances(Protocol):
    """Collision detection, of the arm or of the table."""

    reach: float

    def travel_bound(self, radius: Floats, a: Floats, b: Floats, /) -> Floats:
        """How far anything can travel towards anything on steps, (m,), m; see ``proofs.motion_bounds``."""
        ...

    def bend_bound(self, radius: Floats, turn: Floats, /) -> Floats:
        """Greatest second derivative of the relative motion of things where joints turn by so much, (m,), m."""
        ...

    def clearances(self, q: Floats, deposits_laid: Ints, /) -> Clearances:
        """As of :class:`cell.collision.checker.Checker`."""
        ...


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

    def put(self, index: Ints, other: Clearances) -> None:
        """Replace some of the configurations."""
        self.distance[index], self.pair[index], self.position[index] = other.distance, other.pair, other.position

    def nearer(self, index: Ints, other: Clearances) -> None:
        """Replace those of some configurations, each given once, whose pair in the other is nearer."""
        k = np.flatnonzero(other.distance < self.distance[index])
        self.put(index[k], other.rows(k))

    @classmethod
    def joined(cls, some: Sequence[Clearances]) -> Clearances:
        """Configurations of several, one after the other."""
        return cls(*(np.concatenate([getattr(c, name) for c in some]) for name in ("distance", "pair", "position")))

    @classmethod
    def none(cls, m: int) -> Clearances:
        """M configurations with nothing near."""
        return cls(np.full(m, np.inf), np.full((m, 2), -1), np.full((m, 3), np.nan))


CLEARANCE_REACH = 0.05  # m out to which least clearances are reported
