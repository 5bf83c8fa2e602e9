"""Infill: what beads cover, how long they are, and that nothing is lost between the layer and its chart."""

from __future__ import annotations

import itertools
import math

import manifold3d
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import affinity
from support.layers.layers import PLANE, circle, coverage, laid_area, planar_layer
from support.parts.meshes import BODY, blade, box, box_solid, from_manifold, ring

from slicing.beads.infill import Stroke, contour_rounds
from slicing.beads.lay import _strokes, bead_of, lay_beads, layer_beads
from slicing.beads.middle_lines import distances, middle_lines
from slicing.beads.regions import islands
from slicing.beads.zigzag import zigzag
from slicing.curves.intersect import Curve
from slicing.layers.layer import Layer
from slicing.mesh.solid import PartError
from slicing.parameters import BeadParameters, SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.bodies import ConicalBody, RevolvedBody
from slicing.surfaces.charts import RoundChart
from slicing.surfaces.surfaces import Cone, Cylinder, Revolved

W = 5.0
FILLS = ("contour_parallel", "zigzag")


def rectangle(a: float, b: float) -> np.ndarray:
    return 0.5 * np.array([[-a, -b], [a, -b], [a, b], [-a, b]])


def middle_layer(mesh, strategy: str, body=BODY) -> Layer:
    sliced = slice_sub_volume(mesh, body, SlicingParameters(strategy))
    return sliced.layers[len(sliced.layers) // 2]


def holed():
    bore = manifold3d.Manifold.cylinder(60, 6, 6, 100).rotate((0, 90, 0)).translate((0, 3, 8))
    return from_manifold(box_solid((10, -19, -29), (40, 19, 29)) - bore, "holed")


def cone_flange(angle: float = 360.0):
    """A flange 9 to 13 mm thick over a cone of 15 degrees, all the way round or a sector of it."""
    slope = math.tan(math.radians(15))
    polygon = [(20 - 12 * slope, -12), (32 - 12 * slope, -12), (32 + 12 * slope, 12), (20 + 12 * slope, 12)]
    section = manifold3d.CrossSection([[(float(x), float(y)) for x, y in polygon]])
    return from_manifold(manifold3d.Manifold.revolve(section, 96, angle), "flange")


PROFILE = ((24.0, -30.0), (18.0, -4.0), (20.0, 6.0), (30.0, 30.0))


def turned_boss():
    """A block on a body with corners in its profile."""
    return box((10, -15, -14), (45, 15, 16), "turned")


LAYERS = {
    "plane": lambda: middle_layer(box((10, -25, -20), (60, 25, 20)), "planar"),
    "plane with a hole": lambda: middle_layer(holed(), "planar"),
    "cylinder": lambda: middle_layer(box((10, -15, -20), (60, 15, 20)), "cylindrical"),
    "cylinder with a hole": lambda: middle_layer(holed(), "cylindrical"),
    "ring": lambda: middle_layer(ring(19.9, 30, -13, 13), "cylindrical"),
    "cone": lambda: middle_layer(box((10, -15, -14), (45, 15, 16)), "conical", ConicalBody(20.0, 15.0)),
    "ring on a cone": lambda: middle_layer(cone_flange(), "conical", ConicalBody(20.0, 15.0)),
    "profile": lambda: middle_layer(turned_boss(), "revolved", RevolvedBody(PROFILE)),
    "disc": lambda: planar_layer(circle(14.0)),
    "annulus": lambda: planar_layer(circle(20.0), circle(7.0, hole=True)),
}


# of the others a quick run has the like
FEW = [pytest.param(name, marks=pytest.mark.slow) if name in ("ring on a cone", "profile") else name for name in LAYERS]


@pytest.mark.parametrize("name", FEW)
def test_beads_cover_what_they_can_reach_and_nothing_outside(name):
    layer = LAYERS[name]()
    for pattern, angle in (("contour_parallel", 0.0), ("zigzag", 0.0), ("zigzag", 90.0), ("zigzag", 37.0)):
        parameters = BeadParameters(pattern, width_mm=W, angle_deg=angle, angle_step_deg=0.0)
        share, outside = coverage(layer, parameters)
        assert share >= 0.99, (pattern, angle)
        assert outside < 2e-3 * layer.area_mm2, (pattern, angle)


@pytest.mark.parametrize("name", FEW)
def test_beads_lie_on_their_surface_and_in_their_layer(name):
    layer = LAYERS[name]()
    for pattern in FILLS:
        for bead in layer_beads(layer, BeadParameters(pattern, width_mm=W)):
            assert np.abs(layer.surface.distance(bead.points)).max() < 1e-8
            ends = np.roll(bead.points, -1, axis=0) if bead.closed else bead.points[1:]
            middle = 0.5 * (bead.points[: len(ends)] + ends)
            assert np.abs(layer.surface.distance(middle)).max() < 0.0101


@pytest.mark.slow
@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(8.0, 30.0), st.floats(1.5, 6.0), st.floats(0.0, 0.5), st.floats(0, 180))
def test_wobbly_regions_with_holes_are_covered(seed, size, width, overlap, angle):
    rng = np.random.default_rng(seed)
    t = 2 * np.pi * np.arange(160) / 160

    def blob(radius: float) -> np.ndarray:
        wobble = 1 + 0.3 * sum(rng.normal() / k * np.cos(k * t + rng.uniform(0, 6)) for k in range(2, 6))
        return radius * np.maximum(wobble, 0.4)[:, None] * np.stack([np.cos(t), np.sin(t)], axis=1)

    layer = planar_layer(blob(size), blob(0.15 * size)[::-1])
    for pattern in FILLS:
        parameters = BeadParameters(pattern, width_mm=width, overlap=overlap, angle_deg=angle)
        strokes = [_strokes(island, parameters, 0) for island in islands(layer)]
        assert all(strokes)
        for island, some in zip(islands(layer), strokes, strict=True):
            wide = [stroke for stroke in some if not stroke.thin]
            reach = island.region.buffer(-0.5 * width).buffer(0.5 * width, quad_segs=64)
            if wide and reach.area > width**2:
                covered = laid_area(island, wide, width)
                assert reach.intersection(laid_area(island, some, width)).area >= 0.98 * reach.area
                assert covered.difference(island.region.buffer(5e-3)).area < 1e-3 * island.region.area


