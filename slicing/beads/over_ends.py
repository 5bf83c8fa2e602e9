"""Layers that close over the end of a body, unrolled: about the pole by its map, farther down right round the axis.

    views, whole = views_over_ends(surface, layer, below, under)    # clipped to where each is true

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
from ..surfaces.surfaces import Round
from .overhang_regions import one_period, region_right_round
from .regions import MOST_STRETCH

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


def views_over_ends(surface: Round, layer: Layer, below: Layer, under: Sequence[Border]) -> tuple[list[View], View]:
    """A layer that holds a pole of its surface, or lies on one that does.

    Args:
        surface: the layer's.
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
    views, ends = [], []
    for side in sides:
        chart = PoleChart.around(surface, points, side)
        far = [k for k, s in ((0, -1), (1, 1)) if s != side]
        region = _about_pole(chart, own, held[far[0]])
        support = _about_pole(chart, under, held_below[far[0]])
        views.append(View(chart, region, support))
        ends.append((chart, _true_up_to(chart, points)))
    clipped = [_within(view, *end) for view, end in zip(views, ends, strict=True)]
    cut = [(chart, at) for chart, at in ends if math.isfinite(at)]
    if cut:
        clipped.append(_right_round(surface, (own, list(under)), (held, held_below), cut))
    return [view for view in clipped if not view.region.is_empty], views[0]


def _about_pole(chart: PoleChart, borders: Sequence[Border], other_end: bool) -> Any:
    """The region within an odd number of borders; beyond all of them where it holds the other end."""
    import shapely

    region = shapely.Polygon()
    for points, _ in borders:
        region = region.symmetric_difference(shapely.Polygon(chart.flat(points)).buffer(0))
    if other_end:
        region = region.symmetric_difference(chart.within(float(chart.meridian[-1, 0])))
    return region


def _true_up_to(chart: PoleChart, points: Sequence[Floats]) -> float:
    """The distance from the pole up to which parallels come out no longer than allowed; inf where all do."""
    far = max(float(np.hypot(*chart.flat(p).T).max()) for p in points)
    s = np.linspace(0.0, far, 513)[1:]
    long = np.flatnonzero(np.maximum.accumulate(chart.longer(s)) > MOST_STRETCH)
    return math.inf if len(long) == 0 else float(s[max(long[0] - 1, 0)])


def _within(view: View, chart: PoleChart, cut: float) -> View:
    return View(chart, view.region.intersection(chart.within(cut)), view.support) if math.isfinite(cut) else view


def _right_round(
    surface: Round,
    borders: tuple[Sequence[Border], Sequence[Border]],
    held: tuple[tuple[bool, bool], tuple[bool, bool]],
    cuts: Sequence[tuple[PoleChart, float]],
) -> View:
    """What lies farther from the poles than the cuts, unrolled right round; one period of the region."""
    import shapely

    points = [p for p, _ in (*borders[0], *borders[1])]
    rims = [chart.lift(np.array([[cut, 0.0]])) for chart, cut in cuts]
    chart = RoundChart.around(surface, [*points, *rims], ring=True)
    low, high = -math.inf, math.inf
    for (pole, _), rim in zip(cuts, rims, strict=True):
        at = float(chart.flat(rim)[0, 1])
        low, high = (low, min(high, at)) if pole.side > 0 else (max(low, at), high)
    top = max(float(chart.flat(p)[:, 1].max()) for p in (*points, *rims)) + 1.0
    region, support = (
        region_right_round(chart, list(one), top, lower) for one, (lower, _) in zip(borders, held, strict=True)
    )
    strip = shapely.box(-1e9, max(low, -1e9), 1e9, min(high, 1e9))
    return View(chart, one_period(chart, region).intersection(strip), support)
