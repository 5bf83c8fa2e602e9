"""Connected components of a graph, as `scipy.sparse.csgraph` numbers them, without importing it for a small one.

    count, label = components(4, np.array([0, 3]), np.array([2, 1]))
    count, label.tolist()                     # 2, [0, 1, 0, 1]

Importing SciPy's graphs takes as long as slicing a small part; on a large graph they are faster than arrays are.
"""

from __future__ import annotations

import numpy as np

from .solid import Ints

MANY_EDGES = 200_000  # edges


def components(nodes: int, one: Ints, other: Ints, large: int = MANY_EDGES) -> tuple[int, Ints]:
    """The components of an undirected graph.

    Args:
        nodes: how many nodes there are.
        one: (e,) node at one end of each edge.
        other: (e,) node at its other end.
        large: edges above which SciPy is asked.

    Returns:
        How many components there are, and the component of each node (nodes,), numbered by their least nodes.
    """
    if len(one) > large:
        return _by_scipy(nodes, one, other)
    least: Ints = np.arange(nodes)  # a node of the same component that is no greater
    while True:
        a, b = least[one], least[other]
        low, high = np.minimum(a, b), np.maximum(a, b)
        if (low == high).all():
            break
        np.minimum.at(least, high, low)
        while (further := least[least]).tobytes() != least.tobytes():
            least = further
    found, label = np.unique(least, return_inverse=True)
    return len(found), label.astype(np.int64)


def _by_scipy(nodes: int, one: Ints, other: Ints) -> tuple[int, Ints]:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(one), dtype=bool), (one, other)), shape=(nodes, nodes))
    count, label = connected_components(graph, directed=False)
    return int(count), label.astype(np.int64)
