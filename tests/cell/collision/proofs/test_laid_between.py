"""Steps on which less is laid than at the sample where they end: each is held against what is there on it."""

from __future__ import annotations

import numpy as np
import pytest

from cell.arrays import Ints
from cell.collision.blended_corners import cut_corners
from cell.collision.blended_paths import BlendedPath
from cell.collision.clearances import Clearances
from cell.collision.proofs.between_samples import NEAREST, NEAREST_SHARE, least_between_samples, unproven_steps
from cell.timing.blending import blended
from ik.chain import Floats

FIRST, THEN = np.array([[0.5, -0.3]]), np.array([[0.5, 0.1]])  # posts: the second stands once a deposit is laid
Q = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.5]])
AT, WELDED = np.array([0, 1, 1]), np.array([0, 1])  # laid at samples, and on the steps: as the first one ends


class GrowingPosts:
    """Collision detection of a point in the plane of two joints, a metre a radian, against posts that are put up."""

    reach = 10.0

    def __init__(self, first: Floats = FIRST, then: Floats = THEN) -> None:
        self.first, self.every = first, np.concatenate([first, then])

    def travel_bound(self, radius: Floats, a: Floats, b: Floats) -> Floats:
        return np.asarray(np.linalg.norm(b - a, axis=1))

    def bend_bound(self, radius: Floats, turn: Floats) -> Floats:
        return np.zeros(len(turn))

    def clearances(self, q: Floats, deposits_laid: Ints) -> Clearances:
        away = np.linalg.norm(q[:, None] - self.every, axis=2)
        away[:, len(self.first) :] += np.where(deposits_laid > 0, 0.0, np.inf)[:, None]
        return Clearances(away.min(axis=1), np.zeros((len(q), 2), dtype=np.int64), np.zeros((len(q), 3)))


def on_the_way(q: Floats, k: int) -> Floats:
    """Dense samples of a step."""
    return np.asarray(q[k] + np.linspace(0, 1, 400)[:, None] * (q[k + 1] - q[k]))


def test_what_is_laid_as_a_step_ends_is_not_in_its_way() -> None:
    posts, radius = GrowingPosts(), np.ones(2)
    found = posts.clearances(Q, AT)
    assert unproven_steps(posts, radius, Q, AT, found, least=0.2)[0].tolist() == [0]
    assert not len(unproven_steps(posts, radius, Q, AT, found, least=0.2, laid_between=WELDED)[0])
    assert unproven_steps(posts, radius, Q, AT, found, least=0.2, laid_between=np.array([1, 1]))[0].tolist() == [0]


def test_the_least_clearance_is_that_of_what_is_there() -> None:
    posts, radius = GrowingPosts(), np.ones(2)
    found = posts.clearances(Q, AT)
    assert least_between_samples(posts, radius, Q, AT, found)[1].distance[0] == pytest.approx(0.1, abs=4e-3)
    nearest = least_between_samples(posts, radius, Q, AT, found, laid_between=WELDED)[1]
    assert nearest.distance[0] == pytest.approx(0.3, abs=0.01)


def test_about_the_sample_nearest_to_what_is_laid_there_only_the_step_away_from_it_is_searched() -> None:
    # the post is nearest to the sample that ends the step, and nearer to the step itself
    posts, radius = GrowingPosts(np.array([[9.0, 9.0]]), np.array([[0.9, 0.1]])), np.ones(2)
    found = posts.clearances(Q, AT)
    at, nearest = least_between_samples(posts, radius, Q, AT, found, laid_between=WELDED)
    assert at == 1
    assert nearest.distance[0] == pytest.approx(0.1, abs=4e-3)  # of the step away, upwards
    low = GrowingPosts(np.array([[9.0, 9.0]]), np.array([[0.9, -0.1]]))
    at, nearest = least_between_samples(low, radius, Q, AT, low.clearances(Q, AT), laid_between=WELDED)
    assert at == 1
    assert nearest.distance[0] == pytest.approx(np.hypot(0.1, 0.1), abs=1e-6)


def test_a_row_at_which_less_is_laid_says_nothing_of_how_a_step_is_rounded() -> None:
    # the second post is beside the first step, where its corner is rounded
    posts, radius, path = GrowingPosts(np.array([[9.0, 9.0]]), np.array([[0.85, 0.05]])), np.ones(2), Q.copy()
    path[2, 1] = 1.0
    for between, cut in (None, [0]), (np.array([1, 1]), [0]), (WELDED, []):
        found = posts.clearances(path, AT)
        corner = BlendedPath(path, np.array([0.0, 1.0, 2.0]), 0.4)
        step, _ = cut_corners(posts, radius, corner, AT, found, 0.03, laid_between=between)
        assert step.tolist() == cut


@pytest.mark.parametrize("least", [0.01, 0.03])
def test_nothing_is_proved_of_a_step_that_comes_too_near_to_what_is_there_on_it(least: float) -> None:
    rng, radius = np.random.default_rng(5), np.ones(2)
    met = free = 0
    for _ in range(60):
        q = np.cumsum(rng.normal(size=(5, 2)) * 0.2, axis=0)
        s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
        between = np.repeat([0, 1], [2, 2])
        at = np.maximum(np.append(between, 1), np.append(0, between))
        places = [on_the_way(q, int(rng.integers(4)))[rng.integers(400, size=1)] for _ in range(2)]
        posts = GrowingPosts(*(place + rng.normal(size=2) * 0.06 for place in places))
        found = posts.clearances(q, at)
        true = [posts.clearances(on_the_way(q, k), np.full(400, between[k])).distance.min() for k in range(4)]
        open_, _ = unproven_steps(posts, radius, q, at, found, least=least, laid_between=between)
        if min(true) < least:
            met += 1
            assert len(open_)
        free += not len(open_)
        nearest = least_between_samples(posts, radius, q, at, found, laid_between=between)[1].distance[0]
        near = min(min(true), float(found.distance.min()))
        assert near - 2e-3 <= nearest <= near + max(NEAREST, NEAREST_SHARE * near / (1 - NEAREST_SHARE))
        if len(open_) or (found.distance < least).any():
            continue
        zone = float(rng.uniform(0.02, 0.2))
        cut, _ = cut_corners(posts, radius, BlendedPath(q, s, zone), at, found, least, laid_between=between)
        for k in range(4):
            run = blended(q, s, zone, np.linspace(s[k], s[k + 1], 300))
            if posts.clearances(run, np.full(300, between[k])).distance.min() < least:
                assert len(cut)
    assert met > 5
    assert free > 5
