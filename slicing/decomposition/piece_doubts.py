"""Pieces that may be the body itself: what surrounds it like a bar, and what is lower than the body is uneven.

    lines = doubtful_pieces("part", pieces, outline, extent)     # [] where nothing is

A bar that is not round, with a round spigot at its end, is found as a spigot with one large sub-volume round its foot;
the rounded edges of an octagonal bar stand out of the cylinder that fits it best. Neither can be told from what is
meant to stand on a round body by its shape alone: both are reported.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..arrays import Floats
from ..mesh.face_measures import face_normals
from ..warning import Code, Warning
from .cut import CutPiece
from .evidence_warnings import full_volume, volume_of
from .outline import Outline

FULL_TURN = 0.98  # of the body's surface between a root's ends that the root holds where it goes right round
LARGE = 0.15  # of the body's volume, of a piece that may be the bar of which the body is the spigot
UNEVEN = 2.0  # times how far a body's facets lie inside it: what stands out less may be part of its skin
ALIKE, DIFFERENT = 0.03, 3e-3  # of the volume: pieces that are meant to be alike, and are not
SAME_PLACE = 2e-3  # of the extent: heights and distances from the axis of pieces that are alike
SEVERAL = 3  # pieces so low are no accident: the edges of a bar


def doubtful_pieces(
    name: str, pieces: Sequence[CutPiece], outline: Outline, extent: float, given: bool = False
) -> list[Warning]:
    """Lines about pieces that may belong to the body.

    Args:
        name: of the part.
        pieces: cut off the outline, SV1 first, in its frame.
        outline: of the body, z its axis.
        extent: of the part, mm.
        given: whether the body's radius was given, so that it is not in doubt.

    Returns:
        One typed warning a doubt.
    """
    alike = _unlike_pieces(pieces, extent)
    return alike if given else [*alike, *_bar_around(name, pieces, outline), *_uneven_body(name, pieces, outline)]


def _bar_around(name: str, pieces: Sequence[CutPiece], outline: Outline) -> list[Warning]:
    """A line for each piece that surrounds the body on a stretch longer than it stands out, and is large."""
    whole = full_volume(outline)
    lines = []
    for k, piece in enumerate(pieces):
        volume = volume_of(piece)
        if volume < LARGE * whole:
            continue
        normal = face_normals(piece.vertices, piece.faces[piece.root])
        heights = piece.vertices[piece.faces[piece.root], 2]
        low, high = float(heights.min()), float(heights.max())
        levels = np.linspace(low, high, 65)
        radii = outline.radius_at(0.5 * (levels[1:] + levels[:-1]))
        radius, length = float(radii.mean()), high - low
        side = float(np.hypot(normal[:, 0], normal[:, 1]).sum()) / 2  # of the root, seen from the axis
        out = math.sqrt(volume / (math.pi * length) + radius**2) - radius
        if side < FULL_TURN * 2 * math.pi * radius * length or out > length:
            continue
        text = (
            f"{name}: SV{k + 1} goes right round the body (radius {radius:.6g} mm) along {length:.4g} mm of its"
            f" {outline.high - outline.low:.4g} mm and stands out {out:.3g} mm on average. It may be a bar "
            "that is not round, whose"
            " spigot was taken for the body (if so, part.body.radius_mm sets the body)"
        )
        lines.append(Warning(Code.BODY_RIVAL, text, sub_volume=f"SV{k + 1}"))
    return lines


def _uneven_body(name: str, pieces: Sequence[CutPiece], outline: Outline) -> list[Warning]:
    """A line where several pieces stand out about as little as the body's own facets lie inside it."""
    low = [k for k, piece in enumerate(pieces) if 0.0 < _height(piece.vertices, outline) < _unevenness(piece, outline)]
    if len(low) < SEVERAL:
        return []
    most = max(_height(pieces[k].vertices, outline) for k in low)
    flat = max(_unevenness(pieces[k], outline) for k in low) / UNEVEN
    text = (
        f"{name}: the body's radius is uncertain: {len(low)} sub-volumes stand out by {most:.3g} mm at "
        "most, and the body's"
        f" own facets lie {flat:.3g} mm inside it. The bar may not be round (part.body.radius_mm sets its radius)"
    )
    return [Warning(Code.BODY_RADIUS, text, sub_volume=f"SV{low[0] + 1}")]


def _height(vertices: Floats, outline: Outline) -> float:
    """How far a piece stands out, mm."""
    return float(outline.off(np.hypot(vertices[:, 0], vertices[:, 1]), vertices[:, 2]).max())


def _unevenness(piece: CutPiece, outline: Outline) -> float:
    """What a piece must stand out to be told from the facets of the body below it, mm."""
    where = np.unique(outline.section_at(piece.vertices[piece.faces[piece.root], 2].mean(axis=1)))
    return UNEVEN * max((outline.sections[k].flat_mm for k in where), default=0.0)


def _unlike_pieces(pieces: Sequence[CutPiece], extent: float) -> list[Warning]:
    """A line where pieces that stand alike round the axis are not of one volume."""
    if len(pieces) < 2:
        return []
    volume = np.array([volume_of(piece) for piece in pieces])
    centre = np.array([piece.centroid for piece in pieces])
    place = np.column_stack([np.hypot(centre[:, 0], centre[:, 1]), centre[:, 2]])
    tall = np.array([float(np.ptp(piece.vertices[:, 2])) for piece in pieces])
    lines = []
    for k in range(len(pieces)):
        for j in range(k + 1, len(pieces)):
            near = np.abs(place[k] - place[j]).max() <= SAME_PLACE * extent and abs(tall[k] - tall[j]) <= 1e-5 * extent
            apart = abs(volume[k] / volume[j] - 1.0)
            if near and DIFFERENT < apart <= ALIKE:
                lines.append(
                    Warning(
                        Code.BODY_UNLIKE,
                        f"SV{k + 1} and SV{j + 1} stand alike but differ by {100 * apart:.2g} % in volume: the"
                        " body's axis or radius may be wrong",
                        sub_volume=f"SV{k + 1}",
                    )
                )
                return lines
    return lines
