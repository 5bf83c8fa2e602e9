"""A few points that stand for many.

Use:

    farthest_points(np.array([[0.0], [1.0], [5.0], [9.0]]), 3)       # array([3, 0, 2])
"""

from __future__ import annotations

import numpy as np

from ik.chain import Floats

from .arrays import Ints


def farthest_points(points: Floats, count: int) -> Ints:
    """Points far from one another: the one farthest from the middle, then each the farthest from those before.

    Args:
        points: (n, k), n > 0.
        count: how many; all of them where there are fewer.

    Returns:
        Their numbers, in the order in which they are found.
    """
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    nearest = np.full(len(points), np.inf)
    while len(chosen) < min(count, len(points)):
        nearest = np.minimum(nearest, np.linalg.norm(points - points[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(nearest)))
    return np.array(chosen, dtype=np.int64)
