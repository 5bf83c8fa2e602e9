"""Regions of layers in one chart, and what lies below them there: loops by turns inside and outside.

    region = region_of_curves(chart, [(curve.points, curve.winding) for curve in layer.curves])

Regions are shapely's, in the coordinates of the chart, mm.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..mesh.solid import Floats
from ..surfaces.charts import Chart, FlatChart, RoundChart

SIMPLE_MM = 0.005


def region_of_curves(chart: FlatChart | RoundChart, curves: Sequence[tuple[Floats, int]]) -> Any:
    """The region between curves, by turns inside and outside; three times right round where it goes so far.

    Args:
        chart: of the layer.
        curves: points (n, 3), and turns about the axis.
    """
    return _between(chart, curves, None, False)


def region_right_round(chart: RoundChart, curves: Sequence[tuple[Floats, int]], top: float, lower: bool) -> Any:
    """The same where it may run on to an end of the surface.

    Args:
        chart: of the layer, right round the axis.
        curves: points (n, 3), and turns about the axis.
        top: up to where, in the chart.
        lower: whether it holds the lower end.
    """
    import shapely

    region = _between(chart, curves, top, True)
    if lower:
        half = 1.5 * (chart.period or 0.0)
        region = region.symmetric_difference(shapely.box(-half, -1e9, half, top - 1e-9))
    return region


def _between(chart: FlatChart | RoundChart, curves: Sequence[tuple[Floats, int]], top: float | None, ring: bool) -> Any:
    import shapely
    from shapely.affinity import translate

    parts: list[Any] = []
    period = chart.period
    flats = [(chart.flat(points), winding) for points, winding in curves]
    apart = period is None or not (ring or any(w or np.abs(flat[:, 0]).max() > 0.5 * period for flat, w in flats))
    if top is None:
        top = max((float(flat[:, 1].max()) for flat, _ in flats), default=0.0) + 1.0
    for flat, winding in flats:
        if winding and period is not None:
            flat = flat if winding > 0 else flat[::-1]
            line = np.concatenate([flat + np.array([k * period, 0.0]) for k in range(-3, 4)])
            above = np.concatenate([line, [[line[-1, 0], top], [line[0, 0], top]]])
            parts.append(shapely.Polygon(above).buffer(0))
        else:
            polygon = shapely.Polygon(flat).buffer(0).simplify(SIMPLE_MM)
            copies = (0,) if apart else (-2, -1, 0, 1, 2)
            parts += [translate(polygon, k * (period or 0.0)) for k in copies]
    region = shapely.Polygon()
    for part in parts:
        region = region.symmetric_difference(part)
    if period is None or apart:
        return region
    return region.intersection(shapely.box(-1.5 * period, -1e9, 1.5 * period, top - 1e-9))


def one_period(chart: Chart, region: Any) -> Any:
    """What of a region lies within one turn about the axis."""
    import shapely

    if chart.period is None:
        return region
    return region.intersection(shapely.box(-0.5 * chart.period, -1e9, 0.5 * chart.period, 1e9))
