"""Ways along a bead, against every way there is on small graphs and on beads made to be cut."""

from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.cells.arms import kr70, welder

from ik import bead_path
from ik.bead_path import (
    COSTLY,
    KEPT_BYTES,
    LARGEST_STEP,
    OTHERS,
    ROLL_COST,
    TOGETHER,
    Allowance,
    KnownMoves,
    best_runs,
)
from ik.roll import RollWindow, apply_roll
from ik.solver import Solver


def edge_cost(q, times, speed, circular, blocked, i, a, b):
    """Cost of the edge from node a of target i to node b of target i + 1, infinite where there is none."""
    rolls = q.shape[1]
    step = abs(a[0] - b[0])
    step = min(step, rolls - step) if circular else step
    move = np.abs(q[i + 1][b] - q[i][a])
    if a[1] != b[1] or step > 1 or (a, b) in blocked.get(i, ()) or not np.isfinite(move).all():
        return np.inf
    needed = (move / speed).max()
    if move.max() > LARGEST_STEP or needed > times[i]:
        return np.inf
    return needed + OTHERS * (move / speed).sum() + ROLL_COST * step


def brute_force(q, cost, times, speed, circular, blocked, first, stop):
    """Cheapest way through targets first..stop-1 by trying all of them; infinite where there is none."""
    nodes = list(product(*(range(s) for s in q.shape[1:4])))
    nodes = [[node for node in nodes if np.isfinite(cost[i][node])] for i in range(first, stop)]
    best = np.inf
    for way in product(*nodes):
        total = sum(cost[first + i][node] for i, node in enumerate(way))
        for i, (a, b) in enumerate(pairwise(way)):
            total += edge_cost(q, times, speed, circular, blocked, first + i, a, b)
        best = min(best, total)
    return best


def random_graph(rng):
    t, r, g, k, n = rng.integers(1, 5), rng.integers(1, 5), rng.integers(1, 3), rng.integers(1, 3), rng.integers(1, 4)
    q = rng.uniform(-1, 1, (t, r, g, k, n))
    q[rng.random((t, r, g, k)) < 0.4] = np.nan
    open_nodes = np.isfinite(q[..., 0]) & (rng.random((t, r, g, k)) < 0.9)
    cost = np.where(open_nodes, rng.random((t, r, g, k)), np.inf)
    # keep every way countable
    for i in range(t):
        for node in np.argwhere(np.isfinite(cost[i]))[6:]:
            cost[i][tuple(node)] = np.inf
    times, speed = rng.uniform(0.3, 2, t - 1), rng.uniform(0.5, 2, n)
    blocked = {}
    for i in range(t - 1):
        ends = [tuple(int(rng.integers(s)) for s in (r, g, k, r, k)) for _ in range(4)]
        blocked[i] = {((r0, g0, k0), (r1, g0, k1)) for r0, g0, k0, r1, k1 in ends}
    return q, cost, times, speed, bool(rng.integers(2)) and r > 2, blocked


@given(seed=st.integers(0, 10**6))
@settings(max_examples=120, deadline=None)
def test_runs_are_the_cheapest_ways_and_none_can_be_longer(seed):
    rng = np.random.default_rng(seed)
    q, cost, times, speed, circular, blocked = graph = random_graph(rng)
    runs = best_runs(q, cost, times, speed, circular=circular, blocked=blocked)
    covered = [i for run in runs for i in range(run.start, run.stop)]
    assert covered == [i for i in range(len(q)) if np.isfinite(cost[i]).any()]
    for run in runs:
        nodes = [tuple(node) for node in run.nodes.tolist()]
        total = sum(cost[run.start + i][node] for i, node in enumerate(nodes))
        for i, (a, b) in enumerate(pairwise(nodes)):
            total += edge_cost(q, times, speed, circular, blocked, run.start + i, a, b)
        assert total == pytest.approx(run.cost)
        assert run.cost == pytest.approx(brute_force(*graph, run.start, run.stop))
        if run.stop < len(q):
            assert np.isinf(brute_force(*graph, run.start, run.stop + 1))


def as_told(runs):
    return [(run.start, run.nodes.tolist(), run.cost) for run in runs]