@pytest.mark.slow
def test_charts_keep_lengths_areas_and_places():
    rng = np.random.default_rng(5)
    for name, make in LAYERS.items():
        layer = make()
        exact = not isinstance(layer.surface, Revolved) and name != "ring on a cone"
        for island in islands(layer):
            chart = island.chart
            outline = np.asarray(island.region.exterior.coords)[:-1]
            at = outline[rng.integers(0, len(outline), 12)]
            points = chart.lift(at)
            assert np.abs(layer.surface.distance(points)).max() < 1e-9
            step = 1e-4
            for direction in ([step, 0.0], [0.0, step], [0.6 * step, 0.8 * step]):
                length = np.linalg.norm(chart.lift(at + np.array(direction)) - points, axis=1) / step
                assert length.max() < 1 + 1e-5
                assert length.min() > 1 / chart.stretch[1] - 1e-5
                if exact:
                    assert length.min() > 1 - 1e-5
        if exact:
            assert sum(island.area_mm2 for island in islands(layer)) == pytest.approx(layer.area_mm2, rel=1e-4)


def test_a_chart_is_undone_by_its_lift():
    for surface in (Cylinder((1.0, 2.0), 20.0), Cone((1.0, 2.0), 20.0, 25.0), Cone((0.0, 0.0), 20.0, -40.0)):
        for half_turn in (0.5, 2.9):
            turn = np.linspace(-half_turn, half_turn, 200) + 1.3
            z = 6 * np.sin(3 * turn)
            r = surface.radius + (surface.slope * z if isinstance(surface, Cone) else 0.0)
            x, y = surface.axis_point
            points = np.stack([x + r * np.cos(turn), y + r * np.sin(turn), z], axis=1)
            chart = RoundChart.around(surface, [points], ring=False)
            assert chart.stretch == pytest.approx((1.0, 1.0))
            assert np.allclose(chart.lift(chart.flat(points)), points, atol=1e-9)


