"""Convex hulls, without importing SciPy for them.

corners, normals = convex_hull(points)     # (v, 3) and of its faces (f, 3)
normals, offsets = hull_planes(points)     # inside: points @ normals.T <= offsets
"""

from __future__ import annotations

import numpy as np

from .solid import Floats


def convex_hull(points: Floats) -> tuple[Floats, Floats]:
    """Corners and faces of the convex hull of points.

    Args:
        points: (n, 3).

    Returns:
        Its corners (v, 3), and the outward unit normals of its triangles (f, 3). Perhaps none of points in one plane.
    """
    from manifold3d import Manifold

    hull = Manifold.hull_points(points).to_mesh64()
    corners = np.array(hull.vert_properties, dtype=np.float64)[:, :3].copy()  # no view of what the library holds
    a, b, c = (corners[hull.tri_verts[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1)
    return corners, normals[length > 0] / length[length > 0, None]


def hull_planes(points: Floats) -> tuple[Floats, Floats]:
    """Planes that the hull of points lies between.

    Every face of the hull has one. Each holds all of the points, however thin its face is and however badly its normal
    is known for that.

    Args:
        points: (n, 3).

    Returns:
        Outward unit normals (m, 3), and how far along each the points reach (m,). Perhaps none of points in one plane.
    """
    normals = convex_hull(points)[1]
    return normals, (points @ normals.T).max(axis=0, initial=-np.inf)
