"""One mesh into body and sub-volumes: what is found, that it is exact, and what is refused."""

from __future__ import annotations

import math
import sys
from functools import cache

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from manifold3d import Manifold
from support.parts.meshes import box_section, box_solid, from_manifold
from support.parts.simple_parts import ROUND, boss, cylinder, footprint_area, shaft, three_boxes, volumes
from support.paths import ROOT

from slicing.decomposition.decompose import decompose
from slicing.mesh.load import load_mesh
from slicing.mesh.solid import mesh_from_arrays
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.bodies import CylindricalBody

PARTS = ROOT / "models" / "parts"


QUICK = settings(max_examples=3, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def moved(mesh, motion, name="moved"):
    return mesh_from_arrays(name, mesh.vertices @ motion[:3, :3].T + motion[:3, 3], mesh.faces)


def motion_of(axis, angle_deg, shift) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    motion = np.eye(4)
    direction = np.asarray(axis, float) / np.linalg.norm(axis)
    motion[:3, :3] = Rotation.from_rotvec(math.radians(angle_deg) * direction).as_matrix()
    motion[:3, 3] = shift
    return motion


@pytest.fixture(scope="module")
def propeller():
    return decompose(load_mesh(PARTS / "propeller.stl"))


@pytest.fixture(scope="module")
def blade():
    """The blade as it stands in propeller.stl: rooted in the hub before the two were joined."""
    sys.path.insert(0, str(PARTS))
    try:
        import propeller as builder
    finally:
        sys.path.remove(str(PARTS))
    p = builder.Propeller()
    mesh = builder.blade(p, root_radius=(p.hub_radius + p.bore_radius) / 2)
    return mesh_from_arrays("blade", mesh.vertices.astype(np.float32), mesh.faces)


@cache
def of_the_paper(part):
    return decompose(load_mesh(PARTS / f"{part}.stl"))


def test_propeller_has_five_blades_on_its_hub(propeller):
    assert propeller.body == CylindricalBody(9.7)
    assert [mesh.name for mesh in propeller.sub_volumes] == ["SV1", "SV2", "SV3", "SV4", "SV5"]
    assert propeller.bodies == (CylindricalBody(9.7),) * 5
    assert (propeller.T_part_input == np.eye(4)).all()
    assert propeller.warnings == ()
    assert volumes(propeller) == pytest.approx([load_mesh(PARTS / "propeller_blade.stl").volume] * 5, rel=5e-4)
    assert propeller.body_mesh.volume == pytest.approx(load_mesh(PARTS / "propeller_hub.stl").volume, rel=1e-4)
    middles = [mesh.vertices.mean(axis=0) for mesh in propeller.sub_volumes]
    azimuths = [math.degrees(math.atan2(m[1], m[0])) % 360 for m in middles]
    assert azimuths == pytest.approx([54, 126, 198, 270, 342], abs=0.1)


@pytest.mark.parametrize(
    "strategy", [*(pytest.param(name, marks=pytest.mark.slow) for name in ("planar", "cylindrical")), "nonuniform"]
)
def test_a_found_blade_is_sliced_as_the_blade_itself(propeller, blade, strategy):
    parameters = SlicingParameters(strategy)
    found = slice_sub_volume(propeller.sub_volumes[3], propeller.bodies[3], parameters)
    alone = slice_sub_volume(blade, CylindricalBody(9.7), parameters)
    assert [la.area_mm2 for la in found.layers] == pytest.approx([la.area_mm2 for la in alone.layers], rel=1e-4)
    given_blade = slice_sub_volume(load_mesh(PARTS / "propeller_blade.stl"), CylindricalBody(9.7), parameters)
    assert len(found.layers) == len(given_blade.layers)
    # that one is built of other rings from root to tip: its areas differ by up to 1.2 %
    areas = [la.area_mm2 for la in given_blade.layers]
    assert [la.area_mm2 for la in found.layers] == pytest.approx(areas, rel=1.5e-2)


def test_all_blades_are_sliced_alike(propeller):
    areas = [
        [layer.area_mm2 for layer in slice_sub_volume(mesh, body, ROUND).layers]
        for mesh, body in zip(propeller.sub_volumes, propeller.bodies, strict=True)
    ]
    assert np.ptp(np.array(areas), axis=0).max() < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("part", "radius", "alone"),
    [("support", 30.0, ["sv1", "sv2", "sv3"]), ("boiler", 37.2, ["sv1", "sv2"]), ("valve", 74.3, ["sv1"])],
)
def test_other_parts_of_the_paper(part, radius, alone):
    path = PARTS / f"{part}.stl"
    if not path.exists():
        pytest.skip(f"{path.name} is not built")
    parts = of_the_paper(part)
    assert parts.body == CylindricalBody(radius)
    for name in alone:
        mesh = load_mesh(PARTS / f"{part}_{name}.stl")
        found = min(parts.sub_volumes, key=lambda sub: abs(sub.volume - mesh.volume))
        assert found.volume == pytest.approx(mesh.volume, rel=5e-3)  # its root is of few, deep facets
        layers = [slice_sub_volume(sub, parts.body, ROUND).layers for sub in (found, mesh)]
        assert [la.area_mm2 for la in layers[0]] == pytest.approx([la.area_mm2 for la in layers[1]], rel=1e-3)


