"""Covers hold all that they stand for, and what is proved by them is kept, as a second engine sees it too."""

import numpy as np
import pytest
from support.cells.random_cells import points as random_points
from support.jobs.boss_motion import boss_case
from support.jobs.searches import setup_of

from cell.collision.checker import Checker
from cell.collision.proofs.convex_shapes import ConvexShape
from cell.collision.proofs.covered_pairs import covered_pairs
from cell.collision.proofs.laid_covers import MOST_LATER, Cover, LaidCovers
from cell.collision.proofs.plane_proofs import PlaneProofs
from cell.collision.proofs.step_clusters import gather_steps
from cell.planning.part_plan import plan_part

REACH = 0.1
UP = np.array([0.0, 0.0, 1.0])


@pytest.fixture(scope="module")
def over(tmp_path_factory):
    """A boss, and configurations with the torch on its beads."""
    job, context = setup_of(boss_case(tmp_path_factory.mktemp("covers"), slicing={"h_layer_mm": 1.4}))
    plan = plan_part(context, job.targets.bead)
    return context.checker, np.concatenate([bead.stretches[0].q_targets for bead in plan.beads])


@pytest.fixture(scope="module")
def boss(over):
    return over[0]


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


def test_no_point_is_beyond_its_cover_in_any_direction():
    rng = np.random.default_rng(3)
    larger, fewer = [], []
    for cloud in clouds(rng):
        shape = Cover.of(cloud).shape
        n = directions(rng, 3000)
        true, said = (cloud @ n.T).max(axis=0), shape.support(n.T)
        assert (said >= true - 1e-12).all()
        wide = true + (-cloud @ n.T).max(axis=0)
        larger.append(((said - true) / wide).max())
        fewer.append(len(shape.points) / len(cloud))
    assert np.median(larger) < 0.01
    assert np.min(fewer) < 0.7


def rings(rng, layers, count):
    """The points of layers that grow, one after the other."""
    angle = np.linspace(0, 2 * np.pi, count)
    for layer in range(layers):
        ring = np.stack([np.cos(angle), np.sin(angle), 0.1 * rng.normal(size=count)], axis=1)
        yield ring * (0.04 + 0.002 * layer)


def test_what_is_left_of_the_points_stands_for_all_of_them_however_often_it_is_added_to():
    rng = np.random.default_rng(5)
    every, points = np.zeros((0, 3)), np.zeros((0, 3))
    for ring in rings(rng, 30, 200):
        every = np.concatenate([every, ring])
        last = Cover.of(np.concatenate([points, ring]))
        points = last.points
    n = directions(rng, 3000)
    true = (every @ n.T).max(axis=0)
    assert (last.shape.support(n.T) >= true).all()
    assert (last.shape.support(n.T) - true).max() < 4e-3 * 0.1
    assert len(points) < 0.5 * len(every)


@pytest.mark.parametrize(("layers", "count"), [(60, 200), (4, MOST_LATER - 1), (4, MOST_LATER + 1), (300, 60)])
def test_points_that_come_later_are_held_as_those_before_are(layers, count):
    """Before a cover of all is made and after, with as many points in a layer as may be held as they are, and more."""
    rng = np.random.default_rng(19)
    n, cover, covers, held = directions(rng, 500), None, set(), []
    true = np.full(len(n), -np.inf)
    for ring in rings(rng, layers, count):
        cover = Cover.of(ring) if cover is None else cover.with_points(ring)
        true = np.maximum(true, (ring @ n.T).max(axis=0))
        said = cover.shape.support(n.T)
        assert (said >= true).all()
        assert said == pytest.approx(true, rel=1e-2)
        covers.add(id(cover.points))
        held.append(cover)  # so that no other has its id
        assert len(cover.later) <= MOST_LATER
    assert 1 < len(covers) < max(layers, 5)


def test_a_cover_holds_all_that_is_laid_by_then_and_nothing_that_comes_later(boss):
    links = PlaneProofs(boss, covered=True)._links
    deposits, n = boss.scene.deposit_of_geom, directions(np.random.default_rng(7), 500)
    assert links.covers.ids(0) == []
    for laid in range(1, boss.scene.n_deposits + 1):
        pieces = np.flatnonzero((deposits >= 0) & (deposits < laid)).tolist()
        true = np.max([links.shape(g).support(n.T) for g in pieces], axis=0)
        (cover,) = links.covers.ids(laid)
        assert (links.shape(cover).support(n.T) >= true - 1e-12).all()
        assert links.shape(cover).support(n.T) == pytest.approx(true, abs=1e-4)


