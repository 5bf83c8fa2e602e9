"""Covers hold all that they stand for, and what is proved by them is kept, as a second engine sees it too."""

from dataclasses import replace

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case
from support.jobs.searches import setup_of

from cell.collision.checker import Checker
from cell.collision.proofs import laid_covers
from cell.collision.proofs.convex_shapes import ConvexShape
from cell.collision.proofs.covered_pairs import covered_pairs
from cell.collision.proofs.laid_covers import MOST_HELD, MOST_LATER, TOGETHER, LaidCovers
from cell.collision.proofs.plane_proofs import PlaneProofs
from cell.collision.proofs.step_clusters import gather_steps
from cell.planning.part_plan import plan_part
from cell.table_poses.suited_poses import ABSENT

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


def covers_of_layers(layers):
    """The covers of a part of one sub-volume whose layers have pieces, points (n, 3) each; and shapes of the pieces."""
    out = LaidCovers.__new__(LaidCovers)
    out._first, out._stages = 0, len(layers) + 1
    number = np.repeat(np.arange(len(layers)), [len(pieces) for pieces in layers])
    pieces = [ConvexShape(points, 0.0, UP, 0.0) for layer in layers for points in layer]
    out._begin([(np.arange(len(pieces)), number)])
    return out, pieces.__getitem__


def tubes(rng, layers, count):
    """A wall that grows outwards round a body, in pieces."""
    for layer in range(layers):
        angle, z = np.sort(rng.uniform(0, 2 * np.pi, count)), rng.uniform(-0.01, 0.01, count)
        tube = np.stack([np.cos(angle), np.sin(angle), z], axis=1) * [*2 * [0.04 + 0.001 * layer], 1.0]
        yield np.array_split(tube + np.array([1.0, 0.0, 0.8]), 7)


def slabs(rng, layers, count):
    """A wall that grows upwards and turns, some of its layers with no pieces."""
    for layer in range(layers):
        turn, at = 0.02 * layer, rng.uniform(-1, 1, (count, 3)) * [0.05, 0.005, 0.0005]
        across = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
        at[:, :2] = at[:, :2] @ across.T
        yield np.array_split(at + np.array([0.0, 0.0, 0.001 * layer]), 3) if layer % 5 != 3 else []


def domes(rng, layers, count):
    """Round every way, so that many corners are on the hull."""
    for layer in range(layers):
        yield np.array_split((0.04 + 0.001 * layer) * directions(rng, count), 2)


@pytest.mark.parametrize(
    ("part", "layers", "count"),
    [
        (tubes, 40, MOST_LATER + 300),
        (tubes, 9, MOST_LATER - 1),
        (slabs, 300, 60),
        *(
            pytest.param(*one, marks=pytest.mark.slow)
            for one in ((tubes, 70, 700), (slabs, 90, 600), (domes, 10, 1600))
        ),
    ],
)
def test_every_cover_holds_all_points_of_what_is_laid_by_then(part, layers, count):
    """With as many points in a layer as are held as they are, with more and with less; in blocks of blocks."""
    rng = np.random.default_rng(19)
    n, every = directions(rng, 500), list(part(rng, layers, count))
    covers, shape_of = covers_of_layers(every)
    true, larger = np.full(len(n), -np.inf), []
    for laid, pieces in enumerate(every, 1):
        for points in pieces:
            true = np.maximum(true, (points @ n.T).max(axis=0))
        shape = covers.shape(laid, shape_of)
        said = shape.support(n.T)
        assert (said >= true - 1e-15).all()  # points that are held as they are reach as far, but for the last bit
        larger.append(
            (said - true).max()
            / (true + np.max([(-points @ n.T).max(axis=0) for points in pieces or [0 * n]], axis=0)).max()
        )
    assert max(larger) < 4e-3
    kinds = {size for _, _, size in covers._blocks}
    assert TOGETHER in kinds or layers < 10


def bits(shape):
    return shape.points.tobytes(), shape.ball


