"""A sweep as one HTML file that needs nothing else: the map to click on, the pose chosen, and all poses in a table.

    page = html_sweep(case, document)                # "rbam-sweep/1"
    write_bytes("map.html", page.encode())

The same sweep gives the same page.
"""

from __future__ import annotations

import shlex
from html import escape
from typing import Any

from ..case.roll_text import roll_text
from ..case.sections import Case
from ..pose_sweep.grid import Pose
from ..pose_sweep.variants import variant_words, variants
from ..shipped import DEFAULT_CASE
from .pack import Pack
from .page import page, script_of, template
from .page_words import REASON_WORDS

SCRIPTS = ("data", "sweep_map", "sortable", "pose_list", "sweep")  # in order of use


def html_sweep(case: Case, document: dict[str, Any]) -> str:
    """The page of a sweep.

    Args:
        case: what was swept.
        document: from ``cell.sweep_document``.

    Returns:
        The whole file; UTF-8.
    """
    good = sum(row["verdict"] == "feasible" for row in document["poses"])
    count = f"{good} of {len(document['poses'])} feasible"
    fill = {
        "heading": escape(f"{document['case']}: {count}"),
        "title": escape(document["case"]),
        "css": template("report.css") + template("sweep.css"),
        "mark": "feasible" if good else "infeasible",
        "count": count,
        "sentence": escape(_sentence(document, good)),
        "data": Pack().text(_data(case, document)),
    }
    return page("sweep.html", script_of(SCRIPTS), fill)


def _sentence(document: dict[str, Any], good: int) -> str:
    best, count = document["best"], len(document["poses"])
    cells = len(variants(document))
    tried = f"{count} table poses were tried" + (f" in {cells} cells" if cells > 1 else "")
    if best is None:
        return f"{tried}; the arm can weld the part at none of them."
    where = f"E1 = {best['E1_deg']:g}°, E2 = {best['E2_deg']:g}°"
    words = variant_words(Pose.of(best))
    clearance = best["least_clearance_mm"]
    room = "more than 50 mm" if clearance is None else f"{clearance:.1f} mm"
    return (
        f"{tried}; at {good} of them the arm can weld the whole part in one motion, which was checked all along. "
        f"The best is {where}{f' ({words})' if words else ''}: it deposits at most {best['gravity_max_deg']:.0f}° off "
        f"upright and keeps {room} of clearance."
    )


def _data(case: Case, document: dict[str, Any]) -> dict[str, Any]:
    shipped = case.path == DEFAULT_CASE
    return {
        "schema": "rbam-sweep-html/1",
        "poses": document["poses"],
        "axes": document["axes"],
        "marks": document["marks"],
        "reasons": REASON_WORDS,
        "command": "rbam check" if shipped else f"rbam check {shlex.quote(str(case.path))}",
        "roll": roll_text(case.roll),
        "extends": str(case.path) if shipped else case.path.name,
        "rotation_deg": list(case.positioner.rotation_deg),
        "part_mm": list(case.part.position_mm),
        "support": case.support is not None,
    }
