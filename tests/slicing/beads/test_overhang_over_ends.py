"""What overhangs on layers that close over the end of a body: areas, distances and places by hand."""

from __future__ import annotations

import math

import manifold3d
import numpy as np
import pytest
from support.parts.meshes import from_manifold

from slicing.beads.lay import lay_beads
from slicing.parameters import BeadParameters, SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.bodies import RevolvedBody
from slicing.warning import Code

H, ALLOWED = 1.7, 2.5
PLATE = RevolvedBody(((0.0, 30.0), (40.0, 30.0), (40.0, 0.0)))  # a wide end face
SHAFT = RevolvedBody(((0.0, 30.0), (20.0, 30.0), (20.0, -60.0)))
BALL = RevolvedBody(tuple((30 * math.cos(a), 30 * math.sin(a)) for a in np.linspace(0.0, 0.5 * math.pi, 41)))


def rod(r: float, low: float, high: float) -> manifold3d.Manifold:
    return manifold3d.Manifold.cylinder(high - low, r, r, 96).translate((0, 0, low))


def laid_on(solid: manifold3d.Manifold, body: RevolvedBody):
    sliced = slice_sub_volume(from_manifold(solid), body, SlicingParameters("revolved", H, H, H))
    (laid,) = lay_beads([sliced], BeadParameters())
    lines = [line for line in laid.warnings if getattr(line, "code", None) == Code.OVERHANG]
    return [one for one in laid.overhangs if one.area_mm2 > 0], lines, laid


def disc(r: float, hole: float = 0.0) -> float:
    return math.pi * (r * r - hole * hole)


@pytest.mark.parametrize("upside_down", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_head_that_is_wider_than_its_stem_is_told_of_with_its_area_and_place(upside_down):
    solid, body = rod(10, 25, 50) + rod(18, 45, 50), PLATE
    if upside_down:
        solid, body = solid.rotate((180, 0, 0)), RevolvedBody(((40.0, 0.0), (40.0, -30.0), (0.0, -30.0)))
    (one,), (line,), laid = laid_on(solid, body)
    assert abs(laid.sliced.layers[one.layer].curves[0].points[0, 2]) == pytest.approx(30 + H * one.layer)
    assert one.layer == math.ceil(15 / H)
    assert one.out_mm == pytest.approx(8.0, abs=0.01)
    assert one.area_mm2 == pytest.approx(disc(18, 10 + ALLOWED), rel=4e-3)
    assert one.begins_mm2 == 0.0
    assert math.hypot(*one.place_mm[:2]) == pytest.approx(18.0, abs=0.01)
    assert line.layer == one.layer
    ring = [[r, 0.0, one.place_mm[2]] for r in (0.0, 5.0, 12.0, 13.0, 17.5)]
    assert one.holds(np.array(ring)).tolist() == [False, False, False, True, True]


@pytest.mark.slow
def test_a_ring_that_comes_back_over_the_end_begins_in_the_air():
    mushroom = rod(6, 25, 60) + rod(18, 52, 60) + (rod(18, 42, 60) - rod(12, 40, 70))
    found, lines, _ = laid_on(mushroom, PLATE)
    first = found[0]
    assert first.layer == math.ceil(12 / H)
    assert first.begins_mm2 == pytest.approx(disc(18, 12), rel=2e-3)
    assert first.area_mm2 == pytest.approx(disc(18, 12), rel=2e-3)
    assert first.out_mm == pytest.approx(12.0, abs=0.01)
    assert "begin with nothing below" in str(lines[0])


@pytest.mark.slow
def test_a_plug_over_the_end_with_nothing_below_the_middle_is_told_of():
    """A pipe on the end that closes: the disc that closes it has its border below, and nothing within."""
    bottle = rod(16, 25, 53) - rod(10, 20, 50)
    (one,), _, _ = laid_on(bottle, PLATE)
    assert one.area_mm2 == pytest.approx(disc(10 - ALLOWED), rel=2e-3)
    assert one.out_mm == pytest.approx(10.0, abs=0.2)
    assert np.hypot(*one.place_mm[:2]) == pytest.approx(0.0, abs=0.2)


@pytest.mark.slow
def test_a_cap_over_an_end_and_its_sides_stands_out_nowhere():
    found, lines, laid = laid_on(rod(32, -30, 42) - rod(20, -40, 30), SHAFT)
    assert found == []
    assert lines == []
    assert all(math.isfinite(one.out_mm) for one in laid.overhangs)


@pytest.mark.slow
def test_a_cap_whose_rim_comes_down_farther_out_is_told_of_on_its_side():
    cap = rod(26, -20, 36) + (rod(32, -40, 42) - rod(26, -50, 30)) - rod(20, -60, 30)
    found, _, laid = laid_on(cap, SHAFT)
    (one,) = found
    radius = 20 + H * one.layer
    assert one.layer == math.ceil(6 / H)
    assert one.area_mm2 == pytest.approx(2 * math.pi * radius * (20 - ALLOWED), rel=5e-3)
    assert one.out_mm == pytest.approx(20.0, abs=0.01)
    assert one.place_mm[2] == pytest.approx(-40.0, abs=0.01)
    assert [o.begins_mm2 for o in laid.overhangs] == [0.0] * len(laid.overhangs)
    at = np.array([[*one.place_mm[:2], z] for z in (-39.0, -25.0, -21.0, 0.0)])
    assert one.holds(at).tolist() == [True, True, False, False]


@pytest.mark.slow
def test_a_cap_on_a_ball_that_grows_wider():
    """Distances on the ball are arcs; parallels that come out longer in the map do not make them longer."""
    wide, narrow, high = math.radians(50.0), math.radians(30.0), 37.0
    cone = [manifold3d.Manifold.cylinder(80 * math.cos(a), 0.0, 80 * math.sin(a), 512) for a in (narrow, wide)]
    ball = [manifold3d.Manifold.sphere(r, 256) for r in (29.9, high, 45.0)]
    found, _, laid = laid_on((cone[0] ^ ball[1]) - ball[0] + ((cone[1] ^ ball[2]) - ball[1]), BALL)
    one = max(found, key=lambda o: o.area_mm2)
    r = 30 + H * one.layer
    assert one.layer == pytest.approx((high - 30) / H, abs=1)
    arc = r * (wide - narrow)
    assert one.out_mm == pytest.approx(2 * r * math.sin(0.5 * (wide - narrow)), rel=0.02)
    want = 2 * math.pi * r * r * (math.cos(narrow + ALLOWED / r) - math.cos(wide))
    assert one.area_mm2 == pytest.approx(want, rel=0.02), arc
    assert len(laid.overhangs) == len(laid.sliced.layers)
