"""Make the map of docs/sweep_map.md, and measure poses in and just outside two of its areas.

    python docs/make_sweep_map.py --log map.jsonl     # some minutes; goes on from the log

Writes docs/pictures/sweep_map_propeller.png and the measured table of the page.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from cell import DEFAULT_CASE, Job, Result, check, grid, load_case, prepare, sweep, sweep_document, sweep_picture
from cell.atomic_files import write_bytes
from cell.cli.progress_bar import Bars
from cell.verdict.words import in_words

START, END = "<!-- measured -->", "<!-- end -->"
E1, E2 = "-135:135:7.5", "-180:135:7.5"
PAGE = Path(__file__).with_name("sweep_map.md")
PICTURE = PAGE.parent / "pictures" / "sweep_map_propeller.png"
AREAS = {  # inside first, then over its edges
    "of pose A": {"inside": (105, -180), "right of it": (105, -150), "above it": (120, -180)},
    "at -97.5 / 75": {"inside": (-97.5, 75), "left of it": (-97.5, 60), "right of it": (-97.5, 90)},
}


def words(result: Result) -> str:
    """A pose's verdict with the measure of its gravest target, or of its tightest place."""
    if result.motion is not None:
        chain, q = result.job.scene.chain, result.motion.q
        room = np.rad2deg(np.minimum(q - chain.lower, chain.upper - q).min(axis=0))
        return f"feasible; {chain.names[int(room.argmin())]} keeps {room.min():.1f} deg to its limit"
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


def table(job: Job) -> str:
    """What is measured where two areas of feasible poses end."""
    lines = ["| area | | E1 | E2 | what `rbam check` says |", "| --- | --- | --: | --: | --- |"]
    for name, poses in AREAS.items():
        for where, (tilt, turn) in poses.items():
            lines.append(f"| {name} | {where} | {tilt:g} | {turn:g} | {words(check(job, tilt, turn))} |")
    return "\n".join(lines)


def main() -> None:
    """Sweep, draw, measure."""
    parser = argparse.ArgumentParser(description="Make the map of docs/sweep_map.md.")
    parser.add_argument("--log", help="keep finished poses here, and go on from it")
    parser.add_argument("--jobs", type=int)
    args = parser.parse_args()
    case = load_case(DEFAULT_CASE)
    rows = sweep(case, grid(case, E1, E2), processes=args.jobs, log=args.log, progress=Bars(sys.stderr))
    write_bytes(PICTURE, sweep_picture(sweep_document(case, rows)))
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(START)
    text = f"{before}{START}\n{table(prepare(case))}\n{END}{rest.partition(END)[2]}"
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
