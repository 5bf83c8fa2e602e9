"""A motion from outside with its corners rounded as a controller does, and what it collides with then.

    q = rounded_rows(job, read, rows)                         # all axes where the rows come to lie
    found = corner_collisions(job, read, rows, way, stage, clear)

Corners are rounded while welding and on the way, each by its own measure; not where the arc goes on or off, nor where
all axes stand. A motion that says itself where it is rounded, as a program does, is rounded there. Radians and metres.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..collision.blended_corners import BlendedPath, cut_corners
from ..collision.clearances import Clearances
from ..collision.reach_radii import all_radii
from ..failure import Seen
from ..job.job import Job
from ..motion.motion import STANDING
from ..motion.motion_file import ReadMotion
from ..timing.blending import TRAVEL_ZONE, rounded
from ..units import METRES_PER_MM
from .bead_order import Finding
from .bead_samples import Way
from .collisions import arm_checker, hit, stretches_of


def _runs(job: Job, read: ReadMotion, rows: Way) -> Iterator[tuple[int, int, Floats, float]]:
    """Runs of rows without a stop: the first and the last, path length from the first on, and the rounding's zone."""
    motion = read.motion
    if read.blended is not None:
        yield from ((run.first, run.last, run.s, run.zone) for run in read.blended)
        return
    away = np.linalg.norm(np.diff(rows.Ts_part_tcp[:, :3, 3], axis=0), axis=1)
    way = np.where(motion.welding, away, np.linalg.norm(np.diff(rows.q, axis=0), axis=1))
    zones = {True: job.case.process.blend_mm * METRES_PER_MM, False: TRAVEL_ZONE}
    kind = np.where(way <= STANDING, -1, motion.welding)
    starts = np.flatnonzero(np.diff(kind, prepend=-2))
    for a, b in zip(starts.tolist(), [*starts[1:].tolist(), len(kind)], strict=True):
        if kind[a] >= 0 and b - a > 1:
            yield a, b, np.concatenate([[0.0], np.cumsum(way[a:b])]), zones[bool(kind[a])]


def rounded_rows(job: Job, read: ReadMotion, rows: Way) -> Floats:
    """All axes at the rows with corners rounded, (m, j + 2), rad.

    Args:
        job: the job.
        read: the motion.
        rows: its rows, from ``cell.verification.bead_samples.rows_of``.
    """
    q = rows.q.copy()
    for a, b, s, zone in _runs(job, read, rows):
        q[a : b + 1] = rounded(rows.q[a : b + 1], s, zone)
    return q


def corner_collisions(job: Job, read: ReadMotion, rows: Way, way: Way, stage: Ints, clear: Clearances) -> list[Finding]:
    """Where the arm comes too near to something for the rounding of corners alone.

    Args:
        job: the job.
        read: the motion.
        rows: its rows.
        way: samples of all of it.
        stage: deposits there are at the samples.
        clear: the arm's clearances at the samples.

    Returns:
        What was found.
    """
    scene = job.scene
    least = job.case.checks.clearance_mm * METRES_PER_MM
    checker = arm_checker(job, way)
    radius = all_radii(scene)
    row = np.append(way.row[:-1], len(read.row) - 1)  # the last sample is the last row
    first, count = np.searchsorted(row, row), np.bincount(row)
    share = (np.arange(len(row)) - first) / count[row]
    found = []
    for a, b, s, zone in _runs(job, read, rows):
        low, high = np.searchsorted(row, [a, b]).tolist()
        mine = slice(low, high + 1)
        # samples lie on the rows' own straight lines: the same path with more rows
        length = np.interp(row[mine] - a + share[mine], np.arange(len(s)), s)
        seen = clear.rows(np.arange(low, high + 1))
        step, nearest = cut_corners(checker, radius, BlendedPath(way.q[mine], length, zone), stage[mine], seen, least)
        near = np.full(len(seen) - 1, -np.inf)
        near[step] = -nearest.distance
        bad = np.isfinite(near) & (np.minimum(seen.distance[:-1], seen.distance[1:]) >= least)
        for low_row, high_row, k in stretches_of(bad, row[low:high], near):
            failure = hit(scene, nearest, int(np.searchsorted(step, k)), least, Seen.ROUNDED)
            found.append(Finding(failure, low_row, high_row + 1))
    return found
