"""Layers against sections made without them, regions within regions, and layers that are not those of their solid."""

from __future__ import annotations

from dataclasses import replace

import manifold3d
import numpy as np
import pytest
import shapely
from support.parts.meshes import BODY, box_solid, from_manifold
from support.parts.random_solids import random_solid, unrolled_section

from cell.cli.main import main
from slicing.beads.lay import lay_beads
from slicing.curves.intersect import intersect
from slicing.curves.loops import Curve
from slicing.deposits.part_shape import part_shape
from slicing.layers.layer import CylindricalBody, RevolvedBody, SlicedSubVolume
from slicing.layers.outside_body import region_of
from slicing.parameters import BeadParameters, SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.surfaces import Cone, Cylinder, Plane, Revolved
from slicing.targets.targets import sample_targets
from slicing.volume.borders import section_loops
from slicing.volume.layer_areas import hold_volume
from slicing.warning import Code

HUB = CylindricalBody(40.0)
FRAME = box_solid((30, -20, -20), (66, 20, 20)) - box_solid((20, -14, -14), (70, 14, 14))
PIN = box_solid((30, -6, -6), (66, 6, 6)) - box_solid((20, -2, -2), (70, 2, 2))
STRATEGIES = ("planar", "cylindrical", "nonuniform")


def flat_area(curves: list[Curve]) -> float:
    return sum(curve.area_mm2 for curve in curves)


@pytest.mark.parametrize("seed", range(8))
def test_sections_are_those_of_manifold3d_in_area_loops_and_nesting(seed):
    solid = random_solid(np.random.default_rng(seed))
    mesh, rng = from_manifold(solid), np.random.default_rng(seed + 100)
    for z in rng.uniform(*mesh.bounds[:, 2], 3).tolist():
        theirs = solid.slice(z)
        plane = Plane((0.0, 0.0, z), (0.0, 0.0, 1.0))
        curves = intersect(mesh, plane)
        region = region_of([plane.unrolled(curve.points) for curve in curves])
        assert flat_area(curves) == pytest.approx(theirs.area(), rel=1e-6, abs=1e-6)
        assert region.area == pytest.approx(theirs.area(), rel=1e-6, abs=1e-6)
        assert len(curves) == theirs.num_contour()
        parts = [part for part in shapely.get_parts(region) if part.area > 1e-6]
        assert len(parts) == len(theirs.decompose())
        assert sum(len(part.interiors) for part in parts) == sum(curve.hole for curve in curves)


@pytest.mark.parametrize("seed", range(4))
def test_sections_by_a_cylinder_are_those_of_the_unrolled_solid(seed):
    rng = np.random.default_rng(seed)
    solid = random_solid(rng).translate((60.0, 0.0, 0.0))
    mesh = from_manifold(solid)
    for radius in rng.uniform(40.0, 80.0, 2).tolist():
        theirs = unrolled_section(solid, radius)
        curves = intersect(mesh, Cylinder((0.0, 0.0), radius))
        assert flat_area(curves) == pytest.approx(theirs.area(), rel=5e-3, abs=0.05)
        assert sum(abs(curve.area_mm2) > 0.05 for curve in curves) == sum(
            abs(manifold3d.CrossSection([loop], manifold3d.FillRule.NonZero).area()) > 0.05
            or abs(shapely.Polygon(loop).area) > 0.05
            for loop in theirs.to_polygons()
        )
        lengths, _ = section_loops(mesh.vertices, mesh.faces, Cylinder((0.0, 0.0), radius))
        assert len(lengths) <= len(curves) + 4  # large faces: a bound alone


def test_islands_within_holes_are_in_the_region():
    square = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
    loops = [5 * square, 4 * square[::-1], 3 * square, 2 * square[::-1], square]
    expected = 100 - 64 + 36 - 16 + 4
    for order in (loops, loops[::-1], [loops[k] for k in (2, 0, 4, 1, 3)]):
        assert region_of(order).area == pytest.approx(expected)


