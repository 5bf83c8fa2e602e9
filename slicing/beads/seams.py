"""Where closed beads start and end.

    layers = with_seams(sliced, layers, parameters)      # every closed bead starts at its seam

aligned: at the point nearest to a seam of the layer below; in the first layer at its lowest point, the first of them in
the direction of travel. spread: golden shares of the way round from where the first layer's seam would be, so that
successive seams are at least 0.38 of the bead's length apart and do not come back soon. chosen: at the point nearest
to a given one, or to a given angle about the body's axis (the lowest of the nearest). A sub-volume or some layers of it
may have a place of their own. Open beads have no seam.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..layers.layer import SlicedSubVolume
from ..mesh.solid import Floats
from ..parameters import BeadParameters
from ..surfaces.surfaces import Surface
from .bead import Bead
from .exact_points import point_between

SAME_HEIGHT_MM = 1e-4
SAME_ANGLE_RAD = 1e-4
SAME_PLACE = 1e-6  # share of a side
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
    for beads in layers:
        new = []
        for bead in beads:
            if bead.closed:
                bead = _started(sliced, bead, seams, parameters)
            new.append(bead)
        starts = [bead.points[0] for bead in new if bead.closed]
        seams = np.array(starts) if starts else seams
        out.append(new)
    return out


def _started(sliced: SlicedSubVolume, bead: Bead, below: Floats, p: BeadParameters) -> Bead:
    """A closed bead from its seam on."""
    surface = sliced.layers[bead.layer].surface
    own = next((place for place in reversed(p.seams) if place.is_for(sliced.name, bead.layer)), None)
    if own is not None:
        return _placed(sliced, bead, own.angle_deg, own.xyz_mm)
    if p.seam == "aligned":
        if not len(below):
            return bead.rolled(_lowest(bead, surface))
        away = ((bead.points[:, None] - below[None]) ** 2).sum(axis=2).min(axis=1)
        return bead.rolled(int(np.argmin(away)))
    if p.seam == "spread":
        share = (bead.layer * GOLDEN) % 1.0
        if p.alternate and bead.layer % 2:  # it runs the other way: the same place is the rest of the way on
            share = -share % 1.0
        return _split(sliced, bead, *_further(bead.points, _lowest(bead, surface), share))
    return _placed(sliced, bead, p.seam_angle_deg, p.seam_xyz_mm)


def _placed(
    sliced: SlicedSubVolume, bead: Bead, angle_deg: float | None, xyz_mm: tuple[float, float, float] | None
) -> Bead:
    """A closed bead that starts nearest to a point or an angle."""
    if xyz_mm is not None:
        return _split(sliced, bead, *_nearest(bead.points, np.asarray(xyz_mm, dtype=np.float64)))
    across = bead.points - np.append(sliced.body.surface.axis_point, 0.0)
    return _split(sliced, bead, *_at_angle(across, math.radians(angle_deg or 0.0)))


def _split(sliced: SlicedSubVolume, bead: Bead, k: int, share: float) -> Bead:
    """A closed bead that starts between its point k and the next; the new point lies on the exact curve."""
    n = len(bead.points)
    if share < SAME_PLACE or share > 1.0 - SAME_PLACE:
        return bead.rolled(k if share < SAME_PLACE else (k + 1) % n)
    a, b = bead.points[k], bead.points[(k + 1) % n]
    point = point_between(sliced, bead.layer, a, b)(np.array([share]))
    gained = (1 - share) * bead.gained_mm[k] + share * bead.gained_mm[(k + 1) % n]
    turned = bead.rolled((k + 1) % n)
    return replace(
        turned,
        points=np.concatenate([point, turned.points]),
        gained_mm=np.append(gained, turned.gained_mm),
        stops=tuple(s + 1 for s in turned.stops),
    )


def _nearest(points: Floats, place: Floats) -> tuple[int, float]:
    """Side of a closed polyline and share of it that come nearest to a place."""
    along = np.roll(points, -1, axis=0) - points
    share = ((place - points) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-300)
    share = np.clip(share, 0.0, 1.0)
    k = int(np.argmin(((points + share[:, None] * along - place) ** 2).sum(axis=1)))
    return k, float(share[k])


def _at_angle(across: Floats, angle: float) -> tuple[int, float]:
    """Where a closed polyline about the origin comes to an angle, lowest first; else its nearest point."""
    turn = (np.arctan2(across[:, 1], across[:, 0]) - angle + np.pi) % (2 * np.pi) - np.pi
    after = np.roll(turn, -1)
    passes = np.flatnonzero((turn * after <= 0) & (np.abs(turn - after) > 0) & (np.abs(turn - after) < np.pi))
    if len(passes) == 0:
        near = np.flatnonzero(np.abs(turn) <= np.abs(turn).min() + SAME_ANGLE_RAD)
        return int(near[np.argmin(across[near, 2])]), 0.0
    # the ray meets the side where their cross product vanishes
    ray = np.array([math.cos(angle), math.sin(angle)])
    side = across[:, 0] * ray[1] - across[:, 1] * ray[0]
    gap = side[passes] - np.roll(side, -1)[passes]
    share = np.clip(side[passes] / np.where(gap == 0, 1.0, gap), 0.0, 1.0)
    height = across[passes, 2] + share * (np.roll(across[:, 2], -1)[passes] - across[passes, 2])
    best = int(np.argmin(height))
    return int(passes[best]), float(share[best])


def _lowest(bead: Bead, surface: Surface) -> int:
    """The lowest point, the first of them in the direction of travel."""
    lowest = np.flatnonzero(bead.points[:, 2] <= bead.points[:, 2].min() + SAME_HEIGHT_MM)
    along = surface.unrolled(bead.points)[lowest, 0]
    return int(lowest[np.argmax(along) if bead.hole else np.argmin(along)])


def _further(points: Floats, first: int, share: float) -> tuple[int, float]:
    """Side and share of it that lie a share of the way round on from a first point."""
    loop = np.roll(points, -first, axis=0)
    step = np.sqrt(((np.roll(loop, -1, axis=0) - loop) ** 2).sum(axis=1))
    length = np.append(0.0, np.cumsum(step))
    at = share * length[-1]
    k = min(int(np.searchsorted(length, at, side="right")) - 1, len(step) - 1)
    return (first + k) % len(points), float((at - length[k]) / step[k])
