"""What tests ask of a bead: its break points alone, and the travel between beads."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slicing.beads.bead import Bead
from slicing.mesh.solid import Floats, Ints
from slicing.targets.break_points import BeadLine, chosen_points


def break_points(points: Floats, seam: int, chord_tolerance_mm: float, min_segment_mm: float) -> Ints:
    """Choose the targets of one closed bead.

    Args:
        points: (n, 3) the fine curve, closed, the first point not repeated, mm.
        seam: where to start.
        chord_tolerance_mm: greatest distance of the fine curve from a segment.
        min_segment_mm: least distance between successive targets.

    Returns:
        Numbers of the chosen points in the order of travel, the seam first and not repeated.
    """
    order = np.roll(np.arange(len(points)), -seam)
    (chosen,) = chosen_points([BeadLine(points[order], True, chord_tolerance_mm)], min_segment_mm)
    return order[chosen]


def open_break_points(
    points: Floats, chord_tolerance_mm: float, min_segment_mm: float, stops: Sequence[int] = ()
) -> Ints:
    """Choose the targets of one open bead.

    Args:
        points: (n, 3) the fine curve from end to end, mm.
        chord_tolerance_mm: greatest distance of the fine curve from a segment.
        min_segment_mm: least distance between successive targets; a shorter bead has its two ends.
        stops: numbers of points that are targets whatever their distance.

    Returns:
        Numbers of the chosen points in the order of travel, both ends among them.
    """
    (chosen,) = chosen_points([BeadLine(points, False, chord_tolerance_mm, tuple(stops))], min_segment_mm)
    return chosen


def travel_mm(beads: Sequence[Bead], start: Floats | None = None) -> float:
    """Length of the straight ways from bead to bead, mm."""
    ends = ([] if start is None else [start]) + [bead.end for bead in beads]
    starts = [bead.points[0] for bead in beads][1 if start is None else 0 :]
    return float(sum(np.linalg.norm(b - a) for a, b in zip(ends, starts, strict=False)))
