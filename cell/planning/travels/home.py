"""The ways from the arm's home to the part and back to it: a program is run from there, and ends there.

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
from ..context import Context
from ..edges.edge_check import Stretch
from ..part_plan import PartPlan
from ..station_search import Ends
from .travel import TravelPath, travel, turned_to_travel_end


@dataclass(frozen=True, eq=False)
class HomeTravels:
    """The ways from home to the first bead and from the last one back.

    Attributes:
        out: to the first bead; None where there is none, or where the arm comes from is not known.
        back: from the last; None where there is none, or where the arm goes to is not known.
    """

    out: TravelPath | None
    back: TravelPath | None


@dataclass(frozen=True, eq=False)
class SpanEnds:
    """How beads that are welded at one pose of the table are come to and left.

    Attributes:
        first: the first of them.
        last: the last.
        ways: to the first and from the last.
    """

    first: Stretch
    last: Stretch
    ways: HomeTravels


def with_home(context: Context, plan: PartPlan) -> tuple[PartPlan, HomeTravels | None]:
    """Plan the ways from home and back.

    Args:
        context: what the plan was made with.
        plan: of the part.

    Returns:
        The plan, with targets that no such way leads to, or from, in its travel_failures; and the ways, None where
        neither place is known.
    """
    if context.span.start is None and context.span.end is None:
        return plan, None
    whole = not plan.travel_failures and all(bead.whole for bead in plan.beads)
    if not whole:
        few = max(context.settings.travel_attempts // REDUCED, 1)
        context = replace(context, settings=replace(context.settings, travel_attempts=few))
    return _Home(context, plan, whole).planned()


class _Home:
    """The search of both ways."""

    def __init__(self, context: Context, plan: PartPlan, whole: bool) -> None:
        self.context, self.plan, self.whole = context, plan, whole
        self.beads, self.travels = list(plan.beads), list(plan.travels)
        self.travel_failures = dict(plan.travel_failures)

    def planned(self) -> tuple[PartPlan, HomeTravels | None]:
        first, last = self.beads[0], self.beads[-1]
        start, end = self.context.span.start, self.context.span.end
        laid = int(self.context.laid[last.stop - 1])
        failed_at_home = [
            self._home_itself(start, self.context.begun, first.first),
            self._home_itself(end, laid, last.stop - 1),
        ]
        out = failed_at_home[0] or (self._way(None, first.stretches[0]) if first.whole and start is not None else None)
        back = failed_at_home[1] or (self._way(last.stretches[0], None) if last.whole and end is not None else None)
        if self.whole and isinstance(out, Failure) and not failed_at_home[0]:
            joined = self._otherwise(0)
            out = out if joined is None else joined[0]
            back = joined[1] if joined is not None and len(self.beads) == 1 else back
        if self.whole and isinstance(back, Failure) and not failed_at_home[1]:
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

    def _home_itself(self, home: Floats | None, deposits_laid: int, target: int) -> Failure | None:
        """What the arm is too near to at home, if anything, with the table as at a target."""
        if home is None:
            return None
        axes = self.context.placed.axes(home[None], np.array([target]))
        found = self.context.checker.clearances(axes, np.array([deposits_laid]))
        if found.distance[0] >= self.context.settings.clearance:
            return None
        return self.context.describe(found, 0, FailurePlace(Where.TRAVEL, at_home=True))

    def _way(self, end: Stretch | None, start: Stretch | None) -> TravelPath | Failure:
        deposits_laid = self.context.begun if end is None else int(self.context.laid[end.stop - 1])
        return travel(self.context, end, start, deposits_laid)

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
            found = self._way(before, start)
            if isinstance(found, Failure):
                return None
            into, start = found, turned_to_travel_end(start, found)
        if after is not None or span.end is not None:
            found = self._way(start, after)
            if isinstance(found, Failure) or (after is not None and (found[0][-1] != after.axes[0]).any()):
                return None  # a way on that ends whole turns from the next bead would turn all that comes after it
            on = found
        self.beads[k] = replace(bead, stretches=(start,))
        if before is not None and into is not None:
            self.travels[k - 1] = into
        if after is not None and on is not None:
            self.travels[k] = on
        return into, on
