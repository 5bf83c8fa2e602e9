"""Where closed beads start and end.

    layers = with_seams(sliced, layers, parameters)      # every closed bead starts at its seam

aligned: at the point nearest to a seam of the layer below; in the first layer at its lowest point, the first of them in
the direction of travel. spread: golden shares of the way round from where the first layer's seam would be, so that
successive seams are at least 0.38 of the bead's length apart and do not come back soon. chosen: at the point nearest
to a given one, or to a given angle about the body's axis (the lowest of the nearest). Open beads have no seam.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slicing.beads import Bead, BeadParameters
from slicing.layers import SlicedSubVolume
from slicing.part import Floats
from slicing.surfaces import Surface

SAME_HEIGHT_MM = 1e-4
SAME_ANGLE_RAD = 1e-4
GOLDEN = 0.5 * (5**0.5 - 1)


def with_seams(
    sliced: SlicedSubVolume, layers: Sequence[Sequence[Bead]], parameters: BeadParameters
) -> list[list[Bead]]:
    """Closed beads, each from its seam on.

    Args:
        sliced: their sub-volume.
        layers: beads, layer by layer from the body outward.
        parameters: which seams.

    Returns:
        The same beads; open ones as they are.
    """
    seams, out = np.zeros((0, 3)), []
    for layer, beads in zip(sliced.layers, layers, strict=True):
        new = []
        for bead in beads:
            if bead.closed:
                bead = bead.rolled(_seam(sliced, bead, layer.surface, layer.index, seams, parameters))
            new.append(bead)
        starts = [bead.points[0] for bead in new if bead.closed]
        seams = np.array(starts) if starts else seams
        out.append(new)
    return out


def _seam(sliced: SlicedSubVolume, bead: Bead, surface: Surface, layer: int, below: Floats, p: BeadParameters) -> int:
    """Number of the point where a bead starts."""
    if p.seam == "spread":
        return _further(bead.points, _lowest(bead, surface), (layer * GOLDEN) % 1.0)
    if p.seam == "chosen":
        if p.seam_xyz_mm is not None:
            return int(np.argmin(((bead.points - p.seam_xyz_mm) ** 2).sum(axis=1)))
        across = bead.points[:, :2] - sliced.body.surface.axis_point
        turn = np.arctan2(across[:, 1], across[:, 0]) - np.radians(p.seam_angle_deg or 0.0)
        away = np.abs((turn + np.pi) % (2 * np.pi) - np.pi)
        near = np.flatnonzero(away <= away.min() + SAME_ANGLE_RAD)
        return int(near[np.argmin(bead.points[near, 2])])
    if len(below):
        away = ((bead.points[:, None] - below[None]) ** 2).sum(axis=2).min(axis=1)
        return int(np.argmin(away))
    return _lowest(bead, surface)


def _lowest(bead: Bead, surface: Surface) -> int:
    """The lowest point, the first of them in the direction of travel."""
    lowest = np.flatnonzero(bead.points[:, 2] <= bead.points[:, 2].min() + SAME_HEIGHT_MM)
    along = surface.unrolled(bead.points)[lowest, 0]
    return int(lowest[np.argmax(along) if bead.hole else np.argmin(along)])


def _further(points: Floats, first: int, share: float) -> int:
    """The point a share of the way round on from a first one."""
    loop = np.roll(points, -first, axis=0)
    step = np.sqrt(((np.roll(loop, -1, axis=0) - loop) ** 2).sum(axis=1))
    length = np.append(0.0, np.cumsum(step))
    return (first + int(np.argmin(np.abs(length[:-1] - share * length[-1])))) % len(points)
