"""Straight travels between many beads, checked together: that costs less than one check of each.

    ways = straight_travels(context, [BeadGap(end, start, deposits_laid)])     # None: it takes ``travel``

From home and back are such gaps too: ``end`` or ``start`` is None.

Each is the way that ``travel`` tries first: out along the normal as far as the case asks for, straight across, and in
again. It counts where all of it is free with room, as there. Metres, radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats

from ...arrays import Ints
from ...collision.checker import Checker
from ...collision.clearances import Clearances
from ...collision.proofs.between_samples import steps_between, unproven_steps
from ...collision.proofs.motion_clearance import AIMED_SHARE, GIVEN_BETWEEN
from ...collision.proofs.plane_proofs import proofs_of
from ...collision.stick_out import stick_out_of
from ..context import Context
from ..edges.blended_check import free_travels
from ..edges.edge_check import Stretch
from .legs import end_legs, retract_legs
from .rrt_connect import sampled
from .travel import TravelPath

FIRST_LOOK = 10  # every so many samples of a travel are checked before the others
FEW = 3  # travels of which a sample is checked to learn whether they are to be checked so
ENDS = 3  # samples of either end of a travel that are checked in any case
WIRE_ROOM = 1e-9  # m: a wire that comes nearer to something is left to ``travel``


@dataclass(frozen=True, eq=False)
class BeadGap:
    """Two beads that follow one another, or a bead and the arm's home.

    Attributes:
        end: what is welded last; None where the arm comes from its home.
        start: what is welded next; None where it goes home.
        deposits_laid: deposits laid by then.
    """

    end: Stretch | None
    start: Stretch | None
    deposits_laid: int


@dataclass(frozen=True, eq=False)
class _Route:
    """A straight way between two beads, not checked yet.

    Attributes:
        gap: its number.
        q: all of it, (m, j), rad.
        across: its rows from the end of the way out to the beginning of the way in.
        deposits_laid: deposits laid by then.
    """

    gap: int
    q: Floats
    across: slice
    deposits_laid: int


def straight_travels(context: Context, gaps: Sequence[BeadGap], *, doubtful: bool = False) -> list[TravelPath | None]:
    """The straight travels between beads.

    Args:
        context: what they were planned with.
        gaps: between which.
        doubtful: whether many are not free: then a few samples of each are checked first, as where a few are not.

    Returns:
        Samples (m, j) and their clearances of each, from where the one bead ends to where the other begins; None where
        it is not free with room at the first try.
    """
    settings, routes = context.settings, _routes(context, gaps)
    if doubtful or _some_are_shut(context, routes):
        routes = _free_at_first_look(context, routes)
    ways, wanted = [(r.q, r.deposits_laid) for r in routes], _wanted(context, routes)
    found = _kept(context.checker, context, ways, 2 * settings.clearance, settings.kept, wanted)
    free = [(route, path) for route, path in zip(routes, found, strict=True) if path is not None]
    known = [(path.q, path.at_least, path.kept, route.deposits_laid) for route, path in free]
    rounded = free_travels(context.checker, context, known, settings.kept)
    free = [one for one, is_free in zip(free, rounded, strict=True) if is_free]
    paths: list[TravelPath | None] = [None] * len(gaps)
    for (route, path), is_clear in zip(free, _wire_clear(context, free), strict=True):
        paths[route.gap] = path if is_clear else None
    return paths


def straight_travel(context: Context, end: Stretch, start: Stretch) -> TravelPath | None:
    """The same between two beads.

    Args:
        context: what they were planned with.
        end: what is welded last.
        start: what is welded next.
    """
    gap = BeadGap(end, start, int(context.laid[end.stop - 1]))
    return straight_travels(context, [gap], doubtful=True)[0]


def _some_are_shut(context: Context, routes: Sequence[_Route]) -> bool:
    """Whether one of a few ways has no room half-way."""
    some = (
        [routes[k] for k in np.unique(np.linspace(0, len(routes) - 1, FEW).round().astype(np.int64))] if routes else []
    )
    if len(some) < FEW:
        return False
    q, laid = np.array([route.q[len(route.q) // 2] for route in some]), np.array([r.deposits_laid for r in some])
    return bool((context.checker.clearances(q, laid).distance < 2 * context.settings.clearance).any())


def _free_at_first_look(context: Context, routes: Sequence[_Route]) -> list[_Route]:
    """Those of some ways that have room at every few samples."""
    paths = [(route.q, route.deposits_laid) for route in routes]
    room = _have_room(context.checker, paths, 2 * context.settings.clearance)
    return [route for route, has in zip(routes, room, strict=True) if has]


def _have_room(checker: Checker, paths: Sequence[tuple[Floats, int]], room: float) -> list[bool]:
    """Whether ways (samples and deposits laid) have room at every few of their samples."""
    if not paths:
        return []
    some = [q[::FIRST_LOOK] for q, _ in paths]
    of = np.repeat(np.arange(len(some)), [len(q) for q in some])
    laid = np.array([deposits_laid for _, deposits_laid in paths])[of]
    out = np.ones(len(paths), dtype=bool)
    out[of[checker.clearances(np.concatenate(some), laid).distance < room]] = False
    return [bool(has) for has in out]


def _routes(context: Context, gaps: Sequence[BeadGap]) -> list[_Route]:
    """The straight ways of gaps that the arm can follow."""
    between = [k for k, gap in enumerate(gaps) if gap.end is not None and gap.start is not None]
    ends = [end for k in between for end in ((gaps[k].end, -1), (gaps[k].start, 0))]
    legs = retract_legs(context, [(bead, at) for bead, at in ends if bead is not None], context.settings.retract)
    known = dict(zip(between, zip(legs[::2], legs[1::2], strict=True), strict=True))
    routes: list[_Route] = []
    for k, gap in enumerate(gaps):
        leave, arrive = known[k] if k in known else end_legs(context, gap.end, gap.start, context.settings.retract)
        if leave.failure or arrive.failure:
            continue
        middle = sampled(np.stack([leave.q[-1], arrive.q[-1]]), context.settings.steps.travel_angle)
        across = slice(len(leave.q) - 1, len(leave.q) - 1 + len(middle))
        q = np.concatenate([leave.q, middle[1:], arrive.q[::-1][1:]])
        routes.append(_Route(k, q, across, gap.deposits_laid))
    return routes


def _kept(
    checker: Checker,
    context: Context,
    paths: Sequence[tuple[Floats, int]],
    room: float,
    least: float,
    wanted: Sequence[Floats] | None = None,
) -> list[TravelPath | None]:
    """Ways (samples and deposits laid) with room at every sample that keep a clearance between them.

    Those that keep the room between their samples as well are mostly proved to by few looks; all others are checked
    sample by sample.

    Args:
        checker: collision detection, of the whole cell or of the wire.
        context: what the beads were planned with.
        paths: the ways.
        room: at every sample, m.
        least: clearance between them, m.
        wanted: from each of their samples to the next, (m,) each, m: what is to be proved if it can be, where that is
            more than the room.
    """
    if not paths:
        return []
    of = np.repeat(np.arange(len(paths)), [len(q) for q, _ in paths])
    q, laid = np.concatenate([q for q, _ in paths]), np.array([deposits_laid for _, deposits_laid in paths])[of]
    out: list[TravelPath | None] = [None] * len(paths)
    left = np.ones(len(paths), dtype=bool)
    proofs = proofs_of(checker)
    if proofs is not None:
        step = steps_between(q, of)
        aim = room if wanted is None else np.maximum(room, np.concatenate(wanted)[step])
        proved, kept = proofs.along(q, step, laid[step], aim, GIVEN_BETWEEN, AIMED_SHARE), np.full(len(q), -np.inf)
        kept[step] = proved.kept
        low = np.maximum(kept, np.append(-np.inf, kept[:-1]))
        ends = _near_ends(of)
        proved.seen.nearer(ends, checker.clearances(q[ends], laid[ends]))
        left[of[step]] = False
        left[of[step[proved.kept < room]]] = True
        for i in np.flatnonzero(~left).tolist():
            mine = np.flatnonzero(of == i)
            out[i] = TravelPath(q[mine], proved.seen.rows(mine), low[mine], kept[mine])
    again = np.flatnonzero(left).tolist()
    again = [i for i, has in zip(again, _have_room(checker, [paths[i] for i in again], room), strict=True) if has]
    for i, path in zip(again, _checked_travels(checker, context, [paths[i] for i in again], room, least), strict=True):
        out[i] = path
    return out


def _near_ends(of: Ints) -> Ints:
    """Samples where ways begin and end, of which there the nearest is mostly seen, ascending: ``of`` each which way."""
    place = np.arange(len(of)) - np.searchsorted(of, of)
    left = np.searchsorted(of, of, side="right") - 1 - np.arange(len(of))
    return np.flatnonzero((place < ENDS) | (left < ENDS))


def _checked_travels(
    checker: Checker, context: Context, paths: Sequence[tuple[Floats, int]], room: float, least: float
) -> list[TravelPath | None]:
    """The same, all of whose samples are checked."""
    if not paths:
        return []
    of = np.repeat(np.arange(len(paths)), [len(q) for q, _ in paths])
    q, laid = np.concatenate([q for q, _ in paths]), np.array([deposits_laid for _, deposits_laid in paths])[of]
    found = checker.clearances(q, laid)
    good = np.ones(len(paths), dtype=bool)
    good[of[found.distance < room]] = False
    k = np.flatnonzero(good[of])
    if len(k):
        step, _ = unproven_steps(checker, context.radius, q[k], laid[k], found.rows(k), of[k], least=least)
        good[of[k[step]]] = False
    radius, every = context.radius, [np.flatnonzero(of == i) for i in range(len(paths))]
    return [TravelPath.of(checker, radius, q[k], found.rows(k)) if good[of[k[0]]] else None for k in every]


def _wanted(context: Context, routes: Sequence[_Route]) -> list[Floats] | None:
    """What the torch is to keep from each sample of ways to the next for its wire to be clear across, (m,) each, m."""
    beyond = stick_out_of(context.checker.scene)
    if context.wire is None or not np.isfinite(beyond):
        return None
    wanted = [np.zeros(len(route.q)) for route in routes]
    for mine, route in zip(wanted, routes, strict=True):
        mine[route.across] = beyond + WIRE_ROOM
    return wanted


def _of_wire(path: TravelPath, across: slice, beyond: float) -> tuple[Floats, Floats]:
    """What a wire keeps at samples of the way across, and from each to the next, m; -inf after the last."""
    low, kept = path.low[across] - beyond, path.kept[across] - beyond
    kept[-1] = -np.inf
    return low, kept


def _wire_clear(context: Context, ways: Sequence[tuple[_Route, TravelPath]]) -> list[bool]:
    """Whether the wire is drawn through nothing on the way across; see ``cell.collision.wire``.

    It is as far from the part as the torch, less what it reaches beyond it; only where that is not enough it is checked
    by itself.
    """
    wire = context.wire
    if wire is None:
        return [True] * len(ways)
    out, beyond, routes = [False] * len(ways), stick_out_of(context.checker.scene), [route for route, _ in ways]
    across = {n: _of_wire(path, route.across, beyond) for n, (route, path) in enumerate(ways)}
    near = [n for n, (_, kept) in across.items() if len(kept) < 2 or (kept[:-1] < WIRE_ROOM).any()]
    seen = [(routes[n].q[routes[n].across], routes[n].deposits_laid) for n in near]
    for n, found in zip(near, _kept(wire, context, seen, WIRE_ROOM, 0.0), strict=True):
        if found is None:
            del across[n]
        else:
            across[n] = found.low, found.kept
    known = []
    for n, kept_across in across.items():
        route = routes[n]
        low, kept = np.full(len(route.q), np.inf), np.full(len(route.q), -np.inf)
        low[route.across], kept[route.across] = kept_across
        known.append((route.q, replace(Clearances.none(len(low)), distance=low), kept, route.deposits_laid))
    for n, is_free in zip(across, free_travels(wire, context, known, 0.0), strict=True):
        out[n] = is_free
    return out
