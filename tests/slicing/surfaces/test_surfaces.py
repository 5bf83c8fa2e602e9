"""What planes, cylinders, cones and profiles answer alike."""

from __future__ import annotations

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
