"""The arm's clearances on all of a motion: at samples, between them, and where its corners are rounded.

    seen = arm_along_motion(job, sampled, laid, runs)            # runs: stretches of samples without a stop
    at, nearest = nearest_along_motion(job, sampled, laid, seen.clear, runs)

A long motion is cut into pieces where it stops, by its samples alone, and the pieces are checked side by side where
there are workers: what is found does not depend on how many there are. Radians and metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..collision.blended_corners import cut_corners
from ..collision.blended_paths import BlendedPath
from ..collision.checker import Checker
from ..collision.clearances import CLEARANCE_REACH, Clearances
from ..collision.proofs.between_samples import least_between_samples, unproven_steps
from ..collision.proofs.reach_radii import all_radii
from ..collision.table_clearances import with_table_axes
from ..job.job import Job
from ..processes.worker import Tick
from ..processes.worker_pool import pool
from ..units import METRES_PER_MM
from .bead_samples import SampledMotion
from .laid_deposits import LaidDeposits

LEAST_PIECE = 10_000  # samples that a piece has at least; of fewer than twice as many there is one


@dataclass(frozen=True, eq=False)
class SampledRun:
    """Samples of a run of rows without a stop.

    Attributes:
        low: its first sample.
        high: its last one.
        row: that each step follows, (high - low,).
        length: path length at each sample, (high - low + 1,).
        zone: over which its corners are rounded.
    """

    low: int
    high: int
    row: Ints
    length: Floats
    zone: float

    @property
    def samples(self) -> slice:
        """Its samples."""
        return slice(self.low, self.high + 1)

    def path(self, axes: Floats) -> BlendedPath:
        """Some of the axes on it: samples lie on the rows' own straight lines, the same path with more rows."""
        return BlendedPath(axes[self.samples], self.length, self.zone)


Steps = tuple[Ints, Clearances]


@dataclass(frozen=True, eq=False)
class ArmSeen:
    """What was seen of the arm.

    Attributes:
        clear: clearances at the samples, (m,).
        unproven: samples after which the clearance is not proved to be kept, ascending, and the nearest there.
        rounded: of each run, likewise, its steps on which that is so once its corners are rounded.
    """

    clear: Clearances
    unproven: Steps
    rounded: tuple[Steps, ...]


@dataclass(frozen=True, eq=False)
class _MotionPiece:
    """Samples that are checked by one process; its runs' are counted from its first one on."""

    first: int
    q: Floats
    laid: LaidDeposits
    runs: tuple[SampledRun, ...]


def arm_along_motion(job: Job, sampled: SampledMotion, laid: LaidDeposits, runs: Sequence[SampledRun]) -> ArmSeen:
    """Check the arm on all of a motion.

    Args:
        job: the job.
        sampled: samples of all of it.
        laid: the deposits there are.
        runs: stretches without a stop, in order.

    Returns:
        What was seen.
    """
    pieces = _pieces(sampled, laid, runs)
    found = pool().run(_checked_piece, _light(job), pieces)
    # the last sample of a piece is the first of the next one
    parts = [seen.clear.rows(np.arange(len(seen.clear) - 1)) for seen in found[:-1]]
    steps = [piece.first + seen.unproven[0] for piece, seen in zip(pieces, found, strict=True)]
    return ArmSeen(
        Clearances.joined([*parts, found[-1].clear]),
        (np.concatenate(steps), Clearances.joined([seen.unproven[1] for seen in found])),
        tuple(one for seen in found for one in seen.rounded),
    )


def nearest_along_motion(
    job: Job, sampled: SampledMotion, laid: LaidDeposits, clear: Clearances, runs: Sequence[SampledRun]
) -> tuple[int, Clearances]:
    """How near a motion comes to anything, as of ``cell.collision.proofs.between_samples.least_between_samples``.

    Args:
        job: the job.
        sampled: samples of all of it.
        laid: the deposits there are.
        clear: clearances at the samples.
        runs: stretches without a stop, in order.
    """
    pieces = _pieces(sampled, laid, runs)
    known = float(clear.distance.min()) if len(pieces) > 1 else np.inf
    items = [(piece, clear.rows(piece.first + np.arange(len(piece.q))), known) for piece in pieces]
    found = pool().run(_nearest, _light(job), items)
    k = int(np.argmin([nearest.distance[0] for _, nearest in found]))
    return pieces[k].first + found[k][0], found[k][1]


def _light(job: Job) -> Job:
    """A job without what only reports ask for: it is sent to other processes."""
    return replace(job, sliced=(), beads=())


def _pieces(sampled: SampledMotion, laid: LaidDeposits, runs: Sequence[SampledRun]) -> list[_MotionPiece]:
    """A motion cut where runs end, once there are samples enough on both sides."""
    last = len(sampled.q) - 1
    cuts = [0]
    for run in runs:
        if run.high - cuts[-1] >= LEAST_PIECE and last - run.high >= LEAST_PIECE:
            cuts.append(run.high)
    pieces = []
    for a, b in zip(cuts, [*cuts[1:], last], strict=True):
        mine = tuple(replace(run, low=run.low - a, high=run.high - a) for run in runs if a <= run.low < run.high <= b)
        pieces.append(_MotionPiece(a, sampled.q[a : b + 1], laid.part(a, b), mine))
    return pieces


def _checker(job: Job, q: Floats) -> Checker:
    """Collision detection of the arm that moves the table's axes like the arm's."""
    table = (float(q[0, -2]), float(q[0, -1]))
    reach = max(CLEARANCE_REACH, 2 * job.case.checks.clearance_mm * METRES_PER_MM)
    return Checker(with_table_axes(job.scene), table, reach)


def _checked_piece(job: Job, piece: _MotionPiece, tick: Tick) -> ArmSeen:
    q, laid, least = piece.q, piece.laid, job.case.checks.clearance_mm * METRES_PER_MM
    checker, radius = _checker(job, q), all_radii(job.scene)
    clear = checker.clearances(q, laid.at)
    unproven = unproven_steps(checker, radius, q, laid.at, clear, least=least, laid_between=laid.between)
    checker = _checker(job, q)
    rounded: list[Steps] = []
    lost = bool(len(unproven[0]) or (clear.distance < least).any())
    for run in piece.runs:
        seen = clear.rows(np.arange(run.low, run.high + 1))
        mine = laid.part(run.low, run.high)
        found = cut_corners(checker, radius, run.path(q), mine.at, seen, least, lost=lost, laid_between=mine.between)
        rounded.append(found)
        lost |= bool(len(rounded[-1][0]))
    tick()
    return ArmSeen(clear, unproven, tuple(rounded))


def _nearest(job: Job, item: tuple[_MotionPiece, Clearances, float], tick: Tick) -> tuple[int, Clearances]:
    piece, clear, known = item
    checker, radius, laid = _checker(job, piece.q), all_radii(job.scene), piece.laid
    found = least_between_samples(checker, radius, piece.q, laid.at, clear, known=known, laid_between=laid.between)
    tick()
    return found