@pytest.mark.slow
@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize("pattern", ["contour_parallel", "zigzag"])
def test_an_island_within_a_hole_is_filled_as_if_it_were_alone(strategy, pattern):
    parameters = SlicingParameters(strategy)
    beads = BeadParameters(pattern, width_mm=4.0)

    def length(solid: manifold3d.Manifold) -> float:
        (laid,) = lay_beads([slice_sub_volume(from_manifold(solid), HUB, parameters)], beads)
        return sum(bead.length_mm for bead in laid.beads if bead.layer == 8)

    both, frame, pin = length(FRAME + PIN), length(FRAME), length(PIN)
    assert pin > 20
    if strategy == "cylindrical":  # the others turn or move their layers with the outline
        assert both == pytest.approx(frame + pin, rel=1e-6)
    else:
        assert frame + 0.7 * pin < both < 1.1 * (frame + pin)


def test_an_island_within_a_hole_is_in_the_way():
    sliced = slice_sub_volume(from_manifold(FRAME + PIN), HUB, SlicingParameters("planar"))
    shape = part_shape((sliced,), None, ((40.0, -30.0), (40.0, 30.0)))
    pieces = [points for name, points in shape.hulls.items() if name.startswith("deposit/8/")]
    assert any((np.abs(points[:, 1:]) < 6.5).all() for points in pieces)


def spoilt(sliced: SlicedSubVolume, layer: int, curves: list[Curve]) -> SlicedSubVolume:
    layers = list(sliced.layers)
    layers[layer] = replace(layers[layer], curves=tuple(curves))
    return replace(sliced, layers=tuple(layers))


def codes(sliced: SlicedSubVolume) -> set[tuple[Code, int | None]]:
    return {(line.code, line.layer) for line in hold_volume(sliced).lines}


@pytest.mark.parametrize("strategy", ["planar", pytest.param("nonuniform", marks=pytest.mark.slow)])
def test_a_bridge_of_no_width_and_a_loop_of_little_area_are_seen(strategy):
    legs = (
        box_solid((10, -12, -6), (60, -4, 6))
        + box_solid((10, 4, -6), (60, 12, 6))
        + box_solid((10, -1, -1), (60, 0, 0))
    )
    sliced = slice_sub_volume(from_manifold(legs), BODY, SlicingParameters(strategy))
    assert codes(sliced) == set()
    at = 10
    layer = sliced.layers[at]
    large = sorted(layer.curves, key=lambda curve: -curve.area_mm2)
    # without the pin of 1 mm², half a hundredth of the area
    assert (Code.LAYER_LOOPS, at) in codes(spoilt(sliced, at, large[:2]))
    one, other = (np.concatenate([c.points, c.points[:1]]) for c in large[:2])
    joined = Curve(np.concatenate([one, other]), True, False, large[0].area_mm2 + large[1].area_mm2)
    found = codes(spoilt(sliced, at, [joined, large[2]]))
    assert found - {(Code.LAYER_SEAM, at)} == {(Code.LAYER_LENGTH, at), (Code.LAYER_LOOPS, at)}


@pytest.mark.parametrize(("more", "wrong"), [(1.01, False), (1.05, True)])
def test_how_much_longer_a_border_may_be_than_the_solids_section(more, wrong):
    """A zigzag of no area along one side: 2 % and half a millimetre count as rounding."""
    sliced = slice_sub_volume(from_manifold(box_solid((10, -20, -10), (60, 20, 10))), BODY, SlicingParameters("planar"))
    at = 10
    (curve,) = sliced.layers[at].curves
    a, b = curve.points[0], curve.points[1]
    there = a + min(0.5 * (more - 1.0) * curve.length_mm / np.linalg.norm(b - a), 1.0) * (b - a)
    longer = replace(curve, points=np.concatenate([[a, there], curve.points]))
    assert longer.length_mm == pytest.approx(more * curve.length_mm, rel=1e-3)
    assert ((Code.LAYER_LENGTH, at) in codes(spoilt(sliced, at, [longer]))) == wrong


