"""Layers made by hand, and what their beads cover."""

from __future__ import annotations

import numpy as np
import shapely

from slicing.beads.lay import _strokes
from slicing.beads.regions import Island, islands
from slicing.curves.intersect import Curve, intersect
from slicing.layers.layer import Layer
from slicing.parameters import BeadParameters
from slicing.surfaces.surfaces import Plane

PLANE = Plane((20.0, 0.0, 0.0), (1.0, 0.0, 0.0))


def planar_layer(*loops, index: int = 0) -> Layer:
    """A layer on a plane from loops in its own coordinates, the region on their left."""
    u, v = PLANE.axes()
    curves, total = [], 0.0
    for loop in loops:
        loop = np.asarray(loop, dtype=float)
        after = np.roll(loop, -1, axis=0)
        area = 0.5 * float((loop[:, 0] * after[:, 1] - loop[:, 1] * after[:, 0]).sum())
        points = np.asarray(PLANE.point) + loop[:, :1] * u + loop[:, 1:] * v
        curves.append(Curve(points, True, area < 0, area))
        total += area
    return Layer(index, PLANE, tuple(curves), total, (1.73, 1.73))


def circle(r: float, n: int = 720, hole: bool = False) -> np.ndarray:
    t = 2 * np.pi * np.arange(n) / n * (-1 if hole else 1)
    return r * np.stack([np.cos(t), np.sin(t)], axis=1)


def one_period(island: Island, geometry):
    period = island.chart.period
    return geometry if period is None else geometry.intersection(shapely.box(-period / 2, -1e9, period / 2, 1e9))


def laid_area(island: Island, strokes, width: float):
    """What strokes cover, in one period of the chart."""
    period, parts = island.chart.period, []
    for stroke in strokes:
        line = np.concatenate([stroke.line, stroke.line[:1] + stroke.shift]) if stroke.closed else stroke.line
        for k in range(-4, 5) if period else (0,):
            parts.append(
                shapely.LineString(line + np.array([k * (period or 0.0), 0.0])).buffer(width / 2, quad_segs=32)
            )
    return one_period(island, shapely.union_all(parts))


def coverage(layer: Layer, parameters: BeadParameters) -> tuple[float, float]:
    """Least share covered of what a bead can reach, and greatest area laid outside."""
    share, outside = 1.0, 0.0
    for island in islands(layer):
        covered = laid_area(island, _strokes(island, parameters, layer.index), parameters.width_mm)
        room = island.repeated(4 * parameters.width_mm)
        reach = one_period(room, room.region.buffer(-parameters.first_mm).buffer(parameters.first_mm, quad_segs=64))
        share = min(share, reach.intersection(covered).area / reach.area)
        outside = max(outside, covered.difference(one_period(room, room.region).buffer(2e-3)).area)
    return share, outside


def layer_on(mesh, body, by: float = 3.46) -> Layer:
    """A layer without all the others."""
    surface = body.surface.offset(by)
    curves = tuple(intersect(mesh, surface))
    return Layer(2, surface, curves, sum(c.area_mm2 for c in curves), (1.73, 1.73))
