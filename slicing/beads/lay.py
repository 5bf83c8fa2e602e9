"""From layers to beads, as fine points on the layers' exact surfaces.

    laid = lay_beads([sliced], BeadParameters("zigzag", width_mm=5.0))
    laid[0].beads[3].points, laid[0].beads[3].closed         # in the order in which they are laid
    laid[0].places                                           # where the thickness leaves its limits
    (slicing.beads.thickness_policy)

First come the borders of a layer, or the beads that fill it. Then, layer by layer, places that are too thin or too
thick are treated (`slicing.beads.thickness_policy`), directions alternate, closed beads get their seam
(`slicing.beads.seams`), beads their order (`slicing.beads.order`), and their starts and ends are led in and out
(`slicing.beads.lead_in_out`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..curves.loops import SAME_POINT_MM
from ..layers.layer import Layer, SlicedSubVolume
from ..mesh.solid import Bools, Floats, PartError
from ..parameters import BeadParameters
from ..surfaces.charts import Chart
from .bead import Bead
from .deposition import LayerMetal, layer_metal, metal_lines, with_metal
from .infill import Stroke, contour_rounds, fitted_pitch, narrow_places, wide_part
from .lead_in_out import with_leads
from .order import in_laying_order
from .overhang import ALLOWED, Overhang, overhang_lines, overhangs
from .regions import Island, RegionOverlap, islands
from .seams import with_seams
from .thickness_policy import ThicknessPlace, policy_lines, with_policy
from .zigzag import OVER, length_of, strokes_of_length, zigzag

CROWDED = 0.85  # share of the pitch: beads nearer than this are reported
HALVINGS = 12  # of chords over a corner of the surface


@dataclass(frozen=True, eq=False)
class LaidSubVolume:
    """A sub-volume's beads in the order in which they are laid.

    Attributes:
        sliced: the sub-volume.
        beads: layer by layer.
        places: where the thickness leaves its limits, and what was done there.
        warnings: one line each.
        metal: by layer what the beads lay and what it takes; empty where it was not asked for.
        overhangs: by layer what overhangs; empty where it was not asked for.
    """

    sliced: SlicedSubVolume
    beads: tuple[Bead, ...]
    places: tuple[ThicknessPlace, ...]
    warnings: tuple[str, ...]
    metal: tuple[LayerMetal, ...] = ()
    overhangs: tuple[Overhang, ...] = ()


def lay_beads(
    sliced: Sequence[SlicedSubVolume],
    parameters: BeadParameters | None = None,
    locate: bool = True,
    overhang_mm: float | None = None,
) -> tuple[LaidSubVolume, ...]:
    """The beads of sliced sub-volumes.

    Args:
        sliced: the sub-volumes in the order of deposition.
        parameters: how; their defaults where left out.
        locate: whether places outside the limits are searched even where they are only reported, and metal and
            overhangs are computed.
        overhang_mm: how far a layer may stand out over what lies below it before a warning reports it; None: half a
            bead (`slicing.overhangs`).

    Returns:
        Their beads.

    Raises:
        PartError: a layer cannot be filled, or a seam is given for a sub-volume that is none of these.
    """
    parameters = parameters or BeadParameters()
    names = [one.name for one in sliced]
    for place in parameters.seams:
        if place.sub_volume not in (None, *names):
            raise PartError(f"seams: no sub-volume is named {place.sub_volume}; there are {', '.join(names)}")
    allowed = ALLOWED * parameters.width_mm if overhang_mm is None else overhang_mm
    return tuple(_laid(one, parameters, locate, allowed) for one in sliced)


def _laid(sliced: SlicedSubVolume, parameters: BeadParameters, locate: bool, allowed: float) -> LaidSubVolume:
    fresh = [layer_beads(layer, parameters, sliced.parameters.tolerance_mm) for layer in sliced.layers]
    layers: list[list[Bead]] = fresh
    places: list[ThicknessPlace] = []
    if locate or sliced.parameters.thickness != "report":
        layers, places = with_policy(sliced, fresh, parameters)
    if parameters.alternate:
        layers = [[b.reversed() for b in some] if k % 2 else some for k, some in enumerate(layers)]
    layers = with_seams(sliced, layers, parameters)
    layers = in_laying_order(layers, parameters)
    beads = tuple(with_leads(sliced, bead, parameters) for some in layers for bead in some)
    beads = with_metal(sliced, beads, parameters)
    lines = policy_lines(sliced, places)
    thin = sum(bead.length_mm for bead in beads if bead.thin)
    if thin:
        lines.append(
            f"{sliced.name}: {thin:.1f} mm of beads lie where the layer is narrower than one bead"
            f" ({parameters.width_mm:g} mm); these beads are wider than the layer"
        )
    close = sum(bead.close_mm for some in fresh for bead in some)
    if close:
        least = min(bead.least_spacing for some in fresh for bead in some)
        lines.append(
            f"{sliced.name}: {close:.1f} mm of beads lie closer together than the pitch of "
            f"{parameters.pitch_mm:g} mm, down"
            f" to {100 * least:.0f} % of it, because the layers cannot be unrolled exactly: more metal is laid there"
            " than the layers need"
        )
    if not locate:
        return LaidSubVolume(sliced, beads, tuple(places), tuple(lines))
    metal, hanging = layer_metal(sliced, beads, parameters.pitch_mm), overhangs(sliced, allowed)
    lines += overhang_lines(sliced.name, hanging, allowed)
    lines += metal_lines(sliced.name, metal, parameters)
    return LaidSubVolume(sliced, beads, tuple(places), tuple(lines), metal, hanging)


def layer_beads(layer: Layer, parameters: BeadParameters, tolerance_mm: float = 0.01) -> list[Bead]:
    """A layer's beads by its pattern: contours, then infill; seams, order and leads are not set yet.

    Args:
        layer: the layer.
        parameters: how.
        tolerance_mm: greatest distance of fine points' chords from a line on the surface.

    Returns:
        The beads.

    Raises:
        PartError: the layer cannot be unrolled.
    """
    if parameters.pattern == "contour" and parameters.first_mm == 0.0 and not _has_thin_walls(layer, parameters):
        return [Bead(c.points, c.closed, "contour", layer.index, c.hole) for c in layer.curves]

    # the outermost beads of pieces that meet run first_mm within them, and are to be neighbours
    overlap = RegionOverlap(parameters.first_mm - 0.5 * parameters.pitch_mm, parameters.width_mm)
    beads = [
        bead_of(stroke, island, layer.index, tolerance_mm)
        for island in islands(layer, None if parameters.pattern == "contour" else overlap)
        for stroke in _strokes(island, parameters, layer.index)
    ]
    return sorted(beads, key=lambda bead: (bead.kind == "infill") == parameters.contours_first)


def _has_thin_walls(layer: Layer, p: BeadParameters) -> bool:
    """Whether a layer has walls in which one bead is to be laid along the middle, not two along the borders."""
    if p.thin_walls == "border":
        return False
    try:
        found = islands(layer)
    except PartError:
        return False  # a layer that cannot be unrolled has its borders alone
    for island in found:
        wide = wide_part(island.region, 0.0, p.pitch_mm, p.width_mm)
        if wide.is_empty or island.region.area - wide.area > 1e-3 * island.region.area:
            return True
    return False


def _strokes(island: Island, p: BeadParameters, layer: int) -> list[Stroke]:
    """A pattern's strokes on an island."""
    if p.pattern == "contour":
        found = list(contour_rounds(island, p.first_mm, p.pitch_mm, p.width_mm, 1, fills=False))
        return found + list(narrow_places(island, p.first_mm, p.width_mm, p.pitch_mm))
    pitch, across = fitted_pitch(island, p.first_mm, p.pitch_mm, p.width_mm)
    narrow = list(narrow_places(island, p.first_mm, p.width_mm, p.pitch_mm))
    if p.pattern == "zigzag" and across > 2 * p.contours + 1:
        angle = p.angle_deg + layer * p.angle_step_deg
        rounds = list(contour_rounds(island, p.first_mm, pitch, p.width_mm, p.contours))
        # so far that between the round ends of two lines the round about them covers
        over = pitch - (0.5 - OVER) * p.width_mm if p.contours else 0.0
        over = min(max(over, 0.0), pitch)
        lines = partial(zigzag, island, p.first_mm + p.contours * pitch, over, width_mm=p.width_mm, angle_deg=angle)
        wanted = island.area_mm2 / p.pitch_mm - length_of([*rounds, *narrow])
        return [
            *rounds,
            *strokes_of_length(lambda apart: list(lines(pitch_mm=apart)), wanted, p.pitch_mm, p.width_mm),
            *narrow,
        ]
    # across a wall of few beads no lines fit within the rounds
    return [*contour_rounds(island, p.first_mm, pitch, p.width_mm, None), *narrow]


