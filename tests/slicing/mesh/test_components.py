"""Components of a graph: as SciPy numbers them, and by what they mean."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slicing.mesh.components import components


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 40), st.integers(0, 60), st.integers(0, 2**32 - 1), st.booleans())
def test_components_are_what_edges_join_numbered_by_their_least_nodes(
    nodes: int, edges: int, seed: int, large: bool
) -> None:
    one, other = np.random.default_rng(seed).integers(0, nodes, (2, edges))
    count, label = components(nodes, one, other, large=0 if large else 10**9)
    joined = np.eye(nodes, dtype=bool)
    joined[one, other] = joined[other, one] = True
    for _ in range(nodes):  # until all that is joined at all is joined at once
        joined = joined @ joined
    least = joined.argmax(axis=1)
    assert (label == np.unique(least, return_inverse=True)[1]).all()
    assert count == len(np.unique(least))


@pytest.mark.parametrize("nodes", [2, 1000])
def test_a_chain_in_any_order_is_one(nodes: int) -> None:
    order = np.random.default_rng(nodes).permutation(nodes)
    count, label = components(nodes, order[:-1], order[1:])
    assert count == 1
    assert not label.any()
