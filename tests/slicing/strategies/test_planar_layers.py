"""Planar layers: where the planes stand, which of them count, and beads that thin out."""

from __future__ import annotations

import math

import manifold3d
import numpy as np
import pytest
from support.layers.three_strategies import MIXED, PLANAR, ROUND, H
from support.parts.meshes import (
    BODY,
    R,
    blade,
    box,
    from_manifold,
    prism,
    rotated,
)

from slicing.curves.intersect import Curve
from slicing.layers.layer import CylindricalBody
from slicing.paper.adhesion import area_near_body
from slicing.parameters import SlicingParameters
from slicing.strategies.cylindrical import span
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.bodies import RevolvedBody
from slicing.surfaces.surfaces import Plane
from slicing.warning import WRONG_LAYER


def test_planes_stand_across_the_build_direction_from_the_lowest_point_of_the_root():
    mesh = rotated(box((10, -15, -8), (40, 15, 8)), 0.7)
    sliced = slice_sub_volume(mesh, BODY, PLANAR)
    direction = np.array([np.cos(0.7), np.sin(0.7), 0.0])
    lowest = math.sqrt(R**2 - 15**2)
    for i, layer in enumerate(sliced.layers):
        assert isinstance(layer.surface, Plane)
        assert np.allclose(layer.surface.normal, direction, atol=1e-6)
        height = lowest + (i + 1) * H
        assert np.dot(layer.surface.point, direction) == pytest.approx(height, abs=1e-5)
        inside = 2 * math.sqrt(max(R**2 - height**2, 0.0))  # this much of the width lies in the body
        assert layer.area_mm2 == pytest.approx((30 - inside) * 16, rel=1e-5)
        assert len(layer.curves) == (2 if inside else 1)
        for curve in layer.curves:
            assert BODY.surface.distance(curve.points).min() > -1e-6
    assert len(sliced.layers) == math.floor((40 - lowest) / H)


def test_planar_root_cap_and_root_inside_the_body_are_the_same():
    # the cap cut by the body itself, or the block left reaching into it
    cut = prism(
        [(20 * np.cos(a), 20 * np.sin(a)) for a in np.linspace(0.5, -0.5, 41)] + [(40, -9.6), (40, 9.6)],
        -5,
        5,
    )
    deep = prism(
        [
            (5, 0),
            (20 * np.cos(0.5), -20 * np.sin(0.5)),
            (40, -9.6),
            (40, 9.6),
            (20 * np.cos(0.5), 20 * np.sin(0.5)),
        ],
        -5,
        5,
    )
    for parameters in (PLANAR, ROUND, MIXED):
        a, b = slice_sub_volume(cut, BODY, parameters), slice_sub_volume(deep, BODY, parameters)
        assert [la.area_mm2 for la in a.layers] == pytest.approx([la.area_mm2 for la in b.layers], rel=1e-5)
        assert a.layers[0].thickness_mm == pytest.approx(b.layers[0].thickness_mm, abs=1e-4)


def test_planar_beads_thin_out_towards_the_body_and_are_named():
    sliced = slice_sub_volume(box((10, -15, -8), (40, 15, 8)), BODY, PLANAR)
    first = sliced.layers[0]
    assert first.thickness_mm[0] == pytest.approx(0.0, abs=1e-5)
    assert first.thickness_mm[1] == pytest.approx(H, abs=1e-5)
    thin = [layer.index for layer in sliced.layers if layer.thickness_mm[0] < 1.39 - 1e-6]
    named = [line for line in sliced.warnings if "thinner than h_min" in line]
    assert len(named) == len(thin)
    assert all(f"layer {k}:" in line for k, line in zip(thin, named, strict=True))


def test_adhesion_of_a_planar_stack_by_sampling():
    sliced = slice_sub_volume(blade(), BODY, PLANAR)
    rng = np.random.default_rng(1)
    for layer in sliced.layers[:2]:
        import shapely

        loops = [layer.surface.unrolled(c.points) for c in layer.curves]
        region = shapely.union_all([shapely.Polygon(p) for p in loops])
        low_u, low_v, high_u, high_v = region.bounds
        at = rng.uniform([low_u, low_v], [high_u, high_v], size=(200_000, 2))
        u, v = layer.surface.axes()
        points = np.asarray(layer.surface.point) + at[:, :1] * u + at[:, 1:] * v
        near = np.abs(BODY.surface.distance(points)) <= 0.5 * H
        hit = near & shapely.contains_xy(region, at[:, 0], at[:, 1])
        sampled = hit.mean() * (high_u - low_u) * (high_v - low_v)
        assert area_near_body(layer, BODY, 0.5 * H) == pytest.approx(sampled, rel=0.05, abs=0.3)


