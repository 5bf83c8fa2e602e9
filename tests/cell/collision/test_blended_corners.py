"""Corners as a controller rounds them: how far they are off the rows, and what only they come too near to."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
import trimesh
import yaml
from support.cells.arm_places import places
from support.jobs.cases import at, bosses, turned

from cell.case.read import load_case
from cell.collision.blend_proofs import KnownRows
from cell.collision.blended_corners import _cut_on, _off_rows, cut_corners
from cell.collision.blended_paths import BlendedPath as Rows
from cell.collision.blended_paths import pieces
from cell.collision.checker import Checker
from cell.collision.clearances import Clearances
from cell.collision.proofs.motion_bounds import MotionBounds, joint_travel_bound
from cell.collision.proofs.reach_radii import radii
from cell.failure import Kind
from cell.job.job import prepare
from cell.motion.motion import NO_MOVE, Motion
from cell.motion.motion_file import ReadMotion
from cell.planning.context import Context, settings_of
from cell.planning.edges.blended_check import travel_corners, travel_path
from cell.remedy_search import search as remedies_module
from cell.remedy_search.changes import single_changes
from cell.remedy_search.search import remedies
from cell.report.motion_report import finding_in_words
from cell.timing.blending import blended
from cell.verdict.check import check_fixed
from cell.verdict.result import Result
from cell.verdict.words import in_words
from cell.verification.motion_check import check_motion

RADIUS = np.array([2.5, 2.3, 1.2, 0.6, 0.6, 0.5])


def test_how_far_a_rounded_path_is_off_its_rows_is_bounded_and_no_more_than_it_is() -> None:
    rng = np.random.default_rng(3)
    for trial in range(12):
        m = int(rng.integers(3, 25))
        q = np.cumsum(rng.normal(size=(m, 6)) * 0.01, axis=0)
        s = 0.3 + np.concatenate([[0], np.cumsum(rng.choice([NO_MOVE, 1e-4, 1e-3, 5e-3], m - 1))])
        path = Rows(q, s, 1e-3)
        p = pieces(path, RADIUS)
        at = np.sort(np.concatenate([rng.uniform(s[0], s[-1], 4000), s]))
        straight = np.stack([np.interp(at, s, column) for column in q.T], axis=1)
        off = np.abs(blended(q, s, 1e-3, at) - straight) @ RADIUS
        bound = p.off[np.clip(np.searchsorted(p.s, at) - 1, 0, len(p.off) - 1)]
        assert (off <= bound + 1e-12).all(), trial
        assert p.off.max() <= 1.3 * off.max() + 1e-6
    # two straight lines: a quarter of the zone times the change of slope, at the corner
    q = np.array([[0.0], [0.0], [1.0]]) * np.ones(6)
    p = pieces(Rows(q, np.array([0.0, 1.0, 2.0]), 0.1), RADIUS)
    assert p.off.max() == pytest.approx(0.025 * RADIUS.sum(), rel=0.3)
    assert (p.off[(p.s[1:] <= 0.9) | (p.s[:-1] >= 1.1)] < 1e-12).all()


def test_how_far_the_arm_is_off_its_rows_is_bounded_by_where_its_links_are(make_case) -> None:
    scene = prepare(load_case(make_case())).scene
    checker, radius, chain = Checker(scene, (0.0, 0.0), 0.05), radii(scene), scene.chain
    rng, tighter = np.random.default_rng(4), 0
    for trial in range(8):
        start = rng.uniform(0.6 * chain.lower, 0.6 * chain.upper)
        q = start + np.cumsum(np.cumsum(rng.normal(size=(12, 6)), axis=0) * 0.004 * (1 + trial % 3), axis=0)
        s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(chain.forward(q)[:, :3, 3], axis=0), axis=1))])
        path = Rows(q, s, 5e-3)
        p = pieces(path, radius)
        loose = np.zeros(len(s) - 1)
        np.maximum.at(loose, p.row, p.off)
        bound = _off_rows(checker, radius, path, p, np.zeros(len(s) - 1))
        tighter += (bound < 0.8 * loose).sum()
        for k in range(len(s) - 1):
            at = np.linspace(s[k], s[k + 1], 9)
            rows = np.stack([np.interp(at, s, column) for column in q.T], axis=1)
            off = np.linalg.norm(places(scene, blended(q, s, 5e-3, at)) - places(scene, rows), axis=2).max()
            assert min(2 * off, loose[k]) <= bound[k] + 1e-9  # two parts of the arm may both be off
    assert tighter >= 10


def test_nothing_gets_nearer_to_anything_than_the_bound_on_a_step_says(make_case) -> None:
    scene = prepare(load_case(make_case())).scene
    radius = radii(scene)
    swept = MotionBounds(scene, radius)
    rng = np.random.default_rng(0)
    tighter = 0
    for size in (0.01, 0.1, 0.5, 2.0):
        for _ in range(12):
            a = rng.uniform(scene.chain.lower, scene.chain.upper)
            b = np.clip(a + rng.uniform(-size, size, 6), scene.chain.lower, scene.chain.upper)
            x = places(scene, a + np.linspace(0, 1, 11)[:, None] * (b - a))
            away = np.linalg.norm(x - x[0], axis=2).max(axis=1) + np.linalg.norm(x - x[-1], axis=2).max(axis=1)
            bound, loose = swept.bound(a[None], b[None])[0], joint_travel_bound(radius, a[None], b[None])[0]
            assert min(2 * away.max(), loose) <= bound + 1e-12  # two things may both move
            tighter += bound < 0.999 * loose
    assert tighter > 10


NOTCH = (-2.0, 42.0)  # mm, y and z of the corner of an L


def notched_case(folder: Path, name: str, **process: Any) -> Path:
    """An L, and a nail in its notch: the wire passes it on both sides, but may not cut the corner there."""
    y, z = NOTCH
    outline = [[-22, 20], [22, 20], [22, z], [y, z], [y, 64], [-22, 64]]
    boss = trimesh.creation.extrude_polygon(shapely.Polygon(outline), 12.0)
    # drawn in y and z, it stands on the side that points along -x
    boss.apply_transform(np.array([[0, 0, -1, -36], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]))
    boss.invert()
    boss.fix_normals()
    boss.export(folder / "l.stl")
    nail = {"name": "nail", "on": "table", "box": {"size_mm": [5, 2, 2]}}
    content = {
        "part": {"sub_volumes": ["l.stl"], "body": {"radius_mm": 40, "z_mm": [0, 80]}},
        "slicing": {"h_layer_mm": 8, "h_min_mm": 6, "h_max_mm": 9},
        "support": {"radius_mm": 15, "height_mm": 100},
        "positioner": {"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90]},
        "table": {"E1_deg": 90, "E2_deg": 180},
        "roll": {"fixed_deg": 0},
        "fixtures": [{**nail, "position_mm": [-42.0, y + 7.0, 100 + z + 7.0]}],
        "process": {"least_speed_share": 0, **process},
    }
    path = folder / f"{name}.case.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def run(path: Path) -> Result:
    job = prepare(load_case(path))
    return check_fixed(job, 90, 180)


def nearest_rounded(result: Result, motion: Motion, blend: float) -> float:
    """The least clearance on the first bead with its corners rounded, looked at closely, m."""
    rows = np.flatnonzero((motion.arc == 1) & (motion.bead == 0))
    q, scene = motion.q[rows], result.job.scene
    way = np.linalg.norm(np.diff(scene.chain.forward(q)[:, :3, 3], axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(way)])
    at = np.linspace(0, s[-1], 4000)
    found = Checker(scene, result.table, 0.02).clearances(blended(q, s, blend, at), np.zeros(4000, dtype=np.int64))
    return float(found.distance.min())


@pytest.mark.slow
def test_a_corner_that_only_its_rounding_brings_too_near_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sharp = run(notched_case(tmp_path, "sharp", blend_mm=0.5))
    assert sharp.feasible
    assert sharp.motion is not None
    # the rows keep the clearance, and so does what is run; cut by 20 mm the corner would not
    assert nearest_rounded(sharp, sharp.motion, 0.5e-3) > 5e-3
    assert nearest_rounded(sharp, sharp.motion, 20e-3) < 4e-3
    cut = run(notched_case(tmp_path, "cut", blend_mm=20))
    bad = {i: row for i, row in enumerate(cut.rows) if row.reason is not None}
    # every layer has the corner; the first is held against the same looked at closely
    first = {i: row for i, row in bad.items() if cut.job.targets.bead[i] == 0}
    target, row = min(first.items(), key=lambda item: item[1].detail["distance_mm"])
    assert max(first) - min(first) < 2
    assert (row.reason, row.detail["on_the_way"], row.detail["rounded"]) == ("no_path", "collision", True)
    assert set(row.detail["pair"]) == {"nail", "torch_wire"}
    assert row.detail["distance_mm"] == pytest.approx(1e3 * nearest_rounded(sharp, sharp.motion, 20e-3), abs=0.3)
    assert in_words(row).endswith("needs 5 where a corner is rounded")
    # less rounding is what would help (a stop in that corner would as well: a seam there)
    monkeypatch.setattr(remedies_module, "seam_places", lambda *_: {})
    monkeypatch.setattr(
        remedies_module,
        "single_changes",
        lambda *a, **k: [x for x in single_changes(*a, **k) if x.key.startswith("process")],
    )
    best = next(iter(remedies(cut)))
    assert best.checked == "part"
    assert best.change is not None
    assert best.change["key"] == "process.blend_mm"
    assert best.change["to"] < best.change["from"] == 20
    assert run(notched_case(tmp_path, "mended", blend_mm=best.change["to"])).feasible
    # the corner lies on this way or at its end
    corner = cut.job.targets.position[[target - 1, target], 1:]
    assert np.linalg.norm(corner - NOTCH, axis=1).min() < 1.0
    # the same motion from outside: the rows hold, what is run does not
    outside = ReadMotion(sharp.motion, np.arange(len(sharp.motion.t_s)) + 1, ())
    found = check_motion(cut.job, outside)
    near = [f for f in found.findings if f.reason == "collision"]
    assert near
    assert all(f.detail["rounded"] and "nail" in f.detail["pair"] for f in near)
    assert found.clearance is not None
    assert found.clearance[0] > 5e-3
    assert finding_in_words(near[0]).startswith("where a corner is rounded: ")
    assert not [f for f in check_motion(sharp.job, outside).findings if f.reason == "collision"]


@pytest.mark.slow
def test_a_travel_is_looked_at_as_it_is_run(make_case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    part = bosses(tmp_path, at(20), turned(at(20), 180), length=100)
    path = make_case(part=part, table={"E1_deg": 60, "E2_deg": 180}, roll={"range_deg": [-90, 0]})
    result = check_fixed(prepare(load_case(path)), 60, 180)
    assert result.motion is not None
    job, first = result.job, int(np.flatnonzero(result.job.targets.sub_volume_index == 1)[0])
    q = result.motion.q[(result.motion.target == first) & (result.motion.arc == 0)]
    checker = Checker(job.scene, result.table, 0.05)
    deposits_laid = int(job.laid[first - 1])
    found = checker.clearances(q, np.full(len(q), deposits_laid))
    zone = np.deg2rad(30.0)
    rows, _ = travel_path(q)
    places = np.linspace(rows.s[0], rows.s[-1], 3000)
    closely = checker.clearances(blended(rows.q, rows.s, zone, places), np.full(3000, deposits_laid)).distance.min()
    assert closely < found.distance.min() - 1e-3
    for least, turn, free in (
        (found.distance.min() - 1e-4, zone, False),
        (found.distance.min() - 1e-4, 1e-4, True),
        (closely - 1e-4, zone, True),
    ):
        settings = replace(settings_of(job), clearance=float(least))
        context = Context.of(job, result.table, settings)
        failure = travel_corners(context, q, found, deposits_laid, zone=turn)
        assert (failure is None) is free
        if failure is not None:
            assert (failure.kind, failure.rounded) == (Kind.COLLISION, True)
            assert closely * 1e3 - 1e-3 <= failure.measure < found.distance.min() * 1e3
        # a stop at every corner leaves nothing to be rounded
        assert travel_corners(context, q, found, deposits_laid, range(1, len(q) - 1)) is None


class OfAPoint:
    """Two joints whose place is their angles, and an obstacle in their plane; lengths by a norm."""

    reach = 10.0

    def __init__(self, centre, radius, norm):
        self.centre, self.radius, self.norm = np.array(centre), radius, norm

    def travel_bound(self, radius, a, b):
        return np.linalg.norm(b - a, ord=self.norm, axis=1)

    def bend_bound(self, radius, turn):
        return np.zeros(len(turn))

    def clearances(self, q, deposits_laid):
        found = Clearances.none(len(q))
        found.distance[:] = np.linalg.norm(q - self.centre, ord=self.norm, axis=1) - self.radius
        found.pair[:], found.position[:] = 0, 0.0
        return found


def on_the_widest(point, path, deposits_laid):
    """Steps on which the path that is rounded most is not proved free by itself, and what is nearest on them."""
    steps = len(path.s) - 1
    free = np.ones(steps, dtype=bool), np.full(steps, -np.inf)
    return _cut_on(
        point, np.ones(2), path, KnownRows(deposits_laid, point.clearances(path.q, deposits_laid), 0.0, *free)
    )


BOWED = {  # the joints at the rows, lengths between them, zone, obstacle, step, norm
    "sum": (
        [0, -0.5096650042, 0.2644924421, -0.6545878820, -0.4397785162, -1.3717116602],
        [0, 0.1248986616, 0.2239808023, 0.3412565328, 0.3245366214, 0.1912314288],
        [0.5247457405, 0.7804723072, 0.9265321835, 0.2154577884, 0.9414192085],
        1.2724113632,
        (0.0272867363, 0.0453224324),
        0,
        1,
    ),
    "length": (
        [0, -0.78970033, -0.37948999, -0.59894195, 0.24866834],
        [0, 0.00331274, 0.02460387, 0.00689965, -0.16533308],
        [0.83469460, 0.99788097, 0.25881452, 0.90859128],
        1.05769472,
        (-0.53948114, 0.00604064),
        1,
        2,
    ),
    "half, sum": (
        [0, -0.125498, 0.490073],
        [0, -0.500606, -1.007843],
        [0.599096, 0.925908],
        0.439027,
        (-0.05593352, -0.30539947),
        0,
        1,
    ),
    "half, length": (
        [0, 1.144014, 0.772663, -0.126312, -0.119391],
        [0, -0.212491, 0.26582, -0.126133, -0.334347],
        [0.917867, 0.47767, 0.773609, 0.164336],
        1.11375,
        (0.55281537, -0.01316586),
        1,
        2,
    ),
    "half of several bends": (
        [0, -0.293859, -0.802525, -1.211112],
        [0, 0.5574, 0.525417, 0.83389],
        [0.74349, 0.601372, 0.604068],
        0.261466,
        (-0.64835514, 0.53874722),
        1,
        1,
    ),
}


@pytest.mark.parametrize("bowed", BOWED)
def test_a_rounded_path_that_bows_into_something_beside_its_chord_is_not_proved_free(bowed):
    """Its rows are free, and their clearances add up to more than the chord; the bow takes it into the obstacle.

    So it does with half a step, which the middle's clearance would settle without the bow.
    """
    *rows, lengths, zone, centre, bows, norm = BOWED[bowed]
    q, s = np.array(rows, dtype=float).T, np.concatenate([[0.0], np.cumsum(lengths)])
    path, point = Rows(q, s, zone), OfAPoint(centre, 0.001, norm)
    deposits_laid = np.zeros(len(q), dtype=np.int64)
    along = np.concatenate([a + (b - a) * np.linspace(0, 1, 400)[:, None] for a, b in pairwise(q)])
    assert point.clearances(along, None).distance.min() > 0
    run = blended(q, s, path.zone, np.linspace(s[bows], s[bows + 1], 4001))
    assert point.clearances(run, None).distance.min() < 0
    step, _ = on_the_widest(point, path, deposits_laid)
    assert bows in step
    step, nearest = cut_corners(point, np.ones(2), path, deposits_laid, point.clearances(q, deposits_laid), 0.0)
    assert nearest.distance[step == bows] < 0


@pytest.mark.parametrize(
    ("x", "y", "zone", "place", "step", "small"),
    [
        # one parabola from end to end, lowest amid the first half of the step from 1 to 2
        (0.1, [1.0, 0.0, 0.6], 1.0, (0.125, 0.375), 1, 5e-3),
        # straight up to 0.75, then bent: lowest at 0.8125, in the second half of the step from 0 to 1
        (0.1, [1.0, 0.0, 7.0], 0.25, (0.08125, 0.21875), 0, 5e-3),
        # lowest amid the first of the four finest chords: 0.7 um off it, where the arm is taken for 1 um thicker
        (0.05, [1.0, 0.0, 7 / 9], 1.0, (0.05625, 0.4375), 1, 1e-4),
    ],
)
def test_part_of_a_step_is_not_proved_free_by_its_chord(
    x: float, y: list[float], zone: float, place: tuple[float, float], step: int, small: float
) -> None:
    """By ways along the axes: at its lowest a path across is off its chord by all that its bend allows."""
    q, s = small * np.stack([x * np.arange(3), y], axis=1), np.arange(3.0)
    path, point, deposits_laid = (
        Rows(q, s, zone),
        OfAPoint(small * np.array(place), 1e-3 * small, 1),
        np.zeros(3, dtype=int),
    )
    along = np.concatenate([a + (b - a) * np.linspace(0, 1, 4000)[:, None] for a, b in pairwise(q)])
    assert point.clearances(along, None).distance.min() > 0
    run = blended(q, s, zone, np.linspace(step, step + 1, 4001))
    assert point.clearances(run, None).distance.min() < 0
    assert step in on_the_widest(point, path, deposits_laid)[0]


class Rod:
    """A point that two axes move in a plane, and a round rod in it."""

    reach = 0.05

    def __init__(self, at: tuple[float, float], radius: float) -> None:
        self.at, self.radius = np.array(at), radius

    def clearances(self, q: np.ndarray, deposits_laid: np.ndarray, /) -> Clearances:
        found = Clearances.none(len(q))
        found.distance[:] = np.linalg.norm(q - self.at, axis=1) - self.radius
        found.pair[:] = (0, 1)
        return found

    def travel_bound(self, radius: np.ndarray, a: np.ndarray, b: np.ndarray, /) -> np.ndarray:
        return joint_travel_bound(radius, a, b)

    def bend_bound(self, radius: np.ndarray, turn: np.ndarray, /) -> np.ndarray:
        return np.zeros(len(turn))


@pytest.mark.parametrize("depth", [0.012, 0.017, 0.022, 0.028])
def test_what_stands_between_a_corner_and_its_widest_rounding_is_met_by_one_that_rounds_less(depth: float) -> None:
    """C_DIS of 100 mm: the widest way round is 35 mm from the corner, and a controller may take any one before it."""
    s = np.linspace(0, 0.4, 81)
    q = np.stack([np.maximum(s - 0.2, 0.0), np.minimum(s, 0.2)], axis=1)
    rod = Rod((depth / np.sqrt(2), 0.2 - depth / np.sqrt(2)), 0.001)
    path, reach = Rows(q, s, 0.1), np.ones(2)
    found = rod.clearances(q, np.zeros(len(q)))
    widest = rod.clearances(blended(q, s, 0.1, np.linspace(0, 0.4, 4000)), np.zeros(4000))
    assert min(found.distance.min(), widest.distance.min()) > 5e-3
    step, nearest = cut_corners(rod, reach, path, np.zeros(len(q), dtype=int), found, 5e-3)
    assert len(step)
    assert nearest.distance.min() < 2.5e-3
    # as far off as the clearance asks for, nothing is wrong
    away = Rod((0.05, 0.05), 0.001)
    found = away.clearances(q, np.zeros(len(q)))
    assert not len(cut_corners(away, reach, path, np.zeros(len(q), dtype=int), found, 5e-3)[0])


@pytest.mark.parametrize(("beyond", "open_"), [(5e-6, False), (-5e-6, True)])
def test_a_corner_that_just_keeps_its_clearance_is_not_refused_for_the_thickness_of_its_proof(
    beyond: float, open_: bool
) -> None:
    s = np.linspace(0, 0.4, 81)
    q = np.stack([np.maximum(s - 0.2, 0.0), np.minimum(s, 0.2)], axis=1)
    zone, least, radius = 0.02, 5e-3, 1e-3
    at = np.linspace(0.15, 0.25, 200_001)
    apex = blended(q, s, zone, at)
    apex = apex[np.argmax(apex @ (1, -1) - np.abs(at - 0.2))]  # where it is furthest from the corner, on its bisector
    away = np.array([1.0, -1.0]) / np.sqrt(2)
    rod = Rod(tuple(apex + away * (least + radius + beyond)), radius)
    dense = np.linalg.norm(blended(q, s, zone, at) - rod.at, axis=1).min() - radius
    assert dense == pytest.approx(least + beyond, abs=1e-7)
    found = rod.clearances(q, np.zeros(len(q)))
    step, _ = cut_corners(rod, np.ones(2), Rows(q, s, zone), np.zeros(len(q), dtype=int), found, least)
    assert bool(len(step)) is open_
