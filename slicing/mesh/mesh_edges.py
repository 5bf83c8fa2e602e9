"""The edges of a triangle mesh: one sort, everything else by counting.

Use:

    edges, of_side = edges_of_faces(len(vertices), faces)
    found = Edges.of(len(vertices), faces)
    found.is_surface, found.count, found.balance
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Ints


def _sorted_sides(n: int, faces: Ints) -> tuple[Ints, Ints]:
    """Sides of faces (3 f + k), those of one edge beside each other, and their edges' keys, ascending."""
    flat = faces.ravel()
    after = faces[:, [1, 2, 0]].ravel()
    keys = np.minimum(flat, after) * n + np.maximum(flat, after)
    bits = len(keys).bit_length()
    if int(n * n).bit_length() + bits < 63:  # sorting numbers is several times faster than sorting places
        packed = (keys << bits) | np.arange(len(keys))
        packed.sort()
        return packed & ((1 << bits) - 1), packed >> bits
    order = np.argsort(keys, kind="stable")
    return order, keys[order]


def edges_of_faces(n: int, faces: Ints) -> tuple[Ints, Ints]:
    """Edges of a mesh.

    Args:
        n: how many vertices there are.
        faces: (m, 3) vertex indices.

    Returns:
        Undirected edges (e, 2), lower vertex first, ascending; and the (m, 3) edge of each face's k-th side.
    """
    order, keys = _sorted_sides(n, faces)
    new = np.append(True, keys[1:] != keys[:-1])
    of_side = np.empty(len(keys), dtype=np.int64)
    of_side[order] = np.cumsum(new) - 1
    keys = keys[new]
    lower = keys // n
    return np.stack([lower, keys - lower * n], axis=1), of_side.reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class MeshEdges:
    """The edges of triangles, each once.

    Attributes:
        side: (3 m,) sides of the faces (3 f + k), sorted by their edge.
        first: (e,) where each edge's sides begin in `side`.
        count: (e,) how many sides an edge has.
        balance: (e,) how many more of them run one way than the other.
    """

    side: Ints
    first: Ints
    count: Ints
    balance: Ints

    @classmethod
    def of(cls, n: int, faces: Ints) -> MeshEdges:
        """Edges of faces (m, 3) on n vertices."""
        side, keys = _sorted_sides(n, faces)
        first = np.flatnonzero(np.append(True, keys[1:] != keys[:-1])) if len(keys) else np.zeros(0, dtype=np.int64)
        sense = np.where(faces.ravel() < faces[:, [1, 2, 0]].ravel(), 1, -1)[side]
        count = np.diff(np.append(first, len(keys)))
        balance = np.add.reduceat(sense, first) if len(first) else np.zeros(0, dtype=np.int64)
        return cls(side, first, count, balance)

    @property
    def is_closed(self) -> bool:
        """Whether every edge has an even number of sides."""
        return not (self.count % 2).any()

    @property
    def is_surface(self) -> bool:
        """Whether every edge has two sides that run opposite ways."""
        return bool((self.count == 2).all() and (self.balance == 0).all())

    def pairs(self) -> Ints:
        """(k, 2) sides of the edges that have exactly two."""
        at = self.first[self.count == 2]
        return np.stack([self.side[at], self.side[at + 1]], axis=1)

    def odd_sides(self) -> Ints:
        """Sides of the edges that have an odd number of them."""
        return self.side[np.repeat(self.count % 2 == 1, self.count)]


def neighbours(count: int, faces: Ints) -> tuple[Ints, Ints]:
    """Numbers (e,), (e,) of the faces on either side of each edge that has two.

    Args:
        count: of vertices.
        faces: (m, 3).

    Returns:
        The one, and the other.
    """
    side = edges_of_faces(count, faces)[1].ravel()
    order = np.argsort(side, kind="stable")
    first = np.flatnonzero(np.append(True, np.diff(side[order]) > 0))
    first = first[np.diff(np.append(first, len(order))) == 2]
    return order[first] // 3, order[first + 1] // 3
