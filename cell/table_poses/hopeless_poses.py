"""Settling hopeless poses without a search: what no motion can help is found from the targets one by one.

    found = screen(job, E1_deg, E2_deg)       # None: the pose passes, and needs a check
    screen_all(job, [(90, 180), (0, 0)])      # the same at many poses, faster
    found.infeasible, found.reasons, found.looked_at

Each stage is sound: a target that it finds infeasible is so in ``rbam check`` too. "Feasible" is never said here.

1. The table by itself against the cell, one collision test.
2. The angle of deposition where it is limited, and, by the roll certificate, targets proved to have no configuration at
   any allowed roll: all targets.
3. Targets without a configuration that is clear, at every roll that a check tries: ``SPREAD`` targets that lie far from
   one another.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from ik.reachability_proof import certify

from ..arrays import Ints
from ..collision.checker import Checker
from ..collision.table_clearances import tables_alone
from ..farthest_points import farthest_points
from ..job.job import Job
from ..planning.configurations import Nodes, nodes_at_rolls, reasons
from ..planning.context import FINER_ROLLS, LEAST_REACH, settings_of
from ..rigid import is_beyond
from ..scene.placement import PlacedTargets, place_targets
from ..scene.scene import table_angles

SPREAD = 32  # targets whose collisions are checked
NORMAL_MM = 20.0  # two targets a unit of normal apart count as this far from one another


@dataclass(frozen=True)
class Screened:
    """Why a pose cannot be feasible.

    Attributes:
        infeasible: targets found infeasible, at least 1.
        looked_at: of how many.
        reasons: how many of them by reason, those that occur.
    """

    infeasible: int
    looked_at: int
    reasons: dict[str, int]


def screen(job: Job, E1_deg: float, E2_deg: float, laid: int | None = None) -> Screened | None:
    """Look for targets that are infeasible by themselves.

    Args:
        job: from ``cell.job.job.prepare``.
        E1_deg: tilt of the table.
        E2_deg: turn of the table.
        laid: deposits on the table once all of the job's targets are welded; all of the part's where left out.

    Returns:
        What was found; None where the pose passes.

    Raises:
        InputError: the positioner has no such angles.
    """
    return screen_all(job, [(E1_deg, E2_deg)], laid)[0]


def screen_all(job: Job, poses: Sequence[tuple[float, float]], laid: int | None = None) -> list[Screened | None]:
    """The same at many poses: the table and the proofs of all of them at once, which takes a fraction of the time.

    Args:
        job: from ``cell.job.job.prepare``.
        poses: tilt and turn of the table, deg.
        laid: as of :func:`screen`.

    Returns:
        What was found at each.

    Raises:
        InputError: the positioner has no such angles.
    """
    tables = np.array([table_angles(job.scene, *pose) for pose in poses]).reshape(-1, 2)
    n = len(job.targets)
    hits = tables_alone(job.scene, tables, laid).distance < 0.0
    found: list[Screened | None] = [Screened(n, n, {"collision": n}) if hit else None for hit in hits]
    left = np.flatnonzero(~hits).tolist()
    placed = [place_targets(job.targets, T_base_part) for T_base_part in job.scene.Ts_base_site("part", tables[left])]
    some = targets_far_apart(job.targets.position, job.targets.normal) if left else np.zeros(0, dtype=np.int64)
    for k, one, out in zip(left, placed, _proved_out(job, placed), strict=True):
        dead, looked_at = _steep(job, one) | out, n
        if not dead:
            checker = Checker(job.scene, (tables[k, 0], tables[k, 1]), max(settings_of(job).clearance, LEAST_REACH))
            dead, looked_at = _blocked(job, one, some, checker), len(some)
        if dead:
            found[k] = Screened(len(dead), looked_at, dict(Counter(dead.values())))
    return found


def roll_steps(job: Job) -> tuple[float, ...]:
    """Distances of the rolls that a check samples, rad, coarse first."""
    step = settings_of(job).roll_step
    return (step,) if job.window.is_fixed else (step, step / FINER_ROLLS)


def targets_far_apart(position: Floats, normal: Floats, count: int = SPREAD) -> Ints:
    """Targets far from one another: each the one farthest from those before.

    Args:
        position: (n, 3), mm.
        normal: (n, 3).
        count: how many.

    Returns:
        Their numbers, ascending.
    """
    points = np.concatenate([position, NORMAL_MM * normal], axis=1)
    return np.unique(farthest_points(points, count))


def _steep(job: Job, placed: PlacedTargets) -> dict[int, str]:
    limit = job.case.checks.gravity_max_deg
    if limit is None:
        return {}
    angle = np.arccos(np.clip(placed.normal @ job.scene.T_world_base()[2, :3], -1.0, 1.0))
    return dict.fromkeys(np.flatnonzero(is_beyond(angle, np.deg2rad(limit))).tolist(), "gravity")


def _proved_out(job: Job, placed: Sequence[PlacedTargets]) -> list[dict[int, str]]:
    """At each pose the targets without a configuration at any allowed roll, and the reason a check gives."""
    solver = job.solver
    if solver.form is None or not placed:
        return [{} for _ in placed]
    Ts = np.concatenate([one.Ts_base_target for one in placed])
    proofs = certify(solver.chain, Ts, job.window, job.singularity_limits, solver.form)
    dead = proofs.unreachable.reshape(len(placed), -1)
    causes = iter(reasons(solver, Ts[proofs.unreachable], job.window, roll_steps(job)[0]))
    return [{i: next(causes) for i in np.flatnonzero(rows).tolist()} for rows in dead]


def _nodes(job: Job, placed: PlacedTargets, targets: Ints, roll_step: float) -> Nodes:
    some = placed.rows(targets)
    return nodes_at_rolls(job.solver, some, job.window, roll_step, job.singularity_limits)


def _blocked(job: Job, placed: PlacedTargets, targets: Ints, checker: Checker) -> dict[int, str]:
    """Which of some targets have no free configuration at any roll that a check tries, by reason."""
    why: dict[int, str] = {}
    for roll_step in roll_steps(job):
        if not len(targets):
            break
        nodes = _nodes(job, placed, targets, roll_step)
        open_ones = np.flatnonzero(~_free(job, nodes, targets, checker)).tolist()
        bare = {k: not np.isfinite(nodes.cost[k]).any() for k in open_ones}
        why = {int(targets[k]): nodes.why_not(k)[0].reason if bare[k] else "collision" for k in open_ones}
        targets = targets[open_ones]
    return why


def _free(job: Job, nodes: Nodes, targets: Ints, checker: Checker) -> NDArray[np.bool_]:
    """Of which targets any configuration is clear, (n,); those that cost least first, of all targets at once."""
    cost = nodes.cost.reshape(len(targets), -1)
    order, count = np.argsort(cost, axis=1, kind="stable"), np.isfinite(cost).sum(axis=1)
    q, deposits_laid = nodes.q.reshape(*cost.shape, -1), job.deposits_before[targets]
    free = np.zeros(len(targets), dtype=bool)
    for k in range(int(count.max(initial=0))):
        todo = np.flatnonzero(~free & (count > k))
        if not len(todo):
            break
        found = checker.clearances(q[todo, order[todo, k]], deposits_laid[todo])
        free[todo] = found.distance >= settings_of(job).clearance
    return free
