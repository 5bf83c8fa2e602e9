"""The grid of path lengths at which a time law is worked out: fine where corners are rounded and where the path rests.

    grid = time_grid(s, zone, counting_corners(s, slope, share), fine)

The unit of the path's length is the caller's.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import repeat_with_index
from .greatest_speeds import FLAT_SLOPE

PER_ZONE = 4  # grid steps a zone
MOST_STEPS = 200_000  # of a grid that is even; a finer one is fine about the samples and grows coarser between them
GROWTH, EVEN_STEPS = 1.25, 16  # of the steps of such a grid; its pieces have at least so many
REST_STEPS = 12  # times the first and last grid step are halved: a start from rest is over within the first
CORNER = 0.005  # share of a joint's speed or acceleration that the rounding of a row has to take to count as a corner


def counting_corners(s: Floats, slope: Floats, share: Floats) -> Floats:
    """Path lengths at which the path bends by so much that its rounding takes a share of a speed or an acceleration.

    Args:
        s: path length at each sample, (m,).
        slope: of the pieces between, (m - 1, j).
        share: of each joint's speed or acceleration, by change of slope, (j,), at the path's greatest speed.
    """
    turn = np.abs(np.diff(slope, axis=0))
    return s[1:-1][(np.where(turn > FLAT_SLOPE, turn, 0.0) * share > CORNER).any(axis=1)]


def time_grid(s: Floats, zone: float, corners: Floats, fine: NDArray[np.bool_]) -> Floats:
    """Path lengths fine enough for the rounding of corners, finer still at the ends, where the path is at rest.

    Args:
        s: path length at each sample, (m,).
        zone: over which corners are rounded.
        corners: path lengths of those that count.
        fine: pieces that are processed finely, (m - 1,); of the others only the ends are checked.
    """
    count = np.where(fine, np.maximum(np.ceil(np.diff(s) * PER_ZONE / zone), 1), 1).astype(np.int64)
    if count.sum() > MOST_STEPS:
        grid = np.append(np.concatenate([a + _graded(b - a, zone) for a, b in pairwise(s.tolist())]), s[-1])
    else:
        piece, k = repeat_with_index(count)
        grid = np.append(s[piece] + np.diff(s)[piece] * k / count[piece], s[-1])
    halves = 0.5 ** np.arange(1, REST_STEPS + 1)
    # where the rounding of a corner begins and ends, the acceleration jumps
    mirrored_corners = np.concatenate([-corners, corners, 2 * s[-1] - corners])  # beyond the ends it goes on mirrored
    edges = np.concatenate([mirrored_corners - zone, mirrored_corners + zone])
    edges = edges[(edges > 0) & (edges < s[-1])]
    fine = np.concatenate([grid, grid[1] * halves, s[-1] - (s[-1] - grid[-2]) * halves, edges])
    fine.sort()
    kept = fine[np.concatenate([[True], np.diff(fine) > FLAT_SLOPE * s[-1]])]
    kept[-1] = s[-1]
    return kept


def _graded(length: float, zone: float) -> Floats:
    """Places on a piece but its end: steps of a share of the zone at both ends, growing towards its middle."""
    first = zone / PER_ZONE
    most = max(length / EVEN_STEPS, first)
    near = 3 * PER_ZONE  # steps before they grow
    grown = int(np.ceil(np.log(most / first) / np.log(GROWTH)))
    steps = np.concatenate([np.full(near, first), first * GROWTH ** np.arange(1, grown + 1), np.full(EVEN_STEPS, most)])
    half = np.concatenate([[0.0], np.cumsum(steps)])
    half = half[half < length / 2]
    return np.concatenate([half, length - half[:0:-1]])
