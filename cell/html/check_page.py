"""A check as one HTML file that needs nothing else: words, a 3D view, charts along the path, a table.

    page = html_report(check(prepare(case), 90, 180))
    write_bytes("report.html", page.encode())

The templates are in ``cell/html/web``; they and the numbers are written into the page, which loads nothing and whose
content policy forbids it to. The same result gives the same page.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..job.overhang_check import targets_over_nothing
from ..progress import phase
from ..units import METRES_PER_MM
from ..verdict.result import Result
from ..verdict.severity import severity, worst_first
from .drawn_path import BUDGET, PageBudget
from .pack import Pack
from .page import page, script_of, template
from .page_words import REASON_WORDS, VERDICTS, PageWords, what_went_wrong, worst
from .scene import scene_json
from .series import path_json

if TYPE_CHECKING:
    from ..remedy_search.search import Remedy

SCRIPTS = (  # in order of use
    *("data", "math", "scene", "meshes", "shaders", "buffers", "viewer", "controls"),
    *("charts", "sortable", "target_list", "paint", "report"),
)


@phase("writing the report")
def html_report(result: Result, remedies: Sequence[Remedy] = ()) -> str:
    """The report of a check.

    Args:
        result: the verdict.
        remedies: from ``cell.remedies``.

    Returns:
        The whole file; UTF-8.
    """
    words = PageWords(result, remedies)
    good = result.feasible
    mark = "feasible" if good else "infeasible"
    fill = {
        "heading": f"{words.title()}: {mark}",
        "title": words.title(),
        "css": template("report.css"),
        "mark": mark,
        "sentence": words.verdict(),
        "worst": words.worst(),
        "reasons": words.reasons(),
        "facts": words.facts(),
        "warnings": words.warnings(),
        "no_warnings": "" if result.warnings else "hidden",
        "help": words.help(),
        "no_help": "" if remedies else "hidden",
        "settings": words.settings(),
        "table_hidden": "hidden" if good else "",
        "x_name": "Time" if result.motion is not None else "Target",
        "data": page_data(result),
    }
    return page("report.html", script_of(SCRIPTS), fill)


def page_data(result: Result, budget: PageBudget = BUDGET) -> str:
    """The page's numbers, as ``cell.html.pack`` writes them."""
    pack = Pack()
    job, t = result.job, result.job.targets
    verdicts = ("feasible", *VERDICTS)
    few, listed = len(t) <= budget.samples, listed_targets(result, budget.listed)
    document: dict[str, Any] = {
        "schema": "rbam-html/1",
        "case": job.case.title,
        "feasible": result.feasible,
        "verdicts": verdicts,
        "verdict_words": {"feasible": "feasible", **REASON_WORDS},
        "joints": [*job.scene.chain.names, "E1", "E2"],
        "start": _start(result),
        "targets": {
            "position": pack.steps(t.position * METRES_PER_MM, 1e6 if few else 1e5),
            "normal": pack.steps(t.normal * 32767),
            "thickness": pack.steps(t.thickness_mm * METRES_PER_MM, 1e7 if few else 1e6),
            "layer": pack.steps(t.layer),
            "bead": pack.steps(t.bead),
            "sub_volume": pack.steps(t.sub_volume_index),
            "verdict": pack.put([verdicts.index(row.reason or "feasible") for row in result.rows], "u1"),
            **_over_nothing(pack, result),
            **_of_the_table(pack, result),
        },
        "sub_volumes": list(t.sub_volume),
        "infeasible": _infeasible(result, listed),
        "unlisted": result.infeasible - len(listed),
        "least": None if result.clearance is None else list(result.clearance.what),
        "scene": scene_json(pack, result),
        "path": path_json(pack, result, budget),
    }
    return pack.text(document)


def _over_nothing(pack: Pack, result: Result) -> dict[str, Any]:
    """Which feasible targets overhang, empty where none do; all others have their verdict's colour."""
    over = targets_over_nothing(result.job)
    shown = [i in over and row.reason is None for i, row in enumerate(result.rows)]
    return {"hanging": pack.put(shown, "u1")} if any(shown) else {}


def listed_targets(result: Result, most: int = BUDGET.listed) -> list[int]:
    """Infeasible targets that the table lists: all, or of many the worst of each reason."""
    bad: dict[str, list[int]] = {}
    for i in worst_first(result):
        bad.setdefault(str(result.rows[i].reason), []).append(i)
    share = most // max(len(bad), 1)
    left = most - sum(min(len(own), share) for own in bad.values())
    listed: list[int] = []
    for own in bad.values():
        more = min(left, max(len(own) - share, 0))
        listed += own[: share + more]
        left -= more
    return sorted(listed)


def _of_the_table(pack: Pack, result: Result) -> dict[str, Any]:
    """What only the table of infeasible targets shows."""
    if result.feasible:
        return {}
    return {
        "gravity": pack.steps(np.rad2deg(result.gravity), 1e3),
        "base_mm": pack.steps(result.placed.position / METRES_PER_MM, 1e2),
    }


def _infeasible(result: Result, listed: Sequence[int]) -> list[dict[str, Any]]:
    """Rows of the table."""
    return [
        {
            "target": i,
            "words": what_went_wrong(result, row),
            "proved": row.proved,
            "attempt": row.attempt is not None or row.q is not None,
            "pair": list(row.pair),
            "severity": round(severity(row), 3),
        }
        for i, row in zip(listed, map(result.rows.__getitem__, listed), strict=True)
    ]


def _start(result: Result) -> int:
    """The target the page opens at: the last, with all laid, or the worst."""
    if result.feasible:
        return len(result.rows) - 1
    return worst(result) or 0
