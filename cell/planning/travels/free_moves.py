"""How far straight moves of the arm are free, and what they hit: the collision query of the travel planner.

    moves = FreeMoves(context, deposits_laid, step)
    moves(a, b)                     # (e,) share of each move from a to b, both (e, n), that can be gone
    moves.met()                     # a Failure with the pair met most often; None where none was

Only samples are checked here, at the clearance to be kept. The travel that is found is checked like any motion.
Radians and metres.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from ik.chain import Floats

from ...collision.checker import Checker
from ...collision.clearances import Clearances
from ...failure import ON_TRAVEL, Failure
from ..context import Context

BLOCK = 6  # samples of a move checked before it is known whether the next are wanted


class FreeMoves:
    """Checks moves and remembers what was in their way."""

    def __init__(self, context: Context, deposits_laid: int, step: float, wire: Checker | None = None) -> None:
        """Prepare.

        Args:
            context: what the search needs.
            deposits_laid: deposits laid by then.
            step: most that any joint moves between samples, rad.
            wire: from ``cell.collision.wire.wire_checker``: keeps the wire out of the part.
        """
        self.context, self.deposits_laid, self.step, self.wire = context, deposits_laid, step, wire
        self._count: Counter[tuple[int, int]] = Counter()
        self._example: dict[tuple[int, int], Clearances] = {}

    def __call__(self, a: Floats, b: Floats) -> Floats:
        """How far moves are free.

        Args:
            a: where each begins, (e, n), rad; known to be free.
            b: where each ends, (e, n), rad.

        Returns:
            Share of each that is free, (e,): 1 for the whole.
        """
        count = np.maximum(np.ceil(np.abs(b - a).max(axis=1) / self.step - 1e-9), 1).astype(np.int64)
        share = np.ones(len(a))
        open_ = np.arange(len(a))
        for first in range(1, int(count.max(initial=0)) + 1, BLOCK):
            open_ = open_[count[open_] >= first]
            if not len(open_):
                break
            k = first + np.arange(BLOCK)
            edge, at = np.nonzero(k[None] <= count[open_, None])
            edge, t = open_[edge], k[at] / count[open_[edge]]
            hit = self._hit(a[edge] + t[:, None] * (b[edge] - a[edge]), edge)
            blocked, row = np.unique(edge[hit], return_index=True)
            share[blocked] = t[np.flatnonzero(hit)[row]] - 1 / count[blocked]
            open_ = np.setdiff1d(open_, blocked)
        return share

    def _hit(self, q: Floats, edge: np.ndarray) -> np.ndarray:
        """Which samples are too near to something; of each edge the first is remembered."""
        laid = np.full(len(q), self.deposits_laid)
        found = self.context.screen.clearances(q, laid)
        hit = found.distance < self.context.settings.clearance
        if self.wire is not None:
            clear = np.flatnonzero(~hit)
            drawn = self.wire.clearances(q[clear], laid[clear])
            through = drawn.distance <= 0
            self._remember(drawn, through, edge[clear])
            self._remember(found, hit, edge)
            hit[clear] = through
            return hit
        self._remember(found, hit, edge)
        return hit

    def _remember(self, found: Clearances, hit: np.ndarray, edge: np.ndarray) -> None:
        _, first = np.unique(edge[hit], return_index=True)
        for k in np.flatnonzero(hit)[first]:
            pair = (int(found.pair[k].min()), int(found.pair[k].max()))
            self._count[pair] += 1
            self._example.setdefault(pair, found.rows(np.array([k])))

    def met(self) -> Failure | None:
        """A failure with the pair that was met most often; None where nothing was met."""
        if not self._count:
            return None
        pair, _ = self._count.most_common(1)[0]
        return self.context.describe(self._example[pair], 0, ON_TRAVEL)