def bead_of(stroke: Stroke, island: Island, layer: int, tolerance_mm: float) -> Bead:
    """A stroke put onto its layer's surface, its line cut so fine that chords keep to the surface.

    Args:
        stroke: in the island's chart.
        island: its chart.
        layer: the layer's number.
        tolerance_mm: greatest distance of chords from the surface.

    Returns:
        The bead; the corners of open strokes of infill have to become targets.
    """
    line = np.concatenate([stroke.line, stroke.line[:1] + stroke.shift]) if stroke.closed else stroke.line
    step = np.sqrt((np.diff(line, axis=0) ** 2).sum(axis=1))
    count = np.maximum(np.ceil(step / island.chart.spacing(tolerance_mm)), 1).astype(np.int64)
    count[step <= SAME_POINT_MM] = 0  # a point given twice has no direction
    first = np.append(0, np.cumsum(count))
    piece = np.repeat(np.arange(len(step)), count)
    share = (np.arange(first[-1]) - first[piece]) / count[piece]
    flat = line[piece] + share[:, None] * (line[piece + 1] - line[piece])
    flat = np.concatenate([flat, line[-1:]])
    corner = np.zeros(len(flat), dtype=bool)
    corner[[int(first[k]) for k in stroke.corners]] = True
    points, flat, corner = _true_to_it(island.chart, flat, corner, tolerance_mm)
    close, least = _crowded(island.chart, flat, points) if stroke.kind == "infill" else (0.0, 1.0)
    if stroke.closed:
        points, corner = points[:-1], np.append(corner[0] | corner[-1], corner[1:-1])
    stops = tuple(np.flatnonzero(corner).tolist())
    return Bead(
        points,
        stroke.closed,
        stroke.kind,
        layer,
        stroke.hole,
        stops=stops,
        thin=stroke.thin,
        close_mm=close,
        least_spacing=least,
    )


def _true_to_it(chart: Chart, flat: Floats, corner: Bools, tolerance_mm: float) -> tuple[Floats, Floats, Bools]:
    """Points on the surface of a line in a chart, more of them where the surface has a corner or a tip below it."""
    points = chart.lift(flat)
    for _ in range(HALVINGS if chart.bends else 0):
        half = 0.5 * (flat[1:] + flat[:-1])
        middle = chart.lift(half)
        off = np.sqrt(((middle - 0.5 * (points[1:] + points[:-1])) ** 2).sum(axis=1))
        rows = np.flatnonzero(off > tolerance_mm) + 1
        if len(rows) == 0:
            break
        flat, points = np.insert(flat, rows, half[rows - 1], axis=0), np.insert(points, rows, middle[rows - 1], axis=0)
        corner = np.insert(corner, rows, False)
    return points, flat, corner


def _crowded(chart: Chart, flat: Floats, points: Floats) -> tuple[float, float]:
    """Length of a line on which its neighbours are much nearer than in the chart, mm, and the least share of that."""
    ways = np.diff(flat, axis=0)
    share = chart.spacing_share(0.5 * (flat[1:] + flat[:-1]), ways)
    length = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    return float(length[share < CROWDED].sum()), float(share.min(initial=1.0))
