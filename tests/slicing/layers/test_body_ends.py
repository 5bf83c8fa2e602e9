"""Sub-volumes that reach over a body's ends: contact, volumes and what is said, by hand."""

from __future__ import annotations

import math

import manifold3d
import numpy as np
import pytest
from support.parts.meshes import BODY, R, box, box_solid, from_manifold

from slicing.layers.body_ends import NO_ENDS, body_ends, over_ends_mm3, without_body
from slicing.paper.indices import indices, top_angle
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.bodies import ConicalBody, CylindricalBody, RevolvedBody
from slicing.warning import Code

BLADE = box((5, -3, -15), (50, 3, 45), "blade")
ENDS = (0.0, 20.0)
WIDE = 2 * math.asin(3 / R) * R
# what a blade 6 mm thick has within the radius, from x = 5 on, for every mm of height
SLICE = 2 * (0.5 * (3 * math.sqrt(R**2 - 9) + R**2 * math.asin(3 / R)) - 3 * 5)


def body_ends_lines(sliced):
    return [line for line in sliced.warnings if getattr(line, "code", None) == Code.BODY_END]


@pytest.mark.parametrize("strategy", ["cylindrical", "nonuniform"])
def test_layer_0_ends_where_the_body_ends(strategy):
    sliced = slice_sub_volume(BLADE, BODY, SlicingParameters(strategy), ENDS)
    assert sliced.layers[0].area_mm2 == pytest.approx(WIDE * 20, rel=1e-4)
    assert indices(sliced, 0).A_mm2 == pytest.approx(WIDE * 20, rel=1e-4)
    assert sliced.volume_mm3 == pytest.approx(45 * 6 * 60 - SLICE * 20, rel=1e-4)
    (line,) = body_ends_lines(sliced)
    assert f"{SLICE * 40:.0f}"[:3] in line
    assert not any("layer is wrong" in line for line in sliced.warnings)


def test_what_lies_over_the_ends_is_as_much_as_by_hand():
    assert over_ends_mm3(BLADE, BODY, ENDS) == pytest.approx(SLICE * 40, rel=1e-3)
    assert over_ends_mm3(BLADE, BODY, (-20.0, 20.0)) == pytest.approx(SLICE * 25, rel=1e-3)


def test_over_the_end_of_a_cone_lies_no_more_than_its_tip():
    cone = ConicalBody(20.0, -50.0)
    radius, high = 20.0 - 15.0 * math.tan(math.radians(50.0)), 20.0 / math.tan(math.radians(50.0)) - 15.0
    block = box((-10, -10, 0), (10, 10, 40), "block")
    assert over_ends_mm3(block, cone, (0.0, 15.0)) == pytest.approx(math.pi * radius**2 * high / 3, rel=1e-3)


def test_a_body_with_a_shoulder_is_taken_off_with_its_shoulder():
    body = RevolvedBody(((15.0, 0.0), (15.0, 20.0), (25.0, 20.0), (25.0, 50.0)))
    rest = without_body(box((-30, -30, 0), (30, 30, 40), "block"), body, NO_ENDS)
    assert rest.volume == pytest.approx(60 * 60 * 40 - math.pi * (15**2 * 20 + 25**2 * 20), rel=1e-3)


def test_layers_of_a_profile_go_round_its_ends():
    body = RevolvedBody(((R, 0.0), (R, 20.0)))
    sliced = slice_sub_volume(BLADE, body, SlicingParameters("revolved"), ENDS)
    assert sliced.layers[0].area_mm2 == pytest.approx(WIDE * 20 + 2 * SLICE, rel=1e-3)
    assert sliced.laid_volume_mm3 == pytest.approx(sliced.volume_mm3, rel=0.03)
    assert not body_ends_lines(sliced)


