"""Infill over the end of a body of revolution: discs, cones and spheres by formula, the rest by its own distances."""

from __future__ import annotations

import math
from functools import cache

import manifold3d
import numpy as np
import pytest
import shapely
from scipy.spatial import cKDTree
from support.layers.layers import coverage, layer_on
from support.parts.meshes import box, from_manifold

from slicing.beads.infill import contour_rounds
from slicing.beads.lay import lay_beads, layer_beads
from slicing.beads.regions import RegionOverlap, islands
from slicing.curves.intersect import Curve, intersect
from slicing.layers.layer import Layer
from slicing.layers.poles import poles
from slicing.mesh.solid import PartError
from slicing.parameters import BeadParameters, SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.bodies import ConicalBody, RevolvedBody
from slicing.surfaces.charts import PoleChart, RoundChart
from slicing.surfaces.surfaces import Cone, Plane, Revolved

AXIS = (0.0, 0.0)
W, PITCH = 4.0, 3.0
FLAT_END = ((0.0, 30.0), (20.0, 30.0), (20.0, 0.0))
DOME = ((20.0, 0.0), (18.0, 8.0), (12.0, 14.0), (0.0, 17.0))
NEEDLE = Revolved(AXIS, ((0.001, -50.0), (0.001, 0.0), (0.0, 0.0)), 20.0)  # but for 0.001 mm a sphere at its end
FILLS = [("contour_parallel", 0.0), ("zigzag", 0.0), ("zigzag", 37.0)]


def filled(pattern: str, angle: float = 0.0, **more) -> BeadParameters:
    return BeadParameters(pattern, width_mm=W, angle_deg=angle, angle_step_deg=0.0, **more)


def bar(x0, x1, y0, y1, z0=-60.0, z1=80.0):
    return box((x0, y0, z0), (x1, y1, z1))


def rod(r: float, low: float, high: float, bore: float = 0.0, at=(0.0, 0.0)):
    solid = manifold3d.Manifold.cylinder(high - low, r, r, 128).translate((0, 0, low))
    if bore:
        solid -= manifold3d.Manifold.cylinder(200, bore, bore, 64).translate((*at, -100))
    return from_manifold(solid)


def round_layer(surface, r: float, n: int = 720) -> Layer:
    """What of a surface's upper end lies within a distance from its axis, as a layer."""
    if isinstance(surface, Cone):
        z = (r - surface.radius) / surface.slope
    else:
        z = math.sqrt(400.0 - r * r) if surface is NEEDLE else 30.0
    t = 2 * np.pi * np.arange(n) / n
    loop = np.stack([r * np.cos(t), r * np.sin(t), np.full(n, z)], axis=1)
    return Layer(0, surface, (Curve(loop, True, False, 1.0, 1),), math.nan, (1.73, 1.73))


LAYERS = {
    "boss on a flat end": lambda: layer_on(bar(-8, 7, -9, 10, 20), RevolvedBody(FLAT_END)),
    "cap over a shaft's end": lambda: layer_on(rod(32.0, 6.0, 45.0), RevolvedBody(FLAT_END)),
    "boss on a dome": lambda: layer_on(bar(-10, 9, -9, 11), RevolvedBody(DOME)),
    "cap on a dome": lambda: layer_on(bar(-60, 60, -60, 60, 10), RevolvedBody(DOME)),
    "boss on a cone's tip": lambda: layer_on(bar(-12, 14, -13, 12), ConicalBody(20.0, -50.0)),
    "under a cone's tip": lambda: layer_on(bar(-12, 14, -13, 12), ConicalBody(20.0, 50.0)),
    "tube round a dome's top": lambda: layer_on(rod(15.0, 5.0, 45.0, bore=4.0), RevolvedBody(DOME)),
    "hole beside a dome's top": lambda: layer_on(rod(15.0, 5.0, 45.0, 2.5, (7.0, 2.0)), RevolvedBody(DOME)),
    "side through a dome's top": lambda: layer_on(bar(0, 12, -9, 9), RevolvedBody(DOME)),
}


@cache
def layer_of(name: str) -> Layer:
    return LAYERS[name]()


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if "shaft" in name else name for name in LAYERS]
)
def test_beads_cover_what_they_can_reach_and_lie_on_the_surface(name):
    layer = layer_of(name)
    for pattern, angle in FILLS:
        p = filled(pattern, angle)
        share, outside = coverage(layer, p)
        assert share >= 0.99
        assert outside < 2e-3 * layer.area_mm2
        for bead in layer_beads(layer, p):
            assert np.abs(layer.surface.distance(bead.points)).max() < 1e-8
            ends = np.roll(bead.points, -1, axis=0) if bead.closed else bead.points[1:]
            middle = 0.5 * (bead.points[: len(ends)] + ends)
            assert np.abs(layer.surface.distance(middle)).max() < 0.0101


