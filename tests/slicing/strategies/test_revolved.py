"""Uniform slicing of bodies of revolution by the true offsets of their profiles."""

from __future__ import annotations

import json
import math
from itertools import pairwise

import manifold3d
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.spatial import ConvexHull
from support.parts.meshes import BODY, R, blade, box, box_solid, from_manifold, ring, rotated, sector, subdivided

from slicing.curves.intersect import intersect
from slicing.curves.slabs import ProfileSlabs
from slicing.document import slices_document
from slicing.layers.layer import ConicalBody, RevolvedBody
from slicing.mesh.solid import PartError
from slicing.paper.indices import indices
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.profile import Profile
from slicing.surfaces.surfaces import Cone, Plane, Revolved
from slicing.targets.targets import sample_targets

AXIS = (0.0, 0.0)
REVOLVED, PLANAR, ROUND = (SlicingParameters(s) for s in ("revolved", "planar", "cylindrical"))
H = 1.73
UPRIGHT = ((R, -9.0), (R, 4.0))
STEPPED = ((18.0, -20.0), (18.0, 0.0), (24.0, 0.0), (24.0, 30.0))
FLARED = ((20.0, -20.0), (20.0, -3.0), (24.0, 3.0), (24.0, 30.0))
CAPPED = ((0.0, 30.0), (20.0, 30.0), (20.0, 0.0))  # closed at its top by an end face
DOME = ((20.0, 0.0), (18.0, 8.0), (12.0, 14.0), (0.0, 17.0))
SAGITTA_MM = 1e-3  # more than arcs may stray at the tolerance used


def area(curves) -> float:
    return sum(c.area_mm2 for c in curves)


@st.composite
def profiles(draw):
    """Points (r, z), z rising or level, steps one way at a time."""
    n = draw(st.integers(2, 7))
    r = draw(st.lists(st.floats(2, 30), min_size=n, max_size=n))
    rise = draw(st.lists(st.sampled_from([0.0, 1.0, 4.0, 11.0]), min_size=n, max_size=n))
    points = [(r[0], -10.0)]
    for radius, up, down in zip(r[1:], rise[1:], [1.0, *rise[1:]], strict=False):
        level = up == 0.0 and down == 0.0
        if abs(radius - points[-1][0]) > 0.5 or up > 0.0:
            points.append((radius, points[-1][1] + (1.0 if level else up)))
    if all(z == -10.0 for _, z in points):
        points.append((points[-1][0], 5.0))
    return tuple(points)


@settings(max_examples=100, deadline=None)
@example(((2.0, -10.0), (2.0000000000000004, -9.0)), 1.0)  # vertical but for rounding
@given(profiles(), st.floats(0.01, 40))
def test_offset_chains_are_the_true_offsets(points, by):
    profile = Profile.of(points)
    chain = profile.offset_chain(by, 1e-3)
    assert (np.diff(chain.z) >= 0).all()
    assert (chain.r >= 0).all()
    off_axis = chain.r > 0  # end faces reach in to the axis, where corners are no part of the offset
    assert profile.distance(chain.r, chain.z)[off_axis] == pytest.approx(by, abs=1e-7)
    middle_r, middle_z = 0.5 * (chain.r[1:] + chain.r[:-1]), 0.5 * (chain.z[1:] + chain.z[:-1])
    assert np.abs(profile.distance(middle_r, middle_z) - by).max(initial=0.0) <= 1.001e-3
    # nothing of the offset is missing: points at that distance lie on the chain
    surface = Revolved(AXIS, points, by)
    rng = np.random.default_rng(0)
    at = np.stack([rng.uniform(0, 60, 200), np.zeros(200), rng.uniform(-40, 60, 200)], axis=1)
    bands = ProfileSlabs.of(chain)
    slab = bands.slab(at[:, 2])
    inside = at[:, 0] <= bands.radius(slab, at[:, 2])
    clear = np.abs(surface.distance(at)) > 2e-3
    assert (inside == (surface.distance(at) < 0))[clear].all()


@settings(max_examples=60, deadline=None)
@given(profiles(), st.integers(0, 2**31))
def test_normals_point_along_growing_distance(points, seed):
    surface = Revolved((2.0, -1.0), points)
    at = np.random.default_rng(seed).uniform(-50, 50, (40, 3))
    normals, step = surface.normals(at), 1e-6
    assert np.allclose(np.linalg.norm(normals, axis=1), 1)
    away = np.abs(surface.distance(at)) > 1e-3
    further = (surface.distance(at + step * normals) - surface.distance(at)) / step
    assert further[away] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.slow
