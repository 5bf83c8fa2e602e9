"""Seams, directions, order, leads, speeds and travels of beads, and the targets made of them."""

from __future__ import annotations

import itertools
import math
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.layers.beads import open_break_points, travel_mm
from support.layers.layers import circle, planar_layer
from support.parts.meshes import BODY, R, box, box_solid, from_manifold, ring

from slicing.beads.bead import Bead
from slicing.beads.lay import lay_beads
from slicing.beads.lead_in_out import with_leads
from slicing.beads.order import shortest
from slicing.document import targets_rows
from slicing.layers.layer import SlicedSubVolume
from slicing.mesh.solid import PartError
from slicing.parameters import BeadParameters, SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.surfaces import Plane
from slicing.targets.speeds import BeadSpeed
from slicing.targets.targets import Targets, sample_targets
from slicing.targets.waypoints import travels

BORDERS = BeadParameters(thin_walls="border")


@pytest.fixture(scope="module")
def boss():
    return slice_sub_volume(box((10, -15, -12), (45, 15, 12)), BODY, SlicingParameters("cylindrical"))


@pytest.fixture(scope="module")
def tube():
    solid = box_solid((10, -15, -15), (40, 15, 15)) - box_solid((0, -7, -7), (50, 7, 7))
    return slice_sub_volume(from_manifold(solid, "tube"), BODY, SlicingParameters("cylindrical"))


def of_layer(laid, layer):
    return [bead for bead in laid.beads if bead.layer == layer]


def area_left(bead, normal) -> float:
    at = bead.points - bead.points.mean(axis=0)
    return 0.5 * float(np.cross(at, np.roll(at, -1, axis=0)).sum(axis=0) @ normal)


def test_every_border_is_a_bead(boss, tube):
    for sliced in (boss, tube):
        (laid,) = lay_beads([sliced], BORDERS)
        curves = [(layer.index, curve) for layer in sliced.layers for curve in layer.curves]
        assert len(laid.beads) == len(curves)
        for bead, (layer, curve) in zip(laid.beads, curves, strict=True):
            assert (bead.layer, bead.closed, bead.hole, bead.kind) == (layer, True, curve.hole, "contour")
            assert sorted(bead.points.tolist()) == sorted(curve.points.tolist())


def test_spread_seams_are_far_apart_and_chosen_ones_where_they_are_wanted(boss):
    (spread,) = lay_beads([boss], BeadParameters(seam="spread"))
    places = []
    for bead in spread.beads:
        if len(boss.layers[bead.layer].curves) > 1:
            break  # where the flat top begins: two beads a layer
        step = np.linalg.norm(np.roll(bead.points, -1, axis=0) - bead.points, axis=1)
        corner = int(np.argmin(((bead.points - [0, -100, -100]) ** 2).sum(axis=1)))
        places.append(1.0 - step[corner:].sum() / step.sum() if corner else 0.0)
    assert len(places) > 8
    # round from the lowest corner: where the seam stands, as a share of the way
    for a, b in itertools.pairwise(places):
        assert min(abs(a - b), 1 - abs(a - b)) > 0.3
    again = lay_beads([boss], BeadParameters(seam="spread"))[0]
    assert all(np.array_equal(a.points, b.points) for a, b in zip(spread.beads, again.beads, strict=True))
    wanted = (40.0, 15.0, 12.0)
    (chosen,) = lay_beads([boss], BeadParameters(seam="chosen", seam_xyz_mm=wanted))
    for bead in chosen.beads:
        assert np.abs(boss.layers[bead.layer].surface.distance(bead.points[:1])).max() < 1e-6
        radius = boss.layers[bead.layer].surface.radius
        if radius < 40:  # straight below the place, on the upper edge
            nearest = math.hypot(40.0, 15.0) - radius
            assert np.linalg.norm(bead.points[0] - wanted) == pytest.approx(nearest, abs=0.01)
    (by_angle,) = lay_beads([boss], BeadParameters(seam="chosen", seam_angle_deg=7.0))
    for bead in by_angle.beads:
        if len(boss.layers[bead.layer].curves) > 1:
            break  # these do not come to the angle
        assert math.degrees(math.atan2(bead.points[0, 1], bead.points[0, 0])) == pytest.approx(7.0, abs=1e-6)
        assert bead.points[0, 2] == pytest.approx(-12.0)


