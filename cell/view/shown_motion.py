"""A motion from a file or of a program as a replay shows it: checked, with what is wrong at the targets it is about.

    result = played(job, check_motion(job, read_motion("blade.csv", job)), target=None)
    result.motion, result.feasible                # plays whatever the verdict is
    played_program(job, check_program(job, program)).line_at(row)     # where a program's text is then

Radians and seconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..job.job import Job
from ..motion.motion import Motion
from ..programs.program import SourceLine
from ..programs.program_check import ProgramFinding, ProgramResult
from ..scene.placement import place_targets
from ..verdict.result import Result, TargetVerdict
from ..verification.bead_order import Finding
from ..verification.motion_check import MotionResult


@dataclass(frozen=True, eq=False)
class ShownMotion(Result):
    """A motion that is shown as it is.

    Attributes:
        found: what the check of it found.
        program: what was found of the program that it is of, None of a motion from a file.
    """

    found: MotionResult
    program: ProgramResult | None = None

    @property
    def feasible(self) -> bool:
        """Whether there are no findings: a motion that is shown may be infeasible."""
        return self.found.feasible if self.program is None else self.program.feasible

    @property
    def findings(self) -> Sequence[Finding | ProgramFinding]:
        """Everything that is wrong."""
        return self.found.findings if self.program is None else self.program.findings

    def line_at(self, row: int) -> SourceLine | None:
        """Where the program's text is after a row of the motion, None of a motion from a file."""
        if self.program is None:
            return None
        return self.program.run.line(min(row + 1, len(self.program.run.move) - 1))


def played_program(job: Job, program: ProgramResult, target: int | None = None) -> ShownMotion:
    """A checked program as a result to be shown.

    Args:
        job: the job.
        program: from ``cell.programs.program_check.check_program``.
        target: as of :func:`played`.

    Returns:
        The result.
    """
    shown = replace(played(job, program.found, target), program=program)
    assert shown.motion is not None
    rows = _rows(shown.found, shown.motion, _first_rows(shown.motion, len(job.targets)), program.findings)
    return replace(shown, rows=rows)


def played(job: Job, found: MotionResult, target: int | None = None) -> ShownMotion:
    """A checked motion as a result to be shown.

    Args:
        job: the job.
        found: from ``cell.verification.motion_check.check_motion``.
        target: that a picture shows, where the table moves; else the middle of the motion.

    Returns:
        The result; its table is that of the target.
    """
    motion = replace(found.read.motion, t_s=found.read.motion.t_s - found.read.motion.t_s[0])
    first = _first_rows(motion, len(job.targets))
    middle = int(np.searchsorted(motion.t_s, motion.t_s[-1] / 2))
    shown = middle if target is None else int(first[np.clip(target, 0, len(first) - 1)])
    E1, E2 = (float(v) for v in motion.table[shown])
    placed = place_targets(job.targets, job.scene.T_base_part(E1, E2))
    gravity: Floats = np.arccos(np.clip(placed.normal @ job.scene.T_world_base()[2, :3], -1.0, 1.0))
    deg = np.rad2deg([E1, E2])
    asked = (round(float(deg[0]), 3), round(float(deg[1]), 3))
    rows = _rows(found, motion, first, found.findings)
    return ShownMotion(job, asked, (E1, E2), placed, rows, None, None, None, gravity, motion, found)


def _first_rows(motion: Motion, n: int) -> Ints:
    """The row in which each of n targets is welded first, or else is nearest to be, (n,)."""
    welding = np.flatnonzero(motion.arc)
    if not len(welding):
        return np.zeros(n, dtype=np.int64)
    farthest = np.maximum.accumulate(motion.target[welding])
    out: Ints = welding[np.minimum(np.searchsorted(farthest, np.arange(n)), len(welding) - 1)]
    return out


def _rows(
    found: MotionResult, motion: Motion, first: Ints, findings: Sequence[Finding | ProgramFinding]
) -> tuple[TargetVerdict, ...]:
    """What is wrong at each target: the first finding on rows that are about it."""
    rows = [TargetVerdict(None, motion.q[k]) for k in first]
    for f in findings:
        first_target, last_target = f.failure.target, f.failure.to_target
        if first_target is not None and last_target is not None:
            about = np.arange(first_target, last_target + 1)
        else:
            here = (found.read.row >= f.row) & (found.read.row <= f.to_row)
            about = np.unique(motion.target[here])
        for i in about.tolist():
            if rows[i].reason is None:
                rows[i] = TargetVerdict(f.failure, None, motion.q[first[i]])
    return tuple(rows)
