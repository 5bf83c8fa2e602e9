"""The closest point of a triangle, for many pairs at once; the least value of a distance over triangles.

Use:

    closest_on_triangles(points, triangles)      # (n, 3) and (n, 3, 3) -> (n, 3)
    least_over_triangles(triangles, distance)    # distance: (n, 3) -> (n,)
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from .solid import Floats

LEAST_SPHERE_MM, MOST_SPHERES = 0.02, 4000  # of the search for the least distance of triangles


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


def least_over_triangles(triangles: Floats, distance: Callable[[Floats], Floats]) -> float:
    """Least value of a distance over triangles, corners and insides: those that may hold a nearer point go in four.

    Args:
        triangles: (n, 3, 3) corners, mm.
        distance: of points (n, 3) from something, mm; it changes by no more than a point moves.

    Returns:
        The least distance, mm, never negative; up to LEAST_SPHERE_MM² over the least radius of curvature too large.
    """
    least = float(distance(triangles.reshape(-1, 3)).min())
    while len(triangles) and least > 0:
        centre = triangles.mean(axis=1)
        radius = np.sqrt(((triangles - centre[:, None]) ** 2).sum(axis=2).max(axis=1))
        height = distance(centre)
        least = min(least, float(height.min()), float(distance(triangles.reshape(-1, 3)).min()))
        near = np.flatnonzero((height - radius < least) & (radius > LEAST_SPHERE_MM))
        near = near[np.argsort((height - radius)[near])[:MOST_SPHERES]]
        a, b, c = (triangles[near, k] for k in range(3))
        ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
        parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        triangles = np.concatenate([np.stack(part, axis=1) for part in parts])
    return max(least, 0.0)
