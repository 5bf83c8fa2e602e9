"""Uniform conical slicing, against analytic sections of cones."""

from __future__ import annotations

import json
import math

import manifold3d
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from support.parts.meshes import BODY, R, blade, box, box_solid, from_manifold, ring, rotated, sector, subdivided

from slicing.curves.intersect import intersect
from slicing.document import slices_document
from slicing.layers.layer import ConicalBody, CylindricalBody, RevolvedBody
from slicing.mesh.closest_point import closest_on_triangles
from slicing.mesh.solid import PartError, mesh_from_arrays
from slicing.paper.adhesion import area_near_body
from slicing.paper.indices import indices
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.surfaces import Cone, Cylinder, Plane
from slicing.targets.targets import sample_targets

AXIS = (0.0, 0.0)
CONICAL, PLANAR, ROUND = (SlicingParameters(s) for s in ("conical", "planar", "cylindrical"))
H = 1.73
ANGLES = [25.0, -25.0, 60.0]


def area(curves) -> float:
    return sum(c.area_mm2 for c in curves)


def slope(degrees: float) -> float:
    return math.tan(math.radians(degrees))


def box_on_cone(cone: Cone, half_width: float = 6.0, low: float = -8.0, high: float = 8.0) -> float:
    """Area of the section of a box along x by a cone about z."""

    def across(z):
        r = cone.radius + cone.slope * z
        return 2 * r * math.asin(half_width / r) * math.hypot(1.0, cone.slope)

    return quad(across, low, high)[0]


def off_mesh(mesh, points) -> float:
    triangles = mesh.vertices[mesh.faces]
    close = [closest_on_triangles(np.broadcast_to(p, (len(triangles), 3)), triangles) - p for p in points]
    return max(float(np.sqrt((c**2).sum(axis=1)).min()) for c in close)


def from_polyline(points: np.ndarray, loop: np.ndarray) -> float:
    """Greatest distance of points from a closed polyline."""
    along = np.roll(loop, -1, axis=0) - loop
    t = np.clip(((points[:, None] - loop) * along).sum(axis=2) / (along**2).sum(axis=1), 0, 1)
    return float(np.sqrt(((loop + t[..., None] * along - points[:, None]) ** 2).sum(axis=2)).min(axis=1).max())


@settings(max_examples=40, deadline=None)
@given(st.floats(-85, 85), st.floats(-30, 60), st.floats(0.01, 30), st.integers(0, 2**31))
def test_offsets_lie_along_the_normals(half, radius, by, seed):
    cone = Cone((3.0, -2.0), radius, half)
    points = np.random.default_rng(seed).uniform(-50, 50, (20, 3))
    foot = points - cone.distance(points)[:, None] * cone.normals(points)
    assert np.allclose(np.linalg.norm(cone.normals(points), axis=1), 1)
    r = np.hypot(foot[:, 0] - 3, foot[:, 1] + 2)
    kept = (r - radius - cone.slope * foot[:, 2]) * math.cos(math.radians(half))
    outward = np.hypot(points[:, 0] - 3, points[:, 1] + 2) > cone.distance(points) * math.cos(math.radians(half))
    assert np.abs(kept[outward]).max(initial=0.0) < 1e-9
    assert cone.offset(by).distance(points) == pytest.approx(cone.distance(points) - by, abs=1e-9)
    assert cone.offset(by).half_angle_deg == half


@settings(max_examples=30, deadline=None)
@given(st.sampled_from([-60.0, -5.0, 0.0, 1e-7, 12.0, 45.0, 80.0]), st.floats(0, 1.5), st.floats(-3, 3))
def test_unrolling_keeps_lengths(half, width, lean):
    cone = Cone((1.0, 2.0), 30.0, half)
    t = np.linspace(0, 1, 4001)
    z = lean * t
    r, angle = cone.radius + cone.slope * z, width * t - 0.7
    points = np.stack([1 + r * np.cos(angle), 2 + r * np.sin(angle), z], axis=1)
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    flat = np.linalg.norm(np.diff(cone.unrolled(points), axis=0), axis=1).sum()
    assert flat == pytest.approx(length, rel=1e-5, abs=1e-9)
    if half == 0.0:
        assert np.allclose(cone.unrolled(points), Cylinder((1.0, 2.0), 30.0).unrolled(points))


@pytest.mark.parametrize("half", ANGLES)
@pytest.mark.parametrize("finer", [0, 3])
def test_box_section_is_exact_however_fine_the_mesh(half, finer):
    cone = Cone(AXIS, 25.0, half)
    (curve,) = intersect(subdivided(box((2, -6, -8), (70, 6, 8)), finer), cone)
    assert curve.area_mm2 == pytest.approx(box_on_cone(cone), rel=1e-6)
    assert not curve.hole
    assert np.abs(cone.distance(curve.points)).max() < 1e-6


