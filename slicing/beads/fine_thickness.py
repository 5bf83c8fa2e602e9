"""Beads sampled finely: their thickness at places a quarter of a millimetre apart, and anywhere between.

Use:

    fine = fine_thickness(sliced, bead)
    point, gained = interpolate(sliced, bead, 7.25)     # a quarter of the way from point 7 to point 8
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..layers.layer import SlicedSubVolume
from ..mesh.solid import Floats
from .bead import Bead
from .exact_points import point_between

SPACING_MM = 0.25
SLACK_MM = 1e-6  # as near a limit still keeps it

Run = tuple[float, float]


@dataclass(frozen=True, eq=False)
class FinelySampledBead:
    """A finely sampled bead.

    Attributes:
        at: (m,) places, as numbers of its points with shares of the way to the next.
        points: (m, 3).
        thickness: (m,) what is gained counted in.
    """

    at: Floats
    points: Floats
    thickness: Floats


def fine_thickness(sliced: SlicedSubVolume, bead: Bead) -> FinelySampledBead:
    """Sample a bead finely; the samples of a closed one end at its first point.

    Args:
        sliced: its sub-volume.
        bead: the bead.

    Returns:
        Places, points and thickness.
    """
    points = np.concatenate([bead.points, bead.points[:1]]) if bead.closed else bead.points
    gained = np.append(bead.gained_mm, bead.gained_mm[:1]) if bead.closed else bead.gained_mm
    step = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    count = np.maximum(np.ceil(step / SPACING_MM), 1).astype(np.int64)
    k = np.repeat(np.arange(len(step)), count)
    first = np.append(0, np.cumsum(count))
    at = np.append(k + (np.arange(first[-1]) - first[k]) / count[k], float(len(step)))
    k = np.minimum(at.astype(np.int64), len(step) - 1)
    share: Floats = at - k
    surface = sliced.layers[bead.layer].surface
    chord: Floats = points[k] + share[:, None] * (points[k + 1] - points[k])
    fine = chord - surface.distance(chord)[:, None] * surface.normals(chord)
    thickness = sliced.thickness_at(bead.layer, fine) + (1 - share) * gained[k] + share * gained[k + 1]
    return FinelySampledBead(at, fine, thickness)


def segment_ends(bead: Bead, k: int) -> tuple[Floats, Floats]:
    """A point's position and that of the next, (3,) each."""
    return bead.points[k], bead.points[(k + 1) % len(bead.points)]


def interpolate(sliced: SlicedSubVolume, bead: Bead, u: float) -> tuple[Floats, float]:
    """Point (3,) and gained thickness at a place, the number of a point with the share of the way to the next."""
    n = len(bead.points)
    u = u % n if bead.closed else min(u, n - 1.0)
    k = min(int(u), n - 1)
    share = u - k
    if share < 1e-12:
        return bead.points[k], float(bead.gained_mm[k])
    point = point_between(sliced, bead.layer, *segment_ends(bead, k))(np.array([share]))[0]
    gained = (1 - share) * bead.gained_mm[k] + share * bead.gained_mm[(k + 1) % n]
    return point, float(gained)
