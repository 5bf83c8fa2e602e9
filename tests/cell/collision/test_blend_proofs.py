"""Corners proved free for every rounding up to the full one, and looked at where they are not: by dense sampling."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.distance import cdist
from support.cells.arm_places import places
from support.jobs.cases import little_case

from cell.case.read import load_case
from cell.collision.blend_bisection import NEARLY_ALL, _SheetDistances, _StepSheetRectangles, colliding_blends
from cell.collision.blend_proofs import KnownRows, PathCorners, _off_by_links, _otherwise, every_blend_kept
from cell.collision.blended_corners import cut_corners
from cell.collision.blended_paths import BlendedPath, PathBlends
from cell.collision.checker import Checker
from cell.collision.clearances import Clearances
from cell.collision.pair_groups import PairGroupChecker, groups_of
from cell.collision.proofs.reach_radii import radii
from cell.job.job import prepare
from cell.timing.blending import blended, kept_zone


class Point:
    """A point in the plane of two axes, a metre a radian, and small round posts in it."""

    reach = 10.0

    def __init__(self, posts, radius):
        self.posts, self.radius, self.looks = np.atleast_2d(posts), radius, 0

    def travel_bound(self, radius, a, b):
        return np.linalg.norm(b - a, axis=1)

    def bend_bound(self, radius, turn):
        return np.zeros(len(turn))

    def clearances(self, q, deposits_laid):
        self.looks += len(q)
        found = Clearances.none(len(q))
        found.distance[:] = np.linalg.norm(q[:, None] - self.posts, axis=2).min(axis=1) - self.radius
        found.pair[:], found.position[:] = 0, 0.0
        return found

    def on_step(self, a, b):
        """Clearance on a straight way, to the last digit."""
        t = np.clip((self.posts - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        return np.linalg.norm(a + t[:, None] * (b - a) - self.posts, axis=1).min() - self.radius


def wandering(rng):
    """Rows of a path that bends, turns back the way it came, or both; each length of its own."""
    m = int(rng.integers(8, 40))
    turn = rng.normal(size=m) * rng.choice([0.05, 0.4])
    turn[rng.integers(m, size=2)] += np.pi * rng.integers(0, 2)
    heading = np.cumsum(turn)
    steps = np.stack([np.cos(heading), np.sin(heading)], axis=1) * rng.uniform(0.005, 0.02, (m, 1))
    q = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    s = 0.3 + np.concatenate([[0.0], np.cumsum(rng.uniform(0.005, 0.02, m))])
    return BlendedPath(q, s, float(rng.uniform(0.05, 0.6)) * (s[-1] - s[0]) / 2)


def sheet_of(path, k, n=60):
    """Configurations of a step rounded over many zones, (n, n, 2)."""
    at = np.linspace(path.s[k], path.s[k + 1], n)
    return np.array([blended(path.q, path.s, z * path.zone, at) for z in np.linspace(1e-3, 1.0, n)])


def amid(path, rng):
    """A step, and a configuration of its sheet that is far off all rows, of a few that are tried."""
    best = (0.0, 0, np.zeros(2))
    for k in rng.integers(len(path.s) - 1, size=4).tolist():
        sheet = sheet_of(path, k, 12)[1:-1, 1:-1].reshape(-1, 2)
        rows = np.stack([np.interp(np.linspace(*path.s[[0, -1]], 500), path.s, column) for column in path.q.T], axis=1)
        off = np.linalg.norm(sheet[:, None] - rows, axis=2).min(axis=1)
        best = max(best, (off.max(), k, sheet[int(np.argmax(off))]), key=lambda one: one[0])
    return best[1], best[2]


def known(path, point, least, kept=None, deposits_laid=None):
    m = len(path.s)
    deposits_laid = np.zeros(m, dtype=np.int64) if deposits_laid is None else deposits_laid
    found = point.clearances(path.q, deposits_laid)
    kept = np.full(m - 1, -np.inf) if kept is None else kept
    return KnownRows(deposits_laid, found, least, np.ones(m - 1, dtype=bool), kept)


def test_no_rounding_is_further_off_the_rows_than_the_full_one_is_said_to_be():
    rng, tight, radius = np.random.default_rng(2), [], np.array([2.0, 0.7])
    for _ in range(30):
        path = wandering(rng)
        path = BlendedPath(path.q, path.s - path.s[0], kept_zone(path.zone, path.s[-1] - path.s[0]))
        corners, at = PathCorners.of(path), np.linspace(0, path.s[-1], 700)
        bound = corners.off(radius, at)
        rows = np.stack([np.interp(at, path.s, column) for column in path.q.T], axis=1)
        for share in (0.02, 0.2, 0.5, 0.8, 1.0):
            off = np.abs(blended(path.q, path.s, share * path.zone, at) - rows) @ radius
            assert (off <= bound + 1e-12).all()
        # between two rows no more than the chord of what it is at them
        ends = corners.off(radius, path.s)
        assert (bound <= np.interp(at, path.s, ends) + 1e-12).all()
        one = np.argmax(bound)
        tight.append(off[one] / bound[one])
    assert max(tight) > 0.8


def test_one_zone_for_each_place_is_the_average_over_that_zone():
    rng = np.random.default_rng(4)
    path = wandering(rng)
    s = path.s - path.s[0]
    at, zone = rng.uniform(0, s[-1], 50), rng.uniform(0.01, 0.5, 50) * s[-1]
    one = np.concatenate([blended(path.q, s, z, at[k : k + 1]) for k, z in enumerate(zone.tolist())])
    assert PathBlends(path.q, s).at(at, zone) == pytest.approx(one, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("told", [False, True])
def test_where_every_rounding_is_proved_to_keep_the_clearance_it_does(told):
    rng, least, proved, near = np.random.default_rng(6), 0.004, 0, 0
    for _ in range(80):
        path = wandering(rng)
        post = amid(path, rng)[1] + rng.normal(size=(2, 2)) * np.array([[0.001], [0.015]])
        point = Point(post, 1e-3)
        own = np.array([point.on_step(a, b) for a, b in pairwise(path.q)])
        if own.min() < least:
            continue
        ok = every_blend_kept(point, np.ones(2), path, known(path, point, least, own if told else None))
        proved += ok.sum()
        for i in range(len(own)):
            true = point.clearances(sheet_of(path, i, 30).reshape(-1, 2), None).distance.min()
            near += true < least
            assert not ok[i] or true >= least
    assert proved > 100
    assert near > 10


def test_a_path_that_turns_back_the_way_it_came_is_proved_by_its_own_rows():
    """Off the rows by a quarter of the zone, 25 mm, and yet nowhere else than where they have been."""
    s = np.linspace(0.0, 1.0, 101)
    x = np.minimum(s, 1.0 - s)
    q = np.stack([x, 1e-3 * np.sin(5 * x)], axis=1)
    path, point = BlendedPath(q, s, 0.1), Point([[0.45, 0.02]], 0.0)
    kept = np.array([point.on_step(a, b) for a, b in pairwise(q)])
    here = known(path, point, 0.01, kept)
    assert PathCorners.of(path).off(np.ones(2), s[50:51])[0] > 0.04
    assert every_blend_kept(point, np.ones(2), path, here).all()
    # not where the rows' own clearance is another one: more is laid where the step is than was when they were seen
    deposits_laid = np.where(np.arange(101) >= 50, 1, 0)
    deposits_laid[53:] = 0
    left = ~every_blend_kept(point, np.ones(2), path, known(path, point, 0.01, kept, deposits_laid))
    assert left[49:53].any()


def test_what_stands_between_the_legs_of_a_hairpin_is_met_by_a_rounding_of_its_turn():
    """The legs are 8 mm apart and keep 4 mm; their means cross the middle."""
    out = np.stack([np.linspace(0.0, 0.5, 51), np.full(51, 0.004)], axis=1)
    q = np.concatenate([out, (out * (1, -1))[::-1]])
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    path, point = BlendedPath(q, s, 0.1), Point([[0.47, 0.0]], 1e-4)
    kept = np.array([point.on_step(a, b) for a, b in pairwise(q)])
    assert kept.min() > 0.0038
    proved = every_blend_kept(point, np.ones(2), path, known(path, point, 1e-3, kept))
    near = [point.clearances(sheet_of(path, k).reshape(-1, 2), None).distance.min() < 1e-3 for k in range(101)]
    assert not proved[near].any()
    assert np.flatnonzero(near).tolist() == [48, 49, 50, 51, 52]  # about the step from one leg to the other
    deposits_laid = np.zeros(102, dtype=np.int64)
    step, _ = cut_corners(point, np.ones(2), path, deposits_laid, point.clearances(q, deposits_laid), 1e-3, kept=kept)
    assert step.tolist() == [48, 49, 50, 51, 52]


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    return prepare(load_case(little_case(tmp_path_factory.mktemp("boss")))).scene


def test_by_where_its_links_are_no_rounding_is_further_off_than_is_said(scene):
    rng, radius, chain = np.random.default_rng(7), radii(scene), scene.chain
    checker = Checker(scene, (0.0, 0.0), 0.05)
    tight = []
    for trial in range(10):
        m = 12
        start = rng.uniform(0.6 * chain.lower, 0.6 * chain.upper)
        q = start + np.cumsum(np.cumsum(rng.normal(size=(m, 6)), axis=0) * 0.004 * (1 + trial % 3), axis=0)
        s = np.concatenate([[0.0], np.cumsum(rng.uniform(0.5e-3, 2e-3, m - 1))])
        path = BlendedPath(q, s, kept_zone(2.5e-3, s[-1]))
        corners, steps = PathCorners.of(path), np.arange(m - 1)
        bound = _off_by_links(checker, radius, path, corners, steps)
        for k in range(m - 1):
            at = np.linspace(s[k], s[k + 1], 5)
            rows = places(scene, np.stack([np.interp(at, s, column) for column in q.T], axis=1))
            for share in (0.2, 0.6, 1.0):
                there = places(scene, blended(q, s, share * path.zone, at))
                off = 2 * np.linalg.norm(there - rows, axis=2).max()
                assert off <= bound[k] + 1e-9
            tight.append(off / bound[k])
    assert np.median(tight) > 0.4


def test_what_a_motion_moves_otherwise_once_the_joints_have_turned_is_bounded(scene):
    rng, radius, chain = np.random.default_rng(9), radii(scene), scene.chain
    checker, most = Checker(scene, (0.0, 0.0), 0.05), []
    for _ in range(40):
        q = rng.uniform(chain.lower, chain.upper)
        a, b = (rng.normal(size=6) * rng.choice([0.0, 1.0], 6) * 0.05 for _ in range(2))
        x = places(scene, np.stack([q, q + a, q + b, q + a + b]))
        other = 2 * np.linalg.norm(x[3] - x[1] - x[2] + x[0], axis=1).max()
        bound = _otherwise(checker, radius, np.abs(a)[None], np.abs(b)[None])[0]
        assert other <= bound + 1e-12
        most.append(other / max(bound, 1e-12))
    assert max(most) > 0.2


def test_two_parts_of_the_arm_come_nearer_to_one_another_by_more_than_each_moves_and_no_more_than_is_said(scene):
    rng, radius, nearer = np.random.default_rng(5), radii(scene), []
    itself = groups_of(Checker(scene, (0.0, 0.0), 0.05))[1]
    # the upper arm goes one way and the torch the other
    q = np.array([2.501, -2.386, 1.361, 1.003, 1.954, 3.689])
    step = np.array([-0.00426, 0.00457, -0.00554, 0.00592, 0.01797, 0.00958])
    for size in rng.uniform(0.2, 1.0, 20):
        a = q + rng.normal(size=6) * 0.05
        b = a + size * step
        x, y = places(scene, np.stack([a, b]))
        moved = np.linalg.norm(y - x, axis=1).max()
        change = np.abs(cdist(x, x) - cdist(y, y)).max()
        assert change <= itself.travel_bound(radius, a[None], b[None])[0]
        nearer.append(change / moved)
    assert max(nearer) > 1.2


def test_the_groups_of_a_checkers_pairs_see_together_what_it_sees(scene):
    rng, chain = np.random.default_rng(3), scene.chain
    checker = Checker(scene, (0.0, 0.0), 0.05)
    groups = groups_of(checker)
    assert [type(group) for group in groups] == [PairGroupChecker, PairGroupChecker]
    q, deposits_laid = rng.uniform(chain.lower, chain.upper, (80, 6)), rng.integers(0, scene.n_deposits + 1, 80)
    least = np.minimum(*(group.clearances(q, deposits_laid).distance for group in groups))
    found = checker.clearances(q, deposits_laid).distance
    assert np.minimum(least, checker.reach) == pytest.approx(np.minimum(found, checker.reach), abs=1e-6)
    assert (found < 0.05).sum() > 10
    # what stands still does not come towards the arm: half of what two parts of the arm may do
    radius, a, b = radii(scene), q[:40], q[40:] * 0.05 + 0.95 * q[:40]
    still, itself = (group.travel_bound(radius, a, b) for group in groups)
    assert (still <= itself).all()
    away = np.linalg.norm(places(scene, a) - places(scene, b), axis=2).max(axis=1)
    assert (away <= still + 1e-9).all()
    point = Point([[0.0, 0.0]], 0.1)
    assert groups_of(point) == (point,)


@pytest.mark.slow
def test_a_post_anywhere_among_the_roundings_of_a_corner_is_met():
    """Contact is all that is asked after: paths that round less and more are free, and one between them is not."""
    rng, met, free = np.random.default_rng(12), 0, 0
    for _ in range(40):
        path = wandering(rng)
        k, amidst = amid(path, rng)
        point = Point(amidst, 0.4 * NEARLY_ALL)
        own = [point.on_step(a, b) for a, b in pairwise(path.q)]
        if min(own) < 1e-3:
            continue
        deposits_laid = np.zeros(len(path.s), dtype=np.int64)
        step, nearest = cut_corners(
            point, np.ones(2), path, deposits_laid, point.clearances(path.q, deposits_laid), NEARLY_ALL
        )
        met += 1
        assert k in step
        assert nearest.distance[step == k].max() < NEARLY_ALL
        # a little beside the sheets of all steps it is not
        every = np.concatenate([sheet_of(path, n, 40).reshape(-1, 2) for n in range(len(own))])
        beside = Point(amidst + rng.normal(size=2) * 0.05, 1e-4)
        if min(beside.clearances(every, None).distance.min(), *own) > 2e-3:
            free += 1
            found = beside.clearances(path.q, deposits_laid)
            assert not len(cut_corners(beside, np.ones(2), path, deposits_laid, found, 1e-3)[0])
    assert met > 15
    assert free > 5


@pytest.mark.slow
def test_no_rectangle_of_roundings_reaches_further_than_is_said():
    """Of what is passed, no configuration of the sheet comes nearer than the clearance less what is allowed for."""
    rng, least, passed = np.random.default_rng(21), 0.006, 0
    for _ in range(40):
        path = wandering(rng)
        steps = np.sort(rng.choice(len(path.s) - 1, 3, replace=False))
        sheets = [sheet_of(path, k, 80).reshape(-1, 2) for k in steps]
        every = np.concatenate(sheets)
        point = Point(every[rng.integers(len(every), size=2)] + rng.normal(size=(2, 2)) * 0.01, 1e-3)
        here = known(path, point, least)
        hits = colliding_blends(point, np.ones(2), path, here, steps)
        assert (hits.nearest.distance < least).all()
        for k, sheet in zip(steps.tolist(), sheets, strict=True):
            true = point.clearances(sheet, None).distance.min()
            passed += k not in hits.step
            assert k in hits.step or true >= least - NEARLY_ALL
            assert k not in hits.step or true < least + 1e-3
    assert passed > 20


def to_and_fro(rng):
    """Rows on one line, to and fro by steps of very different lengths: within one of them a rounding sways."""
    m = int(rng.integers(4, 9))
    q = np.stack([rng.normal(size=m), np.zeros(m)], axis=1)
    s = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2, 2.0, m - 1))])
    return BlendedPath(q, s, float(rng.uniform(0.1, 0.5)) * s[-1])


def on_the_spot(rng):
    """Rows of which two are at one place of the path, with all the turning between them."""
    path = wandering(rng)
    k = int(rng.integers(1, len(path.s) - 1))
    s, q = path.s.copy(), path.q.copy()
    s[k:] -= s[k] - s[k - 1] - 1e-9
    q[k:] += rng.normal(size=2)
    return BlendedPath(q, s, min(path.zone, (s[-1] - s[0]) / 2))


@pytest.mark.parametrize("path_of", [wandering, to_and_fro, on_the_spot])
def test_no_configuration_of_a_rectangle_is_further_from_its_middle_than_is_said(path_of):
    rng, tight = np.random.default_rng(31), []
    for _ in range(200):
        path = path_of(rng)
        path = BlendedPath(path.q, path.s - path.s[0], kept_zone(path.zone, path.s[-1] - path.s[0]))
        k = int(rng.integers(len(path.s) - 1))
        ends, wide = path.s[k : k + 2], rng.uniform(0.3, 1.0) * path.zone
        for narrow in (0.0, rng.uniform(0.3, 0.99) * wide):
            some = _StepSheetRectangles(
                *(np.array([x]) for x in (*ends, narrow, wide)), np.array([k]), np.array([np.inf])
            )
            middle, far, _ = _SheetDistances(Point([[9.0, 9.0]], 0.0), np.ones(2), path).extent(some)
            at, zones = np.linspace(*ends, 15), np.linspace(max(narrow, 1e-6), wide, 8)
            sheet = np.concatenate([blended(path.q, path.s, zone, at) for zone in zones.tolist()])
            off = np.linalg.norm(sheet - middle, axis=1).max()
            assert off <= far[0] + 1e-12
            tight.append(off / far[0])
    assert max(tight) > 0.8


def test_a_turn_on_the_spot_is_proved_free_by_what_is_travelled():
    """Where hardly any length is gone slopes say nothing: halves of halves would never do."""
    q = np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 2.0], [0.2, 2.0]])
    path = BlendedPath(q, np.array([0.0, 0.1, 0.1 + 1e-9, 0.2]), 0.001)
    point = Point([[0.115, 1.0], [-0.05, 1.0]], 0.0)
    here, steps = known(path, point, 5e-3), np.arange(3)
    hits = colliding_blends(point, np.ones(2), path, here, steps)
    assert not len(hits.step)
    assert point.looks < 50_000
    near = Point([[0.104, 1.0]], 0.0)
    assert len(colliding_blends(near, np.ones(2), path, known(path, near, 5e-3), steps).step)


def test_a_group_that_sees_further_takes_nothing_for_known_out_to_there(monkeypatch):
    """Where nothing was seen at the rows, nothing is known but that all is further away than was looked then."""

    class ShortSighted(Point):
        reach = 0.05

        def clearances(self, q, deposits_laid):
            found = super().clearances(q, deposits_laid)
            found.distance[found.distance > self.reach] = np.inf
            return found

    legs = np.linspace(-0.3, 0.0, 7)
    q = np.concatenate([np.stack([legs, 0 * legs], axis=1), np.stack([0 * legs, -legs[::-1]], axis=1)[1:]])
    path = BlendedPath(q, np.linspace(0.0, 0.6, len(q)), 0.3)
    short, far = (kind([[-0.06, 0.06]], 1e-3) for kind in (ShortSighted, Point))
    here = known(path, short, 2e-3)
    assert np.isinf(here.found.distance).all()
    monkeypatch.setattr("cell.collision.blend_bisection.groups_of", lambda checker: (far,))
    assert len(colliding_blends(short, np.ones(2), path, here, np.arange(len(q) - 1)).step)


def test_what_is_not_proved_counts_as_too_near_unless_the_motion_is_known_not_to_be_free():
    path = wandering(np.random.default_rng(5))
    # with axes of a thousand kilometres no bound says anything
    point, long, steps = Point([[-0.03, 0.0]], 0.0), np.full(2, 1e6), np.arange(3)
    assert min(point.clearances(sheet_of(path, k).reshape(-1, 2), None).distance.min() for k in steps) > 5e-3
    here = known(path, point, 5e-3)
    hits = colliding_blends(point, long, path, here, steps)
    assert len(hits.step)
    assert (hits.nearest.distance > 5e-3).all()
    assert not len(colliding_blends(point, long, path, replace(here, lost=True), steps).step)
