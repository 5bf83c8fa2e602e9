"""How much of its axes' speeds and accelerations a motion uses, and which axes would have to be faster than they are.

    use = np.stack([speed_use(job, motion), acceleration_use(job, read, rows)])       # (2, m, j + 2), shares
    findings = drive_findings(job, use)

Radians and seconds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ik.chain import Floats

from ..failure import IN_ROWS, Failure, Kind
from ..job.job import Job
from ..motion.motion import Motion
from ..motion.motion_file import ReadMotion
from .bead_order import Finding
from .bead_samples import SampledMotion
from .blended_motion import SampledBlends, blended_rows
from .collisions import stretches_of

SPEED_SLACK = 1.001
ACCELERATION_SLACK = 1.02
WINDOWS = (0.0, 0.005, 0.01, 0.02, 0.05)  # s to either side over which accelerations are measured; 0: from row to row
SHORTEST = 1e-9  # path length, m or rad: next to nothing
MOST_DRIFT = 0.01  # share of a speed that is put down to lengths worked out of rounded angles


def degrees(angle: float, digits: int = 3) -> float:
    """An angle in degrees, rounded as findings give it."""
    return round(float(np.rad2deg(angle)), digits)


def _axes(motion: Motion) -> Floats:
    return np.concatenate([motion.q, motion.table], axis=1)


def speed_use(job: Job, motion: Motion) -> Floats:
    """Share of its speed that each axis needs from row to row, (m, j + 2)."""
    speed = np.abs(np.diff(_axes(motion), axis=0)) / np.diff(motion.t_s)[:, None] / job.drives.speed
    return np.concatenate([speed, np.zeros((1, speed.shape[1]))])


def acceleration_use(job: Job, read: ReadMotion, rows: SampledMotion, windows: Sequence[float] = WINDOWS) -> Floats:
    """Share of its acceleration that each axis needs about each row, (m, j + 2).

    Of the motion with its corners rounded: second differences, which are means of the accelerations in them. From row
    to row they hide no spike, but the rounding of a file's digits can be all they show: what it can be at most is taken
    off, which over longer ones is little. Before its first row and after its last the motion is at rest.
    """
    smooth = _second_differences(blended_rows(job, read, rows), read, windows)
    # where a motion comes to rest in a corner nothing is rounded: over few rows the rows themselves say more
    axes = _axes(read.motion)
    plain = _second_differences(SampledBlends(axes, np.zeros(len(axes)), np.zeros(len(axes))), read, windows)
    plain[-1] = np.inf
    shares: Floats = np.minimum(smooth, plain).max(axis=0) / job.drives.acceleration
    return shares


def _second_differences(rows: SampledBlends, read: ReadMotion, windows: Sequence[float]) -> Floats:
    """Mean accelerations about each row over windows (s to either side; 0: from row to row), (w, m, j), at least."""
    t, (time, angle) = read.motion.t_s, read.grain
    q, drift = rows.q, rows.drift[:, None]
    length = np.concatenate([rows.length[[0, 0]], rows.length, rows.length[[-1, -1]]])
    before, after, longest = float(t[1] - t[0]), float(t[-1] - t[-2]), max(windows)
    q = np.concatenate([q[[0, 0]], q, q[[-1, -1]]])
    t = np.concatenate([t[0] - [before + longest, before], t, t[-1] + [after, after + longest]])
    i = np.arange(2, len(t) - 2)
    out = np.empty((len(windows), len(i), q.shape[1]))
    for k, window in enumerate(windows):
        a = np.clip(np.searchsorted(t, t[i] - window, side="right") - 1, 0, i - 1)
        b = np.clip(np.searchsorted(t, t[i] + window), i + 1, len(t) - 1)
        to, since, both = ((t[x] - t[y])[:, None] for x, y in ((b, i), (i, a), (b, a)))
        ahead, behind = (q[b] - q[i]) / to, (q[i] - q[a]) / since
        mean = np.abs(ahead - behind) / (both / 2)
        # less what the rounding of the file's digits can make of it: of angles, of times, and of the lengths over which
        # corners are rounded, which come from angles
        before_s, after_s = (
            time + wait * np.minimum(drift / np.maximum(length[x] - length[y], SHORTEST)[:, None], MOST_DRIFT)
            for x, y, wait in ((i, a, since), (b, i, to))
        )
        blur = (angle + np.abs(ahead) * after_s) / to + (angle + np.abs(behind) * before_s) / since
        out[k] = np.maximum(mean * (1 - time / both) - blur / (both / 2), 0.0)
    return out


def drive_findings(job: Job, use: Floats) -> list[Finding]:
    """Axes that would have to be faster than they are."""
    drives, row = job.drives, np.arange(use.shape[1])
    found = []
    for share, kind, limit, slack in (
        (use[0], Kind.DRIVE_SPEED, drives.speed, SPEED_SLACK),
        (use[1], Kind.DRIVE_ACCELERATION, drives.acceleration, ACCELERATION_SLACK),
    ):
        for j, name in enumerate(drives.names):
            for a, b, k in stretches_of(share[:, j] > slack, row, share[:, j]):
                most = float(limit[j])
                failure = Failure(kind, degrees(share[k, j] * most), degrees(most), axis=name, place=IN_ROWS)
                found.append(Finding(failure, a, b))
    return found
