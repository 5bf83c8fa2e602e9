"""Sheets of roundings proved by planes: by dense sampling of the sheets, and of what they are made of."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support.cells.random_cells import random_scenes
from support.jobs.cases import little_case

from cell.case.read import load_case
from cell.collision.blend_proofs import KnownRows, PathCorners
from cell.collision.blend_sheets import SHARES, StepSheets, _JoinedPaths, _JoinedRectangles, sheets_kept
from cell.collision.blended_corners import cut_corners, cut_corners_of
from cell.collision.blended_paths import BlendedPath
from cell.collision.checker import Checker
from cell.collision.clearances import Clearances
from cell.collision.proofs.motion_clearance import MotionSamples, clearance_along
from cell.collision.proofs.plane_proofs import PlaneProofs
from cell.collision.proofs.reach_radii import radii
from cell.collision.proofs.sheet_pieces import SheetPieces
from cell.job.job import prepare
from cell.scene.placement import place_targets
from cell.timing.blending import blended, kept_zone
from ik.roll import apply_roll

REACH = 0.3
UP = np.deg2rad([90.0, 180.0])  # a pose of the table at which the boss is up


def wandering(rng, joints, size, m=None):
    """Rows that bend in every joint, now smoothly, now at a corner; each step of a length of its own."""
    m = m or int(rng.integers(6, 40))
    smooth = np.cumsum(rng.normal(size=(m, joints)) * rng.choice([0.02, 0.3]), axis=0) + rng.normal(size=joints)
    smooth[rng.integers(m, size=2)] *= -rng.uniform(0, 2)
    q = size * np.concatenate([np.zeros((1, joints)), np.cumsum(smooth, axis=0)])
    s = 0.3 + np.concatenate([[0.0], np.cumsum(rng.uniform(0.2e-3, 1e-3, m))])
    return BlendedPath(q, s, float(rng.uniform(0.05, 0.9)) * (s[-1] - s[0]) / 2)


def rectangle(curves, rng):
    """One somewhere on the sheet of one of the paths."""
    i = int(rng.integers(len(curves.zone)))
    end = np.ptp(curves._t[curves._first[i] : curves._first[i + 1]]) / 3  # its mirror images are beside it
    u, v = np.sort(rng.uniform(0, end, 2))
    if rng.random() < 0.5:
        v = u + 0.1 * (v - u)
    wide = rng.uniform(0.2, 1.0) * curves.zone[i]
    narrow = rng.uniform(0.2, 0.95) * wide
    ends = (np.array([x]) for x in (u + curves.shift[i], v + curves.shift[i], narrow, wide))
    return _JoinedRectangles(*ends, np.array([i]), np.array([0]))


def test_what_is_said_of_a_rectangle_does_not_depend_on_how_long_its_path_is():
    """Sums over a long path differ by what a window holds, which is a small part of them and not lost in rounding."""
    rng, zone, m = np.random.default_rng(17), 1e-3, 12_000
    s = np.concatenate([[0.0], np.cumsum(rng.uniform(0.2e-3, 1.8e-3, m - 1))])
    path = BlendedPath(np.cumsum(rng.normal(size=(m, 6)) * 0.02, axis=0), s, zone)
    long = _JoinedPaths([path] * 5, np.ones(6))
    for at in rng.integers(m // 2, m - 100, 12).tolist():
        near = slice(at - 20, at + 20)
        short = _JoinedPaths([BlendedPath(path.q[near], s[near], zone)], np.ones(6))
        wide = zone * 2.0 ** -rng.uniform(0, 11, 20)
        u = s[at] + rng.uniform(-1, 1, 20) * wide
        sides = wide * rng.uniform(0.5, 0.95, 20), wide
        ends = u - s[near][0], u - s[near][0] + rng.uniform(0, 0.5, 20) * wide
        i, none = rng.integers(0, 5, 20), np.zeros(20, dtype=np.int64)
        here = _JoinedRectangles(*(x + short.shift[0] for x in ends), *sides, none, none)
        there = _JoinedRectangles(*(x + s[near][0] + long.shift[i] for x in ends), *sides, i, none)
        (bend, turn), (of_long, turn_of_long) = short.bends(here), long.bends(there)
        assert (of_long >= bend * (1 - 1e-5) - 1e-12).all()
        assert (turn_of_long >= turn - 1e-8).all()
        places = (curves.rounded(one.u, one.wide) for curves, one in ((short, here), (long, there)))
        assert np.abs(np.subtract(*places)).max() < 5e-8


def sheet(curves, one, n=9):
    """Configurations all over a rectangle (n, n, j), and the mean of its corners there."""
    u, z = np.linspace(one.u[0], one.v[0], n), np.linspace(one.narrow[0], one.wide[0], n)
    q = curves.rounded(np.repeat(u, n), np.tile(z, n)).reshape(n, n, -1)
    return q, mean(q)


def mean(x):
    """The bilinear mean of the corners of a grid of values (n, n, ..)."""
    t = np.linspace(0, 1, len(x))
    a, b = t.reshape(-1, 1, *[1] * (x.ndim - 2)), t.reshape(1, -1, *[1] * (x.ndim - 2))
    return (1 - a) * ((1 - b) * x[0, 0] + b * x[0, -1]) + a * ((1 - b) * x[-1, 0] + b * x[-1, -1])


@pytest.fixture
def curves(request):
    rng = np.random.default_rng(request.param)
    return _JoinedPaths([wandering(rng, 3, 0.05) for _ in range(4)], np.array([1.5, 0.8, 0.3])), rng


@pytest.mark.parametrize("curves", range(8), indirect=True)
def test_several_paths_are_rounded_as_each_by_itself(curves):
    found, rng = curves
    again = np.random.default_rng(int(rng.bit_generator.seed_seq.entropy))
    for i, path in enumerate(wandering(again, 3, 0.05) for _ in range(4)):
        s = path.s - path.s[0]
        zone = rng.uniform(0.1, 1.0) * kept_zone(path.zone, s[-1])
        at = rng.uniform(0, s[-1], 20)
        there = found.rounded(at + found.shift[i], np.full(20, zone))
        assert there == pytest.approx(blended(path.q, s, zone, at), abs=1e-9)


@pytest.mark.parametrize("curves", range(8), indirect=True)
def test_no_joint_is_further_off_the_mean_of_a_rectangles_corners_than_is_said(curves):
    found, rng = curves
    tight, turned = [], []
    for _ in range(150):
        one = rectangle(found, rng)
        bend, turn = found.bends(one)
        q, between = sheet(found, one)
        assert (np.abs(q - between) <= bend.sum(axis=0)[0] + 1e-9).all()
        tight.append((np.abs(q - between).max(axis=(0, 1)) / np.maximum(bend.sum(axis=0)[0], 1e-12)).max())
        # and no joint turns further along either side, as a whole or by its steepest part
        for side in (0, 1):
            steps = np.abs(np.diff(q, axis=side)) * 8
            assert (steps <= turn[side, 0] + 1e-9).all()
            turned.append((steps.max(axis=(0, 1)) / np.maximum(turn[side, 0], 1e-12)).max())
    assert max(tight) > 0.5
    assert max(turned) > 0.8


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    return random_scenes(tmp_path_factory.mktemp("cells"), seed=5, count=3)


@pytest.fixture(scope="module")
def boss(tmp_path_factory):
    return prepare(load_case(little_case(tmp_path_factory.mktemp("boss"))))


def places(links, q, frame=None):
    """Places of points all over the arm's shapes, (m, v, 3), and the link of each; seen from a link or the base."""
    poses = links.poses(q)
    at = [
        links.shape(g).points @ np.swapaxes(poses.R[:, links.owner[g]], 1, 2) + poses.p[:, links.owner[g], None]
        for g in links.moving.tolist()
    ]
    x, of = np.concatenate(at, axis=1), np.repeat(links.owner[links.moving], [a.shape[1] for a in at])
    if frame is not None:
        x = np.einsum("mji,mvj->mvi", poses.R[:, frame], x - poses.p[:, frame, None])
    return x, of


