"""What a sweep costs a pose, what its screening saves, and what a second worker gives.

    python bench/sweep.py                       # the shipped propeller, 75 poses, one and two workers in turns
    python bench/sweep.py my.case.yaml --runs 5

Runs with one and with two workers take turns, so that both suffer alike from whatever else the machine does; starting
processes and preparing the case is left out by a first run of each. The two have to give the same rows, bit by bit.
CPU time tells what is left where other programs have the cores: it shows what two workers do beyond the work of one.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from bench_arguments import parsed

from cell import DEFAULT_CASE, Case, check, grid, load_case, prepare
from cell.pose_sweep.grid import Pose
from cell.pose_sweep.sweep import Unit, fingerprint
from cell.pose_sweep.workers import completed, processes
from cell.table_poses.hopeless_poses import screen


@dataclass(frozen=True)
class Timed:
    """A unit of a sweep with the CPU time it takes."""

    unit: Unit

    def __call__(self) -> tuple[dict[str, Any], float]:
        start = time.process_time()
        row = self.unit()
        return row, time.process_time() - start


def seconds(units: list[Timed], pool: Executor) -> tuple[float, float, list[dict[str, Any]]]:
    """Wall time, CPU time and rows of a sweep."""
    start = time.perf_counter()
    found = list(completed(pool, units))
    wall = time.perf_counter() - start
    rows = sorted((row for row, _ in found), key=lambda row: (row["E1_deg"], row["E2_deg"]))
    return wall, sum(cpu for _, cpu in found), rows


def screening(case: Case, poses: list[Pose]) -> None:
    """Print what settling a pose costs with and without the screening."""
    job = prepare(case)
    settled: list[tuple[float, float]] = []
    passed: list[float] = []
    for pose in poses:
        start = time.perf_counter()
        found = screen(job, pose.E1_deg, pose.E2_deg)
        took = time.perf_counter() - start
        if found is None:
            passed.append(took)
            continue
        start = time.perf_counter()
        if check(job, pose.E1_deg, pose.E2_deg).feasible:
            raise SystemExit(f"{pose}: screened out, but feasible")
        settled.append((took, time.perf_counter() - start))
    ours, whole = (sum(column) for column in zip(*settled, strict=True)) if settled else (0.0, 0.0)
    print(f"settled by screening  {len(settled)} of {len(poses)} poses")
    if settled:
        print(f"  screening           {1e3 * ours / len(settled):.1f} ms a pose")
        print(f"  whole check instead {1e3 * whole / len(settled):.1f} ms a pose, ratio {whole / ours:.0f}")
    if passed:
        print(f"passed on             {1e3 * statistics.mean(passed):.1f} ms a pose on top of its check")


def scaling(case: Case, poses: list[Pose], runs: int) -> None:
    """Print what a second worker gives, once both have prepared."""
    units = [Timed(Unit(fingerprint(case), case, pose)) for pose in poses]
    found: list[tuple[float, float, float, float]] = []
    with processes(1) as alone, processes(2) as pair:
        for pool in (alone, pair):
            seconds(units, pool)
        for _ in range(runs):
            (wall, cpu, rows), (wall2, cpu2, same) = seconds(units, alone), seconds(units, pair)
            if rows != same:
                raise SystemExit("two workers give other rows than one")
            found.append((wall, wall2, cpu, cpu2))
    wall, wall2, cpu, cpu2 = (statistics.median(column) for column in zip(*found, strict=True))
    ratios = sorted(a / b for a, b, _, _ in found)
    print(f"one worker            {wall:.2f} s for {len(poses)} poses, {cpu:.2f} s of CPU (median of {runs})")
    print(f"two workers           {wall2:.2f} s, {cpu2:.2f} s of CPU")
    print(f"ratio                 {statistics.median(ratios):.2f} ({ratios[0]:.2f} to {ratios[-1]:.2f})")
    print(f"by CPU time           {2 * cpu / cpu2:.2f} with a core for each")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", nargs="?", type=Path, default=DEFAULT_CASE, help="default: the shipped propeller")
    parser.add_argument("--runs", type=int, default=3, help="pairs of runs (default 3)")
    parser.add_argument("--e1", default="-90:90:45")
    parser.add_argument("--e2", default="-180:135:22.5")
    args = parsed(parser, runs=1, e1="0:45:45", e2="-45")
    case = load_case(args.case)
    poses = grid(case, args.e1, args.e2)
    screening(case, poses)
    scaling(case, poses, args.runs)


if __name__ == "__main__":
    main()
