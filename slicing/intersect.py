"""Exact curves in which a closed triangle mesh meets a plane, a cylinder or another surface of revolution.

A triangle meets a cylinder in arcs of an ellipse, so a boss of twelve triangles must give the same curve as
one of a hundred thousand. Nothing here depends on how fine the mesh is:

    curves = intersect(mesh, Cylinder((0.0, 0.0), 21.73), tolerance_mm=0.01)

How it works. Every vertex is inside or outside the surface; every edge is solved once (a line for a plane, a
quadratic for a cylinder: it can cross twice) and its crossings are *nodes*, named (edge, which root). Walking
round a triangle one leaves the surface's inside at one node and comes back at the next: the piece of curve
between these two lies in the triangle, because both the triangle and the inside are convex. That pairing is a
matter of names and order, not of distances, so neighbours always agree and the pieces chain into closed
loops. A triangle that the whole circle falls into holds a loop without any node. A piece on a cylinder is an
arc of an ellipse parametrised by the angle about the axis, or a ruling where the triangle is vertical. Cones and
other surfaces of revolution are taken band by band in the same way: see `slicing.revolve`.

A value of zero counts as inside: the surface is nudged outward by 1e-7 mm, or just past vertices that lie on
it to within the mesh's rounding. So a root cap whose vertices lie on the body is wholly below layer 0, whose
curve is then the footprint, and a flat face lying in a plane gives neither a double nor a broken loop. Pieces
run with the solid on their left seen from outside the surface: outer loops counter-clockwise, holes
clockwise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slicing.arcs import Samples, sample_arcs, sample_lines
from slicing.part import Bools, Floats, Ints, Mesh
from slicing.surfaces import Cone, Cylinder, Plane, Revolved, Surface

NUDGE_MM = 1e-7  # zero counts as inside
SAME_POINT_MM = 1e-5  # points of a loop closer than this are one


@dataclass(frozen=True, eq=False)
class Curve:
    """A curve on a layer's surface, sampled on the exact curve.

    Attributes:
        points: (n, 3) mm, part frame; a closed curve does not repeat its first point.
        closed: the last point is joined to the first.
        hole: the curve bounds a hole (it runs clockwise seen from outside).
        area_mm2: signed area to the left of the curve on its surface, exact (not that of the polyline). For a
            loop that winds round the axis: minus the integral of z along the arc length, so that sums over a
            layer still hold.
        winding: turns about the axis of its surface (0 but for rings).
    """

    points: Floats
    closed: bool
    hole: bool
    area_mm2: float = 0.0
    winding: int = 0

    @property
    def length_mm(self) -> float:
        """Length of the polyline, mm."""
        ends = np.roll(self.points, -1, axis=0) if self.closed else self.points[1:]
        steps = ends - self.points[: len(ends)]
        return float(np.sqrt((steps**2).sum(axis=1)).sum())


@dataclass(frozen=True, eq=False)
class Pieces:
    """Directed pieces of curve, one a row: from one node to another within one face."""

    start: Ints  # node: 2 * edge + root; -1 for a whole circle
    end: Ints
    face: Ints


def intersect(
    mesh: Mesh,
    surface: Surface,
    tolerance_mm: float = 0.01,
    facing: Floats | None = None,
    nudge_mm: float = NUDGE_MM,
    faces: Ints | None = None,
) -> list[Curve]:
    """Curves in which a closed mesh meets a surface.

    Args:
        mesh: the solid, part frame, mm.
        surface: where to cut. Points of the result lie within nudge_mm (or the mesh's rounding) outside of
            it.
        tolerance_mm: greatest distance between the exact curve and the chord of two successive points.
        facing: unit (2,) direction in xy: loops of a round surface wholly on the other side of its axis are
            left out.
        nudge_mm: how far outside the surface the cut is really made.
        faces: (k,) numbers of the triangles to look at; all whose extent reaches the surface when not given.

    Returns:
        Closed curves, outer loops counter-clockwise seen from outside, holes clockwise; empty if there are
        none.
    """
    if faces is None:
        centres, radii = mesh.bounding_spheres
        faces = np.flatnonzero(np.abs(surface.distance(centres)) <= radii + nudge_mm + 1e-5)
    if len(faces) == 0:
        return []
    edges, edge_of_side = mesh.edge_table
    used, sides = np.unique(edge_of_side[faces], return_inverse=True)
    sides = sides.reshape(-1, 3)
    corners = edges[used]
    near, corner_numbers = np.unique(corners, return_inverse=True)
    corner_numbers = corner_numbers.reshape(-1, 2)
    surface = surface.offset(_nudge(surface.distance(mesh.vertices[near]), nudge_mm, mesh.noise_mm))
    if isinstance(surface, Cone | Revolved):
        from slicing.revolve import round_curves  # it builds on this module

        return _facing(round_curves(mesh, faces, surface, tolerance_mm), surface, facing)
    outside = surface.distance(mesh.vertices[near]) > 0.0
    roots, count = _edge_roots(surface, mesh.vertices[corners], outside[corner_numbers])
    nodes = mesh.vertices[corners][:, :1] + roots[:, :, None] * np.diff(mesh.vertices[corners], axis=1)
    # whether each side of a face runs along its edge (lower vertex first) or against it
    forward = mesh.faces[faces] == corners[sides][:, :, 0]
    pieces = pair(sides, forward, count, outside[corner_numbers])
    whole = _whole_circles(surface, mesh, faces, sides, count, outside[corner_numbers])
    pieces = Pieces(
        np.append(pieces.start, np.full(len(whole), -1)),
        np.append(pieces.end, np.full(len(whole), -1)),
        np.append(pieces.face, whole),
    )
    if len(pieces.start) == 0:
        return []
    curves = _assemble(mesh, surface, faces, pieces, nodes.reshape(-1, 3), tolerance_mm)
    return _facing(curves, surface, facing)


def _facing(curves: list[Curve], surface: Surface, facing: Floats | None) -> list[Curve]:
    """The curves that are not wholly on the side of the axis away from a direction."""
    if facing is None or isinstance(surface, Plane):
        return curves
    return [c for c in curves if ((c.points[:, :2] - surface.axis_point) @ facing > 0).any()]


def _nudge(heights: Floats, nudge_mm: float, noise_mm: float) -> float:
    """How far outward to cut: just past the vertices that lie on the surface to within the rounding."""
    touching = heights[(heights > 0.0) & (heights <= noise_mm)]
    return max(nudge_mm, float(touching.max()) + NUDGE_MM) if len(touching) else nudge_mm


def _edge_roots(surface: Surface, ends: Floats, outside: Bools) -> tuple[Floats, Ints]:
    """Where edges cross the surface.

    Args:
        surface: the surface.
        ends: (e, 2, 3) ends of the edges.
        outside: (e, 2) which ends lie outside. The number of roots follows from these, never from rounding.

    Returns:
        (e, 2) parameters in [0, 1] (the second unused where there is one root), and (e,) how many: 0, 1 or 2.
    """
    roots = np.zeros((len(ends), 2))
    count = (outside[:, 0] != outside[:, 1]).astype(np.int64)
    if not isinstance(surface, Cylinder):
        heights = surface.distance(ends.reshape(-1, 3)).reshape(-1, 2)
        cut = count == 1
        roots[cut, 0] = np.clip(heights[cut, 0] / (heights[cut, 0] - heights[cut, 1]), 0.0, 1.0)
        return roots, count
    origin = ends[:, 0, :2] - surface.axis_point
    along = ends[:, 1, :2] - ends[:, 0, :2]
    # |origin + t along|² = r²:  a t² + 2 b t + c = 0
    a = (along**2).sum(axis=1)
    b = (origin * along).sum(axis=1)
    distance = np.hypot(origin[:, 0], origin[:, 1])
    c = (distance - surface.radius) * (distance + surface.radius)
    d = b * b - a * c
    # both ends outside: twice, if the foot of the perpendicular falls within the edge and inside the cylinder
    count[outside.all(axis=1) & (d > 0) & (b < 0) & (b + a > 0)] = 2
    cut = count > 0
    a, b, c, outgoing = a[cut], b[cut], c[cut], ~outside[cut, 0]
    root = np.sqrt(np.maximum(d[cut], 0.0))
    q = -(b + np.where(b >= 0, root, -root))  # the sum without cancellation; the other root by c / q
    with np.errstate(divide="ignore", invalid="ignore"):
        pair = np.sort(np.nan_to_num(np.stack([q / a, c / q], axis=1), posinf=1.0, neginf=0.0), axis=1)
    first = np.where((count[cut] == 1) & outgoing, pair[:, 1], pair[:, 0])  # leaving the inside: the later root
    roots[cut] = np.clip(np.stack([first, pair[:, 1]], axis=1), 0.0, 1.0)
    return roots, count


def pair(sides: Ints, forward: Bools, count: Ints, outside: Bools) -> Pieces:
    """Pieces of curve between nodes, face by face, from the order of crossings along its boundary.

    Args:
        sides: (k, s) edge of each side of each (convex) face; -1 for none.
        forward: (k, s) the side runs along its edge, not against it.
        count: (e,) roots of each edge.
        outside: (e, 2) which ends of the edges lie outside.

    Returns:
        Pieces from the node where a face's boundary comes back inside to the node where it left, which is the
        direction that has the solid on the left; `face` counts rows of `sides`.
    """
    n = np.where(sides >= 0, count[sides], 0)
    slots = np.full((len(sides), 2 * sides.shape[1]), -1, dtype=np.int64)
    leaving = np.zeros(slots.shape, dtype=bool)
    start_outside = np.where(forward, outside[sides, 0], outside[sides, 1])
    for k in range(sides.shape[1]):
        edge, once, twice = sides[:, k], n[:, k] == 1, n[:, k] == 2
        slots[:, 2 * k] = np.where(once | (twice & forward[:, k]), 2 * edge, np.where(twice, 2 * edge + 1, -1))
        slots[:, 2 * k + 1] = np.where(twice, np.where(forward[:, k], 2 * edge + 1, 2 * edge), -1)
        leaving[:, 2 * k] = once & ~start_outside[:, k]  # an edge crossed twice comes in first, then leaves
        leaving[:, 2 * k + 1] = twice
    rows, columns = np.nonzero(slots >= 0)
    node, leaves = slots[rows, columns], leaving[rows, columns]
    events = np.bincount(rows, minlength=len(sides))
    first = np.cumsum(events) - events
    place = np.arange(len(rows)) - first[rows]
    following = first[rows] + (place + 1) % np.maximum(events[rows], 1)
    return Pieces(node[following[leaves]], node[leaves], rows[leaves])


def _whole_circles(surface: Surface, mesh: Mesh, faces: Ints, sides: Ints, count: Ints, outside: Bools) -> Ints:
    """Rows of faces that the cylinder pierces without touching an edge."""
    if not isinstance(surface, Cylinder):
        return np.zeros(0, dtype=np.int64)
    rows = np.flatnonzero((count[sides] == 0).all(axis=1) & outside[sides].all(axis=(1, 2)))
    if len(rows) == 0:
        return rows
    xy = mesh.vertices[mesh.faces[faces[rows]], :2] - surface.axis_point
    turn = np.stack([_cross(xy[:, k], xy[:, (k + 1) % 3]) for k in range(3)], axis=1)
    return rows[(turn > 0).all(axis=1) | (turn < 0).all(axis=1)]


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _assemble(
    mesh: Mesh, surface: Surface, faces: Ints, pieces: Pieces, nodes: Floats, tolerance_mm: float
) -> list[Curve]:
    """Chain the pieces and sample them."""
    if isinstance(surface, Cylinder):
        normals = mesh.normals[faces[pieces.face]]
        corners = mesh.vertices[mesh.faces[faces[pieces.face]]]
        samples = sample_arcs(surface, normals, corners, pieces.start, pieces.end, nodes, tolerance_mm)
    else:
        assert isinstance(surface, Plane)
        samples = sample_lines(surface, pieces.start, pieces.end, nodes)
    return assembled(pieces.start, pieces.end, samples)


def assembled(start: Ints, end: Ints, samples: Samples) -> list[Curve]:
    """Curves of pieces that follow one another.

    Args:
        start: (p,) node each piece starts at, as `chain` takes it.
        end: (p,) node each piece ends at.
        samples: points along the pieces.

    Returns:
        Closed curves; loops smaller than the rounding are dropped.
    """
    curves = []
    for loop in chain(start, end):
        points = np.concatenate([samples.points[samples.first[p] : samples.first[p + 1]] for p in loop])
        points = _distinct(points)
        if len(points) < 3:
            continue  # smaller than the rounding: not a curve
        area = float(samples.area[loop].sum())
        winding = round(float(samples.turn[loop].sum()) / (2 * np.pi))
        curves.append(Curve(points, True, winding == 0 and area < 0, area, winding))
    return curves


def chain(start: Ints, end: Ints) -> list[Ints]:
    """Loops of pieces: each piece is followed by the one that starts where it ends.

    Args:
        start: (p,) node each piece starts at; -1 for a piece that is a loop by itself.
        end: (p,) node each piece ends at. Every node is the start of as many pieces as it is the end of.

    Returns:
        One array of piece numbers a loop.
    """
    by_start, by_end = np.argsort(start, kind="stable"), np.argsort(end, kind="stable")
    if not (start[by_start] == end[by_end]).all():
        raise AssertionError("pieces do not close: the mesh is not closed")
    following = np.empty(len(start), dtype=np.int64)
    following[by_end] = by_start
    alone = start < 0
    following[alone] = np.flatnonzero(alone)
    after, seen, loops = following.tolist(), [False] * len(start), []
    for begin in range(len(start)):
        if seen[begin]:
            continue
        loop, piece = [], begin
        while not seen[piece]:
            seen[piece] = True
            loop.append(piece)
            piece = after[piece]
        loops.append(np.array(loop, dtype=np.int64))
    return loops


def _distinct(points: Floats) -> Floats:
    """Drop points that repeat their predecessor (crossings at a vertex)."""
    step = points - np.roll(points, 1, axis=0)
    return points[(step**2).sum(axis=1) > SAME_POINT_MM**2]
