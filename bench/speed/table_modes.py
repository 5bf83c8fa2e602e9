"""Every part with its table fixed, indexed and moving along: how upright, how long, and what the axes are asked for.

    python -m bench.speed.table_modes                       # the shipped parts in all three modes, as rows of a table
    python -m bench.speed.table_modes --part boiler --mode fixed coordinated --json rows.jsonl

A fixed table stands at the case's pose, or at the best one found where the case has none; poses of an indexed one are
searched. All are asked to be within 10 degrees of upright, which the moving one alone has to keep.
Angles off up are along the beads, between the targets as well, weighted by length. ``--json`` keeps the rows, one a
line, and takes those that are there already for done.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cell import Case, load_case, prepare, with_changes
from cell.case.table_section import Table
from cell.verdict.by_table_mode import check
from cell.verdict.table_use import table_use

from ..bench_arguments import parsed

ROOT = Path(__file__).resolve().parents[2]

CASES = {
    "propeller, one blade": "propeller_free",
    "propeller, five blades": "propeller_indexed",
    "support": "support",
    "boiler": "boiler",
    "valve, branch": "valve",
    "valve, whole": "valve_indexed",
}
MODES = ("fixed", "indexed", "coordinated")
HEAD = ("part", "table", "verdict", "off up, max / mean", "within 10 deg", "cycle time", "slowest axis")
HEAD = (*HEAD, "E1 travel, reversals", "E2 travel, reversals")


def in_mode(case: Case, mode: str) -> Case:
    """A case with its table in another mode; the best fixed pose where the case itself has none."""
    if case.table.mode == mode:
        return case
    return with_changes(case, table=Table(mode="best" if mode == "fixed" else mode))


def measured(case: Case, targets: int | None) -> dict[str, Any]:
    """What a check of a case says."""
    begun = time.process_time()
    job = prepare(case)
    if targets is not None:
        last = int(job.targets.bead[min(targets, len(job.targets)) - 1])
        t, n = job.targets, int(np.searchsorted(job.targets.bead, last + 1))
        columns = ("sub_volume_index", "layer", "bead", "position", "normal", "tangent", "thickness_mm", "speed_mm_s")
        job = replace(
            job,
            targets=replace(t, closed=t.closed[: last + 1], **{name: getattr(t, name)[:n] for name in columns}),
            beads=(),
        )
    result = check(job)
    row: dict[str, Any] = {
        "targets": len(result.rows),
        "infeasible": {reason: count for reason, count in result.reasons.items() if count},
        "targets_off_up_max_deg": round(float(np.rad2deg(result.gravity.max())), 1),
        "seconds": round(time.process_time() - begun, 1),
    }
    use = table_use(result)
    if use is None or result.motion is None:
        return row
    return {
        **row,
        "cycle_s": round(float(result.motion.t_s[-1]), 1),
        "max_deg": round(use.max_deg, 1),
        "mean_deg": round(use.mean_deg, 1),
        "within_10_deg": round(use.share_within, 3),
        "slowest_axis": [use.slowest_axis, round(use.slowest_share, 2)],
        "travel_deg": [round(v) for v in use.travel_deg],
        "reversals": list(use.reversals),
    }


def cells(row: dict[str, Any]) -> list[str]:
    """A row of the table in words."""
    start = [f"{row['part']} ({row['targets']} targets)", row["mode"]]
    if "cycle_s" not in row:
        why = ", ".join(f"{count} {reason}" for reason, count in row["infeasible"].items())
        return [*start, f"infeasible ({why})", f"{row['targets_off_up_max_deg']:g} at targets", *["-"] * 5]
    axis, share = row["slowest_axis"]
    travel = [f"{deg} deg, {count}" for deg, count in zip(row["travel_deg"], row["reversals"], strict=True)]
    off = f"{row['max_deg']:g} / {row['mean_deg']:g} deg"
    return [
        *start,
        "feasible",
        off,
        f"{row['within_10_deg']:.0%}",
        f"{row['cycle_s']:.0f} s",
        f"{axis}, {share:.0%}",
        *travel,
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", nargs="*", default=list(CASES), choices=list(CASES), help="default: all")
    parser.add_argument("--mode", nargs="*", default=list(MODES), choices=MODES, help="default: all")
    parser.add_argument("--targets", type=int, help="the first alone (default: all)")
    parser.add_argument("--json", help="keep the rows here, one a line")
    args = parsed(parser, part=["boiler"], mode=["fixed", "coordinated"], targets=9)
    kept = Path(args.json) if args.json else None
    rows = [json.loads(line) for line in kept.read_text().splitlines()] if kept and kept.exists() else []
    done = {(row["part"], row["mode"]) for row in rows}
    for part in args.part:
        case = load_case(ROOT / "models" / "cases" / f"{CASES[part]}.case.yaml")
        for mode in args.mode:
            if (part, mode) in done:
                continue
            rows.append({"part": part, "mode": mode, **measured(in_mode(case, mode), args.targets)})
            if kept:
                with kept.open("a") as out:
                    out.write(json.dumps(rows[-1]) + "\n")
    print("| " + " | ".join(HEAD) + " |")
    print("| --- | --- | --- | --: | --: | --: | --- | --- | --- |")
    for row in sorted(rows, key=lambda r: (list(CASES).index(r["part"]), MODES.index(r["mode"]))):
        print("| " + " | ".join(cells(row)) + " |")


if __name__ == "__main__":
    main()
