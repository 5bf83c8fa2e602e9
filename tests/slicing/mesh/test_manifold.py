"""Meshes as solids of manifold3d."""

from __future__ import annotations

import numpy as np
import pytest
from support.parts.meshes import box

from slicing.errors import PartError
from slicing.mesh.manifold import manifold_of, triangles_of


def test_a_mesh_comes_back_as_it_was():
    mesh = box((0, 0, 0), (3, 4, 5), "block")
    vertices, faces = triangles_of(manifold_of(mesh.vertices, mesh.faces, "block"))
    corners = vertices[faces]
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume == pytest.approx(60)
    assert faces.dtype == np.int64


def test_a_mesh_that_bounds_no_solid_is_refused_and_not_taken_for_an_empty_one():
    mesh = box((0, 0, 0), (3, 4, 5), "block")
    with pytest.raises(PartError, match="block: the mesh does not bound a solid"):
        manifold_of(mesh.vertices, mesh.faces[1:], "block")
