"""From the end of one chunk to the beginning of the next, as if the next had been planned after it.

    joint = joint_of(context, last, bead)
    joint.bead, joint.way

The bead stays as it was planned where a travel leads to it. Where its beginning is far from where the arm is, as in
another configuration, or where no travel is found, it is planned again after the one before, and what is nearer, or
reached, is taken. Radians and metres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..failure import Failure
from ..planning.bead_search import BeadPlan
from ..planning.context import Context
from ..planning.edge_check import UNKNOWN_SPEED, Stretch
from ..planning.part_plan import plan_bead, that_can_leave, travel_to
from ..planning.travel import Way

FAR = np.pi / 2  # that a joint turns on the way to a bead, from which on another beginning is looked for
NEARER = 0.1  # s that it has to save


@dataclass(frozen=True, eq=False)
class Joint:
    """How a bead follows on what was welded before.

    Attributes:
        bead: as it is run; None where that is as it was planned.
        way: the travel to it, or why there is none.
    """

    bead: BeadPlan | None
    way: Way | Failure


def joint_of(context: Context, last: Stretch, bead: BeadPlan) -> Joint:
    """Lead from what was welded last to a bead that is whole.

    Args:
        context: what the bead was planned with.
        last: what was welded last.
        bead: planned from another beginning.

    Returns:
        The joint.
    """
    again: BeadPlan | None = None
    planned = bead
    if np.abs(bead.stretches[0].q_targets[0] - last.q_targets[-1]).max() > FAR:
        again = _after(context, last, bead)
        if again.whole and _seconds(context, last, again) < _seconds(context, last, bead) - NEARER:
            planned = again
    found, way = travel_to(context, last, planned)
    if isinstance(way, Failure):
        again = again or _after(context, last, bead)
        other = bead if planned is again else again
        if other.whole:
            found_, way_ = travel_to(context, last, other)
            if not isinstance(way_, Failure):
                found, way = found_, way_
    if isinstance(way, Failure):
        return Joint(None, way)
    return Joint(None if same_beginning(found, bead) and same_end(found, bead) else found, way)


def _after(context: Context, last: Stretch, bead: BeadPlan) -> BeadPlan:
    """A bead planned after what was welded last."""
    again = plan_bead(context, bead.first, bead.stop, last.q_targets[-1])
    return that_can_leave(context, again)[0] if again.whole and bead.stop < context.span.stop else again


def _seconds(context: Context, last: Stretch, bead: BeadPlan) -> float:
    """Time of the slowest joint to the beginning of a bead, s."""
    speed = context.solver.chain.max_speed
    move = np.abs(bead.stretches[0].q_targets[0] - last.q_targets[-1])
    return float((move / np.where(np.isfinite(speed), speed, UNKNOWN_SPEED)).max())


def same_beginning(one: BeadPlan, other: BeadPlan) -> bool:
    """Whether two plans of a bead begin in one configuration."""
    return bool((one.stretches[0].q_targets[0] == other.stretches[0].q_targets[0]).all())


def same_end(one: BeadPlan, other: BeadPlan) -> bool:
    """Whether two plans of a bead end in one configuration: what comes after the one can come after the other."""
    return bool((one.stretches[-1].q_targets[-1] == other.stretches[-1].q_targets[-1]).all())
