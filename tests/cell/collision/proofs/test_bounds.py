"""The bounds that proofs rest on, against dense sampling: of the arm's radii, of steps, and of rounded corners."""

import tracemalloc
from dataclasses import replace
from itertools import pairwise

import mujoco
import numpy as np
import pytest

from cell.case.read import load_case
from cell.collision.blended_corners import cut_corners
from cell.collision.blended_paths import BlendedPath
from cell.collision.checker import Checker
from cell.collision.clearances import Clearances
from cell.collision.proofs.between_samples import NEAREST, NEAREST_SHARE, least_between_samples, unproven_steps
from cell.collision.proofs.motion_bounds import MotionBounds, joint_travel_bound
from cell.collision.proofs.reach_radii import radii, table_radii
from cell.failure import Failure, FailurePlace, Kind, Where
from cell.job.job import prepare
from cell.planning import assemble as motion
from cell.planning.travels.travel import TravelPath
from cell.timing.blending import blended

GEOM = mujoco.mjtGeom


class Posts:
    """Collision detection of a point in the plane of two joints, a metre a radian, against thin posts."""

    reach = 10.0

    def __init__(self, posts, thick):
        self.posts, self.thick, self.looked_at = np.atleast_2d(posts), thick, 0

    def travel_bound(self, radius, a, b):
        return np.linalg.norm(b - a, axis=1)

    def bend_bound(self, radius, turn):
        return np.zeros(len(turn))

    def distance(self, q):
        return np.linalg.norm(q[:, None] - self.posts, axis=2).min(axis=1) - self.thick

    def clearances(self, q, deposits_laid):
        self.looked_at += len(q)
        return Clearances(self.distance(q), np.zeros((len(q), 2), dtype=np.int64), np.zeros((len(q), 3)))


def stage_of(q):
    return np.zeros(len(q), dtype=np.int64)


def on_the_way(q, k, count=400):
    """Dense samples of a step."""
    return q[k] + np.linspace(0, 1, count)[:, None] * (q[k + 1] - q[k])


