"""The samples of a result that its page shows.

    path = drawn_path(result)
    worst_of_steps(path, lambda first, stop: path.arm[first:stop])      # (k, c), one row a step sent

A feasible result is shown over time. Where its samples are too many to be sent they are gathered into steps, each with
the worst of what it stands for, so that no peak of a speed or a margin is lost. An infeasible one has no motion and is
shown over its targets, at the configuration of each or at the best attempt.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..motion.motion import Motion
from ..verdict.result import Result

SAMPLES_AT_ONCE = 20_000  # samples whose poses and margins are in memory together


@dataclass(frozen=True)
class PageBudget:
    """How much a page holds of a long motion and of many targets.

    Attributes:
        samples: of the motion, sent as they are; of more, at least so many besides one a target.
        steps: sent of a motion of many targets, about.
        listed: infeasible targets in the table.
    """

    samples: int = 12_000
    steps: int = 75_000
    listed: int = 5_000


BUDGET = PageBudget()


@dataclass(frozen=True, eq=False)
class DrawnPath:
    """Where the arm is along the report's path.

    Attributes:
        x: seconds, or target numbers where there is no motion, (m,).
        arm: (m, j), rad; NaN where a target has no configuration.
        table: E1, E2, (m, 2), rad.
        arc: 1 while welding, (m,).
        target: target last passed, of a travel the one it leads to, (m,).
        starts: first sample of each step sent, (k,).
        timed: whether x is time.
    """

    x: Floats
    arm: Floats
    table: Floats
    arc: Ints
    target: Ints
    starts: Ints
    timed: bool

    @property
    def gathered(self) -> bool:
        """Whether a step stands for several samples."""
        return len(self.starts) < len(self.x)

    @property
    def q(self) -> Floats:
        """Arm and table at the samples sent, (k, j + 2), rad."""
        return np.concatenate([self.arm[self.starts], self.table[self.starts]], axis=1)

    def axis(self, k: int) -> Floats:
        """One of the arm's axes or, after them, of the table's, (m,), rad."""
        n = self.arm.shape[1]
        return np.asarray(self.arm[:, k] if k < n else self.table[:, k - n])


def drawn_path(result: Result, budget: PageBudget = BUDGET) -> DrawnPath:
    """The samples of a result."""
    n = len(result.rows)
    if result.motion is not None:
        m = result.motion
        return DrawnPath(m.t_s, m.q, m.table, m.arc, m.target, _starts(m, budget), True)
    nothing = np.full(result.job.scene.chain.n, np.nan)
    q = np.stack([next((x for x in (r.q, r.attempt) if x is not None), nothing) for r in result.rows])
    i = np.arange(n)
    return DrawnPath(i.astype(np.float64), q, result.tables, np.ones_like(i), i, i, False)


def _starts(motion: Motion, budget: PageBudget = BUDGET) -> Ints:
    """Samples to keep: every one, or each target's first, both ends of every way, and some evenly between."""
    m = len(motion.t_s)
    if m <= budget.samples:
        return np.arange(m)
    change = np.flatnonzero((np.diff(motion.target) != 0) | (np.diff(motion.arc) != 0)) + 1
    before, even = change - 1, budget.samples
    # of many targets the sample before is kept where the arc goes on or off
    if 2 * len(change) + budget.samples > budget.steps:
        before = np.flatnonzero(np.diff(motion.arc) != 0)
        even = max(budget.samples, budget.steps - len(change) - len(before))
    spread = np.linspace(0, m - 1, min(even, m)).astype(np.int64)
    return np.unique(np.concatenate([spread, change, before]))


def worst_of_steps(
    path: DrawnPath,
    values: Callable[[int, int], Floats],
    of: Callable[..., Floats] = np.fmin.reduceat,
    at_once: int = SAMPLES_AT_ONCE,
) -> Floats:
    """The worst of every step, (k, c); NaN only where all of it is.

    Args:
        path: the samples.
        values: those of samples first .. stop - 1, (stop - first, c); asked for a few thousand at a time.
        of: what makes one of several.
        at_once: samples that are in memory together.
    """
    stops = np.append(path.starts[1:], len(path.x))
    out, i = [], 0
    while i < len(path.starts):
        first = int(path.starts[i])
        last = max(int(np.searchsorted(stops, first + at_once, side="right")), i + 1)
        out.append(of(values(first, int(stops[last - 1])), path.starts[i:last] - first, axis=0))
        i = last
    return np.concatenate(out)


def note_of(result: Result, path: DrawnPath) -> str:
    """What the charts do not show; empty where they show all."""
    if not path.gathered:
        return ""
    least = "" if result.clearance is None else "; the least clearance of the motion is drawn where it occurs"
    return (
        f"The charts show {len(path.starts):,} steps for the {len(path.x):,} samples of the motion. Speeds "
        "and margins are "
        f"the worst of each step. Clearance is that of its first sample{least}."
    )