def test_rounds_of_a_rectangle_and_a_disc_have_the_lengths_of_their_offsets():
    a, b, pitch = 40.0, 26.0, 3.75
    found = list(contour_rounds(islands(planar_layer(rectangle(a, b)))[0], 2.5, pitch, W, None))
    lengths = [shapely.LinearRing(s.line).length for s in found if s.closed]
    inside = [2.5 + k * pitch for k in range(3)]
    assert lengths[:3] == pytest.approx([2 * (a - 2 * d) + 2 * (b - 2 * d) for d in inside], abs=1e-6)
    assert [s.kind for s in found] == ["contour", *["infill"] * (len(found) - 1)]
    disc = list(contour_rounds(islands(planar_layer(circle(14.0, 3600)))[0], 2.5, pitch, W, None))
    lengths = [shapely.LinearRing(s.line).length for s in disc]
    assert lengths[:4] == pytest.approx([2 * np.pi * (14 - 2.5 - k * pitch) for k in range(4)], abs=0.02)


def test_rounds_of_an_annulus_run_round_its_hole_as_well():
    layer = planar_layer(circle(20.0, 3600), circle(7.0, 1800, hole=True))
    first = list(contour_rounds(islands(layer)[0], 2.5, 3.75, W, 1, fills=False))
    assert sorted(s.hole for s in first) == [False, True]
    for stroke in first:
        ring_ = shapely.LinearRing(stroke.line)
        assert ring_.length == pytest.approx(2 * np.pi * (9.5 if stroke.hole else 17.5), rel=1e-4)
        assert ring_.is_ccw != stroke.hole


def test_lines_of_a_rectangle_by_hand():
    # 40 x 26 with lines 2.5 inside the border: 21 mm across, at most 3.75 apart: seven lines of 35 mm
    island = islands(planar_layer(rectangle(40.0, 26.0)))[0]
    (stroke,) = zigzag(island, 2.5, 0.0, 3.75, W, 0.0)
    assert len(stroke.line) == 14
    assert shapely.LineString(stroke.line).length == pytest.approx(7 * 35 + 21, abs=0.02)
    (turned,) = zigzag(island, 2.5, 0.0, 3.75, W, 90.0)
    assert shapely.LineString(turned.line).length == pytest.approx(11 * 21 + 35, abs=0.02)


def test_joints_stay_inside():
    ushape = [[-20, -15], [20, -15], [20, 15], [12, 15], [12, -7], [-12, -7], [-12, 15], [-20, 15]]
    island = islands(planar_layer(ushape))[0]
    for angle in (0.0, 30.0, 90.0, 135.0):
        strokes = list(zigzag(island, 1.5, 0.0, 2.0, 3.0, angle))
        room = island.region.buffer(-1.5 + 1e-3)
        assert all(room.covers(shapely.LineString(s.line)) for s in strokes)
    assert len(list(zigzag(island, 1.5, 0.0, 2.0, 3.0, 0.0))) == 2  # the second leg begins anew


def test_beads_run_across_the_seam_of_the_unrolling():
    layer = LAYERS["ring"]()
    circumference = 2 * np.pi * layer.surface.radius
    rounds = list(layer_beads(layer, BeadParameters("contour_parallel", width_mm=W)))
    assert all(bead.closed for bead in rounds)
    for bead in rounds:
        assert bead.length_mm == pytest.approx(circumference, rel=1e-3)
        closing = np.linalg.norm(bead.points[0] - bead.points[-1])
        assert closing < 2 * np.linalg.norm(np.diff(bead.points, axis=0), axis=1).max()
    # upright lines: spread evenly all the way round, joined to and fro
    parameters = BeadParameters("zigzag", width_mm=W, angle_deg=90.0, angle_step_deg=0.0)
    (lines,) = [b for b in layer_beads(layer, parameters) if not b.closed]
    angle = np.unwrap(np.arctan2(lines.points[:, 1], lines.points[:, 0]))
    at = angle[list(lines.stops)][::2]
    count = len(at)
    assert circumference / W < count <= math.ceil(circumference / (0.75 * W))
    laid = sum(bead.length_mm for bead in layer_beads(layer, parameters)) * 0.75 * W
    assert laid == pytest.approx(layer.area_mm2, rel=0.03)
    assert np.abs(np.abs(np.diff(at)) - 2 * np.pi / count).max() < 1e-3
    # turning the ring turns the fill: no place of the way round is special
    chart = islands(layer)[0].chart
    assert chart.period == pytest.approx(circumference)


