"""What a sweep costs a pose, what its screening saves, and what a second worker gives.

    python bench/sweep.py                       # the shipped propeller, 75 poses, one and two workers in turns
    python bench/sweep.py my.case.yaml --runs 5

Runs with one and with two workers take turns, so that both suffer alike from whatever else the machine does; starting
processes and preparing the case is left out by a first run of each. The two have to give the same rows, bit by bit.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import time
from concurrent.futures import Executor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from cell.check import check
from cell.config import DEFAULT_CASE, load_case
from cell.job import prepare
from cell.sections import Case
from cell.sweep import sweep
from cell.sweep_grid import Pose, grid
from cell.sweep_pool import processes
from cell.sweep_screen import screen


def seconds(case: Case, poses: list[Pose], pool: Executor) -> tuple[float, list[dict[str, object]]]:
    """Wall time of a sweep, and its rows."""
    start = time.perf_counter()
    rows = sweep(case, poses, executor=pool)
    return time.perf_counter() - start, rows


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
    ratios, one, two = [], [], []
    with processes(1) as alone, processes(2) as pair:
        start = time.perf_counter()
        for pool in (alone, pair):
            sweep(case, poses, executor=pool)
        print(f"first runs            {time.perf_counter() - start:.2f} s, with the start of three processes")
        for _ in range(runs):
            (a, rows), (b, same) = seconds(case, poses, alone), seconds(case, poses, pair)
            if rows != same:
                raise SystemExit("two workers give other rows than one")
            one.append(a)
            two.append(b)
            ratios.append(a / b)
    print(f"one worker            {statistics.median(one):.2f} s for {len(poses)} poses (median of {runs})")
    print(f"two workers           {statistics.median(two):.2f} s")
    print(f"ratio                 {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f})")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", nargs="?", type=Path, default=DEFAULT_CASE, help="default: the shipped propeller")
    parser.add_argument("--runs", type=int, default=3, help="pairs of runs (default 3)")
    parser.add_argument("--e1", default="-90:90:45")
    parser.add_argument("--e2", default="-180:135:22.5")
    args = parser.parse_args()
    case = load_case(args.case)
    poses = grid(case, args.e1, args.e2)
    screening(case, poses)
    scaling(case, poses, args.runs)


if __name__ == "__main__":
    main()