@pytest.mark.parametrize("most_bytes", [0, 200, KEPT_BYTES])
@given(seed=st.integers(0, 10**6))
@settings(max_examples=40, deadline=None)
def test_prices_that_are_known_from_searches_before_change_nothing(most_bytes, seed):
    rng = np.random.default_rng(seed)
    t, r, g, k = rng.integers(2, 7), rng.integers(1, 7), rng.integers(1, 4), rng.integers(1, 4)
    q = rng.uniform(-1, 1, (t, r, g, k, 2))
    cost, start = rng.random((t, r, g, k)), rng.random((r, g, k))
    cost[rng.random(cost.shape) < 0.2] = np.inf
    usual = Allowance(rng.uniform(0.2, 2, t - 1), rng.uniform(0.2, 2, t - 1))
    free = replace(usual, rolls=np.sort(rng.uniform(-3, 3, r)), turn=1.5, turn_price=0.3)
    options = {"circular": r > 2, "largest_step": 1.5, "allowance": free if rng.integers(2) else usual}
    options["start_cost"] = start if rng.integers(2) else None
    known, blocked = KnownMoves(int(most_bytes)), {}
    for _ in range(8):  # each time some nodes and some edges fewer, until the bead is cut here and there
        given_ = q, cost, np.full(t - 1, 3.0), np.array([1.0, 0.7])
        found = best_runs(*given_, **options, blocked=blocked, known=known)
        assert as_told(found) == as_told(best_runs(*given_, **options, blocked=blocked))
        for run in found:
            for i, (a, b) in enumerate(pairwise(tuple(map(tuple, run.nodes.tolist())))):
                if rng.random() < 0.5:
                    blocked.setdefault(run.start + i, set()).add((a, b))
        cost = np.where(rng.random(cost.shape) < 0.15, np.inf, cost)


def test_what_could_not_be_reached_before_is_priced_when_it_can_be():
    """Of many nodes, an edge is priced for those that are reached alone; behind a cut all of them are begun in."""
    rng, t, r, g, k = np.random.default_rng(0), 5, 80, 2, 5
    q, cost = rng.uniform(-0.1, 0.1, (t, r, g, k, 1)), rng.random((t, r, g, k))
    assert cost[0].size * k * 19 > TOGETHER  # edges are priced one by one
    cost[0, :, 1] = np.inf  # the other branch is not reached
    usual = np.full(t - 1, 3.0)
    turning = Allowance(usual, usual, rolls=np.linspace(-3.1, 3.1, r), turn=1.5, turn_price=0.3)
    known = KnownMoves()
    for _ in range(2):
        given_ = q, cost, usual, np.ones(1)
        found = best_runs(*given_, circular=True, allowance=turning, known=known)
        assert as_told(found) == as_told(best_runs(*given_, circular=True, allowance=turning))
        cost[2, :, 0] = np.inf  # now nothing leads beyond, and there the other branch is all there is
        cost[3:, :, 0] += 9.0
    assert [run.start for run in found] == [0, 2]
    assert (found[1].nodes[:, 1] == 1).all()


def test_prices_that_are_known_are_not_worked_out_again(monkeypatch):
    q, worked_out = line(0.0, 0.1, 0.2), []
    moves = bead_path._moves
    monkeypatch.setattr(bead_path, "_moves", lambda *given_: worked_out.append(1) or moves(*given_))
    known = KnownMoves()
    for _ in range(3):
        runs_of(q, known=known)
    assert len(worked_out) == 1


def test_a_search_goes_as_the_one_before_up_to_what_is_left_out_since(monkeypatch):
    q, passed = np.zeros((6, 4, 1, 1, 1)), []
    forward = bead_path._EdgePrices.forward
    monkeypatch.setattr(
        bead_path._EdgePrices, "forward", lambda self, i, *rest: passed.append(i) or forward(self, i, *rest)
    )
    known, cost = KnownMoves(), np.random.default_rng(1).random(q.shape[:4])

    def passes(**options):
        passed.clear()
        found = runs_of(q, cost, known=known, **options)
        again = passed.copy()
        assert as_told(found) == as_told(runs_of(q, cost, **options))
        return again

    assert passes() == [0, 1, 2, 3, 4]
    assert passes() == []
    nodes = [tuple(node) for node in runs_of(q, cost)[0].nodes.tolist()]
    assert passes(blocked={2: {(nodes[2], nodes[3])}}) == [2, 3, 4]
    cost[4, nodes[4][0]] = np.inf
    assert passes(blocked={2: {(nodes[2], nodes[3])}}) == [4]
    assert passes()[0] == 2, "a move that is open again"


