"""Which crossings of a surface with the sides of faces belong together: by their order, not by distance.

    pieces = pair(sides, forward, count, outside)

Walking round a convex face one leaves the surface's inside at one node and comes back at the next; the piece of
curve between these two lies in the face, because the inside is convex as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.solid import Bools, Ints


@dataclass(frozen=True, eq=False)
class CurvePieces:
    """Directed pieces of curve, one a row: from one node to another within one face."""

    start: Ints  # node: 2 * edge + root; -1 for a whole circle
    end: Ints
    face: Ints


def pair(sides: Ints, forward: Bools, count: Ints, outside: Bools) -> CurvePieces:
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
    return CurvePieces(node[following[leaves]], node[leaves], rows[leaves])