def test_directions_alternate_and_tangents_with_them(tube):
    plain, turned = (lay_beads([tube], replace(BORDERS, alternate=flag))[0] for flag in (False, True))
    for a, b in zip(plain.beads, turned.beads, strict=True):
        normal = tube.layers[a.layer].surface.normals(a.points).mean(axis=0)
        same = area_left(a, normal) * area_left(b, normal) > 0
        assert same == (a.layer % 2 == 0)
        assert (area_left(a, normal) < 0) == a.hole
        assert np.array_equal(a.points[0], b.points[0])  # seams stay
    plain_t, turned_t = (sample_targets([tube], beads=replace(BORDERS, alternate=flag)) for flag in (False, True))
    for path in range(len(plain_t.closed)):
        a, b = np.flatnonzero(plain_t.bead == path), np.flatnonzero(turned_t.bead == path)
        even = plain_t.layer[a[0]] % 2 == 0
        # the way out of the seam: the same, or against the way in
        assert np.allclose(turned_t.tangent[b[0]], plain_t.tangent[a[0]] if even else -plain_t.tangent[a[-1]])
        assert np.allclose(turned_t.position[b[0]], turned_t.position[b[-1]])


def lines_at(xs) -> list[Bead]:
    return [Bead(np.array([[x, 0.0, 0.0], [x, 10.0, 0.0]]), False, "infill", 0) for x in xs]


def test_a_few_beads_come_in_the_shortest_order_there_is():
    rng = np.random.default_rng(1)
    for closed in (True, False):
        beads = [Bead(rng.uniform(0, 100, (3, 3)), closed, "contour", 0) for _ in range(5)]
        start = rng.uniform(0, 100, 3)
        way = shortest(beads, start, may_turn=True)
        length = travel_mm([beads[k].reversed() if t else beads[k] for k, t in way], start)
        sides = [False] if closed else [False, True]
        least = min(
            travel_mm([beads[k].reversed() if t else beads[k] for k, t in zip(order, turns, strict=True)], start)
            for order in itertools.permutations(range(5))
            for turns in itertools.product(sides, repeat=5)
        )
        assert length == pytest.approx(least)


def test_many_lines_in_a_row_are_laid_to_and_fro():
    rng = np.random.default_rng(2)
    beads = lines_at(rng.permutation(12) * 5.0)
    way = shortest(beads, np.array([-5.0, 0.0, 0.0]), may_turn=True)
    assert sorted(k for k, _ in way) == list(range(12))
    laid = [beads[k].reversed() if t else beads[k] for k, t in way]
    assert travel_mm(laid) == pytest.approx(55.0)
    fixed = shortest(beads, None, may_turn=False)
    assert not any(t for _, t in fixed)


@pytest.mark.slow
def test_contours_come_first_or_last(tube):
    for first in (True, False):
        (laid,) = lay_beads([tube], BeadParameters("contour_parallel", width_mm=2.0, contours_first=first))
        for layer in tube.layers:
            kinds = [bead.kind for bead in of_layer(laid, layer.index)]
            assert kinds == sorted(kinds, reverse=not first)
            assert len(set(kinds)) == 2 or layer.index > 3


@pytest.mark.slow
def test_a_short_order_is_no_longer_than_the_given_one(tube):
    long, short = (
        lay_beads([tube], BeadParameters("zigzag", width_mm=3.0, order=order))[0] for order in ("given", "short")
    )
    assert sum(b.length_mm for b in long.beads) == pytest.approx(sum(b.length_mm for b in short.beads))
    assert travel_mm(short.beads) < travel_mm(long.beads)


def test_closed_beads_overlap_their_seam(boss):
    plain = lay_beads([boss])[0].beads
    led = lay_beads([boss], BeadParameters(lead_in_mm=4.0, lead_out_mm=6.0))[0].beads
    for a, b in zip(plain, led, strict=True):
        assert not b.closed
        assert b.length_mm == pytest.approx(a.length_mm + 10.0, abs=1e-3)
        surface = boss.layers[a.layer].surface
        assert np.abs(surface.distance(b.points)).max() < 1e-6
        seam = np.flatnonzero((b.points == a.points[0]).all(axis=1))
        assert len(seam) == 2  # passed twice
        before = np.linalg.norm(np.diff(b.points[: seam[0] + 1], axis=0), axis=1).sum()
        after = np.linalg.norm(np.diff(b.points[seam[1] :], axis=0), axis=1).sum()
        assert (before, after) == (pytest.approx(4.0, abs=1e-3), pytest.approx(6.0, abs=1e-3))
    targets = sample_targets([boss], beads=BeadParameters(lead_in_mm=4.0, lead_out_mm=6.0))
    assert not targets.closed.any()


