"""What a table can do for a direction of the part: how near to up it can be brought, and over which turns of E2.

    table = TableFreedom.of(scene, axes=("E1", "E2"), held=(0.0, 0.0))
    table.least_off(normals)                  # (n,) rad, over all angles that the axes have
    table.turns(normals, E2, upright)         # (n, 2) how far E2 may be off, to either side, E1 doing what it can

Radians.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from .table_kinematics import TableKinematics

if TYPE_CHECKING:
    from .scene import Scene

TURN = 2 * np.pi
BISECTIONS = 24
NAMES = ("E1", "E2")


@dataclass(frozen=True, eq=False)
class TableFreedom:
    """A table of which one axis or both move along the beads.

    Attributes:
        kinematics: of its axes.
        low: least angles of E1 and E2, (2,), rad; the angle itself of an axis that is held.
        high: greatest, likewise; infinite of an endless axis.
        moves: which axes move, (2,).
    """

    kinematics: TableKinematics
    low: Floats
    high: Floats
    moves: NDArray[np.bool_]

    @classmethod
    def of(cls, scene: Scene, axes: Collection[str], held: tuple[float, float]) -> TableFreedom:
        """The table of a composed cell.

        Args:
            scene: the cell.
            axes: names of the axes that move.
            held: where the others stand, rad.
        """
        moves = np.array([name in axes for name in NAMES]) & scene.has_axis
        low = np.where(moves, scene.table_range[:, 0], held)
        high = np.where(moves, scene.table_range[:, 1], held)
        return cls(TableKinematics.of(scene), low, high, moves)

    def wrapped(self, tables: Floats) -> Floats:
        """Table angles (m, 2) turned by whole turns into the axes' ranges where that can be."""
        out = tables.copy()
        for k in range(2):
            if np.isfinite(self.high[k] - self.low[k]):
                out[:, k] -= TURN * np.round((out[:, k] - self.middle(k)) / TURN)
        return out

    def middle(self, k: int) -> float:
        """The middle of an axis' range, rad; 0 of an endless axis."""
        low, high = float(self.low[k]), float(self.high[k])
        return (low + high) / 2 if np.isfinite(high - low) else 0.0

    def exact(self, normals: Floats, aim: Floats | None = None) -> Floats:
        """Angles that bring directions nearest to up, or to an aim, their ranges aside.

        Args:
            normals: unit vectors, (m, 3), part frame.
            aim: unit vector, (3,), base frame; up where left out.

        Returns:
            One or two solutions, (s, m, 2), rad.
        """
        if self.moves.all():
            return self.kinematics.upright(normals, aim)
        out = np.tile(self.low, (len(normals), 1))
        if self.moves.any():
            k = int(np.argmax(self.moves))
            out[:, k] = self.kinematics.nearest(normals, out[:, 1 - k], k, aim)
        return out[None]

    def least_off(self, normals: Floats) -> Floats:
        """The least angle from up to which the axes can bring directions inside their ranges.

        In the ranges' inside it is least where it is exact, or as near as the axes come; on their border, where one
        axis is at its end and the other as near as it comes, or at its end as well.

        Args:
            normals: unit vectors, (m, 3), part frame.

        Returns:
            (m,), rad.
        """
        tried = [*self.exact(normals)]
        for k in np.flatnonzero(self.moves).tolist():
            for end in (self.low[k], self.high[k]):
                if np.isfinite(end):
                    held = np.full(len(normals), end)
                    one = np.empty((len(normals), 2))
                    one[:, k], one[:, 1 - k] = held, self.kinematics.nearest(normals, held, 1 - k)
                    if not self.moves[1 - k]:
                        one[:, 1 - k] = self.low[1 - k]
                    tried.append(one)
        ends = [[e for e in (self.low[k], self.high[k]) if np.isfinite(e)] for k in range(2)]
        tried += [np.tile(corner, (len(normals), 1)) for corner in product(*ends)]
        best = np.full(len(normals), np.pi)
        for tables in tried:
            here = self.wrapped(tables)
            inside = ((here >= self.low - 1e-9) & (here <= self.high + 1e-9)).all(axis=1)
            best = np.where(inside, np.minimum(best, self.kinematics.off(here, normals)), best)
        return best

    def off_at_turn(self, normals: Floats, E2: Floats, about: Floats) -> Floats:
        """The least angle from up at a given E2, with E1 at its best angle near the present one.

        Args:
            normals: unit vectors, (m, 3), part frame.
            E2: (m,), rad.
            about: E1 that is meant, (m,), rad.

        Returns:
            (m,), rad.
        """
        E1 = np.full(len(normals), self.low[0])
        if self.moves[0]:
            E1 = self.kinematics.nearest(normals, E2, 0)
            E1 = np.clip(about + (E1 - about + np.pi) % TURN - np.pi, self.low[0], self.high[0])
        return self.kinematics.off(np.stack([E1, E2], axis=1), normals)

    def turns(self, normals: Floats, tables: Floats, upright: float) -> Floats:
        """How far E2 may turn to either side so that directions stay near to up.

        Args:
            normals: unit vectors, (m, 3), part frame.
            tables: angles at which they are nearest to up, (m, 2), rad.
            upright: how far off up they may be, rad.

        Returns:
            Distances down and up, (m, 2), rad: half a turn where E2 may turn as it likes; 0 where it is held, or
            nothing keeps them there.
        """
        out = np.zeros((len(normals), 2))
        if not self.moves[1]:
            return out
        about = self.wrapped(tables)[:, 0]
        for k, side in enumerate((-1.0, 1.0)):
            low, high = np.zeros(len(normals)), np.full(len(normals), np.pi)
            # what grows first falls again beyond a quarter of a turn
            ends = (np.pi, np.pi / 2)
            free = np.logical_and.reduce(
                [self.off_at_turn(normals, tables[:, 1] + side * e, about) <= upright for e in ends]
            )
            high[~free] = np.pi / 2
            for _ in range(BISECTIONS):
                middle = (low + high) / 2
                good = self.off_at_turn(normals, tables[:, 1] + side * middle, about) <= upright
                low, high = np.where(good, middle, low), np.where(good, high, middle)
            out[:, k] = np.where(free, np.pi, low)
        return out
