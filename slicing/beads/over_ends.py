"""Layers that close over the end of a body, laid flat: round the pole as its map shows it, farther down right round.

    views, whole = views_over_ends(layer, below, under)    # clipped to where each is true

`under` are the borders of the layer below, put onto the layer's surface, with their turns about the axis. In the map of
a pole (`slicing.surfaces.charts.PoleChart`) every border is a closed loop, those that go round the axis round the pole;
what lies within an odd number of them is in the region. Where parallels come out longer than MOST_STRETCH there, the
surface is unrolled right round instead.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..layers.layer import Layer
from ..layers.poles import poles
from ..mesh.solid import Floats
from ..surfaces.charts import Chart, PoleChart, RoundChart
from ..surfaces.surfaces import Cone, Revolved
from .overhang_regions import one_period, region_right_round
from .regions import FINE_CUT, MOST_STRETCH

ANNULI = 64  # by which areas on a dome are summed
Border = tuple[Floats, int]


@dataclass(frozen=True, eq=False)
class View:
    """A part of a layer's region in a chart, and what lies below it.

    Attributes:
        chart: the way to and from the surface.
        region: shapely, in the chart, mm.
        support: what lies below, in the chart; not clipped.
    """

    chart: Chart
    region: Any
    support: Any


def views_over_ends(layer: Layer, below: Layer, under: Sequence[Border]) -> tuple[list[View], View]:
    """A layer that holds a pole of its surface, or lies on one that does.

    Args:
        layer: the layer.
        below: the layer below it.
        under: its borders on this layer's surface.

    Returns:
        Views that make up the region together, and one of all of it, whose areas and distances are not true.

    Raises:
        PartError: its borders, or those below, go round an end that is not there.
    """
    own = [(curve.points, curve.winding) for curve in layer.curves]
    held, held_below = poles(layer), poles(below)
    points = [p for p, _ in (*own, *under)]
    sides = [side for k, side in ((1, 1), (0, -1)) if held[k] or held_below[k]]
    assert isinstance(layer.surface, Cone | Revolved)  # by `poles`
    views, cuts = [], []
    for side in sides:
        chart = PoleChart.around(layer.surface, points, side)
        far = [k for k, s in ((0, -1), (1, 1)) if s != side]
        region = _about_pole(chart, own, held[far[0]])
        support = _about_pole(chart, under, held_below[far[0]])
        views.append(View(chart, region, support))
        cuts.append(_true_up_to(chart, points))
    clipped = [_within(view, cut) for view, cut in zip(views, cuts, strict=True)]
    if any(math.isfinite(cut) for cut in cuts):
        clipped.append(_right_round(layer, (own, list(under)), (held, held_below), list(zip(views, cuts, strict=True))))
    return [view for view in clipped if not view.region.is_empty], views[0]


def _about_pole(chart: PoleChart, borders: Sequence[Border], other_end: bool) -> Any:
    """The region within an odd number of borders; beyond all of them where it holds the other end."""
    import shapely

    region = shapely.Polygon()
    for points, _ in borders:
        region = region.symmetric_difference(shapely.Polygon(chart.flat(points)).buffer(0))
    if other_end:
        region = region.symmetric_difference(shapely.Point(0.0, 0.0).buffer(float(chart.meridian[-1, 0]), FINE_CUT))
    return region


def _true_up_to(chart: PoleChart, points: Sequence[Floats]) -> float:
    """The distance from the pole up to which parallels come out no longer than allowed; inf where all do."""
    far = max(float(np.hypot(*chart.flat(p).T).max()) for p in points)
    s = np.linspace(0.0, far, 513)[1:]
    long = np.flatnonzero(np.maximum.accumulate(chart.longer(s)) > MOST_STRETCH)
    return math.inf if len(long) == 0 else float(s[max(long[0] - 1, 0)])


def _within(view: View, cut: float) -> View:
    import shapely

    if not math.isfinite(cut):
        return view
    return View(view.chart, view.region.intersection(shapely.Point(0.0, 0.0).buffer(cut, FINE_CUT)), view.support)


def _right_round(
    layer: Layer,
    borders: tuple[Sequence[Border], Sequence[Border]],
    held: tuple[tuple[bool, bool], tuple[bool, bool]],
    ends: Sequence[tuple[View, float]],
) -> View:
    """What lies farther from the poles than the cuts, unrolled right round; one period of the region."""
    import shapely

    surface = layer.surface
    assert isinstance(surface, Cone | Revolved)
    points = [p for p, _ in (*borders[0], *borders[1])]
    rims = [view.chart.lift(np.array([[cut, 0.0]])) for view, cut in ends if math.isfinite(cut)]
    chart = RoundChart.around(surface, [*points, *rims], ring=True)
    low, high = -math.inf, math.inf
    for view, cut in ends:
        assert isinstance(view.chart, PoleChart)
        if not math.isfinite(cut):
            continue
        at = float(chart.flat(view.chart.lift(np.array([[cut, 0.0]])))[0, 1])
        low, high = (low, min(high, at)) if view.chart.side > 0 else (max(low, at), high)
    top = max(float(chart.flat(p)[:, 1].max()) for p in (*points, *rims)) + 1.0
    region, support = (
        region_right_round(chart, list(one), top, lower) for one, (lower, _) in zip(borders, held, strict=True)
    )
    strip = shapely.box(-1e9, max(low, -1e9), 1e9, min(high, 1e9))
    return View(chart, one_period(chart, region).intersection(strip), support)


def area_about_pole(chart: PoleChart, region: Any) -> float:
    """Area on the surface of a region in a pole's map, mm².

    Args:
        chart: the pole's.
        region: shapely.
    """
    import shapely

    if region.is_empty:
        return 0.0
    pole = shapely.Point(0.0, 0.0)
    far = float(np.hypot(*shapely.get_coordinates(region).T).max())
    at = np.linspace(0.0, far, ANNULI + 1)
    if chart.longer(at[1:]).max() < 1.0 + 1e-9:
        return float(region.area)
    within = [0.0, *(float(region.intersection(pole.buffer(s, FINE_CUT)).area) for s in at[1:-1]), float(region.area)]
    return float((np.diff(within) / chart.longer(0.5 * (at[1:] + at[:-1]))).sum())
