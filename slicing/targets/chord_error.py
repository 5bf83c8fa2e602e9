"""Greatest distance of a polyline from a segment between two of its points.

Use:

    error(line[3:26])                            # greatest distance of the points between from the segment 3 - 25
    errors_through(line, 0, middles, 40)         # of going from 0 to 40 by way of each of some points between
"""

from __future__ import annotations

import numpy as np

from ..mesh.solid import Floats, Ints


def error(line: Floats) -> float:
    """Greatest distance of a line (n, 3) from the segment between its ends."""
    if len(line) <= 2:
        return 0.0
    between, a = line[1:-1] - line[0], line[-1] - line[0]
    length2 = float(a @ a)
    t = np.clip(between @ a / length2, 0.0, 1.0) if length2 > 0 else np.zeros(len(between))
    off = between - t[:, None] * a
    return float(np.sqrt((off * off).sum(axis=1).max()))


def errors_through(line: Floats, i: int, middles: Ints, j: int) -> Floats:
    """Greater of the two errors (k,) of going from i to j by way of each of some points (k,) between them.

    As exact as rounding, but not to the last bit what `error` gives.
    """
    inner = line[i + 1 : j]
    number = np.arange(i + 1, j)
    worst = np.zeros(len(middles))
    for start, before in ((i, True), (j, False)):
        a = (line[middles] - line[start]).T
        off = inner - line[start]
        dots, length2 = off @ a, (a * a).sum(axis=0)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.clip(np.where(length2 > 0, dots / length2, 0.0), 0.0, 1.0)
        off2 = (off * off).sum(axis=1)[:, None] - t * (2.0 * dots - t * length2)
        off2 *= (number[:, None] < middles) if before else (number[:, None] > middles)
        worst = np.maximum(worst, off2.max(axis=0))
    return np.sqrt(np.maximum(worst, 0.0))
