"""Whether a motion from outside welds every target, bead by bead in their order, and how fast.

    order = order_findings(job, motion, progress)      # progress (m,): length along its bead at every row, m
    order.findings, order.welded, order.held_speed

Metres and seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..failure import IN_ROWS, BeadOrder, Failure, FailurePlace, Kind, SlowdownCause, Where
from ..job.job import Job, speeds
from ..motion.deposition_speed import HeldSpeed, note_stretches, over_stretches, too_slow
from ..motion.motion import JUMP, Motion
from ..units import METRES_PER_MM
from .bead_samples import OnBead, SampledMotion, along_beads

REASONS = (
    "joint_limit",
    "speed",
    "singular",
    "collision",
    "no_path",
    "off_bead",
    "order",
    "not_welded",
    "gravity",
    "overhang",
)
ROUNDING_M = 1e-6  # m beyond the limit off the bead
FASTEST_SHARE = 1.05  # of the deposition speed: a bead laid faster is too thin
SHARE_SLACK = 1e-3  # of a share: where a row is along its bead is measured
SHORT = 1e-4  # m: how fast a shorter way is laid says nothing
WAIT_SLACK = 0.1  # s
NO_WAY = 1e-6  # m between targets: as much as the digits of a file
SKIP = 1e-3  # m: at a hairpin two samples are as far apart along the bead, and near one another


@dataclass(frozen=True)
class Finding:
    """Something that is wrong with a motion.

    Attributes:
        failure: the worst of it on them.
        row: first row concerned.
        to_row: last row concerned.
    """

    failure: Failure
    row: int
    to_row: int

    def __post_init__(self) -> None:
        """Keep plain values only: the record goes into documents."""
        object.__setattr__(self, "row", int(self.row))
        object.__setattr__(self, "to_row", int(self.to_row))

    @property
    def reason(self) -> str:
        """One of ``REASONS``."""
        return self.failure.reason

    @property
    def detail(self) -> dict[str, Any]:
        """The failure as reports have it."""
        return self.failure.document()


@dataclass(frozen=True, eq=False)
class Order:
    """What became of the beads.

    Attributes:
        findings: what is wrong with their order.
        welded: targets that are welded.
        held_speed: how fast.
    """

    findings: tuple[Finding, ...]
    welded: int
    held_speed: HeldSpeed


def order_findings(job: Job, motion: Motion, progress: Floats) -> Order:
    """Hold the rows with the arc on against the beads.

    Args:
        job: the job.
        motion: the motion.
        progress: length along its bead at every row, (m,), m.

    Returns:
        What was found.
    """
    found: list[Finding] = []
    held_speed = HeldSpeed.unknown(len(job.targets))
    welded = np.zeros(len(job.targets), dtype=bool)
    last_bead, end = -1, 0
    for first, stop in _blocks(motion):
        bead = int(motion.bead[first])
        if bead != last_bead + 1:
            beads = BeadOrder(bead, last_bead if last_bead >= 0 else None)
            found.append(Finding(Failure(Kind.BEAD_ORDER, cause=beads, place=IN_ROWS), first, stop - 1))
        last_bead = max(last_bead, bead)
        rows = np.arange(first, stop)
        found += _inside(job, motion, progress, rows)
        _weld(job, motion, progress, rows, welded, held_speed)
        found += _waits(job, motion, progress, rows)
        end = stop - 1
    found += _left_out(job, welded, end)
    found += _speed_findings(job, motion, held_speed)
    return Order(tuple(found), int(welded.sum()), held_speed)


def _blocks(motion: Motion) -> list[tuple[int, int]]:
    """Runs of rows with the arc on in one bead, as first row and one past the last."""
    on = motion.arc == 1
    begins = on & np.concatenate([[True], ~(on[:-1] & (motion.bead[1:] == motion.bead[:-1]))])
    ends = on & np.concatenate([~(on[1:] & (motion.bead[1:] == motion.bead[:-1])), [True]])
    return list(zip(np.flatnonzero(begins).tolist(), (np.flatnonzero(ends) + 1).tolist(), strict=True))


def _tolerance(job: Job) -> float:
    return job.case.checks.off_bead_mm * METRES_PER_MM + ROUNDING_M


def _inside(job: Job, motion: Motion, progress: Floats, rows: Ints) -> list[Finding]:
    """A bead that goes back, or on which the arm jumps."""
    found = []
    # from the farthest place reached: many short steps back are a way as well
    behind = np.maximum.accumulate(progress[rows]) - progress[rows]
    if behind.max() > _tolerance(job):
        first, worst = int(np.argmax(behind > _tolerance(job))), float(behind.max())
        back = Failure(Kind.GOES_BACK, measure=round(worst / METRES_PER_MM, 3), place=IN_ROWS)
        found.append(Finding(back, int(rows[first - 1]), int(rows[first])))
    turn = np.abs(np.diff(motion.q[rows], axis=0)).max(axis=1, initial=0.0)
    for k in np.flatnonzero(turn > JUMP)[:1]:
        jump = Failure(Kind.JUMP, measure=round(float(np.rad2deg(turn[k])), 3), place=IN_ROWS)
        found.append(Finding(jump, int(rows[k]), int(rows[k + 1])))
    return found


def skips(sampled: SampledMotion, on: OnBead, bead: Ints) -> list[Finding]:
    """Where the torch gets on along its bead further than it moves: from one pass over a place to a later one.

    Args:
        sampled: samples with the arc on.
        on: where they are on their beads.
        bead: of each sample, (m,).

    Returns:
        What was found.
    """
    moved = np.linalg.norm(np.diff(sampled.Ts_part_tcp[:, :3, 3], axis=0), axis=1)
    with np.errstate(invalid="ignore"):
        more = np.diff(on.progress) - moved
    more = np.where((np.diff(bead) == 0) & (np.diff(sampled.row) <= 1) & np.isfinite(more), more, 0.0)
    found = []
    for k in np.flatnonzero(more > SKIP).tolist():
        skip = Failure(Kind.SKIPS, measure=round(float(more[k]) / METRES_PER_MM, 3), place=IN_ROWS)
        found.append(Finding(skip, int(sampled.row[k]), int(sampled.row[k + 1])))
    return found


def _weld(job: Job, motion: Motion, progress: Floats, rows: Ints, welded: np.ndarray, held_speed: HeldSpeed) -> None:
    """Note which targets of a block's bead it passes, and when."""
    t = job.targets
    mine = np.flatnonzero(t.bead == motion.bead[rows[0]])
    along = along_beads(job)[mine]
    s, near = np.maximum.accumulate(progress[rows]), _tolerance(job)
    passed = (along >= s[0] - near) & (along <= s[-1] + near)
    welded[mine[passed]] = True
    # a wait at the start or end of a bead is none of the way between its targets
    leaves = int(np.searchsorted(s, s[0] + ROUNDING_M, side="right")) - 1
    arrives = int(np.searchsorted(s, s[-1] - ROUNDING_M))
    if arrives <= leaves:
        return
    moving = rows[leaves : arrives + 1]
    rising = np.concatenate([[True], np.diff(s[leaves : arrives + 1]) > 0])
    when = np.interp(along, s[leaves : arrives + 1][rising], motion.t_s[moving][rising])
    # a wait on the way belongs to the piece after it
    both = passed[:-1] & passed[1:] & (np.diff(along) > NO_WAY)  # targets at one place have no speed between them
    asked = np.diff(along) / speeds(job)[mine[:-1]]
    taken = np.diff(when)
    held_speed.asked_s[mine[:-1][both]] = asked[both]
    held_speed.taken_s[mine[:-1][both]] = np.maximum(taken[both], 1e-12)
    rows_s, rows_t = s[leaves : arrives + 1][rising], motion.t_s[moving][rising]
    if len(rows_s) > 1:
        wanted = np.interp(rows_s, along, np.concatenate([[0.0], np.cumsum(asked)]))
        note_stretches(held_speed, mine, along, over_stretches(rows_s, rows_t, wanted))


