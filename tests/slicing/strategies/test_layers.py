"""Layers by the three strategies: surfaces, areas, thicknesses, warnings, refusals."""

from __future__ import annotations

import math
from itertools import pairwise

import manifold3d
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from support.parts.meshes import (
    BODY,
    R,
    blade,
    box,
    box_section,
    box_solid,
    from_manifold,
    prism,
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
from slicing.surfaces.bodies import RevolvedBody
from slicing.surfaces.surfaces import Cylinder, Plane
from slicing.warning import WRONG_LAYER

PLANAR, ROUND, MIXED = (SlicingParameters(s) for s in ("planar", "cylindrical", "nonuniform"))
H = 1.73


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


@settings(max_examples=12, deadline=None)
@given(st.floats(-3.1, 3.1), st.sampled_from([PLANAR, ROUND, MIXED]))
def test_turning_the_part_turns_the_layers(angle, parameters):
    still = slice_sub_volume(blade(8, 8), BODY, parameters)
    turned = slice_sub_volume(rotated(blade(8, 8), angle), BODY, parameters)
    assert [la.area_mm2 for la in turned.layers] == pytest.approx([la.area_mm2 for la in still.layers], rel=1e-4)


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
    from slicing.curves.intersect import Curve

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


@pytest.mark.parametrize("over_mm", [-1e-6, 0.0, 1e-6, 4e-4, 9e-3])
@pytest.mark.parametrize("strategy", ["cylindrical", "nonuniform", "revolved"])
def test_a_layer_that_only_grazes_the_top_is_none(strategy: str, over_mm: float) -> None:
    """Edges or a round top that end as far out as the fourth layer begins, give or take less than the tolerance."""
    top = 20.0 + 3 * 1.73 + over_mm
    edges = box((10.0, -6.0, -9.0), (math.sqrt(top**2 - 36.0), 6.0, 9.0))  # farthest out along two of its edges
    block = manifold3d.Manifold.cube((30.0, 12.0, 18.0)).translate((10.0, -6.0, -9.0))
    rounded = block ^ manifold3d.Manifold.cylinder(40.0, top, top, 2000, True)
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
