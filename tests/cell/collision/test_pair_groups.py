"""Groups of pairs: together they are all pairs, each travels no further than it is said to; the least is the same."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import mujoco
import numpy as np
import pytest
from support.random_cells import random_cell, write_meshes

from cell.collision import between_samples
from cell.collision.between_samples import NEAREST, NEAREST_SHARE, least_on_the_way
from cell.collision.checker import Checker
from cell.collision.clearances import Clearances
from cell.collision.pair_groups import groups_of, travel_bounds
from cell.collision.reach_radii import radii
from cell.collision.table import with_table_axes
from cell.job.job import prepare
from cell.scene.compose import compose

REACH = 0.08


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cells")
    write_meshes(folder)
    rng = np.random.default_rng(5)
    part = prepare(random_cell(rng, folder)).shape
    return [compose(random_cell(rng, folder), part) for _ in range(5)]


def checkers(scenes, rng):
    return [Checker(scene, tuple(rng.uniform(*scene.table_range.T)), REACH) for scene in scenes]


def near_of(checker, rng):
    """Clearances that name one part of the arm, and something that is none of it, as nearest."""
    scene = checker.scene
    solid = scene.contact_bits.any(axis=0)
    arm, other = (np.flatnonzero(solid & mine) for mine in (scene.arm_geom, ~scene.arm_geom))
    pair = np.array([[rng.choice(arm), rng.choice(other)]])[:, :: int(rng.choice([-1, 1]))]
    return Clearances(np.array([0.01]), pair, np.zeros((1, 3)))


def test_the_least_of_all_groups_is_that_of_all_pairs(scenes):
    rng = np.random.default_rng(0)
    by = np.zeros(4, dtype=int)
    for checker in checkers(scenes, rng):
        scene = checker.scene
        groups = groups_of(checker, near_of(checker, rng))
        q = rng.uniform(scene.chain.lower, scene.chain.upper, (150, scene.chain.n))
        stage = rng.integers(0, scene.n_deposits + 1, len(q))
        whole = checker.clearances(q, stage)
        each = np.array([group.clearances(q, stage).distance for group in groups])
        least, free = each.min(axis=0), whole.distance > 0
        np.testing.assert_allclose(least[free], whole.distance[free], atol=1e-7)
        # depths are iterated for, from where the last look left off
        np.testing.assert_allclose(least[~free], whole.distance[~free], rtol=1e-3, atol=2e-6)
        nearest = np.argmin(each, axis=0)[free & np.isfinite(whole.distance)]
        by[: len(groups)] += np.bincount(nearest, minlength=len(groups))
        assert checker.asked.count == len(q) * (1 + len(groups))  # what is looked at in groups counts as well
    assert (by > 0).all()  # each has been the nearest


def test_what_is_against_itself_is_none_of_the_other_groups(scenes):
    rng = np.random.default_rng(1)
    for checker in checkers(scenes, rng):
        scene = checker.scene
        *still, itself = groups_of(checker, near_of(checker, rng))
        q = rng.uniform(scene.chain.lower, scene.chain.upper, (60, scene.chain.n))
        stage = np.full(len(q), scene.n_deposits)
        for group, both in [*((one, False) for one in still), (itself, True)]:
            seen = group.clearances(q, stage)
            free = np.isfinite(seen.distance) & (seen.distance > 0)  # named pairs that touch are met by all groups
            assert (scene.arm_geom[seen.pair[free]].all(axis=1) == both).all()


def test_groups_and_the_checker_they_are_of_may_be_asked_in_turn(scenes):
    """They work with one copy of the model: what one of them has set in it means nothing to the others."""
    rng = np.random.default_rng(3)
    met = 0
    for checker in checkers(scenes, rng):
        scene = checker.scene
        near = near_of(checker, rng)
        alone = [Checker(scene, checker.table, REACH), *groups_of(Checker(scene, checker.table, REACH), near)]
        together = [checker, *groups_of(checker, near)]
        for q in rng.uniform(scene.chain.lower, scene.chain.upper, (60, scene.chain.n)):
            for k in rng.permutation(len(together)).tolist():
                stage = rng.integers(0, scene.n_deposits + 1, 1)
                mine, other = (some[k].clearances(q[None], stage).distance[0] for some in (together, alone))
                assert mine == pytest.approx(other, rel=1e-3, abs=2e-6)
                met += np.isfinite(mine)
    assert met > 200


def middles(scene, geoms, rows):
    """Points of geoms, (m, k, 3): their middles and what is as far from them as their shapes' farthest points."""
    model, data, out = scene.model, mujoco.MjData(scene.model), []
    for row in rows:
        data.qpos[scene.arm_qpos] = row
        mujoco.mj_kinematics(model, data)
        R = data.geom_xmat[geoms].reshape(-1, 3, 3)
        far = model.geom_rbound[geoms][:, None, None] * np.concatenate([np.eye(3), -np.eye(3)])
        at = data.geom_xpos[geoms][:, None]
        out.append(np.concatenate([at, at + far @ np.swapaxes(R, 1, 2)], axis=1).reshape(-1, 3))
    return np.array(out)