@pytest.mark.parametrize(
    ("part", "layers", "count"),
    [(tubes, 21, MOST_LATER + 100), (slabs, 60, 400), pytest.param(domes, 6, 1600, marks=pytest.mark.slow)],
)
def test_covers_are_the_same_to_the_bit_whatever_is_asked_for_first(part, layers, count):
    every = list(part(np.random.default_rng(21), layers, count))
    covers, shape_of = covers_of_layers(every)
    in_order = [bits(covers.shape(laid, shape_of)) for laid in range(1, layers + 1)]
    assert len(set(in_order)) > layers / 2
    backwards, late = covers_of_layers(every)[0], range(layers, layers // 2, -1)
    assert [bits(backwards.shape(laid, shape_of)) for laid in late] == [in_order[laid - 1] for laid in late]
    assert [bits(backwards.shape(laid, shape_of)) for laid in range(1, layers + 1)] == in_order
    for laid in (1, layers // 3, layers // 2, layers):
        assert bits(covers_of_layers(every)[0].shape(laid, shape_of)) == in_order[laid - 1]


def test_of_early_layers_only_blocks_are_made_where_late_ones_are_asked_about(monkeypatch):
    made, reduced = [], laid_covers._reduced
    monkeypatch.setattr(laid_covers, "_reduced", lambda *args: made.append(args) or reduced(*args))
    layers = 4 * TOGETHER + 2
    covers, shape_of = covers_of_layers(list(tubes(np.random.default_rng(23), layers, MOST_LATER + 1)))
    covers.shape(layers, shape_of)
    assert len(made) == layers + 4 + 1  # each layer, and blocks of 4 and of 16
    assert covers.shape(layers, shape_of) is covers.shape(layers, shape_of)
    covers.shape(layers - 1, shape_of)
    assert len(made) == layers + 4 + 1


@pytest.mark.slow
def test_what_is_held_as_it_is_never_has_many_points():
    every = list(domes(np.random.default_rng(25), 8, MOST_LATER + 1))
    covers, shape_of = covers_of_layers(every)
    held = [len(covers.shape(laid, shape_of).points) for laid in range(1, 9)]
    assert max(held) <= MOST_HELD + MOST_LATER
    assert sum(len(block.points) for block in covers._blocks.values()) > 2 * MOST_HELD


def test_shapes_that_are_thicker_than_the_hull_of_their_points_stay_so():
    rng = np.random.default_rng(27)
    shapes = [ConvexShape(rng.normal(size=(400, 3)) + at, ball, UP, 0.0) for at, ball in ((0.0, 0.3), (2.0, 0.1))]
    n = directions(rng, 500).T
    true = np.max([shape.support(n) for shape in shapes], axis=0)
    for one in (laid_covers._together(shapes), laid_covers._reduced(shapes, 1e-3)):
        assert (one.support(n) >= true).all()
    with pytest.raises(ValueError, match="more than the hull"):
        covers_of_layers([[rng.normal(size=(5, 3))]])[0].shape(1, lambda _: shapes[0])


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


def test_a_cover_is_of_the_deposits_as_its_own_scene_numbers_them(boss):
    """A scene in which nothing of a sub-volume is ever laid shares its model and its table pose with the whole one."""
    scene, n = boss.scene, directions(np.random.default_rng(8), 200)
    others = replace(scene, deposit_of_geom=np.where(scene.deposit_of_geom < 0, -1, ABSENT))
    later = replace(scene, deposit_of_geom=np.where(scene.deposit_of_geom < 0, -1, scene.n_deposits - 1))
    for one in (others, later, scene):
        links = PlaneProofs(Checker(one, (0.3, 0.2), REACH), covered=True)._links
        for laid in (1, scene.n_deposits):
            there = (one.deposit_of_geom >= 0) & (one.deposit_of_geom < laid)
            pieces = np.flatnonzero(there & scene.contact_bits.any(axis=0)).tolist()
            ids = links.covers.ids(laid)
            assert len(ids) == bool(pieces)
            true = np.max([links.shape(g).support(n.T) for g in pieces], axis=0, initial=-np.inf)
            reached = np.max([links.shape(cover).support(n.T) for cover in ids], axis=0, initial=-np.inf)
            assert (reached >= true - 1e-12).all()


def test_a_part_of_thousands_of_layers_has_its_cover_at_once():
    corners = np.array([[x, y, z] for x in (0.0, 0.02) for y in (0.0, 0.03) for z in (0.0, 0.001)])
    layers = 2500
    up = np.array([0.0, 0.0, 0.001])
    many, shape_of = covers_of_layers([[corners + n * up] if n % 3 == 0 else [] for n in range(layers)])
    tall = many.shape(layers, shape_of)
    assert tall.support(UP) == pytest.approx(0.001 * ((layers - 1) // 3 * 3 + 1), rel=2e-3)
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
