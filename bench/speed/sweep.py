"""What a sweep costs a pose, what its screening saves, and what a second worker gives.

    python -m bench.speed.sweep                       # the shipped propeller, 75 poses, one and two workers in turns
    python -m bench.speed.sweep my.case.yaml --runs 5

Runs with one and with two workers take turns, so that both suffer alike from whatever else the machine does; starting
processes and preparing the case is left out by a first run of each. The two have to give the same rows, bit by bit.
CPU time tells what is left where other programs have the cores: it shows what two workers do beyond the work of one.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cell import DEFAULT_CASE, Case, check, grid, load_case, prepare
from cell.pose_sweep.grid import Pose
from cell.pose_sweep.sweep import SweepPlan, fingerprint
from cell.pose_sweep.workers import completed, worker_processes
from cell.table_poses.hopeless_poses import screen, screen_all

from ..bench_arguments import parsed


@dataclass(frozen=True)
class Timed:
    """A unit of a sweep with the CPU time it takes."""

    unit: Callable[[], Any]

    def __call__(self) -> tuple[Any, float]:
        start = time.process_time()
        found = self.unit()
        return found, time.process_time() - start


def seconds(work: SweepPlan, pool: Executor) -> tuple[float, float, list[dict[str, Any]]]:
    """Wall time, CPU time and rows of a sweep."""
    spent = 0.0

    def timed(units: Sequence[Callable[[], Any]]) -> Generator[Any, None, None]:
        nonlocal spent
        for found, cpu in completed(pool, [Timed(unit) for unit in units]):
            spent += cpu
            yield found

    start = time.perf_counter()
    rows = sorted(work.rows(timed), key=lambda row: (row["E1_deg"], row["E2_deg"]))
    return time.perf_counter() - start, spent, rows


def screening(case: Case, poses: list[Pose]) -> None:
    """Print what settling poses costs together, each by itself, and without the screening."""
    job = prepare(case)
    asked = [(pose.E1_deg, pose.E2_deg) for pose in poses]
    screen_all(job, asked[:1])  # what the job keeps is computed at the first
    start = time.process_time()
    found = screen_all(job, asked)
    together = time.process_time() - start
    start = time.process_time()
    if [screen(job, *pose) for pose in asked] != found:
        raise SystemExit("poses screened together are not what each is by itself")
    apart = time.process_time() - start
    settled = [pose for pose, one in zip(asked, found, strict=True) if one is not None]
    whole: list[float] = []
    for pose in settled[:: max(len(settled) // 5, 1)]:
        start = time.process_time()
        if check(job, *pose).feasible:
            raise SystemExit(f"{pose}: screened out, but feasible")
        whole.append(time.process_time() - start)
    print(f"settled by screening  {len(settled)} of {len(poses)} poses")
    print(f"  together            {1e3 * together / len(poses):.1f} ms of CPU a pose")
    print(f"  each by itself      {1e3 * apart / len(poses):.1f} ms, ratio {apart / together:.1f}")
    if whole:
        print(f"  whole check instead {1e3 * statistics.mean(whole):.1f} ms (mean of {len(whole)} of them)")


def scaling(case: Case, poses: list[Pose], runs: int) -> None:
    """Print what a second worker gives, once both have prepared."""
    work = SweepPlan(fingerprint(case), case, tuple(poses))
    found: list[tuple[float, float, float, float]] = []
    with worker_processes(1) as alone, worker_processes(2) as pair:
        for pool in (alone, pair):
            seconds(work, pool)
        for _ in range(runs):
            (wall, cpu, rows), (wall2, cpu2, same) = seconds(work, alone), seconds(work, pair)
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