@pytest.mark.slow
def test_no_point_of_the_arm_is_further_off_the_mean_of_the_corners_than_is_said(scenes):
    rng, tight = np.random.default_rng(3), []
    for scene in scenes:
        proofs, radius = PlaneProofs(Checker(scene, (0.0, 0.0), REACH)), radii(scene)
        for size in (0.003, 0.03, 0.1):
            for _ in range(25):
                curves = _JoinedPaths([wandering(rng, scene.chain.n, size)], radius)
                one = rectangle(curves, rng)
                bend, turn = curves.bends(one)
                pieces = SheetPieces(np.zeros((1, 4), dtype=np.int64), one.laid, bend.sum(axis=0), turn)
                q = sheet(curves, one, 7)[0] + rng.uniform(scene.chain.lower, scene.chain.upper)
                link = int(rng.integers(-1, scene.chain.n - 1))
                x, of = places(proofs._links, q.reshape(49, -1), None if link < 0 else link)
                x = x[:, of > link].reshape(7, 7, -1, 3)
                off = np.linalg.norm(x - mean(x), axis=3).max()
                most = pieces.off(radius, link)[0]
                assert off <= most + 1e-12
                tight.append(off / most)
    assert max(tight) > 0.3


def about(centre, turn):
    """Rows three times round a triangle about a configuration: its mean is among their roundings."""
    corners = centre + np.array([[1.0, 0.0], [-0.5, 0.87], [-0.5, -0.87]]) @ turn
    between = np.concatenate([a + np.linspace(0, 1, 5)[:-1, None] * (b - a) for a, b in pairwise([*corners] * 3)])
    return BlendedPath(between, np.arange(len(between)) * 1e-3, 12e-3)


