"""Uniform slicing of a round body: its surface and that surface's offsets by h_layer, until nothing is left.

    layers = cylindrical_layers(mesh, body, parameters, root)

Layer 0 lies on the body; its curve is the footprint. The offsets of a cylinder are cylinders, those of a cone
cones of the same angle, those of another profile its true offsets (slicing.surfaces.profile); every layer is h_layer
thick along its normals.

Source: Lettori et al. 2024, section 2 and figure 2 (after Ding et al. 2017), table 1; conical bodies after
Dai et al. 2020, revolved ones as section 6 suggests.
"""

from __future__ import annotations

import math

import numpy as np

from ..curves.intersect import Curve, intersect_offsets
from ..layers.layer import Body, Layer, make_layer, without_slivers
from ..mesh.solid import Floats, Mesh
from ..parameters import SlicingParameters
from ..surfaces.greatest_distance import greatest_distance

SAME_GAP_RAD = 1e-5  # gaps between footprints that differ by less are one


def cylindrical_layers(mesh: Mesh, body: Body, parameters: SlicingParameters, root: list[Curve]) -> list[Layer]:
    """Slice by offsets of the body's surface.

    Args:
        mesh: the sub-volume.
        body: what it stands on.
        parameters: h_layer_mm and tolerance_mm count.
        root: the curves of layer 0, on the body.

    Returns:
        The layers, from the body outward, up to the first offset above which there is nothing.
    """
    base, step = body.surface, parameters.h_layer_mm
    layers = [make_layer(0, base, root, None, body, step)]
    heights = heights_below(greatest_distance(base, mesh.vertices[mesh.faces]), parameters)
    for height, curves in zip(
        heights.tolist(), intersect_offsets(mesh, base, heights, parameters.tolerance_mm), strict=True
    ):
        if not (kept := without_slivers(curves)):
            break
        layers.append(make_layer(len(layers), base.offset(height), kept, layers[-1].surface, body, step))
    return layers


def heights_below(top_mm: float, parameters: SlicingParameters) -> Floats:
    """Heights of the layers after the first one: those above which a sub-volume has more than the tolerance.

    Args:
        top_mm: of its highest point, from the same surface.
        parameters: h_layer_mm and tolerance_mm count.

    Returns:
        (n,) mm, one every h_layer_mm.
    """
    count = math.ceil((top_mm - parameters.tolerance_mm) / parameters.h_layer_mm)
    return parameters.h_layer_mm * np.arange(1.0, max(count, 1))


def span(curves: list[Curve], axis_point: tuple[float, float]) -> tuple[float, float]:
    """The smallest arc about an axis that covers curves, all of their loops.

    Args:
        curves: on a cylinder, or anywhere round the axis; neighbours less than half a turn apart.
        axis_point: (x, y) of the axis, mm.

    Returns:
        The angle of its middle and its width, rad; 2 pi if the curves leave no gap.
    """
    full = 2 * np.pi
    low, high = np.zeros(2 * len(curves)), np.zeros(2 * len(curves))
    for k, curve in enumerate(curves):
        points = np.concatenate([curve.points, curve.points[:1]]) if curve.closed else curve.points
        angle = np.unwrap(np.arctan2(points[:, 1] - axis_point[1], points[:, 0] - axis_point[0]))
        first = float(angle.min()) % full % full  # an angle just below 0 rounds up to a whole turn, which is 0
        low[2 * k : 2 * k + 2] = first - full, first  # twice: what runs past 360 degrees begins again at 0
        high[2 * k : 2 * k + 2] = low[2 * k : 2 * k + 2] + float(np.ptp(angle))
    order = np.argsort(low)
    low, covered = low[order], np.maximum.accumulate(high[order])
    gaps = np.where(low[1:] >= 0.0, low[1:] - covered[:-1], 0.0)  # gaps that end within one turn: each once
    # of gaps as good as equal the first one counter-clockwise from +x, whatever the last digits say
    alike = np.flatnonzero(gaps >= gaps.max() - SAME_GAP_RAD)
    widest = int(alike[np.argmin((low[1:][alike] + SAME_GAP_RAD) % full)])
    width = full - max(float(gaps[widest]), 0.0)
    middle = float(low[1 + widest]) + 0.5 * width
    return (middle + np.pi) % full - np.pi, width
