"""Curves of a closed mesh on many parallel planes, or on many cylinders about one axis, all in one go.

    curves = level_curves(mesh, Cylinder((0.0, 0.0), 20.0), heights=1.73 * np.arange(30), tolerance_mm=0.01)
    curves[7]                                 # on the cylinder of radius 20 + 7 * 1.73

Levels are numbered upwards. A vertex lies outside of the levels below it, and their number, its *rank*, says all
about it: an edge crosses the levels between the ranks of its ends, and a triangle those between the least and
the greatest rank of its corners. So what is to be solved, (edge, level) and (triangle, level), follows from
whole numbers, and is solved in arrays over all levels; the work is that of the crossings, not of triangles times
levels. An edge can also dip into a cylinder between two ends outside of it: it crosses twice all the levels
between the foot of the perpendicular from the axis and its lower end.

A vertex counts as inside of a level that it lies on: every level is nudged outward by a hair, or just past the
vertices that lie on it to within the mesh's rounding (see `slicing.curves.intersect`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..mesh.face_measures import columns_at
from ..mesh.solid import Bools, Floats, Ints, Mesh
from ..surfaces.surfaces import Cylinder, Plane
from .ellipse_arcs import Samples, sample_arcs
from .loops import Curve, curves_by_level
from .pairing import pair

Ranks = npt.NDArray[np.int32]  # small: they are gathered by every edge
NUDGE_MM = 1e-7  # zero counts as inside
BATCH = 300_000
# by which corners lie outside (1 + 2 + 4): the side along which the boundary leaves, and that where it comes back
LEAVES = np.array([0, 2, 0, 2, 1, 1, 0, 0])
RETURNS = np.array([0, 0, 1, 1, 2, 0, 2, 0])


@dataclass(frozen=True, eq=False)
class _Net:
    """The triangles that are looked at, numbered by themselves, and where they lie among the levels.

    Attributes:
        base: of the levels.
        cut_at: (l,) heights over base of the cuts as they are made, ascending.
        vertices: (v, 3) mm.
        height: (v,) over base.
        rank: (v,) levels that the vertex lies outside of: the first so many.
        faces: (f, 3) corners.
        number: (f,) of the triangles in the mesh.
        sides: (f, 3) edges.
        edges: (e, 2) vertices.
        edge_low: (e,) first level that the edge meets.
        single_low: (e,) first level that it crosses once; the ones between are crossed twice.
        edge_high: (e,) the level after its last.
        face_low: (f,) first level that the triangle's sides meet.
        face_high: (f,) the level after their last.
        dipped: (f,) triangles with a side that crosses some level twice.
    """

    base: Plane | Cylinder
    cut_at: Floats
    vertices: Floats
    height: Floats
    rank: Ranks
    faces: Ints
    number: Ints
    sides: Ints
    edges: Ints
    edge_low: Ranks
    single_low: Ranks
    edge_high: Ranks
    face_low: Ranks
    face_high: Ranks
    dipped: Bools


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
        faces: (k,) numbers of the triangles to look at, ascending; all when not given.
        batch: crossings of triangles and levels that are solved in one go: bounds the memory.

    Returns:
        For every level its closed curves, as `slicing.curves.intersect.intersect` gives them.
    """
    if len(heights) == 0:
        return []
    net = _net(mesh, base, np.asarray(heights, dtype=np.float64), nudge_mm, faces)
    found: list[list[Curve]] = []
    for low, high in _batches(net, batch):
        found += _batch(mesh, net, low, high, tolerance_mm)
    return found


def _net(mesh: Mesh, base: Plane | Cylinder, heights: Floats, nudge_mm: float, faces: Ints | None) -> _Net:
    edges, sides = mesh.edge_table
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
    single_low, dipped = low, np.zeros(len(corners), dtype=bool)
    if isinstance(base, Cylinder):
        radii = mesh.bounding_spheres[1]
        widest = float((radii if len(faces) == len(radii) else radii.take(faces)).max(initial=0.0))
        close = _may_dip(base, height, rank, cut_at, widest)
        dipping, lowest = _dips(base, vertices, edges, low, cut_at, close)
        if len(dipping):
            low, dips = low.copy(), np.zeros(len(edges), dtype=bool)
            low[dipping], dips[dipping] = lowest, True
            dipped = _any_side(dips, sides)
            rows = np.flatnonzero(dipped)
            face_low[rows] = low[sides[rows]].min(axis=1)
    spans = (low, single_low, high, face_low, face_high, dipped)
    return _Net(base, cut_at, vertices, height, rank, corners, faces, sides, edges, *spans)


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