def round_a_corner(job, rng):
    """Rows of the torch past the boss, which stands inside a corner of them: a rounding comes nearer than the rows do.

    Returns:
        The path, and what is known of its rows; to be kept is what they keep, less a millimetre or two.
    """
    T = place_targets(job.targets, job.scene.T_base_part(*UP)).Ts_base_target
    middle, up = T[:, :3, 3].mean(axis=0), -T[0, :3, 2]
    across = np.linalg.svd(up[None])[2][1:]
    heading, half = rng.uniform(0, 2 * np.pi), rng.uniform(0.3, 0.8)
    away = np.arange(0.0, 0.05, 0.002)[:, None]
    legs = [np.array([np.cos(heading + x), np.sin(heading + x)]) @ across for x in (-half, half)]
    apex = middle - rng.uniform(0.02, 0.03) * np.array([np.cos(heading), np.sin(heading)]) @ across
    position = np.concatenate([apex + away[:0:-1] * legs[0], apex + away * legs[1]]) - rng.uniform(0.004, 0.012) * up
    Ts = np.tile(apply_roll(T[:1], rng.uniform(-1, 1, 1)), (len(position), 1, 1))
    Ts[:, :3, 3] = position
    q = job.solver.candidates(Ts).q[:, :, 0]
    way = np.isfinite(q[..., 0]).all(axis=0) & (np.abs(np.diff(q, axis=0)).max(axis=(0, 2)) < 0.2)
    q = q[:, np.flatnonzero(way)[0]]
    return BlendedPath(q, np.arange(len(q)) * 2e-3, rng.uniform(0.01, 0.045))


def known_rows(checker, path, laid):
    """What is known of rows, of which a millimetre less is to be kept than they keep."""
    m = len(path.s)
    deposits_laid, none = np.full(m, laid), np.zeros(m, dtype=np.int64)
    keep = clearance_along(
        checker, radii(checker.scene), MotionSamples(path.q, deposits_laid, none, np.arange(m)), 1e-3
    )
    least = max(keep.kept[:-1].min() - 3e-4, 0.0)
    low = Clearances(keep.low, keep.seen.pair, keep.seen.position)
    return KnownRows(deposits_laid, low, least, keep.kept[:-1] > least, keep.kept[:-1])


def truth(checker, path, k, laid, n=15, shares=(0.02, 1.0)):
    """The least clearance of a step rounded over many zones, of shares of the path's, out to the reach, m."""
    at, s = np.linspace(path.s[k], path.s[k + 1], n), path.s
    q = np.concatenate([blended(path.q, s, z * path.zone, at) for z in np.linspace(*shares, n)])
    return float(np.minimum(checker.clearances(q, np.full(len(q), laid)).distance, REACH).min())


