"""Verdicts on single targets against py-opw-kinematics: what it finds is found, and nothing it finds was proved out.

The full comparison (10,000 full poses, 10,000 targets of free roll at 720 rolls) is
``python -m bench.speed.certificate --peers``; here is a slice of it.
"""

import numpy as np
import pytest
from support.oracles.peers import FREE, certified, found_by_opw, poses

from ik.roll import RollWindow, apply_roll


def test_full_poses_have_the_verdict_of_opw():
    Ts = poses(np.random.default_rng(0), 10_000)
    theirs, mine = found_by_opw(Ts), certified(Ts, RollWindow.fixed(0.0))
    assert 0.1 < theirs.mean() < 0.9
    assert mine.reachable[theirs].all()
    assert not theirs[mine.unreachable].any()
    assert mine.undecided.mean() <= 0.001
    # the closed form of full poses is the whole truth: what opw does not find is proved out
    assert mine.unreachable[~theirs].mean() > 0.999


@pytest.mark.slow
def test_free_rolls_have_the_verdict_of_opw_at_720_rolls():
    Ts = poses(np.random.default_rng(1), 10_000)
    mine = certified(Ts, FREE)
    assert mine.undecided.mean() <= 0.001
    # of all 10,000 the few rolls that find most, then 720 for the ones that are left of a slice
    rolls = FREE.samples(np.deg2rad(0.5))
    theirs = found_by_opw(apply_roll(Ts, np.zeros(len(Ts))))
    for chunk in (rolls[::180], rolls[::60], rolls[::12]):
        left = np.flatnonzero(~theirs)[: 40_000 // len(chunk)]
        theirs[left] = found_by_opw(apply_roll(Ts[left, None], chunk).reshape(-1, 4, 4)).reshape(len(left), -1).any(1)
    left = np.flatnonzero(~theirs)[:100]
    theirs[left] = found_by_opw(apply_roll(Ts[left, None], rolls).reshape(-1, 4, 4)).reshape(100, -1).any(1)
    assert mine.reachable[theirs].all()
    assert not theirs[mine.unreachable].any()
    assert 0.3 < theirs.mean() < 0.95
    # and what it is that all 720 rolls do not find
    assert mine.unreachable[left[~theirs[left]]].mean() > 0.95
