"""Sliced sub-volumes as plain data: the contract "rbam-slices/1" and the table of targets (no files).

json.dumps(slices_document(sliced, [indices(s, targets) for s in sliced]))
header, rows = targets_rows(targets)
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from slicing.indices import Indices
from slicing.layers import Layer, SlicedSubVolume
from slicing.targets import Targets

SCHEMA = "rbam-slices/1"
TARGETS_HEADER = (
    *("index", "sub_volume", "layer", "path", "kind", "x_mm", "y_mm", "z_mm"),
    *("nx", "ny", "nz", "tx", "ty", "tz", "thickness_mm"),
)


def slices_document(
    sliced: Sequence[SlicedSubVolume], found: Sequence[Indices], warnings: Sequence[str] = ()
) -> dict[str, Any]:
    """The document that `rbam slice --json` writes.

    Args:
        sliced: the sub-volumes.
        found: their indices, in the same order.
        warnings: further warnings, put before those of the sub-volumes.

    Returns:
        Plain lists, dicts, strings and numbers, mm (see docs/formats.md).
    """
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
            }
            for one, some in zip(sliced, found, strict=True)
        ],
        "warnings": [*warnings, *(line for one in sliced for line in one.warnings)],
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


def targets_rows(targets: Targets) -> tuple[tuple[str, ...], list[tuple[Any, ...]]]:
    """Header and rows of the table that `rbam slice --targets` writes.

    Args:
        targets: the targets; all of kind "print".

    Returns:
        The header, and one tuple a target.
    """
    numbers = zip(
        targets.sub_volume_index.tolist(),
        targets.layer.tolist(),
        targets.path.tolist(),
        targets.position.tolist(),
        targets.normal.tolist(),
        targets.tangent.tolist(),
        targets.thickness_mm.tolist(),
        strict=True,
    )
    rows = [
        (index, targets.sub_volume[volume], layer, path, "print", *position, *normal, *tangent, thickness)
        for index, (volume, layer, path, position, normal, tangent, thickness) in enumerate(numbers)
    ]
    return TARGETS_HEADER, rows