def test_turning_a_layer_turns_its_beads_even_over_the_jump_of_the_angle():
    lengths = []
    for turn in (0.0, 100.0, 180.0):
        solid = box_solid((10, -15, -20), (60, 15, 20)).rotate((0, 0, turn))
        layer = middle_layer(from_manifold(solid), "cylindrical")
        lengths.append([bead.length_mm for bead in layer_beads(layer, BeadParameters("zigzag", width_mm=W))])
    assert lengths[1] == pytest.approx(lengths[0], rel=1e-4)
    assert lengths[2] == pytest.approx(lengths[0], rel=1e-4)


def test_a_narrow_strip_gets_one_bead_along_its_middle():
    (line, closed), *rest = middle_lines(shapely.box(-30, -1, 30, 1), W)
    assert not rest
    assert not closed
    assert np.abs(line[:, 1]).max() < 0.05
    assert np.ptp(line[:, 0]) == pytest.approx(60 - W, abs=0.6)
    (loop, closed), *rest = middle_lines(shapely.Point(0, 0).buffer(11, 64) - shapely.Point(0, 0).buffer(9, 64), W)
    assert closed
    assert not rest
    assert np.hypot(*loop.T) == pytest.approx(np.full(len(loop), 10.0), abs=0.15)


def test_a_blade_thinner_than_a_bead_is_laid_once_and_told():
    sliced = slice_sub_volume(blade(), BODY, SlicingParameters("cylindrical"))
    (laid,) = lay_beads([sliced], BeadParameters("zigzag", width_mm=W))
    assert len(laid.beads) == len(sliced.layers)
    assert all(bead.thin and not bead.closed for bead in laid.beads)
    assert any("narrower than one bead" in line for line in laid.warnings)


@pytest.mark.parametrize("pattern", ["contour", *FILLS])
@pytest.mark.parametrize("width", [10.0, 60.0, 1000.0])
def test_no_layer_is_left_out_however_wide_the_bead(pattern, width):
    """A region far smaller than its bead (the tip of a cone) still gets one, which is told as thin."""
    p = BeadParameters(pattern, width, border="edge")
    tip = planar_layer(rectangle(0.6, 0.5))
    wreath = ring(19.0, 24.0, 0.0, 9.0)
    around = slice_sub_volume(wreath, BODY, SlicingParameters("cylindrical", 2.2, 1.0, 3.0)).layers[0]
    turn = 2 * math.pi * BODY.radius_mm
    for layer, least, most in ((tip, 0.1, 2.3), (around, 0.99 * turn, 2.01 * turn)):
        beads = layer_beads(layer, p)
        assert least < sum(bead.length_mm for bead in beads) < most
        assert all(bead.thin for bead in beads)


def test_the_border_may_be_the_edge_or_the_centre_line():
    layer = planar_layer(rectangle(40.0, 26.0))
    edge, centre = (
        layer_beads(layer, BeadParameters("contour", width_mm=W, border=border))[0] for border in ("edge", "centre")
    )
    assert centre.length_mm == pytest.approx(2 * 40 + 2 * 26)
    assert edge.length_mm == pytest.approx(2 * 35 + 2 * 21, abs=1e-6)


def test_lines_turn_from_layer_to_layer():
    for index, across in ((0, 0), (1, 1), (2, 0)):
        layer = planar_layer(rectangle(40.0, 26.0), index=index)
        line = next(b for b in layer_beads(layer, BeadParameters("zigzag", width_mm=W)) if b.kind == "infill")
        first = line.points[line.stops[1]] - line.points[line.stops[0]]
        flat = np.abs([first @ axis for axis in PLANE.axes()])
        assert int(np.argmax(flat)) == across