@pytest.mark.parametrize("half", ANGLES)
def test_frustum_sectors(half):
    mesh, cone = sector(0.6, 2.0, 60.0, -5.0, 5.0, n=3), Cone(AXIS, 20.0, half)
    (curve,) = intersect(mesh, cone, tolerance_mm=1e-4)
    low, high = 20 - 5 * cone.slope, 20 + 5 * cone.slope
    slant = 10 * math.hypot(1, cone.slope)
    assert curve.area_mm2 == pytest.approx(1.2 * 20 * slant, rel=1e-7)
    assert curve.length_mm == pytest.approx(1.2 * (low + high) + 2 * slant, rel=1e-5)
    flat = shapely.Polygon(cone.unrolled(curve.points))
    assert flat.area == pytest.approx(curve.area_mm2, rel=1e-4)


@pytest.mark.parametrize("half", ANGLES)
def test_ring_on_a_cone(half):
    cone = Cone(AXIS, 20.0, half)
    curves = intersect(ring(2.0, 60.0, -4.0, 7.0), cone)
    assert sorted(c.winding for c in curves) == [-1, 1]
    assert not any(c.hole for c in curves)
    middle = 20 + 1.5 * cone.slope
    assert area(curves) == pytest.approx(2 * np.pi * middle * 11 * math.hypot(1, cone.slope), rel=1e-6)


@pytest.mark.slow
def test_round_boss_square_to_a_cone_by_quadrature():
    half, b, n = 20.0, 6.0, 480
    cone = Cone(AXIS, 25.0, half)
    boss = manifold3d.Manifold.cylinder(60.0, b, b, n).rotate((0, 90.0 + half, 0)).translate((4, 0, 6))
    (curve,) = intersect(from_manifold(boss), cone)
    # the boss's axis runs along the normal in the plane y = 0: its region is one of (slant, angle)
    c, s = math.cos(math.radians(half)), math.sin(math.radians(half))
    foot = np.array([4.0, 6.0])  # (x, z) of a point of the boss's axis

    def inside(slant, angle):
        x, z = (25.0 + s * slant) * np.cos(angle), c * slant
        y = (25.0 + s * slant) * np.sin(angle)
        along = (x - foot[0]) * s + (z - foot[1]) * c  # across the boss's axis (c, -s) in xz
        return along**2 + y**2 <= b * b

    slants, angles = (np.arange(3000) + 0.5) / 3000 * 40 - 20, (np.arange(1500) + 0.5) / 1500 * 1.2 - 0.6
    grid = inside(slants[:, None], angles[None]) * (25.0 + s * slants[:, None])
    assert curve.area_mm2 == pytest.approx(grid.mean() * 40 * 1.2, rel=1e-3)
    assert shapely.Polygon(cone.unrolled(curve.points)).area == pytest.approx(curve.area_mm2, rel=2e-4)


def wedge(corners):
    corners = np.asarray(corners, dtype=float)
    points = np.concatenate([corners, corners * [1, 1, 0] - [0, 0, 60]])
    faces = [[0, 1, 2], [5, 4, 3], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]]
    return mesh_from_arrays("wedge", points, faces)


@pytest.mark.parametrize("half", [15.0, -15.0, 1e-3])
def test_slanted_triangle_holding_a_whole_ellipse(half):
    mesh, cone = wedge([[-90, -80, -30], [90, -80, 5], [0, 120, 40.0]]), Cone(AXIS, 17.0, half)
    curves = intersect(mesh, cone, tolerance_mm=1e-3)
    assert sorted(c.winding for c in curves) in ([-1, 1], [1])  # the lower end may lie below the apex
    for curve in curves:
        assert np.abs(cone.distance(curve.points)).max() < 1e-6
        assert off_mesh(mesh, curve.points[::7]) < 1e-9
    split = intersect(subdivided(mesh, 2), cone, tolerance_mm=1e-3)
    assert area(split) == pytest.approx(area(curves), rel=1e-6)


def test_planes_cut_cones_in_every_kind_of_conic():
    # walls leaning less than, as much as and more than the rulings, and one through the apex
    cone = Cone(AXIS, 20.0, 30.0)
    for lean in (0.0, slope(10.0), slope(30.0), slope(50.0)):
        for x in (5.0, 19.0, 20.0):
            points = [(x + lean * z, y, z) for z in (-12, 12) for y in (-9, 9)] + [
                (70, y, z) for z in (-12, 12) for y in (-9, 9)
            ]
            mesh = from_manifold(manifold3d.Manifold.hull_points(points))
            coarse, fine = intersect(mesh, cone, 0.02), intersect(subdivided(mesh, 3), cone, 1e-4)
            assert area(coarse) == pytest.approx(area(fine), rel=1e-5)
            assert len(coarse) == len(fine)
            for a in coarse:
                assert off_mesh(mesh, a.points) < 1e-6
                near = min(fine, key=lambda b: np.abs(b.points.mean(axis=0) - a.points.mean(axis=0)).max())
                assert from_polyline(near.points, a.points) <= 0.02


