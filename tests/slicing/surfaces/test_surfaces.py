"""What planes, cylinders, cones and profiles answer alike."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from slicing.surfaces.surfaces import Cone, Cylinder, Plane, Revolved

AXIS = (1.0, -2.0)
BENT = ((20.0, 0.0), (20.0, 30.0), (28.0, 50.0))
SURFACES = {
    "plane": Plane((20.0, 0.0, 5.0), (0.8, 0.6, 0.0)),
    "cylinder": Cylinder(AXIS, 20.0),
    "cone": Cone(AXIS, 20.0, 25.0),
    "revolved": Revolved(AXIS, BENT),
}
OTHERS = {
    "plane": Plane((20.0, 0.0, 5.0), (0.6, 0.8, 0.0)),
    "cylinder": Cylinder((1.0, -2.5), 20.0),
    "cone": Cone(AXIS, 20.0, 26.0),
    "revolved": Revolved(AXIS, ((20.0, 0.0), (20.0, 31.0), (28.0, 50.0))),
}
KINDS = pytest.mark.parametrize("kind", SURFACES)


@KINDS
def test_offsets_are_known_by_their_family_and_lie_so_far_out(kind):
    surface = SURFACES[kind]
    assert surface.offset(1.73).is_offset_of(surface)
    assert surface.offset(1.73).level - surface.level == pytest.approx(1.73, abs=1e-12)
    assert not surface.is_offset_of(OTHERS[kind])
    assert [other for other in SURFACES if surface.is_offset_of(SURFACES[other])] == [kind]


@KINDS
def test_rays_back_along_the_normals_arrive_after_the_distance(kind):
    surface = SURFACES[kind]
    on = surface.offset(0.0)
    points = np.array([[24.0, 0.0, 4.0], [18.0, 19.0, 11.0], [-25.0, 3.0, 33.0]])
    points = points[surface.distance(points) > 0.0]
    assert len(points) > 1
    normals = surface.normals(points)
    assert on.ray_distance(points, normals) == pytest.approx(surface.distance(points), abs=1e-7)


@pytest.mark.parametrize("kind", ["cylinder", "cone", "revolved"])
def test_rays_that_pass_by_arrive_nowhere(kind):
    surface = SURFACES[kind]
    beside = np.array([[1.0, 60.0, 10.0]])
    assert surface.ray_distance(beside, np.array([[1.0, 0.0, 0.0]])).tolist() == [np.inf]
    straight = surface.ray_distance(beside, np.array([[0.0, 1.0, 0.0]]))
    assert straight == pytest.approx(62.0 - surface.radius_at(np.array([10.0])), abs=1e-6)


@pytest.mark.parametrize("kind", ["cylinder", "cone", "revolved"])
def test_the_radius_is_where_the_distance_is_none(kind):
    surface, z = SURFACES[kind], np.array([3.0, 17.0, 40.0])
    points = np.stack([AXIS[0] + surface.radius_at(z), np.full(3, AXIS[1]), z], axis=1)
    assert surface.distance(points) == pytest.approx(np.zeros(3), abs=1e-9)


@pytest.mark.parametrize("kind", ["plane", "cylinder"])
def test_what_is_unrolled_is_lifted_back(kind):
    surface = SURFACES[kind]
    flat = np.array([[-3.0, 2.0], [0.0, 9.0], [4.0, 7.0]])
    points = surface.lifted(flat)
    assert surface.distance(points) == pytest.approx(np.zeros(3), abs=1e-12)
    assert surface.unrolled(points) == pytest.approx(flat, abs=1e-12)


def test_a_surface_that_meets_its_axis_has_an_end_there():
    assert SURFACES["plane"].ends == SURFACES["cylinder"].ends == (False, False)
    assert SURFACES["cone"].ends == (True, False)
    assert replace(SURFACES["cone"], half_angle_deg=-25.0).ends == (False, True)
    assert SURFACES["revolved"].ends == (False, False)
    assert Revolved(AXIS, (*BENT, (0.0, 60.0))).ends == (False, True)


def test_only_what_goes_round_an_axis_has_one():
    assert [surface.axis_points for surface in SURFACES.values()] == [(), (AXIS,), (AXIS,), (AXIS,)]
    assert [surface.is_flat for surface in SURFACES.values()] == [True, False, False, False]
    assert [surface.widest for surface in list(SURFACES.values())[1:]] == [20.0, math.inf, math.inf]


def test_a_cone_comes_to_a_point_where_its_radius_is_none():
    cone = SURFACES["cone"]
    assert cone.radius + cone.slope * cone.apex_z == pytest.approx(0.0, abs=1e-12)
    radius, z = cone.ruling_from_apex(7.0)
    assert radius.tolist() == [0.0, 7.0]
    assert cone.radius + cone.slope * z == pytest.approx(radius, abs=1e-12)
    for blunt in (replace(cone, half_angle_deg=0.0), SURFACES["cylinder"], SURFACES["revolved"]):
        assert blunt.apex_z is None
        assert blunt.ruling_from_apex(7.0) is None


def test_a_plane_is_so_far_over_a_parallel_one():
    plane = SURFACES["plane"]
    assert plane.offset(3.0).height_over(plane) == pytest.approx(3.0, abs=1e-12)
    assert plane.height_over(plane.offset(3.0)) == pytest.approx(-3.0, abs=1e-12)


@pytest.mark.parametrize("surface", [Cylinder((4.0, -1.0), 30.0), Cylinder((-70.0, 5.0), 100.0), SURFACES["plane"]])
@pytest.mark.parametrize(("middle", "half"), [(0.6, 0.5), (0.2, 0.9), (-0.4, 0.2)])
def test_seen_from_an_axis_a_surface_is_no_nearer_and_no_farther_than_told(surface, middle, half):
    """Along rays from the axis; towards the far side of a cylinder, and where planes are seen at a right angle."""
    low, high = surface.away_from(AXIS, middle, half)
    angle = middle + np.linspace(-half, half, 401)
    way = np.stack([np.cos(angle), np.sin(angle), np.zeros(401)], axis=1)
    start = np.array([*AXIS, 0.0])
    away = 1000.0 - surface.ray_distance(start + 1000.0 * way, way)
    assert away.min() >= low - 1e-9
    assert away.max() <= high + 1e-9
    centred = surface.away_from(AXIS, middle_of(surface), half)
    assert centred[0] == pytest.approx(low)
    angle = middle_of(surface) + half
    far = np.array([[math.cos(angle), math.sin(angle), 0.0]])
    assert centred[1] == pytest.approx(1000.0 - surface.ray_distance(start + 1000.0 * far, far)[0])


def middle_of(surface) -> float:
    """The angle about the axis at which a surface is nearest to it."""
    if surface.is_flat:
        return math.atan2(surface.normal[1], surface.normal[0])
    return math.atan2(AXIS[1] - surface.axis_point[1], AXIS[0] - surface.axis_point[0])


def test_a_plane_beyond_the_axis_or_along_the_sight_may_be_anywhere():
    plane = Plane((20.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    assert plane.away_from((0.0, 0.0), 0.0, 1.6) == (20.0, math.inf)
    assert plane.away_from((25.0, 0.0), 0.0, 0.5) == (-math.inf, math.inf)


@pytest.mark.parametrize("surface", [SURFACES["cylinder"], SURFACES["plane"]])
def test_of_every_triangle_that_reaches_into_an_offset_a_corner_is_told(surface):
    rng, below = np.random.default_rng(2), 1.5
    triangles = rng.uniform(-35.0, 35.0, (4000, 1, 3)) + rng.uniform(-25.0, 25.0, (4000, 3, 3))
    share = rng.dirichlet((1.0, 1.0, 1.0), 300)
    inside = np.einsum("pk,nkx->npx", share, triangles).reshape(-1, 3)
    least = surface.distance(inside).reshape(4000, 300).min(axis=1)
    height = surface.distance(triangles.reshape(-1, 3)).reshape(4000, 3)
    sides = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1)
    told = surface.may_reach(height, below, 0.5 * sides[:, None]).any(axis=1)
    reaches = least <= below
    assert told[reaches].all()
    assert reaches[(height > below).all(axis=1)].mean() > 0.02 or surface.is_flat  # sides alone dip into cylinders
    assert not told.all()


def test_triangles_are_as_far_from_a_cylinder_as_from_the_cone_and_the_profile_that_it_is():
    rng = np.random.default_rng(1)
    triangles = rng.uniform(-6.0, 6.0, (200, 1, 3)) + np.array([36.0, 0.0, 0.0]) + rng.uniform(-4.0, 4.0, (200, 3, 3))
    alike = [Cylinder(AXIS, 20.0), Cone(AXIS, 20.0, 0.0), Revolved(AXIS, ((20.0, -90.0), (20.0, 90.0)))]
    for part in np.split(triangles, 40):
        first, *others = (surface.least_distance(part) for surface in alike)
        assert first > 0.0
        assert others == pytest.approx([first, first], abs=1e-4)


def test_what_a_cylinder_runs_through_is_at_no_distance_from_it():
    pierced = np.array([[[-90.0, -90.0, 3.0], [90.0, -90.0, 4.0], [0.0, 90.0, 5.0]]])
    assert Cylinder(AXIS, 20.0).least_distance(pierced) == 0.0


@pytest.mark.parametrize("deep", [True, False])
def test_a_side_dips_into_a_cylinder_as_deep_as_its_half_length_says(deep):
    cylinder, half = Cylinder(AXIS, 100.0), 9.0
    away = math.hypot(100.5, half) + (-1e-6 if deep else 1e-6)  # its middle lies just within the offset, or outside
    assert cylinder.may_reach(np.array([away - 100.0]), 0.5, half).tolist() == [deep]
