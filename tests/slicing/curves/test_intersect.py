"""Curves of meshes with cylinders and planes, against analytic sections."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest
import shapely
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.spatial import ConvexHull
from shapely.ops import polygonize
from support.parts.meshes import blade, box, box_section, box_solid, from_manifold, ring, rotated, sector, subdivided

from slicing.curves.ellipse_arcs import sample_arcs
from slicing.curves.intersect import chain, intersect
from slicing.mesh.closest_point import closest_on_triangles
from slicing.mesh.solid import Mesh, mesh_from_arrays
from slicing.surfaces.surfaces import Cylinder, Plane

AXIS = (0.0, 0.0)


def area(curves) -> float:
    return sum(c.area_mm2 for c in curves)


def off_mesh(mesh: Mesh, points: np.ndarray) -> float:
    """Greatest distance of points from the mesh's surface, by brute force."""
    triangles = mesh.vertices[mesh.faces]
    worst = 0.0
    for p in points:
        close = closest_on_triangles(np.broadcast_to(p, (len(triangles), 3)), triangles)
        worst = max(worst, float(np.sqrt(((close - p) ** 2).sum(axis=1)).min()))
    return worst


def chord_error(surface: Cylinder, curve, finer) -> float:
    """Greatest distance of a finer sampling of a curve from the polyline of a coarser one."""
    a = curve.points
    b = np.roll(a, -1, axis=0)
    along = b - a
    length2 = (along**2).sum(axis=1)
    worst = 0.0
    for p in finer.points:
        t = np.clip(((p - a) * along).sum(axis=1) / length2, 0, 1)
        worst = max(worst, float(np.sqrt((((a + t[:, None] * along) - p) ** 2).sum(axis=1)).min()))
    return worst


@pytest.mark.parametrize("radius", [20.0, 21.73, 33.3, 39.9])
@pytest.mark.parametrize("finer", [0, 4])
def test_box_section_is_exact_however_fine_the_mesh(radius, finer):
    (curve,) = intersect(subdivided(box(), finer), Cylinder(AXIS, radius))
    assert curve.area_mm2 == pytest.approx(box_section(12, 16, radius), rel=1e-8)
    assert curve.length_mm == pytest.approx(2 * 16 + 4 * radius * np.arcsin(6 / radius), rel=1e-3)
    assert curve.closed
    assert not curve.hole
    assert curve.winding == 0


def test_points_lie_on_the_surface_and_on_the_mesh():
    mesh = blade()
    for surface in (Cylinder(AXIS, 20.0), Cylinder(AXIS, 31.7), Cylinder((-80.0, 3.0), 120.0)):
        for curve in intersect(mesh, surface):
            assert np.abs(surface.distance(curve.points)).max() < 1e-6
            assert off_mesh(mesh, curve.points) < 1e-6


def test_samples_are_as_fine_as_asked():
    mesh, surface = blade(6, 6), Cylinder(AXIS, 30.0)
    (fine,) = intersect(mesh, surface, tolerance_mm=1e-5)
    (coarse,) = intersect(mesh, surface, tolerance_mm=0.05)
    assert len(coarse.points) < len(fine.points)
    assert chord_error(surface, coarse, fine) <= 0.05


def test_radial_cylinder_boss_by_quadrature():
    n, b, r = 360, 7.0, 25.0  # a round boss along x, as a prism of n sides
    solid = manifold3d.Manifold.cylinder(40.0, b, b, n).rotate((0, 90, 0))
    (curve,) = intersect(from_manifold(solid), Cylinder(AXIS, r))
    # y² + z² = b²: on the cylinder y = r sin t, the section's height is 2 sqrt(b² - y²)
    exact = quad(lambda t: 2 * np.sqrt(max(b * b - (r * np.sin(t)) ** 2, 0.0)) * r, -np.arcsin(b / r), np.arcsin(b / r))
    assert curve.area_mm2 == pytest.approx(exact[0], rel=2e-4)  # the prism's own shortfall is 5e-5

    def speed(a):  # y = b cos a, z = b sin a, x = sqrt(r² - y²)
        y = b * np.cos(a)
        return np.sqrt(b * b + (y * b * np.sin(a)) ** 2 / (r * r - y * y))

    assert curve.length_mm == pytest.approx(quad(speed, 0, 2 * np.pi)[0], rel=1e-3)


