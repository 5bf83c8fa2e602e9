"""Whether points are inside deposits."""

from __future__ import annotations

import numpy as np


def inside(solids, points):
    found = np.zeros(len(points), dtype=bool)
    for s in solids:
        found |= (points @ s.face_normals.T - np.einsum("ij,ij->i", s.face_normals, s.triangles_center)).max(
            axis=1
        ) < 1e-6
    return found
