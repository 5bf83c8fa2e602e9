"""The lighter search through rolls and branches, against every way there is and against all turns of the joints."""

from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.cells.arms import kr70

from ik.bead_path import OTHERS
from ik.bead_path_quick import Bounds, cheapest, lowest_angles, prices, steadiest, with_whole_turns
from ik.joint_turns import with_turns
from ik.roll import wrap

CHAIN = kr70()
SPEED = np.array([2.0, 1.5, 2.0, 3.0, 3.0, 4.0])


@given(seed=st.integers(0, 10**6))
@settings(max_examples=60, deadline=None)
def test_standings_are_the_lowest_of_all_turns(seed):
    rng = np.random.default_rng(seed)
    raw = rng.uniform(-np.pi, np.pi, (3, 2, 4, 6))
    raw[..., 1:3] = rng.uniform(CHAIN.lower[1:3] - 0.3, CHAIN.upper[1:3] + 0.3, (3, 2, 4, 2))
    raw[rng.random((3, 2, 4)) < 0.2] = np.nan
    q, inside, room = lowest_angles(CHAIN, raw)
    every = np.swapaxes(with_turns(CHAIN, raw), 1, 2)  # (t, g, r, k, j)
    exists = np.isfinite(every[..., 0])
    assert np.array_equal(inside, exists.any(axis=-1))
    lowest = np.nanmin(np.where(exists[..., None], every, np.inf), axis=-2)[inside]
    assert np.moveaxis(q, 0, -1)[inside] == pytest.approx(lowest, abs=1e-8)
    best = np.where(exists, np.minimum(every - CHAIN.lower, CHAIN.upper - every).min(axis=-1), -np.inf).max(axis=-1)
    assert room[inside] == pytest.approx(best[inside], abs=1e-8)


def way_price(q, rolls, bounds, circular, shifts, way):
    """Price of (group, samples) edge by edge, infinite where it is not allowed."""
    g, samples = way
    total = 0.0
    for i, (a, b) in enumerate(pairwise(samples)):
        shift = b - a
        if circular:
            count = rolls.shape[1]
            shift = (shift + count // 2) % count - count // 2
        move = np.abs(q[:, i + 1, g, b] - q[:, i, g, a])
        move[5] = abs(wrap(move[5]))  # of this arm, A6 alone turns more than once
        turn = abs(wrap(rolls[i + 1, b] - rolls[i, a]))
        needed = move / bounds.speed
        if shift not in shifts or move.max() > bounds.largest[i] or needed.max() > bounds.times[i]:
            return np.inf
        if turn > bounds.roll_step[i] + 1e-9:
            return np.inf
        total += needed.max() + OTHERS * needed.sum() + bounds.roll_price * turn
    return total


@given(seed=st.integers(0, 10**6), circular=st.booleans())
@settings(max_examples=40, deadline=None)
def test_the_way_found_is_the_cheapest_there_is(seed, circular):
    rng = np.random.default_rng(seed)
    t, g, count = int(rng.integers(2, 5)), 2, 4
    q = rng.uniform(-0.5, 0.5, (6, t, g, count))
    q[5] += rng.choice([0.0, 2 * np.pi], (t, g, count))
    cost = np.where(rng.random((t, g, count)) < 0.3, np.inf, rng.random((t, g, count)))
    rolls = np.broadcast_to(2 * np.pi * np.arange(count) / count, (t, count))
    bounds = Bounds(SPEED, rng.uniform(0.2, 1.0, t - 1), np.full(t - 1, 0.9), 0.2, np.full(t - 1, 2 * np.pi / count))
    shifts = np.array([-1, 0, 1])
    found = cheapest(cost, prices(CHAIN, q, rolls, bounds, shifts, circular=circular), shifts)

    def total(way):
        group, samples = way
        stand = sum(cost[i, group, r] for i, r in enumerate(samples))
        return stand + way_price(q, rolls, bounds, circular, shifts.tolist(), way)

    ways = [(k, samples) for k in range(g) for samples in product(range(count), repeat=t)]
    best = min(total(way) for way in ways)
    assert (found is None) == np.isinf(best)
    if found is not None:
        assert total((found[0], found[1].tolist())) == pytest.approx(best)


def test_whole_turns_come_out_of_the_way():
    # A6 goes round by 400 degrees; its range is 700
    way = np.zeros((41, 6))
    way[:, 5] = np.deg2rad(-150 + 10.0 * np.arange(41))
    lowest = way.copy()
    lowest[:, 5] = CHAIN.lower[5] + (way[:, 5] - CHAIN.lower[5]) % (2 * np.pi)
    q = with_whole_turns(CHAIN, lowest, None)
    assert np.abs(np.diff(q, axis=0)).max() == pytest.approx(np.deg2rad(10))
    assert np.all(q >= CHAIN.lower)
    assert np.all(q <= CHAIN.upper)
    assert np.abs(wrap(q - lowest)).max() < 1e-9
    # it begins at the turn nearest to where the arm comes from, as far as the way leaves a choice
    short = lowest[:5]
    for before in (np.deg2rad(-160.0), np.deg2rad(200.0)):
        near = with_whole_turns(CHAIN, short, np.array([0, 0, 0, 0, 0, before]))
        assert abs(near[0, 5] - before) <= np.pi
    # twice round is more than it has
    way = np.tile(way, (2, 1))
    way[:, 5] = np.deg2rad(-340 + 10.0 * np.arange(82))
    lowest = way.copy()
    lowest[:, 5] = CHAIN.lower[5] + (way[:, 5] - CHAIN.lower[5]) % (2 * np.pi)
    assert with_whole_turns(CHAIN, lowest, None) is None


def test_a_roll_that_is_best_held_is_what_the_search_of_all_finds():
    told = 0
    for seed in range(300):
        rng = np.random.default_rng(seed)
        t, g, count = int(rng.integers(1, 12)), 2, 4
        # smooth in time, as along a bead, with some nodes that are forbidden
        q = rng.uniform(-0.5, 0.5, (6, 1, g, count)) + np.cumsum(rng.normal(scale=0.01, size=(6, t, g, count)), axis=1)
        cost = rng.random((1, g, count)) * rng.choice([0.001, 0.05]) + rng.random((t, g, count)) * rng.choice(
            [0.0, 0.02]
        )
        cost[rng.random(cost.shape) < rng.choice([0.0, 0.05])] = np.inf
        rolls = np.broadcast_to(0.3 * np.arange(count), (t, count))
        bounds = Bounds(SPEED, np.full(t - 1, 1.0), np.full(t - 1, 0.9), 0.2, np.full(t - 1, 0.3))
        shifts = np.array([-1, 0, 1])
        best = cheapest(cost, prices(CHAIN, q, rolls, bounds, shifts, circular=False), shifts)
        stay = prices(CHAIN, q, rolls, bounds, np.array([0]), circular=False)
        found = steadiest(cost, stay, 0.2 * 0.3)
        if found is not None:
            told += 1
            assert best is not None
            assert found[0] == best[0]
            assert np.array_equal(found[1], best[1])
            assert (np.diff(found[1]) == 0).all()
    assert 100 < told < 290
