"""A B C against RoboDK's own conversions, and angles that run on."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.programs.orientation import abc_of, frames_of_poses, pose_of, rotation_of, run_on

robomath = pytest.importorskip("robodk.robomath")
angle = st.floats(-math.pi, math.pi)
near = st.one_of(angle, st.sampled_from([math.pi / 2, -math.pi / 2, 0.0, math.pi]))


@given(st.lists(st.floats(-3000, 3000), min_size=3, max_size=3), st.tuples(near, near, near))
def test_poses_agree_with_robodk(xyz: list[float], abc: tuple[float, float, float]) -> None:
    theirs = np.array(robomath.KUKA_2_Pose([*xyz, *map(math.degrees, abc)]).Rows())
    ours = frames_of_poses(np.array([*xyz, *abc]))
    np.testing.assert_allclose(ours, theirs, atol=1e-9)


@given(st.lists(st.floats(-3000, 3000), min_size=3, max_size=3), st.tuples(angle, st.floats(-1.57, 1.57), angle))
def test_poses_are_taken_apart_as_robodk_does(xyz: list[float], abc: tuple[float, float, float]) -> None:
    T = frames_of_poses(np.array([*xyz, *abc]))
    theirs = np.array(robomath.Pose_2_KUKA(robomath.Mat(T.tolist())))
    ours = pose_of(T)
    np.testing.assert_allclose(ours[:3], theirs[:3], atol=1e-9)
    turn = (np.degrees(ours[3:]) - theirs[3:] + 180) % 360 - 180
    np.testing.assert_allclose(turn, 0, atol=1e-9)


@given(st.tuples(near, near, near))
def test_angles_give_the_rotation_back(abc: tuple[float, float, float]) -> None:
    R = rotation_of(np.array(abc))
    np.testing.assert_allclose(rotation_of(abc_of(R)), R, atol=1e-8)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)


@given(st.tuples(near, near, near), st.tuples(near, near, near), st.integers(-3, 3))
def test_running_on_keeps_the_orientation(
    abc: tuple[float, float, float], before: tuple[float, float, float], turns: int
) -> None:
    before = (before[0] + turns * math.tau, before[1], before[2])
    found = run_on(abc, before)
    np.testing.assert_allclose(rotation_of(np.array(found)), rotation_of(np.array(abc)), atol=1e-6)
    plain = max(abs((x - y + math.pi) % math.tau - math.pi) for x, y in zip(abc, before, strict=True))
    assert max(abs(x - y) for x, y in zip(found, before, strict=True)) < plain + 1e-6  # never further than whole turns


@given(angle, angle, st.sampled_from([math.pi / 2, -math.pi / 2]), st.floats(-0.1, 0.1))
def test_at_a_right_angle_a_and_c_share_a_turn(a: float, c: float, b: float, turn: float) -> None:
    sign = 1 if b > 0 else -1
    found = run_on((0.0, b, c - sign * (a + turn)), (a, b, c))
    assert abs(found[0] - a) < 0.051
    assert abs(found[2] - c) < 0.051
