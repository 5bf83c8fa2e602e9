"""Robot targets: points of the beads in the order in which they are deposited.

    targets = sample_targets([sliced], chord_tolerance_mm=0.3, min_segment_mm=3.0)
    targets.position, targets.normal, targets.tangent          # (n, 3) each, part frame

Order: sub-volume, layer, bead. Which beads there are, where they start and in which order they are laid is
decided in `slicing.beads.lay`: by default every curve of a layer is one, outer loops counter-clockwise seen from
outside, holes clockwise, starting at the point nearest to a seam of the layer below. A closed bead ends where it
starts: its first target is repeated as its last. An open one has both its ends. How points are chosen along a
bead: `slicing.targets.break_points`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ..beads.bead import Bead
from ..beads.lay import LaidSubVolume, lay_beads
from ..layers.layer import SlicedSubVolume
from ..mesh.solid import Bools, Floats, Ints, PartError
from ..parameters import BeadParameters
from ..surfaces.surfaces import Surface
from .break_points import BeadLine, chosen_points, corner_flags
from .speeds import BeadSpeed

ALONG_NORMAL = 1e-3  # what is left across a normal of a direction of travel that lies along it
BESIDE_MM = 0.01  # from a corner, where the next face's normal is taken


@dataclass(frozen=True, eq=False)
class Targets:
    """Robot targets in the part frame, one a row.

    Attributes:
        sub_volume: names of the sub-volumes.
        sub_volume_index: (n,) which of them.
        layer: (n,) layer number within the sub-volume.
        bead: (n,) bead number, counting over the whole part.
        position: (n, 3) mm, on the exact curve.
        normal: (n, 3) unit outward normal of the layer's surface, the direction of deposition.
        tangent: (n, 3) unit direction of travel, across the normal. At a corner that of the outgoing segment;
            at the last target of a bead that ends in a corner, of the incoming one.
        thickness_mm: (n,) of the bead down to the layer below, with what it takes over from the layer below.
        closed: (beads,) whether each bead ends where it starts.
        speed_mm_s: (n,) of the deposition; where left out, that of `BeadSpeed`'s default.
    """

    sub_volume: tuple[str, ...]
    sub_volume_index: Ints
    layer: Ints
    bead: Ints
    position: Floats
    normal: Floats
    tangent: Floats
    thickness_mm: Floats
    closed: Bools
    speed_mm_s: Floats = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        if len(self.speed_mm_s) == 0 < len(self.bead):
            object.__setattr__(self, "speed_mm_s", BeadSpeed().at(self.thickness_mm))

    def __repr__(self) -> str:
        return f"<Targets: {len(self)} on {len(self.closed)} beads of {', '.join(self.sub_volume)}>"

    def __len__(self) -> int:
        return len(self.bead)


def sample_targets(
    sliced: Sequence[SlicedSubVolume],
    chord_tolerance_mm: float = 0.3,
    min_segment_mm: float = 3.0,
    beads: BeadParameters | None = None,
    speed: BeadSpeed | None = None,
) -> Targets:
    """Lay the beads of sliced sub-volumes and sample them.

    Args:
        sliced: the sub-volumes in the order of deposition.
        chord_tolerance_mm: greatest distance between a bead and a segment.
        min_segment_mm: least distance between successive targets; wins over the tolerance where the two
            conflict. The ends of lines that fill a layer are targets in any case.
        beads: which beads; the paper's where left out.
        speed: how fast they are laid.

    Returns:
        The targets.

    Raises:
        PartError: a tolerance or least segment that is not above 0, or a layer that cannot be filled.

    Source:
        Lettori et al. 2024, section 4 (0.3 mm, 3 mm) and figures 12c and 19.
    """
    _require(chord_tolerance_mm, min_segment_mm)
    return sample_beads(lay_beads(sliced, beads, locate=False), chord_tolerance_mm, min_segment_mm, speed)


def _require(chord_tolerance_mm: float, min_segment_mm: float) -> None:
    for key, value in (("chord_tolerance_mm", chord_tolerance_mm), ("min_segment_mm", min_segment_mm)):
        if not (math.isfinite(value) and value > 0):
            raise PartError(f"{key}: {value} is not allowed; a number above 0 is needed")


def sample_beads(
    laid: Sequence[LaidSubVolume],
    chord_tolerance_mm: float = 0.3,
    min_segment_mm: float = 3.0,
    speed: BeadSpeed | None = None,
) -> Targets:
    """Put targets on beads that have been laid.

    Args:
        laid: from `slicing.lay_beads`.
        chord_tolerance_mm: greatest distance between a bead and a segment.
        min_segment_mm: least distance between successive targets.
        speed: how fast they are laid.

    Returns:
        The targets.

    Raises:
        PartError: a tolerance or least segment that is not above 0.
    """
    _require(chord_tolerance_mm, min_segment_mm)
    lines: list[BeadLine] = []
    for one in laid:
        tolerance = max(chord_tolerance_mm - one.sliced.parameters.tolerance_mm, 0.5 * chord_tolerance_mm)
        lines += [BeadLine(bead.points, bead.closed, tolerance, bead.stops) for bead in one.beads]
    chosen = iter(chosen_points(lines, min_segment_mm))
    found = [(k, _sampled(one.sliced, bead, next(chosen))) for k, one in enumerate(laid) for bead in one.beads]
    size = np.array([len(some.position) for _, some in found], dtype=np.int64)

    def rows(name: str) -> Floats:
        return np.concatenate([np.zeros((0, 3)), *(getattr(some, name) for _, some in found)])

    thickness = np.concatenate([np.zeros(0), *(some.thickness_mm for _, some in found)])
    return Targets(
        tuple(one.sliced.name for one in laid),
        np.repeat(np.array([k for k, _ in found], dtype=np.int64), size),
        np.repeat(np.array([some.bead.layer for _, some in found], dtype=np.int64), size),
        np.repeat(np.arange(len(found), dtype=np.int64), size),
        rows("position"),
        rows("normal"),
        rows("tangent"),
        thickness,
        np.array([some.bead.closed for _, some in found], dtype=bool),
        (speed or BeadSpeed()).at(thickness) / np.repeat([some.bead.metal for _, some in found], size),
    )


@dataclass(frozen=True, eq=False)
class _SampledBead:
    bead: Bead
    position: Floats
    normal: Floats
    tangent: Floats
    thickness_mm: Floats


def _sampled(sliced: SlicedSubVolume, bead: Bead, chosen: Ints) -> _SampledBead:
    """Targets of a bead at chosen points; of a closed one the first repeated at the end."""
    points, surface = bead.points, sliced.layers[bead.layer].surface
    out = np.roll(points, -1, axis=0) - points
    out /= np.maximum(np.sqrt((out**2).sum(axis=1)), 1e-300)[:, None]
    into = np.roll(out, 1, axis=0)
    if not bead.closed:
        out[-1], into[0] = into[-1], out[0]
    normals = surface.normals(points[chosen])
    corner = corner_flags(points)[chosen][:, None]
    if not bead.closed:
        corner[[0, -1]] = True  # no joint between its ends
    tangents = np.where(corner, out[chosen], out[chosen] + into[chosen])
    if bead.closed:
        arriving = np.where(corner[0], into[chosen[0]], tangents[0])
        tangents, normals = np.concatenate([tangents, arriving[None]]), np.concatenate([normals, normals[:1]])
        chosen = np.append(chosen, chosen[0])
    ahead = out[chosen]
    ahead[-1] = -into[chosen[-1]]
    normals, tangents = _across(surface, points[chosen], ahead, normals, tangents)
    thickness = sliced.thickness_at(bead.layer, points[chosen]) + bead.gained_mm[chosen]
    return _SampledBead(bead, points[chosen], normals, tangents, thickness)


def _across(
    surface: Surface, points: Floats, ahead: Floats, normals: Floats, tangents: Floats
) -> tuple[Floats, Floats]:
    """Normals (n, 3) and unit directions of travel (n, 3) across them.

    At a corner of a profile the surface has two normals. Where the one taken lies along the way, that of the face on
    which the bead goes on is taken instead.

    Args:
        surface: of the layer.
        points: (n, 3) mm.
        ahead: (n, 3) from each point to where the bead goes on; at its last one to where it came from.
        normals: (n, 3) unit, at the points.
        tangents: (n, 3) directions of travel.
    """
    left = tangents - (tangents * normals).sum(axis=1)[:, None] * normals
    along = np.sqrt((left**2).sum(axis=1)) < ALONG_NORMAL * np.sqrt((tangents**2).sum(axis=1))
    if along.any():
        normals = normals.copy()
        normals[along] = surface.normals(points[along] + BESIDE_MM * ahead[along])
        left[along] = tangents[along] - (tangents[along] * normals[along]).sum(axis=1)[:, None] * normals[along]
        # a way straight off the surface has no direction on it: any across the normal will do
        still = np.flatnonzero(along & (np.sqrt((left**2).sum(axis=1)) < ALONG_NORMAL))
        for k in still.tolist():
            left[k] = np.cross(normals[k], np.eye(3)[int(np.argmin(np.abs(normals[k])))])
    return normals, left / np.sqrt((left**2).sum(axis=1))[:, None]
