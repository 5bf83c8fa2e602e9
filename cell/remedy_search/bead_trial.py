"""A first opinion on a changed case: whether some of its beads come out whole.

    first_failure(job, E1_deg, E2_deg, [3, 7], None)       # infeasible targets of the first bead that has any

Single targets are checked before their bead is searched, since a target at which everything collides is what takes a
search of a bead longest.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..collision.table_clearances import table_alone
from ..job.job import Job
from ..planning.bead_plan import plan_bead
from ..planning.configurations import nodes_at_rolls
from ..planning.context import FINER_ROLLS, Context
from ..scene.scene import table_angles

TRIED_TOGETHER = 8  # configurations checked before asking whether one is free
TARGETS_ALONE = 4  # targets of a bead that are checked by themselves


def first_failure(job: Job, E1_deg: float, E2_deg: float, beads: Iterable[int], wanted: set[int] | None) -> set[int]:
    """Infeasible targets of the first bead that has wanted ones among them (None: any); empty if none has."""
    table = table_angles(job.scene, E1_deg, E2_deg)
    if table_alone(job.scene, table).distance[0] < 0.0:
        return set(range(len(job.targets)))
    context = Context.of(job, table)
    for bead in beads:
        first, stop = np.searchsorted(job.targets.bead, [bead, bead + 1]).tolist()
        some = range(first, stop, max((stop - first) // TARGETS_ALONE, 1))
        if not all(_stands_free(context, i) for i in some if wanted is None or i in wanted):
            return set(range(first, stop))
        plan = plan_bead(context, first, stop, None, 0.0)
        lost = {*plan.target_failures, *plan.edge_failures, *plan.open}
        if wanted is not None:
            lost &= wanted
        if lost:
            return lost
    return set()


def _stands_free(context: Context, i: int) -> bool:
    """Whether any configuration of a target is free, at three times the rolls that a bead is first searched with."""
    placed = context.placed.rows([i])
    nodes = nodes_at_rolls(
        context.solver, placed, context.window, context.settings.roll_step / FINER_ROLLS, context.limits
    )
    at = np.argwhere(np.isfinite(nodes.cost))
    at = at[np.argsort(nodes.cost[tuple(at.T)], kind="stable")]
    for first in range(0, len(at), TRIED_TOGETHER):
        q = nodes.q[tuple(at[first : first + TRIED_TOGETHER].T)]
        found = context.screen.clearances(q, np.full(len(q), context.deposits_before[i]))
        if (found.distance >= context.settings.clearance).any():
            return True
    return False