def from_step(posts, a, b):
    """How far posts are from the straight way from one place to another, to the last digit, (p,)."""
    t = np.clip((posts - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
    return np.linalg.norm(a + t[:, None] * (b - a) - posts, axis=1)


def surface(model, g):
    """Points of a geom's surface in its own frame, its farthest among them."""
    kind, size = model.geom_type[g], model.geom_size[g]
    if kind == GEOM.mjGEOM_MESH:
        m = model.geom_dataid[g]
        return model.mesh_vert[model.mesh_vertadr[m] :][: model.mesh_vertnum[m]]
    turn = np.linspace(0, 2 * np.pi, 24)
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) * size[0]
    if kind == GEOM.mjGEOM_SPHERE:
        return np.concatenate([ring, ring[:, [2, 0, 1]]])
    ends = [ring + np.array([0, 0, z * size[1]]) for z in (-1, 1)]
    if kind == GEOM.mjGEOM_CAPSULE:
        ends += [np.array([[0, 0, z * (size[0] + size[1])]]) for z in (-1, 1)]
    return np.concatenate(ends)


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    from support.jobs.cases import little_case

    return prepare(load_case(little_case(tmp_path_factory.mktemp("boss")))).scene


def points_at(scene, geoms, qpos, rows):
    """Where points of geoms are in configurations, (m, k, 3)."""
    data, out = mujoco.MjData(scene.model), []
    mine = [surface(scene.model, g) for g in geoms]
    for row in rows:
        data.qpos[qpos] = row
        mujoco.mj_kinematics(scene.model, data)
        out.append(
            np.concatenate(
                [p @ data.geom_xmat[g].reshape(3, 3).T + data.geom_xpos[g] for g, p in zip(geoms, mine, strict=True)]
            )
        )
    return np.array(out)


def test_no_point_of_arm_or_table_moves_further_than_its_radius_says(scene):
    rng, turn = np.random.default_rng(0), 1e-4
    solid = scene.contact_bits.any(axis=0)
    chain = scene.chain
    table = solid & ~scene.arm_geom & (scene.model.geom_type != GEOM.mjGEOM_PLANE)
    for geoms, qpos, radius, low, high in (
        (solid & scene.arm_geom, scene.arm_qpos, radii(scene), chain.lower, chain.upper),
        (table, scene.table_qpos, table_radii(scene), *scene.table_range.T),
    ):
        geoms = np.flatnonzero(geoms)
        for q in rng.uniform(low, high, (25, len(low))):
            rows = np.concatenate([q[None], q + turn * np.eye(len(low))])
            at = points_at(scene, geoms, qpos, rows)
            moved = np.linalg.norm(at[1:] - at[0], axis=2).max(axis=1)
            assert (moved <= turn * radius * (1 + 1e-6)).all()


def test_no_point_of_the_arm_gets_further_on_a_step_than_the_bound_of_it(scene):
    rng = np.random.default_rng(1)
    geoms = np.flatnonzero(scene.contact_bits.any(axis=0) & scene.arm_geom)
    swept = MotionBounds(scene, radii(scene))
    for size in (0.003, 0.02, 0.1, 0.4):
        for q in rng.uniform(scene.chain.lower, scene.chain.upper, (12, 6)):
            step = rng.normal(size=6) * size
            # joints against one another: where a bound of the whole way is far too much
            step[3:] = rng.choice([-1, 1]) * np.abs(step[3:])
            at = points_at(scene, geoms, scene.arm_qpos, q + np.linspace(0, 1, 9)[:, None] * step)
            # of the clearances at both ends either is lowered by no more than the way from there
            both = np.linalg.norm(at - at[0], axis=2) + np.linalg.norm(at - at[-1], axis=2)
            assert both.max() <= swept.bound(q[None], (q + step)[None])[0] * (1 + 1e-9)


def test_many_steps_are_bounded_as_one_by_one_and_in_little_memory(scene):
    rng = np.random.default_rng(4)
    a = rng.uniform(scene.chain.lower, scene.chain.upper, (40_000, scene.chain.n))
    b = a + rng.normal(size=a.shape) * 0.02
    checker = Checker(scene, (0.0, 0.0), 0.02)
    radius = radii(scene)
    assert len(checker.travel_bound(radius, a[:0], b[:0])) == 0
    tracemalloc.start()
    found = checker.travel_bound(radius, a, b)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 60e6
    few = [0, 1, 4_999, 5_000, 5_001, 39_999]
    whole = MotionBounds(scene, radius).bound(a[few], b[few])
    np.testing.assert_allclose(found[few], whole, rtol=1e-12)


def test_two_parts_of_the_arm_get_no_nearer_to_each_other_than_the_bound_of_both(scene):
    """The elbow goes one way and what the forearm carries the other."""
    rng, chain = np.random.default_rng(2), scene.chain
    swept = MotionBounds(scene, radii(scene))
    geoms = np.flatnonzero(scene.contact_bits.any(axis=0) & scene.arm_geom)
    most = 0.0
    for q in rng.uniform(chain.lower, chain.upper, (40, 6)):
        step = np.array([0, 0.01, -0.01 * rng.uniform(1, 4), 0, 0, 0])
        a, b = points_at(scene, geoms, scene.arm_qpos, np.stack([q, q + step]))[:, ::9]
        nearer = np.linalg.norm(a[:, None] - a, axis=2) - np.linalg.norm(b[:, None] - b, axis=2)
        bound = swept.bound(q[None], (q + step)[None])[0]
        assert nearer.max() <= bound * (1 + 1e-9)
        most = max(most, float(nearer.max() / bound))
    assert most > 0.5  # more than one of them alone goes


def test_a_shape_that_turns_about_its_own_middle_moves_by_what_it_is_wide(scene):
    disc = scene.model.geom("torch_mount").id  # round about A6
    alone = replace(scene, arm_geom=np.arange(scene.model.ngeom) == disc)
    swept = MotionBounds(alone, radii(alone))
    q = np.deg2rad([[0.0, -90.0, 90.0, 0.0, 30.0, 0.0]])
    for turn in (1e-3, 0.02, 0.1):
        step = np.array([[0, 0, 0, 0, 0, turn]])
        at = points_at(scene, [disc], scene.arm_qpos, np.concatenate([q, q + step]))
        moved = np.linalg.norm(at[1] - at[0], axis=1).max()
        assert moved > 0.05 * turn
        assert moved <= swept.bound(q, q + step)[0] * (1 + 1e-9)


@pytest.mark.parametrize("turn", [2.0, 4.0, 2 * np.pi])
def test_what_goes_round_and_ends_where_it_began_has_been_away(scene, turn):
    swept, geoms = MotionBounds(scene, radii(scene)), np.flatnonzero(scene.tool_geom & scene.contact_bits.any(axis=0))
    q = np.deg2rad([[0.0, -90.0, 90.0, 0.0, 30.0, -180.0]])
    step = np.array([[0, 0, 0, 0, 0, turn]])
    at = points_at(scene, geoms, scene.arm_qpos, q + np.linspace(0, 1, 25)[:, None] * step)
    both = (np.linalg.norm(at - at[0], axis=2) + np.linalg.norm(at - at[-1], axis=2)).max()
    assert both > 0.1
    assert both <= swept.bound(q, q + step)[0] / 2


@pytest.mark.parametrize("least", [0.0, 0.02])
def test_a_step_that_comes_too_near_is_never_proved(least):
    rng = np.random.default_rng(2)
    radius = np.ones(2)
    proved = 0
    for _ in range(150):
        q = np.cumsum(rng.normal(size=(6, 2)) * 0.2, axis=0)
        checker = Posts(on_the_way(q, 2)[rng.integers(400)] + rng.normal(size=2) * 0.03, 1e-4)
        known = checker.clearances(q, stage_of(q))
        open_, _ = unproven_steps(checker, radius, q, stage_of(q), known, np.arange(6) // 6, least=least)
        near = [k for k in range(5) if checker.distance(on_the_way(q, k)).min() < least]
        if near:
            assert len(open_)
        else:
            proved += len(open_) == 0
    assert proved > 20  # a proof is had where there is room


def test_each_of_several_motions_that_come_too_near_is_named():
    posts = Posts([[0.5, 0.0], [0.37, 1.0]], 0.01)  # one is met at the first halving, the other later
    q = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0], [0.0, 2.0], [1.0, 2.0]])
    found = posts.clearances(q, stage_of(q))
    open_, nearest = unproven_steps(posts, np.ones(2), q, stage_of(q), found, np.repeat([0, 1, 2], 2))
    assert open_.tolist() == [0, 2]
    assert (nearest.distance <= 0).all()