def test_open_beads_run_back_over_themselves_and_stay_in_the_layer():
    line = lines_at([0.0])[0]
    sliced = flat_sub_volume()
    led = with_leads(sliced, line, BeadParameters(lead_in_mm=3.0, lead_out_mm=4.0))
    assert led.points[:, 1].tolist() == pytest.approx([3.0, 0.0, 10.0, 6.0])
    assert led.length_mm == pytest.approx(17.0)
    assert led.stops == (1, 2)
    whole = with_leads(sliced, line, BeadParameters(lead_in_mm=300.0))
    assert whole.points[:, 1].tolist() == pytest.approx([10.0, 0.0, 10.0])


def flat_sub_volume() -> SlicedSubVolume:
    """Something with one layer on the plane z = 0, to hang beads on."""
    mesh = box((10, -20, -20), (40, 20, 20))
    sliced = slice_sub_volume(mesh, BODY, SlicingParameters("planar"))
    plane = Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    return replace(sliced, layers=(replace(sliced.layers[0], surface=plane),))


def test_ends_of_fill_lines_are_targets_and_open_beads_keep_their_ends(boss):
    parameters = BeadParameters("zigzag", width_mm=2.0)  # joints shorter than the least segment
    (laid,) = lay_beads([boss], parameters)
    targets = sample_targets([boss], beads=parameters)
    for path, bead in enumerate(laid.beads):
        rows = np.flatnonzero(targets.bead == path)
        assert targets.closed[path] == bead.closed
        if not bead.closed:
            assert np.array_equal(targets.position[rows[0]], bead.points[0])
            assert np.array_equal(targets.position[rows[-1]], bead.points[-1])
        held = {tuple(p) for p in targets.position[rows].tolist()}
        assert all(tuple(bead.points[k].tolist()) in held for k in bead.stops)
        if bead.kind == "infill":
            assert len(bead.stops) >= 2
    assert np.allclose(np.linalg.norm(targets.tangent, axis=1), 1)
    assert np.abs((targets.tangent * targets.normal).sum(axis=1)).max() < 1e-9


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 40.0), st.floats(0.05, 1.0), st.floats(0.2, 6.0))
def test_break_points_of_open_curves(seed, size, tolerance, least):
    rng = np.random.default_rng(seed)
    t = np.linspace(0, 1, 200)[:, None]
    curve = size * (t * [1.0, 0.3, 0.1] + 0.1 * np.sin(6 * t + rng.uniform(0, 6, 3)))
    chosen = open_break_points(curve, tolerance, least)
    assert (chosen[0], chosen[-1]) == (0, 199)
    assert (np.diff(chosen) > 0).all()
    step = np.linalg.norm(np.diff(curve[chosen], axis=0), axis=1)
    if len(chosen) > 2:
        assert step.min() >= least - 1e-9


def test_a_bead_shorter_than_a_segment_has_two_targets():
    curve = np.linspace(0, 1, 50)[:, None] * [0.5, 0.2, 0.0]
    assert open_break_points(curve, 0.3, 3.0).tolist() == [0, 49]
    assert open_break_points(curve[:2], 0.3, 3.0).tolist() == [0, 1]


def test_tangents_flip_where_a_bead_turns_back(boss):
    parameters = BeadParameters("zigzag", width_mm=4.0, lead_in_mm=5.0, lead_out_mm=5.0, contours=0)
    targets = sample_targets([boss], beads=parameters)
    rows = np.flatnonzero(targets.bead == 0)
    along = np.diff(targets.position[rows], axis=0)
    unit = along / np.linalg.norm(along, axis=1)[:, None]
    assert (unit[0] * unit[1]).sum() < -0.99  # back to the start, then forward
    assert (unit[-1] * unit[-2]).sum() < -0.99


def test_speed_follows_the_thickness(boss):
    table = BeadSpeed(8.0, ((1.0, 10.0), (2.0, 6.0)))
    assert table.at(np.array([0.5, 1.0, 1.5, 2.0, 9.0])).tolist() == [10.0, 10.0, 8.0, 6.0, 6.0]
    targets = sample_targets([boss], speed=table)
    assert targets.speed_mm_s == pytest.approx(10.0 - 4.0 * (targets.thickness_mm - 1.0))
    plain = sample_targets([boss])
    assert plain.speed_mm_s.tolist() == [8.0] * len(plain)
    names = [field.name for field in fields(Targets) if field.name != "speed_mm_s"]
    assert len(Targets(*(getattr(plain, name) for name in names)).speed_mm_s) == len(plain)
    for rows in (((2.0, 6.0), (1.0, 8.0)), ((1.0, 8.0), (1.0, 6.0)), ((1.0, 0.0),), ((-1.0, 5.0),), ((1.0, math.nan),)):
        with pytest.raises(PartError, match="speed_by_thickness"):
            BeadSpeed(8.0, rows)


