"""The order of layers: the shortest turns, and no layer before those that it would lock out."""

from __future__ import annotations

from itertools import pairwise, permutations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.table_poses.layer_order import NEVER, shortest_order

FREE = np.full((4, 3), NEVER)


def needs(*entries: tuple[int, int, int, int], layers: int = 4, count: int = 3) -> list[np.ndarray]:
    """Entries (b, m, a, k): layer m of b comes before layer k of a."""
    out = [np.full((layers, count), NEVER) for _ in range(count)]
    for b, m, a, k in entries:
        out[b][m, a] = k
    return out


def holds(runs: list[tuple[int, int, int]], wanted: list[np.ndarray]) -> bool:
    """Whether an order lays every layer once and in turn, and none before one that has to come first."""
    laid = [0] * len(wanted)
    for a, first, last in runs:
        if first != laid[a] or last < first:
            return False
        for layer in range(first, last + 1):
            for b, need in enumerate(wanted):
                if b != a and (need[laid[b] :, a] <= layer).any():
                    return False
            laid[a] = layer + 1
    return laid == [len(need) for need in wanted]


def test_without_locks_the_order_turns_least() -> None:
    place = np.array([0.0, 5.0, 1.0, 3.0])
    seconds = np.abs(place[:, None] - place)
    runs = shortest_order([4] * 4, seconds, [np.full((4, 4), NEVER)] * 4)
    assert runs is not None
    assert [run[1:] for run in runs] == [(0, 3)] * 4
    cost = sum(seconds[a[0], b[0]] for a, b in pairwise(runs))
    assert cost == min(sum(seconds[a, b] for a, b in pairwise(p)) for p in permutations(range(4)))


def test_neighbours_that_lock_each_other_out_grow_together() -> None:
    # layers 0 and 1 of each have to be there before layer 2 of the other
    wanted = needs((0, 0, 1, 2), (0, 1, 1, 2), (1, 0, 0, 2), (1, 1, 0, 2), count=2)
    runs = shortest_order([4, 4], np.ones((2, 2)), wanted)
    assert runs == [(0, 0, 1), (1, 0, 3), (0, 2, 3)]
    assert holds(runs, wanted)


def test_what_locks_out_in_any_order_has_none() -> None:
    wanted = needs((0, 0, 1, 0), (1, 0, 0, 0), count=2)
    assert shortest_order([4, 4], np.ones((2, 2)), wanted) is None


def test_the_body_comes_first() -> None:
    runs = shortest_order([4] * 3, np.ones((3, 3)), [FREE] * 3, fixed=1)
    assert runs is not None
    assert runs[0] == (0, 0, 3)


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_every_order_found_keeps_what_is_asked_for(data: st.DataObject) -> None:
    count, layers = data.draw(st.integers(1, 4)), data.draw(st.integers(1, 4))
    entry = st.tuples(*(st.integers(0, n - 1) for n in (count, layers, count, layers)))
    wanted = needs(*data.draw(st.lists(entry, max_size=6)), layers=layers, count=count)
    runs = shortest_order([layers] * count, np.ones((count, count)), wanted)
    assert runs is None or holds(runs, wanted)
