"""Rows of a sweep document by what was varied beside the table angles.

Use:

    for pose, rows in variants(document): ...
"""

from __future__ import annotations

from typing import Any

from .grid import Pose

SweepRow = dict[str, Any]


def variants(document: dict[str, Any]) -> list[tuple[Pose, list[SweepRow]]]:
    """The poses of every cell that was tried: of each a map.

    Args:
        document: "rbam-sweep/1".

    Returns:
        In the document's order; the pose says what is tried, its table angles are 0.
    """
    found: dict[Pose, list[SweepRow]] = {}
    for row in document["poses"]:
        found.setdefault(Pose.of(row).variant, []).append(row)
    return list(found.items())


def is_lower_bound(row: SweepRow) -> bool:
    """Whether more of a pose's targets may be infeasible than its row counts: some were not checked, or alone."""
    return not row["searched"] or row.get("not_looked_at", 0) > 0


def variant_words(pose: Pose) -> str:
    """What a cell was given to try; empty where nothing."""
    return ", ".join(variant_pieces(pose))


def variant_pieces(pose: Pose) -> list[str]:
    """The same, one piece a thing that was tried."""
    words = []
    if pose.roll is not None:
        words.append(f"roll {pose.roll}")
    if pose.positioner is not None:
        x, y, z, rz = pose.positioner
        words.append(f"positioner at {x:g}, {y:g}, {z:g} mm turned {rz:g} deg")
    if pose.height_mm is not None:
        words.append(f"height {pose.height_mm:g} mm")
    return words