def test_nodes_that_are_open_again_are_led_to():
    q, known = np.zeros((4, 1, 1, 2, 1)), KnownMoves()
    shut = np.zeros(q.shape[:4])
    shut[1:, ..., 1] = np.inf
    assert {run.stop for run in runs_of(q, shut, known=known)} == {4}
    cost = np.zeros(q.shape[:4])
    cost[1, ..., 0] = 1.0  # the other is cheaper now
    found = runs_of(q, cost, known=known)
    assert as_told(found) == as_told(runs_of(q, cost))
    assert found[0].nodes[1, 2] == 1


def cheapest_of_all(q, cost, times, speed, blocked):
    """Cost of the cheapest way along all targets, by all pairs of neighbouring nodes at once."""
    t, r, g, k, n = q.shape
    flat, here = q.reshape(t, -1, n), cost[0].reshape(-1)
    roll, group, _ = (x.reshape(-1) for x in np.indices((r, g, k)))
    apart = np.abs(roll[:, None] - roll)
    apart = np.minimum(apart, r - apart)
    for i in range(t - 1):
        move = np.abs(flat[i][:, None] - flat[i + 1])
        needed = (move / speed).max(axis=-1)
        price = needed + OTHERS * (move / speed).sum(axis=-1) + ROLL_COST * apart
        price[(apart > 1) | (group[:, None] != group) | (move.max(axis=-1) > LARGEST_STEP) | (needed > times[i])] = (
            np.inf
        )
        for a, b in blocked.get(i, ()):
            price[np.ravel_multi_index(a, (r, g, k)), np.ravel_multi_index(b, (r, g, k))] = np.inf
        here = (here[:, None] + price).min(axis=0) + cost[i + 1].reshape(-1)
    return float(here.min())


@pytest.mark.parametrize(("r", "g", "k"), [(1, 8, 8), pytest.param(24, 2, 2, marks=pytest.mark.slow)])
def test_a_long_bead_is_as_cheap_as_all_its_ways_say(r, g, k):
    # longer than what is priced at once, with more than one standing and group
    rng = np.random.default_rng(r)
    t = 3 * TOGETHER // (g * k * k * r * (1 if r == 1 else 3)) + 5
    base = np.cumsum(rng.normal(0, 0.1, (t, 1, 1, 1, 2)), axis=0)
    q = base + rng.uniform(-1, 1, (1, r, g, k, 2)) + rng.normal(0, 0.1, (t, r, g, k, 2))
    cost = np.where(rng.random((t, r, g, k)) < 0.8, rng.random((t, r, g, k)), np.inf)
    times, speed = rng.uniform(0.6, 2, t - 1), np.array([1.0, 0.7])
    plain = best_runs(q, cost, times, speed, circular=r > 2)[0]
    blocked = {i: {(tuple(plain.nodes[i].tolist()), tuple(plain.nodes[i + 1].tolist()))} for i in range(0, t - 1, 7)}
    (run,) = best_runs(q, cost, times, speed, circular=r > 2, blocked=blocked)
    assert len(run.nodes) == t
    assert run.cost == pytest.approx(cheapest_of_all(q, cost, times, speed, blocked), rel=1e-12)
    assert run.cost > plain.cost == pytest.approx(cheapest_of_all(q, cost, times, speed, {}), rel=1e-12)


def line(*angles, standings=1):
    """One joint, one roll, one group, one target an angle: (t, 1, 1, k, 1)."""
    return np.array(angles, dtype=float).reshape(len(angles), 1, 1, standings, 1)


