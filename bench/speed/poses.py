"""The propeller's path at many table poses, collision included, against the bare calls that this needs.

    python -m bench.speed.poses                             # 1,000 poses; some minutes
    python -m bench.speed.poses --poses 200 --roll free

At every pose each target gets its configurations, and these are checked for collision, least cost first, until one
is free or none is left. Bare are: MuJoCo's kinematics and collision for just those configurations, and one closed form
a target. Both sides take turns, pose by pose, so that a busy machine slows them alike.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import mujoco
import numpy as np

from cell import Job, load_case, prepare, with_changes
from cell.case.roll_text import parse_roll
from cell.collision.checker import Checker
from cell.planning.configurations import nodes_at_rolls
from cell.planning.context import settings_of
from cell.scene.placement import place_targets
from ik import closed_form
from ik.roll import apply_roll

from ..bench_arguments import parsed

ROOT = Path(__file__).resolve().parents[2]


def verdicts(job: Job, checker: Checker, placed, clearance: float, roll_step: float):
    """Which targets have a free configuration, (n,); with the configurations and stages that were checked."""
    nodes = nodes_at_rolls(job.solver, placed, job.window, roll_step, job.singularity_limits)
    n = len(nodes.cost)
    cost, q = nodes.cost.reshape(n, -1), nodes.q.reshape(n, -1, job.solver.chain.n)
    order, count = np.argsort(cost, axis=1), np.isfinite(cost).sum(axis=1)
    free, looked = np.zeros(n, dtype=bool), []
    for k in range(int(count.max(initial=0))):
        todo = np.flatnonzero(~free & (count > k))
        if not len(todo):
            break
        here = q[todo, order[todo, k]]
        found = checker.clearances(here, job.deposits_before[todo])
        free[todo[found.distance >= clearance]] = True
        looked.append((here, job.deposits_before[todo]))
    return free, looked


def bare(job: Job, data: mujoco.MjData, Ts, looked) -> None:
    """The calls by themselves."""
    model, arm, scene = job.scene.model, job.scene.arm_qpos, job.scene
    closed_form.solve(job.solver.form, Ts)
    for configurations, stages in looked:
        for stage in np.unique(stages):
            there = scene.deposit_of_geom < stage
            model.geom_contype[:] = np.where(there, scene.contact_bits[0], 0)
            model.geom_conaffinity[:] = np.where(there, scene.contact_bits[1], 0)
            for q in configurations[stages == stage]:
                data.qpos[arm] = q
                mujoco.mj_kinematics(model, data)
                mujoco.mj_collision(model, data)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--poses", type=int, default=1000, help="random table poses (default 1000)")
    parser.add_argument("--roll", default=None, help="free | fixed:DEG | range:LO:HI instead of the case's")
    parser.add_argument("--seed", type=int, default=0)
    args = parsed(parser, poses=3)
    case = load_case(ROOT / "models" / "cases" / "propeller.case.yaml")
    if args.roll:
        case = with_changes(case, roll=parse_roll(args.roll))
    job = prepare(case)
    settings = settings_of(job)
    low, high = job.scene.table_range.T
    tables = np.random.default_rng(args.seed).uniform(low, high, (args.poses, 2))
    spent, calls, whole = np.zeros(2), 0, 0
    for E1, E2 in tables:
        start = time.perf_counter()
        placed = place_targets(job.targets, job.scene.T_base_part(E1, E2))
        checker = Checker(job.scene, (E1, E2), settings.clearance)
        free, looked = verdicts(job, checker, placed, settings.clearance, settings.roll_step)
        middle = time.perf_counter()
        Ts, data = apply_roll(placed.Ts_base_target, np.array(job.window.low)), mujoco.MjData(job.scene.model)
        data.qpos[job.scene.table_qpos] = E1, E2
        begin = time.perf_counter()
        bare(job, data, Ts, looked)
        spent += middle - start, time.perf_counter() - begin
        calls += sum(len(q) for q, _ in looked)
        whole += bool(free.all())
    n = args.poses * len(job.targets)
    print(
        f"{args.poses} poses of {len(job.targets)} targets, {whole} with all of them free;"
        f" {calls / n:.2f} collisions a target"
    )
    print(f"verdicts     {spent[0]:.2f} s, {spent[0] / n * 1e6:.1f} us a target")
    print(f"bare calls   {spent[1]:.2f} s, {spent[1] / n * 1e6:.1f} us a target")
    print(f"ratio        {spent[0] / spent[1]:.2f}")


if __name__ == "__main__":
    main()
