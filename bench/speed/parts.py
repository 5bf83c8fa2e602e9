"""Real parts through ``rbam check``, of any size: what each stage costs a target, memory, and how large the files are.

    python -m bench.speed.parts --parts pad --targets 1000 10000 --roll free --fill zigzag
    python -m bench.speed.parts --parts pad branch --twins none share layer all far split  # infeasible ones as well
    python -m bench.speed.parts --targets 50000 --no-help --figures bench/figures/parts.json

Each part (``bench/speed/real_parts.py``) is a process of its own, so that memory is its own and imports are counted.
Time is processor time of all threads, in ms a target; wall time stands beside the total. Stages: imports; slicing and
sampling; the scene; planning (beads, travels, home); checks after planning (refined, corners, time law); the least
clearance; what would help; the page; the JSON document. Functions that a stage is timed by are in STAGES; what none of
them takes is "other".
"""

from __future__ import annotations

import time

BEGUN = time.process_time(), time.perf_counter()  # before the imports that it counts

import argparse  # noqa: E402
import importlib  # noqa: E402
import json  # noqa: E402
import resource  # noqa: E402
import subprocess  # noqa: E402
import sys  # noqa: E402
import tempfile  # noqa: E402
from collections.abc import Callable  # noqa: E402
from pathlib import Path  # noqa: E402
from typing import Any  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]


NO_TWIN = "none"
COLUMNS = ("imports", "slicing", "scene", "planning", "after", "clearance", "other", "help", "page", "json")
# which functions belong to which stage: module, name, stage. Their callers look them up by name in that module
STAGES = (
    ("cell.job.job", "_laid_here", "slicing"),
    ("cell.job.job", "toolpath_shape", "slicing"),
    ("cell.job.job", "compose", "scene"),
    ("cell.verdict.check", "plan_in_chunks", "planning"),
    ("cell.verdict.check", "with_lockouts", "planning"),
    ("cell.verdict.check", "with_home", "planning"),
    ("cell.part_chunks.chunk_run", "densified", "after"),
    ("cell.part_chunks.chunk_run", "corners", "after"),
    ("cell.part_chunks.chunk_run", "timed", "after"),
    ("cell.part_chunks.chunked_run", "assemble", "after"),
    ("cell.part_chunks.chunked_run", "least_clearance", "clearance"),
)


