"""Everything that keeps a target out: of all its candidates, how many each reason excludes, and how nearly.

    found = all_reasons(result)               # {target: [Excluded(reason, candidates, failure), ...]}

A candidate is a configuration (one of the closed form's eight) at a sampled roll. It counts for the last test it fails
in the order reach, joint limits, singularity margins, collision; what passes all of them is "free", and why it does not
make the target feasible is on the way there (no_path, speed) or in a limit on gravity. The measure with each reason is
that of the candidate that is closest to passing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..failure import Failure, Kind, SearchEffort
from ..planning.configurations import Nodes, nodes_at_rolls
from ..planning.context import Context
from .result import Result

ORDER = ("unreachable", "joint_limit", "singular", "collision", "free")
BLOCK = 256  # targets evaluated together


@dataclass(frozen=True)
class Excluded:
    """Candidates of a target that one reason excludes.

    Attributes:
        reason: one of ``ORDER``.
        candidates: how many.
        failure: of the candidate that is closest to passing; None of those that are free.
    """

    reason: str
    candidates: int
    failure: Failure | None

    def document(self) -> dict[str, Any]:
        """As reports write it."""
        measure = {} if self.failure is None else self.failure.document()
        return {"reason": self.reason, "candidates": self.candidates, **measure}


def all_reasons(result: Result) -> dict[int, list[Excluded]]:
    """Count the candidates of every infeasible target by what excludes them.

    Args:
        result: a verdict.

    Returns:
        By target: one entry a reason that excludes any, in the order of the tests, and "free" with the candidates
        that pass. With damped least squares, which finds some configurations and not others, "unreachable" counts
        rolls at which nothing was found.
    """
    job = result.job
    every = [i for i, row in enumerate(result.rows) if row.failure is not None]
    if result.mode == "coordinated":  # the reasons are those at the angles that the table moves through
        return _of_targets(Context.along(job, result.tables), every)
    tables, which = np.unique(result.tables[every], axis=0, return_inverse=True)
    out = {}
    for n, table in enumerate(tables.tolist()):
        bad = [i for i, at in zip(every, which.ravel().tolist(), strict=True) if at == n]
        out.update(_of_targets(Context.of(job, (table[0], table[1])), bad))
    return dict(sorted(out.items()))


def _of_targets(context: Context, bad: list[int]) -> dict[int, list[Excluded]]:
    """What excludes the candidates of some targets."""
    out = {}
    for first in range(0, len(bad), BLOCK):
        block = bad[first : first + BLOCK]
        here = context.placed.rows(block)
        nodes = nodes_at_rolls(context.solver, here, context.window, context.settings.roll_step, context.limits)
        out.update({i: _of_target(context, nodes, k, i) for k, i in enumerate(block)})
    return out


def _of_target(context: Context, nodes: Nodes, i: int, target: int) -> list[Excluded]:
    """What excludes the candidates of a target, which is number i of the nodes'."""
    inside = nodes.within_limits(i)  # (r, g, k)
    allowed = np.isfinite(nodes.cost[i])
    free = np.zeros_like(allowed)
    at = np.argwhere(allowed)
    axes = context.placed.axes(nodes.q[i][tuple(at.T)], np.full(len(at), target))
    found = context.screen.clearances(axes, np.full(len(at), context.deposits_before[target]))
    hit = found.distance < context.settings.clearance
    free[tuple(at[~hit].T)] = True
    exists = np.isfinite(nodes.over[i]).all(axis=-1) | inside.any(axis=-1)  # (r, g)
    passed = [exists, inside.any(axis=-1), allowed.any(axis=-1), free.any(axis=-1)]
    last = np.sum(passed, axis=0)
    count = [int((last == k).sum()) for k in range(len(ORDER))]
    failures: dict[str, Failure] = {}
    if count[0]:
        failures["unreachable"] = _reach(nodes, i, ~exists)
    if count[1]:
        failures["joint_limit"] = nodes.joint_limit(i, last == 1)[0]
    if count[2]:
        failures["singular"] = nodes.singular(i, inside & (last == 2)[..., None])[0]
    if count[3]:
        mine = np.flatnonzero(hit & (last[tuple(at[:, :2].T)] == 3))
        best = int(mine[np.argmax(found.distance[mine])])
        roll = round(float(np.rad2deg(nodes.rolls[at[best, 0]])), 3)
        failures["collision"] = replace(context.describe(found, best), roll_deg=roll)
    return [Excluded(reason, n, failures.get(reason)) for reason, n in zip(ORDER, count, strict=True) if n]


def _reach(nodes: Nodes, i: int, missing: np.ndarray) -> Failure:
    """The reach at the best roll at which it is what a candidate lacks."""
    excess = nodes.reach_excess[i]
    out = missing.any(axis=1) & (excess != 0.0)
    if np.isfinite(excess).any() and not out.any():
        # the arm that faces away has a shorter reach than the one that faces the target
        note = "within reach for other configurations at these rolls"
        return Failure(Kind.UNREACHABLE, effort=SearchEffort(note=note))
    return nodes.reach(i, out)
