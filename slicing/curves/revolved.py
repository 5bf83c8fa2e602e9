"""Exact curves in which a closed triangle mesh meets a cone or another surface of revolution.

    curves = round_curves(mesh, faces, Cone((0.0, 0.0), 20.0, 15.0), tolerance_mm=0.01)

The surface is taken band by band (`slicing.curves.slabs`): within a band it is one cone, whose inside is convex, so
that what `slicing.curves.intersect` does for triangles and cylinders holds for cells and bands. Every segment is
solved once, the pieces of curve follow from the order of its crossings round each cell, they chain by name,
and each is an arc of a conic (`slicing.curves.conic_arcs`). A cell that holds a whole ellipse has it without any node.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..mesh.solid import Bools, Floats, Ints, Mesh
from ..surfaces.surfaces import Cone, Revolved
from .conic_arcs import Arcs, sample_conics
from .loops import SAME_POINT_MM, Curve, curves_by_level
from .pairing import pair
from .slabs import CutTriangles, ProfileSlabs, Segments, cut_at_slabs

SAGITTA_SHARE = 0.05  # of the tolerance: how far chords in place of a profile's arcs may stray


def round_curves(mesh: Mesh, faces: Ints, surface: Cone | Revolved, tolerance_mm: float) -> list[Curve]:
    """Curves of a mesh on a surface of revolution, the cut made exactly there.

    Args:
        mesh: the solid, part frame, mm.
        faces: (m,) numbers of the triangles that may reach the surface.
        surface: where to cut; points that lie on it count as inside.
        tolerance_mm: greatest distance between the curve and the chord of two successive points.

    Returns:
        Closed curves, as `slicing.curves.intersect.intersect` gives them.
    """
    return _cut(mesh, faces, surface, np.zeros(len(faces), dtype=np.int64), 1, tolerance_mm)[0]


def stacked_curves(mesh: Mesh, surface: Cone, level: Ints, levels: int, tolerance_mm: float) -> list[list[Curve]]:
    """Curves of several meshes in one on a cone (see `slicing.curves.cone_levels`).

    Args:
        mesh: their triangles; those of different levels have no corner in common.
        surface: where to cut; points that lie on it count as inside.
        level: (m,) which of the meshes each triangle is of.
        levels: how many there are.
        tolerance_mm: greatest distance between the curve and the chord of two successive points.

    Returns:
        The closed curves of each.
    """
    return _cut(mesh, np.arange(len(mesh.faces)), surface, level, levels, tolerance_mm)


def _cut(
    mesh: Mesh, faces: Ints, surface: Cone | Revolved, level: Ints, levels: int, tolerance_mm: float
) -> list[list[Curve]]:
    """Curves of triangles on a surface, by the levels (m,) of the triangles."""
    bands = ProfileSlabs.of(surface.chain(SAGITTA_SHARE * tolerance_mm))
    cells = cut_at_slabs(mesh, faces, bands)
    outside = _outside(cells.segments, surface.axis_point)
    nodes, count = _crossings(cells.segments, outside, surface.axis_point)
    pieces = pair(cells.sides, cells.forward, count, outside)
    unit = mesh.normals[faces]
    unit /= np.maximum(np.sqrt((unit**2).sum(axis=1)), 1e-300)[:, None]
    arcs = Arcs(
        nodes[pieces.start],
        nodes[pieces.end],
        _directions(cells, pieces.start, pieces.end, pieces.face, nodes),
        unit[cells.face[pieces.face]],
        cells.slab[pieces.face],
        bands,
    )
    start, end, at = pieces.start, pieces.end, level[cells.face[pieces.face]]
    whole = _whole(mesh, faces, cells, bands, count, outside, surface.axis_point)
    if len(whole):
        number = len(nodes) + np.arange(3 * len(whole)).reshape(-1, 3)
        arcs = _with_ellipses(arcs, mesh, faces[cells.face[whole]], unit[cells.face[whole]], cells.slab[whole], surface)
        start = np.concatenate([start, number.ravel()])
        end = np.concatenate([end, np.roll(number, -1, axis=1).ravel()])
        at = np.concatenate([at, np.repeat(level[cells.face[whole]], 3)])
    if len(start) == 0:
        return [[] for _ in range(levels)]
    samples = sample_conics(arcs, surface.axis_point, tolerance_mm)
    return [_with_pole(curves, bands) for curves in curves_by_level(start, end, at, levels, samples)]


def _with_pole(curves: list[Curve], bands: ProfileSlabs) -> list[Curve]:
    """Add the area of the whole surface to the loop that runs round the top of a closed one.

    Areas under loops that wind count from the profile's lowest knot. That is right for a loop round the lower
    end of a closed surface and for two loops that bound a ring; a region that holds the upper end is bounded
    by the topmost of the winding loops, running counter-clockwise. A region that is all of a closed surface but
    for what loops cut out of it has no winding loops, and less than no area.
    """
    if not bands.empty[-1] or not curves:
        return curves
    winding = [k for k, curve in enumerate(curves) if curve.winding]
    if winding:
        top = max(winding, key=lambda k: -curves[k].area_mm2 / curves[k].winding)
        holds_top = curves[top].winding > 0
    else:
        top = min(range(len(curves)), key=lambda k: curves[k].area_mm2)
        holds_top = bool(bands.empty[0]) and sum(curve.area_mm2 for curve in curves) < 0
    if holds_top:
        area = curves[top].area_mm2 + 2 * np.pi * float(bands.area[-1])
        curves[top] = replace(curves[top], area_mm2=area, hole=False)
    return curves


def _outside(segments: Segments, axis_point: tuple[float, float]) -> Bools:
    """(s, 2) which ends of segments lie outside; on the surface counts as inside."""
    ends = []
    for point, radius in ((segments.begin, segments.begin_r), (segments.end, segments.end_r)):
        r = np.hypot(point[:, 0] - axis_point[0], point[:, 1] - axis_point[1])
        ends.append((r > radius) | (radius <= 0.0))
    return np.stack(ends, axis=1)


def _crossings(segments: Segments, outside: Bools, axis_point: tuple[float, float]) -> tuple[Floats, Ints]:
    """Where segments cross the surface.

    Args:
        segments: the segments.
        outside: (s, 2) which ends lie outside. The number of crossings follows from these, never from rounding.
        axis_point: of the surface.

    Returns:
        (2 s, 3) nodes: 2 i the first crossing of segment i or its only one, 2 i + 1 the second; and (s,) how
        many: 0, 1 or 2.
    """
    origin, along = segments.begin[:, :2] - axis_point, segments.end - segments.begin
    radius, growth = segments.begin_r, segments.end_r - segments.begin_r
    # |origin + t along|² = (radius + t growth)²:  a t² + 2 b t + c = 0
    a = (along[:, :2] ** 2).sum(axis=1) - growth**2
    b = (origin * along[:, :2]).sum(axis=1) - radius * growth
    away = np.hypot(origin[:, 0], origin[:, 1])
    c = (away - radius) * (away + radius)
    d = b * b - a * c
    count = (outside[:, 0] != outside[:, 1]).astype(np.int64)
    inside_possible = np.maximum(segments.begin_r, segments.end_r) > 0.0
    count[outside.all(axis=1) & inside_possible & (d > 0) & (b < 0) & (b + a > 0)] = 2
    root = np.sqrt(np.maximum(d, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        leaving = np.where(b >= 0, -c / (b + root), (root - b) / a)  # no difference of like numbers
        entering = np.where(b <= 0, c / (root - b), (-b - root) / a)
    t = np.stack([np.where((count == 1) & outside[:, 1], leaving, entering), leaving], axis=1)
    t = np.clip(np.nan_to_num(t, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    return (segments.begin[:, None] + t[:, :, None] * along[:, None]).reshape(-1, 3), count


def _directions(cells: CutTriangles, start: Ints, end: Ints, cell: Ints, nodes: Floats) -> Floats:
    """Directions (p, 3) of the pieces' chords; along the segment where both nodes lie on the same one.

    Nodes of two segments that coincide lie at a corner, or in a cell without width: an edge in a border plane and
    the chord beside it. Rounding must not tell the direction there; 0 makes the piece straight.
    """
    chord = nodes[end] - nodes[start]
    chord[(chord**2).sum(axis=1) < SAME_POINT_MM**2] = 0.0
    same = np.flatnonzero(start // 2 == end // 2)
    segment = start[same] // 2
    at = np.argmax(cells.sides[cell[same]] == segment[:, None], axis=1)
    sign = np.where(cells.forward[cell[same], at], 1.0, -1.0)
    # the walk round the cell comes in at the piece's start and leaves at its end, forward along the side
    chord[same] = sign[:, None] * (cells.segments.end[segment] - cells.segments.begin[segment])
    return chord


def _whole(
    mesh: Mesh,
    faces: Ints,
    cells: CutTriangles,
    bands: ProfileSlabs,
    count: Ints,
    outside: Bools,
    axis_point: tuple[float, float],
) -> Ints:
    """Cells that hold a whole ellipse: no side meets the surface, and the axis passes through, inside."""
    used = cells.sides >= 0
    rows = np.flatnonzero(((count[cells.sides] == 0) | ~used).all(axis=1) & ~bands.empty[cells.slab])
    rows = rows[(outside[cells.sides[rows]].all(axis=2) | ~used[rows]).all(axis=1) & ~bands.step[cells.slab[rows]]]
    if len(rows) == 0:
        return rows
    corners = mesh.vertices[mesh.faces[faces[cells.face[rows]]]]
    xy = corners[:, :, :2] - axis_point
    turn = np.stack([_cross(xy[:, k], xy[:, (k + 1) % 3]) for k in range(3)], axis=1)
    pierced = (turn > 0).all(axis=1) | (turn < 0).all(axis=1)
    rows, corners, turn = rows[pierced], corners[pierced], turn[pierced]
    z = (corners[:, [2, 0, 1], 2] * turn).sum(axis=1) / turn.sum(axis=1)  # of the axis, by barycentric weights
    here = (bands.slab(z) == cells.slab[rows]) & (bands.radius(cells.slab[rows], z) > 0.0)
    return rows[here]


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _with_ellipses(arcs: Arcs, mesh: Mesh, faces: Ints, normal: Floats, slab: Ints, surface: Cone | Revolved) -> Arcs:
    """Add ellipses as three arcs each, between points a third of a turn apart about the axis."""
    bands, corner = arcs.bands, mesh.vertices[mesh.faces[faces, 0]] - np.append(surface.axis_point, 0.0)
    turn = -np.sign(normal[:, 2])[:, None] * np.arange(3) * (2 * np.pi / 3)  # the inside on the right
    direction = np.stack([np.cos(turn), np.sin(turn)], axis=2)
    # in the plane z = z0 - r g(angle), on the cone r = r0 + k (z - at_z)
    z0 = (normal * corner).sum(axis=1) / normal[:, 2]
    g = (direction * normal[:, None, :2]).sum(axis=2) / normal[:, 2:]
    k = bands.slope[slab]
    r = (bands.at_r[slab] + k * (z0 - bands.at_z[slab]))[:, None] / (1.0 + k[:, None] * g)
    z = z0[:, None] - r * g
    points = np.concatenate([direction * r[:, :, None] + surface.axis_point, z[:, :, None]], axis=2)
    start, end = points.reshape(-1, 3), np.roll(points, -1, axis=1).reshape(-1, 3)
    return Arcs(
        np.concatenate([arcs.start, start]),
        np.concatenate([arcs.end, end]),
        np.concatenate([arcs.chord, end - start]),
        np.concatenate([arcs.normal, np.repeat(normal, 3, axis=0)]),
        np.concatenate([arcs.slab, np.repeat(slab, 3)]),
        bands,
    )
