"""Verdicts on single targets against py-opw-kinematics: what it finds is found, and nothing it finds was proved out.

The full comparison (10,000 full poses, 10,000 targets of free roll at 720 rolls) is
``python bench/certificate.py --peers``; here is a slice of it.
"""

import numpy as np
import pytest
from ik_arms import OPW, kr70, welder

from ik.certificate import certify
from ik.chain import Floats
from ik.closed_form import recognise
from ik.roll import RollWindow, apply_roll
from ik.singularity import SingularityLimits

FREE, ANY = RollWindow.free(), SingularityLimits(0.0, 0.0, 0.0)
T_FLANGE_TCP = np.linalg.inv(kr70().T_last_tcp) @ welder().T_last_tcp

opw = pytest.importorskip("py_opw_kinematics")


def found_by_opw(Ts: Floats) -> np.ndarray:
    """Which TCP poses, (m, 4, 4), have a configuration inside the limits by py-opw-kinematics, (m,)."""
    from scipy.spatial.transform import RigidTransform

    robot = opw.Robot(opw.KinematicModel(**OPW), degrees=True)
    low, high = np.rad2deg([kr70().lower, kr70().upper])
    # the tool is folded in here: its own ee_transform turns first and shifts then
    q = np.asarray(robot.reach(RigidTransform.from_matrix(Ts @ np.linalg.inv(T_FLANGE_TCP))).joints)
    # A6 has more than one turn: an angle is inside if it is so at any turn
    turns = [(q + 360.0 * k >= low - 1e-7) & (q + 360.0 * k <= high + 1e-7) for k in (-1, 0, 1)]
    return np.any(turns, axis=0).all(axis=-1).any(axis=-1)


def poses(rng, count):
    """TCP poses anywhere in and around the reach, (count, 4, 4)."""
    from ik_arms import random_rotation

    Ts = np.tile(np.eye(4), (count, 1, 1))
    Ts[:, :3, :3] = [random_rotation(rng) for _ in range(count)]
    out = rng.normal(size=(count, 3))
    Ts[:, :3, 3] = [0, 0, 0.575] + out / np.linalg.norm(out, axis=1)[:, None] * rng.uniform(0.1, 2.7, (count, 1))
    return Ts


def certified(Ts, window):
    chain = welder()
    form = recognise(chain)
    assert form is not None
    return certify(chain, form, Ts, window, ANY)


def test_full_poses_have_the_verdict_of_opw():
    Ts = poses(np.random.default_rng(0), 10_000)
    theirs, mine = found_by_opw(Ts), certified(Ts, RollWindow.fixed(0.0))
    assert 0.1 < theirs.mean() < 0.9
    assert mine.reachable[theirs].all()
    assert not theirs[mine.unreachable].any()
    assert mine.undecided.mean() <= 0.001
    # the closed form of full poses is the whole truth: what opw does not find is proved out
    assert mine.unreachable[~theirs].mean() > 0.999


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
