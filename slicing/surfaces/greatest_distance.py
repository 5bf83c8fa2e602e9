"""How far a mesh reaches off a surface: its corners tell of convex bodies, of grooved ones they do not.

    greatest_distance(body.surface, mesh.vertices[mesh.faces])

The distance from a convex body grows outwards along any line, so that no point of a triangle lies further off than its
corners. In a groove the middle of a triangle may lie far off the walls that its corners are at. There triangles are
quartered where they may reach further than what is known.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from .offsets import Offsets

FINE_MM = 1e-3  # by which the distance may be more than what is found
COARSE_MM = 0.5  # triangles smaller than this are followed only where the distance is greatest
MOST_FINE, MOST_COARSE = 256, 200_000  # triangles that are followed


def greatest_distance(surface: Offsets, triangles: Floats) -> float:
    """Greatest signed distance of triangles' points from a surface, mm.

    Args:
        surface: that it is measured from.
        triangles: their corners, (n, 3, 3), mm.

    Returns:
        The distance of one of their points.
    """
    best = float(surface.distance(triangles.reshape(-1, 3)).max())
    if not surface.bends:
        return best
    while len(triangles):
        middle = triangles.mean(axis=1)
        size = np.linalg.norm(triangles - middle[:, None], axis=2).max(axis=1)
        away = surface.distance(middle)
        best = max(best, float(away.max()))
        order = np.argsort(-(away + size), kind="stable")
        further = order[(away + size)[order] > best + FINE_MM]
        most = MOST_COARSE if size[further].max(initial=0.0) > COARSE_MM else MOST_FINE
        triangles = _quartered(triangles[further[:most]])
    return best


def _quartered(triangles: Floats) -> Floats:
    a, b, c = (triangles[:, k] for k in range(3))
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    return np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