def test_planes_hold_what_lies_over_the_ends_as_far_as_they_reach():
    block = box((12, -12, -15), (40, 12, 45), "block")
    sliced = slice_sub_volume(block, BODY, SlicingParameters("planar"), ENDS)
    first = sliced.layers[0]
    height = math.sqrt(R**2 - 144) + 1.73  # a plane that runs into the body between its ends
    assert -float(first.surface.distance(np.zeros((1, 3)))[0]) == pytest.approx(height, abs=1e-6)
    assert first.area_mm2 == pytest.approx(24 * 60 - 2 * math.sqrt(R**2 - height**2) * 20, rel=1e-4)


def test_sub_volumes_within_the_ends_are_sliced_as_on_a_body_without():
    for strategy in ("planar", "cylindrical", "nonuniform"):
        plain = slice_sub_volume(box(), BODY, SlicingParameters(strategy))
        told = slice_sub_volume(box(), BODY, SlicingParameters(strategy), (-8.0, 8.0))
        assert told.body_z_mm == NO_ENDS
        assert told.warnings == plain.warnings
        for a, b in zip(plain.layers, told.layers, strict=True):
            assert all(np.array_equal(p.points, q.points) for p, q in zip(a.curves, b.curves, strict=True))


def test_a_body_ends_where_its_profile_leaves_its_radius():
    stepped = ((20.0, 0.0), (20.0, 30.0), (12.0, 30.0), (12.0, 60.0))
    assert body_ends(stepped, CylindricalBody(20.0)) == pytest.approx((0.0, 30.0), abs=0.1)
    assert body_ends(stepped, CylindricalBody(12.0)) == pytest.approx((0.0, 60.0), abs=0.1)
    assert body_ends(stepped, CylindricalBody(33.0)) == NO_ENDS
    assert body_ends(
        ((0.0, 0.0), (20.0, 0.0), (20.0, 30.0)), RevolvedBody(((0.0, 0.0), (20.0, 0.0), (20.0, 30.0)))
    ) == (pytest.approx((-math.inf, 30.0)))


def test_adhesion_counts_the_body_once():
    block = box((20, -10, -10), (42, 10, 10), "block")
    body = CylindricalBody(30.0)
    footprint = 2 * 30 * math.asin(10 / 30) * 20
    for least in (0.5, 1.2):
        parameters = SlicingParameters("nonuniform", h_min_mm=least)
        found = indices(slice_sub_volume(block, body, parameters), 0).A_mm2
        assert found == pytest.approx(footprint, rel=1e-4)


def test_the_top_angle_goes_by_the_length_of_the_curves():
    """A fork of two tines with tops of their own slope: the mean by length, not by tine."""
    low, high = box_solid((10, -12, 0), (30, 12, 10)), []
    for (y0, y1), wide, slope in (((-12, -7), 20.0, 0.0), ((4, 12), 6.0, 0.5)):
        tine = box_solid((29, y0, 0), (60, y1, wide))
        x = 50.4 - slope * 0.5 * (y1 - y0)
        cut = manifold3d.Manifold.cube((40, 40, 60)).translate((0, -20, -20))
        turned = cut.rotate((0, 0, math.degrees(math.atan(slope)))).translate((x, 0.5 * (y0 + y1), 0))
        high.append(tine - turned)
    mesh = from_manifold(manifold3d.Manifold.batch_boolean([low, *high], manifold3d.OpType.Add), "fork")
    sliced = slice_sub_volume(mesh, BODY, SlicingParameters("planar"))
    last = sliced.layers[-1]
    if len(last.curves) == 2:
        lengths = [float(np.linalg.norm(np.roll(c.points, -1, axis=0) - c.points, axis=1).sum()) for c in last.curves]
        tilted = [0.0 if c.points[:, 1].mean() < 0 else math.atan(0.5) for c in last.curves]
        exact = float(np.average(tilted, weights=lengths))
        assert top_angle(sliced) == pytest.approx(exact, abs=0.02)
    assert len(last.curves) == 2
