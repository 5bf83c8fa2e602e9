"""Curves of a closed mesh on many parallel planes, or on many cylinders about one axis, all in one go.

    curves = level_curves(mesh, Cylinder((0.0, 0.0), 20.0), heights=1.73 * np.arange(30), tolerance_mm=0.01)
    curves[7]                                 # on the cylinder of radius 20 + 7 * 1.73

Levels are numbered upwards. A vertex lies outside of the levels below it, and their number, its *rank*, says all
about it: an edge crosses the levels between the ranks of its ends, and a triangle those between the least and
the greatest rank of its corners. So what is to be solved, (edge, level) and (triangle, level), follows from
whole numbers, and is solved in arrays over all levels; the work is that of the crossings, not of triangles times
levels. An edge can also dip into a cylinder between two ends outside of it: it crosses twice all the levels
between the foot of the perpendicular from the axis and its lower end. This and what else planes and cylinders have of
their own: `slicing.curves.plane_levels` and `slicing.curves.cylinder_levels`.

A vertex counts as inside of a level that it lies on: every level is nudged outward by a hair, or just past the
vertices that lie on it to within the mesh's rounding (see `slicing.curves.intersect`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..mesh.face_measures import columns_at
from ..mesh.solid import Bools, Floats, Ints, Mesh
from ..surfaces.surfaces import Cylinder, Plane
from .crossing_net import CrossingNet, LevelPieces, Ranks, row_level_pairs
from .cylinder_levels import CylinderLevels
from .loops import Curve, curves_by_level
from .pairing import pair
from .plane_levels import PlaneLevels

LEVELS: dict[type, Callable[[Any], PlaneLevels | CylinderLevels]] = {Plane: PlaneLevels, Cylinder: CylinderLevels}
NUDGE_MM = 1e-7  # zero counts as inside
BATCH = 300_000
# by which corners lie outside (1 + 2 + 4): the side along which the boundary leaves, and that where it comes back
LEAVES = np.array([0, 2, 0, 2, 1, 1, 0, 0])
RETURNS = np.array([0, 0, 1, 1, 2, 0, 2, 0])


def level_curves(
    mesh: Mesh,
    base: Plane | Cylinder,
    heights: Floats,
    tolerance_mm: float,
    nudge_mm: float = NUDGE_MM,
    faces: Ints | None = None,
    batch: int = BATCH,
) -> list[list[Curve]]:
    """Curves in which a mesh meets offsets of a plane or a cylinder.

    Args:
        mesh: the solid, part frame, mm.
        base: what is offset.
        heights: (l,) offsets, mm, ascending; above minus the radius of a cylinder.
        tolerance_mm: greatest distance between the exact curve and the chord of two successive points.
        nudge_mm: how far outside a level the cut is really made.
        faces: (k,) numbers of the triangles to examine, ascending; all when not given.
        batch: crossings of triangles and levels that are solved in one go: bounds the memory.

    Returns:
        For every level its closed curves, as `slicing.curves.intersect.intersect` gives them.
    """
    if len(heights) == 0:
        return []
    kind = LEVELS[type(base)](base)
    net = _net(mesh, base, np.asarray(heights, dtype=np.float64), nudge_mm, faces)
    dipping, lowest = kind.dips(mesh, net)
    net = _with_dips(net, dipping, lowest) if len(dipping) else net
    found: list[list[Curve]] = []
    for low, high in _batches(net, batch):
        found += _batch(mesh, net, kind, (low, high), tolerance_mm)
    return found


def _net(mesh: Mesh, base: Plane | Cylinder, heights: Floats, nudge_mm: float, faces: Ints | None) -> CrossingNet:
    """The triangles among the levels, as if no edge crossed a level twice."""
    edges, sides = mesh.edges_and_sides
    vertices, corners = mesh.vertices, mesh.faces
    if faces is None:
        faces, columns = np.arange(len(corners)), mesh.corners
    else:
        used, sides = _renumbered(len(edges), sides[faces])
        near, both = _renumbered(len(vertices), np.concatenate([edges[used].ravel(), corners[faces].ravel()]))
        vertices, edges, corners = vertices[near], both[: 2 * len(used)].reshape(-1, 2), both[2 * len(used) :]
        corners = corners.reshape(-1, 3)
        columns = np.ascontiguousarray(corners.T)
    height = base.distance(vertices)
    cut_at, rank = _ranks(height, heights, nudge_mm, mesh.noise_mm)
    begin, end = (rank.take(edges[:, k]) for k in (0, 1))
    a, b, c = (rank.take(column) for column in columns)
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    face_low, face_high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    spans = (low, low, high, face_low, face_high, np.zeros(len(corners), dtype=bool))
    return CrossingNet(cut_at, vertices, height, rank, corners, faces, sides, edges, *spans)


def _with_dips(net: CrossingNet, dipping: Ints, lowest: Ints) -> CrossingNet:
    """The same with edges that cross levels twice, from the lowest level of each on."""
    low, dips, face_low = net.edge_low.copy(), np.zeros(len(net.edges), dtype=bool), net.face_low.copy()
    low[dipping], dips[dipping] = lowest, True
    dipped = _any_side(dips, net.sides)
    rows = np.flatnonzero(dipped)
    face_low[rows] = low[net.sides[rows]].min(axis=1)
    return replace(net, edge_low=low, face_low=face_low, dipped=dipped)


def _any_side(dips: Bools, sides: Ints) -> Bools:
    """Whether any of the sides (f, 3) of triangles dips."""
    first, second, third = (dips.take(sides[:, k]) for k in range(3))
    return first | second | third


def _renumbered(size: int, used: Ints) -> tuple[Ints, Ints]:
    """The numbers that occur, ascending, and every number's place among them (without sorting)."""
    mark = np.zeros(size, dtype=bool)
    mark[used] = True
    numbers = np.flatnonzero(mark)
    place = np.empty(size, dtype=np.int64)
    place[numbers] = np.arange(len(numbers))
    return numbers, place[used]


