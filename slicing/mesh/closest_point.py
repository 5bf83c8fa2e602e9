"""The closest point of a triangle, for many pairs at once.

Use:

    closest_on_triangles(points, triangles)      # (n, 3) and (n, 3, 3) -> (n, 3)
"""

from __future__ import annotations

import numpy as np

from .solid import Floats


def closest_on_triangles(points: Floats, triangles: Floats) -> Floats:
    """Closest points of triangles to points, pair by pair.

    Args:
        points: (n, 3) mm.
        triangles: (n, 3, 3) corners, mm.

    Returns:
        (n, 3) mm: the foot of the perpendicular where it falls into the triangle, else the nearest point of a
        side.
    """
    best = np.empty_like(points)
    least = np.full(len(points), np.inf)
    for k in range(3):
        start = triangles[:, k]
        along = triangles[:, (k + 1) % 3] - start
        length2 = (along**2).sum(axis=1)
        t = np.clip(((points - start) * along).sum(axis=1) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
        foot = start + t[:, None] * along
        distance = ((points - foot) ** 2).sum(axis=1)
        best = np.where((distance < least)[:, None], foot, best)
        least = np.minimum(least, distance)
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    size2 = (normal**2).sum(axis=1)
    height = ((points - triangles[:, 0]) * normal).sum(axis=1) / np.where(size2 > 0, size2, 1.0)
    foot = points - height[:, None] * normal
    inside = size2 > 0
    for k in range(3):
        side = triangles[:, (k + 1) % 3] - triangles[:, k]
        inside &= (np.cross(side, foot - triangles[:, k]) * normal).sum(axis=1) >= 0
    return np.where(inside[:, None], foot, best)
