"""The motion of the arm along every bead and from bead to bead.

    plan = plan_part(context, bead_of_target)    # (n,), ascending
    plan.beads[0].stretches               # what can be run through; edge_failures and target_failures say what cannot
    plan.travels, plan.travel_failures    # between the beads, and the failures of those that are not found

How one bead is planned, and led to, is in ``cell.planning.bead_plan``. Metres, radians, seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..arrays import Ints
from ..failure import Failure, FailurePlace, Where
from ..progress import Progress, counted_progress
from .bead_outcome import BeadPlan
from .bead_plan import plan_bead, reduced_budget, that_can_leave, travel_to
from .bead_runs import BeadRun, PartPlan, PlannedRun, PostponedRun
from .context import Context
from .edges.edge_check import Stretch
from .infeasible_part import (
    LOOKED_AT,
    LOOKED_AT_CLOSELY,
    InfeasiblePartJudge,
    first_cut_of,
    lost_bead,
)
from .loss_ahead import LossAhead, last_beads, loss_ahead
from .neighbours.beads_ahead import BeadsAhead
from .neighbours.similar_bead import last_hard
from .travels.straight_travels import straight_travel
from .travels.travel import TravelPath

NOT_STRAIGHT = 3  # gaps known to have no straight travel, until it is looked whether one of the last beads is lost
RUNS_LOOKED_AT = 2  # in which it is looked whether a postponed bead is cut, one after the other


def plan_part(context: Context, bead_of_target: Ints, progress: Progress | None = None) -> PartPlan:
    """Plan bead after bead and the travels between them.

    Args:
        context: what the search needs.
        bead_of_target: of the whole part, (n,), ascending; those of the context's span are planned.
        progress: called with how far it is.

    Returns:
        The plan.
    """
    span = context.span
    firsts = [i for i in np.flatnonzero(np.diff(bead_of_target, prepend=-1)).tolist() if span.first <= i < span.stop]

    def planned(runs: Sequence[BeadRun], count: Callable[[], None]) -> list[PlannedRun]:
        return [plan_run(context, run, count) for run in runs]

    run = BeadRun(tuple(firsts), span.stop, span.start, last=last_beads(firsts, span.stop))
    return plan_runs(context, [run], planned, progress)[0]


def plan_runs(
    context: Context,
    runs: Sequence[BeadRun],
    planned: Callable[[Sequence[BeadRun], Callable[[], None]], list[PlannedRun]],
    progress: Progress | None = None,
) -> list[PartPlan]:
    """Plan the runs of a part; postponed beads come last, and are searched in full only as long as no bead is lost.

    Before any is searched in full, it is looked whether one of them is cut, which costs much less. Of all runs together
    one is searched at first, then twice as many in every round: one that is lost ends it.

    Args:
        context: what the search needs.
        runs: all beads of the part, in order.
        planned: plans some runs, in order, in this process or others; calls its second argument for every bead.
        progress: called with how far it is.

    Returns:
        The plan of each run. Where the part is lost, postponed beads are left open.
    """
    with counted_progress(progress, "beads", sum(run.beads_left for run in runs)) as count:
        found = planned(runs, count)
    ahead = next((run.ahead for run in found if run.ahead is not None), None)
    if ahead is not None:
        if any(bead.whole and bead.first == ahead.first for run in found for bead in run.plan.beads):
            return plan_runs(context, [replace(run, last=()) for run in runs], planned, progress)  # it was not lost
        found = [run.with_bead(ahead) if run.has(ahead) else run for run in found]
    postponed = _postponed(found)
    if not postponed or any(run.lost for run in found):
        return [run.plan for run in found]
    found = _with_a_cut(context, found, progress)
    if any(run.lost for run in found):
        return [run.plan for run in found]
    searches = 1
    goes_on = [replace(runs[k], begun=found[k].postponed) for k in postponed]
    with counted_progress(progress, "beads from postponed ones on", sum(run.beads_left for run in goes_on)) as count:
        while postponed := _postponed(found):
            lost = any(run.lost for run in found)
            few = postponed if lost else postponed[-searches:]  # what is laid last has most in its way
            each = max(searches // len(few), 1)
            some = [replace(runs[k], begun=found[k].postponed, full_searches=each, lost=lost) for k in few]
            for k, again in zip(few, planned(some, count), strict=True):
                found[k] = again
            searches *= 2
    return [run.plan for run in found]


def _with_a_cut(context: Context, found: Sequence[PlannedRun], progress: Progress | None) -> list[PlannedRun]:
    """The same plan with one bead that is found to be cut, searched from the last runs on."""
    out = list(found)
    some = [k for k, run in enumerate(found) if run.doubtful][: -RUNS_LOOKED_AT - 1 : -1]
    known = {bead for run in found for bead in run.not_cut}
    beads = [[b for b in found[k].doubtful[-LOOKED_AT:] if (b.first, b.stop) not in known] for k in some]
    with counted_progress(progress, "postponed beads", sum(min(len(b), LOOKED_AT_CLOSELY) for b in beads)) as count:
        for k, doubtful in zip(some, beads, strict=True):
            cut = first_cut_of(context, doubtful, count)
            if cut is not None:
                out[k] = found[k].with_bead(cut)
                break
    return out


def _postponed(found: Sequence[PlannedRun]) -> list[int]:
    return [k for k, run in enumerate(found) if run.postponed is not None]


def plan_run(context: Context, run: BeadRun, count: Callable[[], None]) -> PlannedRun:
    """Plan some beads of a part and the travels between them.

    A bead that the quick search does not find, and that may cost more than the budget of a lost part allows, is
    postponed. In the first round the beads after it are planned as if it had not been there, to learn whether the part
    is infeasible anyway. A run that goes on from a postponed bead searches in full as many such beads as it may
    (``full_searches``), and ends before the next.

    Args:
        context: what the search needs.
        run: which.
        count: called for every bead.

    Returns:
        What became of them; no travel leads to the first.
    """
    return _RunSearch(context, run).planned(count)


class _RunSearch:
    """Beads planned one after the other, so far."""

    def __init__(self, context: Context, run: BeadRun) -> None:
        self.context, self.run = context, run
        self.reduced = reduced_budget(context)
        full_searches, cuts_known = run.full_searches, run.begun is not None
        self.judge = InfeasiblePartJudge(context, run.firsts[0], run.share, full_searches, cuts_known=cuts_known)
        self.beads: list[BeadPlan] = []
        self.travels: list[TravelPath] = []
        self.travel_failures: dict[int, Failure] = {}
        self.postponed: PostponedRun | None = None
        self.loss_ahead: LossAhead | None = None  # once it was looked for
        if run.begun is not None:
            plan = run.begun.plan
            self.beads, self.travels = list(plan.beads), list(plan.travels)
            self.travel_failures = dict(plan.travel_failures)
            self.judge.go_on(run.begun.judged)
        self.judge.lost |= run.lost
        self.ahead = BeadsAhead(context, run.firsts[len(self.beads) :], run.stop)

    def planned(self, count: Callable[[], None]) -> PlannedRun:
        """Plan the remaining beads."""
        stops = [*self.run.firsts[1:], self.run.stop]
        last = next((bead.stretches[-1] for bead in reversed(self.beads) if bead.stretches), None)
        for first, stop in list(zip(self.run.firsts, stops, strict=True))[len(self.beads) :]:
            judged = self.judge.judged
            bead = self._bead(first, stop, last)
            if bead is None and self._is_lost_ahead(first):
                bead = lost_bead(first, stop, {})
            if bead is None:
                self.postponed = self.postponed or PostponedRun(self._plan(), judged)
                if self.run.begun is not None:
                    break
                bead = lost_bead(first, stop, {})
            if bead.whole and stop < self.context.span.stop and not self._can_leave(last, bead):
                bead = self._that_can_leave(bead)
            if last is not None and bead.whole:
                bead = self._led_to(bead, last)
            self.beads.append(bead)
            last = bead.stretches[-1] if bead.stretches else last
            count()
        doubtful = tuple(self.judge.doubtful)
        ahead = self.loss_ahead or LossAhead()
        return PlannedRun(self._plan(), self.judge.lost, self.postponed, doubtful, ahead.lost, ahead.not_cut)

    def _plan(self) -> PartPlan:
        home = self.ahead.home_travels(self.beads) if self.beads else (None, None)
        return PartPlan(tuple(self.beads), tuple(self.travels), dict(self.travel_failures), home)

    def _bead(self, first: int, stop: int, last: Stretch | None) -> BeadPlan | None:
        """A bead; None: it is postponed."""
        lost = None if self.loss_ahead is None else self.loss_ahead.lost
        if lost is not None and lost.first == first:
            return lost
        q_before = self.run.q_before if last is None else last.q_targets[-1]
        self.ahead.doubtful = self._sparing
        found = self.ahead.bead(first, q_before)
        vain = self.ahead.failed_search(first, q_before)
        in_full = partial(plan_bead, self.context, first, stop, q_before, quickly=vain is None)
        if found is not None:
            return found
        bead = self.judge.plan(first, stop, q_before, in_full, vain, last_hard(self.beads))
        if bead is not None and bead.whole and (self.judge.lost or self.postponed is not None):
            self.ahead.found_alone()  # behind what is lost there may be much that is not
        return bead

    @property
    def _sparing(self) -> bool:
        """Whether what is planned now counts only where the part is lost."""
        return self.judge.lost or self.postponed is not None

    def _can_leave(self, last: Stretch | None, bead: BeadPlan) -> bool:
        """Whether it is known that the torch can be drawn back from a whole bead."""
        known = self.ahead.can_leave(last, bead)
        if not known and not self._sparing and self.ahead.gaps_not_straight >= NOT_STRAIGHT:
            self.ahead.doubtful = self._is_lost_ahead(bead.first)
        return known

    def _that_can_leave(self, bead: BeadPlan) -> BeadPlan:
        """A whole bead, ended elsewhere if only so the torch can be drawn back from it."""
        if not self._sparing:
            return that_can_leave(self.context, bead)[0]
        if not self.judge.affords_travel(bead.stop):
            return bead
        before = self.context.work
        bead, _ = that_can_leave(self.context, bead)
        self.judge.spend(before)
        return bead

    def _led_to(self, bead: BeadPlan, last: Stretch) -> BeadPlan:
        """A whole bead with the travel to it, or why there is none; left open where no way round may be searched."""
        straight = self.ahead.travel(last, bead)
        if straight is not None:
            self.travels.append(straight)
            return bead
        sparing, refused, first = self._sparing, False, bead.first
        if sparing and (self.beads[-1].open or not self.judge.affords_travel(bead.stop)):
            return self._led_straight_to(bead, last)
        begun = self.context.work

        def may_search() -> bool:
            nonlocal begun, refused
            before = self.context.work
            refused = not sparing and self._is_lost_ahead(bead.first)
            begun += self.context.work - before  # beads looked at ahead are charged to no travel
            return not refused

        # where the part is lost, what is still searched for is what to report
        context = self.reduced if sparing or self.run.reduced else self.context
        bead, way = travel_to(context, last, bead, may_search)
        if not isinstance(way, Failure):
            if sparing:
                self.judge.spend(begun)
            self.travels.append(way)
            return bead
        if refused:
            return replace(bead, open=frozenset([first]))
        if not self.run.reduced and self.postponed is None:
            self.judge.charge(begun)  # of a chunk's own beads it is not known yet that none is found
        elif sparing:
            self.judge.spend(begun)
        self.travel_failures[first] = travel_failure(way, last, first)
        return bead

    def _led_straight_to(self, bead: BeadPlan, last: Stretch) -> BeadPlan:
        """A whole bead with a straight travel to it; left open where there is none."""
        if not self.ahead.no_straight_travel(last, bead):
            path = straight_travel(self.context, last, bead.stretches[0])
            if path is not None:
                self.travels.append(path)
                return bead
        return replace(bead, open=frozenset([bead.first]))

    def _is_lost_ahead(self, first: int) -> bool:
        """Whether one of the part's last beads, still to come after one, is found to be lost: looked for once."""
        if self.run.begun is not None or self.judge.every:
            return False  # they have been come to already, or are come to in any case
        if self.loss_ahead is None:
            self.loss_ahead = loss_ahead(self.context, tuple(some for some in self.run.last if some[0] > first))
            if self.loss_ahead.lost is not None:
                self.judge.knows_lost(self.loss_ahead.lost)
                self.ahead.most_misses = 1  # what is like that bead is not found so either
        return self.loss_ahead.lost is not None


def travel_failure(travel: Failure, last: Stretch, first: int) -> Failure:
    """Why no travel leads from what was welded last to a bead that begins at a target."""
    return travel.at(FailurePlace(Where.TRAVEL, from_target=last.stop - 1, to_target=first))