def test_what_no_sample_meets_is_not_proved_free():
    q = np.array([[0.0, 0.0], [1.0, 0.0]])
    posts = Posts([np.sqrt(0.5), 0.0], 1e-9)
    assert unproven_steps(posts, np.ones(2), q, stage_of(q), posts.clearances(q, stage_of(q)))[0].tolist() == [0]


def test_the_least_clearance_is_that_of_the_way():
    rng = np.random.default_rng(3)
    for _ in range(60):
        q = np.cumsum(rng.normal(size=(8, 2)) * 0.2, axis=0)
        checker = Posts(q[:5] + rng.normal(size=(5, 2)) * 0.2, 0.0)
        apart = np.repeat([0, 1], 4)
        found = checker.clearances(q, stage_of(q))
        at, nearest = least_between_samples(checker, np.ones(2), q, stage_of(q), found, apart)
        each = [checker.distance(on_the_way(q, k)).min() for k in (0, 1, 2, 4, 5, 6)]
        slack = max(NEAREST, NEAREST_SHARE * min(each) / (1 - NEAREST_SHARE))
        assert min(each) - 2e-3 <= nearest.distance[0] <= min(each) + slack
        # the least of both motions is found by looking at each by itself, told how near the samples come at all
        known = float(found.distance.min())
        halves = [slice(0, 4), slice(4, 8)]
        alone = [
            least_between_samples(checker, np.ones(2), q[h], stage_of(q[h]), found.rows(np.arange(8)[h]), known=known)
            for h in halves
        ]
        assert min(each) - 2e-3 <= min(one[1].distance[0] for one in alone) <= min(each) + slack
        here = [k for k in (at - 1, at) if k in (0, 1, 2, 4, 5, 6)]
        assert min(checker.distance(on_the_way(q, k)).min() for k in here) <= nearest.distance[0] + NEAREST


