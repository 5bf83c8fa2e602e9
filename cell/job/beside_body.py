"""Solids of a part beside its body of revolution, as convex pieces for collisions.

    pieces_beside(part.beside_profile)        # {"body/beside_0/0": (k, 3), ..}

A part in one mesh is taken apart into a body of revolution and sub-volumes. Solids that are neither, on the
body's ends or beside it, are there from the start like the body itself. Millimetres.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ik.chain import Floats
from slicing import Mesh, convex_hull

from ..mjcf.convex_pieces import CORNERS, convex_pieces

PADDED_MM = 0.05  # by which what has no volume to speak of is made thicker
FLAT = 1e-4  # thickness over length, below which it has none


def pieces_beside(solids: Sequence[Mesh]) -> dict[str, Floats]:
    """Vertices of convex pieces that hold some solids, by geom name.

    Args:
        solids: closed, part frame, mm.
    """
    return {f"body/beside_{k}/{i}": p for k, one in enumerate(solids) for i, p in enumerate(_pieces(one))}


def _pieces(solid: Mesh) -> Iterator[Floats]:
    import trimesh  # heavy: only where there is something beside the body

    try:
        found = convex_pieces(trimesh.Trimesh(solid.vertices, solid.faces, process=False)).pieces
    except ValueError:  # a part of it is too thin to be cut
        found = (np.asarray(solid.vertices),)
    for points in found:
        spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
        if spread[2] < FLAT * spread[0]:
            points = (points[:, None] + PADDED_MM * CORNERS).reshape(-1, 3)
        yield convex_hull(points)[0]
