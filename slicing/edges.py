"""The edges of a triangle mesh: one sort, everything else by counting.

edges, of_side = edge_table(len(vertices), faces)
unpaired, unbalanced = open_edges(len(vertices), faces)
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]


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


def edge_table(n: int, faces: Ints) -> tuple[Ints, Ints]:
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


def open_edges(n: int, faces: Ints) -> tuple[int, int]:
    """How many edges lack a partner altogether, and how many have one that runs the same way.

    Args:
        n: how many vertices there are.
        faces: (m, 3) vertex indices.
    """
    order, keys = _sorted_sides(n, faces)
    first = np.flatnonzero(np.append(True, keys[1:] != keys[:-1]))
    up = np.where(faces.ravel() < faces[:, [1, 2, 0]].ravel(), 1, -1)
    count = np.diff(np.append(first, len(keys)))
    return int((count % 2 == 1).sum()), int((np.add.reduceat(up[order], first) != 0).sum())
