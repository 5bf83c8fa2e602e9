"""The arm's pairs in two groups: together they are all, and what is nearest in one or the other is nearest of all."""

import gc
import itertools
import weakref

import numpy as np
import pytest
from support.cells.random_cells import random_scenes

from cell.collision.checker import Checker
from cell.collision.pair_groups import PairGroupChecker, groups_of
from cell.collision.proofs.between_samples import NEAREST, NEAREST_SHARE, least_between_samples
from cell.collision.proofs.plane_proofs import proofs_of
from cell.collision.proofs.reach_radii import radii

REACH = 0.3


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    return random_scenes(tmp_path_factory.mktemp("cells"), seed=5, count=5)


def checkers(scenes, rng):
    return [Checker(scene, tuple(rng.uniform(*scene.table_range.T)), REACH) for scene in scenes]


def groups(checker):
    return PairGroupChecker(checker, itself=False), PairGroupChecker(checker, itself=True)


def test_the_least_of_both_groups_is_that_of_all_pairs(scenes):
    rng = np.random.default_rng(0)
    by = np.zeros(2, dtype=int)
    for checker in checkers(scenes, rng):
        scene = checker.scene
        q = rng.uniform(scene.chain.lower, scene.chain.upper, (150, scene.chain.n))
        deposits_laid = rng.integers(0, scene.n_deposits + 1, len(q))
        whole = checker.clearances(q, deposits_laid)
        each = np.array([group.clearances(q, deposits_laid).distance for group in groups(checker)])
        least, free = each.min(axis=0), whole.distance > 0
        np.testing.assert_allclose(least[free], whole.distance[free], atol=1e-7)
        # depths are iterated for, from where the last look left off
        np.testing.assert_allclose(least[~free], whole.distance[~free], rtol=1e-3, atol=2e-6)
        by += np.bincount(np.argmin(each, axis=0)[free & np.isfinite(whole.distance)], minlength=2)
        assert checker.asked.count == 3 * len(q)  # what is looked at in groups counts as well
    assert (by > 0).all()  # each has been the nearest


def test_what_is_against_itself_is_none_of_the_other_group(scenes):
    rng = np.random.default_rng(1)
    for checker in checkers(scenes, rng):
        scene = checker.scene
        q = rng.uniform(scene.chain.lower, scene.chain.upper, (60, scene.chain.n))
        deposits_laid = np.full(len(q), scene.n_deposits)
        for group in groups(checker):
            seen = group.clearances(q, deposits_laid)
            free = np.isfinite(seen.distance) & (seen.distance > 0)  # named pairs that touch are met by both
            assert (scene.arm_geom[seen.pair[free]].all(axis=1) == group.itself).all()


def test_all_pairs_within_a_distance_are_those_that_it_is_the_least_of(scenes):
    rng = np.random.default_rng(2)
    for checker in checkers(scenes, rng):
        scene = checker.scene
        q = rng.uniform(scene.chain.lower, scene.chain.upper, (60, scene.chain.n))
        deposits_laid = rng.integers(0, scene.n_deposits + 1, len(q))
        near, least = checker.pairs_within(q, deposits_laid, REACH), checker.clearances(q, deposits_laid)
        nearest = near.nearest(len(q))
        free = ~(least.distance < 0)
        np.testing.assert_allclose(nearest.distance[free], least.distance[free], atol=1e-7)
        assert (near.distance <= REACH + 1e-9).all()
        assert (np.diff(near.row) >= 0).all()
        # further out there are more, and those that there were
        more = checker.pairs_within(q, deposits_laid, 2 * REACH)
        assert len(more.row) > len(near.row)


@pytest.mark.parametrize("many", [0, 10**9])
def test_the_least_is_what_dense_samples_have(scenes, many):
    """Of motions that are free: nearer than any of many samples but for what is promised, by proofs and by halving."""
    rng = np.random.default_rng(4)
    met = 0
    for checker in checkers(scenes, rng):
        chain, radius = checker.scene.chain, radii(checker.scene)
        q = rng.uniform(chain.lower, chain.upper, (100, chain.n))
        seen = checker.clearances(q, np.zeros(100, dtype=np.int64)).distance
        for start in q[(seen > 0.01) & (seen < REACH)][:3]:
            # it is near in the middle of a step
            way = start + np.array([-3.0, -1.0, 1.0, 3.0])[:, None] * rng.normal(size=chain.n) * 0.03
            deposits_laid = np.zeros(len(way), dtype=np.int64)
            found = checker.clearances(way, deposits_laid)
            _, nearest = least_between_samples(checker, radius, way, deposits_laid, found, many=many)
            t = np.linspace(0, 1, 15)[:, None]
            dense = np.concatenate([a + t * (b - a) for a, b in itertools.pairwise(way)])
            true = checker.clearances(dense, np.zeros(len(dense), dtype=np.int64)).distance.min()
            if not np.isfinite(true) or true < 0:
                continue
            met += 1
            assert nearest.distance[0] <= true + max(NEAREST, NEAREST_SHARE * true / (1 - NEAREST_SHARE)) + 1e-9
            assert nearest.distance[0] >= true - 2e-3
    assert met > 4


def test_what_is_made_for_a_checker_goes_with_it(scenes):
    for make in (groups_of, proofs_of):
        checker = Checker(scenes[0], tuple(scenes[0].table_range.mean(axis=1)), REACH)
        assert make(checker) is make(checker)
        gone = weakref.ref(checker)
        del checker
        gc.collect()
        assert gone() is None, make.__name__


def test_how_far_is_looked_in_each_does_not_change_what_is_found_there(scenes):
    rng = np.random.default_rng(6)
    for checker in checkers(scenes, rng):
        scene = checker.scene
        q = rng.uniform(scene.chain.lower, scene.chain.upper, (40, scene.chain.n))
        deposits_laid, far = rng.integers(0, scene.n_deposits + 1, len(q)), rng.choice([0.01, 0.05, 0.3], len(q))
        found = checker.pairs_within(q, deposits_laid, far)
        for i in range(len(q)):
            alone = checker.pairs_within(q[i : i + 1], deposits_laid[i : i + 1], float(far[i]))
            mine = found.row == i
            assert sorted(map(tuple, found.geom[mine].tolist())) == sorted(map(tuple, alone.geom.tolist()))
            np.testing.assert_allclose(np.sort(found.distance[mine]), np.sort(alone.distance), atol=1e-9)
