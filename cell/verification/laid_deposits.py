"""What the rows of a motion from outside say has been laid, sample by sample and step by step.

    laid = LaidDeposits.of(job, motion, sampled.row)
    laid.at, laid.between       # at samples, and from each to the next

A bead's layer counts as laid from where the bead ends: it is there for the step that leads away, and not yet for the
step that welds the bead's last piece. So a step may have fewer than the sample at which it ends. For the arm, that is:
what a table turns while it is welded may meet something before the bead ends, and may have left it again by then. For
the table by itself all of a layer is there from where its first bead begins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Ints
from ..job.job import Job
from ..motion.motion import Motion


@dataclass(frozen=True, eq=False)
class LaidDeposits:
    """How many deposits there are along a motion.

    Attributes:
        at: at each sample, as many as on the steps to it and from it, (m,).
        between: from each sample to the next, (m - 1,).
    """

    at: Ints
    between: Ints

    @classmethod
    def of(cls, job: Job, motion: Motion, row: Ints, *, for_table: bool = False) -> LaidDeposits:
        """What the rows say has been laid by then.

        Args:
            job: the job.
            motion: the motion, of two rows at least.
            row: that each of two samples or more follows, ascending, (m,): none is left out between two of them.
            for_table: whether a layer counts while its first bead is welded.
        """
        on_row = np.zeros(len(motion.t_s) - 1, dtype=np.int64)
        if len(job.targets):
            arc = motion.arc == 1
            done = np.maximum.accumulate(np.where(arc, job.laid[motion.target], 0))
            at_row = np.where(arc, job.deposits_before[motion.target], done)
            welded = job.laid[motion.target] if for_table else at_row
            on_row = np.where(motion.welding, welded[:-1], np.maximum(at_row[:-1], at_row[1:]))
        between = on_row[row[:-1]]
        return cls(np.maximum(np.append(between, between[-1]), np.append(between[0], between)), between)

    def part(self, first: int, last: int) -> LaidDeposits:
        """From one sample to another, both included."""
        return LaidDeposits(self.at[first : last + 1], self.between[first:last])
