"""Limits and whole turns, the roll about the wire, distances from singularities."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.cells.arms import kr70, offset_wrist_arm, random_class_arm, replaced, sampled, seven_joint_arm, welder

from ik.joint_turns import excess, turn_combinations, with_turns
from ik.roll import RollWindow, apply_roll, roll_of, wrap
from ik.singularity import KINDS, SingularityLimits, least_singular_value, margins, smallest_singular_value
from ik.spherical_wrist import recognise

TURN = 2 * np.pi
ANGLES = st.floats(-20.0, 20.0)


def every_standing(chain, q):
    """Brute force: all whole turns of all joints that are inside the limits, as a set of rounded tuples."""
    found = [[]]
    for angle, low, high in zip(q, chain.lower, chain.upper, strict=True):
        turns = [angle + TURN * k for k in range(-6, 7)]
        here = [a for a in turns if low - 1e-9 <= a <= high + 1e-9]
        found = [[*row, a] for row in found for a in here]
    return {tuple(np.round(row, 6)) for row in found}


@given(q=st.lists(ANGLES, min_size=6, max_size=6), packed=st.booleans())
@settings(max_examples=200, deadline=None)
def test_standings_are_all_the_turns_inside_the_limits(q, packed):
    chain = kr70()
    out = with_turns(chain, np.array(q), packed=packed)
    out = out[np.isfinite(out[:, 0])]
    assert chain.within(out).all()
    assert {tuple(np.round(row, 6)) for row in out} == every_standing(chain, q)
    assert len(out) == len(every_standing(chain, q))


@given(q=st.lists(ANGLES, min_size=6, max_size=6))
@settings(max_examples=200, deadline=None)
def test_excess_is_the_distance_to_the_nearest_turn_inside(q):
    chain, q = kr70(), np.array(q)
    over = excess(chain, q)
    turns = q[:, None] + TURN * np.arange(-6, 7)
    away = np.maximum(np.maximum(chain.lower[:, None] - turns, turns - chain.upper[:, None]), 0.0).min(axis=1)
    np.testing.assert_allclose(over, away, atol=1e-9)
    assert np.isfinite(with_turns(chain, q)).any() == (over <= 1e-9).all()


def test_a_range_of_exactly_one_turn_has_two_standings_at_its_end_and_one_inside():
    chain = kr70()
    q = np.deg2rad([0, -90, 90, 180, 30, 100.0])
    out = with_turns(chain, q)
    a4 = np.rad2deg(out[np.isfinite(out[:, 0])][:, 3])
    assert sorted(set(np.round(a4))) == [-180, 180]
    q[3] = np.deg2rad(179)
    out = with_turns(chain, q)
    np.testing.assert_allclose(np.rad2deg(out[np.isfinite(out[:, 0])][:, 3]), 179)


def test_a6_stands_twice_where_350_degrees_allow_it():
    chain = kr70()
    for a6, allowed in ((100, [-260, 100]), (355, [-5]), (-5, [-5]), (9, [9]), (11, [-349, 11]), (0, [0])):
        out = with_turns(chain, np.deg2rad([0, -90, 90, 30, 30, a6]), packed=True)
        got = sorted(np.round(np.rad2deg(out[np.isfinite(out[:, 0])][:, 5]), 6))
        np.testing.assert_allclose(got, allowed, atol=1e-6)


def test_a_hair_outside_is_put_on_the_limit_and_more_is_refused():
    chain = kr70()
    q = np.zeros(6)
    q[1] = chain.upper[1] + 5e-10
    out = with_turns(chain, q, packed=True)
    assert (out[..., 1][np.isfinite(out[..., 1])] == chain.upper[1]).all()
    q[1] = chain.upper[1] + 1e-6
    assert np.isnan(with_turns(chain, q)).all()
    np.testing.assert_allclose(excess(chain, q), [0, 1e-6, 0, 0, 0, 0], atol=1e-12)


def test_no_number_stays_none():
    q = np.full((3, 2, 6), np.nan)
    assert np.isnan(with_turns(kr70(), q)).all()
    assert np.isnan(excess(kr70(), q)).all()
    assert with_turns(kr70(), q, packed=True).shape == (3, 2, 1, 6)
    assert with_turns(kr70(), q).shape == (3, 2, len(turn_combinations(kr70())), 6)
    assert with_turns(kr70(), np.empty((0, 6)), packed=True).shape == (0, 1, 6)


@given(angle=st.floats(-1e4, 1e4))
def test_wrapping_takes_whole_turns_away(angle):
    out = float(wrap(np.array(angle)))
    assert -np.pi - 1e-9 <= out <= np.pi + 1e-9
    turns = (angle - out) / TURN
    assert abs(turns - round(turns)) < 1e-9


@given(low=st.floats(-3.0, 3.0), width=st.floats(0.0, 7.0), step=st.floats(0.05, 2.0))
def test_samples_cover_their_window(low, width, step):
    window = RollWindow(low, low + width)
    rolls = window.samples(step)
    assert np.all(window.excess(rolls) == 0) or np.abs(window.excess(rolls)).max() < 1e-12
    ring = window.is_full
    gaps = np.diff(np.append(rolls, rolls[0] + TURN) if ring else rolls)
    assert (gaps <= step + 1e-9).all()
    if not ring:
        assert rolls[0] == window.low
        assert rolls[-1] == pytest.approx(window.high)


@given(low=st.floats(-6.0, 6.0), width=st.floats(0.0, 6.2), roll=ANGLES)
def test_excess_brings_a_roll_to_the_nearer_end(low, width, roll):
    window = RollWindow(low, low + width)
    off = float(window.excess(np.array(roll)))
    inside = (roll - low) % TURN <= width
    if off == 0:
        assert inside or min((low - roll) % TURN, (roll - low - width) % TURN) < 1e-9
        return
    end = wrap(np.array(roll - off - (window.high if off > 0 else window.low)))
    assert abs(end) < 1e-9
    assert abs(off) <= (TURN - width) / 2 + 1e-9


def test_windows_that_make_no_sense_are_refused():
    for low, high in ((1.0, 0.0), (np.nan, 1.0), (0.0, np.inf)):
        with pytest.raises(ValueError, match="roll range"):
            RollWindow(low, high)
    assert RollWindow.free().is_full
    assert RollWindow.fixed(0.3).is_fixed
    assert not RollWindow(-1, 1).is_full


@given(roll=st.floats(-3.1, 3.1), more=st.floats(-3.1, 3.1))
@settings(deadline=None)
def test_rolls_add_up_about_the_wire(roll, more):
    T = kr70().forward(sampled(kr70(), 4, seed=1))
    once = apply_roll(T, np.full(4, roll))
    np.testing.assert_allclose(once[:, :3, 2:], T[:, :3, 2:])
    np.testing.assert_allclose(roll_of(T, once), roll, atol=1e-9)
    np.testing.assert_allclose(apply_roll(once, np.full(4, more)), apply_roll(T, np.full(4, roll + more)), atol=1e-12)
    assert apply_roll(T[:, None], np.zeros(7)).shape == (4, 7, 4, 4)


@pytest.mark.parametrize("seed", range(6))
def test_a_margin_is_zero_exactly_where_the_jacobian_is_singular(seed):
    rng = np.random.default_rng(seed)
    chain = [kr70(), welder()][seed] if seed < 2 else random_class_arm(rng, bent_wrist=seed >= 4)
    form = recognise(chain)
    q = sampled(chain, 4000, seed)
    m, sigma = margins(chain, form, q)[:, :3], smallest_singular_value(chain, q)
    # the determinant is their product times a constant of the arm; it vanishes with them and only with them
    det = np.abs(np.linalg.det(chain.jacobian(q)))
    ratio = det / np.prod([np.sin(m[:, 0]), np.sin(m[:, 1]), m[:, 2]], axis=0)
    np.testing.assert_allclose(ratio, np.median(ratio), rtol=1e-6)
    assert np.median(ratio) > 1e-3
    assert sigma[m.min(axis=1) > 0.3].min(initial=1.0) > 1e-3
    # and put on a singularity, each is zero with the singular value
    onto = q[:50].copy()
    onto[:, 4] = form.wrist.base
    np.testing.assert_allclose(margins(chain, form, onto)[:, 0], 0.0, atol=1e-9)
    np.testing.assert_allclose(smallest_singular_value(chain, onto), 0.0, atol=1e-9)
    onto = q[:50].copy()
    onto[:, 2] = form.sign_3 * (np.angle(form.upper_arm) - np.angle(form.forearm))
    np.testing.assert_allclose(margins(chain, form, onto)[:, 1], 0.0, atol=1e-9)
    np.testing.assert_allclose(smallest_singular_value(chain, onto), 0.0, atol=1e-9)


def test_margins_of_known_configurations():
    chain = kr70()
    form = recognise(chain)
    wrist, elbow, shoulder, sigma = margins(chain, form, np.deg2rad([0, -90, 90, 0, -7, 200.0]))
    assert np.rad2deg(wrist) == pytest.approx(7.0)
    # the forearm is lifted by 50 mm over 1035
    assert np.rad2deg(elbow) == pytest.approx(90 - np.rad2deg(np.arctan2(0.05, 1.035)))
    assert shoulder == pytest.approx(0.175 + 1.035)
    assert np.isinf(sigma)
    assert np.isnan(margins(chain, form, np.full((2, 6), np.nan))[:, :3]).all()


@pytest.mark.parametrize("arm", [offset_wrist_arm, seven_joint_arm])
def test_other_arms_are_judged_by_their_singular_value(arm):
    chain = arm()
    q = sampled(chain, 10, seed=1)
    q[3] = np.nan
    m = margins(chain, None, q.reshape(2, 5, chain.n)).reshape(10, 4)
    good = np.isfinite(q).all(axis=1)
    np.testing.assert_allclose(m[good, 3], smallest_singular_value(chain, q[good]))
    assert np.isnan(m[3, 3])
    assert np.isinf(m[:, :3]).all()


def test_limits_that_do_not_apply_ask_for_nothing():
    limits = SingularityLimits()
    assert len(KINDS) == 4
    assert np.isneginf(limits.values(True)[3])
    assert np.isneginf(limits.values(False)[:3]).all()
    assert limits.values(True)[2] == limits.shoulder


def test_the_singular_value_has_no_unit():
    chain = kr70()
    origins, T = chain.origins.copy(), chain.T_last_tcp.copy()
    origins[:, :3, 3] *= 1000
    T[:3, 3] *= 1000
    q = sampled(chain, 20, seed=2)
    in_mm = replaced(chain, origins=origins, T_last_tcp=T)
    np.testing.assert_allclose(smallest_singular_value(in_mm, q), smallest_singular_value(chain, q), rtol=1e-9)


@pytest.mark.parametrize("step", [1e-3, 0.02, 0.3])
def test_the_least_singular_value_of_a_way_is_that_of_all_of_it(step):
    for seed in range(20):
        chain = kr70() if seed % 2 else welder()
        start = sampled(chain, 1, seed)
        q = start + np.cumsum(np.random.default_rng(seed).normal(scale=step, size=(61 + seed, chain.n)), axis=0)
        assert least_singular_value(chain, q) == smallest_singular_value(chain, q).min()
        assert least_singular_value(chain, q[:1]) == smallest_singular_value(chain, q[:1]).min()
