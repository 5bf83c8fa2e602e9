"""The report on a motion from outside: its document, and lines for the terminal.

Use:

    document = motion_document(result, "blade.csv")   # "rbam-motion-report/1"
    for line in motion_lines(result, "blade.csv"): ...
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from slicing import typed

from ..motion.deposition_speed import speed_document
from ..units import MARGIN_UNITS, METRES_PER_MM
from ..verdict.failure_words import failure_in_words
from ..verification.bead_order import REASONS, Finding
from ..verification.motion_check import MotionResult
from .facts import facts_grid, headline

if TYPE_CHECKING:
    from rich.console import RenderableType

SHOWN = 8  # findings on the terminal


def motion_document(result: MotionResult, path: str) -> dict[str, Any]:
    """The document of schema "rbam-motion-report/1".

    Args:
        result: what was found.
        path: the motion's file.

    Returns:
        The document; rows count from 1, the header not counted.
    """
    motion, t = result.read.motion, result.job.targets
    count = Counter(f.reason for f in result.findings)
    at = {int(row): float(when) for row, when in zip(result.read.row, motion.t_s, strict=True)}
    kinds = zip(("speed", "acceleration"), result.use, strict=True)
    return {
        "schema": "rbam-motion-report/1",
        "case": result.job.case.title,
        "motion": path,
        "verdict": "feasible" if result.feasible else "infeasible",
        "rows": len(motion.t_s),
        "samples": result.samples,
        "targets": len(t),
        "welded": result.welded,
        "reasons": {reason: count[reason] for reason in REASONS},
        "time_s": round(float(motion.t_s[-1] - motion.t_s[0]), 3),
        "arc_on_s": round(motion.arc_time, 3),
        "travel_s": round(motion.travel_time, 3),
        "dwell_s": round(motion.dwell_time, 3),
        "least_clearance": _clearance(result),
        "least_singularity_margin": _margin(result),
        "smallest_singular_value": None if result.sigma is None else round(result.sigma, 6),
        "off_bead": _off(result, "distance_mm", result.bead_distance[0] / METRES_PER_MM, result.bead_distance[1]),
        "off_wire": _off(result, "angle_deg", float(np.rad2deg(result.wire_angle[0])), result.wire_angle[1]),
        "largest_share_of_limit": {
            kind: {name: round(float(v), 4) for name, v in zip(result.job.drives.names, use, strict=True)}
            for kind, use in kinds
        },
        "speed": speed_document(result.held_speed, t.bead),
        "repaired": list(result.read.repaired),
        "warnings": [str(line) for line in result.warnings],
        "typed_warnings": [typed(line).document() for line in result.warnings],
        "findings": [
            {"reason": f.reason, "row": f.row, "to_row": f.to_row, "t_s": round(at[f.row], 6), "detail": f.detail}
            for f in result.findings
        ],
    }


def _off(result: MotionResult, name: str, value: float, row: int) -> dict[str, Any] | None:
    return {name: round(value, 5), "row": row} if len(result.job.targets) else None


def _clearance(result: MotionResult) -> dict[str, Any] | None:
    if result.clearance is None:
        return None
    distance, row, pair = result.clearance
    return {"distance_mm": round(distance / METRES_PER_MM, 3), "row": row, "pair": list(pair)}


def _margin(result: MotionResult) -> dict[str, Any] | None:
    if result.singularity is None:
        return None
    value, row, kind = result.singularity
    unit, factor = MARGIN_UNITS[kind]
    return {"kind": kind, "margin": round(value * factor, 3), "unit": unit, "row": row}


def finding_in_words(f: Finding) -> str:
    """What a finding is about in a few words."""
    return failure_in_words(f.failure)


def motion_lines(result: MotionResult, path: str) -> Iterator[RenderableType]:
    """The terminal report.

    Args:
        result: what was found.
        path: the motion's file.

    Yields:
        rich renderables, one a block.
    """
    from rich.table import Table

    yield headline(result.job.case.title, path, feasible=result.feasible)
    yield facts_grid(motion_facts(result, motion_document(result, path)))
    if result.feasible:
        return
    table = Table(box=None, pad_edge=False, header_style="dim")
    table.add_column("rows", justify="right")
    table.add_column("reason")
    table.add_column("what is wrong")
    for f in result.findings[:SHOWN]:
        rows = str(f.row) if f.row == f.to_row else f"{f.row} .. {f.to_row}"
        table.add_row(rows, f.reason, finding_in_words(f))
    if len(result.findings) > SHOWN:
        table.caption = f"and {len(result.findings) - SHOWN} more; all of them with --json"
        table.caption_justify = "left"
    yield table


def motion_facts(result: MotionResult, d: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """The report on a motion, as names and texts.

    Args:
        result: what was found.
        d: its document.
    """
    if d["targets"]:
        yield "welded", f"{d['welded']} of {d['targets']} targets"
    counts = ", ".join(f"{reason} {k}" for reason, k in d["reasons"].items() if k)
    if counts:
        yield "faults", counts
    c, s = d["least_clearance"], d["least_singularity_margin"]
    if c:
        limit = result.job.case.checks.clearance_mm
        yield "least clearance", f"{c['distance_mm']:.1f} mm, {' - '.join(c['pair'])}, row {c['row']} (limit {limit:g})"
    if s:
        unit = "" if s["unit"] == "1" else f" {s['unit']}"
        yield "singularity", f"{s['kind']} at {s['margin']:g}{unit}, row {s['row']}"
    off, wire_angle = d["off_bead"], d["off_wire"]
    if off and wire_angle:
        yield "on the bead", f"within {off['distance_mm']:.3f} mm and {wire_angle['angle_deg']:.3f} deg"
    use = d["largest_share_of_limit"]
    most = {kind: max(shares.items(), key=lambda item: item[1]) for kind, shares in use.items()}
    yield "drives", ", ".join(f"{axis} at {100 * v:.0f} % of its {kind}" for kind, (axis, v) in most.items())
    if d["speed"]["least_share"] is not None:
        share, start = d["speed"]["least_share"], d["speed"]["from_target"]
        yield "speed", f"kept to {100 * share:.0f} % or more over every 5 mm, least from target {start}"
    dwell = f", {d['dwell_s']:.0f} s waiting" if d["dwell_s"] else ""
    yield (
        "motion",
        f"{d['time_s']:.0f} s, {d['arc_on_s']:.0f} s with the arc on, {d['travel_s']:.0f} s travelling{dwell}; "
        f"{d['rows']} rows, {d['samples']} samples checked",
    )
    for line in (*d["repaired"], *d["warnings"]):
        yield "warning", line
