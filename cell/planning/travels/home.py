"""The travels from the arm's home to the part and back: a program starts and ends at home.

    plan, home = with_home(context, plan)        # home.out, home.back; what has no way is added to plan.travel_failures

They are travels like those between beads: out of the part along the normal, round what is in the way, checked with what
is laid by then, which on the way back is the whole part. Where no way leads to the first bead as it was planned, or
from the last, other beginnings and ends of it are tried. Metres, radians.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats

from ...failure import Failure, FailurePlace, Where
from ..bead_outcome import BeadPlan
from ..bead_plan import BEGINNINGS, REDUCED, searched_again
from ..bead_runs import HomePaths, PartPlan
from ..context import Context
from ..edges.edge_check import Stretch
from ..station_search import Ends
from .travel import TravelPath, travel, turned_to_travel_end


@dataclass(frozen=True, eq=False)
class HomeTravels:
    """The travels from home to the first bead and from the last one back.

    Attributes:
        out: to the first bead; None where there is none, or where the arm comes from is not known.
        back: from the last; None where there is none, or where the arm goes to is not known.
    """

    out: TravelPath | None
    back: TravelPath | None


@dataclass(frozen=True, eq=False)
class SpanEnds:
    """How the arm comes to the beads that are welded at one table pose, and how it leaves them.

    Attributes:
        first: the first of them.
        last: the last.
        paths: to the first and from the last.
    """

    first: Stretch
    last: Stretch
    paths: HomeTravels


@dataclass(frozen=True, eq=False)
class FoundHomeWay:
    """What the search of one way has found, for a bead as it was planned.

    Attributes:
        bead: that the way leads to, or comes from.
        at_home: what the arm is too near to at home, if anything.
        way: the way, or why there is none; None where none is asked for.
    """

    bead: BeadPlan
    at_home: Failure | None
    way: TravelPath | Failure | None


@dataclass(frozen=True, eq=False)
class FoundHomeTravels:
    """What the search of both ways has found.

    Attributes:
        out: from home to the first bead.
        back: from the last one home.
    """

    out: FoundHomeWay
    back: FoundHomeWay


def search_from_home(context: Context, first: BeadPlan, known: TravelPath | None = None) -> FoundHomeWay:
    """Search the way from home to a bead.

    Args:
        context: what the bead was planned with.
        first: the first of its span.
        known: a way that counts where it leads to where the bead begins.
    """
    start = context.span.start
    at_home = _home_itself(context, start, context.begun, first.first)
    way: TravelPath | Failure | None = at_home
    if way is None and first.whole and start is not None:
        way = _leads(known, -1, first.stretches[0], 0) or _way(context, None, first.stretches[0])
    return FoundHomeWay(first, at_home, way)


def search_to_home(context: Context, last: BeadPlan, known: TravelPath | None = None) -> FoundHomeWay:
    """Search the way from a bead back home.

    Args:
        context: what the bead was planned with.
        last: the last of its span.
        known: a way that counts where it comes from where the bead ends.
    """
    end = context.span.end
    at_home = _home_itself(context, end, int(context.laid[last.stop - 1]), last.stop - 1)
    way: TravelPath | Failure | None = at_home
    if way is None and last.whole and end is not None:
        way = _leads(known, 0, last.stretches[0], -1) or _way(context, last.stretches[0], None)
    return FoundHomeWay(last, at_home, way)


def search_home_travels(
    context: Context,
    first: BeadPlan,
    last: BeadPlan,
    known: HomePaths = (None, None),
) -> FoundHomeTravels:
    """Search both ways; see :func:`search_from_home` and :func:`search_to_home`."""
    return FoundHomeTravels(search_from_home(context, first, known[0]), search_to_home(context, last, known[1]))


def _home_itself(context: Context, home: Floats | None, deposits_laid: int, target: int) -> Failure | None:
    """The collision of the arm at home with the table as at a target, or None."""
    if home is None:
        return None
    axes = context.placed.axes(home[None], np.array([target]))
    found = context.checker.clearances(axes, np.array([deposits_laid]))
    if found.distance[0] >= context.settings.clearance:
        return None
    return context.describe(found, 0, FailurePlace(Where.TRAVEL, at_home=True))


def _leads(path: TravelPath | None, row: int, stretch: Stretch, at: int) -> TravelPath | None:
    """A way, where its first or last row is that end of a stretch."""
    return path if path is not None and np.array_equal(path.q[row], stretch.axes[at]) else None


def _way(context: Context, end: Stretch | None, start: Stretch | None) -> TravelPath | Failure:
    deposits_laid = context.begun if end is None else int(context.laid[end.stop - 1])
    return travel(context, end, start, deposits_laid)


def with_home(
    context: Context, plan: PartPlan, known: FoundHomeTravels | None = None
) -> tuple[PartPlan, HomeTravels | None]:
    """Plan the ways from home and back.

    Args:
        context: what the plan was made with.
        plan: of the part.
        known: what has been found already; counts where the plan is whole and both beads are still the same.

    Returns:
        The plan, with targets that no such way leads to, or from, in its travel_failures; and the ways, None where
        neither place is known.
    """
    if context.span.start is None and context.span.end is None:
        return plan, None
    first, last = plan.beads[0], plan.beads[-1]
    if not plan.whole:
        few = max(context.settings.travel_attempts // REDUCED, 1)
        context = replace(context, settings=replace(context.settings, travel_attempts=few))
    elif known is not None and known.out.bead is first and known.back.bead is last:
        return _Home(context, plan, known).planned()
    return _Home(context, plan, search_home_travels(context, first, last, plan.home)).planned()


class _Home:
    """The search of both ways."""

    def __init__(self, context: Context, plan: PartPlan, found: FoundHomeTravels) -> None:
        self.context, self.plan, self.whole, self.found = context, plan, plan.whole, found
        self.beads, self.travels = list(plan.beads), list(plan.travels)
        self.travel_failures = dict(plan.travel_failures)

    def planned(self) -> tuple[PartPlan, HomeTravels | None]:
        first, last = self.beads[0], self.beads[-1]
        out, back = self.found.out.way, self.found.back.way
        if self.whole and isinstance(out, Failure) and not self.found.out.at_home:
            joined = self._otherwise(0)
            out = out if joined is None else joined[0]
            back = joined[1] if joined is not None and len(self.beads) == 1 else back
        if self.whole and isinstance(back, Failure) and not self.found.back.at_home:
            joined = self._otherwise(len(self.beads) - 1)
            back = back if joined is None else joined[1]
            out = joined[0] if joined is not None and len(self.beads) == 1 else out
        if isinstance(out, Failure):
            place = replace(out.place, where=Where.FROM_HOME, to_target=first.first)
            self._note(first.first, out.at(place))
        if isinstance(back, Failure):
            at = last.stop - 1
            self._note(at, back.at(replace(back.place, where=Where.TO_HOME, from_target=at)))
        ways = HomeTravels(None if isinstance(out, Failure) else out, None if isinstance(back, Failure) else back)
        return PartPlan(tuple(self.beads), tuple(self.travels), self.travel_failures), ways

    def _note(self, target: int, failure: Failure) -> None:
        """Say it at a target that nothing else is wrong with."""
        bead = self.beads[0] if target < self.beads[0].stop else self.beads[-1]
        if target not in (*bead.target_failures, *bead.edge_failures, *self.travel_failures):
            self.travel_failures[target] = failure

    def _otherwise(self, k: int) -> tuple[TravelPath | None, TravelPath | None] | None:
        """Ways to and from the first or last bead, begun or ended elsewhere; None where that does not help."""
        bead = self.beads[k]
        begin_off: list[Floats] = []
        end_off: list[Floats] = []
        for _ in range(BEGINNINGS - 1):
            run = bead.stretches[0]
            if k == 0:
                begin_off.append(run.q_targets[0])
            if k == len(self.beads) - 1:
                end_off.append(run.q_targets[-1])
            before = self.beads[k - 1].stretches[0].q_targets[-1] if k else self.context.span.start
            bead = searched_again(self.context, bead, Ends(before, begin_off, end_off))
            if not bead.whole:
                break
            found = self._joined(k, bead)
            if found is not None:
                return found
        return None

    def _joined(self, k: int, bead: BeadPlan) -> tuple[TravelPath | None, TravelPath | None] | None:
        """The ways to and from a bead if they are free, None where none is needed; the bead and they take their places.

        None alone: they are not free.
        """
        start = bead.stretches[0]
        before = self.beads[k - 1].stretches[0] if k else None
        after = self.beads[k + 1].stretches[0] if k + 1 < len(self.beads) else None
        span = self.context.span
        into: TravelPath | None = None
        on: TravelPath | None = None
        if before is not None or span.start is not None:
            found = _way(self.context, before, start)
            if isinstance(found, Failure):
                return None
            into, start = found, turned_to_travel_end(start, found)
        if after is not None or span.end is not None:
            found = _way(self.context, start, after)
            if isinstance(found, Failure) or (after is not None and (found[0][-1] != after.axes[0]).any()):
                return None  # a way on that ends whole turns from the next bead would turn all that comes after it
            on = found
        self.beads[k] = replace(bead, stretches=(start,))
        if before is not None and into is not None:
            self.travels[k - 1] = into
        if after is not None and on is not None:
            self.travels[k] = on
        return into, on
