"""One bead planned: by the quick search, the full search, then with finer samples of the roll; and the travel to it.

    plan = plan_bead(context, first, stop, q_before)
    plan, leaves = that_can_leave(context, plan)    # with another end if the torch cannot be drawn back from this one
    plan, way = travel_to(context, last, plan)      # with another beginning if no travel leads to this one

A bead for which no whole motion is found is searched again, unless it is cut: with finer samples of the roll, with the
roll turning as fast as the joints can, and with rolls between the samples at which its targets are free. A bead to
which no travel leads is searched again with another beginning: another configuration or another roll. Metres, radians,
seconds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from ik.chain import Floats
from ik.roll import wrap

from ..failure import Failure
from .bead_outcome import BeadPlan
from .bead_search import MOST_SEARCHES, BeadSearch
from .collision_free_rolls import Stretches, collision_free_rolls, stabbing
from .configurations import nodes_at_rolls
from .context import FINER_ROLLS, Context
from .cuts.bead_cut import find_cut
from .edges.edge_check import SearchedBead, Stretch
from .station_search import ELSEWHERE, Ends, StationSearch
from .travels.travel import TravelPath, can_leave, travel, turned_to_travel_end

FINEST_ROUNDS = 60  # searches of such a bead until it is given up
BEGINNINGS = 4  # of a bead that no travel leads to
REDUCED = 10  # share of a travel's attempts once the part is lost


def reduced_budget(context: Context, to: int | None = None) -> Context:
    """The same, with fewer attempts at a travel, or so many."""
    attempts = max(context.settings.travel_attempts // REDUCED, 1) if to is None else to
    return replace(context, settings=replace(context.settings, travel_attempts=attempts))


def that_can_leave(context: Context, bead: BeadPlan, avoid: Sequence[Floats] = ()) -> tuple[BeadPlan, bool]:
    """The bead, with another end if the torch cannot be drawn back from this one; and whether it can be."""
    deposits_laid = int(context.laid[bead.stop - 1])
    ends: list[Floats] = []
    tried = bead
    while tried.whole:
        if can_leave(context, tried.stretches[0], deposits_laid):
            return tried, True
        ends.append(tried.stretches[0].q_targets[-1])
        if len(ends) == BEGINNINGS:
            break
        tried = searched_again(context, bead, Ends(None, avoid, ends))
    return bead, False


def travel_to(
    context: Context, last: Stretch, bead: BeadPlan, may_search: Callable[[], bool] | None = None
) -> tuple[BeadPlan, TravelPath | Failure]:
    """The travel to a bead that is whole; the bead begins elsewhere if that is the only way to reach it.

    Args:
        context: what the search needs.
        last: what is welded before.
        bead: the bead.
        may_search: asked once, before any way round is searched: whether it may be. Where not, no other beginning of
            the bead is tried either.

    Returns:
        The bead with the travel, or with why there is none.
    """
    deposits_laid = int(context.laid[last.stop - 1])  # the layer under the torch counts as laid
    avoid: list[Floats] = []
    tried = bead
    failed: Failure | None = None
    may = cache(may_search or (lambda: True))  # asked once
    refused = False

    def may_now() -> bool:
        nonlocal refused
        refused = not may()
        return not refused

    while True:
        start = tried.stretches[0]
        way = travel(context, last, start, deposits_laid, may_now)
        if not isinstance(way, Failure):
            return replace(tried, stretches=(turned_to_travel_end(start, way),)), way
        failed = failed or way
        avoid.append(start.q_targets[0])
        if refused or len(avoid) == BEGINNINGS or _cannot_leave(way):
            return bead, failed
        tried = searched_again(context, bead, Ends(last.q_targets[-1], avoid))
        tried, _ = that_can_leave(context, tried, avoid)
        if not tried.whole:
            return bead, failed


def _cannot_leave(travel: Failure) -> bool:
    """Whether a travel failed on the way out of the bead before it, where no other beginning of the next can help."""
    effort = travel.effort
    return effort is not None and effort.shut_in == "leaving" and effort.attempts is None


def plan_bead(
    context: Context,
    first: int,
    stop: int,
    q_before: Floats | None,
    most: float | None = None,
    *,
    quickly: bool = True,
) -> BeadPlan:
    """Plan one bead.

    Args:
        context: what the search needs.
        first: its first target.
        stop: one past its last.
        q_before: where the arm comes from, (j,), rad, or None.
        most: configurations that may be asked about once a target of it is known to be lost; None: any number.
        quickly: whether the quick search comes first; it need not where it has found no way already.

    Returns:
        The plan; beyond that limit, targets that only a finer search could settle are left open.
    """
    begun, step = context.work, context.settings.roll_step
    bead, ends = SearchedBead.of(context, first, stop), Ends(q_before)
    plan = _search(bead, ends, step) if quickly else _in_full(bead, ends, step)
    if plan.whole or context.window.is_fixed or not plan.may_be_mended:
        return plan
    if not plan.target_failures and find_cut(
        context, first, stop, [(i - 1 - first, i - first) for i in plan.edge_failures]
    ):
        return plan
    free = _free_between(context, plan, step / FINER_ROLLS)
    lost = {i for i in plan.target_failures if not free.get(i)}
    left = np.inf if most is None or not lost else most - (context.work - begun)
    finer = _search(bead, ends, step / FINER_ROLLS, _FastRollSearch(_all(free), most=left))
    if finer.open:
        return plan.only(lost)
    plan = _better(plan, replace(finer, hard=True))
    if plan.whole or not all(i in free and free[i] for i in plan.target_failures):
        return plan
    free |= _free_between(context, plan, step / FINER_ROLLS, free)
    rolls = _FastRollSearch(_all(free), FINEST_ROUNDS)
    return _better(plan, replace(_search(bead, ends, step / FINER_ROLLS**2, rolls), hard=True))


def _better(plan: BeadPlan, other: BeadPlan) -> BeadPlan:
    """The plan that loses fewer targets, and of these fewer altogether; the first of two alike."""
    return other if (other.lost, len(other.target_failures)) < (plan.lost, len(plan.target_failures)) else plan


def _free_between(
    context: Context, plan: BeadPlan, step: float, known: Mapping[int, Stretches] | None = None
) -> dict[int, Stretches]:
    """Rolls at which the lost targets of a bead are free by themselves, of those that are not proved out."""
    some = [i for i, lost in plan.target_failures.items() if not lost.failure.proved and i not in (known or {})]
    between = {i: plan.target_failures[i].failure.between for i in some}
    alone = {i: float(np.deg2rad(b.roll_deg)) for i, b in between.items() if b is not None and b.collision is None}
    return collision_free_rolls(context, some, step, alone)


def _all(found: Mapping[int, Stretches]) -> Floats:
    return stabbing(stretch for stretches in found.values() for stretch in stretches)


@dataclass(frozen=True, eq=False)
class _FastRollSearch:
    """How a bead is searched whose roll turns as fast as the joints can.

    Attributes:
        also: rolls beside the samples, (m,), rad.
        rounds: searches until it is given up.
        most: configurations that may be asked about.
    """

    also: Floats
    rounds: int = MOST_SEARCHES
    most: float = np.inf


def _search(bead: SearchedBead, ends: Ends, roll_step: float, free: _FastRollSearch | None = None) -> BeadPlan:
    """Search a bead: by the quick search, and by the full one where that finds no path."""
    if StationSearch.suits(bead):
        stretch = StationSearch(bead, roll_step, ends).run()
        if stretch is not None:
            return BeadPlan(bead.first, bead.first + len(bead), (stretch,), {}, {})
    return _in_full(bead, ends, roll_step, free)


def _in_full(bead: SearchedBead, ends: Ends, roll_step: float, free: _FastRollSearch | None = None) -> BeadPlan:
    """Search a bead at all rolls of every target."""
    context, also = bead.context, None if free is None else free.also
    nodes = nodes_at_rolls(context.solver, bead.placed, context.window, roll_step, context.limits, also)
    for at, q in [*((0, q) for q in ends.begin_off), *((-1, q) for q in ends.end_off)]:
        # whole turns are the travel's own to try
        off = np.abs(wrap(nodes.q[at] - q)).max(axis=-1)
        nodes.cost[at][off < ELSEWHERE] = np.inf
    if free is None:
        return BeadSearch(bead, nodes).run(ends.q_before)
    return BeadSearch(bead, nodes, turns_freely=True, rounds=free.rounds, most=free.most).run(ends.q_before)


def searched_again(context: Context, bead: BeadPlan, ends: Ends) -> BeadPlan:
    """A bead that begins and ends well off given configurations."""
    return _search(SearchedBead.of(context, bead.first, bead.stop), ends, context.settings.roll_step)