@pytest.mark.parametrize("over_mm", [-1e-6, 0.0, 1e-6, 4e-4, 9e-3])
@pytest.mark.parametrize("strategy", ["cylindrical", "nonuniform", "revolved"])
def test_a_layer_that_only_grazes_the_top_is_none(strategy: str, over_mm: float) -> None:
    """Edges or a round top that end as far out as the fourth layer begins, give or take less than the tolerance."""
    top = 20.0 + 3 * 1.73 + over_mm
    edges = box((10.0, -6.0, -9.0), (math.sqrt(top**2 - 36.0), 6.0, 9.0))  # farthest out along two of its edges
    block = manifold3d.Manifold.cube((30.0, 12.0, 18.0)).translate((10.0, -6.0, -9.0))
    rounded = block ^ manifold3d.Manifold.cylinder(40.0, top, top, 500, True)
    body = RevolvedBody(((20.0, -30.0), (20.0, 30.0))) if strategy == "revolved" else CylindricalBody(20.0)
    for mesh in (edges, from_manifold(rounded)):
        sliced = slice_sub_volume(mesh, body, SlicingParameters(strategy, 1.73))
        if strategy != "nonuniform":
            assert len(sliced.layers) == 3
        assert sliced.layers[-1].surface.distance(mesh.vertices).max() > 0.01
        assert [line for line in sliced.warnings if getattr(line, "code", None) in WRONG_LAYER] == []
        assert min(layer.area_mm2 for layer in sliced.layers) > 100.0


def test_a_plane_at_the_top_of_a_block_is_its_last_layer() -> None:
    """Planes are the tops of their layers: the last one is there though nothing is above it."""
    block = box((10.0, -6.0, -9.0), (math.sqrt(400 - 36) + 4 * 1.73 + 1e-4, 6.0, 9.0))
    sliced = slice_sub_volume(block, CylindricalBody(20.0), SlicingParameters("planar", 1.73))
    assert len(sliced.layers) == 4
    assert sliced.layers[-1].area_mm2 == pytest.approx(12 * 18, rel=1e-6)


def test_a_sub_volume_lower_than_a_layer_has_the_one_on_the_body() -> None:
    for strategy in ("cylindrical", "nonuniform"):
        low = box((10.0, -6.0, -9.0), (20.5, 6.0, 9.0))
        assert len(slice_sub_volume(low, CylindricalBody(20.0), SlicingParameters(strategy, 1.73)).layers) == 1


def test_a_plane_that_only_grazes_a_ridge_is_no_layer() -> None:
    ridge = math.sqrt(400 - 36) + 5 * 1.73 + 1e-3  # a roof of 45 degrees, 2 um wide in the fifth plane
    corners = [[x, y, z] for z in (-9.0, 9.0) for x, y in ((10.0, -6.0), (10.0, 6.0), (ridge, 0.0))]
    corners += [[ridge - 6.0, y, z] for z in (-9.0, 9.0) for y in (-6.0, 6.0)]
    sliced = slice_sub_volume(from_manifold(manifold3d.Manifold.hull_points(corners)), CylindricalBody(20.0), PLANAR)
    assert len(sliced.layers) == 4
    assert [line for line in sliced.warnings if getattr(line, "code", None) in WRONG_LAYER] == []


@pytest.mark.parametrize("first", [0.0, 0.2])
def test_of_equal_gaps_rounding_does_not_choose_the_build_direction(first: float) -> None:
    """Nine feet all round: which gap is the widest by the eighth digit is no reason to turn the planes."""
    rng = np.random.default_rng(5)
    found = set()
    for _ in range(20):
        feet = []
        for k in range(9):
            begin = first + k * 2 * math.pi / 9 + rng.uniform(-1e-8, 1e-8)
            angle = np.linspace(begin, begin + 0.1, 5)
            points = np.column_stack([20 * np.cos(angle), 20 * np.sin(angle), 0 * angle])
            feet.append(Curve(points, False, False, 1.0))
        middle, width = span(feet, (0.0, 0.0))
        found.add(round(middle, 4))
        assert width == pytest.approx(2 * math.pi - (2 * math.pi / 9 - 0.1), abs=1e-5)
    assert len(found) == 1
