"""From the end of one chunk to the beginning of the next.

    plan = turned_to_chunk_before(context, last, plan)  # the next chunk, in the turns that joints have come to
    join = join_to(context, last, bead)
    join.bead, join.way

A chunk whose configurations are those of the arm but for whole turns of joints is turned as a whole. Its first bead
stays as it was planned where a travel leads to it; where none is found, it is planned again after the one before, to
begin elsewhere.
Radians and metres.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats

from ..failure import Failure
from ..planning.bead_outcome import BeadPlan
from ..planning.bead_plan import travel_to
from ..planning.bead_runs import PartPlan
from ..planning.context import Context
from ..planning.edges.edge_check import Stretch
from ..planning.travels.straight_travels import straight_travel
from ..planning.travels.travel import TravelPath


@dataclass(frozen=True, eq=False)
class JoinedBead:
    """How a bead follows on what was welded before.

    Attributes:
        bead: as it is run; None where that is as it was planned.
        way: the travel to it, or why there is none; None where no straight one is free and no other was searched.
    """

    bead: BeadPlan | None
    way: TravelPath | Failure | None


def turned_to_chunk_before(context: Context, last: Stretch, plan: PartPlan) -> PartPlan:
    """A chunk turned by the whole turns that the arm's joints are off its beginning, where the limits allow it.

    Args:
        context: what it was planned with.
        last: what is welded before.
        plan: of the chunk; some of it can be run through.

    Returns:
        The chunk, every configuration of it where it was but for whole turns.
    """
    turn = turns_between(last, plan)
    if not turn.any():
        return plan
    chain, n = context.solver.chain, context.solver.chain.n
    q = np.concatenate([stretch.q for stretch in plan.stretches] + [way.q[:, :n] for way in plan.travels])
    turn[(q.min(axis=0) + turn < chain.lower) | (q.max(axis=0) + turn > chain.upper)] = 0.0
    return _turned(plan, turn) if turn.any() else plan


def turns_between(last: Stretch, plan: PartPlan) -> Floats:
    """Whole turns that the arm's joints, after what was welded last, are off the beginning of a chunk, (j,), rad."""
    return np.asarray(2 * np.pi * np.round((last.q_targets[-1] - plan.stretches[0].q_targets[0]) / (2 * np.pi)))


def _turned(plan: PartPlan, turn: Floats) -> PartPlan:
    """A plan with joints turned by whole turns, (j,), rad."""

    def stretch(s: Stretch) -> Stretch:
        return replace(s, q_targets=s.q_targets + turn, q=s.q + turn)

    def way(found: TravelPath) -> TravelPath:
        rows = found.q.copy()
        rows[:, : len(turn)] += turn
        return found._replace(q=rows)

    beads = tuple(replace(bead, stretches=tuple(map(stretch, bead.stretches))) for bead in plan.beads)
    return PartPlan(beads, tuple(map(way, plan.travels)), plan.travel_failures)


def join_to(context: Context, last: Stretch, bead: BeadPlan, *, straight: bool = False) -> JoinedBead:
    """Lead from what was welded last to a bead that is whole.

    Args:
        context: what the bead was planned with.
        last: what was welded last.
        bead: planned from another beginning.
        straight: whether a straight travel alone is wanted: of a part that is lost.

    Returns:
        The bead, if it had to be planned anew, and the way to it or why there is none.
    """
    if straight:
        return JoinedBead(None, straight_travel(context, last, bead.stretches[0]))
    found, way = travel_to(context, last, bead)
    stays = isinstance(way, Failure) or (same_beginning(found, bead) and same_end(found, bead))
    return JoinedBead(None if stays else found, way)


def same_beginning(one: BeadPlan, other: BeadPlan) -> bool:
    """Whether two plans of a bead begin in one configuration."""
    return bool((one.stretches[0].q_targets[0] == other.stretches[0].q_targets[0]).all())


def same_end(one: BeadPlan, other: BeadPlan) -> bool:
    """Whether two plans of a bead end in one configuration, so that the same motion can follow either."""
    return bool((one.stretches[-1].q_targets[-1] == other.stretches[-1].q_targets[-1]).all())