def test_sector_has_constant_angles():
    mesh = sector(0.6, 20.0, 40.0, -5.0, 5.0, n=8)
    for radius in (20.0, 25.0, 39.0):
        (curve,) = intersect(mesh, Cylinder(AXIS, radius))
        angle = np.arctan2(curve.points[:, 1], curve.points[:, 0])
        assert angle.max() == pytest.approx(0.6, abs=1e-7)
        assert angle.min() == pytest.approx(-0.6, abs=1e-7)
        assert curve.area_mm2 == pytest.approx(1.2 * radius * 10, rel=1e-6)


def test_outer_loops_run_counter_clockwise_and_holes_clockwise():
    tube = box_solid((10, -6, -8), (40, 6, 8)) - box_solid((0, -2, -3), (50, 2, 3))
    curves = intersect(from_manifold(tube), Cylinder(AXIS, 25.0))
    assert [c.hole for c in sorted(curves, key=lambda c: c.area_mm2)] == [True, False]
    assert area(curves) == pytest.approx(box_section(12, 16, 25) - box_section(4, 6, 25))
    for curve in curves:
        flat = np.stack([np.arctan2(curve.points[:, 1], curve.points[:, 0]), curve.points[:, 2]], axis=1)
        after = np.roll(flat, -1, axis=0)
        turned = (flat[:, 0] * after[:, 1] - flat[:, 1] * after[:, 0]).sum()
        assert (turned < 0) == curve.hole


def test_fork_gives_two_loops():
    fork = (
        box_solid((10, -8, -4), (25, 8, 4)) + box_solid((20, -8, -4), (40, -3, 4)) + box_solid((20, 3, -4), (40, 8, 4))
    )
    mesh = from_manifold(fork)
    assert len(intersect(mesh, Cylinder(AXIS, 24.0))) == 1
    curves = intersect(mesh, Cylinder(AXIS, 35.0))
    assert len(curves) == 2
    one = 35 * (np.arcsin(8 / 35) - np.arcsin(3 / 35)) * 8
    assert [c.area_mm2 for c in curves] == pytest.approx([one, one])


def test_ring_gives_two_windings_and_the_area_between():
    for radius in (22.0, 27.5):
        curves = intersect(ring(20.0, 30.0, -4.0, 7.0), Cylinder(AXIS, radius))
        assert sorted(c.winding for c in curves) == [-1, 1]
        assert not any(c.hole for c in curves)
        assert area(curves) == pytest.approx(2 * np.pi * radius * 11, rel=1e-7)
        for curve in curves:
            assert np.ptp(curve.points[:, 2]) < 1e-9


def test_circle_inside_one_triangle():
    plate = mesh_from_arrays("plate", *_plate())
    curves = intersect(plate, Cylinder((10.0, 3.0), 5.0))
    assert len(curves) == 2
    assert area(curves) == pytest.approx(2 * np.pi * 5 * 10, rel=1e-7)
    for curve in curves:
        assert curve.length_mm == pytest.approx(2 * np.pi * 5, rel=1e-2)


def _plate():
    solid = box((-100, -100, 0), (100, 60, 10))
    return solid.vertices, solid.faces


def test_slanted_triangle_holding_a_whole_ellipse():
    corners = np.array([[-90, -80, -30], [90, -80, 5], [0, 120, 40.0]])
    mesh = mesh_from_arrays(
        "wedge",
        np.concatenate([corners, corners * [1, 1, 0] - [0, 0, 60]]),
        [[0, 1, 2], [5, 4, 3], [0, 3, 4], [0, 4, 1], [1, 4, 5], [1, 5, 2], [2, 5, 3], [2, 3, 0]],
    )
    curves = intersect(mesh, Cylinder(AXIS, 15.0), tolerance_mm=1e-3)
    assert len(curves) == 2
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    centre = corners[0][2] + (normal[:2] @ corners[0][:2]) / normal[2]
    assert area(curves) == pytest.approx(2 * np.pi * 15 * (centre + 60), rel=1e-7)
    for curve in curves:
        assert off_mesh(mesh, curve.points) < 1e-9