def _may_dip(base: Cylinder, height: Floats, rank: Ranks, cut_at: Floats, half_mm: float) -> Bools:
    """Which vertices (v,) stand so close above a level that a side from there may dip into it.

    The foot of the perpendicular lies within half a side's length (at most half_mm) of the side's lower end.
    """
    radius = np.append(-np.inf, base.radius + cut_at)  # of the highest cut below a vertex
    reached = radius**2 + (1.0 + 1e-9) * half_mm**2
    reached[0] = -np.inf
    return (height + base.radius) ** 2 < reached.take(rank)


def _dips(base: Cylinder, vertices: Floats, edges: Ints, low: Ranks, cut_at: Floats, close: Bools) -> tuple[Ints, Ints]:
    """Edges that cross levels twice, both ends outside, and the first such level of each.

    Args:
        base: of the levels.
        vertices: (v, 3) mm.
        edges: (e, 2) vertices.
        low: (e,) least rank of their ends.
        cut_at: (l,) heights of the cuts.
        close: (v,) vertices of which one is an end of any such edge.

    Returns:
        Numbers of the edges, and levels.
    """
    if not close.any():
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    above = np.flatnonzero((close.take(edges[:, 0]) | close.take(edges[:, 1])) & (low > 0))
    x, y = vertices[:, 0] - base.axis_point[0], vertices[:, 1] - base.axis_point[1]
    begin, end = edges[above, 0], edges[above, 1]
    x0, y0 = x[begin], y[begin]
    dx, dy = x[end] - x0, y[end] - y0
    length2, along = dx * dx + dy * dy, x0 * dx + y0 * dy
    # the foot of the perpendicular falls within the edge
    rows = np.flatnonzero((along < 0) & (along + length2 > 0))
    foot = np.abs(x0[rows] * dy[rows] - y0[rows] * dx[rows]) / np.sqrt(length2[rows]) - base.radius
    above = above[rows]
    rows = np.flatnonzero(foot < cut_at[low[above] - 1])
    return above[rows], np.searchsorted(cut_at, foot[rows], side="right")


def _batches(net: _Net, batch: int) -> Iterator[tuple[int, int]]:
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


