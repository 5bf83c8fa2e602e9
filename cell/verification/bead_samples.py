"""Where a motion from outside is on its beads: the TCP against the targets' chords, row by row and between rows.

    sampled = dense(job, motion, rows, grain, which)   # joint-linear samples between the rows, seen from the part
    on = against_beads(job, sampled, target)
    on.bead_distance, on.wire_angle, on.progress             # m, rad, m along the bead

Metres and radians; poses in the part frame, so that a table that moves changes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from ..errors import InputError
from ..job.job import Job
from ..motion.motion import Motion
from ..rigid import frames, great_circle, inverse
from ..units import METRES_PER_MM


@dataclass(frozen=True)
class SampleSpacing:
    """How far apart samples are at most.

    Attributes:
        position: of the TCP, m.
        angle: of every axis, rad.
    """

    position: float
    angle: float


FINE = SampleSpacing(0.2e-3, np.deg2rad(0.2))
ALIKE = SampleSpacing(0.05e-3, np.deg2rad(0.05))  # distances and angles that count alike
MOST_SAMPLES = 10_000_000
COARSE = SampleSpacing(1e-3, np.deg2rad(1.0))


@dataclass(frozen=True, eq=False)
class SampledMotion:
    """Samples of a motion between whose rows all axes move on straight lines.

    Attributes:
        row: row that each sample follows, (m,).
        q: all axes, (m, j + 2), rad.
        Ts_part_tcp: (m, 4, 4), m.
        T_base_part: (m, 4, 4), m.
    """

    row: Ints
    q: Floats
    Ts_part_tcp: Floats
    T_base_part: Floats


def rows_of(job: Job, motion: Motion) -> SampledMotion:
    """The rows themselves."""
    return _posed(job, np.arange(len(motion.t_s)), np.concatenate([motion.q, motion.table], axis=1))


def dense(
    job: Job,
    motion: Motion,
    rows: SampledMotion,
    grain: SampleSpacing,
    which: NDArray[np.bool_],
    most: int = MOST_SAMPLES,
) -> SampledMotion:
    """Samples on some of a motion's steps, ends included.

    Args:
        job: the job.
        motion: the motion.
        rows: from :func:`rows_of`.
        grain: how far apart at most.
        which: steps wanted, (rows - 1,).
        most: samples.

    Returns:
        The samples; a step's end is there once, as the start of the next where that is wanted.

    Raises:
        InputError: more of them than could be held.
    """
    p = rows.Ts_part_tcp[:, :3, 3]
    away = np.linalg.norm(np.diff(p, axis=0), axis=1) / grain.position
    turn = np.abs(np.diff(rows.q, axis=0)).max(axis=1) / grain.angle
    count = np.maximum(np.ceil(np.maximum(away, turn) - 1e-9), 1).astype(np.int64)
    step = np.flatnonzero(which)
    if count[step].sum() > most:
        raise InputError(f"the motion is too long: it takes {count[step].sum()} samples, at most {most} are checked")
    last = step[~np.isin(step + 1, step)]
    row = np.repeat(step, count[step])
    k = np.arange(len(row)) - np.repeat(np.cumsum(count[step]) - count[step], count[step])
    row, f = np.concatenate([row, last]), np.concatenate([k / count[row], np.ones(len(last))])
    order = np.lexsort((f, row))
    row, f = row[order], f[order][:, None]
    return _posed(job, row, (1 - f) * rows.q[row] + f * rows.q[row + 1])


def _posed(job: Job, row: Ints, q: Floats) -> SampledMotion:
    scene, n = job.scene, job.scene.chain.n
    T_base_part = scene.Ts_base_site("part", q[:, n:])
    return SampledMotion(row, q, inverse(T_base_part) @ scene.chain.forward(q[:, :n]), T_base_part)


@dataclass(frozen=True, eq=False)
class OnBead:
    """Samples against their beads.

    What a sample is judged by is the place of the bead that fits it best in distance and direction together. Another
    place can be nearer to it where the wire's direction is a worse fit.

    Attributes:
        bead_distance: distance from the bead's nearest place, (m,), m.
        nearest_angle: angle between the wire and its direction at the nearest place, (m,), rad.
        judged_distance: distance from the place that fits best, (m,), m; not less.
        wire_angle: angle between the wire and its direction at the place that fits best, (m,), rad.
        progress: length along the bead from its first target, (m,), m; on the chord that the sample names where that is
            as near as any but for :data:`ALIKE`: where a bead runs back another pass over the place is as near.
        normal: deposition direction at the place that fits best, (m, 3), part frame.
        roll: about the wire, (m,), rad.
    """

    bead_distance: Floats
    nearest_angle: Floats
    judged_distance: Floats
    wire_angle: Floats
    progress: Floats
    normal: Floats
    roll: Floats


def along_beads(job: Job) -> Floats:
    """Length along its bead at which each target is, (n,), m."""
    t = job.targets
    step = np.linalg.norm(np.diff(t.position, axis=0), axis=1) * METRES_PER_MM
    total = np.concatenate([[0.0], np.cumsum(step)])
    first = np.flatnonzero(np.diff(t.bead, prepend=-1))
    out: Floats = total - total[first][t.bead]
    return out


def against_beads(job: Job, sampled: SampledMotion, target: Ints) -> OnBead:
    """Measure samples against the chords next to the targets they passed last.

    Args:
        job: the job.
        sampled: samples.
        target: last target passed of each, (m,).

    Returns:
        The measures; each chord stands for its point that is nearest to the sample.
    """
    t = job.targets
    p, n = t.position * METRES_PER_MM, t.normal
    x, z = sampled.Ts_part_tcp[:, :3, 3], sampled.Ts_part_tcp[:, :3, 2]
    along = along_beads(job)
    best = np.full(len(x), np.inf)
    nearest, nearest_angle, off, wire_angle, progress = (np.full(len(x), np.inf) for _ in range(5))
    normal = n[target]
    named_score, named_progress = best, progress
    for shift in (0, -1, 1):
        e = np.clip(target + shift, 0, len(t) - 2)
        mine = (t.bead[e] == t.bead[target]) & (t.bead[e + 1] == t.bead[target])
        chord = p[e + 1] - p[e]
        s = np.clip(((x - p[e]) * chord).sum(axis=1) / np.maximum((chord**2).sum(axis=1), 1e-30), 0.0, 1.0)
        away = np.linalg.norm(x - p[e] - s[:, None] * chord, axis=1)
        towards = great_circle(n[e], n[e + 1], s)
        turned = 2 * np.arcsin(np.clip(np.linalg.norm(z + towards, axis=1) / 2, 0.0, 1.0))
        # a chord may be nearer whose direction is another; where chords meet, it is the one that the row names
        score = np.maximum(away / ALIKE.position, turned / ALIKE.angle)
        better = mine & (score < best)
        nearer = mine & (away < nearest)
        nearest, nearest_angle = np.where(nearer, away, nearest), np.where(nearer, turned, nearest_angle)
        here = along[e] + s * (along[e + 1] - along[e])
        if shift == 0:
            named_score, named_progress = np.where(mine, score, np.inf), here
        best, off = np.where(better, score, best), np.where(better, away, off)
        wire_angle = np.where(better, turned, wire_angle)
        progress = np.where(better, here, progress)
        normal = np.where(better[:, None], towards, normal)
    progress = np.where(named_score <= best + 1, named_progress, progress)
    return OnBead(nearest, nearest_angle, off, wire_angle, progress, normal, _roll(sampled, normal))


def _roll(sampled: SampledMotion, normal: Floats) -> Floats:
    """Roll of samples about the wire; the reference directions are the part's own z and x."""
    T0 = frames(np.zeros((len(normal), 3)), normal, (np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])))
    x = sampled.Ts_part_tcp[:, :3, 0]
    return np.arctan2((T0[:, :3, 1] * x).sum(axis=1), (T0[:, :3, 0] * x).sum(axis=1))