@pytest.mark.slow
def test_end_flanges_of_the_valve_are_rings_on_its_body():
    path = PARTS / "valve.stl"
    if not path.exists():
        pytest.skip(f"{path.name} is not built")
    parts = of_the_paper("valve")
    assert len(parts.sub_volumes) == 3
    assert parts.sub_volumes[0].volume == pytest.approx(parts.sub_volumes[2].volume, rel=1e-5)
    # they are oval: the body's end is not seen, but goes on through them
    assert np.allclose(parts.outline.points, [(74.3, 0), (74.3, 200)], atol=1e-5)
    for k in (0, 2):
        assert footprint_area(parts, k) == pytest.approx(2 * math.pi * 74.3 * 18, rel=1e-5)


def test_square_flanges_are_cut_at_the_body_as_well():
    plate = box_solid((-30, -30, 0), (30, 30, 6))
    solid = shaft() + plate + plate.translate((0, 0, 40)) + plate.translate((0, 0, 94)) - cylinder(8, -1, 101)
    parts = decompose(from_manifold(solid, "part"))
    assert volumes(parts) == pytest.approx([6 * (3600 - math.pi * 400)] * 3, rel=1e-4)
    assert parts.body_mesh.volume == pytest.approx(math.pi * (400 - 64) * 100, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("sides", [16, 24, 100, 200])
def test_the_footprint_is_exact_however_coarse_the_body(sides):
    parts = decompose(from_manifold(three_boxes(sides), "part"))
    assert parts.body == CylindricalBody(20.0)
    # by height: +y box (z 30), +x box (z 38), -x box (z 65)
    for k, (width, height) in enumerate([(10, 20), (12, 16), (10, 10)]):
        layers = slice_sub_volume(parts.sub_volumes[k], parts.bodies[k], ROUND).layers
        for layer in layers[:5]:
            assert layer.area_mm2 == pytest.approx(box_section(width, height, layer.surface.radius), rel=5e-5)
    assert any("polygon of about" in line for line in parts.warnings) == (sides < 32)


def test_roots_lie_on_the_body_and_nothing_of_it_is_left(boxes):
    parts = decompose(boxes)
    for mesh in parts.sub_volumes:
        away = np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1])
        assert away.min() == pytest.approx(20.0, abs=1e-9)
        root = np.flatnonzero(np.abs(away - 20.0) < 1e-9)
        assert len(root) > 8
    total = parts.body_mesh.volume + sum(volumes(parts))
    assert total == pytest.approx(boxes.volume, rel=1e-6)
    assert parts.body_mesh.volume == pytest.approx(from_manifold(shaft()).volume, rel=1e-4)


@pytest.mark.slow
def test_a_refined_mesh_gives_the_same(plain):
    fine = decompose(from_manifold(three_boxes().refine(4), "fine"))
    assert fine.body == plain.body
    assert volumes(fine) == pytest.approx(volumes(plain), rel=1e-5)
    assert [footprint_area(fine, k) for k in range(3)] == pytest.approx(
        [footprint_area(plain, k) for k in range(3)], rel=1e-5
    )


def test_a_body_of_scattered_triangles():
    rng = np.random.default_rng(3)
    angle, z = rng.uniform(0, 2 * np.pi, 1500), rng.uniform(0, 100, 1500)
    angle[:200], z[:100], z[100:200] = np.tile(np.linspace(0, 2 * np.pi, 100, endpoint=False), 2), 0, 100
    hull = Manifold.hull_points(np.column_stack([20 * np.cos(angle), 20 * np.sin(angle), z]))
    parts = decompose(from_manifold(hull + box_solid((10, -6, 30), (40, 6, 46)), "scattered"))
    assert parts.body == CylindricalBody(20.0)
    assert footprint_area(parts) == pytest.approx(box_section(12, 16, 20.0), rel=5e-5)


@pytest.mark.slow
def test_a_measured_mesh_with_noise():
    mesh = from_manifold(three_boxes(64).refine_to_length(5.0))
    rng = np.random.default_rng(5)
    noisy = mesh_from_arrays("scan", mesh.vertices + rng.normal(0, 0.005, mesh.vertices.shape), mesh.faces)
    parts = decompose(noisy)
    assert parts.body.radius_mm == pytest.approx(20.0, abs=0.03)
    assert (parts.T_part_input == np.eye(4)).all()
    assert volumes(parts) == pytest.approx(volumes(decompose(mesh)), rel=5e-3)


