"""Volumes and areas by the faces of a solid: `slicing.volume.solid_flux` against the formulas written down."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from support.parts.meshes import blade, box, box_solid, from_manifold, ring, subdivided

from slicing.curves.intersect import intersect, intersect_offsets
from slicing.mesh.face_measures import CHUNK, bounding_box, enclosed_volume, face_measures, face_normals, total_area
from slicing.mesh.solid import Mesh, PartError, mesh_from_arrays
from slicing.surfaces.bodies import CylindricalBody, RevolvedBody
from slicing.surfaces.surfaces import Cone, Cylinder, Plane, Revolved
from slicing.volume.solid_flux import SolidFlux

PROFILE = ((20.0, -60.0), (24.0, 0.0), (22.0, 60.0))
NOTCHED = box_solid((10, -18, -30), (70, 18, 30)) - box_solid((30, -30, -6), (90, 2, 6))


def ball(subdivisions: int, centre=(45.0, 5.0, -3.0), radius: float = 24.0) -> Mesh:
    solid = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return mesh_from_arrays("ball", np.asarray(solid.vertices) + centre, np.asarray(solid.faces))


def share_over(h1: float, h2: float, h3: float) -> float:
    """How much of a triangle lies where its height is above 0, from the heights of its corners."""
    h1, h2, h3 = sorted((h1, h2, h3))
    if h1 >= 0:
        return 1.0
    if h3 <= 0:
        return 0.0
    if h2 <= 0:
        return h3 / (h3 - h1) * h3 / (h3 - h2)
    return 1.0 - h1 / (h1 - h2) * h1 / (h1 - h3)


def stretch(surface, z: np.ndarray) -> np.ndarray:
    """Area of a surface by flux of (x, y, 0) / rho² through it, at heights along the axis."""
    if isinstance(surface, Cylinder):
        return np.full(len(z), surface.radius)
    if isinstance(surface, Cone):
        return (surface.radius + surface.slope * z) * math.sqrt(1.0 + surface.slope**2)
    below, at, above = (surface.radius_at(z + by) for by in (-1e-4, 0.0, 1e-4))
    return at * np.hypot(1.0, (above - below) / 2e-4)


def plain_area(mesh: Mesh, surface) -> float:
    """The section's area, face by face: what beyond the surface passes through."""
    total = 0.0
    corners, heights = mesh.vertices[mesh.faces], surface.distance(mesh.vertices)[mesh.faces]
    vectors = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    if isinstance(surface, Plane):
        flux = vectors @ surface.normal
    else:
        x, y, z = (corners.mean(axis=1) - (*surface.axis_point, 0.0)).T
        flux = (x * vectors[:, 0] + y * vectors[:, 1]) / (x * x + y * y) * stretch(surface, z)
    for height, through in zip(heights.tolist(), flux.tolist(), strict=True):
        total += share_over(*height) * through
    return total


def plain_volume(mesh: Mesh, surface: Cylinder) -> float:
    """The volume beyond a cylinder, face by face."""
    total = 0.0
    for corners in mesh.vertices[mesh.faces]:
        vector = 0.5 * np.cross(corners[1] - corners[0], corners[2] - corners[0])
        x, y, _ = corners.mean(axis=0) - (*surface.axis_point, 0.0)
        if x * x + y * y > surface.radius**2:
            total += 0.5 * (1.0 - surface.radius**2 / (x * x + y * y)) * (x * vector[0] + y * vector[1])
    return total


