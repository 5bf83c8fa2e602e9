"""From a mesh to a toolpath in three calls, for scripts and notebooks.

    mesh = load("blade.stl", units="mm")
    sliced = slice(mesh, CylindricalBody(radius_mm=20), strategy="nonuniform", h_layer_mm=1.73)
    path = lay([sliced], pattern="zigzag", width_mm=5)
    path.targets.position                                   # (n, 3) mm, in the order of deposition

The long forms are `slicing.slice_sub_volume`, `slicing.lay_beads` and `slicing.sample_beads`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..beads.lay import lay_beads
from ..layers.layer import SlicedSubVolume
from ..mesh.load import load_mesh
from ..mesh.solid import Mesh
from ..parameters import BeadParameters, SlicingParameters, Strategy
from ..strategies.slice import slice_sub_volume
from ..surfaces.bodies import Body
from ..targets.speeds import BeadSpeed
from ..targets.targets import sample_beads
from .toolpath import Toolpath

load = load_mesh


def slice(mesh: Mesh, body: Body, strategy: Strategy = "nonuniform", **parameters: Any) -> SlicedSubVolume:
    """Slice a sub-volume.

    Args:
        mesh: the sub-volume, part frame, mm; from `slicing.load`.
        body: what it stands on.
        strategy: one of `slicing.STRATEGIES`.
        **parameters: further fields of `slicing.SlicingParameters`: h_layer_mm, h_min_mm, h_max_mm, ...; where only
            h_layer_mm is given the limits keep their share of it.

    Returns:
        Its layers.

    Raises:
        PartError: as `slicing.slice_sub_volume`.
        TypeError: a field that does not exist.
    """
    default = SlicingParameters(strategy)
    if "h_layer_mm" in parameters:
        scale = parameters["h_layer_mm"] / default.h_layer_mm  # as `rbam slice --h-layer` does
        parameters = {"h_min_mm": default.h_min_mm * scale, "h_max_mm": default.h_max_mm * scale, **parameters}
    return slice_sub_volume(mesh, body, SlicingParameters(strategy, **parameters))


def lay(
    sliced: Sequence[SlicedSubVolume],
    *,
    chord_tolerance_mm: float = 0.3,
    min_segment_mm: float = 3.0,
    speed_mm_s: float = 8.0,
    **beads: Any,
) -> Toolpath:
    """Lay the beads of sliced sub-volumes and sample their targets.

    Args:
        sliced: the sub-volumes in the order of deposition.
        chord_tolerance_mm: greatest distance between a bead and a segment.
        min_segment_mm: least distance between successive targets.
        speed_mm_s: of the deposition.
        **beads: fields of `slicing.BeadParameters`: pattern, width_mm, overlap, seam, ...

    Returns:
        The toolpath.

    Raises:
        PartError: as `slicing.lay_beads` and `slicing.sample_beads`.
        TypeError: a field that does not exist.
    """
    parameters = BeadParameters(**beads)
    laid = lay_beads(sliced, parameters)
    targets = sample_beads(laid, chord_tolerance_mm, min_segment_mm, BeadSpeed(speed_mm_s))
    reported = (*(line for one in sliced for line in one.warnings), *(line for one in laid for line in one.warnings))
    return Toolpath(targets, parameters, laid, warnings=reported)