def test_vertical_profile_is_the_cylinder():
    for mesh in (box(), blade(10, 10), sector(1.1, 20, 40, -5, 5), ring(19.9, 32.0, -4.0, 7.0)):
        a, b = slice_sub_volume(mesh, RevolvedBody(UPRIGHT), REVOLVED), slice_sub_volume(mesh, BODY, ROUND)
        assert len(a.layers) == len(b.layers)
        for p, q in zip(a.layers, b.layers, strict=True):
            assert len(p.curves) == len(q.curves)
            assert p.area_mm2 == pytest.approx(q.area_mm2, rel=1e-7)
            assert p.thickness_mm == pytest.approx(q.thickness_mm, abs=1e-6)
        assert indices(a, 7).A_mm2 == pytest.approx(indices(b, 7).A_mm2, rel=1e-7)


@pytest.mark.parametrize("half", [20.0, pytest.param(-35.0, marks=pytest.mark.slow)])
def test_slanted_profile_is_the_cone(half):
    k = math.tan(math.radians(half))
    profile = tuple((20 + k * z, z) for z in (-6.0, 0.5, 3.0))
    cone = ConicalBody(20.0, half)
    for mesh in (box(), blade(10, 10, inner=16.0)):
        a = slice_sub_volume(mesh, RevolvedBody(profile), REVOLVED)
        b = slice_sub_volume(mesh, cone, SlicingParameters("conical"))
        assert len(a.layers) == len(b.layers)
        for p, q in zip(a.layers, b.layers, strict=True):
            assert p.area_mm2 == pytest.approx(q.area_mm2, rel=1e-6)
            points = np.concatenate([c.points for c in p.curves])
            assert np.abs(q.surface.distance(points)).max() < 1e-6
            assert np.allclose(p.surface.normals(points), q.surface.normals(points), atol=1e-6)


def stepped_area(by: float) -> float:
    """Of a box |y| <= 6, -8 <= z <= 8 on the offset of STEPPED: cylinder, annulus, torus, cylinder."""

    def width(r):
        return 2 * math.asin(6 / r)

    low, high = 18 + by, 24 + by
    annulus = quad(lambda r: r * width(r), low, 24)[0] if low < 24 else 0.0
    start = 0.0 if low < 24 else math.acos(min((low - 24) / by, 1.0))
    lower = -by if low < 24 else -by * math.sin(start)
    reach = math.pi / 2 - start if low < 24 else start
    torus = quad(lambda a: by * (24 + by * math.cos(a)) * width(24 + by * math.cos(a)), 0, reach)[0]
    return low * width(low) * (lower + 8) + annulus + torus + high * width(high) * 8


@pytest.mark.parametrize("finer", [0, 3])
@pytest.mark.parametrize("by", [0.0, 1.0, 3.46, 7.5])
def test_box_across_a_shoulder(by, finer):
    mesh = subdivided(box((2, -6, -8), (45, 6, 8)), finer)
    (curve,) = intersect(mesh, Revolved(AXIS, STEPPED, by))
    assert curve.area_mm2 == pytest.approx(stepped_area(by), rel=1e-4)
    off = np.abs(Revolved(AXIS, STEPPED, by).distance(curve.points))
    assert off.max() < (1e-6 if by == 0 else SAGITTA_MM)
    on_arc = (curve.points[:, 2] > -by) & (curve.points[:, 2] < 0)
    assert off[~on_arc].max() < 1e-6
    sides = np.minimum(6 - np.abs(curve.points[:, 1]), 8 - np.abs(curve.points[:, 2]))
    assert np.abs(sides).max() < 1e-9


def test_corners_that_go_in_stay_sharp():
    # at the foot of the shoulder offsets meet in a corner: no arc there
    chain = Profile.of(STEPPED).offset_chain(2.0, 1e-3)
    corner = (np.abs(chain.r - 20.0) < 1e-9) & (np.abs(chain.z + 2.0) < 1e-9)
    assert corner.any()


