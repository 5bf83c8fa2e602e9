"""What goes right round a body and is lower than it is long: turned steps, threads, the skin of a ball.

    is_turned_step(piece, vertices, skin, outline)   # of a solid that was cut off the outline; frame: z is the axis

The outline of a body is made of cylinders and cones (`slicing.decomposition.outline`). A thread's ridge is none of
these, and neither is a ball of scattered facets: what the outline lacks of them is cut off as a piece. Such a piece is
a step of the body, as a low ring is: its skin is turned about the axis, it is there in every direction, and in no
section along the axis does it stand out farther than it is long; of a thread its foot counts. An auger's flight stands
out farther, and a sub-volume it remains.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..mesh.face_measures import face_normals
from ..mesh.solid import Floats, Ints
from .outline import Outline

DIRECTIONS = 24  # about the axis in which a piece must be there
MOST_ASIDE = math.sin(math.radians(20.0))  # of a unit normal that may point round the axis at a face's corners
TURNED_SHARE = 0.9  # of the skin that must be turned
FOOT = 0.1  # of its height: as near the body as this is its foot
LEAST_HIGH = 0.02  # of the greatest height: lower bits of a section do not count


def is_turned_step(piece: Any, vertices: Floats, skin: Ints, outline: Outline) -> bool:
    """Whether a piece is a step of the body and no sub-volume that stands on it.

    Args:
        piece: a solid (manifold3d) that was cut off the outline; z is the axis.
        vertices: (n, 3) of its mesh, mm.
        skin: (m, 3) faces that were not made by the cut, outward.
        outline: of the body.
    """
    corners = vertices[skin]
    azimuth = np.arctan2(corners[..., 1], corners[..., 0])
    twelfths = np.floor(azimuth * (0.5 * DIRECTIONS / np.pi)).astype(np.int64)
    if len(np.unique(twelfths.clip(-DIRECTIONS // 2, DIRECTIONS // 2 - 1))) < DIRECTIONS:
        return False
    return is_turned(vertices, skin) and _low_all_round(piece, outline)


def is_turned(vertices: Floats, skin: Ints) -> bool:
    """Whether a skin looks along planes through the axis, as what is turned does.

    Args:
        vertices: (n, 3) mm, z the axis.
        skin: (m, 3) faces, outward.
    """
    return _turned_share(vertices, skin) >= TURNED_SHARE


def _turned_share(vertices: Floats, skin: Ints) -> float:
    """Share of the skin whose faces look along planes through the axis."""
    corners = vertices[skin]
    normal = face_normals(vertices, skin)
    area = np.sqrt((normal**2).sum(axis=1))
    away = np.maximum(np.hypot(corners[..., 0], corners[..., 1]), 1e-300)
    aside = np.abs(corners[..., 0] * normal[:, None, 1] - corners[..., 1] * normal[:, None, 0]) / away
    turned = (aside <= MOST_ASIDE * area[:, None]).all(axis=1)
    return float(area[turned].sum() / max(area.sum(), 1e-300))


def _low_all_round(piece: Any, outline: Outline) -> bool:
    """In planes through the axis the piece is there in every direction, and nowhere higher than its foot is wide."""
    sections = [_sections(piece, 360.0 * (k + 0.37) / DIRECTIONS) for k in range(DIRECTIONS)]
    if not all(sections):
        return False
    measured = [_size(loop, outline) for loops in sections for loop in loops]
    # a ring's length is that at half its height, as of the outline's flanges; a thread's that of its foot
    wound = any(len(loops) > 1 for loops in sections)
    most = max(size.height for size in measured)
    return all(size.height <= max(size.foot if wound else size.mean, LEAST_HIGH * most) for size in measured)


def _sections(solid: Any, turn_deg: float) -> list[Floats]:
    """Borders (n, 2) of a solid's section by the half plane from the axis in a direction: (r, z) in mm."""
    upright = solid.rotate((0.0, 0.0, -turn_deg)).rotate((-90.0, 0.0, 0.0)).slice(0.0)
    loops = [np.asarray(loop) for loop in upright.to_polygons()]
    return [loop for loop in loops if loop[:, 0].mean() > 0.0]


@dataclass(frozen=True)
class _Size:
    """Of a section, mm: how far it stands out, how wide it is where it stands, and in the mean."""

    height: float
    foot: float
    mean: float


def _size(loop: Floats, outline: Outline) -> _Size:
    ends = np.roll(loop, -1, axis=0)
    share = np.linspace(0.0, 1.0, 17)[:, None, None]
    points = (loop + share * (ends - loop)).reshape(-1, 2)
    off = outline.off(points[:, 0], points[:, 1])
    height = float(off.max())
    foot = points[off <= FOOT * height, 1]
    area = 0.5 * abs(float((loop[:, 0] * ends[:, 1] - loop[:, 1] * ends[:, 0]).sum()))
    return _Size(height, float(np.ptp(foot)) if len(foot) else 0.0, area / max(height, 1e-12))
