"""What is peculiar to levels that are planes: crossings of edges by a linear equation, and straight pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.face_measures import columns_at
from ..mesh.solid import Floats, Ints, Mesh
from ..surfaces.planes import Plane
from .crossing_net import CrossingNet, LevelPieces
from .ellipse_arcs import Samples


@dataclass(frozen=True)
class PlaneLevels:
    """Parallel planes.

    Attributes:
        base: the one that heights are counted from.
    """

    base: Plane

    def dips(self, mesh: Mesh, net: CrossingNet) -> tuple[Ints, Ints]:
        """Edges that cross a level twice: none."""
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)

    def sampled(
        self,
        mesh: Mesh,
        net: CrossingNet,
        levels: tuple[int, int],
        crossings: tuple[Ints, Ints],
        pieces: LevelPieces,
        tolerance_mm: float,
    ) -> tuple[LevelPieces, Samples]:
        """Pieces of some levels, as they are, and points along them: straight from node to node, one point each.

        Args:
            mesh: the solid.
            net: its triangles among the levels.
            levels: the first of those that are examined, and the one after the last.
            crossings: edges (c,) and the levels (c,) at which they cross.
            pieces: between the crossings.
            tolerance_mm: it does not matter: lines are straight.
        """
        return pieces, _lines(self.base, _on_plane(net, *crossings), pieces.start // 2, pieces.end // 2)


def _on_plane(net: CrossingNet, edge: Ints, at: Ints) -> Floats:
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