def test_no_point_of_a_group_gets_further_on_a_step_than_it_is_said_to(scenes):
    rng = np.random.default_rng(2)
    tight = []
    for checker in checkers(scenes, rng):
        scene, chain = checker.scene, checker.scene.chain
        for group in groups_of(checker, near_of(checker, rng))[:-1]:
            geoms = np.flatnonzero(group.parts)
            for size in (0.005, 0.1, 0.5):
                q = rng.uniform(chain.lower, chain.upper, (6, chain.n))
                step = rng.normal(size=q.shape) * size
                step[:, 1] = -step[:, 2]  # against one another: where the arcs are far too much
                bound = group.travel_bound(group.radius, q, q + step)
                for a, b, most in zip(q, q + step, bound, strict=True):
                    at = middles(scene, geoms, a + np.linspace(0, 1, 13)[:, None] * (b - a))
                    both = np.linalg.norm(at - at[0], axis=2) + np.linalg.norm(at - at[-1], axis=2)
                    assert both.max() <= most * (1 + 1e-9)
                    tight.append(both.max() / most)
                np.testing.assert_allclose(
                    travel_bounds([group], np.concatenate([q[:1], q[:1] + step[:1]]))[0], bound[:1]
                )
    assert np.median(tight) > 0.6


def test_two_parts_of_the_arm_may_both_move(scenes):
    rng = np.random.default_rng(8)
    for checker in checkers(scenes, rng):
        itself, radius = groups_of(checker, near_of(checker, rng))[-1], radii(checker.scene)
        a = rng.uniform(checker.scene.chain.lower, checker.scene.chain.upper, (20, checker.scene.chain.n))
        b = a + rng.normal(size=a.shape) * 0.05
        np.testing.assert_allclose(itself.travel_bound(radius, a, b), checker.travel_bound(radius, a, b), rtol=1e-12)


def test_many_samples_are_bounded_in_blocks_as_step_by_step(scenes):
    rng = np.random.default_rng(3)
    checker = checkers(scenes, rng)[0]
    groups = groups_of(checker, near_of(checker, rng))
    q = np.cumsum(rng.normal(size=(10_010, checker.scene.chain.n)) * 0.01, axis=0)
    for group, way in zip(groups, travel_bounds(groups, q), strict=True):
        assert len(way) == len(q) - 1
        few = np.array([0, 4_998, 4_999, 5_000, 9_999, 10_008])
        np.testing.assert_allclose(way[few], group.travel_bound(group.radius, q[few], q[few + 1]), rtol=1e-12)


def test_the_least_is_what_dense_samples_have(scenes):
    """Of motions that are free: nearer than any of many samples but for what is promised."""
    rng = np.random.default_rng(4)
    met = 0
    for checker in checkers(scenes, rng):
        chain = checker.scene.chain
        q = rng.uniform(chain.lower, chain.upper, (100, chain.n))
        seen = checker.clearances(q, np.zeros(100, dtype=np.int64)).distance
        for start in q[(seen > 0.01) & (seen < REACH)][:3]:
            # it is near in the middle of a step
            way = start + np.array([-3.0, -1.0, 1.0, 3.0])[:, None] * rng.normal(size=chain.n) * 0.03
            stage = np.zeros(len(way), dtype=np.int64)
            found = checker.clearances(way, stage)
            _, nearest = least_on_the_way(checker, np.full(chain.n, 4.0), way, stage, found, many=0)
            t = np.linspace(0, 1, 15)[:, None]
            dense = np.concatenate([a + t * (b - a) for a, b in pairwise(way)])
            true = checker.clearances(dense, np.zeros(len(dense), dtype=np.int64)).distance.min()
            if not np.isfinite(true) or true < 0:
                continue
            met += 1
            assert nearest.distance[0] <= true + max(NEAREST, NEAREST_SHARE * true / (1 - NEAREST_SHARE)) + 1e-9
            assert nearest.distance[0] >= true - 2e-3
    assert met > 4


class Posts:
    """A point in the plane of two joints, a metre a radian, against posts."""

    reach = 3.0
    radius = np.ones(2)

    def __init__(self, posts):
        self.posts = np.atleast_2d(posts)

    def travel_bound(self, radius, a, b):
        return np.linalg.norm(b - a, axis=1)

    def clearances(self, q, stage):
        apart = np.linalg.norm(q[:, None] - self.posts, axis=2).min(axis=1)
        return Clearances(apart, np.zeros((len(q), 2), dtype=np.int64), np.zeros((len(q), 3)))


def test_what_a_later_group_comes_nearer_to_between_samples_is_found(monkeypatch):
    rng = np.random.default_rng(7)
    later = 0
    for _ in range(40):
        q = np.cumsum(rng.normal(size=(9, 2)) * 0.3, axis=0)
        posts = q[rng.integers(9, size=3)] + rng.normal(size=(3, 2)) * 0.3
        groups = [Posts(post) for post in posts]
        found = Posts(posts).clearances(q, np.zeros(9))
        monkeypatch.setattr(between_samples, "groups_of", lambda checker, found, groups=groups: groups)
        monkeypatch.setattr(
            between_samples, "travel_bounds", lambda groups, q: [g.travel_bound(None, q[:-1], q[1:]) for g in groups]
        )
        stage = np.zeros(9, dtype=np.int64)
        _, nearest = least_on_the_way(Posts(posts), np.ones(2), q, stage, found, many=0)
        dense = np.concatenate([a + np.linspace(0, 1, 400)[:, None] * (b - a) for a, b in pairwise(q)])
        each = [group.clearances(dense, None).distance.min() for group in groups]
        true = min(each)
        later += each[0] > 1.5 * true and true < 0.9 * found.distance.min()
        assert true - 5e-3 <= nearest.distance[0] <= true + max(NEAREST, NEAREST_SHARE * true / (1 - NEAREST_SHARE))
    assert later > 5


def test_there_are_no_groups_where_the_table_turns_as_well(scenes):
    rng = np.random.default_rng(6)
    checker = checkers(scenes, rng)[0]
    turning = Checker(with_table_axes(checker.scene), checker.table, REACH)
    assert groups_of(turning, near_of(checker, rng)) == ()
    assert groups_of(checker, replace(near_of(checker, rng), pair=np.full((1, 2), -1)))[0].parts is None