def test_travels_retract_along_the_normal_and_keep_out_of_the_body(boss):
    other = slice_sub_volume(box((-45, -8, -8), (-10, 8, 8), "far"), BODY, SlicingParameters("cylindrical"))
    targets = sample_targets([boss, other])
    ways = travels(targets, 30.0)
    assert len(ways) == len(targets.closed) - 1
    top = np.hypot(*targets.position[:, :2].T).max()
    for way in ways:
        end, start = way.to_target - 1, way.to_target
        assert np.allclose(way.position[0], targets.position[end] + 30 * targets.normal[end])
        assert np.allclose(way.position[-1], targets.position[start] + 30 * targets.normal[start])
        assert np.allclose(way.tangent[-1], -targets.normal[start])
        assert np.allclose(np.linalg.norm(way.tangent, axis=1), 1)
        share = np.linspace(0, 1, 30)[:, None]
        for a, b in itertools.pairwise(way.position):
            away = np.hypot(*(a + share * (b - a))[:, :2].T)
            assert away.min() > R + 15
    across = [way for way in ways if len(way.position) > 2]
    volume = targets.sub_volume_index
    (over,) = [way for way in across if volume[way.to_target - 1] != volume[way.to_target]]
    for a, b in itertools.pairwise(over.position[1:-1]):
        away = np.hypot(*(a + np.linspace(0, 1, 30)[:, None] * (b - a))[:, :2].T)
        assert away.min() > top + 29.99


def test_rows_of_travel_stand_between_the_beads(boss):
    targets = sample_targets([boss])
    header, rows = targets_rows(targets, travels(targets, 30.0), 100.0)
    assert header[-1] == "speed_mm_s"
    kind, index = header.index("kind"), header.index("index")
    printed = [row for row in rows if row[kind] == "print"]
    assert [row[index] for row in printed] == list(range(len(targets)))
    assert {row[index] for row in rows if row[kind] == "travel"} == {""}
    assert rows[0][kind] == rows[-1][kind] == "print"
    path = header.index("path")
    for before, row in itertools.pairwise(rows):
        if row[path] != before[path]:
            assert row[kind] == "travel"
            assert row[-1] == 100.0
            assert row[-2] == 0.0


@pytest.mark.slow
def test_a_ring_has_beads_with_every_pattern():
    sliced = slice_sub_volume(ring(19.9, 30, -10, 10), BODY, SlicingParameters("cylindrical"))
    for pattern in ("contour_parallel", "zigzag"):
        targets = sample_targets([sliced], beads=BeadParameters(pattern, width_mm=4.0, seam="spread"))
        assert (np.diff(targets.bead) >= 0).all()
        for layer in sliced.layers:
            at = targets.position[targets.layer == layer.index]
            assert np.abs(layer.surface.distance(at)).max() < 1e-6
            assert np.abs(at[:, 2]).max() <= 8.0 + 1e-3


@pytest.mark.parametrize(
    ("how", "named"),
    [
        ({"pattern": "spiral"}, "pattern"),
        ({"seam": "there"}, "seam"),
        ({"seam": "chosen"}, "seam"),
        ({"seam_angle_deg": 3.0}, "seam"),
        ({"order": "long"}, "order"),
        ({"border": "outside"}, "border"),
        ({"width_mm": 0.0}, "width_mm"),
        ({"overlap": 1.0}, "overlap"),
        ({"lead_in_mm": -1.0}, "lead_in_mm"),
        ({"angle_deg": math.nan}, "angle_deg"),
    ],
)
def test_what_is_not_allowed_is_named(how, named):
    with pytest.raises(PartError, match=named):
        BeadParameters(**how)


def test_reversing_and_rolling_keep_the_points():
    layer = planar_layer(circle(5.0, 12))
    bead = Bead(layer.curves[0].points, True, "contour", 0, stops=(2, 5))
    back = bead.reversed()
    assert np.array_equal(back.points[0], bead.points[0])
    assert np.array_equal(back.points[1], bead.points[-1])
    assert {tuple(back.points[k]) for k in back.stops} == {tuple(bead.points[k]) for k in bead.stops}
    rolled = bead.rolled(4)
    assert np.array_equal(rolled.points[0], bead.points[4])
    assert {tuple(rolled.points[k]) for k in rolled.stops} == {tuple(bead.points[k]) for k in bead.stops}