@pytest.mark.slow
def test_boss_on_an_end_face_is_sliced_by_planes():
    body = RevolvedBody(CAPPED)
    sliced = slice_sub_volume(box((-5, -5, 20), (5, 5, 60)), body, REVOLVED)
    assert len(sliced.layers) == 1 + math.floor(30 / H)
    for k, layer in enumerate(sliced.layers):
        assert layer.area_mm2 == pytest.approx(100.0, rel=1e-6)  # round the pole: its inside, not the rest
        points = layer.curves[0].points
        assert np.abs(points[:, 2] - 30 - k * H).max() < 1e-6
        assert np.allclose(layer.surface.normals(points), [0, 0, 1])
    tube = box_solid((-5, -5, 20), (5, 5, 60)) - box_solid((-2, -2, 0), (2, 2, 80))
    layer = slice_sub_volume(from_manifold(tube), body, REVOLVED).layers[3]
    assert layer.area_mm2 == pytest.approx(84.0, rel=1e-6)
    beside = slice_sub_volume(box((6, -5, 20), (12, 5, 60)), body, REVOLVED).layers[3]
    assert beside.area_mm2 == pytest.approx(60.0, rel=1e-6)
    assert beside.curves[0].winding == 0


@pytest.mark.parametrize("turn", [0.0, 0.3, math.pi / 2, 3.0])
def test_a_side_through_the_axis(turn):
    solid = rotated(box((0, -5, 20), (8, 5, 60)), turn)
    for by in (0.5, 7.0):
        assert area(intersect(solid, Revolved(AXIS, CAPPED, by))) == pytest.approx(80.0, rel=1e-6)
    cone, rim = Cone(AXIS, 0.0, 30.0), 10 * math.tan(math.radians(30.0))
    (whole,) = intersect(rotated(box((0, -40, -10), (40, 40, 10)), turn), cone)
    assert whole.area_mm2 == pytest.approx(0.5 * math.pi * rim * math.hypot(rim, 10), rel=1e-5)


@pytest.mark.slow
def test_cap_on_a_dome():
    body = RevolvedBody(DOME)
    sliced = slice_sub_volume(box((-40, -40, 10), (40, 40, 40)), body, REVOLVED)
    rim = 18 - 6 * (10 - 8) / 6
    cones = math.pi * (rim + 12) * math.hypot(rim - 12, 4) + math.pi * 12 * math.hypot(12, 3)
    assert sliced.layers[0].area_mm2 == pytest.approx(cones, rel=1e-6)
    for a, b in pairwise(sliced.layers[:8]):
        assert b.area_mm2 > a.area_mm2


def test_layers_are_h_layer_thick():
    for profile, mesh in ((STEPPED, box((2, -6, -8), (45, 6, 8))), (FLARED, blade(12, 12, inner=18.0))):
        sliced = slice_sub_volume(mesh, RevolvedBody(profile), REVOLVED)
        assert sliced.warnings == ()
        for k, layer in enumerate(sliced.layers):
            assert layer.thickness_mm == pytest.approx((H, H), abs=1e-9)
            points = np.concatenate([c.points for c in layer.curves])
            body = sliced.body.surface
            assert np.abs(body.distance(points) - k * H).max() < SAGITTA_MM
            if k:  # straight back along the normals one comes to the layer below
                foot = points - H * layer.surface.normals(points)
                assert np.abs(sliced.layers[k - 1].surface.distance(foot)).max() < SAGITTA_MM


def test_targets_indices_and_document_of_a_revolved_stack():
    body = RevolvedBody(FLARED, (1.0, 2.0))
    sliced = slice_sub_volume(box(), body, REVOLVED)
    targets = sample_targets([sliced])
    assert np.allclose(np.linalg.norm(targets.normal, axis=1), 1)
    assert np.abs((targets.normal * targets.tangent).sum(axis=1)).max() < 1e-9
    assert targets.thickness_mm == pytest.approx(np.full(len(targets), H), abs=1e-9)
    low = (targets.position[:, 2] < -7.9) & (targets.layer < 3)  # the flare's foot moves down with the offset
    assert np.abs(targets.normal[low, 2]).max() < 1e-9  # on the cylinder below it
    found = indices(sliced, targets)
    assert found.A_mm2 == pytest.approx(sliced.layers[0].area_mm2)
    written = json.loads(json.dumps(slices_document([sliced], [found])))["sub_volumes"][0]
    assert written["layers"][2]["surface"] == {
        "kind": "revolved",
        "axis_point": [1.0, 2.0],
        "profile": [list(point) for point in FLARED],
        "offset": 2 * H,
    }