@pytest.mark.parametrize("name", LAYERS)
def test_no_place_on_the_surface_is_farther_from_a_bead_than_half_its_width(name):
    """Seen in space, without any chart; what beads cannot reach into (corners) is left out."""
    layer = layer_of(name)
    p = filled("zigzag", 20.0)
    cloud = cKDTree(np.concatenate([bead.points for bead in layer_beads(layer, p)]))
    rng = np.random.default_rng(3)
    for island in islands(layer):
        reach = island.region.buffer(-0.5 * W).buffer(0.5 * W - 0.05)
        x0, y0, x1, y1 = reach.bounds
        flat = rng.uniform((x0, y0), (x1, y1), (2500, 2))
        flat = flat[shapely.contains_xy(reach, flat[:, 0], flat[:, 1])]
        away, _ = cloud.query(island.chart.lift(flat))
        assert (away <= 0.5 * W + 0.05).mean() > 0.995
        assert away.max() < 0.75 * W


def lengths(layer: Layer) -> list[float]:
    """Of the rounds on the surface, from the outside inward."""
    (island,) = islands(layer)
    assert isinstance(island.chart, PoleChart)
    rounds = contour_rounds(island, 0.5 * W, PITCH, W, None, fills=False)
    out = []
    for stroke in rounds:
        line = shapely.LineString(np.concatenate([stroke.line, stroke.line[:1]])).segmentize(0.02)
        points = island.chart.lift(np.asarray(line.coords))
        out.append(float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()))
    return out


def test_rounds_on_a_disc_a_cone_and_a_sphere_have_the_lengths_of_their_parallels():
    inside = 0.5 * W + PITCH * np.arange(4)
    flat = lengths(round_layer(Revolved(AXIS, FLAT_END, 0.0), 15.0))
    assert flat[:4] == pytest.approx(2 * np.pi * (15 - inside), abs=0.01)
    for half in (-65.0, -40.0, -15.0):
        cone, sine = Cone(AXIS, 20.0, half), math.sin(math.radians(-half))
        found = lengths(round_layer(cone, 15.0))
        along = 15 / sine - inside
        assert found[:4] == pytest.approx(2 * np.pi * along * sine, rel=1e-3)
    for rim in (12.0, 17.0):
        angle = math.asin(rim / 20) - inside / 20
        found = lengths(round_layer(NEEDLE, rim))
        assert found[:3] == pytest.approx(2 * np.pi * 20 * np.sin(angle[:3]), rel=1e-3)


def test_a_flat_end_is_filled_as_the_plane_it_lies_in():
    """The same lines: the chart is exact there."""
    layer = layer_on(bar(-8, 7, -9, 10, 20), RevolvedBody(FLAT_END))
    z = layer.curves[0].points[0, 2]
    plane = Layer(2, Plane((0.0, 0.0, z), (0.0, 0.0, 1.0)), layer.curves, layer.area_mm2, layer.thickness_mm)
    u, _ = plane.surface.axes()
    turn = math.degrees(math.atan2(u[1], u[0]))  # where angles count from there
    for pattern in ("contour_parallel", "zigzag"):
        over = sorted(bead.length_mm for bead in layer_beads(layer, filled(pattern, 20.0)))
        flat = sorted(bead.length_mm for bead in layer_beads(plane, filled(pattern, 20.0 - turn)))
        assert over == pytest.approx(flat, rel=1e-5)


def test_charts_of_poles_are_undone_by_their_lift_and_never_shorter_than_the_surface():
    rng = np.random.default_rng(1)
    for name in LAYERS:
        layer = layer_of(name)
        for island in islands(layer):
            chart = island.chart
            if not isinstance(chart, PoleChart):
                continue
            x0, y0, x1, y1 = island.region.bounds
            at = rng.uniform((x0, y0), (x1, y1), (200, 2))
            at = at[shapely.contains_xy(island.region, at[:, 0], at[:, 1])]
            points, step = chart.lift(at), 1e-4
            assert np.abs(layer.surface.distance(points)).max() < 1e-9
            assert chart.flat(points) == pytest.approx(at, abs=2e-5), name
            for way in rng.normal(size=(3, 2)):
                way = step * way / np.linalg.norm(way)
                ratio = np.linalg.norm(chart.lift(at + way) - points, axis=1) / step
                assert ratio.max() < 1 + 1e-4
                assert ratio.min() > 1 / chart.stretch[1] - 1e-4


def test_the_share_of_the_spacing_is_that_of_two_lines_nearby():
    for surface in (NEEDLE, Cone(AXIS, 20.0, -35.0)):
        (island,) = islands(round_layer(surface, 16.0))
        beside = RoundChart.around(
            surface, [island.chart.lift(np.array([[9.0, 2.0], [15.0, 3.0], [12.0, 8.0]]))], False
        )
        for chart, at in ((island.chart, np.array([[9.0, 5.0]])), (beside, np.array([[0.4, 0.3]]))):
            for way in ([1.0, 0.0], [0.0, 1.0], [0.6, 0.8]):
                along, across = 1e-3 * np.array(way), 1e-3 * np.array([-way[1], way[0]])
                a, b, c = (chart.lift(at + d)[0] for d in (0 * along, along, across))
                unit = (b - a) / np.linalg.norm(b - a)
                gap = (c - a) - ((c - a) @ unit) * unit
                share = chart.spacing_share(at, np.array([way]))
                assert share == pytest.approx([np.linalg.norm(gap) / 1e-3], rel=2e-3)