@pytest.mark.slow
def test_where_sheets_are_proved_every_rounding_keeps_the_clearance(boss):
    rng, proved, near = np.random.default_rng(8), 0, 0
    checker, laid = Checker(boss.scene, tuple(UP), 0.05), boss.scene.n_deposits
    for _ in range(16):
        path = round_a_corner(boss, rng)
        known = known_rows(checker, path, laid)
        steps = np.flatnonzero(known.which)
        ok = sheets_kept(PlaneProofs(checker), radii(boss.scene), [StepSheets(path, known, steps)])[0]
        true = np.array([truth(checker, path, k, laid, 10) for k in steps.tolist()])
        assert (true[ok] >= known.least - 1e-7).all()
        proved, near = proved + int(ok.sum()), near + int((true < known.least).sum())
    assert proved > 200
    assert near > 30


@pytest.mark.slow
def test_what_stands_among_the_roundings_of_a_turn_is_not_proved_away(scenes):
    """Two ways past a shape, one on either side, joined by a short one: a rounding leads through the shape."""
    rng, through = np.random.default_rng(14), 0
    for scene in scenes:
        checker, radius = Checker(scene, (0.0, 0.0), REACH), radii(scene)
        for _ in range(6):
            q = rng.uniform(scene.chain.lower, scene.chain.upper, (40, scene.chain.n))
            inside = q[checker.clearances(q, np.zeros(40, dtype=np.int64)).distance < -0.01]
            if not len(inside):
                continue
            path = about(inside[0], rng.normal(size=(2, scene.chain.n)) * 0.15)
            m = len(path.s)
            kept = np.full(m - 1, 0.5)  # as if the rows were far from everything
            every = np.ones(m - 1, dtype=bool)
            known = KnownRows(np.zeros(m, dtype=np.int64), Clearances.none(m), 0.005, every, kept)
            steps = np.arange(10, m - 11, 3)
            ok = sheets_kept(PlaneProofs(checker), radius, [StepSheets(path, known, steps)])[0]
            for k, proved in zip(steps.tolist(), ok.tolist(), strict=True):
                if truth(checker, path, k, 0, 8) < 0.004:
                    through += 1
                    assert not proved
    assert through > 10


@pytest.mark.slow
def test_of_several_paths_what_comes_near_is_found_as_of_each_by_itself(boss):
    rng, near, proved = np.random.default_rng(8), 0, 0
    checker, laid, radius = Checker(boss.scene, tuple(UP), 0.05), boss.scene.n_deposits, radii(boss.scene)
    known_of = [(path, known_rows(checker, path, laid)) for path in (round_a_corner(boss, rng) for _ in range(12))]
    several = [(path, replace(known, least=1e-4, which=known.kept > 1e-4)) for path, known in known_of]
    for (path, known), (step, nearest) in zip(several, cut_corners_of(checker, radius, several), strict=True):
        unknown = np.full(len(known.kept), -np.inf)
        alone, _ = cut_corners(checker, radius, path, known.deposits_laid, known.found, 1e-4, known.which, unknown)
        true = np.array([truth(checker, path, k, laid, 10) for k in range(len(known.kept))])
        assert np.isin(np.flatnonzero(known.which & (true < 0)), step).all()
        assert step.tolist() == alone.tolist()
        assert (nearest.distance < 1e-4).all()
        near, proved = near + len(step), proved + int(known.which.sum()) - len(step)
    assert near > 5
    assert proved > 100


