"""Damped least squares: what it calls found is found, it finds what there is, and the batch changes nothing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.cells.arms import kr70, offset_wrist_arm, replaced, sampled, seven_joint_arm, welder

from ik import closed_form, dls, spherical_wrist
from ik.chain import Floats
from ik.dls_kernel import Tool
from ik.joint_turns import excess
from ik.roll import RollWindow, apply_roll, roll_of, wrap
from ik.solver import Solver

FULL = RollWindow.fixed(0.0)


def task_error(Ts_target: Floats, Ts_tcp: Floats, window: RollWindow) -> Floats:
    """Twist from the TCP to its target, in the TCP's frame.

    Args:
        Ts_target: targets at roll 0, (m, 4, 4).
        Ts_tcp: (m, 4, 4).
        window: allowed roll; inside it the roll is no error.

    Returns:
        (m, 6): translation (m), then rotation vector (rad) whose z part is the roll's excess.
    """
    e = dls._error(Tool(*Ts_tcp[:, :3].transpose(2, 1, 0)), Ts_target[:, :3].transpose(2, 1, 0), window, 0.0)
    out = np.zeros((len(Ts_tcp), 6))
    out[:, :3] = np.einsum("mij,im->mj", Ts_tcp[:, :3, :3], e[:3])
    out[:, 3 : len(e)] = e[3:].T
    return out


def check_found(chain, found, Ts, window):
    """Every configuration called ok is inside the limits and on its target."""
    m, s, n = found.q.shape
    assert (found.q >= chain.lower).all()
    assert (found.q <= chain.upper).all()
    at = chain.forward(found.q.reshape(-1, n)).reshape(m, s, 4, 4)[found.ok]
    wanted = np.broadcast_to(Ts[:, None], (m, s, 4, 4))[found.ok]
    assert np.abs(at[:, :3, 3] - wanted[:, :3, 3]).max() < 2e-7
    assert np.abs(at[:, :3, 2] - wanted[:, :3, 2]).max() < 2e-7
    assert np.abs(window.excess(roll_of(wanted, at))).max() < 2e-7


WINDOWS = {"free": RollWindow.free(), "fixed": RollWindow.fixed(0.4), "range": RollWindow(-0.3, 0.8)}


@pytest.mark.parametrize("arm", [kr70, welder, offset_wrist_arm, seven_joint_arm])
@pytest.mark.parametrize("window", WINDOWS.values(), ids=WINDOWS)
def test_what_is_called_found_is_there(arm, window):
    chain = arm()
    inside = 0.5 if chain.n == 6 else 0.0
    Ts = apply_roll(
        chain.forward(sampled(chain, 40, seed=1, inside=inside)), -np.full(40, window.low / 2 + window.high / 2)
    )
    found = dls.solve(chain, Ts, window)
    check_found(chain, found, Ts, window)
    assert found.ok.any(axis=1).mean() >= 0.9


def test_full_poses_are_found_from_sixteen_seeds():
    Ts = welder().forward(sampled(welder(), 300, seed=2))
    found = dls.solve(welder(), Ts, FULL, seeds=16)
    assert found.ok.any(axis=1).mean() >= 0.98
    assert found.ok[:, :8].any(axis=1).mean() >= 0.95
    assert found.ok.mean() >= 0.5


@pytest.mark.slow
@pytest.mark.parametrize("window", WINDOWS.values(), ids=WINDOWS)
def test_hardly_any_of_many_targets_is_missed(window):
    chain = welder()
    Ts = apply_roll(chain.forward(sampled(chain, 3000, seed=11)), np.full(3000, -window.low / 2 - window.high / 2))
    found = dls.solve(chain, Ts, window)
    check_found(chain, found, Ts, window)
    assert found.ok.any(axis=1).mean() >= 0.99


def random_targets(chain, count, seed):
    """Targets around the arm, many of them out of its reach."""
    rng = np.random.default_rng(seed)
    Ts = chain.forward(sampled(chain, count, seed))
    Ts[:, :3, 3] = rng.uniform([-2, -2, -0.5], [2, 2, 2.2], (count, 3))
    return Ts


def reachable_by_closed_form(chain, Ts, rolls):
    form = spherical_wrist.recognise(chain)
    q = closed_form.solve(form, apply_roll(Ts[:, None], rolls))
    return (excess(chain, q) <= 0).all(axis=-1).any(axis=(1, 2))


def test_free_roll_targets_are_found_where_the_closed_form_gets_there():
    chain = welder()
    Ts = random_targets(chain, 300, seed=3)
    possible = reachable_by_closed_form(chain, Ts, RollWindow.free().samples(np.deg2rad(5)))
    assert 0.2 < possible.mean() < 0.95
    found = dls.solve(chain, Ts, RollWindow.free(), seeds=16)
    assert found.ok.any(axis=1)[possible].mean() >= 0.99


def test_the_unreachable_is_never_found():
    chain = welder()
    form = spherical_wrist.recognise(chain)
    Ts = random_targets(chain, 300, seed=4)
    beyond = np.abs(closed_form.reach_excess(form, Ts)) > 1e-6
    assert beyond.sum() > 20
    assert not dls.solve(chain, Ts[beyond], FULL).ok.any()
    # within reach, but not within the limits
    outside = ~beyond & (excess(chain, closed_form.solve(form, Ts)) > 1e-6).any(axis=-1).all(axis=1)
    assert outside.sum() > 5
    assert not dls.solve(chain, Ts[outside], FULL).ok.any()


def test_every_solution_is_one_of_the_closed_forms():
    chain = welder()
    Ts = chain.forward(sampled(chain, 120, seed=5, inside=np.deg2rad(3)))
    found = dls.solve(chain, Ts, FULL)
    q = closed_form.solve(spherical_wrist.recognise(chain), Ts)
    gap = np.abs(wrap(found.q[:, :, None] - q[:, None])).max(axis=-1)
    nearest = np.where(np.isnan(gap), np.inf, gap).min(axis=2)[found.ok]
    # the tolerance of 1e-7 m grows where the arm is close to a singularity
    assert np.quantile(nearest, 0.99) < 1e-5
    assert nearest.max() < 1e-2


@pytest.mark.parametrize("window", WINDOWS.values(), ids=WINDOWS)
def test_batch_is_loop(window):
    chain = welder()
    Ts = random_targets(chain, 150, seed=6)  # 2400 rows: more than are worked on at a time
    whole = dls.solve(chain, Ts, window)
    for i in (0, 1, 77, 149):
        one = dls.solve(chain, Ts[i : i + 1], window)
        np.testing.assert_array_equal(one.q[0], whole.q[i])
        np.testing.assert_array_equal(one.ok[0], whole.ok[i])
    few = dls.solve(chain, Ts[40:50], window, seeds=3)
    np.testing.assert_array_equal(few.q, whole.q[40:50, :3])
    lone = dls.solve(chain, Ts[5:6], window, seeds=1)
    np.testing.assert_array_equal(lone.q[0], whole.q[5, :1])


def test_enough_leaves_out_seeds_and_changes_nothing_else():
    chain = welder()
    Ts = random_targets(chain, 60, seed=7)
    whole, first = dls.solve(chain, Ts, FULL), dls.solve(chain, Ts, FULL, enough=1)
    np.testing.assert_array_equal(first.ok.any(axis=1), whole.ok.any(axis=1))
    tried = np.isfinite(first.position_error)
    assert tried.mean() < 0.9
    np.testing.assert_array_equal(first.q[tried], whole.q[tried])
    assert not first.ok[~tried].any()
    one = dls.solve(chain, Ts[9:10], FULL, enough=1)
    np.testing.assert_array_equal(one.q[0], first.q[9])


def test_no_targets_and_one_seed():
    chain = kr70()
    assert dls.solve(chain, np.empty((0, 4, 4)), FULL).q.shape == (0, 16, 6)
    assert dls.track_one(chain, np.empty((0, 4, 4)), np.empty((0, 6)), FULL).q.shape == (0, 6)
    assert dls.solve(chain, np.eye(4)[None], FULL, seeds=1).q.shape == (1, 1, 6)


def test_a_guess_on_its_target_stays():
    chain = kr70()
    q = sampled(chain, 50, seed=8)
    found = dls.track_one(chain, chain.forward(q), q, FULL)
    assert found.ok.all()
    np.testing.assert_allclose(found.q, q, atol=1e-9)


def test_following_stays_near_its_guess_and_inside_the_limits():
    chain = welder()
    q = sampled(chain, 200, seed=9, inside=np.deg2rad(5))
    q[:, 4] = np.where(np.abs(q[:, 4]) < 0.3, 0.8, q[:, 4])
    guess = q + np.random.default_rng(9).normal(scale=0.002, size=q.shape)
    found = dls.track_one(chain, chain.forward(q), guess, FULL)
    assert found.ok.all()
    assert np.median(np.abs(found.q - q).max(axis=1)) < 1e-8
    assert (np.abs(found.q - guess).max(axis=1) < 0.2).mean() > 0.98


def test_following_never_jumps_a_whole_turn():
    chain = kr70()
    q = np.deg2rad([[0, -90, 90, 179.9, 40, 0.0]])
    T = chain.forward(np.deg2rad([[0, -90, 90, 180.5, 40, 0.0]]))  # just beyond A4's limit
    found = dls.track_one(chain, T, q, FULL)
    assert not found.ok.any()
    assert abs(found.q[0, 3] - q[0, 3]) < 0.3


def test_a_guess_that_is_no_number_is_not_found():
    chain = kr70()
    q = np.full((1, 6), np.nan)
    assert not dls.track_one(chain, chain.forward(np.zeros((1, 6))), q, FULL).ok.any()


@given(turn=st.floats(-3.1, 3.1), roll=st.floats(-3.1, 3.1), seed=st.integers(0, 1000))
@settings(max_examples=60, deadline=None)
def test_the_error_vanishes_at_the_target_alone(turn, roll, seed):
    chain = kr70()
    T = chain.forward(sampled(chain, 1, seed=seed))
    window = RollWindow(-0.5, 0.25)
    e = task_error(T, apply_roll(T, np.array([roll])), window)
    np.testing.assert_allclose(e[:, :5], 0.0, atol=1e-7)
    np.testing.assert_allclose(e[0, 5], -window.excess(np.array(roll)), atol=1e-9)
    bent = T.copy()
    c, s = np.cos(turn), np.sin(turn)
    bent[0, :3, :3] = T[0, :3, :3] @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    e = task_error(bent, T, window)
    np.testing.assert_allclose(e[0, 3:5], [0.0, turn], atol=1e-9)
    np.testing.assert_allclose(e[0, 5], 0.0, atol=1e-6)


def test_an_opposed_wire_is_half_a_turn_away():
    T = kr70().forward(sampled(kr70(), 5, seed=3))
    flipped = T @ np.diag([1.0, -1.0, -1.0, 1.0])
    for window in WINDOWS.values():
        e = task_error(flipped, T, window)
        assert np.isfinite(e).all()
        np.testing.assert_allclose(np.linalg.norm(e[:, 3:5], axis=1), np.pi, atol=1e-9)


def test_seeds_are_spread_inside_the_limits_and_repeat():
    chain = welder()
    seeds = dls.seeds_within_limits(chain, 64)
    assert ((seeds > chain.lower) & (seeds < chain.upper)).all()
    np.testing.assert_allclose(seeds[0], (chain.lower + chain.upper) / 2)
    np.testing.assert_array_equal(dls.seeds_within_limits(chain, 16), seeds[:16])
    assert np.abs(dls.seeds_within_limits(chain, 16, rng_seed=1) - seeds[:16])[1:].min() > 0
    # each half of each joint's range gets its share
    assert (np.abs((seeds > seeds[0]).mean(axis=0) - 0.5) < 0.1).all()


def test_a_target_across_a_limit_of_a_whole_turn_is_found():
    # A4 cannot pass 180 degrees; the start must come round the other way
    chain = replaced(kr70(), lower=kr70().lower.copy(), upper=kr70().upper.copy())
    Ts = chain.forward(np.deg2rad([[10, -80, 80, a, 50, 20.0] for a in (-179.9, -179, 179, 179.9)]))
    assert dls.solve(chain, Ts, FULL).ok.any(axis=1).all()


def test_candidates_of_both_solvers_agree():
    chain = welder()
    Ts = chain.forward(sampled(chain, 40, seed=10, inside=np.deg2rad(4)))
    exact = Solver.for_chain(chain, "closed_form").candidates(Ts)
    found = Solver.for_chain(chain, "dls").candidates(Ts)
    assert exact.exhaustive
    assert not found.exhaustive
    assert exact.q.shape[1] == 8
    assert found.q.shape[1] == 1
    hits = 0
    for mine, all_there_is in zip(found.q[:, 0], exact.q.reshape(len(Ts), -1, 6), strict=True):
        mine, all_there_is = mine[np.isfinite(mine[:, 0])], all_there_is[np.isfinite(all_there_is[:, 0])]
        gap = np.abs(mine[:, None] - all_there_is).max(axis=-1)
        assert len(mine) <= len(all_there_is)
        assert (gap.min(axis=1, initial=np.inf) < 1e-2).all()
        hits += (gap.min(axis=0, initial=np.inf) < 1e-2).sum()
    # whole turns included, most of what there is
    assert hits > 0.7 * exact.valid.sum()


def test_a_solver_is_chosen_by_the_arm():
    assert Solver.for_chain(kr70()).name == "closed form"
    assert Solver.for_chain(seven_joint_arm()).name == "damped least squares"
    assert Solver.for_chain(kr70(), "dls").geometry is not None
    with pytest.raises(ValueError, match="closed_form"):
        Solver.for_chain(offset_wrist_arm(), "closed_form")
    with pytest.raises(ValueError, match="allowed are"):
        Solver.for_chain(kr70(), "newton")
