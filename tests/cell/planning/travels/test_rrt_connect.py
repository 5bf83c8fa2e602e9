"""Ways round obstacles in a plain joint space, where what is free is known exactly."""

import numpy as np
import pytest

from cell.planning.travels.rrt_connect import Space, TreeRoots, connect, sampled, with_round_corners, with_shortcuts

SPACE = Space(np.full(3, -1.0), np.full(3, 1.0), np.array([1.0, 1.0, 0.5]), np.ones(3))


def slab(gap):
    """A wall across the first joint with a hole of the given half size in its corner: free(a, b) by fine samples."""

    def blocked(q):
        hole = (q[..., 1] > 1 - gap) & (q[..., 2] > 1 - gap)
        return (np.abs(q[..., 0]) < 0.1) & ~hole

    def free(a, b):
        t = np.linspace(0, 1, 201)
        hit = blocked(a[:, None] + t[:, None] * (b - a)[:, None])
        first = np.where(hit.any(axis=1), hit.argmax(axis=1), 202)
        return np.where(first > 200, 1.0, np.maximum(first - 1, 0) / 200)

    return free


def ends():
    return TreeRoots(np.array([[-0.9, -0.5, 0.0]]), np.array([[0.9, -0.5, 0.0]]), np.zeros((0, 3)))


def test_a_hole_in_a_wall_is_found_and_every_edge_is_free():
    free = slab(0.3)
    found = connect(SPACE, ends(), free, 6000, 1)
    assert np.array_equal(found.path[0], ends().starts[0])
    assert np.array_equal(found.path[-1], ends().goals[0])
    assert (free(found.path[:-1], found.path[1:]) == 1).all()
    assert (np.abs(found.path) <= 1).all()


def test_no_hole_no_way():
    found = connect(SPACE, ends(), slab(0.0), 600, 1)
    assert found.path is None
    assert min(found.sizes) > 1


def test_the_same_seed_gives_the_same_way():
    a, b = (connect(SPACE, ends(), slab(0.3), 3000, 7).path for _ in range(2))
    assert np.array_equal(a, b)


@pytest.mark.parametrize("seed", range(2))
def test_shortcuts_keep_ends_and_freedom_and_only_shorten(seed):
    free = slab(0.3)
    way = connect(SPACE, ends(), free, 6000, seed).path
    short = with_shortcuts(SPACE, way, free, 60, seed)
    assert np.array_equal(short[[0, -1]], way[[0, -1]])
    assert (free(short[:-1], short[1:]) == 1).all()
    assert SPACE.time(short[:-1], short[1:]).sum() <= SPACE.time(way[:-1], way[1:]).sum() + 1e-12
    bent = with_round_corners(short, free)
    assert np.array_equal(bent[[0, -1]], way[[0, -1]])
    assert (free(bent[:-1], bent[1:]) == 1).all()


def test_a_way_from_any_start_to_any_goal():
    # the first start and the first goal lie in closed rooms
    trees = TreeRoots(
        np.array([[0.0, -0.9, 0.0], [-0.9, 0.0, 0.0]]), np.array([[0.0, 0.9, 0.0], [-0.5, 0.0, 0.0]]), np.zeros((0, 3))
    )
    found = connect(SPACE, trees, slab(0.0), 600, 3)
    assert np.array_equal(found.path[[0, -1]], [trees.starts[1], trees.goals[1]])


def test_samples_are_dense_and_hold_the_corners():
    way = np.array([[0.0, 0.0, 0.0], [0.5, 0.1, 0.0], [0.5, -0.2, 0.7]])
    q = sampled(way, 0.02)
    assert np.abs(np.diff(q, axis=0)).max() <= 0.02 + 1e-12
    assert all((np.abs(q - corner).max(axis=1) < 1e-12).any() for corner in way)