SOLIDS = {
    "ball": ball(2),
    "ball about the axis": ball(3, (1.0, -2.0, 3.0), 40.0),
    "blade": blade(9, 9),
    "ring": ring(12.0, 36.0, -4.0, 7.0, n=60),
    "notched": subdivided(from_manifold(NOTCHED), 2),
}
FAMILIES = {
    "planes": [Plane((x, 0.3 * x, 0.0), (0.6, 0.0, 0.8)) for x in (27.0, 31.5, 44.0)],
    "planes across x": [Plane((x, 0.0, 0.0), (1.0, 0.0, 0.0)) for x in (24.0, 36.5)],
    "cylinders": [Cylinder((0.0, 0.0), r) for r in (33.0, 21.0, 27.5)],
    "cylinders about axes of their own": [
        *(Cylinder((-3.0 * k * k - 60.0, 0.7 * k), 3.0 * k * k + 90.0 + k) for k in range(9)),
        Cylinder((-1e5, 0.0), 1e5 + 31.0),
    ],
    "cylinders from afar": [Cylinder((-200.0 - 3.0 * k, 40.0), 231.0 + 3.0 * k) for k in range(3)],
    "many cylinders": [Cylinder((-30.0, 2.0), 50.0 + 0.15 * k) for k in range(300)],
    "cones": [Cone((0.0, 0.0), r, 15.0) for r in (25.0, 20.0, 28.0)],
    "revolved": [Revolved((0.0, 0.0), PROFILE, by) for by in (1.0, 9.0, 4.5)],
}


@pytest.mark.parametrize("solid", SOLIDS)
@pytest.mark.parametrize("family", [name for name in FAMILIES if name != "many cylinders"])
def test_areas_are_the_sums_over_all_faces(solid, family, monkeypatch):
    monkeypatch.setattr("slicing.mesh.face_measures.CHUNK", 300)  # several chunks, the last one not full
    mesh, surfaces = SOLIDS[solid], FAMILIES[family]
    exact = [plain_area(mesh, surface) for surface in surfaces]
    assert SolidFlux(mesh).areas_on(surfaces) == pytest.approx(exact, rel=1e-9, abs=1e-9 * total_area(mesh.normals))


def test_families_taken_together_are_those_taken_alone():
    mesh = SOLIDS["notched"]
    surfaces = [surface for family in FAMILIES.values() for surface in family]
    mixed = np.random.default_rng(7).permutation(len(surfaces))
    together = SolidFlux(mesh).areas_on([surfaces[k] for k in mixed])
    alone = np.concatenate([SolidFlux(mesh).areas_on(family) for family in FAMILIES.values()])
    assert together == pytest.approx(alone[mixed], rel=1e-12, abs=1e-9)
    few = [0, 128, 254, 255, 299]  # more levels than a byte counts
    many = FAMILIES["many cylinders"]
    found = SolidFlux(mesh).areas_on(many)
    assert found[few] == pytest.approx([plain_area(mesh, many[k]) for k in few], rel=1e-9)


@settings(max_examples=30, deadline=None)
@given(
    centre=st.tuples(*[st.floats(-30.0, 60.0)] * 3),
    axis=st.tuples(st.floats(-200.0, 20.0), st.floats(-40.0, 40.0)),
    radius=st.floats(2.0, 260.0),
    tilt=st.floats(-1.2, 1.2),
)
def test_areas_of_any_ball_by_any_surface(centre, axis, radius, tilt):
    mesh = ball(1, centre)
    normal = (math.cos(tilt), 0.0, math.sin(tilt))
    surfaces = [Cylinder(axis, radius), Cylinder((axis[0] - 9.0, 0.0), radius), Plane(centre, normal)]
    cone = Cone(axis, radius, 40.0 * tilt)
    exact = [plain_area(mesh, surface) for surface in [*surfaces, cone]]
    assert SolidFlux(mesh).areas_on([*surfaces, cone]) == pytest.approx(exact, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("solid", SOLIDS)
def test_volumes_and_measures_of_faces(solid):
    mesh = SOLIDS[solid]
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    normals, centres, radii = face_measures(mesh.vertices, mesh.faces)
    assert np.array_equal(normals, np.cross(b - a, c - a))
    assert np.array_equal(normals, face_normals(mesh.vertices, mesh.faces))
    assert total_area(normals) == pytest.approx(0.5 * np.linalg.norm(normals, axis=1).sum(), rel=1e-12)
    assert enclosed_volume(mesh.vertices, mesh.faces, normals) == pytest.approx(
        np.linalg.det(np.stack([a, b, c], axis=1)).sum() / 6.0, rel=1e-9
    )
    assert np.array_equal(bounding_box(mesh.vertices), [mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)])
    reach = np.max([np.linalg.norm(corner - centres, axis=1) for corner in (a, b, c)], axis=0)
    assert (radii >= reach).all()
    assert (radii <= math.sqrt(3.0) * reach).all()
    for surface in (Cylinder((0.0, 0.0), 27.0), Cylinder((-40.0, 3.0), 75.0)):
        assert SolidFlux(mesh).volume_beyond(surface) == pytest.approx(plain_volume(mesh, surface), rel=1e-9, abs=1e-6)


