"""Which infeasible target is worst.

Use:

    for i in worst_first(result): ...         # the gravest reason first, then the greatest excess
"""

from __future__ import annotations

import numpy as np

from .check import Result, TargetVerdict

GRAVEST_FIRST = ("unreachable", "joint_limit", "collision", "singular", "no_path", "speed", "gravity", "overhang")


def worst_first(result: Result) -> list[int]:
    """Infeasible targets, the gravest first."""
    bad = [i for i, row in enumerate(result.rows) if row.reason is not None]
    return sorted(bad, key=lambda i: -severity(result.rows[i]))


def severity(row: TargetVerdict) -> float:
    """How bad an infeasible target is, so that what no lower margin mends comes first; whole reasons are 1e6 apart."""
    d = row.detail
    measure = d.get("beyond_reach_mm") or d.get("inside_reach_mm") or d.get("over_deg") or 0.0
    if "distance_mm" in d:
        measure = d.get("required_mm", 0.0) - d["distance_mm"]
    elif "margin" in d:
        measure = d.get("limit", 0.0) - d["margin"]
    elif "share" in d:
        measure = d.get("limit", 0.0) - d["share"]
    elif "angle_deg" in d:
        measure = d["angle_deg"] - d.get("limit_deg", 0.0)
    rank = len(GRAVEST_FIRST) - GRAVEST_FIRST.index(row.reason) if row.reason in GRAVEST_FIRST else 0
    return rank * 1e6 + float(np.clip(measure, -4e5, 4e5))
