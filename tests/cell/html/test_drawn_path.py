"""Samples that pages show of long motions: every target and every way's ends, and no peak lost."""

from __future__ import annotations

import numpy as np
import pytest

from cell.html import drawn_path
from cell.html.drawn_path import DrawnPath, PageBudget, worst_of_steps
from cell.motion.motion import Motion


def motion_of(targets: int, each: int) -> Motion:
    """A motion of beads of ten targets with ways between them, so many samples a target."""
    m = targets * each
    target = np.repeat(np.arange(targets), each)
    arc = np.ones(m, dtype=np.int64)
    arc[(target % 10 == 0) & (np.arange(m) % each < each // 2)] = 0  # on the way to a bead's first target
    q = np.zeros((m, 6))
    return Motion(np.arange(m) * 0.1, q, q[:, :2], arc, target // 10, target * 0, target, tuple("ABCDEF"))


def path_with(starts: np.ndarray, m: int) -> DrawnPath:
    i = np.arange(m)
    return DrawnPath(i * 1.0, np.zeros((m, 6)), np.zeros((m, 2)), i * 0, i, starts, True)


@pytest.mark.parametrize("most_steps", [75_000, 3_000, 100])
def test_every_target_and_both_ends_of_every_way_are_kept(most_steps: int) -> None:
    budget = PageBudget(samples=500, steps=most_steps)
    motion = motion_of(1000, 20)
    starts = drawn_path._starts(motion, budget)
    assert (np.diff(starts) > 0).all()
    assert {0, len(motion.t_s) - 1} <= set(starts.tolist())
    welded = starts[motion.arc[starts] == 1]
    firsts = [int(np.argmax((motion.target == i) & (motion.arc == 1))) for i in range(1000)]
    assert set(firsts) <= set(welded.tolist())
    switched = np.flatnonzero(np.diff(motion.arc))
    assert set(switched) | set(switched + 1) <= set(starts.tolist())
    # no long way without a sample, whatever the budget
    assert np.diff(starts).max() <= len(motion.t_s) / (500 - 2)
    assert len(starts) <= max(min(most_steps, 500 + 2 * 1100), 500 + len(firsts) + 2 * len(switched)) + 2
    assert len(drawn_path._starts(motion_of(20, 20), budget)) == 400  # few are all sent


@pytest.mark.parametrize("at_once", [1, 7, 100, 10_000])
def test_the_worst_of_a_step_is_the_worst_of_all_its_samples(at_once: int) -> None:
    rng = np.random.default_rng(3)
    values = rng.normal(size=(1000, 2))
    values[rng.random(values.shape) < 0.2] = np.nan
    starts = np.unique(np.append(0, rng.integers(0, 1000, 90)))
    values[starts[4] : starts[5]] = np.nan
    asked = []

    def some(first: int, stop: int) -> np.ndarray:
        asked.append(stop - first)
        return values[first:stop]

    least = worst_of_steps(path_with(starts, 1000), some, at_once=at_once)
    most = worst_of_steps(path_with(starts, 1000), some, np.fmax.reduceat, at_once)
    for k, (a, b) in enumerate(zip(starts, np.append(starts[1:], 1000), strict=True)):
        known = [column[np.isfinite(column)] for column in values[a:b].T]
        np.testing.assert_array_equal(least[k], [c.min() if len(c) else np.nan for c in known])
        np.testing.assert_array_equal(most[k], [c.max() if len(c) else np.nan for c in known])
    assert max(asked) <= max(at_once, np.diff(starts, append=1000).max())
