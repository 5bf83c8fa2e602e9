"""The way of the arm through every bead and from bead to bead.

    plan = plan_part(context, bead_of_target)    # (n,), ascending
    plan.beads[0].stretches               # what can be run through; edge_failures and target_failures say what cannot
    plan.travels, plan.travel_failures    # between the beads, and the failures of those that are not found

How one bead is planned, and led to, is in ``cell.planning.bead_plan``. Metres, radians, seconds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..failure import Failure, FailurePlace, Where
from ..progress import Progress, counted_progress
from .bead_outcome import BeadPlan
from .bead_plan import plan_bead, reduced_budget, that_can_leave, travel_to
from .beads_ahead import BeadsAhead
from .context import Context
from .edges.edge_check import Stretch
from .infeasible_part import InfeasiblePartJudge
from .travels.travel import TravelPath, travel


@dataclass(frozen=True, eq=False)
class PartPlan:
    """What became of a part.

    Attributes:
        beads: in order.
        travels: to each whole bead from the one before.
        travel_failures: failures of travels, by the target that begins a bead to which none leads.
    """

    beads: tuple[BeadPlan, ...]
    travels: tuple[TravelPath, ...]
    travel_failures: dict[int, Failure]

    @property
    def stretches(self) -> list[Stretch]:
        """All that can be run through, in order."""
        return [stretch for bead in self.beads for stretch in bead.stretches]


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
    with counted_progress(progress, "beads", len(firsts)) as count:
        return plan_beads(context, BeadRun(tuple(firsts), span.stop, span.start), count)


@dataclass(frozen=True, eq=False)
class KnownBead:
    """A bead that is planned before the run that it belongs to.

    Attributes:
        bead: its plan.
        spent: what was asked about it without a result.
    """

    bead: BeadPlan
    spent: float


@dataclass(frozen=True, eq=False)
class BeadRun:
    """Beads to be planned one after the other.

    Attributes:
        firsts: first target of each.
        stop: one past the last target of the last.
        q_before: where the arm comes from, (j,), rad, or None.
        known: the first of them, where it is planned already.
        reduced: whether travels are searched with few attempts from the beginning.
        share: of what the whole part may cost where it is lost.
    """

    firsts: tuple[int, ...]
    stop: int
    q_before: Floats | None
    known: KnownBead | None = None
    reduced: bool = False
    share: float = 1.0


def plan_beads(context: Context, run: BeadRun, count: Callable[[], None]) -> PartPlan:
    """Plan some beads of a part and the travels between them.

    Args:
        context: what the search needs.
        run: which.
        count: called for every bead.

    Returns:
        The plan of these beads; no travel leads to the first.
    """
    beads: list[BeadPlan] = []
    travels: list[TravelPath] = []
    travel_failures: dict[int, Failure] = {}
    last: Stretch | None = None
    way: TravelPath | Failure
    reduced = reduced_budget(context)
    judge, ahead = InfeasiblePartJudge(context, run.firsts[0], run.share), BeadsAhead(context, run.firsts, run.stop)
    for first, stop in zip(run.firsts, [*run.firsts[1:], run.stop], strict=True):
        if run.known is not None and run.known.bead.first == first:
            bead = run.known.bead
            judge.knows(bead, run.known.spent)
        else:
            q_before = run.q_before if last is None else last.q_targets[-1]
            found = ahead.bead(first, q_before)
            vain = ahead.in_vain(first, q_before)
            in_full = partial(plan_bead, context, first, stop, q_before, quickly=vain is None)
            bead = found or judge.plan(first, stop, q_before, in_full, vain)
        if bead.whole and stop < context.span.stop and not ahead.can_leave(last, bead):
            bead, _ = that_can_leave(context, bead)
        if last is not None and bead.whole:
            # where the part is lost, what is still searched for is what to report
            before = context.work
            whole = not run.reduced and not travel_failures and all(bead.whole for bead in beads)
            known = not beads[-1].open and judge.left(stop) > 0
            straight = ahead.travel(last, bead)
            if straight is not None:
                way = straight
            elif whole or known:
                bead, way = travel_to(context if whole else reduced, last, bead)
            else:
                way = travel(reduced_budget(context, to=1), last, bead.stretches[0], int(context.laid[last.stop - 1]))
            if isinstance(way, Failure) and not run.reduced:
                judge.charge(before)  # of a chunk's own beads it is not known yet that none is found
            if isinstance(way, Failure) and not (whole or known):
                bead = replace(bead, open=frozenset([first]))
            elif isinstance(way, Failure):
                travel_failures[first] = travel_failure(way, last, first)
            else:
                travels.append(way)
        beads.append(bead)
        last = bead.stretches[-1] if bead.stretches else last
        count()
    return PartPlan(tuple(beads), tuple(travels), travel_failures)


def known_bead(context: Context, first: int, stop: int, q_before: Floats | None, share: float) -> KnownBead:
    """The first bead of a run, planned as the run would plan it.

    Args:
        context: what the search needs.
        first: its first target.
        stop: one past its last.
        q_before: where the arm comes from, (j,), rad, or None.
        share: as of the run.

    Returns:
        The bead.
    """
    judge = InfeasiblePartJudge(context, first, share)
    bead = judge.plan(first, stop, q_before, partial(plan_bead, context, first, stop, q_before))
    return KnownBead(bead, judge.spent)


def travel_failure(travel: Failure, last: Stretch, first: int) -> Failure:
    """Why no travel leads from what was welded last to a bead that begins at a target."""
    return travel.at(FailurePlace(Where.TRAVEL, from_target=last.stop - 1, to_target=first))