def runs_of(q, cost=None, **options):
    cost = np.where(np.isfinite(q[..., 0]), 0.0, np.inf) if cost is None else cost
    options.setdefault("circular", False)
    return best_runs(q, cost, np.full(len(q) - 1, 1.0), np.ones(q.shape[-1]), **options)


def test_a_flip_halfway_cuts_the_bead_in_two():
    # reachable everywhere, but group 0 ends where group 1 begins
    q = np.full((6, 1, 2, 1, 1), np.nan)
    q[:3, 0, 0, 0, 0], q[3:, 0, 1, 0, 0] = [0.0, 0.1, 0.2], [0.3, 0.4, 0.5]
    runs = runs_of(q)
    assert [(run.start, run.stop) for run in runs] == [(0, 3), (3, 6)]
    assert [set(run.nodes[:, 1]) for run in runs] == [{0}, {1}]
    q[3, 0, 0, 0, 0] = 0.3  # an overlap of one target is not enough either
    assert [(run.start, run.stop) for run in runs_of(q)] == [(0, 4), (4, 6)]
    q[:3, 0, 1, 0, 0] = [0.0, 0.1, 0.2]  # group 1 all the way
    assert [(run.start, run.stop) for run in runs_of(q)] == [(0, 6)]


def test_a_jump_or_a_slow_joint_cuts_the_bead():
    assert len(runs_of(line(0.0, 0.5, 1.0))) == 1
    assert len(runs_of(line(0.0, 0.5, 0.5 + LARGEST_STEP + 0.01))) == 2
    slow = best_runs(line(0.0, 0.5), np.zeros((2, 1, 1, 1)), np.array([0.4]), np.ones(1), circular=False)
    assert len(slow) == 2
    # a velocity alone would let it through
    q = line(0.0, np.pi)
    assert len(best_runs(q, np.zeros((2, 1, 1, 1)), np.array([1e9]), np.ones(1), circular=False)) == 2


@pytest.mark.parametrize("dear_by", ["step", "time"])
def test_a_dear_edge_is_taken_only_where_others_cost_more(dear_by):
    # two groups: one moves by 0.5, the other by 0.1 but is worth avoiding
    q = np.array([[0.0, 0.0], [0.5, 0.1]]).reshape(2, 1, 2, 1, 1)
    step, time = (0.2, 9.0) if dear_by == "step" else (9.0, 0.2)
    allowance = Allowance(np.array([step]), np.array([time]))
    price = COSTLY + (COSTLY * (0.5 / 0.2 - 1.0) if dear_by == "time" else 0.0)
    for extra, group in ((price - 1.0, 1), (price + 1.0, 0)):
        cost = np.array([0.0, extra]).reshape(1, 1, 2, 1) * np.array([1.0, 0.0]).reshape(2, 1, 1, 1)
        (run,) = runs_of(q, cost, allowance=allowance)
        assert set(run.nodes[:, 1]) == {group}
        moved = (1 + OTHERS) * (0.1 if group else 0.5)
        assert run.cost == pytest.approx(moved + (extra if group else price))


def test_targets_without_nodes_belong_to_no_run():
    runs = runs_of(line(0.0, 0.1, np.nan, 0.3))
    assert [(run.start, run.stop) for run in runs] == [(0, 2), (3, 4)]
    assert runs_of(line(np.nan, np.nan)) == []


def test_a_cost_at_a_configuration_that_is_none_opens_nothing():
    q = line(0.0, np.nan, 0.2)
    assert [(run.start, run.stop) for run in runs_of(q, np.zeros((3, 1, 1, 1)))] == [(0, 1), (2, 3)]
    cost = np.zeros((3, 1, 1, 1))
    cost[1] = np.nan
    assert [run.start for run in runs_of(line(0.0, 0.1, 0.2), cost)] == [0, 2]