@pytest.mark.parametrize("depth", [0.0, 1e-9, -1e-9, 1e-5, -1e-5])
def test_edges_that_graze_the_cylinder(depth):
    # a vertical edge pointing at the axis, its nearest point just reaching, touching or missing the cylinder
    x = 20.0 - depth
    mesh = from_manifold(
        manifold3d.Manifold.hull_points([(x, 0, -5), (x, 0, 5), (30, -9, -5), (30, 9, -5), (30, -9, 5), (30, 9, 5)])
    )
    curves = intersect(mesh, Cylinder(AXIS, 20.0))
    assert len(curves) <= 1
    assert area(curves) == pytest.approx(max(depth, 0.0) * 10 * 2 * 0.9, abs=1e-4)
    # a face tangent to the cylinder
    slab = box((20.0 - depth, -9, -5), (30, 9, 5))
    curves = intersect(slab, Cylinder(AXIS, 20.0))
    assert area(curves) == pytest.approx(10 * 2 * np.sqrt(max(2 * 20 * (depth + 1e-7), 0.0)), abs=1e-2)


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.234567, 3.0])
@pytest.mark.parametrize("single", [False, True])
def test_root_cap_on_the_cylinder_gives_one_footprint(turn, single):
    mesh = rotated(sector(0.7, 20.0, 35.0, -6.0, 6.0, n=9), turn)
    if single:
        mesh = mesh_from_arrays("SV", mesh.vertices.astype(np.float32), mesh.faces)
    (curve,) = intersect(mesh, Cylinder(AXIS, 20.0))
    assert curve.area_mm2 == pytest.approx(1.4 * 20 * 12, rel=1e-5)
    (curve,) = intersect(rotated(blade(), turn), Cylinder(AXIS, 20.0))
    assert curve.area_mm2 == pytest.approx(intersect(blade(), Cylinder(AXIS, 20.001))[0].area_mm2, rel=1e-3)


def test_faces_lying_in_a_plane_count_as_below_it():
    mesh = subdivided(box((20, -5, -5), (30, 5, 5)), 3)
    for x, expected in ((20.0, 100.0), (25.0, 100.0), (30.0, 0.0)):
        assert area(intersect(mesh, Plane((x, 0, 0), (1.0, 0.0, 0.0)))) == pytest.approx(expected)


def test_cylinder_of_large_radius_is_nearly_a_plane():
    mesh = blade()
    flat = intersect(mesh, Plane((35.0, 0, 0), (1.0, 0.0, 0.0)))
    round_ = intersect(mesh, Cylinder((35.0 - 1e6, 0.0), 1e6))
    assert area(round_) == pytest.approx(area(flat), rel=1e-4)
    assert np.abs(Cylinder((35.0 - 1e6, 0.0), 1e6).distance(round_[0].points)).max() < 1e-6


def lines_in_plane(plane: Plane, lines: np.ndarray) -> shapely.Geometry:
    flat = np.round(plane.unrolled(lines.reshape(-1, 3)), 8).reshape(-1, 2, 2)
    return shapely.union_all(shapely.linestrings(flat))


def even_odd_area(cells: list) -> float:
    """Area of the cells inside an odd number of outlines: polygonize gives holes as cells of their own."""
    outer = [shapely.Polygon(c.exterior) for c in cells]
    return sum(c.area for c in cells if sum(o.contains(c.representative_point()) for o in outer) % 2)


@pytest.mark.parametrize("make", [lambda: blade(), lambda: ring(12, 30, -4, 7), lambda: subdivided(box(), 2)])
def test_planes_agree_with_trimesh(make):
    mesh = make()
    reference = trimesh.Trimesh(mesh.vertices, mesh.faces)
    rng = np.random.default_rng(5)
    for _ in range(4):
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        point = mesh.vertices.mean(axis=0) + rng.normal(size=3)
        lines = trimesh.intersections.mesh_plane(reference, plane_normal=normal, plane_origin=point)
        curves = intersect(mesh, Plane(tuple(point), tuple(normal)))
        assert sum(c.length_mm for c in curves) == pytest.approx(
            np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum(), rel=1e-6
        )
        flat = list(polygonize(lines_in_plane(Plane(tuple(point), tuple(normal)), lines)))
        assert area(curves) == pytest.approx(even_odd_area(flat), rel=1e-6)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(2.0, 60.0), st.booleans())
