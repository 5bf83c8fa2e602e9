"""What is peculiar to levels that are cylinders: edges that cross twice, arcs of ellipses, whole circles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.face_measures import columns_at
from ..mesh.solid import Bools, Floats, Ints, Mesh
from ..surfaces.cylinders import Cylinder
from .crossing_net import CrossingNet, LevelPieces, Ranks, row_level_pairs
from .ellipse_arcs import Samples, sample_arcs


@dataclass(frozen=True)
class CylinderLevels:
    """Cylinders about one axis.

    Attributes:
        base: the one that heights are counted from.
    """

    base: Cylinder

    def dips(self, mesh: Mesh, net: CrossingNet) -> tuple[Ints, Ints]:
        """Edges that cross a level twice, both ends outside, and the first such level of each.

        Args:
            mesh: the solid.
            net: its triangles among the levels.
        """
        radii = mesh.bounding_spheres[1]
        widest = float((radii if len(net.number) == len(radii) else radii.take(net.number)).max(initial=0.0))
        close = _may_dip(self.base, net.height, net.rank, net.cut_at, widest)
        return _dips(self.base, net.vertices, net.edges, net.edge_low, net.cut_at, close)

    def sampled(
        self,
        mesh: Mesh,
        net: CrossingNet,
        levels: tuple[int, int],
        crossings: tuple[Ints, Ints],
        pieces: LevelPieces,
        tolerance_mm: float,
    ) -> tuple[LevelPieces, Samples]:
        """Pieces of some levels, whole circles as well, and points along them.

        Args:
            mesh: the solid.
            net: its triangles among the levels.
            levels: the first of those that are examined, and the one after the last.
            crossings: edges (c,) and the levels (c,) at which they cross.
            pieces: between the crossings.
            tolerance_mm: greatest distance between the exact curve and the chord of two successive points.
        """
        row, level = _whole_circles(self.base, net, *levels)
        row, level = np.append(pieces.row, row), np.append(pieces.level, level)
        start, end = (np.append(nodes, np.full(len(row) - len(nodes), -1)) for nodes in (pieces.start, pieces.end))
        nodes = _on_cylinder(self.base, net, *crossings) if len(crossings[0]) else np.zeros((1, 3))
        radius = self.base.radius + net.cut_at[level]
        samples = sample_arcs(self.base.axis_point, radius, mesh, net.number[row], start, end, nodes, tolerance_mm)
        return LevelPieces(start, end, row, level), samples


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


def _on_cylinder(base: Cylinder, net: CrossingNet, edge: Ints, at: Ints) -> Floats:
    """Where edges cross cylinders (2 c, 3): twice each, the second unused where they cross once."""
    begin, end = columns_at(net.edges, edge)
    origin = columns_at(net.vertices, begin)
    way = columns_at(net.vertices, end) - origin
    x, y = (origin[k] - base.axis_point[k] for k in (0, 1))
    # |origin + t way|² = r² in xy:  a t² + 2 b t + c = 0
    a = way[0] ** 2 + way[1] ** 2
    b = x * way[0] + y * way[1]
    radius, distance = base.radius + net.cut_at.take(at), net.height.take(begin) + base.radius
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


def _whole_circles(base: Cylinder, net: CrossingNet, low: int, high: int) -> tuple[Ints, Ints]:
    """Triangles that cylinders pierce without touching a side: the axis passes through them. And the levels."""
    lowest = int(np.searchsorted(net.cut_at, -base.radius, side="right"))
    x, y = (net.vertices[:, k] > base.axis_point[k] for k in range(2))
    around = x + 2 * y.astype(np.int8)
    if int(np.bitwise_or.reduce(around, initial=0)) != 3 or int(np.bitwise_and.reduce(around, initial=3)) != 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)  # all of it lies beside the axis
    quarter = around[net.faces]
    either, both = (f(f(quarter[:, 0], quarter[:, 1]), quarter[:, 2]) for f in (np.bitwise_or, np.bitwise_and))
    # few triangles lie on both sides of the axis both ways
    rows = np.flatnonzero((either == 3) & (both == 0) & (net.face_low > max(low, lowest)))
    xy = net.vertices[net.faces[rows], :2] - base.axis_point
    a, b, c = xy[:, 0], xy[:, 1], xy[:, 2]
    turn = np.stack([_cross(a, b), _cross(b, c), _cross(c, a)])
    rows = rows[(turn > 0).all(axis=0) | (turn < 0).all(axis=0)]
    whole, level, _ = row_level_pairs(np.full(len(rows), lowest), net.face_low[rows].astype(np.int64), low, high)
    return rows[whole], level


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
