"""Everything that keeps a target out: of all its candidates, how many each reason excludes, and how nearly.

    found = all_reasons(result)               # {target: [{"reason", "candidates", **measure}, ...]}

A candidate is a configuration (one of the closed form's eight) at a sampled roll. It counts for the last test it fails
in the order reach, joint limits, singularity margins, collision; what passes all of them is "free", and why it does not
make the target feasible is on the way there (no_path, speed) or in a limit on gravity. The measure with each reason is
that of the candidate that is closest to passing.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..plain import plain
from ..planning.configurations import Nodes, evaluate
from ..planning.context import Context
from .check import Result

ORDER = ("unreachable", "joint_limit", "singular", "collision", "free")
BLOCK = 256  # targets evaluated together


def all_reasons(result: Result) -> dict[int, list[dict[str, Any]]]:
    """Count the candidates of every infeasible target by what excludes them.

    Args:
        result: a verdict.

    Returns:
        By target: one entry a reason that excludes any, in the order of the tests, with ``candidates`` and the
        reason's measure (as ``detail`` of a report's row), and "free" with the candidates that pass. With damped least
        squares, which finds some configurations and not others, "unreachable" counts rolls at which nothing was found.
    """
    job = result.job
    every = [i for i, row in enumerate(result.rows) if row.reason is not None]
    tables, which = np.unique(result.tables[every], axis=0, return_inverse=True)
    out = {}
    for n, table in enumerate(tables.tolist()):
        context = Context.of(job, (table[0], table[1]))
        bad = [i for i, at in zip(every, which.ravel().tolist(), strict=True) if at == n]
        for first in range(0, len(bad), BLOCK):
            block = bad[first : first + BLOCK]
            here = context.placed.rows(block)
            nodes = evaluate(job.solver, here, job.window, context.settings.roll_step, context.limits)
            out.update({i: _of_target(context, nodes, k, int(job.stage[i])) for k, i in enumerate(block)})
    return dict(sorted(out.items()))


def _of_target(context: Context, nodes: Nodes, i: int, stage: int) -> list[dict[str, Any]]:
    inside = nodes.within_limits[i]  # (r, g, k)
    allowed = np.isfinite(nodes.cost[i])
    free = np.zeros_like(allowed)
    at = np.argwhere(allowed)
    found = context.screen.clearances(nodes.q[i][tuple(at.T)], np.full(len(at), stage))
    hit = found.distance < context.settings.clearance
    free[tuple(at[~hit].T)] = True
    exists = np.isfinite(nodes.over[i]).all(axis=-1) | inside.any(axis=-1)  # (r, g)
    passed = [exists, inside.any(axis=-1), allowed.any(axis=-1), free.any(axis=-1)]
    last = np.sum(passed, axis=0)
    count = [int((last == k).sum()) for k in range(len(ORDER))]
    measures: dict[str, dict[str, Any]] = {"free": {}}
    if count[0]:
        measures["unreachable"] = _reach(nodes, i, ~exists)
    if count[1]:
        measures["joint_limit"] = nodes.joint_limit(i, last == 1)[0]
    if count[2]:
        measures["singular"] = nodes.singular(i, inside & (last == 2)[..., None])[0]
    if count[3]:
        mine = np.flatnonzero(hit & (last[tuple(at[:, :2].T)] == 3))
        best = int(mine[np.argmax(found.distance[mine])])
        roll = round(float(np.rad2deg(nodes.rolls[at[best, 0]])), 3)
        measures["collision"] = {**context.describe(found, best), "roll_deg": roll}
    return [
        plain({"reason": reason, "candidates": n, **measures[reason]})
        for reason, n in zip(ORDER, count, strict=True)
        if n
    ]


def _reach(nodes: Nodes, i: int, missing: np.ndarray) -> dict[str, Any]:
    """The reach at the best roll at which it is what a candidate lacks."""
    excess = nodes.reach_excess[i]
    out = missing.any(axis=1) & (excess != 0.0)
    if np.isfinite(excess).any() and not out.any():
        # the arm that faces away has a shorter reach than the one that faces the target
        return {"note": "within reach for other configurations at these rolls"}
    return nodes.reach(i, out)
