"""Settling hopeless poses without a search: what no motion can help is found from the targets one by one.

    found = screen(job, E1_deg, E2_deg)       # None: nothing speaks against the pose, it needs a check
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
from dataclasses import dataclass

import numpy as np

from ik.chain import Floats
from ik.reachability_proof import certify

from ..arrays import Ints
from ..collision.checker import Checker
from ..collision.table import table_alone
from ..farthest_points import farthest_points
from ..job.job import Job
from ..planning.configurations import Nodes, evaluate
from ..planning.context import FINER, LEAST_REACH, settings_of
from ..scene.placement import Placed, place
from ..scene.scene import table_angles

SPREAD = 32  # targets whose collisions are looked at
NORMAL_MM = 20.0  # two targets a unit of normal apart count as this far from one another
BITE = 4  # configurations tried at once; most targets are free in the first


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
        What was found; None where nothing speaks against the pose.

    Raises:
        InputError: the positioner has no such angles.
    """
    table = table_angles(job.scene, E1_deg, E2_deg)
    n = len(job.targets)
    if table_alone(job.scene, table, laid).distance[0] < 0.0:
        return Screened(n, n, {"collision": n})
    placed = place(job.targets, job.scene.T_base_part(*table))
    dead = _steep(job, placed) | _proved_out(job, placed)
    if dead:
        return Screened(len(dead), n, dict(Counter(dead.values())))
    some = spread(job.targets.position, job.targets.normal)
    checker = Checker(job.scene, table, max(settings_of(job).clearance, LEAST_REACH))
    dead = _blocked(job, placed, some, checker)
    if dead:
        return Screened(len(dead), len(some), dict(Counter(dead.values())))
    return None


def roll_steps(job: Job) -> tuple[float, ...]:
    """Distances of the rolls that a check samples, rad, coarse first."""
    step = settings_of(job).roll_step
    return (step,) if job.window.is_fixed else (step, step / FINER)


def spread(position: Floats, normal: Floats, count: int = SPREAD) -> Ints:
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


def _steep(job: Job, placed: Placed) -> dict[int, str]:
    limit = job.case.checks.gravity_max_deg
    if limit is None:
        return {}
    angle = np.arccos(np.clip(placed.normal @ job.scene.T_world_base()[2, :3], -1.0, 1.0))
    return dict.fromkeys(np.flatnonzero(angle > np.deg2rad(limit)).tolist(), "gravity")


def _proved_out(job: Job, placed: Placed) -> dict[int, str]:
    """Targets without a configuration at any allowed roll, and the reason a check gives."""
    solver = job.solver
    if solver.form is None:
        return {}
    proofs = certify(solver.chain, placed.Ts_base_target, job.window, job.singularity_limits, solver.form)
    out = np.flatnonzero(proofs.unreachable)
    if not len(out):
        return {}
    nodes = _nodes(job, placed, out, roll_steps(job)[0])
    return {int(i): nodes.why_not(k)[0].reason for k, i in enumerate(out)}


def _nodes(job: Job, placed: Placed, targets: Ints, roll_step: float) -> Nodes:
    some = placed.rows(targets)
    return evaluate(job.solver, some, job.window, roll_step, job.singularity_limits)


def _blocked(job: Job, placed: Placed, targets: Ints, checker: Checker) -> dict[int, str]:
    """Which of some targets have no free configuration at any roll that a check tries, by reason."""
    reasons: dict[int, str] = {}
    for roll_step in roll_steps(job):
        if not len(targets):
            break
        nodes = _nodes(job, placed, targets, roll_step)
        open_ones = [k for k, i in enumerate(targets) if not _free(job, nodes, k, int(i), checker)]
        bare = {k: not np.isfinite(nodes.cost[k]).any() for k in open_ones}
        reasons = {int(targets[k]): nodes.why_not(k)[0].reason if bare[k] else "collision" for k in open_ones}
        targets = targets[open_ones]
    return reasons


def _free(job: Job, nodes: Nodes, k: int, target: int, checker: Checker) -> bool:
    """Whether any configuration of a target is clear; those that cost least first."""
    clearance = settings_of(job).clearance
    allowed = np.isfinite(nodes.cost[k])
    q = nodes.q[k][allowed][np.argsort(nodes.cost[k][allowed], kind="stable")]
    for some in np.split(q, range(BITE, len(q), BITE)) if len(q) else ():
        stage = np.full(len(some), job.stage[target])
        if (checker.clearances(some, stage).distance >= clearance).any():
            return True
    return False