def test_chunks_cover_more_faces_than_one_holds():
    fine = ball(6)
    assert len(fine.faces) > 2 * CHUNK
    flux, surface = SolidFlux.of(fine), Cylinder((0.0, 0.0), 40.0)
    assert flux.fit_for(surface) is flux  # so many faces are not divided
    (curve,) = intersect(fine, surface)
    assert flux.area_on(surface) == pytest.approx(curve.area_mm2, rel=1e-4)
    assert fine.volume == pytest.approx(4.0 / 3.0 * math.pi * 24.0**3, rel=1e-3)


@pytest.mark.parametrize("depth", [0.0, 1e-3, 0.019, 0.021, 0.5, 3.0, 19.0, 20.0])
@pytest.mark.parametrize("finer", [0, 3, 5])
def test_a_solid_that_enters_the_body_between_its_corners_is_seen(depth, finer):
    """A flat face whose corners lie far outside of the body touches it in its middle alone."""
    mesh = subdivided(box((20.0 - depth, -43.7, 1.0), (30.0, 40.0, 9.0)), finer)
    surface = Cylinder((0.0, 0.0), 20.0)
    assert SolidFlux.of(mesh).deepest(surface) == pytest.approx(-depth, abs=1e-9)
    # what is asked for alone need be exact
    told = SolidFlux.of(mesh).deepest(surface, -0.02)
    assert told == pytest.approx(-depth, abs=1e-9) if depth > 0.02 else told >= -0.02


def test_the_axis_through_a_face_is_seen_from_any_mesh():
    slab = box((-30, -30, 0), (30, 30, 8))
    for finer in (0, 2):
        assert SolidFlux.of(subdivided(slab, finer)).deepest(Cylinder((1.0, 2.0), 20.0), -0.02) == pytest.approx(-20.0)


@pytest.mark.parametrize("solid", SOLIDS)
def test_faces_near_a_surface_are_all_that_it_meets(solid):
    """Cuts from the faces that may reach a surface are the cuts from all faces."""
    mesh = SOLIDS[solid]
    for base in (Cylinder((0.0, 0.0), 20.0), Cylinder((2.0, -1.0), 0.5), Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))):
        heights = np.array([0.0, 0.7, 6.0, 11.0, 19.5])
        for height, curves in zip(heights.tolist(), intersect_offsets(mesh, base, heights), strict=True):
            alone = intersect(mesh, base.offset(height))
            assert [len(curve.points) for curve in alone] == [len(curve.points) for curve in curves]
            assert [c.area_mm2 for c in alone] == pytest.approx([c.area_mm2 for c in curves], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("make", "key"),
    [
        (lambda: CylindricalBody(20.0, (1e200, 0.0)), "axis_xy_mm: 1e+200"),
        (lambda: CylindricalBody(1e200), "radius_mm: 1e+200"),
        (lambda: RevolvedBody(((20.0, 0.0), (20.0, 1e160))), "profile_mm: 1e+160"),
    ],
)
def test_bodies_beyond_any_coordinates_are_refused(make, key):
    with pytest.raises(PartError) as caught:
        make()
    assert str(caught.value) == f"{key} mm is too far; at most 1e+09 mm are taken"