def test_a_cone_ends_at_its_apex():
    cone = Cone(AXIS, 0.0, 30.0)  # apex at the origin, widening upwards
    (curve,) = intersect(box((-40, -40, -10), (40, 40, 10)), cone)
    assert curve.winding == -1
    rim = 10 * slope(30.0)
    assert curve.area_mm2 == pytest.approx(np.pi * rim * math.hypot(rim, 10), rel=1e-6)
    (turned,) = intersect(box((-40, -40, -10), (40, 40, 10)), Cone(AXIS, 0.0, -30.0))
    assert turned.area_mm2 == pytest.approx(curve.area_mm2, rel=1e-6)
    assert intersect(box((-5, -5, -30), (5, 5, -20)), cone) == []


def test_holes_run_clockwise_and_are_left_out():
    tube = from_manifold(box_solid((2, -6, -8), (60, 6, 8)) - box_solid((0, -2, -3), (90, 2, 3)))
    cone = Cone(AXIS, 25.0, 20.0)
    curves = intersect(tube, cone)
    assert [c.hole for c in sorted(curves, key=lambda c: c.area_mm2)] == [True, False]
    assert area(curves) == pytest.approx(box_on_cone(cone) - box_on_cone(cone, 2, -3, 3), rel=1e-6)


@settings(max_examples=15, deadline=None)
@given(st.floats(-3.2, 3.2), st.floats(-40, 40))
def test_turning_the_solid_turns_the_curves(angle, half):
    cone = Cone(AXIS, 32.0, half)
    still, turned = (intersect(mesh, cone) for mesh in (blade(8, 8), rotated(blade(8, 8), angle)))
    assert len(still) == len(turned)
    assert area(turned) == pytest.approx(area(still), rel=1e-5)


def test_layers_are_the_offsets_of_the_cone_h_layer_thick():
    body = ConicalBody(20.0, 20.0)
    sliced = slice_sub_volume(box(), body, CONICAL)
    assert sliced.warnings == ()
    for k, layer in enumerate(sliced.layers):
        assert layer.surface == body.surface.offset(k * H)
        assert layer.thickness_mm == pytest.approx((H, H), abs=1e-9)
        points = np.concatenate([c.points for c in layer.curves])
        assert np.abs(layer.surface.distance(points)).max() < 1e-6
        if k:
            back = sliced.layers[k - 1].surface.ray_distance(points, layer.surface.normals(points))
            assert np.abs(back - H).max() < 1e-6
        if layer.surface.radius + 8 * layer.surface.slope < 39:
            assert layer.area_mm2 == pytest.approx(box_on_cone(layer.surface), rel=1e-6)
    far = body.surface.distance(box().vertices).max()
    assert len(sliced.layers) == 1 + math.floor(far / H)


def test_half_angle_0_is_the_cylinder():
    for mesh in (box(), blade(10, 10), sector(1.1, 20, 40, -5, 5), ring(19.9, 32.0, -4.0, 7.0)):
        a, b = slice_sub_volume(mesh, ConicalBody(R, 0.0), CONICAL), slice_sub_volume(mesh, BODY, ROUND)
        assert len(a.layers) == len(b.layers)
        for p, q in zip(a.layers, b.layers, strict=True):
            assert len(p.curves) == len(q.curves)
            assert p.area_mm2 == pytest.approx(q.area_mm2, rel=1e-7)
            assert p.thickness_mm == pytest.approx(q.thickness_mm, abs=1e-6)
        assert indices(a, 7).A_mm2 == pytest.approx(indices(b, 7).A_mm2, rel=1e-7)
        assert indices(a, 7).R_rad == pytest.approx(indices(b, 7).R_rad, abs=2e-3)


