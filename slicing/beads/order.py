"""The order of the beads in a layer: little travel from the end of each to the start of the next.

    layers = in_laying_order(layers, parameters)

Contours come before infill (or after it, as asked). Within each of the two the travel is exactly the shortest for up to
EXACT_COUNT beads; for more it is that of the nearest neighbour, improved by reversing stretches (2-opt). It begins
where the layer below ended. Open beads may be laid from either end, unless directions alternate by layer.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..mesh.solid import Floats
from ..parameters import BeadParameters
from .bead import Bead

EXACT_COUNT = 7  # beads whose best order is searched for among all
MOST_BETTERED = 250  # beads whose order is bettered
SWEEPS = 20


def in_laying_order(layers: Sequence[Sequence[Bead]], parameters: BeadParameters) -> list[list[Bead]]:
    """Beads in the order in which they are laid.

    Args:
        layers: beads, layer by layer.
        parameters: which order.

    Returns:
        The same beads, open ones turned where that is shorter.
    """
    if not parameters.short:
        return [list(beads) for beads in layers]
    at: Floats | None = None
    out = []
    for beads in layers:
        new: list[Bead] = []
        for kind in ("contour", "infill") if parameters.contours_first else ("infill", "contour"):
            some = [bead for bead in beads if bead.kind == kind]
            for k, turned in shortest(some, at, not parameters.alternate):
                new.append(some[k].reversed() if turned else some[k])
            at = new[-1].end if new else at
        out.append(new)
    return out


def shortest(beads: Sequence[Bead], start: Floats | None, may_turn: bool) -> list[tuple[int, bool]]:
    """An order of short travel.

    Args:
        beads: of one layer.
        start: (3,) where the torch comes from; None where that does not matter.
        may_turn: whether open beads may be laid from their end.

    Returns:
        Numbers of the beads, and whether each is turned.
    """
    n = len(beads)
    if n == 0:
        return []
    # ends numbered 2 * bead + (1 if turned): where it is entered, and where it is left
    enter = np.array([at for bead in beads for at in (bead.points[0], bead.end)])
    leave = enter.reshape(n, 2, 3)[:, ::-1].reshape(2 * n, 3)
    gaps = np.sqrt(((leave[:, None] - enter[None]) ** 2).sum(axis=2))
    begin = np.zeros(2 * n) if start is None else np.sqrt(((enter - start) ** 2).sum(axis=1))
    free = [may_turn and not bead.closed for bead in beads]
    if n <= EXACT_COUNT:
        way = _exact(gaps.tolist(), begin.tolist(), free)
    else:
        way = _greedy(gaps, begin, free)
        if n <= MOST_BETTERED:
            same = [bool(np.array_equal(bead.points[0], bead.end)) for bead in beads]
            way = _bettered(way, gaps.tolist(), begin.tolist(), free, same)
    return [(e // 2, bool(e % 2)) for e in way]


def _exact(gaps: list[list[float]], begin: list[float], free: list[bool]) -> list[int]:
    """The order of shortest travel (Held and Karp): by sets of beads that are done and the one done last."""
    n = len(free)
    every = [2 * k + s for k in range(n) for s in ((0, 1) if free[k] else (0,))]
    best: dict[tuple[int, int], tuple[float, int]] = {(1 << (e // 2), e): (begin[e], -1) for e in every}
    for done in range(1, 1 << n):
        for e in every:
            if (done, e) not in best:
                continue
            cost = best[done, e][0]
            for f in every:
                if done >> (f // 2) & 1:
                    continue
                key, total = (done | 1 << (f // 2), f), cost + gaps[e][f]
                if key not in best or total < best[key][0] - 1e-12:
                    best[key] = (total, e)
    done = (1 << n) - 1
    way = [min(every, key=lambda e: best[done, e][0])]
    for _ in range(n - 1):
        before = best[done, way[-1]][1]
        done &= ~(1 << (way[-1] // 2))
        way.append(before)
    return way[::-1]


def _greedy(gaps: Floats, begin: Floats, free: list[bool]) -> list[int]:
    """Always on to the nearest end."""
    barred = np.array([False, True] * len(free)) & ~np.repeat(free, 2)
    away, way = begin, []
    for _ in range(len(free)):
        e = int(np.argmin(np.where(barred, np.inf, away)))
        way.append(e)
        barred[[2 * (e // 2), 2 * (e // 2) + 1]] = True
        away = gaps[e]
    return way


def _bettered(
    way: list[int], gaps: list[list[float]], begin: list[float], free: list[bool], same: list[bool]
) -> list[int]:
    """2-opt: stretches are reversed as long as that shortens the travel."""

    def turned(e: int) -> int:
        return e ^ 1 if free[e // 2] else e

    n = len(way)
    for _ in range(SWEEPS):
        shorter = False
        for i in range(n):
            for j in range(i + 1, n + 1):
                if not (free[way[j - 1] // 2] or same[way[j - 1] // 2]):
                    break  # a bead that cannot be laid from its end
                head, tail = turned(way[j - 1]), turned(way[i])
                now = gaps[way[i - 1]][way[i]] if i else begin[way[i]]
                then = gaps[way[i - 1]][head] if i else begin[head]
                if j < n:
                    now, then = now + gaps[way[j - 1]][way[j]], then + gaps[tail][way[j]]
                if then < now - 1e-9:
                    way[i:j] = [turned(e) for e in reversed(way[i:j])]
                    shorter = True
        if not shorter:
            break
    return way
