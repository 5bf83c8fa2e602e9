"""A controller that stops in its corners: 0 is a value, and small zones cost no more than others."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cell.cli.main import main
from cell.timing.blending import blended
from cell.timing.time_grid import MOST_STEPS, time_grid
from cell.timing.time_law import time_path, time_stops

V, A = np.array([2.0, 2.0]), np.array([4.0, 4.0])


def right_angle(steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Two straight legs of length 1 that meet at a right angle, and the length of the way."""
    a = np.linspace(0, 1, steps + 1)
    q = np.concatenate([np.stack([a, 0 * a], axis=1), np.stack([0 * a + 1, a], axis=1)[1:]])
    return q, np.linspace(0, 2, 2 * steps + 1)


def test_a_stop_in_the_corner_takes_the_time_of_two_legs() -> None:
    # from rest to rest over 1 rad at 2 rad/s and 4 rad/s2: half a second up, half a second down
    q, s = right_angle(10)
    law = time_stops(q, s, V, A, cap=np.full(20, 1e3), stops=np.array([0, 10, 20]))
    assert law.t[[10, 20]] == pytest.approx([1.0, 2.0], rel=1e-3)
    assert law.speed[[0, 10, 20]] == pytest.approx(0.0, abs=1e-9)
    assert law.speed.max() == pytest.approx(2.0, rel=1e-2)
    exact = time_path(q, s, V, A, cap=1e3, zone=0.0).t[-1]
    assert exact == pytest.approx(2.0, rel=0.01)


def test_smaller_zones_are_slower_and_no_finer_than_is_needed() -> None:
    q, s = right_angle(10)
    times = [time_path(q, s, V, A, cap=1e3, zone=zone).t[-1] for zone in (0.1, 0.01, 1e-3, 1e-5, 1e-7, 0.0)]
    assert times == sorted(times)
    assert times[-1] == pytest.approx(2.0, rel=0.01)
    for zone in (1e-4, 1e-6, 1e-9):
        grid = time_grid(s, zone, s[10:11], np.ones(len(s) - 1, dtype=bool))
        assert len(grid) < MOST_STEPS + 100
        assert (np.diff(grid) > 0).all()
        assert (grid[0], grid[-1]) == (0.0, s[-1])
        assert np.diff(grid)[np.abs(grid[:-1] - 1.0) < zone].max() <= zone  # fine where the corner is


def test_without_a_zone_nothing_is_rounded() -> None:
    q, s = right_angle(4)
    np.testing.assert_allclose(blended(q, s, 0.0), q, atol=1e-8)


def test_a_case_whose_controller_stops_is_checked_and_its_motion_holds(
    make_case: Callable[..., Path], tmp_path: Path
) -> None:
    case, motion = str(make_case(process={"blend_mm": 0})), str(tmp_path / "m.csv")
    assert main(["check", case, "-q", "--motion", motion]) == 0
    assert main(["check", case, "-q", "--motion-in", motion]) == 0