def test_a_blocked_edge_is_gone_round_or_cuts():
    q = line(0.0, 0.1, 0.2)
    assert len(runs_of(q, blocked={0: {((0, 0, 0), (0, 0, 0))}})) == 2
    # two standings: the way switches to the dearer one
    q = line([0.0, 0.1], [0.0, 0.1], [0.0, 0.1], standings=2)
    assert (runs_of(q)[0].nodes[:, 2] == runs_of(q)[0].nodes[0, 2]).all()
    block = {0: {((0, 0, 0), (0, 0, 0)), ((0, 0, 1), (0, 0, 1))}}
    run = runs_of(q, blocked=block)[0]
    assert len(run.nodes) == 3
    assert run.nodes[0, 2] != run.nodes[1, 2]


def test_the_roll_goes_round_where_it_may():
    # allowed rolls wander over the end of the circle: 3, then 0
    cost = np.full((2, 4, 1, 1), np.inf)
    cost[0, 3], cost[1, 0] = 0.0, 0.0
    q = np.zeros((2, 4, 1, 1, 1))
    assert len(runs_of(q, cost, circular=True)) == 1
    assert len(runs_of(q, cost, circular=False)) == 2
    cost[1, 0], cost[1, 1] = np.inf, 0.0  # two samples away
    assert len(runs_of(q, cost, circular=True)) == 2


def test_a_steady_roll_is_preferred():
    run = runs_of(np.zeros((5, 6, 1, 1, 1)), circular=True)[0]
    assert len(set(run.nodes[:, 0])) == 1
    assert run.cost == 0.0


def test_the_start_is_chosen_by_where_the_arm_comes_from():
    q = np.zeros((3, 4, 1, 1, 1))
    start = np.ones((4, 1, 1))
    start[2] = 0.0
    assert (runs_of(q, start_cost=start)[0].nodes[:, 0] == 2).all()
    start[:] = np.nan
    start[1] = 5.0
    run = runs_of(q, start_cost=start)[0]
    assert (run.nodes[0, 0], run.cost) == (1, 5.0)


def test_turns_of_the_last_joint_are_followed_across_180_degrees():
    chain = kr70()
    a6 = np.deg2rad(np.arange(100, 261, 10))
    q = np.tile(np.deg2rad([0, -80, 100, 20, 40, 0.0]), (len(a6), 1))
    q[:, 5] = a6
    candidates = Solver.for_chain(chain).candidates(chain.forward(q)).q[:, None]
    runs = best_runs(
        candidates,
        np.where(np.isfinite(candidates[..., 0]), 0.0, np.inf),
        np.full(len(a6) - 1, 10.0),
        np.ones(6),
        circular=False,
    )
    assert len(runs) == 1
    nodes = runs[0].nodes
    way = candidates[np.arange(len(a6)), nodes[:, 0], nodes[:, 1], nodes[:, 2]]
    np.testing.assert_allclose(np.abs(np.diff(way[:, 5])), np.deg2rad(10), atol=1e-6)
    np.testing.assert_allclose(chain.forward(way), chain.forward(q), atol=1e-9)


def test_a_circle_with_the_wire_down_is_welded_in_one_go():
    chain = welder()
    angle = np.linspace(0, 2 * np.pi, 40)
    Ts = np.tile(np.diag([1.0, -1.0, -1.0, 1.0]), (len(angle), 1, 1))
    Ts[:, :3, 3] = np.array([1.2, 0.0, 0.7]) + 0.2 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    rolls = RollWindow.free().samples(np.deg2rad(15))
    solver = Solver.for_chain(chain)
    q = solver.candidates(apply_roll(Ts[:, None], rolls).reshape(-1, 4, 4)).q
    q = q.reshape(len(Ts), len(rolls), *q.shape[1:])
    cost = np.where(np.isfinite(q[..., 0]), 0.0, np.inf)
    (run,) = best_runs(q, cost, np.full(len(Ts) - 1, 3.0), np.ones(6), circular=True)
    way = q[np.arange(len(Ts)), run.nodes[:, 0], run.nodes[:, 1], run.nodes[:, 2]]
    assert np.abs(np.diff(way, axis=0)).max() <= LARGEST_STEP
    at = chain.forward(way)
    np.testing.assert_allclose(at[:, :3, 3], Ts[:, :3, 3], atol=1e-9)
    np.testing.assert_allclose(at[:, :3, 2], Ts[:, :3, 2], atol=1e-9)
