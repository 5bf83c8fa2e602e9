"""Layers held against the solid they came from: volumes, areas by the solid alone, and layers that were spoilt."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad
from support.parts.meshes import BODY, R, blade, box, box_solid, from_manifold, ring, sector, subdivided
from support.paths import ROOT

from slicing.curves.intersect import intersect
from slicing.document import slices_document
from slicing.layers.body_ends import NO_ENDS
from slicing.layers.layer import ConicalBody, CylindricalBody, RevolvedBody, SlicedSubVolume
from slicing.mesh.load import load_mesh
from slicing.paper.indices import indices
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.surfaces import Cone, Cylinder, Plane, Revolved
from slicing.volume.layer_areas import hold_volume, laid_volume
from slicing.volume.solid_flux import SolidFlux
from slicing.warning import WRONG_LAYER

PARTS = ROOT / "models" / "parts"
H = 1.73
STRATEGIES = ("planar", "cylindrical", "nonuniform")
TUBE = box_solid((10, -6, -8), (40, 6, 8)) - box_solid((0, -1, -2), (50, 1, 2))
FORK = box_solid((10, -8, -4), (25, 8, 4)) + box_solid((20, -8, -4), (40, -3, 4)) + box_solid((20, 3, -4), (40, 8, 4))


def spoilt(sliced: SlicedSubVolume, layer: int, curves) -> SlicedSubVolume:
    """With other curves in one layer."""
    layers = list(sliced.layers)
    layers[layer] = replace(layers[layer], curves=tuple(curves), area_mm2=sum(c.area_mm2 for c in curves))
    return replace(sliced, layers=tuple(layers))


@pytest.mark.parametrize(
    "surface", [Cylinder((0.0, 0.0), 27.0), Cylinder((-70.0, 4.0), 99.0), Cone((0.0, 0.0), 25.0, 20.0)]
)
@pytest.mark.parametrize("finer", [0, 4])
def test_area_and_volume_from_the_faces_alone(surface, finer):
    mesh = subdivided(box((2, -6, -8), (60, 6, 8)), finer)
    flux = SolidFlux.of(mesh)
    by = (0.0, 1.5, 3.0)
    for step in by:
        (curve,) = intersect(mesh, surface.offset(step))
        assert flux.area_on(surface, step) == pytest.approx(curve.area_mm2, rel=2e-3)
    far = surface.offset(3.0)
    between = quad(lambda d: sum(c.area_mm2 for c in intersect(mesh, surface.offset(d))), 0, 3, epsabs=1e-3)[0]
    assert flux.volume_beyond(surface) - flux.volume_beyond(far) == pytest.approx(between, rel=2e-3)


def test_planes_are_exact():
    flux = SolidFlux.of(blade())
    for x in (25.0, 31.7):
        plane = Plane((x, 0.0, 0.0), (1.0, 0.0, 0.0))
        (curve,) = intersect(blade(), plane)
        assert flux.area_on(plane) == pytest.approx(curve.area_mm2, rel=1e-8)


def test_area_on_a_revolved_profile():
    surface = Revolved((0.0, 0.0), ((20.0, -20.0), (24.0, 0.0), (23.0, 20.0)), 2.0)
    mesh = box((2, -6, -8), (60, 6, 8))
    (curve,) = intersect(mesh, surface)
    assert SolidFlux.of(mesh).area_on(surface) == pytest.approx(curve.area_mm2, rel=3e-3)


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_a_block_that_reaches_into_the_body(strategy):
    exact = 16 * quad(lambda y: 40 - math.sqrt(R * R - y * y), -6, 6)[0]
    held = hold_volume(slice_sub_volume(box(), BODY, SlicingParameters(strategy)))
    assert held.volume_mm3 == pytest.approx(exact, rel=1e-4)
    assert held.laid_mm3 - held.end_mm3 == pytest.approx(exact, rel=5e-3)
    assert held.lines == ()


def test_what_stands_out_above_the_top_is_told_apart():
    mesh = sector(0.6, 20.0, 40.0, -5.0, 5.0, n=40)
    sliced = slice_sub_volume(mesh, BODY, SlicingParameters("cylindrical"))
    held = hold_volume(sliced)
    count = 12
    assert len(sliced.layers) == count
    assert held.end_mm == pytest.approx(count * H - 20, abs=0.01)
    assert held.laid_mm3 == pytest.approx(sum(H * 1.2 * (20 + k * H) * 10 for k in range(count)), rel=1e-3)
    planar = hold_volume(slice_sub_volume(mesh, BODY, SlicingParameters("planar")))
    assert planar.end_mm < 0  # the last plane lies below the top


def test_thickness_is_integrated_over_the_region():
    """The wedge between a plane and the body, and between a plane and a cylinder below it."""
    sliced = slice_sub_volume(box((10, -15, -8), (40, 15, 8)), BODY, SlicingParameters("planar"))
    first, base = sliced.layers[0], math.sqrt(R * R - 225)
    edge = math.sqrt(R * R - (base + H) ** 2)  # from here outward the plane lies outside the body
    exact = 2 * 16 * quad(lambda y: base + H - math.sqrt(R * R - y * y), edge, 15)[0]
    assert laid_volume(first, None, BODY, H) == pytest.approx(exact, rel=1e-3)
    mixed = slice_sub_volume(box((10, -6, -8), (40, 6, 8)), BODY, SlicingParameters("nonuniform"))
    plane = next(k for k, layer in enumerate(mixed.layers) if isinstance(layer.surface, Plane))
    below = mixed.layers[plane - 1].surface
    x, height = below.axis_point[0], mixed.layers[plane].surface.point[0]
    exact = 16 * quad(lambda y: height - x - math.sqrt(below.radius**2 - y * y), -6, 6)[0]
    assert laid_volume(mixed.layers[plane], below, BODY, H) == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize(
    "name", ["propeller", *(pytest.param(n, marks=pytest.mark.slow) for n in ("support", "valve", "boiler"))]
)
def test_layers_of_the_shipped_parts_fit_their_solids(name):
    from slicing.decomposition.decompose import decompose

    parts = decompose(load_mesh(PARTS / f"{name}.stl"))
    mesh, body = parts.sub_volumes[0], parts.bodies[0]
    for strategy in ("cylindrical", "nonuniform") if name == "valve" else STRATEGIES:
        sliced = slice_sub_volume(mesh, body, SlicingParameters(strategy))
        held = hold_volume(sliced)
        assert held.lines == ()
        assert [layer.area_mm2 for layer in sliced.layers] == pytest.approx(held.area_mm2, rel=0.02)
        assert sliced.volume_mm3 == pytest.approx(mesh.volume, rel=1e-3)


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_a_lost_loop_is_seen(strategy):
    sliced = slice_sub_volume(from_manifold(FORK), BODY, SlicingParameters(strategy))
    assert hold_volume(sliced).lines == ()
    k = next(layer.index for layer in sliced.layers if len(layer.curves) == 2)
    lines = hold_volume(spoilt(sliced, k, sliced.layers[k].curves[:1])).lines
    assert lines[0].startswith(f"SV: layer {k}: its curves enclose")
    assert [line.code for line in lines] == ["layer_area", "layer_length", "layer_loops", "layer_volume"]
    assert {line.layer for line in lines[:-1]} == {k}
    assert "1 layer is wrong" in lines[-1]


@pytest.mark.parametrize("z_mm", [NO_ENDS, (-14.0, 60.0)])
@pytest.mark.parametrize("strategy", ["cylindrical", "nonuniform"])
def test_a_lost_loop_of_the_first_layer_is_seen(strategy, z_mm):
    """Below it is the body, in which the solid has no section: that is no section that it may fit."""
    legs = (
        box_solid((10, -4, -20), (40, 4, -8))
        + box_solid((10, -4, 8), (40, 4, 20))
        + box_solid((30, -4, -9), (40, 4, 9))
    )
    sliced = slice_sub_volume(from_manifold(legs), BODY, SlicingParameters(strategy), z_mm)
    held = hold_volume(sliced)
    assert not [line for line in held.lines if line.code in WRONG_LAYER]
    long = 24.0 if z_mm == NO_ENDS else 18.0
    assert held.area_mm2[0] == pytest.approx(2 * R * math.asin(4 / R) * long, rel=1e-3)
    for curve in sliced.layers[0].curves:
        codes = {line.code for line in hold_volume(spoilt(sliced, 0, [curve])).lines}
        assert codes >= {"layer_area", "layer_length", "layer_loops"}


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_a_hole_taken_for_an_outer_loop_is_seen(strategy):
    sliced = slice_sub_volume(from_manifold(TUBE), BODY, SlicingParameters(strategy))
    assert hold_volume(sliced).lines == ()
    k = next(layer.index for layer in sliced.layers if any(c.hole for c in layer.curves))
    turned = [replace(c, hole=False, area_mm2=abs(c.area_mm2)) for c in sliced.layers[k].curves]
    assert any("the layer is wrong" in line for line in hold_volume(spoilt(sliced, k, turned)).lines)
    assert any(
        "the layer is wrong" in line for line in hold_volume(spoilt(sliced, k, sliced.layers[k + 1].curves)).lines
    ) == (abs(sliced.layers[k + 1].area_mm2 / sliced.layers[k].area_mm2 - 1) > 0.021)


@pytest.mark.parametrize(
    ("body", "strategy", "mesh"),
    [
        (ConicalBody(20.0, 15.0), "conical", from_manifold(FORK)),
        pytest.param(ConicalBody(20.0, 15.0), "conical", ring(12.0, 36.0, -4.0, 7.0, n=90), marks=pytest.mark.slow),
        (RevolvedBody(((20.0, -40.0), (23.0, 0.0), (22.0, 40.0))), "revolved", from_manifold(FORK)),
    ],
)
def test_other_bodies(body, strategy, mesh):
    sliced = slice_sub_volume(mesh, body, SlicingParameters(strategy))
    held = hold_volume(sliced)
    assert held.lines == ()
    assert [layer.area_mm2 for layer in sliced.layers] == pytest.approx(held.area_mm2, rel=0.01, abs=0.05)
    k = next(layer.index for layer in sliced.layers if len(layer.curves) == 2)
    lines = hold_volume(spoilt(sliced, k, sliced.layers[k].curves[:1])).lines
    assert any("the layer is wrong" in line for line in lines)


def test_a_collar_thinner_than_a_layer_is_reported():
    """No layer is wrong, but layers cannot say how large the solid is: the volumes differ, and the line says both."""
    plain = [box_solid((10, -6, -8), (60, 6, 8))]
    collars = [box_solid((x, -18, -20), (x + 0.3, 18, 20)) for x in (R + 8 * H - 0.1, R + 15 * H - 0.1)]
    solid = from_manifold(plain[0] + collars[0] + collars[1])
    sliced = slice_sub_volume(solid, CylindricalBody(R), SlicingParameters("nonuniform", h_min_mm=H))
    flat = slice_sub_volume(solid, CylindricalBody(R), SlicingParameters("planar"))
    found = [line for one in (sliced, flat) for line in one.warnings if "area times thickness" in line]
    assert found
    assert "the sub-volume" in found[0]
    assert not any("is wrong" in line for one in (sliced, flat) for line in one.warnings)


def test_the_document_has_both_volumes():
    sliced = slice_sub_volume(box(), BODY, SlicingParameters("cylindrical"))
    held = hold_volume(sliced)
    written = json.loads(json.dumps(slices_document([sliced], [indices(sliced, 1)])))["sub_volumes"][0]
    assert written["volume_mm3"] == held.volume_mm3
    assert written["laid_volume_mm3"] == held.laid_mm3
    assert written["end_mm"] == held.end_mm
    assert np.isfinite(held.area_mm2).all()


def test_layers_on_an_end_face_raise_no_alarm():
    """The field runs along them; rounding lifts some a hair off the surface."""
    body = RevolvedBody(((0.0, 30.0), (20.0, 30.0), (20.0, 0.0)))
    sliced = slice_sub_volume(box((6, -5, 20), (12, 5, 60)), body, SlicingParameters("revolved"))
    assert hold_volume(sliced).lines == ()


def test_many_sections_at_once_are_those_one_by_one():
    flux = SolidFlux.of(from_manifold(TUBE))
    surfaces = [
        *(Cylinder((0.0, 0.0), r) for r in (33.0, 21.0, 27.5)),
        *(Plane((x, 0.0, 0.0), (1.0, 0.0, 0.0)) for x in (30.0, 15.0)),
        *(Cone((0.0, 0.0), r, 15.0) for r in (25.0, 20.0, 22.0)),
        Cylinder((-30.0, 2.0), 60.0),
    ]
    alone = [SolidFlux.of(from_manifold(TUBE)).area_on(surface) for surface in surfaces]
    assert flux.areas_on(surfaces) == pytest.approx(alone, rel=1e-9)
    assert flux.areas_on(surfaces) == pytest.approx(
        [sum(c.area_mm2 for c in intersect(from_manifold(TUBE), surface)) for surface in surfaces], rel=3e-3
    )


def test_a_body_that_only_enters_through_the_middle_of_a_face_is_taken_off():
    flux = SolidFlux.of(box((-30, -30, 0), (30, 30, 8)))
    assert flux.deepest(Cylinder((1.0, 2.0), 20.0)) == pytest.approx(-20.0)
    assert SolidFlux.of(box((10, -40, 0), (30, 40, 8))).deepest(Cylinder((0.0, 0.0), 20.0)) == pytest.approx(-10.0)