class Clock:
    """Processor time by stage; a stage within another is taken off it."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._within: list[float] = []

    def timed(self, stage: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """A function whose time is put down to a stage."""

        def call(*args: Any, **kwargs: Any) -> Any:
            begun = time.process_time()
            self._within.append(0.0)
            try:
                return function(*args, **kwargs)
            finally:
                took = time.process_time() - begun
                self.seconds[stage] = self.seconds.get(stage, 0.0) + took - self._within.pop()
                if self._within:
                    self._within[-1] += took

        return call

    def hook(self) -> list[str]:
        """Time the functions of STAGES; the names of those that are not there."""
        absent = []
        for module, name, stage in STAGES:
            owner = importlib.import_module(module)
            if hasattr(owner, name):
                setattr(owner, name, self.timed(stage, getattr(owner, name)))
            else:
                absent.append(f"{module}.{name}")
        return absent


def run(part: str, targets: int, fill: str, roll: str, twin: str, help_too: bool) -> dict[str, Any]:
    """One part through all stages, in this process."""
    import cell.cli.check_command as check_command
    import cell.html.check_page
    import cell.remedy_search.search
    import cell.report.check_document
    import cell.verdict.by_table_mode as by_table_mode

    clock = Clock()
    absent = clock.hook()
    clock.seconds["imports"] = time.process_time() - BEGUN[0]
    from .real_parts import job_of  # the builders of the parts are no stage of a check

    begun = time.process_time()
    job = job_of(part, targets, fill, roll, twin == NO_TWIN, "share" if twin == NO_TWIN else twin)
    made = time.process_time() - begun
    begun, wall = time.process_time(), time.perf_counter()
    result = by_table_mode.check(job)
    checked, wall = time.process_time() - begun, time.perf_counter() - wall
    clock.seconds["other"] = made + checked - sum(v for k, v in clock.seconds.items() if k != "imports")
    remedies = []
    if help_too and not result.feasible:
        most = check_command.HELP_SECONDS + check_command.HELP_CHECKS * result.seconds
        remedies = clock.timed("help", lambda: list(cell.remedy_search.search.remedies(result, None, most)))()
    with tempfile.TemporaryDirectory() as folder:
        page, document = Path(folder) / "page.html", Path(folder) / "report.json"
        clock.timed("page", lambda: _put_page(page, result, remedies))()
        clock.timed("json", lambda: _put_json(document, result, remedies))()
        sizes = page.stat().st_size, document.stat().st_size
    return {
        "targets": len(job.targets),
        "feasible": result.feasible,
        "reasons": {k: v for k, v in result.reasons.items() if v},
        "remedies": len(remedies),
        "checked_s": checked,
        "wall_s": wall,
        "seconds": clock.seconds,
        "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "page_mb": sizes[0] / 1e6,
        "json_mb": sizes[1] / 1e6,
        "absent": absent,
    }


def _put_page(path: Path, result: Any, remedies: list[Any]) -> None:
    from cell.atomic_files import write_text
    from cell.html.check_page import html_report

    write_text(path, html_report(result, remedies))


def _put_json(path: Path, result: Any, remedies: list[Any]) -> None:
    from cell.cli.console import put_json
    from cell.report.check_document import streamed_report

    put_json(str(path), streamed_report(result, remedies))


def row_of(name: list[str], found: dict[str, Any]) -> list[Any]:
    """A row of the table."""
    n, seconds = found["targets"], found["seconds"]
    lost = ", ".join(f"{v:,} {k}" for k, v in found["reasons"].items())
    stages = [round(1e3 * seconds.get(stage, 0.0) / n, 3) for stage in COLUMNS]
    check, wall = (round(1e3 * found[key] / n, 3) for key in ("checked_s", "wall_s"))
    files = [round(found[key], 1) for key in ("memory_mb", "page_mb", "json_mb")]
    return [*name, n, "feasible" if found["feasible"] else lost, check, wall, *stages, *files]


HEAD = ["part", "fill", "roll", "twin", "targets", "verdict", "check", "wall", *COLUMNS, "memory, MB", "page, MB"]
HEAD += ["json, MB"]


def measured(asked: tuple[str, int, str, str, str], *, help_too: bool, longest_s: float) -> Any:
    """The same in a process of its own; None where it takes too long."""
    ask = json.dumps([*asked, help_too])
    command = [sys.executable, "-m", "bench.speed.parts", "--one", ask]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=longest_s, cwd=ROOT)
    except subprocess.TimeoutExpired:
        return None
    if done.returncode:
        raise SystemExit(f"{ask}: exit code {done.returncode}\n{done.stderr.strip()}")
    return json.loads(done.stdout.splitlines()[-1])


def arguments() -> argparse.Namespace:
    from ..bench_arguments import parsed

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    several: dict[str, Any] = {"nargs": "+"}
    parser.add_argument("--parts", **several, default=["pad", "flange", "blade", "branch"])
    parser.add_argument("--targets", **several, type=int, default=[1000, 10_000, 50_000])
    parser.add_argument("--fill", **several, default=["zigzag", "contour"])
    parser.add_argument("--roll", **several, default=["free", "held"])
    parser.add_argument("--twins", **several, default=[NO_TWIN, "share"], help="none, share, layer, all, far, split")
    parser.add_argument("--no-help", action="store_true", help="without the search for what would help")
    parser.add_argument("--longest", type=float, default=3600.0, help="seconds that one part may take (default 3600)")
    parser.add_argument("--figures", type=Path, help="write the table there as JSON (bench/figures.py shows it)")
    parser.add_argument("--one", help=argparse.SUPPRESS)
    tiny = {"parts": ["pad"], "targets": [300], "fill": ["contour"], "roll": ["free"], "twins": [NO_TWIN, "far"]}
    return parsed(parser, **tiny)


def main() -> None:
    args = arguments()
    if args.one:
        print(json.dumps(run(*json.loads(args.one))))
        return
    from ..figures import table_of

    rows, absent = [], set()
    for part in args.parts:
        for fill in args.fill:
            for roll in args.roll:
                for targets in args.targets:
                    for twin in args.twins:
                        name = [part, fill, roll, twin]
                        asked = (part, targets, fill, roll, twin)
                        found = measured(asked, help_too=not args.no_help, longest_s=args.longest)
                        if found is None:
                            print(f"{' '.join(name)}, {targets:,}: more than {args.longest:g} s", flush=True)
                            continue
                        rows.append(row_of(name, found))
                        absent.update(found["absent"])
                        print(rows[-1], file=sys.stderr, flush=True)
    print("ms a target of processor time (check: all stages from planning to other; wall: of the check)")
    print("\n".join(table_of(HEAD, rows)))
    for name in sorted(absent):
        print(f"{name}: not there; its time is under other")
    if args.figures:
        put_figures(args.figures, rows)


def put_figures(path: Path, rows: list[list[Any]]) -> None:
    """The table into a document of figures, beside what else it holds."""
    from ..figures import text_of

    document = json.loads(path.read_text(encoding="utf-8"))
    document["date"] = time.strftime("%Y-%m-%d")
    document["tables"] = [{"caption": "ms a target of processor time", "columns": HEAD, "rows": rows}]
    path.write_text(text_of(document), encoding="utf-8")


if __name__ == "__main__":
    main()
