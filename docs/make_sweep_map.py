"""Make the map of docs/sweep_map.md, and measure poses in and just outside its islands.

    python docs/make_sweep_map.py --log map.jsonl     # some ten minutes on one core; goes on from the log

Writes docs/pictures/sweep_map_propeller.png and prints the rows of the page's table.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from cell.check import Result, check
from cell.config import DEFAULT_CASE, load_case
from cell.files import write_bytes
from cell.job import Job, prepare
from cell.report import in_words
from cell.sweep import sweep
from cell.sweep_grid import grid
from cell.sweep_picture import sweep_picture
from cell.sweep_rank import sweep_document

E1, E2 = "-135:135:7.5", "-180:135:7.5"
PICTURE = Path(__file__).resolve().parent / "pictures" / "sweep_map_propeller.png"
ISLANDS = {  # inside first, then over its edges
    "upper left": ((105, -180), (105, -150), (75, -180), (120, -180)),
    "lower right": ((-97.5, 75), (-97.5, 60), (-75, 75), (-97.5, 90)),
}


def words(result: Result) -> str:
    """A pose's verdict with the measure of its gravest target, or of its tightest place."""
    if result.motion is not None:
        chain = result.job.scene.chain
        room = (result.motion.q - chain.lower).min(axis=0), (chain.upper - result.motion.q).min(axis=0)
        least = [(min(a, b), name) for a, b, name in zip(*room, chain.names, strict=True)]
        tightest, name = min(least)
        return f"feasible; {name} keeps {tightest * 57.29577951308232:.1f} deg"
    reason = max(result.reasons, key=lambda r: result.reasons[r])
    bad = [(i, row) for i, row in enumerate(result.rows) if row.reason == reason]
    key = {"joint_limit": "over_deg", "unreachable": "beyond_reach_mm"}.get(reason)
    if key:
        i, row = max(bad, key=lambda found: found[1].detail.get(key, 0.0))
    elif reason == "collision":
        i, row = min(bad, key=lambda found: found[1].detail["distance_mm"])
    else:
        i, row = bad[0]
    return f"{reason.replace('_', ' ')} {result.reasons[reason]} of {len(result.rows)}; target {i}: {in_words(row)}"


def table(job: Job) -> None:
    """Print what is measured in and around the islands."""
    print("| island | E1 | E2 | what `rbam check` says |\n| --- | --: | --: | --- |")
    for name, poses in ISLANDS.items():
        for tilt, turn in poses:
            print(f"| {name} | {tilt:g} | {turn:g} | {words(check(job, tilt, turn))} |", flush=True)


def main() -> None:
    """Sweep, draw, measure."""
    parser = argparse.ArgumentParser(description="Make the map of docs/sweep_map.md.")
    parser.add_argument("--log", help="keep finished poses here, and go on from it")
    parser.add_argument("--workers", type=int)
    args = parser.parse_args()
    case = load_case(DEFAULT_CASE)
    rows = sweep(case, grid(case, E1, E2), workers=args.workers, log=args.log, progress=sys.stderr)
    write_bytes(PICTURE, sweep_picture(sweep_document(case, rows)))
    table(prepare(case))


if __name__ == "__main__":
    main()
