"""Borders of many points, thinned for hulls: only what is straight, and no more than hulls may stay inside."""

from __future__ import annotations

import numpy as np
import pytest

from slicing.deposits.part_shape import SIMPLIFY_MM
from slicing.deposits.round_sectors import _thinned
from slicing.surfaces.surfaces import Cylinder


def ring(radius: float, z: np.ndarray, count: int) -> np.ndarray:
    angle = 2 * np.pi * np.arange(count) / count
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=1)


@pytest.mark.parametrize("radius", [8.0, 60.0, 200.0])
def test_what_is_left_out_lies_on_the_straight_and_near_the_chord(radius: float) -> None:
    loop = ring(radius, np.full(3000, 7.0), 3000)
    left = _thinned(loop, Cylinder((0.0, 0.0), radius), SIMPLIFY_MM)
    assert 10 < len(left) < 0.8 * len(loop)
    step = np.linalg.norm(np.diff(left, axis=0), axis=1)
    rise = radius - np.sqrt(radius**2 - step**2 / 4)
    assert rise.max() < 0.5 * SIMPLIFY_MM


def test_a_border_that_is_nowhere_straight_is_left_as_it_is() -> None:
    loop = ring(60.0, 7.0 + np.sin(np.linspace(0, 40, 3000)), 3000)
    left = _thinned(loop, Cylinder((0.0, 0.0), 60.0), SIMPLIFY_MM)
    assert len(left) > 0.99 * len(loop)
