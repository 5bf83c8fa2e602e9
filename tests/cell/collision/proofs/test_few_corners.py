"""A shape of few corners holds all points that it is made of, and is hardly larger than their hull."""

import numpy as np
import pytest
from support.cells.random_cells import points as random_points

from cell.collision.proofs.convex_shapes import PRODUCTS, ConvexShape
from cell.collision.proofs.few_corners import GROUP, LOOSE, MOST_GROWN, ROUNDING, _PointGroups, shape_of_few_corners

ENOUGH = 1e-3


def directions(rng, count):
    n = rng.normal(size=(count, 3))
    return n / np.linalg.norm(n, axis=1)[:, None]


def clouds(rng):
    """Points of all forms, thin and thick, far from where they are measured."""
    for _ in range(200):
        some = [
            random_points(rng, np.exp(rng.uniform(np.log(3e-4), np.log(0.3), 3))) for _ in range(rng.integers(1, 5))
        ]
        spread = rng.normal(size=(len(some), 3)) * rng.choice([0.0, 0.01, 0.1])
        yield np.concatenate([one + at for one, at in zip(some, spread, strict=True)]) + rng.normal(size=3)


def shell(rng, count):
    """On a tube, both ends included."""
    angle, z = rng.uniform(0, 2 * np.pi, count), np.clip(rng.uniform(-1.2, 1.2, count), -1, 1)
    return np.stack([0.07 * np.cos(angle), 0.07 * np.sin(angle), 0.01 * z], axis=1)


def ball(rng, count):
    return 0.05 * directions(rng, count)


def grains(rng, count):
    return rng.normal(size=(count, 3)) * [0.05, 0.02, 0.003]


def bar(rng, count):
    """A slanted box full of points, many of them on its faces."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return np.clip(rng.uniform(-1.1, 1.1, (count, 3)), -1, 1) * [0.1, 0.01, 0.002] @ turn.T


@pytest.mark.slow
def test_no_point_is_beyond_its_shape_in_any_direction():
    rng = np.random.default_rng(3)
    larger, fewer = [], []
    for cloud in clouds(rng):
        shape = shape_of_few_corners(cloud, ENOUGH)
        n = directions(rng, 3000)
        true, said = (cloud @ n.T).max(axis=0), shape.support(n.T)
        assert (said >= true - 1e-12).all()
        wide = true + (-cloud @ n.T).max(axis=0)
        larger.append(((said - true) / wide).max())
        fewer.append(len(shape.points) / len(cloud))
    assert np.median(larger) < 0.01
    assert np.min(fewer) < 0.7


@pytest.mark.parametrize("form", [shell, ball, grains, bar])
@pytest.mark.parametrize("count", [GROUP - 1, GROUP, GROUP + 1, 5 * GROUP + LOOSE + 1, 3500])
def test_of_many_points_none_is_left_out(form, count):
    rng = np.random.default_rng(count)
    cloud = form(rng, count) + rng.normal(size=3)
    # the points themselves are the directions in which each is the most likely to be beyond
    n = np.concatenate([directions(rng, 500), (cloud - cloud.mean(axis=0)) * rng.uniform(0.2, 5.0, 3)])
    n /= np.linalg.norm(n, axis=1)[:, None]
    shape = shape_of_few_corners(cloud, ENOUGH)
    true, said = (cloud @ n.T).max(axis=0), shape.support(n.T)
    assert (said >= true).all()
    size = np.linalg.norm(cloud - cloud.mean(axis=0), axis=1).max()
    assert (said - true).max() < 2.5 * ENOUGH * size
    assert shape.ball < 2 * ROUNDING * size


@pytest.mark.slow
def test_a_point_that_stands_out_alone_is_held_wherever_it_comes_among_the_others():
    rng = np.random.default_rng(5)
    for _ in range(80):
        cloud = rng.choice([shell, ball, grains, bar])(rng, int(rng.integers(300, 3000)))
        alone = rng.choice([0, len(cloud) - 1, rng.integers(0, len(cloud))])
        n = directions(rng, 1)[0]
        # by more than what is enough at times and by less at others
        cloud[alone] = n * (cloud @ n).max() * (1 + rng.choice([3e-4, 8e-4, 2e-3, 0.3]))
        shape = shape_of_few_corners(cloud, ENOUGH)
        near = n + 0.02 * directions(rng, 50)
        near /= np.linalg.norm(near, axis=1)[:, None]
        assert (shape.support(near.T) >= (cloud @ near.T).max(axis=0)).all()


def disc(rng, count):
    """All of its points on its rim."""
    return shell(rng, count) * [1.0, 1.0, 0.0] + [0.0, 0.0, 1.0] * rng.choice([-1, 1], (count, 1))


def plate(rng, count):
    return np.clip(rng.uniform(-1.2, 1.2, (count, 3)), -1, 1) * [0.1, 0.03, 1.0]


@pytest.mark.parametrize("form", [disc, plate])
@pytest.mark.parametrize("thick", [0.0, 1e-15, 1e-12, 1e-10, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4])
def test_of_flat_shapes_the_rim_is_held_as_well(form, thick):
    rng = np.random.default_rng(7)
    for _ in range(10):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        cloud = form(rng, 1500) * [1.0, 1.0, thick] @ turn + rng.normal(size=3)
        n = np.concatenate([directions(rng, 200), cloud[rng.integers(0, 1500, 600)] - cloud.mean(axis=0)])
        n /= np.linalg.norm(n, axis=1)[:, None]
        shape = shape_of_few_corners(cloud, ENOUGH)
        assert (shape.support(n.T) >= (cloud @ n.T).max(axis=0)).all()
        assert len(shape.points) == len(cloud) or thick > 1e-7


@pytest.mark.slow
def test_a_shape_is_never_grown_by_more_than_it_may():
    rng = np.random.default_rng(9)
    for form in (shell, ball, grains, bar):
        cloud, n = form(rng, 3000), directions(rng, 2000)
        true = (cloud @ n.T).max(axis=0)
        assert (shape_of_few_corners(cloud, 1e-9).support(n.T) <= true * (1 + 2 * MOST_GROWN)).all()


@pytest.mark.parametrize("count", [1, GROUP, 3 * GROUP + 7])
def test_how_far_points_reach_is_as_if_each_were_multiplied_with_each_direction(count):
    rng = np.random.default_rng(count)
    groups = _PointGroups.of(bar(rng, count))
    n = directions(rng, 40) * rng.uniform(0.5, 50.0, (40, 1))
    product = n @ groups.points
    for known in (np.full(40, -1.0), product.max(axis=1) * 0.9, product.max(axis=1) + 1.0):
        far, which, left = groups.over(n, known)
        assert far == pytest.approx(np.maximum(product.max(axis=1), known), rel=1e-12, abs=1e-15)
        reach = which >= 0
        assert np.array_equal(reach, product.max(axis=1) > known)
        assert product[reach, which[reach]] == pytest.approx(far[reach])
        assert np.array_equal(left, np.flatnonzero((product > known[:, None]).any(axis=0)))


@pytest.mark.parametrize(("corners", "count"), [(1, 7), (24, PRODUCTS // 24 + 1), (3000, 1000), (2 * PRODUCTS, 70)])
def test_how_far_a_shape_reaches_is_the_same_whether_directions_come_alone_or_many_at_once(corners, count):
    rng = np.random.default_rng(corners)
    shape = ConvexShape(rng.normal(size=(corners, 3)), 0.1, np.array([0.0, 0.0, 1.0]), 0.0)
    n = directions(rng, count).T
    assert shape.support(n) == pytest.approx(np.array([shape.support(one) for one in n.T]), rel=1e-14)
