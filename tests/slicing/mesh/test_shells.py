"""Cavities through decomposition, T-vertices, and what repairs say about the volume."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest
import trimesh
from support.parts.meshes import box_solid, from_manifold

from slicing.curves.intersect import intersect
from slicing.decomposition.cut import whole_solids
from slicing.decomposition.decompose import decompose
from slicing.mesh.load import solid_from_arrays
from slicing.mesh.solid import PartError
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.surfaces import Plane
from slicing.warning import Code

POST = manifold3d.Manifold.cylinder(100, 25, 25, 120)
BLOCK = box_solid((0, -15, 20), (70, 15, 60))
CAVITY = box_solid((37, -8, 30), (55, 8, 50))


@pytest.mark.parametrize(("solid", "hollow"), [(CAVITY, 0.0), (CAVITY - box_solid((40, -2, 35), (50, 2, 45)), 400.0)])
def test_a_cavity_stays_in_its_sub_volume(solid, hollow):
    """With an island of 10 x 4 x 10 mm in it as well, which touches nothing."""
    whole = POST + BLOCK - solid
    parts = decompose(from_manifold(whole))
    assert len(parts.warnings) == bool(hollow)  # of the island
    block = max(parts.sub_volumes, key=lambda mesh: mesh.volume)
    assert sum(mesh.volume for mesh in parts.sub_volumes) + parts.body_mesh.volume == pytest.approx(
        whole.volume(), rel=1e-4
    )
    sliced = slice_sub_volume(block, parts.bodies[0], SlicingParameters("planar"))
    for layer in sliced.layers:
        x = layer.surface.point[0]
        if 37.5 < x < 54.5:
            assert layer.area_mm2 == pytest.approx(30 * 40 - 16 * 20, rel=1e-5)
            assert [curve.hole for curve in sorted(layer.curves, key=lambda c: -abs(c.area_mm2))] == [False, True]
        elif 26 < x < 36.5 or x > 55.5:
            assert layer.area_mm2 == pytest.approx(30 * 40, rel=1e-5)


def test_cavities_go_to_the_smallest_solid_around_them():
    shells = [manifold3d.Manifold.cube((size,) * 3, True) for size in (20.0, 16.0, 12.0, 8.0)]
    nested = shells[0] - shells[1] + shells[2] - shells[3] + box_solid((30, 0, 0), (31, 1, 1))
    found = sorted(solid.volume() for solid in whole_solids(nested))
    assert found == pytest.approx([1, 12**3 - 8**3, 20**3 - 16**3])


def divided_on_one_side(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """A box of which single faces are divided at points of their sides, their neighbours not."""
    box = trimesh.creation.box(extents=(40, 10, 30))
    points, faces = box.vertices.tolist(), box.faces.tolist()
    for face in rng.choice(12, count, replace=False).tolist():
        a, b, c = faces[face]
        shares = sorted(rng.uniform(0.1, 0.9, 3))
        chain = [a, *range(len(points), len(points) + 3), b]
        points += [(np.array(points[a]) * (1 - s) + np.array(points[b]) * s).tolist() for s in shares]
        faces[face] = [chain[0], chain[1], c]
        faces += [[chain[k], chain[k + 1], c] for k in range(1, 4)]
    return np.array(points), np.array(faces)


@pytest.mark.parametrize("seed", range(4))
def test_t_vertices_are_divided_at_and_move_nothing(seed):
    points, faces = divided_on_one_side(np.random.default_rng(seed), 6)
    mesh = solid_from_arrays("x", points, faces)
    assert mesh.volume == pytest.approx(12000, rel=1e-12)
    assert np.allclose(np.unique(mesh.vertices, axis=0), np.unique(points, axis=0))
    (line,) = mesh.warnings
    assert line.code == Code.MESH_REPAIRED
    assert "T-vertices" in line


def test_a_vertex_beside_a_side_closes_no_hole():
    points, faces = divided_on_one_side(np.random.default_rng(0), 1)
    points[8:, :] += 0.5  # the new vertices
    with pytest.raises(PartError, match="not closed"):
        solid_from_arrays("x", points, faces)


def test_repairs_say_what_they_do_to_the_volume():
    outer = trimesh.creation.box(extents=(20, 20, 20))
    inner = trimesh.creation.box(extents=(4, 4, 4))
    both = trimesh.util.concatenate([outer, inner])
    assert any(
        "hold these 64 mm³ already" in line for line in solid_from_arrays("x", both.vertices, both.faces).warnings
    )
    (line,) = solid_from_arrays("x", outer.vertices, outer.faces[:, ::-1]).warnings
    assert "(8000 mm³)" in line
    assert line.code == Code.MESH_REPAIRED
    apart = np.concatenate([outer.vertices, outer.vertices[:1] + 0.001])
    faces = outer.faces.copy()
    first = int(np.argmax((faces == 0).any(axis=1)))
    faces[first][faces[first] == 0] = 8
    assert any("mm apart (at most 0." in line for line in solid_from_arrays("x", apart, faces).warnings)


U = np.array([[20, -20], [70, -20], [70, 20], [20, 20], [20, 14], [54, 14], [54, -14], [20, -14]], dtype=float)


@pytest.mark.parametrize("begin", range(8))
def test_concave_ends_divided_as_fans_are_divided_anew(begin):
    """From corners of which the fan lies within the U, leaves it, or has corners in one line with its first one."""
    outline, n = np.roll(U, -begin, axis=0), len(U)
    points = np.concatenate([np.c_[outline, np.zeros(n)], np.c_[outline, np.full(n, 12.0)]])
    fan = np.array([[0, k, k + 1] for k in range(1, n - 1)])
    sides = [[k, (k + 1) % n, (k + 1) % n + n] for k in range(n)] + [[k, (k + 1) % n + n, k + n] for k in range(n)]
    mesh = solid_from_arrays("u", points, np.concatenate([fan[:, ::-1], fan + n, sides]))
    area = 50 * 40 - 34 * 28
    assert mesh.volume == pytest.approx(12 * area, rel=1e-12)
    assert 0.5 * np.abs(mesh.normals[:, 2]).sum() == pytest.approx(2 * area)
    curves = intersect(mesh, Plane((30.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    assert [curve.length_mm for curve in curves] == pytest.approx([36.0, 36.0])
