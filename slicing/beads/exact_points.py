"""Exact points of a curve between two of its fine points: on the layer's surface and on the mesh's face.

    between = point_between(sliced, layer, a, b)
    between(np.array([0.25, 0.5]))                  # (2, 3)

Two neighbouring points of a layer's border lie on one face of the mesh, so the curve between them is where that
face meets the surface. Between points that lie on no common face (lines of infill) it is the chord put onto the
surface.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..layers.layer import SlicedSubVolume
from ..mesh.closest_point import closest_on_triangles
from ..mesh.solid import Floats, Mesh

ON_FACE_MM = 1e-5
GRAZING = 1e-6  # sine² between face and surface below which they are as good as the same
NEWTON_STEPS = 8


def point_between(sliced: SlicedSubVolume, layer: int, a: Floats, b: Floats) -> Callable[[Floats], Floats]:
    """The curve between two neighbouring points of a bead.

    Args:
        sliced: the sub-volume.
        layer: the bead's layer.
        a: (3,) one point, mm.
        b: (3,) the other.

    Returns:
        From shares (n,) of the way to points (n, 3), mm.
    """
    surface = sliced.layers[layer].surface
    face = _common_face(sliced.mesh, a, b)

    def at(share: Floats) -> Floats:
        points = a + share[:, None] * (b - a)
        for _ in range(NEWTON_STEPS):
            away = surface.distance(points)
            if np.abs(away).max(initial=0.0) < 1e-11:
                break
            normals = surface.normals(points)
            if face is None:
                points = points - away[:, None] * normals
                continue
            along = normals - (normals @ face)[:, None] * face
            steep = (along * normals).sum(axis=1)
            along = np.where(steep[:, None] > GRAZING, along / np.maximum(steep, GRAZING)[:, None], normals)
            points = points - away[:, None] * along
        return points

    return at


def _common_face(mesh: Mesh, a: Floats, b: Floats) -> Floats | None:
    """Unit normal of a face that holds both points, or None."""
    centres, radii = mesh.bounding_spheres
    middle = 0.5 * (a + b)
    near = np.flatnonzero(((centres - middle) ** 2).sum(axis=1) <= (radii + ON_FACE_MM) ** 2)
    if len(near) == 0:
        return None
    triangles = mesh.vertices[mesh.faces[near]]
    away = np.zeros(len(near))
    for point in (a, b):
        held = np.broadcast_to(point, (len(near), 3))
        away = np.maximum(away, np.sqrt(((closest_on_triangles(held, triangles) - held) ** 2).sum(axis=1)))
    best = int(np.argmin(away))
    if away[best] > ON_FACE_MM:
        return None
    normal = mesh.normals[near[best]]
    return np.asarray(normal / np.sqrt((normal**2).sum()))
