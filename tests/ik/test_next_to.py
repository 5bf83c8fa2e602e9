"""The configuration that a guess leads to: on its pose, next to the guess, and the one damped least squares finds."""

from dataclasses import replace

import numpy as np
import pytest
from support.cells.arms import welder

from ik import dls
from ik.roll import RollWindow
from ik.solver import NEXT, Solver


@pytest.fixture(scope="module")
def solver():
    return Solver.for_chain(welder())


def some(chain, rng, count, away=0.2):
    """Configurations off their limits by so much, rad, some of them whole turns from what a closed form gives."""
    return rng.uniform(chain.lower + away, chain.upper - away, (count, chain.n))


def off_pose(chain, q, Ts):
    return np.abs(chain.forward(q) - Ts).max(axis=(1, 2))


def test_it_is_on_its_pose_and_next_to_the_guess_in_the_turn_of_the_guess(solver):
    rng = np.random.default_rng(1)
    q = some(solver.chain, rng, 400)
    assert (np.abs(q[:, 5]) > np.pi).sum() > 50
    guess = q + rng.uniform(-0.02, 0.02, q.shape)
    found, ok = solver.next_to(solver.chain.forward(q), guess)
    assert ok.mean() > 0.95
    assert off_pose(solver.chain, found[ok], solver.chain.forward(q)[ok]).max() < 1e-6
    near = ok & (np.abs(q[:, 4]) > 0.3)  # with A4 and A6 nearly in line a little of the pose is much of both
    assert np.abs(found[near] - q[near]).max(axis=1).max() < NEXT


def test_it_is_what_damped_least_squares_finds(solver):
    rng = np.random.default_rng(2)
    q = some(solver.chain, rng, 300)
    q = q[np.abs(q[:, 4]) > 0.3]
    guess, Ts = q + rng.uniform(-0.01, 0.01, q.shape), solver.chain.forward(q)
    found, ok = solver.next_to(Ts, guess)
    known = dls.track_one(solver.chain, Ts, guess, RollWindow.fixed(0.0))
    both = ok & known.ok
    assert both.mean() > 0.95
    assert np.median(np.abs(found - known.q)[both].max(axis=1)) < 1e-8
    # where the arm is nearly straight two configurations are next to the guess, and either may be found
    assert (np.abs(found - known.q)[both].max(axis=1) < 1e-6).mean() > 0.98


def test_what_is_outside_the_limits_or_out_of_reach_is_not_reached(solver):
    rng = np.random.default_rng(3)
    q = some(solver.chain, rng, 100)
    q = q[np.abs(q[:, 4]) > 0.3]
    Ts = solver.chain.forward(q)
    tight = replace(solver.chain, upper=np.where(np.arange(6) == 1, q[:, 1].max() + 1e-3, solver.chain.upper))
    narrow = Solver.for_chain(replace(tight, upper=np.where(np.arange(6) == 1, np.median(q[:, 1]), tight.upper)))
    found, ok = narrow.next_to(Ts, q)
    outside = q[:, 1] > narrow.chain.upper[1]
    assert 10 < outside.sum() < len(q) - 10
    assert ok[~outside].all()
    # found all the same it is another one, inside
    assert (found <= narrow.chain.upper + 1e-12).all()
    far = Ts.copy()
    far[:, :3, 3] *= 10
    assert not solver.next_to(far, q)[1].any()


def test_an_arm_without_a_closed_form_is_followed_too(solver):
    rng = np.random.default_rng(4)
    q = some(solver.chain, rng, 40)
    q = q[np.abs(q[:, 4]) > 0.3]
    found, ok = Solver.for_chain(solver.chain, "dls").next_to(solver.chain.forward(q), q + 1e-3)
    assert ok.mean() > 0.9
    assert off_pose(solver.chain, found[ok], solver.chain.forward(q)[ok]).max() < 1e-6
