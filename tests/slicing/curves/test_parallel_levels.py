"""Many levels in one go: the same curves as level by level, for any mesh, and in bounded batches."""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from support.layers.curves import same
from support.parts.meshes import blade, box, subdivided

from slicing.curves import loops as chains
from slicing.curves import parallel_levels as levels
from slicing.curves.intersect import intersect, intersect_offsets
from slicing.mesh.mesh_edges import MeshEdges, edges_of_faces
from slicing.mesh.solid import mesh_from_arrays
from slicing.surfaces.surfaces import Cone, Cylinder, Plane

AXIS = (0.0, 0.0)
STACKS = [
    (Plane((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), np.arange(12.0, 48.0, 1.7)),
    (Plane((15.0, 0.0, 0.0), (0.6, 0.0, 0.8)), np.arange(-9.0, 30.0, 2.3)),
    (Cylinder(AXIS, 12.0), np.arange(0.0, 40.0, 1.7)),
    (Cylinder((26.0, 1.0), 0.5), np.arange(0.0, 30.0, 0.9)),  # its axis passes through faces and dips into edges
]


@pytest.mark.parametrize(("base", "heights"), STACKS)
@pytest.mark.parametrize("solid", [lambda: subdivided(box(), 2), lambda: blade(12, 12)], ids=["box", "blade"])
def test_all_levels_at_once_are_each_level_by_itself(solid, base, heights):
    mesh = solid()
    found = intersect_offsets(mesh, base, heights)
    assert sum(map(len, found)) > 3
    for height, curves in zip(heights, found, strict=True):
        same(curves, intersect(mesh, base.offset(float(height))))


def test_small_batches_change_nothing():
    mesh, (base, heights) = blade(12, 12), STACKS[2]
    whole = intersect_offsets(mesh, base, heights)
    for a, b in zip(levels.level_curves(mesh, base, heights, 0.01, batch=50), whole, strict=True):
        same(a, b)


def test_no_levels_and_levels_that_miss():
    mesh = box()
    assert intersect_offsets(mesh, Cylinder(AXIS, 12.0), []) == []
    assert intersect_offsets(mesh, Cylinder(AXIS, 500.0), [0.0, 1.0]) == [[], []]
    cone = Cone(AXIS, 20.0, 5.0)
    assert [len(c) for c in intersect_offsets(mesh, cone, [0.0, 1e3])] == [len(intersect(mesh, cone)), 0]


def test_levels_through_vertices_and_faces_give_each_loop_once():
    mesh, upwards = mesh_from_arrays("cube", *_cube()), Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    found = intersect_offsets(mesh, upwards, [0, 2.5, 5, 10])
    for curves, area in zip(found, (100, 100, 100, 0), strict=True):
        assert sum(c.area_mm2 for c in curves) == pytest.approx(area)
        assert len(curves) == (area > 0)


def _cube():
    cube = trimesh.creation.box((10, 10, 10))
    cube.apply_translation([0, 0, 5])
    fine = cube.subdivide().subdivide()  # with vertices at z = 0, 2.5, 5 ..
    return fine.vertices, fine.faces


@given(st.integers(1, 60), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_cycles_are_walked_the_same_either_way(n, seed):
    following = np.random.default_rng(seed).permutation(n)
    order, first = chains.cycles(following)
    assert np.array_equal(np.sort(order), np.arange(n))
    for cycle in np.split(order, first[1:]):
        assert np.array_equal(following[cycle], np.roll(cycle, -1))
        assert cycle[0] == cycle.min()
    for ours, theirs in zip((order, first), chains._cycles_in_parallel(following), strict=True):
        assert np.array_equal(ours, theirs)


def test_an_edge_with_four_faces_still_gives_closed_loops():
    # two boxes that share an edge, merged into one vertex list
    a, b = trimesh.creation.box((10, 10, 10)), trimesh.creation.box((10, 10, 10))
    b.apply_translation([10, 10, 0])
    both = trimesh.util.concatenate([a, b])
    both.merge_vertices()
    mesh = mesh_from_arrays("touching", both.vertices, both.faces)
    for curves in intersect_offsets(mesh, Plane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), [-3.3, 0.0, 4.1]):
        assert sum(c.area_mm2 for c in curves) == pytest.approx(200.0)


def test_edges_are_found_by_either_sort_and_open_ones_counted():
    mesh = blade(6, 6)
    edges, of_side = edges_of_faces(len(mesh.vertices), mesh.faces)
    assert 2 * len(edges) == 3 * len(mesh.faces)
    sides = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, axis=1)], axis=2), axis=2)
    assert np.array_equal(edges[of_side], sides)
    # so many vertices that keys and places do not fit into one number: the other way of sorting
    far_edges, far_of_side = edges_of_faces(2**31, mesh.faces)
    assert np.array_equal(far_edges, edges)
    assert np.array_equal(far_of_side, of_side)
    whole, far = MeshEdges.of(len(mesh.vertices), mesh.faces), MeshEdges.of(2**31, mesh.faces)
    assert whole.is_surface
    assert np.array_equal(whole.side, far.side)
    assert np.array_equal(whole.first, far.first)
    open_ = MeshEdges.of(len(mesh.vertices), mesh.faces[1:])
    assert (int((open_.count == 1).sum()), open_.is_closed) == (3, False)
    assert sorted(open_.odd_sides() // 3) == sorted(of for of in range(len(mesh.faces) - 1) if _touches(mesh, of + 1))
    turned = mesh.faces.copy()
    turned[0] = turned[0, ::-1]
    found = MeshEdges.of(len(mesh.vertices), turned)
    assert (int((found.balance != 0).sum()), found.is_closed, found.is_surface) == (3, True, False)
    none = MeshEdges.of(5, np.zeros((0, 3), dtype=np.int64))
    assert len(none.count) == len(none.pairs()) == 0


def _touches(mesh, face):
    """Whether a face has a common edge with face 0."""
    return len(set(mesh.faces[face].tolist()) & set(mesh.faces[0].tolist())) == 2