def test_a_fine_mesh_gives_the_layers_of_a_coarse_one():
    for profile in (STEPPED, FLARED, DOME):
        body = RevolvedBody(profile)
        coarse = slice_sub_volume(box(), body, REVOLVED)
        fine = slice_sub_volume(subdivided(box(), 3), body, REVOLVED)
        assert len(coarse.layers) == len(fine.layers)
        for a, b in zip(coarse.layers, fine.layers, strict=True):
            assert len(a.curves) == len(b.curves)
            assert b.area_mm2 == pytest.approx(a.area_mm2, rel=1e-6)


@settings(max_examples=10, deadline=None)
@given(st.floats(-3.2, 3.2), st.sampled_from([STEPPED, FLARED, DOME]), st.floats(0.0, 9.0))
def test_turning_the_solid_turns_the_curves(angle, profile, by):
    surface = Revolved(AXIS, profile, by)
    solid = box((3, -6, -8), (50, 6, 8))
    still, turned = (intersect(mesh, surface) for mesh in (solid, rotated(solid, angle)))
    assert len(still) == len(turned)
    assert area(turned) == pytest.approx(area(still), rel=1e-5)


def test_profile_points_on_a_straight_line_change_nothing():
    plain = Revolved(AXIS, ((18.0, -9.0), (25.0, 12.0)), 3.0)
    split = Revolved(AXIS, tuple((18.0 + 7 * t, -9.0 + 21 * t) for t in (0.0, 0.2, 0.5, 0.9, 1.0)), 3.0)
    for mesh in (box(), blade(8, 8), ring(10.0, 50.0, -7.0, 6.0)):
        assert area(intersect(mesh, split)) == pytest.approx(area(intersect(mesh, plain)), rel=1e-6)


def quadrature(surface: Revolved | Cone, hull: ConvexHull) -> float:
    """Area of the surface within a convex hull, on a grid."""
    bands, total = ProfileSlabs.of(surface.chain(1e-3)), 0.0
    angle = (np.arange(360) + 0.5) / 360 * 2 * np.pi
    border = np.concatenate([[-60.0], bands.z, [60.0]])
    for slab in np.flatnonzero(~bands.empty & ((np.diff(border) > 0) | bands.step)).tolist():
        a, b = border[slab : slab + 2]
        if bands.step[slab]:
            r0, r1 = bands.r[slab - 1 : slab + 1]
            length, place = abs(r1 - r0), np.arange(max(math.ceil(abs(r1 - r0) * 8), 2))
            r, z = r0 + (place + 0.5) / len(place) * (r1 - r0), np.full(len(place), a)
        else:
            length = (b - a) * math.hypot(1, bands.slope[slab])
            place = np.arange(max(math.ceil(min(length, 500) * 8), 2))
            z = a + (place + 0.5) / len(place) * (b - a)
            r = bands.radius(np.full(len(z), slab), z)
        x = np.stack([np.outer(r, np.cos(angle)), np.outer(r, np.sin(angle)), np.outer(z, np.ones(360))], axis=2)
        inside = (x.reshape(-1, 3) @ hull.equations[:, :3].T + hull.equations[:, 3] <= 0).all(axis=1)
        total += float((inside.reshape(x.shape[:2]).mean(axis=1) * r).sum()) * 2 * np.pi * length / len(r)
    return total


@pytest.mark.parametrize("seed", [*range(5), *(pytest.param(k, marks=pytest.mark.slow) for k in range(5, 10))])
def test_convex_solids_by_quadrature(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-30, 30, size=(10, 3)) + np.array([15.0 * (seed % 2), 0, 0])
    if seed % 3 == 0:  # vertices on one another's level, at the profiles' heights
        points = np.round(points / 10) * 10
    hull = ConvexHull(points)
    mesh = from_manifold(manifold3d.Manifold.hull_points([tuple(p) for p in points]))
    profile = (STEPPED, FLARED, DOME, CAPPED, ((20.0, -20.0), (35.0, -10.0), (20.0, 0.0), (15.0, 0.0), (20.0, 30.0)))
    for by in (0.3, 4.0, 12.0):
        surface = Revolved(AXIS, profile[seed % 5], by)
        curves = intersect(mesh, surface)
        assert area(curves) == pytest.approx(quadrature(surface, hull), rel=0.01, abs=8.0)
        for curve in curves:
            assert np.abs(surface.distance(curve.points)).max() < SAGITTA_MM
            height = hull.equations[:, :3] @ curve.points.T + hull.equations[:, 3:]
            assert np.abs(height.max(axis=0)).max() < 1e-6


