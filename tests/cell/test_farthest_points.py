"""Points that stand for many are far from one another."""

from __future__ import annotations

import numpy as np

from cell.farthest_points import farthest_points


def test_each_point_is_the_farthest_from_those_before() -> None:
    points = np.random.default_rng(3).normal(size=(200, 6))
    chosen = farthest_points(points, 20)
    assert len(set(chosen.tolist())) == 20
    for k in range(1, 20):
        away = np.linalg.norm(points[:, None] - points[chosen[:k]], axis=2).min(axis=1)
        assert away[chosen[k]] == away.max()


def test_fewer_points_than_asked_for_are_all_of_them() -> None:
    assert sorted(farthest_points(np.array([[0.0], [1.0], [5.0]]), 9).tolist()) == [0, 1, 2]
    assert farthest_points(np.array([[0.0], [1.0], [5.0], [9.0]]), 3).tolist() == [3, 0, 2]
