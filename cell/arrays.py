"""Types of arrays, places counted through, and rows that are alike.

Use:

    def rows(index: Ints) -> Floats: ...
    which, place = repeat_with_index(np.array([2, 0, 3]))    # [0, 0, 2, 2, 2], [0, 1, 0, 1, 2]
    first, of = distinct(np.array([7, 3, 7]), np.array([1.0, 2.0, 1.0]))     # [1, 0], [1, 0, 1]
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


def repeat_with_index(counts: Ints) -> tuple[Ints, Ints]:
    """Repeat every i counts[i] times; and beside it count 0, 1, 2, .. within each i."""
    which = np.repeat(np.arange(len(counts)), counts)
    return which, np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)


def distinct(*columns: NDArray[Any]) -> tuple[Ints, Ints]:
    """Rows that differ, sorted by the first column, then the next: as ``np.unique`` of rows, which takes far longer.

    Args:
        columns: numbers, (m,) each; one column at least.

    Returns:
        The first of all rows that are alike, (k,), and for every row which of these it is like, (m,).
    """
    order = np.lexsort(columns[::-1])
    new = np.zeros(len(order), dtype=bool)
    new[:1] = True
    for column in columns:
        new[1:] |= np.diff(column[order]) != 0
    of = np.empty(len(order), dtype=np.int64)
    of[order] = np.cumsum(new) - 1
    return order[new], of
