"""Robot targets: points of the layers' curves in the order in which they are deposited.

    targets = sample_targets([sliced], chord_tolerance_mm=0.3, min_segment_mm=3.0)
    targets.position, targets.normal, targets.tangent          # (n, 3) each, part frame

Order: sub-volume, layer, curve. Each curve is one bead (path). Outer loops run counter-clockwise seen from
outside, holes clockwise. A closed bead ends where it starts: its first target is repeated as its last. It
starts (the seam) at the point nearest to a seam of the layer below; in the first layer at its lowest point,
the first of them in the direction of travel. How points are chosen along a curve: `slicing.breakpoints`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slicing.breakpoints import break_points, corner_flags
from slicing.intersect import Curve
from slicing.layers import Layer, SlicedSubVolume
from slicing.part import Bools, Floats, Ints, PartError
from slicing.surfaces import Surface

SAME_HEIGHT_MM = 1e-4


@dataclass(frozen=True, eq=False)
class Targets:
    """Robot targets in the part frame, one a row.

    Attributes:
        sub_volume: names of the sub-volumes.
        sub_volume_index: (n,) which of them.
        layer: (n,) layer number within the sub-volume.
        path: (n,) bead number, counting over the whole part.
        position: (n, 3) mm, on the exact curve.
        normal: (n, 3) unit outward normal of the layer's surface, the direction of deposition.
        tangent: (n, 3) unit direction of travel, across the normal. At a corner that of the outgoing segment;
            at the last target of a bead that ends in a corner, of the incoming one.
        thickness_mm: (n,) of the bead (see `slicing.thickness`).
        closed: (paths,) whether each bead ends where it starts.
    """

    sub_volume: tuple[str, ...]
    sub_volume_index: Ints
    layer: Ints
    path: Ints
    position: Floats
    normal: Floats
    tangent: Floats
    thickness_mm: Floats
    closed: Bools

    def __len__(self) -> int:
        return len(self.path)


@dataclass(frozen=True, eq=False)
class _Bead:
    layer: int
    position: Floats
    normal: Floats
    tangent: Floats
    thickness_mm: Floats
    closed: bool


def sample_targets(
    sliced: Sequence[SlicedSubVolume], chord_tolerance_mm: float = 0.3, min_segment_mm: float = 3.0
) -> Targets:
    """Sample the curves of sliced sub-volumes.

    Args:
        sliced: the sub-volumes in the order of deposition.
        chord_tolerance_mm: greatest distance between a curve and a segment.
        min_segment_mm: least distance between successive targets; wins over the tolerance where the two
            conflict.

    Returns:
        The targets.

    Raises:
        PartError: a tolerance or least segment that is not above 0.

    Source:
        Lettori et al. 2024, section 4 (0.3 mm, 3 mm) and figures 12c and 19.
    """
    for key, value in (("chord_tolerance_mm", chord_tolerance_mm), ("min_segment_mm", min_segment_mm)):
        if not (math.isfinite(value) and value > 0):
            raise PartError(f"{key}: {value} is not allowed; a number above 0 is needed")
    beads = [_beads(sub_volume, chord_tolerance_mm, min_segment_mm) for sub_volume in sliced]
    flat = [(k, bead) for k, some in enumerate(beads) for bead in some]
    size = np.array([len(bead.position) for _, bead in flat], dtype=np.int64)

    def rows(name: str) -> Floats:
        return np.concatenate([np.zeros((0, 3)), *(getattr(bead, name) for _, bead in flat)])

    return Targets(
        tuple(sub_volume.name for sub_volume in sliced),
        np.repeat(np.array([k for k, _ in flat], dtype=np.int64), size),
        np.repeat(np.array([bead.layer for _, bead in flat], dtype=np.int64), size),
        np.repeat(np.arange(len(flat), dtype=np.int64), size),
        rows("position"),
        rows("normal"),
        rows("tangent"),
        np.concatenate([np.zeros(0), *(bead.thickness_mm for _, bead in flat)]),
        np.array([bead.closed for _, bead in flat], dtype=bool),
    )


def _beads(sliced: SlicedSubVolume, chord_tolerance_mm: float, min_segment_mm: float) -> list[_Bead]:
    """The beads of one sub-volume, layer by layer."""
    beads: list[_Bead] = []
    tolerance = max(chord_tolerance_mm - sliced.parameters.tolerance_mm, 0.5 * chord_tolerance_mm)
    seams = np.zeros((0, 3))
    for layer in sliced.layers:
        new = []
        for curve in layer.curves:
            seam = _seam(curve, layer.surface, seams)
            chosen = break_points(curve.points, seam, tolerance, min_segment_mm)
            new.append(_bead(sliced, layer, curve, chosen))
        seams = np.array([bead.position[0] for bead in new])
        beads += new
    return beads


def _seam(curve: Curve, surface: Surface, seams: Floats) -> int:
    """Number of the point where a bead starts."""
    if len(seams):
        away = ((curve.points[:, None] - seams[None]) ** 2).sum(axis=2).min(axis=1)
        return int(np.argmin(away))
    lowest = np.flatnonzero(curve.points[:, 2] <= curve.points[:, 2].min() + SAME_HEIGHT_MM)
    along = surface.unrolled(curve.points)[lowest, 0]
    return int(lowest[np.argmax(along) if curve.hole else np.argmin(along)])


def _bead(sliced: SlicedSubVolume, layer: Layer, curve: Curve, chosen: Ints) -> _Bead:
    """Targets at chosen points of a curve, the first repeated at the end."""
    points = curve.points
    normals = layer.surface.normals(points[chosen])
    out = np.roll(points, -1, axis=0) - points
    out /= np.sqrt((out**2).sum(axis=1))[:, None]
    into = np.roll(out, 1, axis=0)
    corner = corner_flags(points)[chosen][:, None]
    leaving = np.where(corner, out[chosen], out[chosen] + into[chosen])
    arriving = np.where(corner[0], into[chosen[0]], leaving[0])
    tangents = np.concatenate([leaving, arriving[None]])
    normals = np.concatenate([normals, normals[:1]])
    tangents -= (tangents * normals).sum(axis=1)[:, None] * normals
    tangents /= np.sqrt((tangents**2).sum(axis=1))[:, None]
    position = points[np.append(chosen, chosen[0])]
    return _Bead(layer.index, position, normals, tangents, sliced.thickness_at(layer.index, position), True)