def test_what_cannot_be_unrolled_is_refused():
    angle = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    loop = np.stack([20 * np.cos(angle), 20 * np.sin(angle), 0 * angle], axis=1)
    layer = Layer(3, Cylinder((0.0, 0.0), 20.0), (Curve(loop, True, False, 0.0, 1),), 1.0, (1.73, 1.73))
    with pytest.raises(PartError, match="layer 3"):
        islands(layer)


def test_strokes_become_fine_points_that_keep_their_corners():
    layer = LAYERS["cylinder"]()
    island = islands(layer)[0]
    stroke = next(iter(zigzag(island, 2.5, 0.0, 3.75, W, 20.0)))
    bead = bead_of(stroke, island, 0, 0.01)
    assert np.allclose(bead.points[list(bead.stops)], island.chart.lift(stroke.line[list(stroke.corners)]))
    assert bead.length_mm == pytest.approx(shapely.LineString(stroke.line).length, rel=1e-4)


@pytest.mark.parametrize("closed", [True, False])
def test_points_given_twice_are_laid_once(closed):
    (island,) = islands(planar_layer(rectangle(30.0, 20.0)))
    a, b, c = [0.0, 0.0], [5.0, 0.0], [5.0, 5.0]
    once = Stroke(np.array([a, b, c]), closed, False, "infill", corners=(0, 1, 2))
    twice = Stroke(np.array([a, a, b, c, a] if closed else [a, a, b, c, c]), closed, False, "infill", corners=(0, 2, 3))
    one, other = (bead_of(stroke, island, 0, 0.01) for stroke in (once, twice))
    assert np.array_equal(one.points, other.points)
    assert set(other.stops) <= set(one.stops)


def test_copies_of_a_ring_are_one_region():
    island = islands(LAYERS["ring"]())[0]
    many = island.repeated(3 * island.chart.period)
    assert many.region.geom_type == "Polygon"
    assert many.area_mm2 == pytest.approx(island.area_mm2, rel=1e-9)
    moved = affinity.translate(many.region, island.chart.period)
    assert moved.intersection(many.region).area == pytest.approx((many.periods - 1) * island.area_mm2, rel=1e-6)


def test_distances_from_a_border_of_many_sides_are_the_plain_ones() -> None:
    rng = np.random.default_rng(3)
    region = shapely.Point(0, 0).buffer(20, 500) - shapely.Point(3, 1).buffer(11, 300)
    points = rng.uniform(-25, 25, (400, 2))
    plain = shapely.distance(shapely.points(points), region.boundary)
    assert distances(points, region.boundary) == pytest.approx(plain, abs=1e-12)
    line = shapely.LineString([(0, 0), (10, 0), (10, 5)])
    assert distances(np.array([[4.0, 3.0], [12.0, 9.0]]), line) == pytest.approx([3.0, math.hypot(2, 4)])


@pytest.mark.parametrize("at", [-220.0, 0.0, 220.0])
def test_a_hole_in_a_helical_strip_is_on_the_turn_on_which_it_is(at):
    """The strip goes round more than once, beside itself; the hole's own points say no more than where it is."""
    surface, rise, wide = Cylinder((0.0, 0.0), 20.0), 0.3, 8.0

    def loop(*outline) -> np.ndarray:
        corners = np.array([*outline, outline[0]])
        flat = np.concatenate([np.linspace(a, b, 200, endpoint=False) for a, b in itertools.pairwise(corners)])
        return surface.lifted(np.stack([20.0 * np.radians(flat[:, 0]), rise * flat[:, 0] / 3.6 + flat[:, 1]], axis=1))

    strip = loop((-250.0, -wide), (250.0, -wide), (250.0, wide), (-250.0, wide))
    hole = loop((at - 5.0, -2.0), (at - 5.0, 2.0), (at + 5.0, 2.0), (at + 5.0, -2.0))
    area, gone = 20.0 * math.radians(500.0) * 2 * wide, 20.0 * math.radians(10.0) * 4.0
    curves = (Curve(strip, True, False, area), Curve(hole, True, True, -gone))
    (island,) = islands(Layer(1, surface, curves, area - gone, (1.7, 1.7)))
    assert island.area_mm2 == pytest.approx(area - gone, rel=1e-6)
