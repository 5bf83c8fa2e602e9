"""Lines through values most of which lie on them: radii of a turned surface's corners over their heights.

A corner of a turned surface lies exactly on it; corners that other surfaces share with it (a fillet's outer edge, a
wall that cuts a facet) lie off it, scattered. The surface is where the most weight lies within the least width:

    line = fit_line(z, r, weight, slopes=(0.0,), limits=(1.0, 1e-5))
    line.level, line.slope, line.width, line.share
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats

SHRINK = 0.5
BIWEIGHT = 2.0  # widths at which a corner no longer counts
PREFERRED = 1.15  # how much better a slanted line must be than an upright one


@dataclass(frozen=True)
class Line:
    """A line level + slope * z.

    Attributes:
        level: at z = 0.
        slope: rise per z.
        width: half the width of the strip that holds what lies on it.
        share: of the weight that lies within.
    """

    level: float
    slope: float
    width: float
    share: float

    @property
    def merit(self) -> float:
        """Share for the width: most weight within the least width is best."""
        return self.share / self.width**0.5

    def off(self, z: Floats, r: Floats) -> Floats:
        """How far values lie above it."""
        return r - self.level - self.slope * z


def densest(values: Floats, weight: Floats, width: float) -> tuple[float, float]:
    """Where the most weight lies within 2 width: its weighted mean, and the share of the weight.

    Args:
        values: (n,).
        weight: (n,) not all 0.
        width: half that of the strip.

    Returns:
        The mean of what lies within, and its share.
    """
    order = np.argsort(values, kind="stable")
    ascending, heavy = values[order], weight[order]
    total = np.append(0.0, np.cumsum(heavy))
    last = np.searchsorted(ascending, ascending + 2 * width, side="right")
    held = total[last] - total[:-1]
    best = int(held.argmax())
    inside = slice(best, int(last[best]))
    if held[best] <= 0:
        return float(ascending[best]), 0.0
    # sums and not BLAS: its threads cost more than they save on so few numbers
    return float((heavy[inside] * ascending[inside]).sum() / held[best]), float(held[best] / total[-1])


def biweights(off: Floats, width: float) -> Floats:
    """Tukey's weights (n,) of residuals: 1 on the line, 0 beyond BIWEIGHT widths."""
    return np.square(np.maximum(1.0 - np.square(off / (BIWEIGHT * width)), 0.0))


def fit_line(z: Floats, r: Floats, weight: Floats, slopes: Sequence[float], limits: tuple[float, float]) -> Line:
    """The line on which the most weight lies within the least width.

    Args:
        z: (n,) heights.
        r: (n,) radii.
        weight: (n,).
        slopes: at which it may begin; the first is the one preferred, and is kept as it stands if it is 0.
        limits: greatest and least width of the strip.

    Returns:
        The line.
    """
    best: Line | None = None
    for slope in slopes:
        line = _shrunk(z, r, weight, slope, limits, free=slope != 0.0)
        if best is None or line.merit > (PREFERRED if best.slope == 0.0 else 1.0) * best.merit:
            best = line
    assert best is not None
    return best


def _shrunk(z: Floats, r: Floats, weight: Floats, slope: float, limits: tuple[float, float], free: bool) -> Line:
    """Fit within ever narrower strips; the best of them by merit."""
    width, floor = max(limits), limits[1]
    best: Line | None = None
    while True:
        level, _ = densest(r - slope * z, weight, width)
        for _ in range(2 if free else 1):
            w = weight * biweights(r - level - slope * z, width)
            total = float(w.sum())
            if total <= 0:
                break
            middle = float((w * z).sum()) / total
            lever = w * (z - middle)
            spread = float((lever * (z - middle)).sum())
            mean = float((w * r).sum()) / total
            if free and spread > 1e-18 * total:
                slope = float((lever * (r - mean)).sum()) / spread
            level = mean - slope * middle
        inside = np.abs(r - level - slope * z) <= width
        line = Line(level, slope, width, float(weight[inside].sum() / weight.sum()))
        if best is None or line.merit > best.merit:
            best = line
        if width <= floor:
            return best
        width = max(width * SHRINK, floor)


def in_strip(off: Floats, width: float) -> Bools:
    """Which residuals lie in a strip."""
    return np.abs(off) <= width
