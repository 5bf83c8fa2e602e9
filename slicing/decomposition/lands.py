"""What grooves leave of a turned bar: its lands, which are body and no rings that stand on it.

    is_land(z, r, where, top)        # of an outline's points (r, z), those of a stretch that stands out

A land is as wide as the body that is beside it beyond narrow grooves, or one of several that together are longer than
they stand out, as a pulley's: their grooves are turned out of a wide stretch whose bottom is still wider than the body.
"""

from __future__ import annotations

import numpy as np

from ..mesh.solid import Floats, Ints

SAME_RADIUS = 5e-3  # of its radius: lands that differ by less are of one bar
WIDE_GROOVE = 2.0  # of its depth: a wider groove is a narrower stretch of the body
CUT_AWAY = 0.6  # of depth times pitch: grooves that take more leave rings that stand on their bottom
OUT_AND_LONG = 0.999  # of its length: a stretch that stands out as far is a flange, whatever grooves it has


def is_land(z: Floats, r: Floats, where: Ints, top: float) -> bool:
    """Whether a stretch of an outline that stands out is what grooves left of a bar.

    Args:
        z: (n,) heights of the outline's points, lowest first, mm.
        r: (n,) their radii.
        where: (k,) numbers of the stretch's points.
        top: its greatest radius.
    """
    ends = where[r[where] >= top * (1.0 - SAME_RADIUS)]
    first, last = int(ends[0]), int(ends[-1])
    if _is_grooved(z, r, (first, last), top):
        return True
    up, down = (z, r, last), (-z[::-1], r[::-1], len(r) - 1 - first)
    return any(_reaches_body(*way, top) for way in (up, down))


def _reaches_body(z: Floats, r: Floats, k: int, top: float) -> bool:
    """Whether up from the k-th point of an outline narrow grooves lead to a stretch of one radius that is body."""
    while (first := _next_land(r, k, top)) is not None:
        depth = top - float(r[k : first + 1].min())
        if z[first] - z[k] > WIDE_GROOVE * depth:
            return False
        last = _end_of(r, first, top)
        if z[last] - z[first] > depth:
            return True
        k = last
    return False


def _is_grooved(z: Floats, r: Floats, land: tuple[int, int], top: float) -> bool:
    """Whether a land and those beside it are one wide stretch with grooves in it."""
    last = _last_of_grooved(z, r, land[1], top)
    first = len(r) - 1 - _last_of_grooved(-z[::-1], r[::-1], len(r) - 1 - land[0], top)
    if (first, last) == land:
        return False
    beside = [float(r[k]) for k in (first - 1, last + 1) if 0 <= k < len(r)]
    feet = [radius for radius in beside if radius < top * (1.0 - SAME_RADIUS)]
    if not feet or r[first : last + 1].min() <= max(feet) * (1.0 + SAME_RADIUS):
        return False
    return bool(top - max(feet) < OUT_AND_LONG * (z[last] - z[first]))


def _last_of_grooved(z: Floats, r: Floats, k: int, top: float) -> int:
    """Up from the k-th point of an outline, the end of the last land that grooves alone part from it."""
    start = k - _end_of(r[: k + 1][::-1], 0, top)
    while (first := _next_land(r, k, top)) is not None:
        last = _end_of(r, first, top)
        groove = slice(k, first + 1)
        depth, width = top - float(r[groove].min()), float(z[first] - z[k])
        pitch = width + 0.5 * float(z[k] - z[start] + z[last] - z[first])
        cut = width * top - float(np.trapezoid(r[groove], z[groove]))
        if depth > pitch or cut > CUT_AWAY * depth * pitch:
            break
        start, k = first, last
    return k


def _next_land(r: Floats, k: int, top: float) -> int | None:
    """Up from the k-th point the first of the next land of a radius; None where there is none, or a wider stretch."""
    after = np.flatnonzero(r[k + 1 :] >= top * (1.0 - SAME_RADIUS))
    first = k + 1 + int(after[0]) if len(after) else None
    return None if first is None or r[first] > top * (1.0 + SAME_RADIUS) else first


def _end_of(r: Floats, k: int, top: float) -> int:
    """The last point of the land that the k-th is on."""
    while k + 1 < len(r) and abs(r[k + 1] - top) <= SAME_RADIUS * top:
        k += 1
    return k
