"""The order of the beads in a layer: little travel from the end of each to the start of the next.

    layers = ordered(layers, parameters)

Contours come before infill (or after it, as asked). Within each of the two the way is the shortest there is for up to
EXACT beads, and for more the nearest neighbour's, bettered by turning round stretches of it (2-opt). It begins where
the layer below ended. Open beads may be laid from either end, unless directions alternate by layer.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from slicing.beads import Bead, BeadParameters
from slicing.part import Floats

EXACT = 7  # beads whose best order is searched for among all
MOST = 250  # beads whose order is bettered


def ordered(layers: Sequence[Sequence[Bead]], parameters: BeadParameters) -> list[list[Bead]]:
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


def travel_mm(beads: Sequence[Bead], start: Floats | None = None) -> float:
    """Length of the straight ways from bead to bead, mm."""
    ends = ([] if start is None else [start]) + [bead.end for bead in beads]
    starts = [bead.points[0] for bead in beads][1 if start is None else 0 :]
    return float(sum(np.linalg.norm(b - a) for a, b in zip(ends, starts, strict=False)))


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
    first = np.array([[bead.points[0], bead.end] for bead in beads])  # [bead, turned]: where it starts
    last = first[:, ::-1]
    free = [may_turn and not bead.closed for bead in beads]
    if n <= EXACT:
        return _exact(first, last, free, start)
    way = _greedy(first, last, free, start)
    return _bettered(way, first, last, free, start) if n <= MOST else way


def _gap(a: Floats | None, b: Floats) -> float:
    return 0.0 if a is None else float(np.sqrt(((a - b) ** 2).sum()))


def _exact(first: Floats, last: Floats, free: list[bool], start: Floats | None) -> list[tuple[int, bool]]:
    """The shortest way of all: by sets of beads that are done and the one done last."""
    n = len(first)
    sides = [(0, 1) if f else (0,) for f in free]
    best: dict[tuple[int, int, int], tuple[float, tuple[int, int] | None]] = {}
    every = [(bead, side) for bead in range(n) for side in sides[bead]]
    for k, s in every:
        best[1 << k, k, s] = (_gap(start, first[k, s]), None)
    for done in range(1, 1 << n):
        for k, s in (e for e in every if (done, e[0], e[1]) in best):
            cost = best[done, k, s][0]
            for j in (j for j in range(n) if not done >> j & 1):
                for t in sides[j]:
                    key = (done | 1 << j, j, t)
                    total = cost + _gap(last[k, s], first[j, t])
                    if key not in best or total < best[key][0] - 1e-12:
                        best[key] = (total, (k, s))
    done = (1 << n) - 1
    at = min(every, key=lambda e: best[done, e[0], e[1]][0])
    way = [(at[0], bool(at[1]))]
    before = best[done, at[0], at[1]][1]
    while before is not None:
        done &= ~(1 << at[0])
        at = before
        way.append((at[0], bool(at[1])))
        before = best[done, at[0], at[1]][1]
    return way[::-1]


def _greedy(first: Floats, last: Floats, free: list[bool], start: Floats | None) -> list[tuple[int, bool]]:
    """Always on to the nearest start."""
    left, at, way = list(range(len(first))), start, []
    while left:
        if at is None:
            k, turned = left[0], False
        else:
            away = np.sqrt(((first[left] - at) ** 2).sum(axis=2))
            away[[not free[k] for k in left], 1] = np.inf
            row, side = np.unravel_index(int(np.argmin(away)), away.shape)
            k, turned = left[int(row)], bool(side)
        left.remove(k)
        way.append((k, turned))
        at = last[k, int(turned)]
    return way


def _bettered(
    way: list[tuple[int, bool]], first: Floats, last: Floats, free: list[bool], start: Floats | None
) -> list[tuple[int, bool]]:
    """2-opt: stretches turned round as long as that shortens the way."""

    def begin(e: tuple[int, bool]) -> Floats:
        return first[e[0], int(e[1])]

    def finish(e: tuple[int, bool]) -> Floats:
        return last[e[0], int(e[1])]

    for _ in range(20):
        shorter = False
        for i, j in itertools.combinations(range(len(way) + 1), 2):
            stretch = way[i:j]
            if not all(free[k] or np.array_equal(first[k, 0], first[k, 1]) for k, _ in stretch):
                continue
            before = finish(way[i - 1]) if i else start
            now, then = _gap(before, begin(stretch[0])), _gap(before, finish(stretch[-1]))
            if j < len(way):
                now += _gap(finish(stretch[-1]), begin(way[j]))
                then += _gap(begin(stretch[0]), begin(way[j]))
            if then < now - 1e-9:
                way[i:j] = [(k, not turned if free[k] else turned) for k, turned in stretch[::-1]]
                shorter = True
        if not shorter:
            break
    return way
