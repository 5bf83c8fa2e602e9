"""Planes of a hull: those of SciPy, and never one that cuts a point off."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from slicing.mesh.hull import hull_planes


@settings(max_examples=40, deadline=None)
@given(st.integers(4, 60), st.integers(0, 2**32 - 1), st.sampled_from([1.0, 1e-3]))
def test_a_hull_is_what_lies_between_its_planes(count: int, seed: int, flat: float) -> None:
    random = np.random.default_rng(seed)
    points = random.normal(size=(count, 3)) * [10.0, 10.0, 10.0 * flat]
    normals, offsets = hull_planes(points)
    assert (points @ normals.T <= offsets + 1e-12).all()
    assert np.abs((points @ normals.T).max(axis=0) - offsets).max() < 1e-12  # each touches it
    equations = ConvexHull(points).equations
    places = points.mean(axis=0) + random.normal(size=(500, 3)) * [12.0, 12.0, 12.0 * flat]
    beyond = (places @ equations[:, :3].T + equations[:, 3]).max(axis=1)
    mine = (places @ normals.T - offsets).max(axis=1)
    assert (mine - beyond).max() < 1e-9  # nothing is cut off
    assert (beyond - mine).max() < 2e-4  # mm: of flat points a face may be turned a little


@pytest.mark.parametrize("thick", [1e-9, 1e-6])
def test_a_sliver_loses_no_point(thick: float) -> None:
    turn = np.linspace(0.0, 2 * np.pi, 40, endpoint=False)
    ring = np.column_stack([20 * np.cos(turn), 20 * np.sin(turn), np.zeros(40)])
    points = np.concatenate([ring, ring + np.array([0.0, 0.0, thick])])
    normals, offsets = hull_planes(points)
    assert (points @ normals.T <= offsets + 1e-12).all()


def test_points_in_one_plane_have_a_hull_without_a_volume() -> None:
    normals, offsets = hull_planes(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]))
    beside = np.array([[0.5, 0.5, 1e-6], [0.5, 0.5, -1e-6]])
    assert not len(normals) or ((beside @ normals.T - offsets).max(axis=1) > 0.0).all()
