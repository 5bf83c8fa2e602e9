"""The document of a check, as docs/formats.md describes it.

Use:

    report_document(result)                   # "rbam-report/1": plain lists, dicts, strings and numbers
    streamed_report(result)                   # the same, its rows made while it is written
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ik.chain import Floats
from slicing import metal_document, typed

from ..job.part_input import found_document
from ..json_text import StreamedItems
from ..motion.deposition_speed import speed_document
from ..scene.site_frames import T_flange_tcp
from ..units import MARGIN_UNITS, METRES_PER_MM
from ..verdict.result import Result
from ..verdict.table_use import table_use

if TYPE_CHECKING:
    from ..job.job import Job
    from ..remedy_search.search import Remedy
    from ..verdict.all_reasons import Excluded


def report_document(
    result: Result,
    remedies: Sequence[Remedy] = (),
    all_reasons: Mapping[int, list[Excluded]] | None = None,
) -> dict[str, Any]:
    """The document of schema "rbam-report/1": see docs/formats.md.

    Args:
        result: the verdict.
        remedies: from ``cell.remedies``.
        all_reasons: by target what excludes its candidates, from ``cell.all_reasons``; None leaves the key out.

    Returns:
        The document.
    """
    document = streamed_report(result, remedies, all_reasons)
    return {**document, "rows": list(document["rows"].make())}


def streamed_report(
    result: Result,
    remedies: Sequence[Remedy] = (),
    all_reasons: Mapping[int, list[Excluded]] | None = None,
) -> dict[str, Any]:
    """The same with its rows as `cell.json_text.StreamedItems`: a row is made when it is written."""
    job, t = result.job, result.job.targets
    T = T_flange_tcp(job.scene)
    return {
        "schema": "rbam-report/1",
        "case": job.case.title,
        "verdict": "feasible" if result.feasible else "infeasible",
        "table": table_document(result),
        "tcp_in_flange": {"xyz_mm": _list(T[:3, 3] / METRES_PER_MM, 4), "z_axis": _list(T[:3, 2], 9)},
        "targets": len(result.rows),
        "infeasible": result.infeasible,
        "looked_at": result.looked_at,
        "not_looked_at": result.not_looked_at,
        "reasons": result.reasons,
        "solver": job.solver.name,
        "roll": roll_text_of(result),
        "least_clearance": least_document(result, "clearance"),
        "least_singularity_margin": least_document(result, "singularity"),
        "smallest_singular_value": None if result.sigma is None else round(result.sigma, 6),
        "gravity_deg": {
            "min": round(float(np.rad2deg(result.gravity.min())), 3),
            "max": round(float(np.rad2deg(result.gravity.max())), 3),
        },
        "motion": None
        if result.motion is None
        else {
            "time_s": round(float(result.motion.t_s[-1]), 3),
            "arc_on_s": round(result.motion.arc_time, 3),
            "samples": len(result.motion.t_s),
            "travel_s": round(result.motion.travel_time, 3),
            "dwell_s": round(result.motion.dwell_time, 3),
            "speed": None if result.motion.held_speed is None else speed_document(result.motion.held_speed, t.bead),
            "home_s": None if result.motion.home_s is None else round(result.motion.home_s, 3),
        },
        "table_use": None if (use := table_use(result)) is None else use.document(),
        "metal": metal_of(job) if job.beads else None,
        "warnings": [str(line) for line in result.warnings],
        "typed_warnings": [typed(line).document() for line in result.warnings],
        **found_document(job.T_part_input, job.evidence),
        "rows": StreamedItems(lambda: _rows(result, all_reasons)),
        "help": [remedy.document() for remedy in remedies],
    }


def _rows(result: Result, all_reasons: Mapping[int, list[Excluded]] | None) -> Iterator[dict[str, Any]]:
    """One record a target."""
    job, t = result.job, result.job.targets
    number = np.arange(len(t)) if job.order is None else job.order.target
    bead = np.arange(len(t.closed)) if job.order is None else job.order.bead
    tables = np.rad2deg(result.tables)
    for i, row in enumerate(result.rows):
        record = {
            "index": i,
            "sub_volume": t.sub_volume[t.sub_volume_index[i]],
            "layer": int(t.layer[i]),
            "base_xyz_mm": _list(result.placed.position[i] / METRES_PER_MM, 4),
            "base_normal": _list(result.placed.normal[i], 8),
            "verdict": row.verdict,
            "looked_at": row.looked_at,
            "reason": row.reason,
            "detail": row.detail,
            "proved": row.proved,
            "q_deg": None if row.q is None or row.reason else _list(np.rad2deg(row.q), 6),
            "attempt_deg": None if row.attempt is None else _list(np.rad2deg(row.attempt), 6),
            "gravity_deg": round(float(np.rad2deg(result.gravity[i])), 3),
            "bead": int(t.bead[i]),
            "E1_deg": round(float(tables[i, 0]), 6) + 0.0,
            "E2_deg": round(float(tables[i, 1]), 6) + 0.0,
            "file_target": int(number[i]),
            "file_bead": int(bead[t.bead[i]]),
        }
        if all_reasons is not None and i in all_reasons:
            record["all_reasons"] = [one.document() for one in all_reasons[i]]
        yield record


def table_document(result: Result) -> dict[str, Any]:
    """Table angles as documents write them."""
    return {
        "E1_deg": float(result.asked[0]),
        "E2_deg": float(result.asked[1]),
        "mode": result.mode,
        "poses": [pose.document() for pose in result.poses],
    }


def _list(values: Floats, digits: int) -> list[float]:
    return [round(float(v), digits) + 0.0 for v in values]


def roll_text_of(result: Result) -> str:
    """The roll window of a result in words."""
    window = result.job.window
    if window.is_full:
        return "free"
    low, high = np.rad2deg([window.low, window.high])
    return f"fixed:{low:g}" if window.is_fixed else f"range:{low:g}:{high:g}"


def least_document(result: Result, what: str) -> dict[str, Any] | None:
    """The least clearance or singularity margin as the document has it."""
    if what == "clearance":
        c = result.clearance
        if c is None:
            return None
        return {"distance_mm": round(c.value / METRES_PER_MM, 3), "target": c.target, "pair": list(c.what)}
    s = result.singularity
    if s is None:
        return None
    kind = s.what[0]
    unit, factor = MARGIN_UNITS[kind]
    return {"kind": kind, "margin": round(s.value * factor, 3), "unit": unit, "target": s.target}


def metal_of(job: Job) -> dict[str, float]:
    """The metal of all beads of a job, see `slicing.beads.deposition.metal_document`."""
    process = job.case.process
    metal = [m for one in job.beads for m in one.metal]
    return metal_document(metal, process.density_g_cm3, process.wire_diameter_mm)