def test_what_runs_far_down_from_the_end_is_divided_where_both_parts_fare_better():
    layer = layer_of("cap over a shaft's end")
    whole, pieces = islands(layer), islands(layer, RegionOverlap(0.5, W))
    assert len(whole) == 1
    assert whole[0].chart.stretch[1] > 1.9
    assert [type(piece.chart) for piece in pieces] == [PoleChart, RoundChart]
    assert max(piece.chart.stretch[1] for piece in pieces) < 1.15
    # they lie over one another by twice the joint
    over = sum(piece.area_mm2 for piece in pieces) - layer.area_mm2
    assert over == pytest.approx(2 * 0.5 * 2 * np.pi * 23.0, rel=0.5)
    # so that the nearest rounds of the two are neighbours
    rounds = [b for b in layer_beads(layer, filled("contour_parallel")) if b.closed]
    z_and_s = sorted(float(np.abs(whole[0].chart.flat(b.points)).max()) for b in rounds)
    gaps = np.diff(z_and_s)
    assert gaps.max() < PITCH + 0.01
    # the pattern of borders alone has none but the border
    assert len(layer_beads(layer, BeadParameters("contour", width_mm=W, border="edge"))) == 1


def test_beads_closer_together_than_asked_are_told_of():
    def lines(mesh, body, pattern):
        thick = {"h_layer_mm": 3.0, "h_min_mm": 1.0, "h_max_mm": 4.0}
        strategy = "conical" if body.kind == "cone" else "revolved"
        sliced = slice_sub_volume(mesh, body, SlicingParameters(strategy, **thick))
        (laid,) = lay_beads([sliced], filled(pattern))
        return [line for line in laid.warnings if "closer together" in line]

    sharp = ConicalBody(20.0, -25.0)
    (line,) = lines(bar(-6, 6, -6, 6, 20, 60), sharp, "zigzag")
    share = int(line.split("down to ")[1].split("%")[0]) / 100
    assert math.sin(math.radians(25)) - 0.006 < share < math.sin(math.radians(25)) + 0.03
    assert lines(bar(-6, 6, -6, 6, 20, 37), RevolvedBody(FLAT_END), "zigzag") == []


def test_which_ends_a_layer_holds():
    assert poles(layer_of("boss on a dome")) == (False, True)
    assert poles(layer_of("under a cone's tip")) == (True, False)
    assert poles(layer_of("tube round a dome's top")) == (False, False)
    # both ends of a barrel at once: two caps, not the ring between them
    barrel = RevolvedBody(((0.0, -20.0), (20.0, -12.0), (20.0, 12.0), (0.0, 20.0)))
    clamp = manifold3d.Manifold.cube((80, 80, 80), True) - manifold3d.Manifold.cylinder(34, 90, 90, 128).translate(
        (0, 0, -17)
    )
    clamp += manifold3d.Manifold.cube((10, 10, 80), True).translate((38, 0, 0))
    layer = layer_on(from_manifold(clamp), barrel, 0.0)
    assert poles(layer) == (True, True)
    found = islands(layer)
    assert [island.chart.side for island in found] == [-1, 1]
    assert sum(island.area_mm2 for island in found) == pytest.approx(2 * np.pi * 7.5**2 * math.hypot(1, 0.4), rel=0.1)


def test_a_layer_over_both_ends_in_one_is_refused():
    barrel = RevolvedBody(((0.0, -20.0), (20.0, -12.0), (20.0, 12.0), (0.0, 20.0)))
    shell = manifold3d.Manifold.sphere(60.0, 64) - manifold3d.Manifold.cylinder(100, 3, 3, 32).rotate((0, 90, 0))
    layer = layer_on(from_manifold(shell), barrel, 0.0)
    with pytest.raises(PartError, match="both ends of the body"):
        layer_beads(layer, filled("zigzag"))


@pytest.mark.parametrize("by", [0.0, 1.73, 3.46, 5.19])
def test_a_side_through_the_pole_has_the_area_between_those_beside_it(by):
    """Points exactly on the axis have no direction; what turns there must still add up."""
    sphere = tuple((20 * math.sin(a), 20 * math.cos(a)) for a in np.radians(np.arange(0, 91, 3)))
    for profile in (sphere, DOME, FLAT_END):
        surface = Revolved(AXIS, profile, by)
        less, exact, more = (
            sum(c.area_mm2 for c in intersect(bar(x, 12, -9, 9, 5, 45), surface)) for x in (1e-3, 0.0, -1e-3)
        )
        assert exact == pytest.approx(0.5 * (less + more), abs=2e-3)