def test_a_part_of_thousands_of_layers_has_its_cover_at_once():
    corners = np.array([[x, y, z] for x in (0.0, 0.02) for y in (0.0, 0.03) for z in (0.0, 0.001)])
    layers = 2500
    many = LaidCovers.__new__(LaidCovers)
    many._first, many._stages, many._begins, many._made = 0, layers + 1, [0], {}
    many._laid = [[np.array([n]) if n % 3 == 0 else np.array([], dtype=int) for n in range(layers + 1)]]
    tall = many.shape(layers, lambda g: ConvexShape(corners + np.array([0.0, 0.0, 0.001 * g]), 0.0, UP, 0.0))
    assert tall.support(UP) == pytest.approx(0.001 * (layers // 3 * 3 + 1), rel=2e-3)
    assert tall.support(-UP) == pytest.approx(0.0, abs=5e-3)


def near_the_part(over, rng, count):
    """Free configurations near what is laid."""
    checker, welding = over
    q = welding[rng.integers(0, len(welding), 3000)] + rng.normal(scale=0.02, size=(3000, welding.shape[1]))
    found = Checker(checker.scene, checker.table, REACH).clearances(q, np.full(len(q), checker.scene.n_deposits))
    of_part = np.isin(found.pair, np.flatnonzero(checker.scene.deposit_of_geom >= 0)).any(axis=1)
    q = q[of_part & (found.distance > 4e-3)][:count]
    assert len(q) == count
    return q


def coal_hull(points):
    import coal

    some = coal.StdVec_Vec3s()
    for point in points:
        some.append(point)
    return coal.Convex.convexHull(some, True, "Qt")


def test_pairs_are_as_far_from_what_is_laid_as_they_are_said_to_be_at_least(over, boss):
    """Against the second engine, piece by piece, and no pair that is nearer than asked for is left out."""
    coal = pytest.importorskip("coal")
    from support.oracles.second_engine import signed_distance

    rng = np.random.default_rng(9)
    checker = Checker(boss.scene, boss.table, REACH)
    links, scene = PlaneProofs(checker, covered=True)._links, boss.scene
    start = near_the_part(over, rng, 25)
    q = np.concatenate([start, start + 1e-3])
    step = np.arange(len(q) - 1)
    laid = np.full(len(step), scene.n_deposits)
    poses = links.poses(q)
    clusters, _ = gather_steps(links.places(poses), step, laid, 0.0)
    need = np.full(len(clusters.at), REACH)
    near = checker.nearest_pairs(q[clusters.at], clusters.laid)
    found = covered_pairs(links, poses, clusters, near, need)
    said = {(int(c), int(a)): d for c, (a, _), d in zip(found.row, found.geom, found.distance, strict=True)}
    pieces = [coal_hull(links.shape(g).points) for g in np.flatnonzero(scene.deposit_of_geom >= 0).tolist()]
    here, close = coal.Transform3s(np.eye(3), np.zeros(3)), 0
    for g in links.meets_laid.tolist():
        shape = links.shape(g)
        if shape.disc:
            continue
        own, joint = coal_hull(shape.points) if len(shape.points) > 3 else None, links.owner[g]
        for c, at in enumerate(clusters.at.tolist()):
            if own is None:
                continue
            there = coal.Transform3s(poses.R[at, joint], poses.p[at, joint])
            true = min(signed_distance(own, there, piece, here) for piece in pieces) - shape.ball
            assert true >= said.get((c, g), REACH) - 1e-6
            close += abs(true - said.get((c, g), np.inf)) < 2e-3
    assert close > 3


def test_what_the_wire_may_touch_it_is_not_held_against(boss):
    links, scene = PlaneProofs(boss, covered=True)._links, boss.scene
    wire = np.flatnonzero(scene.wire_geom)
    assert len(wire)
    assert not np.isin(links.meets_laid, wire).any()
    solid = np.flatnonzero(scene.arm_geom & (scene.contact_bits[0] & 1 > 0) & ~scene.wire_geom)
    assert np.isin(solid, links.meets_laid).all()


@pytest.mark.parametrize("covered", [True, False])
def test_motions_over_a_part_keep_what_is_proved(over, boss, covered):
    rng = np.random.default_rng(11)
    checker = Checker(boss.scene, boss.table, REACH)
    proofs, known = PlaneProofs(checker, covered=covered), []
    for q0 in near_the_part(over, rng, 12):
        way = np.linspace(0, 1, 12)[:, None] * rng.normal(scale=0.02, size=q0.shape)
        q, step = q0 + way, np.arange(11)
        laid = np.full(11, boss.scene.n_deposits)
        kept = proofs.along(q, step, laid, 3e-3, 1e-3).kept
        every = q[step][:, None] + np.linspace(0, 1, 12)[:, None] * (q[step + 1] - q[step])[:, None]
        true = checker.clearances(every.reshape(-1, q.shape[1]), np.repeat(laid, 12)).distance
        true = np.minimum(true, REACH).reshape(11, -1).min(axis=1)
        assert (np.minimum(kept, REACH) <= true + 1e-7).all()
        known.append(kept)
    assert (np.concatenate(known) > 3e-3).sum() > 30
