"""``rbam check`` on the shipped case, start to end, against the time that importing its libraries takes.

    python -m bench.speed.check                # five alternating pairs of runs
    python -m bench.speed.check my.case.yaml --runs 9

"The imports alone" are a process that does nothing but ``import mujoco, trimesh, scipy``; trimesh brings numpy,
scipy.sparse, scipy.spatial and networkx. The ratio to it says what slicing, solving, colliding and planning cost,
whatever the machine. What a check itself imports of other packages is less and stands beside it. Runs alternate, so
that all suffer alike from whatever else goes on; the ratios are of processor time (user and system, all threads), least
of the runs. Every process has its bytecode, as an installed program has: where the environment says that none is
written, it is written to a temporary folder.

Below, what answers at once: help, a case that is wrong, a mesh sliced.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from ..bench_arguments import parsed

ROOT = Path(__file__).resolve().parents[2]
IMPORTS = "import mujoco, trimesh, scipy"
OWN = "import mujoco, numpy, pydantic, yaml, shapely, manifold3d, rich.console, rich.table"
WRONG = "slicing: {h_layer: 2}\n"


def environment(folder: str) -> dict[str, str]:
    """The environment of the processes, in which bytecode is kept."""
    kept = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
    if kept != dict(os.environ):
        kept["PYTHONPYCACHEPREFIX"] = folder
    return kept


def seconds(command: list[str], env: dict[str, str], allowed: tuple[int, ...]) -> tuple[float, float]:
    """Processor time and wall time of a command.

    Args:
        command: what to run.
        env: its environment.
        allowed: exit codes that are no failure.

    Raises:
        SystemExit: it failed; with its message.
    """
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(command, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in allowed:
        raise SystemExit(f"{' '.join(command)}: exit code {done.returncode}\n{done.stderr.strip()}")
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, wall


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("case", nargs="?", help="case file (default: the shipped propeller)")
    parser.add_argument("--runs", type=int, default=5, help="rounds (default 5)")
    args = parsed(parser, runs=1)
    with tempfile.TemporaryDirectory() as folder:
        wrong = Path(folder) / "wrong.case.yaml"
        wrong.write_text(WRONG, encoding="utf-8")
        env = environment(folder)
        check = ["check", *([str(Path(args.case).resolve())] if args.case else [])]
        tool = [sys.executable, "-m", "cell"]
        mesh = str(ROOT / "models" / "parts" / "propeller_blade.stl")
        rows: dict[str, tuple[list[str], tuple[int, ...]]] = {
            "rbam check": ([*tool, *check], (0, 1)),
            "imports alone": ([sys.executable, "-c", IMPORTS], (0,)),
            "its own imports": ([sys.executable, "-c", OWN], (0,)),
            "rbam --help": ([*tool, "--help"], (0,)),
            "a wrong case": ([*tool, "check", str(wrong)], (2,)),
            "rbam slice": ([*tool, "slice", mesh, "--body-radius", "9.7"], (0,)),
        }
        for command, allowed in rows.values():
            seconds(command, env, allowed)  # once for the disk's cache and the bytecode
        rounds = [[seconds(command, env, allowed) for command, allowed in rows.values()] for _ in range(args.runs)]
    columns = zip(*rounds, strict=True)
    least = {name: tuple(map(min, zip(*column, strict=True))) for name, column in zip(rows, columns, strict=True)}
    for name, (cpu, wall) in least.items():
        print(f"{name:17s} {cpu:.2f} s of processor time, {wall:.2f} s (least of {args.runs})")
    whole, floor, own = (least[name][0] for name in list(rows)[:3])
    print(f"ratio             {whole / floor:.2f} to the imports alone, {whole / own:.2f} to its own")


if __name__ == "__main__":
    main()
