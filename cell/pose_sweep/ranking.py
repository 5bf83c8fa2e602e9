"""Which feasible pose is best, and a sweep's results as documents.

    document = sweep_document(case, rows)        # "rbam-sweep/1", each feasible pose with its rank
    header, lines = sweep_columns(document)      # the same as a table

Feasible poses are ranked by, in this order:

1. gravity: how far off upright they deposit at most, in steps of 5 deg;
2. clearance: the least on the way, in steps of 1 mm; all above 50 mm are alike;
3. singularity: the least margin as a multiple of its limit, in steps of a tenth;
4. joint limits: the least room any axis keeps on the way, in steps of 1 deg;
5. the time of the motion; then E1, E2 and what else was tried, so that the order is never a matter of chance.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..case.roll_text import roll_text
from ..case.sections import REASONS, Case
from .grid import FURTHER

SCHEMA = "rbam-sweep/1"
GRAVITY_STEP_DEG = 5.0
FAR_MM = 50.0  # nothing nearer than this was seen where the clearance is null
MARGIN_STEP = 0.1


def sweep_document(case: Case, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The document of schema "rbam-sweep/1".

    Args:
        case: the case.
        rows: from ``cell.sweep``.

    Returns:
        The document; ``rank`` of a pose is 1 for the best feasible one and null where infeasible, ``best`` the pose of
        rank 1 or null, ``axes`` the columns beside E1 and E2, ``roll`` that of poses without one.
    """
    feasible = sorted((i for i, row in enumerate(rows) if row["verdict"] == "feasible"), key=lambda i: _order(rows[i]))
    rank = {i: k + 1 for k, i in enumerate(feasible)}
    poses = [{**row, "rank": rank.get(i)} for i, row in enumerate(rows)]
    return {
        "schema": SCHEMA,
        "case": case.title,
        "poses": poses,
        "best": poses[feasible[0]] if feasible else None,
        "axes": [name for name in FURTHER if any(name in row for row in rows)],
        "marks": [mark.model_dump() for mark in case.sweep.marks],
        "roll": roll_text(case.roll),
    }


def _order(row: dict[str, Any]) -> tuple[Any, ...]:
    clearance, share = row.get("least_clearance_mm"), row.get("least_margin_share")
    room = row.get("least_joint_room_deg")
    return (
        round(row["gravity_max_deg"] / GRAVITY_STEP_DEG),
        -round(FAR_MM if clearance is None else min(clearance, FAR_MM)),
        -round((0.0 if share is None else share) / MARGIN_STEP),
        -round(0.0 if room is None else room),
        row.get("time_s") or 0.0,
        row["E1_deg"],
        row["E2_deg"],
        *(row.get(name, 0.0) for name in FURTHER),
    )


def sweep_columns(document: dict[str, Any]) -> tuple[list[str], list[list[Any]]]:
    """The poses as a table for a CSV.

    Args:
        document: from :func:`sweep_document`.

    Returns:
        The header and one line a pose; what does not apply is empty.
    """
    asked = ["E1_deg", "E2_deg", *document["axes"]]
    found = ["verdict", "rank", "infeasible", "looked_at", "searched"]
    least = ["least_clearance_mm", "least_margin_share", "least_joint_room_deg", "gravity_max_deg", "time_s"]
    header = [*asked, *found, *REASONS, *least]
    lines = []
    for row in document["poses"]:
        reasons = row.get("reasons") or {}
        flat = {**row, **{reason: reasons.get(reason, 0) for reason in REASONS}, "searched": int(row["searched"])}
        lines.append(["" if flat.get(name) is None else flat[name] for name in header])
    return header, lines