def test_an_edge_in_a_border_plane_of_the_bands_is_no_loop():
    # a vertex at the very height of a profile's point, where cells have no width
    points = [(40, -30, -10), (30, -20, 0), (0, 30, -30), (0, 30, 20), (-10, 20, 0), (-10, -10, 0), (10, 30, -10),
              (10, -10, -10), (40, 10, 0), (20, -10, 0)]  # fmt: skip
    mesh = from_manifold(manifold3d.Manifold.hull_points(points))
    profile = ((20.0, -20.0), (35.0, -10.0), (20.0, 0.0), (15.0, 0.0), (20.0, 30.0))
    for tolerance in (0.1, 0.01, 0.001):
        assert area(intersect(mesh, Revolved(AXIS, profile, 12.0), tolerance)) == pytest.approx(71.27, rel=1e-3)


def test_planes_on_a_stepped_body_stop_where_it_begins():
    sliced = slice_sub_volume(box((2, -6, -8), (45, 6, 8)), RevolvedBody(STEPPED), PLANAR)
    for layer in sliced.layers[:8]:
        assert isinstance(layer.surface, Plane)
        x = layer.surface.point[0]
        inside = [min(2 * math.sqrt(max(r * r - x * x, 0.0)), 12.0) * 8 for r in (18.0, 24.0)]
        assert layer.area_mm2 == pytest.approx(192 - sum(inside), abs=0.01)


@pytest.mark.parametrize(
    ("profile", "why"),
    [
        (((20.0, 0.0),), "at least two"),
        (((20.0, 0.0), (-3.0, 9.0), (20.0, 12.0)), "crosses the axis"),
        (((20.0, 0.0), (0.0, 9.0), (20.0, 12.0)), "touches the axis"),
        (((20.0, 0.0), (20.0, 0.0), (20.0, 12.0)), "points 0 and 1 are the same"),
        (((20.0, 0.0), (30.0, 0.0)), "one height"),
        (((20.0, 0.0), (30.0, 10.0), (30.0, 0.0), (20.0, 10.0)), "crosses itself"),
        (((20.0, 0.0), (20.0, 10.0), (30.0, 10.0), (25.0, 10.0), (25.0, 20.0)), "runs back over itself"),
        (((20.0, 0.0), (30.0, 10.0), (40.0, 5.0)), "undercut"),
        (((20.0, 0.0), (math.nan, 10.0)), "not finite"),
        (((20.0, 0.0, 1.0), (20.0, 10.0, 1.0)), "two numbers"),
    ],
)
def test_profiles_that_make_no_sense_are_refused(profile, why):
    with pytest.raises(PartError, match=f"profile_mm: .*{why}") as refused:
        RevolvedBody(profile)
    assert "\n" not in str(refused.value)


def test_profiles_may_be_given_downwards():
    mesh = box((2, -6, -8), (45, 6, 8))
    up, down = (intersect(mesh, Revolved(AXIS, p, 2.0)) for p in (STEPPED, STEPPED[::-1]))
    assert area(up) == pytest.approx(area(down), rel=1e-12)


def test_sub_volumes_off_or_in_the_body_are_refused():
    body = RevolvedBody(STEPPED)
    with pytest.raises(PartError, match=r"gap is 5\.000 mm"):
        slice_sub_volume(box((29, -6, 1), (40, 6, 8)), body, REVOLVED)
    with pytest.raises(PartError, match=r"gap is 3\.000 mm"):
        slice_sub_volume(
            box((19, -1, -9), (23, 1, -3)), RevolvedBody(((16.0, -20.0), (16.0, 0.0), *STEPPED[2:])), REVOLVED
        )
    with pytest.raises(PartError, match="wholly inside"):
        slice_sub_volume(box((2, -6, 1), (10, 6, 8)), body, REVOLVED)
