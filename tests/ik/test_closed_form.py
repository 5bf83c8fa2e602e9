"""The closed form: all configurations, only true ones, for every arm of the class and none outside."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.cells.arms import (
    OPW,
    chain_from_lines,
    kr70,
    offset_wrist_arm,
    random_class_arm,
    random_pose,
    replaced,
    sampled,
    seven_joint_arm,
    welder,
    with_tool,
)

from ik.closed_form import reach_excess, solve, solve_branch, wrist_centre
from ik.roll import wrap
from ik.spherical_wrist import recognise


def form_of(chain):
    form = recognise(chain)
    assert form is not None
    return form


def worst_pose_error(chain, q, Ts):
    """Largest deviation of the poses of q (m, 8, 6) from Ts (m, 4, 4); counts what exists."""
    there = np.isfinite(q).all(axis=-1)
    wanted = np.broadcast_to(Ts[:, None], (*q.shape[:2], 4, 4))[there]
    return np.abs(chain.forward(q[there]) - wanted).max(), there


def distance_to_nearest(q, wanted):
    """For each row, how far the nearest of q (m, 8, 6) is from wanted (m, 6), whole turns aside."""
    return np.nanmin(np.abs(wrap(q - wanted[:, None])).max(axis=-1), axis=1)


@pytest.mark.parametrize("arm", [kr70, welder])
def test_every_solution_reaches_and_the_sampled_one_is_among_them(arm):
    chain = arm()
    wanted = sampled(chain, 2000, seed=1)
    Ts = chain.forward(wanted)
    q = solve(form_of(chain), Ts)
    error, there = worst_pose_error(chain, q, Ts)
    assert error < 1e-11
    assert there.sum() > 6 * len(Ts) / 2
    assert distance_to_nearest(q, wanted).max() < 1e-7


@given(seed=st.integers(0, 10**6), bent=st.booleans())
@settings(max_examples=60, deadline=None)
def test_random_arms_of_the_class(seed, bent):
    rng = np.random.default_rng(seed)
    chain = random_class_arm(rng, bent_wrist=bent)
    form = form_of(chain)
    wanted = rng.uniform(-3, 3, (40, 6))
    Ts = chain.forward(wanted)
    q = solve(form, Ts)
    error, _ = worst_pose_error(chain, q, Ts)
    assert error < 1e-9
    # near a singularity angles are as sharp as the square root of rounding
    assert distance_to_nearest(q, wanted).max() < 1e-5
    np.testing.assert_allclose(reach_excess(form, Ts), 0.0, atol=1e-9)


@pytest.mark.slow
def test_a_thousand_random_arms_of_the_class():
    for seed in range(1000):
        rng = np.random.default_rng(seed)
        chain = random_class_arm(rng, bent_wrist=bool(seed % 2))
        wanted = rng.uniform(-3, 3, (20, 6))
        Ts = chain.forward(wanted)
        q = solve(form_of(chain), Ts)
        assert worst_pose_error(chain, q, Ts)[0] < 1e-9, seed
        assert distance_to_nearest(q, wanted).max() < 1e-5, seed


def test_branches_are_those_of_py_opw_kinematics():
    opw = pytest.importorskip("py_opw_kinematics")
    from scipy.spatial.transform import RigidTransform

    robot = opw.Robot(opw.KinematicModel(**OPW), degrees=True)
    chain = kr70()
    Ts = chain.forward(sampled(chain, 500, seed=2))
    mine = solve(form_of(chain), Ts)
    theirs = np.deg2rad(robot.reach(RigidTransform.from_matrix(Ts)).joints)
    for a, b in zip(mine, theirs, strict=True):
        a, b = a[np.isfinite(a[:, 0])], b[np.isfinite(b[:, 0])]
        gap = np.abs(wrap(a[:, None] - b)).max(axis=-1)
        assert len(a) == len(b)
        assert gap.min(axis=0).max() < 1e-6
        assert gap.min(axis=1).max() < 1e-6


@pytest.mark.parametrize("a5", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, -1e-7])
def test_a_straight_wrist_is_no_loss_of_accuracy(a5):
    chain = welder()
    q = sampled(chain, 300, seed=3)
    q[:, 4] = a5
    Ts = chain.forward(q)
    found = solve(form_of(chain), Ts)
    error, there = worst_pose_error(chain, found, Ts)
    assert error < 1e-11
    assert there.any(axis=1).all()
    assert np.abs(found[there][:, 4]).min() < max(10 * abs(a5), 1e-12)


def test_with_a4_and_a6_in_line_a4_stays_at_zero():
    chain = kr70()
    T = chain.forward(np.deg2rad([[0, -90, 90, 20, 0, 30.0]]))
    found = solve(form_of(chain), T)[0]
    straight = found[np.abs(found[:, 4]) < 1e-9]
    assert len(straight) == 2
    np.testing.assert_allclose(straight[:, 3], 0.0, atol=1e-12)
    np.testing.assert_allclose(straight[:, 5], np.deg2rad(50), atol=1e-9)


@pytest.mark.parametrize("scale", [1.0, 1.0 + 1e-13, 1.0 - 1e-13])
def test_a_stretched_arm_is_within_reach(scale):
    chain = kr70()
    form = form_of(chain)
    stretched = np.angle(form.upper_arm) - np.angle(form.forearm)
    q = sampled(chain, 200, seed=4)
    q[:, 2] = stretched
    Ts = chain.forward(q)
    shoulder = form.origin + np.array([0.0, 0.0, form.zeta_2.real])
    Ts[:, :3, 3] += (scale - 1) * (wrist_centre(form, Ts) - shoulder)
    found = solve(form, Ts)
    error, there = worst_pose_error(chain, found, Ts)
    assert there.any(axis=1).all()
    assert error < 1e-9


def test_beyond_the_stretched_arm_there_is_nothing():
    chain = kr70()
    form = form_of(chain)
    q = np.zeros((1, 6))
    q[0, 2] = np.angle(form.upper_arm) - np.angle(form.forearm)
    q[0, 4] = 0.7
    Ts = np.repeat(chain.forward(q), 3, axis=0)
    outwards = wrist_centre(form, Ts)[0] - (form.origin + form.zeta_2.real * form.axes[0] + form.zeta_2.imag * form.e_r)
    Ts[:, :3, 3] += np.array([1e-6, 1e-3, 1.0])[:, None] * outwards / np.linalg.norm(outwards)
    assert np.isnan(solve(form, Ts)).all()
    np.testing.assert_allclose(reach_excess(form, Ts), [1e-6, 1e-3, 1.0], atol=1e-9)


def test_a_wrist_over_the_first_axis_has_solutions():
    chain = kr70()
    form = form_of(chain)
    T = chain.forward(np.deg2rad([[10, -100, 120, 30, 40, 50.0]]))
    centre = wrist_centre(form, T)[0]
    T[0, :3, 3] -= centre * [1, 1, 0]  # the wrist's centre onto A1's axis, which is base z
    T[0, 2, 3] += 1.2 - centre[2]
    np.testing.assert_allclose(wrist_centre(form, T)[0], [0, 0, 1.2], atol=1e-12)
    error, there = worst_pose_error(chain, solve(form, T), T)
    assert there.any()
    assert error < 1e-11


def test_inside_the_cylinder_of_a_lateral_offset_there_is_nothing():
    x, y, z = np.eye(3)
    w = np.array([z, y, y, x, y, x])
    wrist = np.array([0.9, 0.2, 1.2])
    p = np.array([0 * x, 0.4 * z, [0, 0, 1.1], wrist, wrist, wrist])
    chain = chain_from_lines(w, p, np.random.default_rng(7))
    form = form_of(chain)
    assert abs(form.lateral) == pytest.approx(0.2)
    at = form.origin + 0.8 * form.axes[0] + 0.15 * form.e_r
    T = chain.forward(np.zeros((1, 6)))
    T[0, :3, 3] += at - wrist_centre(form, T)[0]
    assert np.isnan(solve(form, T)).all()
    np.testing.assert_allclose(reach_excess(form, T), [-0.05], atol=1e-12)


def test_a_moved_base_and_tool_change_nothing():
    rng = np.random.default_rng(8)
    chain, B, tool = kr70(), random_pose(rng, 2.0), random_pose(rng)
    origins = chain.origins.copy()
    origins[0] = B @ origins[0]
    moved = with_tool(replaced(chain, origins=origins), tool)
    Ts = chain.forward(sampled(chain, 200, seed=8))
    np.testing.assert_allclose(solve(form_of(moved), B @ Ts @ tool), solve(form_of(chain), Ts), atol=1e-6)


def test_batch_is_loop():
    chain = welder()
    Ts = chain.forward(sampled(chain, 50, seed=9)).reshape(5, 10, 4, 4)
    form = form_of(chain)
    whole = solve(form, Ts)
    assert whole.shape == (5, 10, 8, 6)
    one = np.array([[solve(form, T) for T in row] for row in Ts])
    np.testing.assert_allclose(whole, one, atol=1e-9)
    assert solve(form, Ts[:0]).shape == (0, 10, 8, 6)


def nudged(chain, joint, axis_by=0.0, origin_by=0.0):
    origins, axes = chain.origins.copy(), chain.axes.copy()
    origins[joint, :3, 3] += origin_by
    axes[joint] += axis_by * np.array([0.3, 0.5, -0.8])
    axes[joint] /= np.linalg.norm(axes[joint])
    return replaced(chain, origins=origins, axes=axes)


def test_arms_outside_the_class_are_refused():
    assert recognise(offset_wrist_arm()) is None
    assert recognise(seven_joint_arm()) is None
    for joint in (1, 2):
        assert recognise(nudged(kr70(), joint, axis_by=1e-3)) is None, "A2 no longer parallel to A3"
    for joint in (4, 5):
        assert recognise(nudged(kr70(), joint, origin_by=1e-5)) is None, "an offset wrist"
    assert recognise(kr70()) is not None


@pytest.mark.parametrize("seed", range(4))
def test_one_branch_alone_is_that_of_all(seed):
    rng = np.random.default_rng(seed)
    chain = [kr70(), welder()][seed] if seed < 2 else random_class_arm(rng, bent_wrist=seed == 3)
    q = sampled(chain, 300, seed)
    q[:30, 4] = 0.0
    Ts = chain.forward(q)
    Ts[:20, :3, 3] *= 3.0  # out of reach
    whole = solve(form_of(chain), Ts)
    assert np.isnan(whole).any()
    for branch in range(8):
        assert np.array_equal(solve_branch(form_of(chain), Ts, branch), whole[:, branch], equal_nan=True)