def test_targets_indices_and_document_of_a_conical_stack():
    body = ConicalBody(22.0, -15.0, (1.0, 2.0))
    sliced = slice_sub_volume(box(), body, CONICAL)
    targets = sample_targets([sliced])
    c, s = math.cos(math.radians(-15)), math.sin(math.radians(-15))
    radial = targets.position[:, :2] - [1.0, 2.0]
    radial /= np.linalg.norm(radial, axis=1)[:, None]
    assert np.allclose(targets.normal, np.column_stack([c * radial, np.full(len(radial), -s)]))
    assert np.abs((targets.normal * targets.tangent).sum(axis=1)).max() < 1e-9
    assert targets.thickness_mm == pytest.approx(np.full(len(targets), H), abs=1e-9)
    found = indices(sliced, targets)
    assert found.A_mm2 == pytest.approx(sliced.layers[0].area_mm2)  # the footprint
    written = json.loads(json.dumps(slices_document([sliced], [found])))["sub_volumes"][0]
    assert written["strategy"] == "conical"
    surface = written["layers"][2]["surface"]
    assert surface.pop("radius") == pytest.approx(22 + 2 * H / c)
    assert surface == {"kind": "cone", "axis_point": [1.0, 2.0], "half_angle_deg": -15.0}


def test_planes_on_a_cone_stop_where_the_body_begins():
    body = ConicalBody(20.0, 20.0)
    sliced = slice_sub_volume(box((5, -6, -8), (40, 6, 8)), body, PLANAR)
    k = slope(20.0)
    for layer in sliced.layers[::3]:
        assert isinstance(layer.surface, Plane)
        x = layer.surface.point[0]

        def outside(z, within=0.0, x=x):
            return 12 - 2 * min(math.sqrt(max((20 + within + k * z) ** 2 - x * x, 0.0)), 6.0)

        exact = quad(outside, -8, 8, limit=400)[0]
        assert layer.area_mm2 == pytest.approx(exact, abs=0.03)
        near = 0.5 * H / math.cos(math.radians(20.0))
        exact -= quad(lambda z: outside(z, near), -8, 8, limit=400)[0]  # noqa: B023
        assert area_near_body(layer, body, 0.5 * H) == pytest.approx(exact, abs=0.05)
        for curve in layer.curves:
            assert body.surface.distance(curve.points).min() > -0.02


@pytest.mark.parametrize("gap", [0.02, 0.09])
def test_a_root_a_little_off_the_cone_still_stands_on_it(gap):
    k = slope(20.0)
    lift = gap / math.cos(math.radians(20.0))
    points = [((20 + lift + k * z + deep) * np.cos(t), (20 + lift + k * z + deep) * np.sin(t), z)
              for z in (-5, 5) for deep in (0, 12) for t in (-0.005, 0.005)]  # fmt: skip
    sliced = slice_sub_volume(from_manifold(manifold3d.Manifold.hull_points(points)), ConicalBody(20.0, 20.0), CONICAL)
    assert any("off the body" in line for line in sliced.warnings)


@pytest.mark.parametrize(
    ("make", "key"),
    [
        (lambda: ConicalBody(20.0, 90.0), "half_angle_deg: 90"),
        (lambda: ConicalBody(20.0, -90.0), "half_angle_deg"),
        (lambda: ConicalBody(20.0, math.nan), "half_angle_deg"),
        (lambda: ConicalBody(math.inf, 10.0), "radius_mm"),
        (lambda: ConicalBody(-1.0, 0.0), "radius_mm"),
        (lambda: ConicalBody(20.0, 10.0, (0.0, math.nan)), "axis_xy_mm"),
    ],
)
def test_cones_that_make_no_sense_are_refused(make, key):
    with pytest.raises(PartError, match=key) as refused:
        make()
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("strategy", "body"),
    [
        ("conical", BODY),
        ("revolved", BODY),
        ("cylindrical", ConicalBody(20.0, 10.0)),
        ("nonuniform", ConicalBody(20.0, 10.0)),
        ("revolved", ConicalBody(20.0, 10.0)),
        ("conical", RevolvedBody(((20.0, 0.0), (22.0, 9.0)))),
        ("nonuniform", RevolvedBody(((20.0, 0.0), (22.0, 9.0)))),
    ],
)
def test_strategies_that_do_not_fit_the_body_are_refused(strategy, body):
    with pytest.raises(PartError, match=f"strategy: {strategy} needs a .* allowed on it: planar") as refused:
        slice_sub_volume(box(), body, SlicingParameters(strategy))
    assert "\n" not in str(refused.value)


def test_sub_volumes_off_or_in_the_cone_are_refused():
    body = ConicalBody(20.0, 20.0)
    gap = body.surface.distance(np.array([[35.0, 0, 8.0]]))[0]
    with pytest.raises(PartError, match=rf"gap is {gap:.3f} mm"):
        slice_sub_volume(box((35, -6, -8), (50, 6, 8)), body, CONICAL)
    with pytest.raises(PartError, match="wholly inside"):
        slice_sub_volume(box((2, -6, -8), (10, 6, 8)), body, CONICAL)
    with pytest.raises(PartError, match=r"unknown; allowed: .*conical, revolved"):
        SlicingParameters("spiral")
    assert CylindricalBody(20.0).kind == "cylinder"
