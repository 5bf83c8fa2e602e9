"""Which infeasible target is worst.

Use:

    for i in worst_first(result): ...         # the gravest reason first, then the greatest excess
"""

from __future__ import annotations

import numpy as np

from ..failure import Kind
from .result import Result, TargetVerdict

GRAVEST_FIRST = ("unreachable", "joint_limit", "collision", "singular", "no_path", "speed", "gravity", "overhang")


def worst_first(result: Result) -> list[int]:
    """Infeasible targets, the gravest first."""
    bad = [i for i, row in enumerate(result.rows) if row.failure is not None]
    return sorted(bad, key=lambda i: -severity(result.rows[i]))


def severity(row: TargetVerdict) -> float:
    """How bad an infeasible target is, so that what no lower margin mends comes first; whole reasons are 1e6 apart."""
    rank = len(GRAVEST_FIRST) - GRAVEST_FIRST.index(row.reason) if row.reason in GRAVEST_FIRST else 0
    return rank * 1e6 + float(np.clip(_excess(row), -4e5, 4e5))


def _excess(row: TargetVerdict) -> float:
    """By how much a measure is beyond its limit; 0 where that says nothing about how bad it is."""
    if row.failure is None or row.failure.root.measure is None:
        return 0.0
    root = row.failure.root
    measure, limit = root.measure or 0.0, root.limit or 0.0
    if root.kind in (Kind.UNREACHABLE, Kind.JOINT_LIMIT):
        return abs(measure)
    if root.kind in (Kind.COLLISION, Kind.SINGULAR, Kind.DEPOSITION_SPEED):
        return limit - measure
    return measure - limit if root.kind is Kind.GRAVITY else 0.0