@pytest.mark.parametrize("least", [0.0, 0.01])
def test_a_rounded_corner_that_comes_too_near_is_never_passed(least):
    rng = np.random.default_rng(4)
    met = 0
    for _ in range(120):
        q = np.cumsum(rng.normal(size=(5, 2)) * rng.choice([0.02, 0.2], size=(5, 1)), axis=0)
        s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
        zone = float(rng.uniform(0.02, 0.2))
        dense = np.linspace(0, s[-1], 1000)
        run = blended(q, s, zone, dense)
        post = run[rng.integers(1000)] + rng.normal(size=2) * 0.3 * least
        checker = Posts(post, 1e-4)
        if min(from_step(checker.posts, q[k], q[k + 1]).min() for k in range(4)) - checker.thick < least:
            continue  # the rows themselves are not free
        seen = checker.clearances(q, stage_of(q))
        steps, _ = cut_corners(checker, np.ones(2), BlendedPath(q, s, zone), stage_of(q), seen, least)
        if checker.distance(run).min() < least:
            met += 1
            assert len(steps)
    assert met > 15


@pytest.mark.parametrize("least", [pytest.param(0.0, marks=pytest.mark.slow), 0.02])
def test_a_rounding_is_passed_by_what_the_rows_keep_only_where_it_keeps_it_too(least):
    rng = np.random.default_rng(11)
    passed = near = 0
    for _ in range(80):
        q = np.cumsum(rng.normal(size=(9, 2)) * 0.3, axis=0)
        s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
        zone = float(rng.uniform(0.02, 0.3))
        deposits_laid, run = stage_of(q), blended(q, s, zone, np.linspace(0, s[-1], 1000))
        checker = Posts(run[rng.integers(1000, size=1)] + rng.normal(size=(1, 2)) * 0.3 * least, 1e-4)
        # what the rows' own way keeps, exactly
        own = [from_step(checker.posts, a, b).min() - checker.thick for a, b in pairwise(q)]
        seen = checker.clearances(q, deposits_laid)
        steps, _ = cut_corners(
            checker, np.ones(2), BlendedPath(q, s, zone), deposits_laid, seen, least, kept=np.array(own) - 1e-3
        )
        for k in range(8):
            run = blended(q, s, zone, np.linspace(s[k], s[k + 1], 300))
            true = checker.clearances(run, stage_of(run)).distance.min()
            if true < least:
                near += own[k] > least
                assert k in steps or own[k] <= least
            else:
                passed += k not in steps
    assert passed > 100
    assert near > 10


def test_a_joint_way_is_the_sum_over_the_joints():
    a, b = np.zeros((1, 3)), np.array([[0.1, -0.2, 0.3]])
    assert joint_travel_bound(np.array([1.0, 2.0, 3.0]), a, b)[0] == pytest.approx(0.1 + 0.4 + 0.9)


def test_corners_of_travels_that_stop_for_a_dwell_are_looked_at_again(monkeypatch):
    class Job:
        class case:
            class process:
                blend_mm = 1.0

    asked = []

    def told(setup, q, found, deposits_laid, stops):
        asked.append(stops)
        return Failure(Kind.COLLISION)

    monkeypatch.setattr(motion, "bead_corners", lambda *a: {})
    monkeypatch.setattr(motion, "travel_corners", told)
    monkeypatch.setattr(motion, "_dwell", lambda job, before, after: 2.0 if after == 8 else 0.0)
    monkeypatch.setattr(motion, "retracted", lambda job, p: 1)
    Bead = type("Bead", (), {})
    beads = []
    for first, stop in ((0, 4), (4, 8), (8, 12)):
        beads.append(Bead())
        beads[-1].first, beads[-1].stop = first, stop
    job, setup = Job(), Bead()
    job.scene = Bead()
    job.scene.chain = Bead()
    job.scene.chain.n = 6
    job.scene.chain.forward = lambda q: np.tile(np.eye(4), (len(q), 1, 1))
    setup.laid = np.arange(12)
    q = np.linspace(0, 1, 5)[:, None] * np.ones(6)
    ways = (TravelPath(q, Clearances.none(5), np.ones(5), np.ones(5)),) * 2
    # all beads in one run, and in two of which the second begins with the travel to its first
    runs = (
        [motion.RunBeads(tuple(beads), ways)],
        [
            motion.RunBeads(tuple(beads[:2]), ways[:1]),
            motion.RunBeads(tuple(beads[2:]), ways[1:], (4, 7)),
        ],
    )
    for some in runs:
        asked.clear()
        failures = {}
        for run in some:
            failures.update(motion.corners(job, setup, run))
        assert list(failures) == [8]
        assert failures[8].place == FailurePlace(Where.TRAVEL, from_target=7, to_target=8)
        assert asked == [[1]]