def _ranks(height: Floats, levels: Floats, nudge_mm: float, noise_mm: float) -> tuple[Floats, Ranks]:
    """Where the levels are cut, and how many of these cuts each vertex lies outside of.

    A level is cut nudge_mm further out, or just past the vertices that lie on it to within the rounding.
    """
    rank: Ranks = np.searchsorted(levels, height, side="left").astype(np.int32)
    below = rank - 1  # the last level that the vertex lies above
    gap = np.where(rank > 0, height - levels[below], np.inf)
    touching = np.flatnonzero(gap <= noise_mm)
    lift = np.full(len(levels), nudge_mm)
    np.maximum.at(lift, below[touching], gap[touching] + NUDGE_MM)
    cut_at = np.maximum.accumulate(levels + lift)
    near = np.flatnonzero(gap <= lift.max())
    rank[near] = np.searchsorted(cut_at, height[near], side="left")
    return cut_at, rank


def _batches(net: CrossingNet, batch: int) -> Iterator[tuple[int, int]]:
    """Ranges of levels with a bounded number of crossings each."""
    levels = len(net.cut_at)
    if len(net.faces) <= batch // levels:
        yield 0, levels
        return
    begin = np.bincount(net.face_low, minlength=levels + 1)
    active = np.cumsum(begin - np.bincount(net.face_high, minlength=levels + 1))[:levels]
    low, total = 0, 0
    for level, count in enumerate(active.tolist()):
        if total and total + count > batch:
            yield low, level
            low, total = level, 0
        total += count
    yield low, levels


def _batch(
    mesh: Mesh, net: CrossingNet, kind: PlaneLevels | CylinderLevels, levels: tuple[int, int], tolerance_mm: float
) -> list[list[Curve]]:
    """Curves of the levels low .. high - 1."""
    low, high = levels
    edge, at, first = row_level_pairs(net.edge_low, net.edge_high, low, high)
    pieces = _pieces(net, low, high, edge, at, first)
    pieces, samples = kind.sampled(mesh, net, levels, (edge, at), pieces, tolerance_mm)
    return curves_by_level(pieces.start, pieces.end, pieces.level - low, high - low, samples)


def _pieces(net: CrossingNet, low: int, high: int, edge: Ints, at: Ints, shift: Ints) -> LevelPieces:
    """Pieces of curve in the triangles.

    Args:
        net: the triangles.
        low: first level.
        high: the level after the last.
        edge: (c,) edges of the crossings.
        at: (c,) their levels.
        shift: (e,) from an edge's levels to the numbers of its crossings.

    Returns:
        The pieces; by triangle, then level.
    """
    row, level, _ = row_level_pairs(net.face_low, net.face_high, low, high)
    special = net.dipped[row]
    if not special.any():
        return LevelPieces(*_simple(net, row, level, shift), row, level)
    plain = np.flatnonzero(~special)
    start, end = _simple(net, row[plain], level[plain], shift)
    more = np.flatnonzero(special)
    sides = net.sides[row[more]]
    crossed = (level[more, None] >= net.edge_low[sides]) & (level[more, None] < net.edge_high[sides])
    forward = net.faces[row[more]] == net.edges[sides, 0]
    outside = net.rank[net.edges[edge]] > at[:, None]
    count = np.where(at < net.single_low[edge], 2, 1)
    pieces = pair(np.where(crossed, shift[sides] + level[more, None], -1), forward, count, outside)
    place = np.concatenate([plain, more[pieces.face]])
    order = np.argsort(place, kind="stable")
    place = place[order]
    start, end = np.append(start, pieces.start)[order], np.append(end, pieces.end)[order]
    return LevelPieces(start, end, row[place], level[place])


def _simple(net: CrossingNet, row: Ints, level: Ints, shift: Ints) -> tuple[Ints, Ints]:
    """Start and end nodes where a triangle's boundary crosses the level just twice, on two sides."""
    kind = np.zeros(len(row), dtype=np.int8)
    for k, corner in enumerate(columns_at(net.faces, row)):
        kind += (net.rank.take(corner) > level) * np.int8(1 << k)
    sides, row = net.sides.ravel(), 3 * row
    start, end = (2 * (shift.take(sides.take(row + table.take(kind))) + level) for table in (RETURNS, LEAVES))
    return start, end
