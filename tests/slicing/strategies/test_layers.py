"""Layers by the three strategies: surfaces, areas, thicknesses, warnings, refusals."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise

import manifold3d
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.layers.three_strategies import MIXED, PLANAR, ROUND, H
from support.parts.meshes import (
    BODY,
    R,
    blade,
    box,
    box_section,
    box_solid,
    from_manifold,
    ring,
    rotated,
    sector,
    subdivided,
)

from slicing.curves.intersect import Curve
from slicing.decomposition.decompose import decompose
from slicing.layers.layer import CylindricalBody
from slicing.layers.thickness import resampled
from slicing.mesh.solid import PartError
from slicing.paper.adhesion import area_near_body
from slicing.parameters import SlicingParameters
from slicing.strategies.cylindrical import span
from slicing.strategies.nonuniform import flattened
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.surfaces import Cylinder, Plane


def test_uniform_layers_are_the_offsets_of_the_body():
    sliced = slice_sub_volume(box(), BODY, ROUND)
    top = math.hypot(40, 6)
    assert len(sliced.layers) == 1 + math.floor((top - R) / H)
    for i, layer in enumerate(sliced.layers):
        assert layer.index == i
        assert layer.surface == Cylinder((0.0, 0.0), R + i * H)
        if layer.surface.radius < 40:
            assert layer.area_mm2 == pytest.approx(box_section(12, 16, layer.surface.radius), rel=1e-7)
        assert layer.thickness_mm == pytest.approx((H, H), abs=1e-6)
    assert sliced.warnings == ()


def test_body_off_the_axis_moves_the_layers_with_it():
    mesh = box((110.0, 194.0, -8.0), (140.0, 206.0, 8.0))
    moved = slice_sub_volume(mesh, CylindricalBody(R, (100.0, 200.0)), MIXED)
    plain = slice_sub_volume(box(), BODY, MIXED)
    assert [la.area_mm2 for la in moved.layers] == pytest.approx([la.area_mm2 for la in plain.layers], rel=1e-6)


@pytest.mark.parametrize("parameters", [PLANAR, ROUND, MIXED])
def test_a_fine_mesh_gives_the_layers_of_a_coarse_one(parameters):
    coarse = slice_sub_volume(box(), BODY, parameters)
    fine = slice_sub_volume(subdivided(box(), 5), BODY, parameters)
    assert len(coarse.layers) == len(fine.layers)
    for a, b in zip(coarse.layers, fine.layers, strict=True):
        assert len(a.curves) == len(b.curves)
        assert b.area_mm2 == pytest.approx(a.area_mm2, rel=1e-6)
        assert b.thickness_mm == pytest.approx(a.thickness_mm, abs=1e-3)


@cache
def still_blade(parameters):
    return slice_sub_volume(blade(8, 8), BODY, parameters)


@settings(max_examples=8, deadline=None)
@given(st.floats(-3.1, 3.1), st.sampled_from([PLANAR, ROUND, MIXED]))
def test_turning_the_part_turns_the_layers(angle, parameters):
    still = still_blade(parameters)
    turned = slice_sub_volume(rotated(blade(8, 8), angle), BODY, parameters)
    assert [la.area_mm2 for la in turned.layers] == pytest.approx([la.area_mm2 for la in still.layers], rel=1e-4)


def test_thickness_is_the_distance_down_to_the_layer_below():
    sliced = slice_sub_volume(blade(), BODY, MIXED)
    for below, layer in pairwise(sliced.layers):
        points = np.concatenate([c.points for c in layer.curves])
        thickness = sliced.thickness_at(layer.index, points)
        foot = points - thickness[:, None] * layer.surface.normals(points)
        assert np.abs(below.surface.distance(foot)).max() < 1e-9
        assert layer.thickness_mm[0] <= thickness.min() + 1e-12
        assert layer.thickness_mm[1] >= thickness.max() - 1e-12
        between = np.concatenate([resampled(c.points, layer.surface, 0.05) for c in layer.curves])
        spread = sliced.thickness_at(layer.index, between)
        assert layer.thickness_mm == pytest.approx((spread.min(), spread.max()), abs=1e-2)


def test_ray_that_misses_a_cylinder_is_infinite():
    points, normals = np.array([[30.0, 25, 0], [30.0, 5, 0]]), np.array([[1.0, 0, 0], [1.0, 0, 0]])
    away = Cylinder((0.0, 0.0), 20.0).ray_distance(points, normals)
    assert away[0] == np.inf
    assert away[1] == pytest.approx(30 - math.sqrt(400 - 25))


def test_equal_limits_reduce_to_uniform_cylinders():
    same = SlicingParameters("nonuniform", h_layer_mm=H, h_min_mm=H, h_max_mm=H)
    for mesh in (box(), blade(8, 8), sector(1.1, 20, 40, -5, 5)):
        a, b = slice_sub_volume(mesh, BODY, same), slice_sub_volume(mesh, BODY, ROUND)
        assert len(a.layers) == len(b.layers)
        for p, q in zip(a.layers, b.layers, strict=True):
            assert p.surface.kind == "cylinder"
            assert p.surface.axis_point == q.surface.axis_point
            assert p.surface.radius == pytest.approx(q.surface.radius, abs=1e-12)
            assert p.area_mm2 == pytest.approx(q.area_mm2, rel=1e-9)


def test_layers_flatten_one_after_the_other_and_end_as_planes():
    sliced = slice_sub_volume(box((10, -9, -8), (60, 9, 8)), BODY, MIXED)
    kinds = [layer.surface.kind for layer in sliced.layers]
    planes = kinds.count("plane")
    assert planes > 10
    assert kinds == ["cylinder"] * (len(kinds) - planes) + ["plane"] * planes
    radii = [layer.surface.radius for layer in sliced.layers[: len(kinds) - planes]]
    assert all(b > a + MIXED.h_layer_mm for a, b in pairwise(radii[1:]))
    for layer in sliced.layers[1:]:
        assert layer.thickness_mm[0] >= 1.39 - 1e-6
        assert layer.thickness_mm[1] <= 2.2 + 1e-6
    heights = [layer.surface.point[0] for layer in sliced.layers if layer.surface.kind == "plane"]
    assert np.allclose(np.diff(heights), H)


@settings(max_examples=80, deadline=None)
@given(
    st.floats(5, 1e4),
    st.floats(0.02, 1.5),
    st.floats(-3, 3),
    st.floats(0.1, 1.0),
    st.tuples(st.floats(-50, 50), st.floats(-50, 50)),
)
def test_flattened_surface_passes_the_three_points(radius, half, middle, share, axis):
    h = 1.73
    previous = Cylinder(axis, radius)
    surface = flattened(previous, h, middle, half, share * h)
    ends = np.array(
        [
            [
                axis[0] + (radius + h) * np.cos(middle + s * half),
                axis[1] + (radius + h) * np.sin(middle + s * half),
                0,
            ]
            for s in (1, -1)
        ]
    )
    chord = (radius + h) * math.cos(half) - radius
    top = max(chord, share * h)
    p2 = np.array([[axis[0] + (radius + top) * np.cos(middle), axis[1] + (radius + top) * np.sin(middle), 0]])
    assert np.abs(surface.distance(p2)).max() < 1e-6
    nearly_flat = 2e-6 * (radius * half) ** 2  # what the flat limit may leave at the ends
    assert np.abs(surface.distance(ends)).max() < 1e-6 + nearly_flat
    outward = surface.normals(p2)[0]
    assert outward[:2] @ [np.cos(middle), np.sin(middle)] == pytest.approx(1.0, abs=1e-6)
    if chord >= share * h:
        assert isinstance(surface, Plane)


def test_middle_is_h_min_and_ends_are_h_layer():
    sliced = slice_sub_volume(sector(1.0, 20, 60, -5, 5, n=40), BODY, MIXED)
    layer = sliced.layers[1]
    assert isinstance(layer.surface, Cylinder)
    middle = np.array([[layer.surface.axis_point[0] + layer.surface.radius, layer.surface.axis_point[1], 0.0]])
    assert sliced.thickness_at(1, middle)[0] == pytest.approx(1.39, abs=1e-6)
    ends = np.array([[(R + H) * np.cos(1.0), (R + H) * np.sin(1.0), 0.0]])
    assert layer.surface.distance(ends)[0] == pytest.approx(0, abs=1e-5)
    assert BODY.surface.distance(ends)[0] == pytest.approx(H)


def test_h_max_holds_a_widening_sub_volume_back():
    # wings that hang beside the stem: out of the offset's reach, within that of the flattened surface
    wings = [box_solid((18.3, 12, -5), (30, 19, 5)), box_solid((18.3, -19, -5), (30, -12, 5))]
    wide = from_manifold(
        box_solid((10, -5, -5), (30, 5, 5)) + box_solid((26, -19, -5), (30, 19, 5)) + wings[0] + wings[1]
    )
    limits = (50.0, 2.2, 1.75)
    stacks = [slice_sub_volume(wide, BODY, SlicingParameters("nonuniform", h_max_mm=m)) for m in limits]
    for sliced, limit in zip(stacks, limits, strict=True):
        for layer in sliced.layers[1:]:
            assert layer.thickness_mm[1] <= limit + 1e-6
    assert stacks[0].layers[1].thickness_mm[1] > 2.2
    first = [sliced.layers[1].surface for sliced in stacks]
    assert first[0] != first[1]
    assert isinstance(first[1], Cylinder)
    assert first[1].radius > R + H + 1e-3  # as flat as h_max allows, not given up


@pytest.mark.parametrize("half", [1.5705, 1.6, 2.5, 3.1])
def test_half_a_turn_and_more_stays_cylindrical(half):
    mesh = sector(half, 20, 30, -5, 5, n=60)
    a, b = slice_sub_volume(mesh, BODY, MIXED), slice_sub_volume(mesh, BODY, ROUND)
    assert [la.surface for la in a.layers] == pytest.approx([la.surface for la in b.layers]) or all(
        abs(p.surface.radius - q.surface.radius) < 1e-9 for p, q in zip(a.layers, b.layers, strict=True)
    )


def test_ring_layers_are_the_area_between_their_two_loops():
    for parameters in (ROUND, MIXED):
        sliced = slice_sub_volume(ring(19.9, 32.0, -4.0, 7.0, n=90), BODY, parameters)
        for layer in sliced.layers[:-1]:
            assert sorted(c.winding for c in layer.curves) == [-1, 1]
            assert layer.area_mm2 == pytest.approx(2 * np.pi * layer.surface.radius * 11, rel=1e-6)
    with pytest.raises(PartError, match="right round the body"):
        slice_sub_volume(ring(19.9, 32.0, -4.0, 7.0), BODY, PLANAR)


def test_arc_spans_all_loops_of_a_fork():
    fork = from_manifold(
        box_solid((10, -9, -4), (22, 9, 4)) + box_solid((20, -9, -4), (45, -5, 4)) + box_solid((20, 5, -4), (45, 9, 4))
    )
    sliced = slice_sub_volume(fork, BODY, MIXED)
    assert {len(layer.curves) for layer in sliced.layers} == {1, 2}
    assert sliced.layers[-1].surface.kind == "plane"
    for layer in sliced.layers[1:]:
        assert 1.39 - 1e-6 <= layer.thickness_mm[0] <= layer.thickness_mm[1] <= 2.2
    middle, width = span(list(slice_sub_volume(fork, BODY, ROUND).layers[5].curves), (0.0, 0.0))
    assert middle == pytest.approx(0.0, abs=1e-9)
    assert width == pytest.approx(2 * math.asin(9 / (R + 5 * H)))


def test_holes_are_left_out_of_the_area():
    tube = from_manifold(box_solid((10, -6, -8), (40, 6, 8)) - box_solid((0, -2, -3), (50, 2, 3)))
    for parameters in (PLANAR, MIXED):
        layer = slice_sub_volume(tube, BODY, parameters).layers[6]
        assert [c.hole for c in layer.curves].count(True) == 1
        assert layer.area_mm2 == pytest.approx(12 * 16 - 4 * 6, rel=0.01)


@settings(max_examples=60, deadline=None)
@example([(0.0, 0.25), (-1e-214, 1.0)])
@given(st.lists(st.tuples(st.floats(-3.1, 3.1), st.floats(0.05, 1.2)), min_size=1, max_size=4))
def test_span_covers_all_loops_and_no_more_than_it_must(arcs):

    curves = []
    for start, width in arcs:
        t = start + width * np.concatenate([np.linspace(0, 1, 9), np.linspace(1, 0, 9)])
        points = np.stack([10 * np.cos(t), 10 * np.sin(t), np.repeat([0.0, 1.0], 9)], axis=1)
        curves.append(Curve(points, True, False))
    middle, width = span(curves, (0.0, 0.0))
    free = np.ones(20000, dtype=bool)
    grid = np.arange(20000) / 20000 * 2 * np.pi
    for start, wide in arcs:
        free &= (grid - start) % (2 * np.pi) > wide
        assert abs((start + 0.5 * wide - middle + np.pi) % (2 * np.pi) - np.pi) <= 0.5 * width + 1e-6
    runs = np.diff(np.flatnonzero(~np.concatenate([free, free])), prepend=0).max() * 2 * np.pi / 20000
    assert width == pytest.approx(2 * np.pi - runs, abs=2e-3)


def test_adhesion_on_a_shifted_cylinder_by_quadrature():
    fat = SlicingParameters("nonuniform", h_layer_mm=1.0, h_min_mm=0.2, h_max_mm=2.0)
    sliced = slice_sub_volume(box((10, -12, -8), (40, 12, 8)), BODY, fat)
    layer = sliced.layers[1]
    assert isinstance(layer.surface, Cylinder)
    t = (np.arange(200_000) + 0.5) / 200_000 * 0.8 - 0.4
    (cx, cy), r = layer.surface.axis_point, layer.surface.radius
    x, y = cx + r * np.cos(t), cy + r * np.sin(t)
    inside = (np.hypot(x, y) - R <= 0.5) & (np.abs(y) <= 12) & (x > 0)
    assert area_near_body(layer, BODY, 0.5) == pytest.approx(inside.mean() * 0.8 * r * 16, rel=1e-3)
    assert 0 < area_near_body(layer, BODY, 0.5) < layer.area_mm2


@pytest.mark.parametrize("parameters", [PLANAR, ROUND, MIXED])
def test_sub_volumes_off_or_in_the_body_are_refused(parameters):
    with pytest.raises(PartError, match=r"gap is 5\.000 mm"):
        slice_sub_volume(box((25, -6, -8), (40, 6, 8)), BODY, parameters)
    with pytest.raises(PartError, match="wholly inside"):
        slice_sub_volume(box((2, -6, -8), (10, 6, 8)), BODY, parameters)
    with pytest.raises(PartError, match="wholly inside"):
        slice_sub_volume(sector(0.5, 10, 20, -5, 5), BODY, parameters)


def test_walls_that_lean_over_the_root_are_none_of_its_cap():
    hub = manifold3d.Manifold.cylinder(60, R, R, 48)
    ball = manifold3d.Manifold.sphere(15, 24).translate((30, 0, 30))  # below its middle it leans out over the hub
    parts = decompose(from_manifold(hub + ball))
    sliced = slice_sub_volume(parts.sub_volumes[0], parts.bodies[0], SlicingParameters("cylindrical"))
    assert not any("off the body" in line for line in sliced.warnings)


@pytest.mark.parametrize("gap", [0.02, 0.09])
def test_a_root_a_little_off_the_body_still_stands_on_it(gap):
    sliced = slice_sub_volume(sector(0.5, 20 + gap, 40, -5, 5, n=60), BODY, ROUND)
    assert sliced.layers[0].area_mm2 == pytest.approx(20 * 10, rel=0.01)
    assert any("off the body" in line for line in sliced.warnings)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"strategy": "spiral"}, "strategy"),
        ({"h_layer_mm": 0.0}, "h_layer_mm"),
        ({"h_min_mm": -1.0}, "h_min_mm"),
        ({"h_min_mm": 1.8}, "h_layer_mm"),
        ({"h_max_mm": 1.0}, "h_layer_mm"),
        ({"h_max_mm": math.nan}, "h_max_mm"),
        ({"tolerance_mm": 0.0}, "tolerance_mm"),
    ],
)
def test_parameters_that_make_no_sense_are_refused(change, key):
    with pytest.raises(PartError, match=key):
        SlicingParameters(**change)


def test_bodies_that_make_no_sense_are_refused():
    with pytest.raises(PartError, match="radius_mm"):
        CylindricalBody(0.0)
    with pytest.raises(PartError, match="axis_xy_mm"):
        CylindricalBody(1.0, (math.inf, 0.0))