def _batch(mesh: Mesh, net: _Net, low: int, high: int, tolerance_mm: float) -> list[list[Curve]]:
    """Curves of the levels low .. high - 1."""
    edge, at, first = _spread(net.edge_low, net.edge_high, low, high)
    start, end, row, level = _pieces(net, low, high, edge, at, first)
    if isinstance(net.base, Plane):
        samples = _lines(net.base, _on_plane(net, edge, at), start // 2, end // 2)
    else:
        whole, its_level = _whole_circles(net, low, high)
        row, level = np.append(row, whole), np.append(level, its_level)
        start, end = (np.append(nodes, np.full(len(whole), -1)) for nodes in (start, end))
        nodes = _on_cylinder(net, edge, at) if len(edge) else np.zeros((1, 3))
        radius = net.base.radius + net.cut_at[level]
        samples = sample_arcs(net.base.axis_point, radius, mesh, net.number[row], start, end, nodes, tolerance_mm)
    return curves_by_level(start, end, level - low, high - low, samples)


def _spread(first: Ints | Ranks, after: Ints | Ranks, low: int, high: int) -> tuple[Ints, Ints, Ints]:
    """Pairs (row, level) of the levels first .. after - 1 of every row, as far as they lie in low .. high - 1.

    Returns:
        The rows and the levels of the pairs, row after row, and (n,) what to add to a level of a row to get the
        number of its pair.
    """
    rows = np.flatnonzero((first < after) & (first < high) & (after > low))
    begin = np.maximum(first[rows], low).astype(np.int64)
    count = np.minimum(after[rows], high) - begin
    total = np.cumsum(count)
    shift = np.zeros(len(first), dtype=np.int64)
    shift[rows] = total - count - begin
    row = np.repeat(rows, count)
    return row, np.arange(len(row)) - shift[row], shift


def _pieces(net: _Net, low: int, high: int, edge: Ints, at: Ints, shift: Ints) -> tuple[Ints, Ints, Ints, Ints]:
    """Pieces of curve in the triangles.

    Args:
        net: the triangles.
        low: first level.
        high: the level after the last.
        edge: (c,) edges of the crossings.
        at: (c,) their levels.
        shift: (e,) from an edge's levels to the numbers of its crossings.

    Returns:
        Of every piece the node it starts at (2 * crossing + root), that it ends at, its triangle and its level;
        by triangle, then level.
    """
    row, level, _ = _spread(net.face_low, net.face_high, low, high)
    special = net.dipped[row]
    if not special.any():
        return (*_simple(net, row, level, shift), row, level)
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
    return start, end, row[place], level[place]


def _simple(net: _Net, row: Ints, level: Ints, shift: Ints) -> tuple[Ints, Ints]:
    """Start and end nodes where a triangle's boundary crosses the level just twice, on two sides."""
    kind = np.zeros(len(row), dtype=np.int8)
    for k, corner in enumerate(columns_at(net.faces, row)):
        kind += (net.rank.take(corner) > level) * np.int8(1 << k)
    sides, row = net.sides.ravel(), 3 * row
    start, end = (2 * (shift.take(sides.take(row + table.take(kind))) + level) for table in (RETURNS, LEAVES))
    return start, end


def _on_plane(net: _Net, edge: Ints, at: Ints) -> Floats:
    """Where edges cross planes (c, 3)."""
    begin, end = columns_at(net.edges, edge)
    below, above = (net.height.take(ends) for ends in (begin, end))
    share = np.clip((below - net.cut_at.take(at)) / (below - above), 0.0, 1.0)
    nodes, way = columns_at(net.vertices, begin), columns_at(net.vertices, end)
    way -= nodes
    way *= share
    nodes += way
    return nodes.T


def _lines(plane: Plane, nodes: Floats, start: Ints, end: Ints) -> Samples:
    """Pieces on planes: straight lines from node to node, one point each."""
    u, v = plane.unrolled(nodes).T
    area = 0.5 * (u.take(start) * v.take(end) - v.take(start) * u.take(end))
    points = np.stack([column.take(start) for column in nodes.T]).T
    return Samples(points, np.arange(len(start) + 1), area, np.zeros(len(start)))


def _on_cylinder(net: _Net, edge: Ints, at: Ints) -> Floats:
    """Where edges cross cylinders (2 c, 3): twice each, the second unused where they cross once."""
    assert isinstance(net.base, Cylinder)
    begin, end = columns_at(net.edges, edge)
    origin = columns_at(net.vertices, begin)
    way = columns_at(net.vertices, end) - origin
    x, y = (origin[k] - net.base.axis_point[k] for k in (0, 1))
    # |origin + t way|² = r² in xy:  a t² + 2 b t + c = 0
    a = way[0] ** 2 + way[1] ** 2
    b = x * way[0] + y * way[1]
    radius, distance = net.base.radius + net.cut_at.take(at), net.height.take(begin) + net.base.radius
    c = (distance - radius) * (distance + radius)
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    q = -(b + np.copysign(root, b))  # the sum without cancellation; the other root by c / q
    with np.errstate(divide="ignore", invalid="ignore"):
        early, late = (np.nan_to_num(t, copy=False, posinf=1.0, neginf=0.0) for t in (q / a, c / q))
    early, late = np.minimum(early, late), np.maximum(early, late)
    leaving = (at >= net.single_low.take(edge)) & (net.rank.take(begin) <= at)  # from inside: at the later root
    nodes = np.empty((3, len(edge), 2))
    for root_no, share in enumerate((np.where(leaving, late, early), late)):
        share = np.clip(share, 0.0, 1.0)
        np.add(origin, share * way, out=nodes[:, :, root_no])
    return nodes.reshape(3, -1).T


def _whole_circles(net: _Net, low: int, high: int) -> tuple[Ints, Ints]:
    """Triangles that cylinders pierce without touching a side: the axis passes through them. And the levels."""
    assert isinstance(net.base, Cylinder)
    lowest = int(np.searchsorted(net.cut_at, -net.base.radius, side="right"))
    x, y = (net.vertices[:, k] > net.base.axis_point[k] for k in range(2))
    around = x + 2 * y.astype(np.int8)
    if int(np.bitwise_or.reduce(around, initial=0)) != 3 or int(np.bitwise_and.reduce(around, initial=3)) != 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)  # all of it lies beside the axis
    quarter = around[net.faces]
    either, both = (f(f(quarter[:, 0], quarter[:, 1]), quarter[:, 2]) for f in (np.bitwise_or, np.bitwise_and))
    # few triangles lie on both sides of the axis both ways
    rows = np.flatnonzero((either == 3) & (both == 0) & (net.face_low > max(low, lowest)))
    xy = net.vertices[net.faces[rows], :2] - net.base.axis_point
    a, b, c = xy[:, 0], xy[:, 1], xy[:, 2]
    turn = np.stack([_cross(a, b), _cross(b, c), _cross(c, a)])
    rows = rows[(turn > 0).all(axis=0) | (turn < 0).all(axis=0)]
    whole, level, _ = _spread(np.full(len(rows), lowest), net.face_low[rows].astype(np.int64), low, high)
    return rows[whole], level


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
