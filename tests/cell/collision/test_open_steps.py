"""A few looks say of many steps what is near on them, and never too little of it."""

import numpy as np

from cell.collision.clearances import Clearances
from cell.collision.open_steps import OpenSteps, asked_sparsely


class Spots:
    """Collision detection of a point in the plane of two joints, a metre a radian, against points that are laid."""

    reach = 3.0

    def __init__(self, spots, laid_at):
        self.spots, self.laid_at, self.looked_at = spots, laid_at, 0

    def travel_bound(self, radius, a, b):
        return np.linalg.norm(b - a, axis=1)

    def distance(self, q, laid):
        apart = np.linalg.norm(q[:, None] - self.spots, axis=2)
        return np.where(self.laid_at < np.asarray(laid)[:, None], apart, np.inf).min(axis=1)

    def clearances(self, q, stage):
        self.looked_at += len(q)
        near = self.distance(q, stage)
        none = np.full((len(q), 2), -1)
        return Clearances(np.where(near <= self.reach, near, np.inf), none, np.full((len(q), 3), np.nan))


def steps_of(q, stage, apart):
    step = np.flatnonzero(apart[:-1] == apart[1:])
    nothing = np.zeros(len(step))
    return OpenSteps(step, q[step], q[step + 1], nothing, nothing, np.maximum(stage[step], stage[step + 1]))


def test_no_step_is_passed_on_which_something_is_nearer():
    rng = np.random.default_rng(0)
    looked_at = met = 0
    for _ in range(80):
        q = np.cumsum(rng.normal(size=(60, 2)) * 0.1, axis=0)
        apart, stage = np.arange(60) // 30, np.arange(60) // rng.integers(7, 60)
        spots = Spots(q[rng.integers(60, size=3)] + rng.normal(size=(3, 2)) * 0.5, rng.integers(-1, 6, 3))
        steps = steps_of(q, stage, apart)
        travel, limit = spots.travel_bound(None, q[:-1], q[1:]), rng.uniform(0.05, 0.5)
        left = asked_sparsely(spots, q, steps, travel, limit)
        looked_at += spots.looked_at
        for k, laid in zip(steps.step.tolist(), steps.laid.tolist(), strict=True):
            way = q[k] + np.linspace(0, 1, 50)[:, None] * (q[k + 1] - q[k])
            near = spots.distance(way, np.full(50, laid)).min()
            if near < limit:
                met += 1
                assert k in left.step
        for ends, low in ((left.a, left.da), (left.b, left.db)):
            # where something is open, what is said of its ends is true of them
            assert (low <= spots.distance(ends, left.laid) + 1e-12).all()
    assert met > 300
    assert looked_at < 0.6 * 80 * 60  # of all samples


def test_where_all_is_far_two_looks_a_motion_are_enough():
    q = np.linspace(0, 1, 200)[:, None] * np.ones(2)
    spots = Spots(np.array([[2.0, 0.0]]), np.array([-1]))
    apart = np.arange(200) // 100
    left = asked_sparsely(spots, q, steps_of(q, 0 * apart, apart), spots.travel_bound(None, q[:-1], q[1:]), 0.1)
    assert len(left.step) == 0
    assert spots.looked_at == 4


def test_of_no_steps_none_remain():
    q = np.zeros((1, 2))
    nothing = steps_of(q, np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64))
    spots = Spots(np.zeros((1, 2)), np.array([-1]))
    assert len(asked_sparsely(spots, q, nothing, np.zeros(0), 0.1).step) == 0
