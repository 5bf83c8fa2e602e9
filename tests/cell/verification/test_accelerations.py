"""Accelerations of motions from outside: a short spike is one, and the rounding of a file's digits is none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, result_of
from support.jobs.random_jobs import own_motion, random_job

from cell.motion.motion import Motion
from cell.motion.motion_file import ReadMotion, read_motion, write_motion
from cell.verdict.result import Result
from cell.verification.bead_samples import rows_of
from cell.verification.blended_motion import SampledBlends
from cell.verification.drive_use import ACCELERATION_SLACK, WINDOWS, _second_differences, acceleration_use
from cell.verification.motion_check import check_motion


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Result:
    found = result_of(boss_case(tmp_path_factory.mktemp("acceleration")))
    assert found.motion is not None
    return found


def read(motion: Motion) -> ReadMotion:
    return ReadMotion(motion, np.arange(len(motion.t_s)) + 1, ())


def test_a_spike_between_few_rows_is_found(good: Result) -> None:
    m = good.motion
    assert m is not None
    weld, limit = int(np.argmax(m.arc)), np.rad2deg(good.job.drives.acceleration)
    # on the way from home at its fastest: one row a little off, of the axis that has most to spare
    k = 1 + int(np.argmin(np.diff(m.t_s[: weld - 10])[5:])) + 5
    dt = (m.t_s[k + 1] - m.t_s[k - 1]) / 2
    assert dt < WINDOWS[-1] / 3
    bump = 1.8 * limit[4] * dt**2 / 2
    q = m.q.copy()
    q[k, 4] += np.deg2rad(bump)
    spiked = read(replace(m, q=q))
    found = check_motion(good.job, spiked)
    assert {f.detail["by"] for f in found.findings} == {"acceleration"}
    worst = max(found.findings, key=lambda f: f.detail["needed_deg_s2"] / f.detail["limit_deg_s2"])
    assert worst.detail["axis"] == "A5"
    assert k <= worst.row <= k + 2
    # the second difference at that row, less what the axis does anyway and what the rounding of corners takes off
    assert 1.02 * limit[4] < worst.detail["needed_deg_s2"] < 2.5 * limit[4]
    # as a mean over more rows it goes unseen
    use = acceleration_use(good.job, spiked, rows_of(good.job, spiked.motion), WINDOWS[-1:])
    assert use.max() <= ACCELERATION_SLACK


@pytest.mark.parametrize(("digits", "suffix"), [(4, ".csv"), (5, ".npz")])
def test_few_digits_are_no_spikes(good: Result, digits: int, suffix: str, tmp_path: Path) -> None:
    m = good.motion
    assert m is not None
    coarse = replace(m, q=np.deg2rad(np.round(np.rad2deg(m.q), digits)), t_s=np.round(m.t_s, max(digits, 5)))
    path = tmp_path / f"m{suffix}"
    write_motion(path, coarse)
    back = read_motion(path, good.job)
    assert back.grain[1] == pytest.approx(np.deg2rad(10.0**-digits), rel=1e-6)
    assert back.grain[0] == pytest.approx(10.0 ** -max(digits, 5), rel=1e-6)
    found = check_motion(good.job, back)
    assert not [f for f in found.findings if f.detail.get("by") == "acceleration"]
    assert found.use[1].max() <= 1.02


def test_an_even_beat_is_not_rounded(good: Result, tmp_path: Path) -> None:
    m = good.motion
    assert m is not None
    path = tmp_path / "m.csv"
    write_motion(path, replace(m, t_s=0.1 * np.arange(len(m.t_s))))
    assert read_motion(path, good.job).grain[0] == 0.0


@pytest.mark.slow
def test_lengths_worked_out_of_rounded_angles_are_no_spikes(tmp_path: Path) -> None:
    # rows 0.05 mm apart on which A6 turns 1.2 deg: the sixth decimal of the angles is 0.05 % of their distance
    assert own_motion(random_job(np.random.default_rng((5000, 0)), tmp_path)) == []


@pytest.mark.parametrize("step_mm", [0.05, 1e-3, 1e-6, 0.0])
def test_a_spike_shows_however_little_the_tcp_moves(good: Result, step_mm: float) -> None:
    n, k = 41, 20
    q = np.linspace(0.0, 0.8, n)[:, None]
    q[k] += 0.002
    t = np.linspace(0.0, 0.4, n)
    m = good.motion
    assert m is not None
    rounded = ReadMotion(replace(m, t_s=t), np.arange(n) + 1, (), (1e-6, np.deg2rad(1e-6)))
    rows = SampledBlends(q, 1e-3 * step_mm * np.arange(n), np.full(n, 1e-7))
    found = _second_differences(rows, rounded, (0.0,))[0, k, 0]
    assert 0.85 * 2 * 0.002 / 0.01**2 < found <= 2 * 0.002 / 0.01**2
