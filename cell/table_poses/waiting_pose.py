"""Where the arm stands while the table turns: nearer than at home, where that is proved clear and takes less time.

    found = nearer_place(turns, before, after, turn)     # None: there is none
    found.turn, found.back, found.out

The arm is on its way home from what it has welded, and comes from there to what it welds next: places on either way,
and between what both begin with, are tried, those first that promise the shortest time. The table's turn is proved
clear of an arm that stands there, and the ways there and on from there are checked as all travels are. Metres, radians,
seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats

from ..collision.proofs.between_samples import NEAREST, NEAREST_SHARE, least_between_samples
from ..failure import Failure
from ..planning.assemble import home_travel_time
from ..planning.bead_plan import reduced_budget
from ..planning.context import Context
from ..planning.edges.edge_check import UNLIMITED_SPEED
from ..planning.travels.home import SpanEnds
from ..planning.travels.travel import STRAIGHT, TravelPath, straight_retract, travel
from .table_turn import TableTurn, TurnSearch

SHARES = (0.0, 0.15, 0.3, 0.5, 0.7)  # of a way, from where the torch is drawn back on
TRIED = 3  # places that the table's turn is clear of, to which ways are searched
EQUAL_FACTOR = 1 + 2 * NEAREST_SHARE  # times a least distance: within it is not known which of two is nearer
WORTH_S = 0.05  # s: what saves less is not worth another place


@dataclass(frozen=True, eq=False)
class TurnEnd:
    """What is welded before a turn of the table, or after it.

    Attributes:
        context: what it was planned with, at its pose.
        ends: how it is come to and left.
        least: the nearest that anything comes in its motion, m.
    """

    context: Context
    ends: SpanEnds
    least: float


@dataclass(frozen=True, eq=False)
class CheckedTravel:
    """A way that is free.

    Attributes:
        path: samples and their clearances.
        least: the nearest that anything comes on it, m; infinite where nothing is near.
        pair: the two geoms.
    """

    path: TravelPath
    least: float
    pair: tuple[int, int]


@dataclass(frozen=True, eq=False)
class NearerPlace:
    """A place that is clear of a turn.

    Attributes:
        turn: the table's turn with the arm there.
        back: the way to it from what was welded before.
        out: the way from it to what is welded next.
    """

    turn: TableTurn
    back: CheckedTravel
    out: CheckedTravel


def nearer_place(turns: TurnSearch, before: TurnEnd, after: TurnEnd, turn: TableTurn) -> NearerPlace | None:
    """A place that takes less time than the one that is known.

    Args:
        turns: of the job.
        before: what is welded before the turn.
        after: what is welded after it.
        turn: the turn with the arm at the place that is known.

    Returns:
        The first place found; None where there is none, or where it would not be known any more how near the group's
        motion comes to anything.
    """
    back, out = before.ends.paths.back, after.ends.paths.out
    if back is None or out is None:
        return None
    known = _seconds(turns, before, after, turn, back, out)
    speed = before.context.solver.chain.max_speed
    speed = np.where(np.isfinite(speed), speed, UNLIMITED_SPEED)
    ends = before.ends.last.q_targets[-1], after.ends.first.q_targets[0]
    places = [p for p in _places(before, after, back, out) if np.abs(p - turn.q).max() > 1e-6]
    places.sort(key=lambda p: sum(float((np.abs(p - end) / speed).max()) for end in ends))
    tried = 0
    for place in places:
        a, b = before.context.checker.table, after.context.checker.table
        there = turns.search(place, a, b, turn.deposits_laid)
        if isinstance(there, Failure):
            continue
        tried += 1
        paths = _ways(before, after, place)
        if paths is not None and _seconds(turns, before, after, there, *paths) < known - WORTH_S:
            return _as_near(before, after, NearerPlace(there, *_checked(before, after, *paths)))
        if tried == TRIED:
            break
    return None


def _as_near(before: TurnEnd, after: TurnEnd, found: NearerPlace) -> NearerPlace | None:
    """A place found; None where a way that it replaces may be what came nearest, and the new one comes less near."""
    back, out = before.ends.paths.back, after.ends.paths.out
    assert back is not None
    assert out is not None
    for end, old, new in zip((before, after), _checked(before, after, back, out), (found.back, found.out), strict=True):
        nearly = EQUAL_FACTOR * end.least + NEAREST
        if old.least <= nearly < new.least:
            return None
    return found


def _checked(before: TurnEnd, after: TurnEnd, back: TravelPath, out: TravelPath) -> tuple[CheckedTravel, CheckedTravel]:
    """Ways with the nearest that anything comes on them."""
    laid = int(before.context.laid[before.ends.last.stop - 1])
    return _checked_way(before.context, back, laid), _checked_way(after.context, out, after.context.begun)


def _checked_way(context: Context, path: TravelPath, laid: int) -> CheckedTravel:
    deposits_laid = np.full(len(path.q), laid)
    seen, kept = path.clearances, path.kept
    _, nearest = least_between_samples(context.checker, context.radius, path.q, deposits_laid, seen, kept=kept)
    return CheckedTravel(path, float(nearest.distance[0]), (int(nearest.pair[0, 0]), int(nearest.pair[0, 1])))


def _seconds(
    turns: TurnSearch, before: TurnEnd, after: TurnEnd, turn: TableTurn, back: TravelPath, out: TravelPath
) -> float:
    """How long it takes from one group to the next."""
    job = turns.job
    there = home_travel_time(job, back[0], before.ends.last.stop - 1, begins=False)
    return there + float(turn.dt_s.sum()) + home_travel_time(job, out[0], after.ends.first.first, begins=True)


def _places(before: TurnEnd, after: TurnEnd, back: TravelPath, out: TravelPath) -> list[Floats]:
    """Configurations on the way home, on the way from there, and between what both are once they are drawn back."""
    n = before.context.solver.chain.n
    places, drawn = [], []
    for context, path, i in (
        (before.context, back[0][:, :n], before.ends.last.stop - 1),
        (after.context, out[0][::-1, :n], after.ends.first.first),
    ):
        p = context.solver.chain.forward(path)[:, :3, 3]
        off = np.linalg.norm(p - context.placed.position[i], axis=1)
        begin = int(np.argmax(off >= context.settings.retract - STRAIGHT))
        drawn.append(path[begin])
        places += [path[begin + round(share * (len(path) - 1 - begin))] for share in SHARES]
    return [*places, (drawn[0] + drawn[1]) / 2]


def _ways(before: TurnEnd, after: TurnEnd, place: Floats) -> tuple[TravelPath, TravelPath] | None:
    """The ways to a place and on from it, both drawn back as far as the case asks for; None where one is not found."""
    found: list[TravelPath] = []
    for end, back in ((before, True), (after, False)):
        span = replace(end.context.span, end=place) if back else replace(end.context.span, start=place)
        context = replace(reduced_budget(end.context, to=1), span=span)
        stretch = end.ends.last if back else end.ends.first
        laid = int(context.laid[stretch.stop - 1]) if back else context.begun
        path = travel(context, stretch if back else None, None if back else stretch, laid)
        if isinstance(path, Failure):
            return None
        if straight_retract(context, path, stretch, -1 if back else 0) < context.settings.retract - STRAIGHT:
            return None
        if not back and (path.q[-1] != stretch.axes[0]).any():
            return None
        found.append(path)
    return found[0], found[1]
