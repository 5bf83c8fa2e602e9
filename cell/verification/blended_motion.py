"""A motion from outside with its corners rounded as a controller does, and what it collides with then.

    q = blended_rows(job, read, rows).q                       # all axes where the rows come to lie
    runs = list(sampled_runs(job, read, rows, sampled))           # sampled: samples, rows among them
    found = blend_collisions(job, runs, seen)                 # seen: from cell.verification.arm_clearances
    found = table_blend_collisions(job, runs, sampled, laid)     # laid: what laid_deposits says is there for the table

Corners are rounded while welding and on the way, each by its own measure; not where the arc goes on or off, nor where
all axes stand. A motion that says itself where it is rounded, as a program does, is rounded there. Radians and metres.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..collision.blended_corners import cut_corners
from ..collision.clearances import CLEARANCE_REACH, Clearances
from ..collision.proofs.reach_radii import table_radii
from ..collision.table_clearances import TableChecker
from ..failure import CollisionPlace
from ..job.job import Job
from ..motion.motion import NO_MOVE
from ..motion.motion_file import ReadMotion
from ..scene.scene import Scene
from ..timing.blending import TRAVEL_ZONE, blended
from ..units import METRES_PER_MM
from .arm_clearances import ArmSeen, SampledRun
from .bead_order import Finding
from .bead_samples import SampledMotion
from .collisions import hit, stretches_of
from .laid_deposits import LaidDeposits


def _runs(job: Job, read: ReadMotion, rows: SampledMotion) -> Iterator[tuple[int, int, Floats, float]]:
    """Runs of rows without a stop: the first and the last, path length from the first on, and the rounding's zone."""
    motion = read.motion
    if read.blended is not None:
        yield from ((run.first, run.last, run.s, run.zone) for run in read.blended)
        return
    away = np.linalg.norm(np.diff(rows.Ts_part_tcp[:, :3, 3], axis=0), axis=1)
    turned = np.linalg.norm(np.diff(rows.q, axis=0), axis=1)
    # a turn about the TCP in one place is no stop: corners beside it are rounded, over hardly any length of its own
    moved = np.where(motion.welding, np.maximum(away, NO_MOVE), turned)
    zones = {True: job.case.process.blend_mm * METRES_PER_MM, False: TRAVEL_ZONE}
    kind = np.where(turned <= NO_MOVE, -1, motion.welding)
    starts = np.flatnonzero(np.diff(kind, prepend=-2))
    for a, b in zip(starts.tolist(), [*starts[1:].tolist(), len(kind)], strict=True):
        if kind[a] >= 0 and b - a > 1:
            yield a, b, np.concatenate([[0.0], np.cumsum(moved[a:b])]), zones[bool(kind[a])]


@dataclass(frozen=True, eq=False)
class SampledBlends:
    """Rows of a motion with its corners rounded.

    Attributes:
        q: all axes, (m, j + 2), rad.
        length: path length from the first row, (m,), in the units over which corners are rounded: metres of the TCP
            while welding, radians of joint travel between.
        drift: what the length between a row and another can be off at most because the file's angles are rounded, (m,).
    """

    q: Floats
    length: Floats
    drift: Floats


def blended_rows(job: Job, read: ReadMotion, rows: SampledMotion) -> SampledBlends:
    """Rows where they come to lie once corners are rounded.

    Args:
        job: the job.
        read: the motion.
        rows: its rows, from ``cell.verification.bead_samples.rows_of``.
    """
    q, steps = rows.q.copy(), np.zeros(len(rows.q) - 1)
    for a, b, s, zone in _runs(job, read, rows):
        q[a : b + 1], steps[a:b] = blended(rows.q[a : b + 1], s, zone), np.diff(s)
    drift = np.zeros(len(q))
    if read.grain[1] > 0 and read.blended is None:  # half of it at either end
        lever = np.linalg.norm(job.scene.chain.jacobian(rows.q[:, : job.scene.chain.n])[:, :3], axis=1).sum(axis=1)
        lever += table_radii(job.scene).sum()
        welding = np.append(read.motion.welding, False) | np.append(False, read.motion.welding)
        drift = read.grain[1] * np.where(welding, lever, np.sqrt(q.shape[1]))
    return SampledBlends(q, np.concatenate([[0.0], np.cumsum(steps)]), drift)


def blend_collisions(job: Job, runs: Sequence[SampledRun], seen: ArmSeen) -> list[Finding]:
    """Where the arm comes too near to something for the rounding of corners alone.

    Args:
        job: the job.
        runs: from :func:`sampled_runs`.
        seen: what was seen of the arm on them.

    Returns:
        What was found.
    """
    least = job.case.checks.clearance_mm * METRES_PER_MM
    found: list[Finding] = []
    for run, (step, nearest) in zip(runs, seen.rounded, strict=True):
        clear = seen.clear.rows(np.arange(run.low, run.high + 1))
        found += _findings(job.scene, run, clear, step, nearest, least)
    return found


def table_blend_collisions(
    job: Job, runs: Sequence[SampledRun], sampled: SampledMotion, laid: LaidDeposits
) -> list[Finding]:
    """Where the table, or what stands on it, meets something for the rounding of its corners alone.

    Args:
        job: the job.
        runs: from :func:`sampled_runs`.
        sampled: samples of all of it.
        laid: the deposits there are for the table.

    Returns:
        What was found; as in ``cell.verification.collisions.table_collisions`` nothing but penetration is wrong.
    """
    scene = job.scene
    tables = sampled.q[:, scene.chain.n :]
    if not np.diff(tables, axis=0).any():
        return []
    checker, radius = TableChecker(scene, CLEARANCE_REACH), table_radii(scene)
    found: list[Finding] = []
    for run in runs:
        if not np.diff(tables[run.samples], axis=0).any():
            continue
        path, mine = run.path(tables), laid.part(run.low, run.high)
        seen = checker.clearances(tables[run.samples], mine.at)
        step, nearest = cut_corners(checker, radius, path, mine.at, seen, 0.0, laid_between=mine.between)
        found += _findings(scene, run, seen, step, nearest, 0.0)
    return found


def sampled_runs(job: Job, read: ReadMotion, rows: SampledMotion, sampled: SampledMotion) -> Iterator[SampledRun]:
    """Runs of a motion without a stop, in order.

    Args:
        job: the job.
        read: the motion.
        rows: its rows.
        sampled: samples of all of it.
    """
    row = np.append(sampled.row[:-1], len(read.row) - 1)  # the last sample is the last row
    first, count = np.searchsorted(row, row), np.bincount(row)
    share = (np.arange(len(row)) - first) / count[row]
    for a, b, s, zone in _runs(job, read, rows):
        low, high = np.searchsorted(row, [a, b]).tolist()
        mine = slice(low, high + 1)
        length = np.interp(row[mine] - a + share[mine], np.arange(len(s)), s)
        yield SampledRun(low, high, row[low:high], length, zone)


def _findings(
    scene: Scene, run: SampledRun, seen: Clearances, step: Ints, nearest: Clearances, least: float
) -> Iterator[Finding]:
    """What was found on steps of a run whose samples are free themselves."""
    near = np.full(len(seen) - 1, -np.inf)
    near[step] = -nearest.distance
    bad = np.isfinite(near) & (np.minimum(seen.distance[:-1], seen.distance[1:]) >= least)
    for low_row, high_row, k in stretches_of(bad, run.row, near):
        failure = hit(scene, nearest, int(np.searchsorted(step, k)), least, CollisionPlace.ROUNDED)
        yield Finding(failure, low_row, high_row + 1)