def with_less_area(layer):
    return replace(layer, area_mm2=0.9 * layer.area_mm2)


def with_a_loop_more(layer):
    points = layer.curves[0].points
    inside = points.mean(axis=0)
    small = inside + 0.19 / np.linalg.norm(points - inside, axis=1).max() * (points - inside)  # mm
    return replace(layer, curves=(*layer.curves, Curve(small, True, False, 0.0)))


def with_a_longer_border(layer):
    (curve,) = layer.curves
    a, b = curve.points[:2]
    there = a + 0.05 * curve.length_mm / np.linalg.norm(b - a) * (b - a)
    return replace(layer, curves=(replace(curve, points=np.concatenate([[a, there], curve.points])),))


@pytest.mark.parametrize(
    ("spoil", "code"),
    [(with_less_area, "layer_area"), (with_a_loop_more, "layer_loops"), (with_a_longer_border, "layer_length")],
)
def test_a_wrong_layer_gets_no_verdict(spoil, code, make_case, monkeypatch, capsys):
    from slicing.strategies import slice as slicer

    right = slicer._layers

    def wrong(*args):
        layers = right(*args)
        layers[1] = spoil(layers[1])
        return layers

    case = str(make_case())
    monkeypatch.setattr(slicer, "_layers", wrong)
    for command in (["check", case], ["check", case, "--motion-in", "none.csv"], ["sweep", case, "--e1", "0"]):
        assert main(command) == 2
        out, err = capsys.readouterr()
        assert "feasible" not in out
        assert "layer 1: " in err
        assert f"[{code}]" in err
    assert main(["slice", case]) == 0


def test_travel_along_a_corners_normal_has_a_unit_tangent_across_it():
    body = RevolvedBody(((20.0, 0.0), (20.0, 30.0), (30.0, 30.0), (30.0, 60.0)))
    block = from_manifold(box_solid((10, -8, 12), (50, 8, 48)))
    targets = sample_targets([slice_sub_volume(block, body, SlicingParameters("revolved"))])
    assert np.allclose(np.linalg.norm(targets.tangent, axis=1), 1.0)
    assert np.allclose(np.linalg.norm(targets.normal, axis=1), 1.0)
    assert np.abs((targets.tangent * targets.normal).sum(axis=1)).max() < 1e-9
    corner = (np.abs(targets.tangent[:, 2] + 1) < 1e-9) & (np.abs(targets.position[:, 2] - 24.81) < 0.02)
    assert corner.any()  # down along the lower face, under the shoulder


@pytest.mark.parametrize(
    "surface",
    [
        Revolved((1.0, 2.0), ((20.0, 0.0), (20.0, 30.0), (30.0, 30.0), (30.0, 60.0))),
        Revolved((0.0, 0.0), ((20.0, 0.0), (30.0, 30.0), (12.0, 60.0))),
        Cone((0.0, 1.0), 20.0, 12.0),
    ],
)
def test_the_way_back_across_the_axis_meets_the_circle_at_that_height(surface):
    rng = np.random.default_rng(4)
    points = rng.uniform((-60, -60, 1), (60, 60, 59), (3000, 3))
    turn = rng.uniform(0, 2 * np.pi, len(points))
    normals = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    out = surface.distance(points) > 1e-6
    points, normals = points[out], normals[out]
    back = surface.ray_distance(points, normals)
    met = np.isfinite(back)
    assert 100 < met.sum() < 0.9 * len(points)
    assert np.abs(surface.distance(points[met] - back[met, None] * normals[met])).max() < 1e-9
    for share in np.linspace(0.0, 0.999, 50):  # nothing is met before
        assert (surface.distance(points[met] - share * back[met, None] * normals[met]) > 0).all()
    for far in np.linspace(0.0, 120.0, 200):  # nor ever, where nothing is met
        assert (surface.distance(points[~met] - far * normals[~met]) > -0.01).all()
