"""Layers and indices of sub-volumes on a terminal.

Use:

    for line in slice_lines(sliced, indices, warnings): ...    # rich renderables
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from slicing import metal_document

if TYPE_CHECKING:
    from rich.console import RenderableType

    from slicing import Indices, LaidSubVolume, SlicedSubVolume

    from ..case.sections import Process
from .check_report import _bead_figures, metal_in_words


def slice_lines(
    sliced: Sequence[SlicedSubVolume],
    found: Sequence[Indices],
    warnings: Sequence[str],
    reported: Sequence[str] = (),
    laid: Sequence[LaidSubVolume] = (),
    process: Process | None = None,
) -> Iterator[RenderableType]:
    """The terminal report of a slicing: the paper's indices by sub-volume.

    Args:
        sliced: the sub-volumes.
        found: their indices.
        warnings: of the part as a whole, one line each.
        reported: of its beads, one line each.
        laid: its beads, for their metal and overhangs.
        process: density and wire, for mass and length.

    Yields:
        rich renderables.
    """
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="dim")
    for name in ("sub-volume", "strategy"):
        table.add_column(name)
    more = ("overhang deg", "metal") if laid else ()
    for name in ("layers NL", "adhesion A mm2", "targets NV", "top R rad", "thickness mm", "volume mm3", *more):
        table.add_column(name, justify="right")
    for k, (s, i) in enumerate(zip(sliced, found, strict=True)):
        low, high = min(x.thickness_mm[0] for x in s.layers), max(x.thickness_mm[1] for x in s.layers)
        thickness = f"{low:.2f} .. {high:.2f}"
        numbers = (
            str(i.NL),
            f"{i.A_mm2:.2f}",
            str(i.NV),
            f"{i.R_rad:.3f}",
            thickness,
            f"{s.mesh.volume:.1f}",
        )
        table.add_row(s.name, s.strategy, *numbers, *(_bead_figures(laid[k]) if laid else ()))
    yield table
    if laid and process is not None:
        metal = metal_document([m for one in laid for m in one.metal], process.density_g_cm3, process.wire_diameter_mm)
        yield f"metal: {metal_in_words(metal)}"
    for line in (*warnings, *(line for s in sliced for line in s.warnings), *reported):
        yield f"warning: {line}"
