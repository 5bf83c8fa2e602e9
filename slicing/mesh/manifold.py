"""Meshes as solids of manifold3d, which cuts and unites them, and back.

    cut = manifold_of(vertices, faces, "part") - cutter
    vertices, faces = triangles_of(cut)

Lengths in mm.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Floats, Ints, PartError


def manifold_of(vertices: Floats, faces: Ints, name: str) -> Any:
    """A closed mesh as a solid.

    Args:
        vertices: (n, 3) mm.
        faces: (m, 3), outward.
        name: of the mesh, for the message.

    Returns:
        The solid (`manifold3d.Manifold`); empty if the mesh has no faces or encloses nothing.

    Raises:
        PartError: manifold3d does not take it. Without this check its result would be an empty solid.
    """
    import manifold3d  # heavy: only where solids are cut

    # copies: manifold3d takes no arrays that are read-only
    data = manifold3d.Mesh64(np.array(vertices, np.float64, order="C"), np.array(faces, np.uint64, order="C"))
    solid = manifold3d.Manifold(data)
    if solid.status() != manifold3d.Error.NoError:
        raise PartError(f"{name}: the mesh does not bound a solid (manifold3d: {solid.status().name})")
    return solid


def triangles_of(solid: Any) -> tuple[Floats, Ints]:
    """The surface of a solid.

    Args:
        solid: of manifold3d, in mm.

    Returns:
        Vertices (n, 3), mm, and outward faces (m, 3).
    """
    data = solid.to_mesh64()
    return np.asarray(data.vert_properties, dtype=np.float64)[:, :3], np.asarray(data.tri_verts).astype(np.int64)