def test_convex_solids_by_quadrature(seed, radius, integers):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-30, 30, size=(12, 3)) + np.array([15.0, 0, 0])
    if integers:  # many vertical edges, coincident heights, vertices on one another's level
        points = np.round(points / 10) * 10
    try:
        hull = ConvexHull(points)
    except Exception:  # noqa: BLE001  a flat cloud has no hull
        return
    mesh = from_manifold(manifold3d.Manifold.hull_points([tuple(p) for p in points]))
    curves = intersect(mesh, Cylinder(AXIS, radius))
    angles = (np.arange(100_000) + 0.5) / 100_000 * 2 * np.pi
    a, b = hull.equations[:, :3], hull.equations[:, 3]
    lateral = a[:, :1] * radius * np.cos(angles) + a[:, 1:2] * radius * np.sin(angles) + b[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        level = -lateral / a[:, 2:3]
    up, down, side = a[:, 2] > 1e-12, a[:, 2] < -1e-12, np.abs(a[:, 2]) <= 1e-12
    height = level[up].min(axis=0) - level[down].max(axis=0)
    height[(lateral[side] > 0).any(axis=0)] = 0.0
    exact = np.maximum(height, 0).mean() * 2 * np.pi * radius
    assert area(curves) == pytest.approx(exact, rel=2e-3, abs=0.4)
    for curve in curves:
        assert np.abs(np.hypot(curve.points[:, 0], curve.points[:, 1]) - radius).max() < 1e-6
        assert (a @ curve.points.T + b[:, None]).max() < 1e-6


@settings(max_examples=25, deadline=None)
@given(st.floats(-3.2, 3.2), st.floats(20.0, 50.0))
def test_turning_the_solid_turns_the_curves(angle, radius):
    still, turned = (
        intersect(blade(8, 8), Cylinder(AXIS, radius)),
        intersect(rotated(blade(8, 8), angle), Cylinder(AXIS, radius)),
    )
    assert len(still) == len(turned)
    assert area(turned) == pytest.approx(area(still), rel=1e-6)
    assert sum(c.length_mm for c in turned) == pytest.approx(sum(c.length_mm for c in still), rel=1e-5)


def test_chain_refuses_pieces_that_do_not_close():
    with pytest.raises(AssertionError, match="not closed"):
        chain(np.array([0, 1]), np.array([1, 2]))


def test_area_under_a_slanted_face_is_exact_not_that_of_the_polyline():
    points = [(x, y, z) for x in (10, 40) for y in (-6.0, 9.0) for z in (-8.0, 1.5 * x + 0.7 * y)]
    mesh = from_manifold(manifold3d.Manifold.hull_points(points))
    r = 25.0
    low, high = -np.arcsin(6 / r), np.arcsin(9 / r)
    exact = quad(lambda t: (1.5 * r * np.cos(t) + 0.7 * r * np.sin(t) + 8) * r, low, high)[0]
    (coarse,) = intersect(mesh, Cylinder(AXIS, r), tolerance_mm=0.5)
    assert coarse.area_mm2 == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("slope", [2.0, 20.0, 300.0])
def test_steep_faces_are_sampled_where_their_ellipse_turns(slope):
    # a wall z = slope (x - 22): its arc on the cylinder runs up, turns at angle 0 and comes down
    low, high = slope * (24.5 - 22), slope * (25.5 - 22)
    points = [(22 + z / slope, y, z) for y in (-9, 9) for z in (low, high)]
    points += [(40, y, z) for y in (-9, 9) for z in (low, high)]
    mesh, surface = from_manifold(manifold3d.Manifold.hull_points(points)), Cylinder(AXIS, 25.0)
    curves, finer = intersect(mesh, surface, 0.02), intersect(mesh, surface, 2e-5)
    assert len(curves) == len(finer) == 1
    assert chord_error(surface, curves[0], finer[0]) <= 0.02
    assert off_mesh(mesh, curves[0].points) < 1e-6


def one_face(corners) -> tuple[Mesh, np.ndarray]:
    return Mesh("one", corners[0], np.array([[0, 1, 2]])), np.array([0])


def test_a_circle_all_but_grazed_by_an_edge_keeps_its_full_turn():
    # a triangle that holds the circle but for a sliver which its lower edge cuts off
    corners = np.array([[[-60, -10, 0], [60, -10, 0], [0, 90, 0.0]]])
    start, end, radius = np.array([0]), np.array([1]), np.array([10.0])
    nodes = np.array([[-1e-6, -10, 0], [1e-6, -10, 0.0]])
    whole = sample_arcs(AXIS, radius, *one_face(corners), start, end, nodes, 0.01)
    assert abs(whole.turn[0]) == pytest.approx(2 * np.pi, abs=1e-6)
    # and the triangle below that edge, which holds only the sliver
    below = corners * [1, -1, 1] - [0, 20, 0]
    sliver = sample_arcs(AXIS, radius, *one_face(below), start, end, nodes, 0.01)
    assert abs(sliver.turn[0]) < 1e-6
    # even where rounding has put its two ends in the wrong order
    swapped = sample_arcs(AXIS, radius, *one_face(below), end, start, nodes, 0.01)
    assert abs(swapped.turn[0]) < 1e-6
