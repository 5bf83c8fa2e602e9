"""Types of arrays, and places counted through.

Use:

    def rows(index: Ints) -> Floats: ...
    which, place = counted(np.array([2, 0, 3]))    # [0, 0, 2, 2, 2], [0, 1, 0, 1, 2]
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


def counted(counts: Ints) -> tuple[Ints, Ints]:
    """Every i as often as counts[i] says, and beside it 0, 1, 2, .. within each."""
    which = np.repeat(np.arange(len(counts)), counts)
    return which, np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
