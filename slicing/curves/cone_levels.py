"""Curves of a closed mesh on many offsets of one cone, all in one go.

    curves = cone_curves(mesh, Cone((0.0, 0.0), 20.0, 15.0), heights=1.73 * np.arange(30), tolerance_mm=0.01)
    curves[7]                                 # on the cone 7 * 1.73 mm further out

The offsets of a cone are the cone itself, moved along its axis. So instead of the cone the triangles are moved: every
triangle is copied once for each offset that it meets, lowered or raised by what that offset is, and all copies are
cut by the one cone (`slicing.curves.revolved`). Copies for different offsets share no corner, so no curve runs from
one to another. Which triangles an offset meets is told by the heights of their corners over the cone: these cannot be
lower than their triangle's least height but by the sag of the cone between them.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..mesh.solid import Floats, Ints, Mesh
from ..surfaces.surfaces import Cone
from .face_intervals import SLACK_MM
from .loops import Curve
from .revolved import stacked_curves

NUDGE_MM = 1e-7  # zero counts as inside
BATCH = 100_000
STEEPEST = 0.01  # of cones whose offsets are moved along the axis; steeper ones would be moved too far


def cone_curves(mesh: Mesh, base: Cone, heights: Floats, tolerance_mm: float, batch: int = BATCH) -> list[list[Curve]]:
    """Curves in which a mesh meets offsets of a cone.

    Args:
        mesh: the solid, part frame, mm.
        base: what is offset; its slope at least STEEPEST either way.
        heights: (l,) offsets, mm, ascending.
        tolerance_mm: greatest distance between the exact curve and the chord of two successive points.
        batch: triangles that are cut in one go: bounds the memory.

    Returns:
        For every offset its closed curves, as `slicing.curves.intersect.intersect` gives them.
    """
    found: list[list[Curve]] = []
    height = base.distance(mesh.vertices)
    cut_at = _cuts(height, heights, mesh.noise_mm)
    sine = base.slope / np.hypot(1.0, base.slope)
    for rows, level, low, high in _batches(mesh, base, height, cut_at, batch):
        if len(rows) == 0:
            found += [[] for _ in range(low, high)]
            continue
        raised = cut_at[low:high] / sine
        stack, level = _stacked(mesh, rows, level - low, raised)
        curves = stacked_curves(stack, base, level, high - low, tolerance_mm)
        for own, by in zip(curves, raised.tolist(), strict=True):
            for curve in own:
                curve.points[:, 2] -= by
        found += curves
    return found


def _cuts(height: Floats, heights: Floats, noise_mm: float) -> Floats:
    """Where the offsets are cut: a hair further out, or just past the corners that lie on them but for rounding."""
    below = np.searchsorted(heights, height, side="left") - 1
    gap = np.where(below >= 0, height - heights[below], np.inf)
    lift = np.full(len(heights), NUDGE_MM)
    touching = np.flatnonzero(gap <= noise_mm)
    np.maximum.at(lift, below[touching], gap[touching] + NUDGE_MM)
    return heights + lift


def _batches(
    mesh: Mesh, base: Cone, height: Floats, cut_at: Floats, batch: int
) -> Iterator[tuple[Ints, Ints, int, int]]:
    """Ranges of levels: numbers of triangles (k,) with the levels (k,) that they meet, and the range's ends."""
    corners = [height[mesh.faces[:, k]] for k in range(3)]
    centres, radii = mesh.bounding_spheres
    away = np.hypot(centres[:, 0] - base.axis_point[0], centres[:, 1] - base.axis_point[1]) - radii
    sag = np.where(away > radii, radii**2 / (2.0 * np.maximum(away, 1e-300)), 2.0 * radii) + SLACK_MM
    low = np.minimum(np.minimum(corners[0], corners[1]), corners[2]) - sag
    high = np.maximum(np.maximum(corners[0], corners[1]), corners[2])
    first, after = np.searchsorted(cut_at, low), np.searchsorted(cut_at, high)
    met = np.flatnonzero(after > first)
    first, after = first[met], after[met]
    levels = len(cut_at)
    count = np.cumsum(np.bincount(first, minlength=levels + 1) - np.bincount(after, minlength=levels + 1))[:levels]
    begin = 0
    while begin < levels:
        end = begin + max(int(np.searchsorted(np.cumsum(count[begin:]), batch, side="right")), 1)
        start = np.maximum(first, begin)
        many = np.maximum(np.minimum(after, end) - start, 0)
        row = np.repeat(np.arange(len(met)), many)
        level = np.arange(len(row)) + np.repeat(start - np.cumsum(many) + many, many)
        order = np.argsort(level, kind="stable")
        yield met[row[order]], level[order], begin, end
        begin = end


def _stacked(mesh: Mesh, rows: Ints, level: Ints, raised: Floats) -> tuple[Mesh, Ints]:
    """Copies of triangles for their levels, each raised by its level's height along the axis; and the levels."""
    corner = mesh.faces[rows] + (level * len(mesh.vertices))[:, None]
    used, faces = np.unique(corner, return_inverse=True)
    of = used // len(mesh.vertices)
    vertices = mesh.vertices[used - of * len(mesh.vertices)]
    vertices[:, 2] += raised[of]
    return Mesh(mesh.name, vertices, faces.reshape(-1, 3).astype(np.int64), noise_mm=mesh.noise_mm), level
