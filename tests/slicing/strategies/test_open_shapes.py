"""Shapes that the paper leaves open: what is decided for each, in every strategy."""

import manifold3d
import numpy as np
import pytest
from support.parts.meshes import box, box_solid, from_manifold, ring, sector

from slicing.layers.layer import ConicalBody, CylindricalBody, RevolvedBody
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume

R, H = 20.0, 1.73
BODY = CylindricalBody(R)
ALL = ("planar", "cylindrical", "nonuniform")


def cut(solid, strategy, body=BODY):
    mesh = solid if hasattr(solid, "vertices") else from_manifold(solid)
    return slice_sub_volume(mesh, body, SlicingParameters(strategy))


def areas(sliced):
    return np.array([layer.area_mm2 for layer in sliced.layers])


@pytest.mark.parametrize(("half", "warned"), [(1.4, False), (1.65, True), (2.8, True)])
def test_planes_beyond_half_a_turn_are_cut_and_warned_of(half, warned):
    mesh = sector(half, 20, 30, -5, 5, n=80)
    sliced = cut(mesh, "planar")
    assert any("have no body below them" in line for line in sliced.warnings) == warned
    if warned:
        assert f"spans {np.degrees(2 * half):.0f} degrees" in " ".join(sliced.warnings)
    # the planes stack up to the solid, or it is said what is left out
    short = any("the metal below them is left out" in line for line in sliced.warnings)
    assert short == (half > 2)
    assert areas(sliced).sum() * H == pytest.approx(mesh.volume, rel=0.2 if short else 0.12)
    for layer in sliced.layers:
        for curve in layer.curves:
            assert np.hypot(*curve.points[:, :2].T).min() > R - 1e-3
    assert not any("below them" in line for line in cut(mesh, "nonuniform").warnings)


def test_a_sub_volume_flattens_as_soon_as_it_spans_less_than_half_a_turn():
    # a collar over 230 degrees that goes on as a block above it
    solid = from_manifold(box_solid((10, -12, -5), (60, 12, 5)) + _manifold(sector(2.0, 19.0, 26.0, -5, 5, n=120)))
    wide, uniform = cut(solid, "nonuniform"), cut(solid, "cylindrical")
    for a, b in zip(wide.layers[:4], uniform.layers, strict=False):  # radius 20 .. 25.19
        assert a.surface.axis_point == b.surface.axis_point
        assert a.surface.radius == pytest.approx(b.surface.radius)
    assert wide.layers[5].surface != uniform.layers[5].surface
    assert wide.layers[-1].surface.kind == "plane"


def _manifold(mesh):
    return manifold3d.Manifold(
        manifold3d.Mesh(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32)),
    )


def test_rings_on_cones_and_profiles():
    for strategy, body in (
        ("conical", ConicalBody(R, 10.0)),
        ("revolved", RevolvedBody(((R, -20.0), (R + 2, 0.0), (R, 20.0)))),
    ):
        sliced = cut(ring(17.0, 30.0, -4.0, 7.0, n=90), strategy, body)
        assert len(sliced.layers) >= 4
        for layer in sliced.layers[:3]:
            assert sorted(curve.winding for curve in layer.curves) == [-1, 1]


@pytest.mark.parametrize("strategy", ["cylindrical", "planar"])
def test_several_loops_are_the_layers_of_each_by_itself(strategy):
    feet = [box_solid((10, -9, -8), (33, -4, 8)), box_solid((10, 4, -8), (33, 9, 8))]
    both = cut(feet[0] + feet[1], strategy)
    assert {len(layer.curves) for layer in both.layers} == {2}
    if strategy == "cylindrical":
        alone = [areas(cut(foot, strategy)) for foot in feet]
        assert areas(both) == pytest.approx(alone[0] + alone[1], rel=1e-9)
    else:
        assert areas(both)[3:] == pytest.approx(2 * 5 * 16.0)


@pytest.mark.parametrize("strategy", ALL)
def test_branches_that_come_together_become_one_region(strategy):
    legs = box_solid((10, -9, -4), (40, -5, 4)) + box_solid((10, 5, -4), (40, 9, 4))
    arch = legs + box_solid((36, -9, -4), (46, 9, 4))
    loops = [len(layer.curves) for layer in cut(arch, strategy).layers]
    assert loops == sorted(loops, reverse=True)
    assert set(loops) == {1, 2}


@pytest.mark.parametrize("strategy", ALL)
def test_holes_are_left_out_in_every_strategy(strategy):
    tube = box_solid((10, -6, -8), (40, 6, 8)) - box_solid((0, -2, -3), (50, 2, 3))
    whole, core = (cut(s, strategy) for s in (box(), box_solid((10, -2, -3), (40, 2, 3))))
    assert whole.layers  # the shapes that tests share stay sliceable
    sliced = cut(tube, strategy)
    for layer in sliced.layers[2:10]:
        assert [curve.hole for curve in layer.curves].count(True) == 1
    if strategy == "cylindrical":
        full = cut(box_solid((10, -6, -8), (40, 6, 8)), strategy)
        n = len(core.layers)
        assert areas(sliced)[:n] == pytest.approx(areas(full)[:n] - areas(core), rel=1e-6)


@pytest.mark.parametrize("strategy", ALL)
def test_a_sub_volume_that_ends_on_another_body_stays_out_of_it(strategy):
    other, centre = 15.0, 70.0
    strut = box_solid((10, -5, -6), (70, 5, 6)) - manifold3d.Manifold.cylinder(60, other, other, 720, True).translate(
        [centre, 0, 0]
    )
    sliced = cut(strut, strategy)
    sagitta = other * (1 - np.cos(np.pi / 720))
    for layer in sliced.layers:
        for curve in layer.curves:
            away = np.hypot(curve.points[:, 0] - centre, curve.points[:, 1])
            assert away.min() > other - sagitta - 1e-6
    # up to where the strut ends: beside the other body, at x = 70 - sqrt(15^2 - 5^2)
    end = max(float(curve.points[:, 0].max()) for curve in sliced.layers[-1].curves)
    assert centre - np.sqrt(other**2 - 25.0) - H < end <= centre - np.sqrt(other**2 - 25.0) + 1e-6


def test_an_arc_that_is_flat_already_goes_straight_to_planes():
    sliced = cut(box_solid((10, -0.8, -6), (34, 0.8, 6)), "nonuniform")
    assert [layer.surface.kind for layer in sliced.layers[:2]] == ["cylinder", "plane"]
    assert {layer.surface.kind for layer in sliced.layers[1:]} == {"plane"}
    assert sliced.layers[1].thickness_mm == pytest.approx((H, H), abs=0.02)
    huge = cut(box_solid((1e5 - 5, -6, -6), (1e5 + 14, 6, 6)), "nonuniform", CylindricalBody(1e5))
    assert {layer.surface.kind for layer in huge.layers[1:]} == {"plane"}
    assert areas(huge) == pytest.approx(144.0, rel=1e-6)
