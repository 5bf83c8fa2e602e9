"""Rows that differ are those that numpy finds, in its order."""

import numpy as np
import pytest

from cell.arrays import distinct, repeat_with_index


@pytest.mark.parametrize("seed", range(20))
def test_rows_that_differ_are_those_that_numpy_finds(seed):
    rng = np.random.default_rng(seed)
    m = int(rng.integers(0, 60))
    table = rng.integers(0, 4, (m, int(rng.integers(1, 4)))) * rng.choice([1, 0.3])
    table = np.column_stack([rng.integers(0, 3, m), table])
    first, of = distinct(*table.T)
    every, wanted_first, wanted_of = np.unique(table, axis=0, return_index=True, return_inverse=True)
    np.testing.assert_array_equal(table[first], every)
    np.testing.assert_array_equal(first, wanted_first)
    np.testing.assert_array_equal(of, wanted_of.reshape(-1))


def test_places_are_counted_through():
    which, place = repeat_with_index(np.array([2, 0, 3]))
    assert which.tolist() == [0, 0, 2, 2, 2]
    assert place.tolist() == [0, 1, 0, 1, 2]
