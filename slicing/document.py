"""Sliced sub-volumes as plain data: the document of schema "rbam-slices/1" and the table of targets (no files).

Use:

    json.dumps(slices_document(sliced, [indices(s, targets) for s in sliced]))
    header, rows = targets_rows(targets, travels(targets, 30.0), 100.0)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from .beads.bead import Bead
from .beads.deposition import metal_document
from .beads.lay import LaidSubVolume
from .layers.layer import Layer, SlicedSubVolume
from .paper.indices import Indices
from .targets.targets import Targets
from .targets.waypoints import Travel
from .warning import typed

SCHEMA = "rbam-slices/1"
TARGETS_HEADER = (
    *("index", "sub_volume", "layer", "path", "kind", "x_mm", "y_mm", "z_mm"),
    *("nx", "ny", "nz", "tx", "ty", "tz", "thickness_mm", "speed_mm_s"),
)


def slices_document(
    sliced: Sequence[SlicedSubVolume],
    found: Sequence[Indices],
    warnings: Sequence[str] = (),
    laid: Sequence[LaidSubVolume] = (),
    density_g_cm3: float = 7.85,
    wire_diameter_mm: float = 1.2,
) -> dict[str, Any]:
    """The document that `rbam slice --json` writes.

    Args:
        sliced: the sub-volumes.
        found: their indices, in the same order.
        warnings: further warnings, put before those of the sub-volumes.
        laid: their beads, in the same order; left out of the document where there are none.
        density_g_cm3: of the metal.
        wire_diameter_mm: of the wire.

    Returns:
        Plain lists, dicts, strings and numbers, mm (see docs/formats.md).
    """
    reported = [
        *warnings,
        *(line for one in sliced for line in one.warnings),
        *(line for one in laid for line in one.warnings),
    ]
    return {
        "schema": SCHEMA,
        "units": "mm",
        "sub_volumes": [
            {
                "name": one.name,
                "strategy": one.strategy,
                "layers": [_layer(layer) for layer in one.layers],
                "indices": some.to_dict(),
                "volume_mm3": _known(one.volume_mm3),
                "laid_volume_mm3": _known(one.laid_volume_mm3),
                "end_mm": _known(one.end_mm),
                **(_beads(laid[k], density_g_cm3, wire_diameter_mm) if laid else {}),
            }
            for k, (one, some) in enumerate(zip(sliced, found, strict=True))
        ],
        "warnings": [str(line) for line in reported],
        "typed_warnings": [typed(line).document() for line in reported],
    }


def _beads(laid: LaidSubVolume, density_g_cm3: float, wire_diameter_mm: float) -> dict[str, Any]:
    return {
        "metal": {
            **metal_document(laid.metal, density_g_cm3, wire_diameter_mm),
            "layers": [one.to_dict() for one in laid.metal],
        },
        "overhangs": [one.to_dict() for one in laid.overhangs],
        "beads": [_bead(bead) for bead in laid.beads],
        "thickness_policy": {
            "policy": laid.sliced.parameters.thickness,
            "places": [place.to_dict() for place in laid.places],
        },
    }


def _bead(bead: Bead) -> dict[str, Any]:
    return {
        "layer": bead.layer,
        "kind": bead.kind,
        "closed": bead.closed,
        "hole": bead.hole,
        "length_mm": bead.length_mm,
        "metal": float(bead.metal),
    }


def _known(value: float) -> float | None:
    """A number, or null for one that was not found (JSON has no NaN)."""
    return float(value) if math.isfinite(value) else None


def _layer(layer: Layer) -> dict[str, Any]:
    return {
        "index": layer.index,
        "surface": layer.surface.to_dict(),
        "curves": [
            {"closed": curve.closed, "hole": curve.hole, "points": curve.points.tolist()} for curve in layer.curves
        ],
        "area_mm2": float(layer.area_mm2),
        "thickness_mm": [float(v) for v in layer.thickness_mm],
    }


def targets_rows(
    targets: Targets, ways: Sequence[Travel] = (), travel_speed_mm_s: float = 0.0
) -> tuple[tuple[str, ...], list[tuple[Any, ...]]]:
    """Header and rows of the table that `rbam slice --targets` writes.

    Args:
        targets: the targets; rows of kind "print", numbered.
        ways: between the beads; rows of kind "travel" before the bead that they lead to, without a number.
        travel_speed_mm_s: on these ways.

    Returns:
        The header, and one tuple a row.
    """
    numbers = zip(
        targets.sub_volume_index.tolist(),
        targets.layer.tolist(),
        targets.bead.tolist(),
        targets.position.tolist(),
        targets.normal.tolist(),
        targets.tangent.tolist(),
        targets.thickness_mm.tolist(),
        targets.speed_mm_s.tolist(),
        strict=True,
    )
    before = {way.to_target: way for way in ways}
    rows: list[tuple[Any, ...]] = []
    for index, (volume, layer, path, position, normal, tangent, *rest) in enumerate(numbers):
        bead = (targets.sub_volume[volume], layer, path)
        if index in before:
            way = before[index]
            for p, n, t in zip(way.position.tolist(), way.normal.tolist(), way.tangent.tolist(), strict=True):
                rows.append(("", *bead, "travel", *p, *n, *t, 0.0, travel_speed_mm_s))
        rows.append((index, *bead, "print", *position, *normal, *tangent, *rest))
    return TARGETS_HEADER, rows
