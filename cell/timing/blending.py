"""Corners as a controller rounds them.

Use:

    blended(q, s, zone)                       # rows (m, n), path lengths (m,), rounded over zone each way
"""

from __future__ import annotations

import numpy as np

from ik.chain import Floats

# rounding of corners between beads, rad of joint travel each way; a TCP leaves them by 1.5 mm
# at most in the shipped cells
TRAVEL_ZONE = np.deg2rad(0.2)

NO_ZONE = 1e-9  # a zone below counts as this: corners are run through at next to no speed, and hardly left


def blended(q: Floats, s: Floats, zone: float, at: Floats | None = None) -> Floats:
    """A path with its corners rounded, as :func:`time_path` times it.

    Args:
        q: samples, (m, j), rad.
        s: path length at each, (m,), ascending.
        zone: distance each way over which corners are rounded; at most half the path.
        at: path lengths wanted, (k,); those of the samples where left out.

    Returns:
        The moving average there, (m, j) or (k, j).
    """
    at = s if at is None else at
    at, s = at - s[0], s - s[0]
    zone = kept_zone(zone, s[-1])
    t, far = mirrored(q, s)
    slope = np.diff(far, axis=0) / np.diff(t)[:, None]
    area = np.concatenate(
        [np.zeros((1, q.shape[1])), np.cumsum((far[:-1] + far[1:]) / 2 * np.diff(t)[:, None], axis=0)]
    )

    def integral(u: Floats) -> Floats:
        k = np.clip(np.searchsorted(t, u, side="right") - 1, 0, len(slope) - 1)
        h = (u - t[k])[:, None]
        return np.asarray(area[k] + far[k] * h + slope[k] * h**2 / 2)

    return (integral(at + zone) - integral(at - zone)) / (2 * zone)


def kept_zone(zone: float, end: float) -> float:
    """The zone that a path of a length is rounded over: more than nothing, and at most half the path."""
    return float(min(max(zone, NO_ZONE), end / 2))


def mirrored(q: Floats, s: Floats) -> tuple[Floats, Floats]:
    """A path that goes on beyond its ends as its point reflection there: its average starts and ends where it does."""
    t = np.concatenate([-s[:0:-1], s, 2 * s[-1] - s[-2::-1]])
    return t, np.concatenate([2 * q[0] - q[:0:-1], q, 2 * q[-1] - q[-2::-1]])