def test_the_frame_is_kept_where_the_axis_is_parallel_to_z(boxes, plain):
    parts = decompose(moved(boxes, motion_of((0, 0, 1), 0, (100, 200, -30))))
    assert parts.body == CylindricalBody(20.0, (100.0, 200.0))
    assert (parts.T_part_input == np.eye(4)).all()
    assert volumes(parts) == pytest.approx(volumes(plain), rel=1e-6)
    assert [footprint_area(parts, k) for k in range(3)] == pytest.approx(
        [footprint_area(plain, k) for k in range(3)], rel=1e-6
    )


def test_upside_down_is_parallel_to_z(boxes, plain):
    parts = decompose(moved(boxes, motion_of((1, 0, 0), 180, (0, 0, 100))))
    assert (parts.T_part_input == np.eye(4)).all()
    assert volumes(parts) == pytest.approx(volumes(plain)[::-1], rel=1e-5)


@QUICK
@given(
    axis=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v[:2]) > 0.3),
    angle=st.floats(20, 160),
    shift=st.tuples(*[st.floats(-300, 300)] * 3),
)
def test_a_tilted_part_is_brought_back(boxes, plain, axis, angle, shift):
    parts = decompose(moved(boxes, motion_of(axis, angle, shift)))
    T = parts.T_part_input
    assert np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-12)
    assert np.linalg.det(T[:3, :3]) == pytest.approx(1.0)
    up = T[:3, :3] @ motion_of(axis, angle, shift)[:3, 2]
    assert np.abs(up) == pytest.approx([0, 0, 1], abs=1e-6)  # the shaft's axis is along z again
    base = T @ np.append(motion_of(axis, angle, shift)[:3, 3], 1.0)
    assert base[:2] == pytest.approx([0, 0], abs=1e-5)
    assert parts.body == CylindricalBody(20.0)
    assert volumes(parts) == pytest.approx(volumes(plain)[:: 1 if up[2] > 0 else -1], rel=1e-5)


@QUICK
@given(seed=st.integers(0, 2**32 - 1))
def test_shuffled_faces_and_vertices_change_nothing(boxes, plain, seed):
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(boxes.vertices))
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    faces = number[boxes.faces[rng.permutation(len(boxes.faces))]]
    faces = np.take_along_axis(faces, (rng.integers(0, 3, len(faces))[:, None] + np.arange(3)) % 3, axis=1)
    parts = decompose(mesh_from_arrays("shuffled", boxes.vertices[order], faces))
    assert parts.body == plain.body
    assert parts.bodies == plain.bodies
    assert (parts.T_part_input == plain.T_part_input).all()
    assert volumes(parts) == pytest.approx(volumes(plain), rel=1e-6)


@QUICK
@given(turn=st.floats(-180, 180))
def test_turning_about_the_axis_turns_the_sub_volumes(boxes, plain, turn):
    motion = motion_of((0, 0, 1), turn, (0, 0, 0))
    parts = decompose(moved(boxes, motion))
    assert parts.body == plain.body
    for before, after in zip(plain.sub_volumes, parts.sub_volumes, strict=True):  # all at different heights
        assert after.volume == pytest.approx(before.volume, rel=1e-5)
        ends = [mesh.vertices[:, 2] for mesh in (before, after)]
        assert [ends[1].min(), ends[1].max()] == pytest.approx([ends[0].min(), ends[0].max()], abs=1e-3)
        top = before.vertices[np.hypot(*before.vertices[:, :2].T) > 25] @ motion[:3, :3].T
        gaps = np.linalg.norm(top[:, None] - after.vertices[None], axis=2).min(axis=1)
        assert gaps.max() < 1e-6


@QUICK
@given(azimuths=st.lists(st.integers(0, 71), min_size=1, max_size=5, unique=True))
def test_order_at_one_height_is_counter_clockwise_from_x(azimuths):
    degrees = [5 * a for a in azimuths]
    degrees = [d for k, d in enumerate(degrees) if all(abs((d - e + 180) % 360 - 180) > 28 for e in degrees[:k])]
    solid = sum((boss(4, 32, d, 50) for d in degrees), shaft(72))
    parts = decompose(from_manifold(solid, "part"))
    middles = [mesh.vertices.mean(axis=0) for mesh in parts.sub_volumes]
    found = [math.degrees(math.atan2(y, x)) % 360 for x, y, _ in middles]
    assert [round(f) % 360 for f in found] == sorted(degrees)
