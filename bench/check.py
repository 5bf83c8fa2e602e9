"""``rbam check`` on the shipped case, start to end, against the time that importing its libraries takes.

    python bench/check.py                # five alternating pairs of runs
    python bench/check.py my.case.yaml --runs 9

A process that only imports mujoco, trimesh and scipy is the least that any such check can take; the ratio to it says
what slicing, solving, colliding and planning add, whatever the machine. Runs alternate, so that both suffer alike from
whatever else goes on.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import time
from pathlib import Path

from bench_arguments import parsed

ROOT = Path(__file__).resolve().parents[1]
IMPORTS = "import mujoco, trimesh, scipy"


def seconds(command: list[str], allowed: tuple[int, ...]) -> float:
    """Wall time of a command.

    Args:
        command: what to run.
        allowed: exit codes that are no failure.

    Raises:
        SystemExit: it failed; with its message.
    """
    start = time.perf_counter()
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    took = time.perf_counter() - start
    if done.returncode not in allowed:
        raise SystemExit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr.strip()}")
    return took


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", nargs="?", help="case file (default: the shipped propeller)")
    parser.add_argument("--runs", type=int, default=5, help="pairs of runs (default 5)")
    args = parsed(parser, runs=1)
    check = [sys.executable, "-m", "cell", "check", *([str(Path(args.case).resolve())] if args.case else [])]
    imports = [sys.executable, "-c", IMPORTS]
    seconds(check, (0, 1))  # once for the disk's cache and the bytecode
    seconds(imports, (0,))
    pairs = [(seconds(check, (0, 1)), seconds(imports, (0,))) for _ in range(args.runs)]
    mine, floor = (statistics.median(column) for column in zip(*pairs, strict=True))
    ratios = sorted(a / b for a, b in pairs)
    print(f"rbam check        {mine:.2f} s (median of {args.runs})")
    print(f"imports alone     {floor:.2f} s")
    print(f"ratio             {statistics.median(ratios):.2f} ({ratios[0]:.2f} to {ratios[-1]:.2f})")


if __name__ == "__main__":
    main()
