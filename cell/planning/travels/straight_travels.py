"""Straight travels between many beads, looked at together: one look at all of them costs less than one at each.

    ways = straight_travels(context, [BeadGap(end, start, stage)])     # None: it takes ``travel``

Each is the way that ``travel`` tries first: out along the normal as far as the case asks for, straight across, and in
again. It counts where all of it is free with room, as there. Metres, radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ...collision.checker import Checker
from ...collision.clearances import Clearances
from ...collision.proofs.between_samples import unproven_steps
from ..blended_check import travel_corners, wire_corners
from ..context import Context
from ..edge_check import Stretch
from .legs import ways_out
from .rrt_connect import sampled
from .travel import Way

WIRE_ROOM = 1e-9  # m: a wire that comes nearer to something is left to ``travel``


@dataclass(frozen=True, eq=False)
class BeadGap:
    """Two beads that follow one another.

    Attributes:
        end: what is welded last.
        start: what is welded next.
        stage: deposits laid by then.
    """

    end: Stretch
    start: Stretch
    stage: int


@dataclass(frozen=True, eq=False)
class _Route:
    """A straight way between two beads, not looked at yet.

    Attributes:
        gap: its number.
        q: all of it, (m, j), rad.
        across: its rows from the end of the way out to the beginning of the way in.
        stage: deposits laid by then.
    """

    gap: int
    q: Floats
    across: slice
    stage: int


def straight_travels(context: Context, gaps: Sequence[BeadGap]) -> list[Way | None]:
    """The straight travels between beads.

    Args:
        context: what they were planned with.
        gaps: between which.

    Returns:
        Samples (m, j) and their clearances of each, from where the one bead ends to where the other begins; None where
        it is not free with room at the first try.
    """
    settings, routes = context.settings, _routes(context, gaps)
    found = _kept(context.checker, context, [(r.q, r.stage) for r in routes], 2 * settings.clearance, settings.kept)
    free = [
        (route, seen)
        for route, seen in zip(routes, found, strict=True)
        if seen is not None and travel_corners(context, route.q, seen, route.stage) is None
    ]
    ways: list[Way | None] = [None] * len(gaps)
    for (route, seen), is_clear in zip(free, _wire_clear(context, [route for route, _ in free]), strict=True):
        ways[route.gap] = (route.q, seen) if is_clear else None
    return ways


def _routes(context: Context, gaps: Sequence[BeadGap]) -> list[_Route]:
    """The straight ways of gaps that the arm can follow."""
    ends = [end for gap in gaps for end in ((gap.end, -1), (gap.start, 0))]
    legs = ways_out(context, ends, context.settings.retract)
    routes: list[_Route] = []
    for k, gap in enumerate(gaps):
        leave, arrive = legs[2 * k], legs[2 * k + 1]
        if leave.failure or arrive.failure:
            continue
        middle = sampled(np.stack([leave.q[-1], arrive.q[-1]]), context.settings.steps.travel_angle)
        across = slice(len(leave.q) - 1, len(leave.q) - 1 + len(middle))
        q = np.concatenate([leave.q, middle[1:], arrive.q[::-1][1:]])
        routes.append(_Route(k, q, across, gap.stage))
    return routes


def _kept(
    checker: Checker, context: Context, ways: Sequence[tuple[Floats, int]], room: float, least: float
) -> list[Clearances | None]:
    """Clearances of ways (samples and deposits laid) with room at every sample that keep a clearance between them."""
    if not ways:
        return []
    of = np.repeat(np.arange(len(ways)), [len(q) for q, _ in ways])
    q, laid = np.concatenate([q for q, _ in ways]), np.array([stage for _, stage in ways])[of]
    found = checker.clearances(q, laid)
    good = np.ones(len(ways), dtype=bool)
    good[of[found.distance < room]] = False
    k = np.flatnonzero(good[of])
    if len(k):
        step, _ = unproven_steps(checker, context.radius, q[k], laid[k], found.rows(k), of[k], least=least)
        good[of[k[step]]] = False
    return [found.rows(np.flatnonzero(of == i)) if good[i] else None for i in range(len(ways))]


def _wire_clear(context: Context, routes: Sequence[_Route]) -> list[bool]:
    """Whether the wire is drawn through nothing on the way across; see ``cell.collision.wire``."""
    wire = context.wire
    if wire is None:
        return [True] * len(routes)
    found = _kept(wire, context, [(r.q[r.across], r.stage) for r in routes], WIRE_ROOM, 0.0)
    return [
        seen is not None and wire_corners(wire, context, r.q, (r.across.start, seen), r.stage) is None
        for r, seen in zip(routes, found, strict=True)
    ]
