"""Hundreds of changes to a case, screened by the arm's kinematics on a sample of the targets.

    screening = Screening(start, bad, good, changes)
    screening.border(change, wanted)       # (too small, large enough): from where on the change can help

What screening refuses cannot help: some target is out of reach, limits or margins at every allowed roll. What it
lets pass may still collide, or lack a way. With damped least squares, which proves nothing, it is a search.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from ik.dls import solve as dls_solve
from ik.reachability_proof import certify
from ik.roll import RollWindow
from ik.singularity import SingularityLimits, margins
from ik.solver import Solver

from ..arrays import Ints
from ..farthest_points import farthest_points
from ..rigid import is_beyond
from .change import Change
from .changes import CheckedCase

Bools = NDArray[np.bool_]
BAD, GOOD = 96, 48  # targets in the sample; a quarter of them without a closed form
TURN_MM = 35.0  # a right angle between normals counts as 50 mm of distance


class Screening:
    """Which sampled targets the arm can reach after which changes."""

    def __init__(self, start: CheckedCase, bad: Sequence[int], good: Sequence[int], must: Sequence[int] = ()) -> None:
        """Choose the sample.

        Args:
            start: what is changed.
            bad: infeasible targets.
            good: feasible ones, which a change must not lose.
            must: targets to have in the sample whatever else is.
        """
        self.start = start
        fewer = 4 if start.job.solver.form is None else 1
        chosen = [*must, *self._spread(bad, BAD // fewer), *self._spread(good, GOOD // fewer)]
        self.sample = np.unique(np.array(chosen, dtype=np.int64))
        self.reached: dict[Change, Bools] = {}

    def add(self, changes: Iterable[Change]) -> None:
        """Screen all sizes of some changes; those that leave the window of the roll alone in one pass."""
        start = self.start
        todo: dict[RollWindow, list[tuple[Change, int, Floats, Floats]]] = {}
        for change in changes:
            self.reached[change] = np.zeros((len(change.steps), len(self.sample)), dtype=bool)
            # a seam does not change the pose of a target, so one size is enough
            for k, size in enumerate(change.steps[: 1 if change.other_targets else None]):
                window = start.window(change, size)
                todo.setdefault(window, []).append((change, k, *start.poses(change, size, self.sample)))
        for window, items in todo.items():
            Ts, normal = (np.concatenate([item[i] for item in items]) for i in (2, 3))
            ok = self._solved(Ts, normal, window).reshape(len(items), -1)
            for (change, k, *_), row in zip(items, ok, strict=True):
                self.reached[change][slice(None) if change.other_targets else k] = row

    def allowed(self, change: Change, wanted: Ints | None) -> list[float]:
        """Sizes at which the sampled ones of some targets (None: of all) can be reached."""
        ok = self.reached[change][:, self._mine(wanted)]
        return [size for size, row in zip(change.steps, ok, strict=True) if row.all()]

    def border(self, change: Change, wanted: Ints | None) -> tuple[float, float]:
        """Where screening begins to allow a change, to the change's resolution.

        Returns:
            A size that is too small and one that is not; infinite where none is large enough. Where the arm is no
            obstacle as things stand, zero and the first size.
        """
        allowed = self.allowed(change, wanted)
        if not allowed:
            return 0.0, np.inf
        if change.numbered:
            return -1.0, allowed[0]
        high, mine = allowed[0], self.sample[self._mine(wanted)]
        low = max((s for s in change.steps if s < high), default=0.0)
        if low == 0.0 and self._reached(change, 0.0, mine).all():
            return 0.0, high
        while high - low > change.resolution * 1.001:
            middle = size_between(change, low, high)
            if self._reached(change, middle, mine).all():
                high = middle
            else:
                low = middle
        return low, high

    def _mine(self, wanted: Ints | None) -> Bools:
        return np.ones(len(self.sample), dtype=bool) if wanted is None else np.isin(self.sample, wanted)

    def _reached(self, change: Change, size: float, index: Ints) -> Bools:
        if not self.start.has(change, size):
            return np.zeros(len(index), dtype=bool)
        return self._solved(*self.start.poses(change, size, index), self.start.window(change, size))

    def _solved(self, Ts: Floats, normal: Floats, window: RollWindow) -> Bools:
        job = self.start.job
        ok = reachable(job.solver, Ts, window, job.singularity_limits)
        steepest = job.case.checks.gravity_max_deg
        if steepest is not None:
            up = job.scene.T_world_base()[2, :3]
            ok &= ~is_beyond(np.arccos(np.clip(normal @ up, -1.0, 1.0)), np.deg2rad(steepest))
        return ok

    def _spread(self, index: Sequence[int], most: int) -> Ints:
        """Targets that stand for many: the outermost, then those furthest from the ones chosen."""
        targets = self.start.job.targets
        if len(index) <= most:
            return np.array(index, dtype=np.int64)
        points = np.hstack([targets.position[index], TURN_MM * targets.normal[index]])
        return np.array(index, dtype=np.int64)[farthest_points(points, most)]


def reachable(solver: Solver, Ts: Floats, window: RollWindow, limits: SingularityLimits) -> Bools:
    """Which targets an arm reaches at some roll, collisions aside.

    Args:
        solver: the arm.
        Ts: targets at roll 0, (m, 4, 4), m, base frame.
        window: allowed roll.
        limits: singularity margins to keep.

    Returns:
        (m,) booleans; without a closed form, what damped least squares finds.
    """
    if solver.form is not None:
        return certify(solver.chain, Ts, window, limits, solver.form).reachable
    found = dls_solve(solver.chain, Ts, window, seeds=solver.seeds, enough=1)
    least = limits.values(solver.geometry is not None)
    q = np.where(found.ok[..., None], found.q, np.nan)
    keeps: Bools = np.all(margins(solver.chain, solver.geometry, q) >= least, axis=-1)
    return np.asarray(keeps.any(axis=1), dtype=bool)


def size_between(change: Change, low: float, high: float) -> float:
    """The middle of two sizes, on the change's lattice."""
    middle = round((low + high) / 2 / change.resolution) * change.resolution
    return float(min(max(middle, low + change.resolution), high - change.resolution))