def test_more_is_laid_on_some_steps_than_on_others(boss):
    """The boss that a rounding cuts into is there on the later steps alone: these are not proved, the others are."""
    rng = np.random.default_rng(8)
    checker, laid, radius = Checker(boss.scene, tuple(UP), 0.05), boss.scene.n_deposits, radii(boss.scene)
    path = round_a_corner(boss, rng)
    known = known_rows(checker, path, laid)
    steps, deposits_laid = np.flatnonzero(known.which), known.deposits_laid.copy()
    near = [k for k in steps.tolist() if truth(checker, path, k, laid, 10) < known.least]
    deposits_laid[: near[len(near) // 2]] = 0
    some = replace(known, deposits_laid=deposits_laid)
    ok = sheets_kept(PlaneProofs(checker), radius, [StepSheets(path, some, steps)])[0]
    before = sheets_kept(
        PlaneProofs(checker), radius, [StepSheets(path, replace(known, deposits_laid=0 * deposits_laid), steps)]
    )[0]
    later = np.isin(steps, near) & (np.maximum(deposits_laid[steps], deposits_laid[steps + 1]) == laid)
    assert later.any()
    assert not ok[later].any()
    assert before[later].any()


def test_of_rows_that_keep_no_more_than_they_have_to_the_small_roundings_are_not_taken_for_granted(boss):
    """Far from everything, but what is known of the rows has to be enough for the zones below the sheets."""
    rng = np.random.default_rng(8)
    checker, radius = Checker(boss.scene, tuple(UP), 0.05), radii(boss.scene)
    path = round_a_corner(boss, rng)
    m, zone = len(path.s), kept_zone(path.zone, path.s[-1])
    off = PathCorners.of(BlendedPath(path.q, path.s, SHARES[-1] * zone)).off(radius, path.s)
    off = np.maximum(off[:-1], off[1:])
    steps, every = np.arange(m - 1), np.ones(m - 1, dtype=bool)
    for room in (1e-8, 0.5 * float(off.max())):
        known = KnownRows(np.zeros(m, dtype=np.int64), Clearances.none(m), 1e-3, every, np.full(m - 1, 1e-3 + room))
        ok = sheets_kept(PlaneProofs(checker), radius, [StepSheets(path, known, steps)])[0]
        assert (off > room).any()
        assert not ok[off > room].any()


def test_few_looks_prove_what_turns_far_on_the_spot(scenes):
    """A wrist that swings by 60 degrees within the zone: looked at is a fraction of the steps."""
    rng, asked, proved, looks = np.random.default_rng(6), 0, 0, 0
    for scene in scenes:
        checker = Checker(scene, (0.0, 0.0), REACH)
        starts = rng.uniform(scene.chain.lower, scene.chain.upper, (40, scene.chain.n))
        far = checker.clearances(starts, np.zeros(40, dtype=np.int64)).distance
        start = starts[int(np.argmax(np.minimum(far, REACH)))]
        q = np.tile(start, (81, 1))
        q[:, 3] += np.deg2rad(30) * np.sin(np.linspace(0, np.pi, 81))
        q[:, 5] += np.deg2rad(30) * np.cos(np.linspace(0, np.pi, 81))
        path = BlendedPath(q, np.arange(81) * 0.05e-3, 1e-3)
        deposits_laid, none = np.zeros(81, dtype=np.int64), np.zeros(81, dtype=np.int64)
        kept = clearance_along(checker, radii(scene), MotionSamples(q, deposits_laid, none, np.arange(81)), 0.005).kept[
            :-1
        ]
        known = KnownRows(deposits_laid, Clearances.none(81), 0.005, kept >= 0.005, kept)
        steps = np.flatnonzero(known.which)
        before = checker.asked.count
        ok = sheets_kept(PlaneProofs(checker), radii(scene), [StepSheets(path, known, steps)])[0]
        looks, asked, proved = looks + checker.asked.count - before, asked + len(steps), proved + int(ok.sum())
    assert proved > 0.9 * asked > 50
    assert looks < 0.5 * asked


def test_pieces_of_one_cell_lie_close_together():
    rng = np.random.default_rng(2)
    places_, corner, laid = rng.random((60, 4)), rng.integers(60, size=(50, 4)), np.sort(rng.integers(0, 3, 50))
    none = np.zeros((50, 2))
    pieces = SheetPieces(corner, laid, none, np.stack([none, none]))
    for spacing in (0.0, 0.3, 10.0):
        clusters, of = pieces.clusters(places_, spacing)
        assert (clusters.sample[of] == corner).all()
        assert (clusters.cluster[of] == clusters.cluster[of][:, :1]).all()
        assert (clusters.laid[clusters.cluster[of[:, 0]]] == laid).all()
        assert (np.diff(clusters.cluster) >= 0).all()
        middle = places_[corner].mean(axis=1)
        for c in range(len(clusters.at)):
            mine = clusters.cluster[of[:, 0]] == c
            assert np.ptp(middle[mine], axis=0).max() <= spacing * (1 + 1e-6) or mine.sum() == 1
            assert clusters.at[c] in corner[mine]