def _waits(job: Job, motion: Motion, progress: Floats, rows: Ints) -> list[Finding]:
    """An arc that burns where the torch stands."""
    process, t, s = job.case.process, motion.t_s, progress[rows]
    start = rows[: int(np.searchsorted(np.maximum.accumulate(s), s[0] + ROUNDING_M, side="right"))]
    end = rows[int(np.searchsorted(np.maximum.accumulate(s), s[-1] - ROUNDING_M)) :]
    waits = [(start, process.arc_on_s), (end, process.arc_off_s)]
    if process.least_speed_share > 0:
        # on the way: of a long chord a wait is lost in the mean
        still = np.diff(s[len(start) - 1 : len(s) - len(end) + 1]) <= ROUNDING_M
        ends = np.flatnonzero(np.diff(still, prepend=False, append=False))
        waits += [(rows[len(start) - 1 :][a : b + 1], 0.0) for a, b in zip(ends[::2], ends[1::2], strict=True)]
    found = []
    for at, allowed in waits:
        stands = float(t[at[-1]] - t[at[0]])
        if stands > allowed + WAIT_SLACK:
            still_s = Failure(Kind.STANDSTILL, measure=round(stands, 3), limit=allowed, place=IN_ROWS)
            found.append(Finding(still_s, int(at[0]), int(at[-1])))
    return found


def _left_out(job: Job, welded: np.ndarray, end: int) -> list[Finding]:
    """Stretches of targets that nothing welds, noted at the last row that welds."""
    missing = np.flatnonzero(~welded)
    if not len(missing):
        return []
    groups = np.split(missing, np.flatnonzero(np.diff(missing) > 1) + 1)
    places = [FailurePlace(Where.ROWS, target=int(g[0]), to_target=int(g[-1])) for g in groups]
    return [Finding(Failure(Kind.NOT_WELDED, place=place), end, end) for place in places]


def _speed_findings(job: Job, motion: Motion, held_speed: HeldSpeed) -> list[Finding]:
    """Ways from target to target that are laid too slowly or too fast."""
    welding = motion.arc == 1
    found = []

    def note(i: int, failure: Failure) -> None:
        rows = np.flatnonzero(welding & (motion.target == i))
        a, b = (int(rows[0]), int(rows[-1])) if len(rows) else (0, 0)
        found.append(Finding(replace(failure, axis="", place=FailurePlace(Where.ROWS, from_target=i)), a, b))

    for target, slow in too_slow(held_speed, job.case.process.least_speed_share, SHARE_SLACK).items():
        note(target - 1, slow)
    share = np.where(held_speed.asked_s * speeds(job) < SHORT, np.nan, held_speed.ratio)
    for i in np.flatnonzero(np.nan_to_num(share) > FASTEST_SHARE).tolist():
        taken = SlowdownCause("", round(float(held_speed.taken_s[i]), 4))
        note(i, Failure(Kind.DEPOSITION_SPEED, round(float(share[i]), 4), FASTEST_SHARE, cause=taken))
    return found
