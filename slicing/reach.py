"""How far segments may reach along a polyline before it strays from them: many candidates looked at at once.

    reach = Reach(line, tolerance_mm=0.3)
    reach.error(0, 25)             # greatest distance of points 1 .. 24 from the segment 0 - 25
    reach.farthest(0, end=80)      # a last point that the segment from point 0 may have

Distances of all points of a window from the segments to all points of the window follow from one product of
matrices. What it gives is as exact as rounding allows, but not to the last bit what `error` gives: wherever that could
decide, `error` does.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from slicing.part import Floats, Ints

WINDOW = 128  # points beyond which single segments are looked at: a table grows with the square
SLACK, ROUNDING = 1e-9, 1e-14  # of the squared tolerance, of the squared size: nearer than this `error` decides


@cache
def _asked(size: int) -> tuple[Ints, list[int], Floats]:
    """What doubling up to a size (a power of two), then halving may ask: which of the next points, from 0.

    Also where among them each of the size points is found (-1: not there), and (size, k) 1 where a point lies before
    the one that was asked for.
    """
    doubled = [2**k for k in range(1, size.bit_length() - 2)]
    numbers = np.array([*doubled, *range(max(size // 2, 1), size + 1)], dtype=np.int64) - 1
    where = np.full(size, -1)
    where[numbers] = np.arange(len(numbers))
    return numbers, where.tolist(), (np.arange(size)[:, None] < numbers).astype(np.float64)


class Reach:
    """Segments between points of one polyline.

    Attributes:
        line: (n, 3) mm.
        tolerance_mm: how far the line may stray from a segment.
    """

    def __init__(self, line: Floats, tolerance_mm: float) -> None:
        self.line, self.tolerance_mm = line, tolerance_mm
        slack2 = SLACK * tolerance_mm**2 + ROUNDING * float((np.ptp(line, axis=0) ** 2).sum())
        self._sure2 = (tolerance_mm**2 - slack2, tolerance_mm**2 + slack2)
        self._begin = -1  # of the table
        self._where: list[int] = []
        self._errors2: list[float] = []
        self._usual = 16  # how large a table was needed last

    def error(self, i: int, j: int) -> float:
        """Greatest distance of the line from i to j from the segment between them."""
        if j <= i + 1:
            return 0.0
        between, a = self.line[i + 1 : j] - self.line[i], self.line[j] - self.line[i]
        length2 = float(a @ a)
        t = np.clip(between @ a / length2, 0.0, 1.0) if length2 > 0 else np.zeros(len(between))
        off = between - t[:, None] * a
        return float(np.sqrt((off * off).sum(axis=1).max()))

    def farthest(self, i: int, end: int) -> int:
        """A last point that the segment from i may reach: doubling, then halving."""
        with np.errstate(divide="ignore", invalid="ignore"):
            good, reach = i + 1, 2
            while i + reach < end and self._within(i, i + reach):
                good, reach = i + reach, 2 * reach
            bad = min(i + reach, end)
            self._usual = reach
            if bad == end and self._within(i, end):
                return end
            while bad - good > 1:
                middle = (good + bad) // 2
                if self._within(i, middle):
                    good = middle
                else:
                    bad = middle
        return good

    def _within(self, i: int, j: int) -> bool:
        """Whether the line stays within the tolerance of the segment from i to j."""
        if j - i > WINDOW:
            return self.error(i, j) <= self.tolerance_mm
        if self._begin != i or j - i > len(self._where) or self._where[j - i - 1] < 0:
            # first as many as were needed last; on the same point's behalf what is asked now
            least = max(j - i, self._usual if self._begin != i else 2)
            self._begin = i
            self._look(i, min(1 << (least - 1).bit_length(), WINDOW))
        error2 = self._errors2[self._where[j - i - 1]]
        if error2 < self._sure2[0]:
            return True
        if error2 > self._sure2[1]:
            return False
        return self.error(i, j) <= self.tolerance_mm  # as near as rounding, or no number

    def _look(self, i: int, size: int) -> None:
        """Squares of the errors of segments from i to some of the next points; NaN to a point on i."""
        numbers, self._where, before = _asked(size)
        away = self.line[i + 1 : i + 1 + size] - self.line[i]
        if len(away) < size:  # the line ends: its last point once more, and after it
            away = np.concatenate([away, np.repeat(away[-1:], size - len(away), axis=0)])
        to = away[numbers].T
        dots, length2 = away @ to, (to * to).sum(axis=0)
        t = dots / length2
        np.minimum(t, 1.0, out=t)
        np.maximum(t, 0.0, out=t)
        off2 = t * length2  # |p - t a|² = p·p - t (2 p·a - t a·a)
        dots += dots
        off2 -= dots
        off2 *= t
        off2 += (away * away).sum(axis=1)[:, None]
        off2 *= before
        self._errors2 = off2.max(axis=0).tolist()

    def errors_through(self, i: int, middles: Ints, j: int) -> Floats:
        """Greater of the two errors (k,) of going from i to j by way of each of some points (k,) between them.

        As exact as rounding, but not to the last bit what `error` gives.
        """
        inner = self.line[i + 1 : j]
        number = np.arange(i + 1, j)
        worst = np.zeros(len(middles))
        for start, before in ((i, True), (j, False)):
            a = (self.line[middles] - self.line[start]).T
            off = inner - self.line[start]
            dots, length2 = off @ a, (a * a).sum(axis=0)
            with np.errstate(divide="ignore", invalid="ignore"):
                t = np.clip(np.where(length2 > 0, dots / length2, 0.0), 0.0, 1.0)
            off2 = (off * off).sum(axis=1)[:, None] - t * (2.0 * dots - t * length2)
            off2 *= (number[:, None] < middles) if before else (number[:, None] > middles)
            worst = np.maximum(worst, off2.max(axis=0))
        return np.sqrt(np.maximum(worst, 0.0))
