"""The part of a layer that overhangs: how far it stands out over what lies below, and pieces with nothing below.

    found = overhangs(sliced, allowed_mm=2.5)
    found[3].area_mm2, found[3].begins_mm2, found[3].place_mm     # mm² with nothing below; in whole pieces; where
    found[3].out_mm, found[3].angle_deg                           # how far it stands out, and the wall's lean

Below a layer lies the layer before, and under planes the body where it is as high. Seen along the layer's own direction
of deposition that is a region of the layer's surface: the borders below are put onto the surface by the shortest way,
which runs along its normal. What of a layer's region lies outside it stands out; by more than ALLOWED of a bead's
width, or than the case says, it has nothing to lie on. A piece of a region that nothing below touches begins in the
air. Layers over the end of a body, where its surface meets the axis, are laid flat in pieces
(`slicing.beads.over_ends`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..layers.layer import Layer, SlicedSubVolume
from ..layers.outside_body import body_section
from ..layers.poles import poles
from ..mesh.solid import Bools, Floats, PartError
from ..surfaces.charts import Chart, FlatChart, RoundChart
from ..surfaces.surfaces import Cone, Cylinder, Plane, Revolved, Round
from ..warning import Code, Warning
from .over_ends import Border, View, views_over_ends
from .overhang_regions import SIMPLE_MM, one_period, region_of_curves

ALLOWED = 0.5  # of a bead's width that may stand out
LEAST_MM2 = 0.5  # smaller areas are not reported, but for pieces that begin in the air: a bead is laid there
FINE_MM = 0.5  # spacing of points along what lies below
DEEP = 0.98  # of the greatest distance from what lies below
EDGE_MM = 0.05  # points so far beside what stands out count to it: beads run along its border
SLIVER_MM, LONG_MM = 0.1, 1.0  # places of what lies below that are narrower, and longer, do not count
SECTION_MM = 0.01  # how true the section of a body is


@dataclass(frozen=True, eq=False)
class Overhang:
    """The part of one layer that overhangs.

    Attributes:
        layer: its number.
        out_mm: how far it stands out over what lies below at most; inf where nothing lies below at all; NaN where it
            was not found, as of layers that cannot be unrolled.
        angle_deg: between the wall and the direction of deposition there, 0 .. 90; NaN likewise.
        area_mm2: of what stands out by more than is allowed.
        begins_mm2: of that, in pieces that nothing below touches.
        place_mm: (3,) the farthest out; None where nothing stands out.
        out: charts, and what stands out by more than is allowed in each; empty where nothing does.
    """

    layer: int
    out_mm: float = 0.0
    angle_deg: float = 0.0
    area_mm2: float = 0.0
    begins_mm2: float = 0.0
    place_mm: Floats | None = None
    out: tuple[tuple[Chart, Any], ...] = ()

    def holds(self, points: Floats) -> Bools:
        """Whether points of the layer overhang.

        Args:
            points: on the layer, (n, 3), mm, part frame.

        Returns:
            (n,).
        """
        import shapely

        held = np.zeros(len(points), dtype=bool)
        for chart, region in self.out:
            flat = chart.flat_each(points)
            held |= np.asarray(shapely.contains_xy(region.buffer(EDGE_MM), flat[:, 0], flat[:, 1]))
        return held

    def to_dict(self) -> dict[str, Any]:
        """As rbam-slices/1 writes it; null for what was not found or has no end."""
        out, angle = (v if math.isfinite(v) else None for v in (self.out_mm, self.angle_deg))
        place = None if self.place_mm is None else [float(v) for v in self.place_mm]
        return {
            "layer": self.layer,
            "out_mm": out,
            "angle_deg": angle,
            "area_mm2": self.area_mm2,
            "begins_mm2": self.begins_mm2,
            "place_mm": place,
        }


def overhangs(sliced: SlicedSubVolume, allowed_mm: float) -> tuple[Overhang, ...]:
    """The part of each layer that overhangs.

    Args:
        sliced: the sub-volume.
        allowed_mm: how far a layer may stand out.

    Returns:
        One entry a layer.
    """
    found = []
    for k, layer in enumerate(sliced.layers):
        if k == 0 and (sliced.stands_on_plate or layer.on_body):
            found.append(Overhang(0))  # on the plate, or on the body, and no further than it goes
            continue
        below = sliced.layers[k - 1] if k else None
        try:
            found.append(_overhang(sliced, layer, below, allowed_mm))
        except PartError:  # cannot be unrolled
            found.append(Overhang(k, math.nan, math.nan))
    return tuple(found)


def _overhang(sliced: SlicedSubVolume, layer: Layer, below: Layer | None, allowed_mm: float) -> Overhang:
    """The part of one layer that overhangs."""
    under = [] if below is None else _put_onto(layer, below)
    views, whole = VIEWS[type(layer.surface)](sliced, layer, layer.surface, below, under)
    seen = _without_slivers(whole)
    views, whole = [seen if view is whole else _without_slivers(view) for view in views], seen
    far, place = _farthest_of(views)
    height = sliced.parameters.h_layer_mm if sliced.stands_on_plate else 0.5 * sum(layer.thickness_mm)
    angle = math.degrees(math.atan2(far, max(height, 1e-9))) if far > 0.0 else 0.0
    found = Overhang(layer.index, far, angle, place_mm=place)
    return found if far <= allowed_mm else _with_warnings(found, views, whole, allowed_mm)


def _without_slivers(view: View) -> View:
    """A view without the long slivers of what lies below: a face that a layer just touches carries no bead."""
    import shapely

    if view.support.covers(view.region.buffer(-SIMPLE_MM)):
        return view  # what lies over slivers is one itself
    lost = []
    for part in shapely.get_parts(view.support):
        core = part.buffer(-0.5 * SLIVER_MM, join_style="mitre")
        if not core.is_empty:  # what is so narrow as a whole is laid as one bead
            thin = part.difference(core.buffer(SLIVER_MM, join_style="mitre"))
            lost += [one for one in shapely.get_parts(thin) if one.length > 2.0 * LONG_MM]
    if not lost:
        return view
    return replace(view, support=view.support.difference(shapely.union_all(lost).buffer(SLIVER_MM)))


def _farthest_of(views: Sequence[View]) -> tuple[float, Floats | None]:
    """Greatest overhang of a layer and its place; inf where nothing lies below."""
    best: tuple[float, Floats | None] = (0.0, None)
    for view in views:
        far, at, foot = _farthest(view.region, view.support)
        if math.isfinite(far):
            far = float(np.linalg.norm(np.subtract(*view.chart.lift(np.stack([at, foot])))))
        if far > best[0]:
            best = far, view.chart.lift(at[None])[0]
    return best


def _with_warnings(found: Overhang, views: Sequence[View], whole: View, allowed_mm: float) -> Overhang:
    """With what stands out by more than is allowed, and what of it begins with nothing below."""
    import shapely

    out = [(v.chart, v.region.difference(v.support.buffer(allowed_mm))) for v in views]
    near = whole.support.buffer(SIMPLE_MM)
    pieces = [piece for piece in shapely.get_parts(whole.region) if not piece.intersects(near)]
    area, begins = sum(chart.area(own) for chart, own in out), sum(whole.chart.area(piece) for piece in pieces)
    # a piece of next to no area gets a bead as well
    in_the_air = any(whole.support.is_empty or whole.support.distance(piece) > allowed_mm for piece in pieces)
    if area < LEAST_MM2 and not (in_the_air and area > 0.0):
        return found
    return replace(found, area_mm2=area, begins_mm2=min(begins, area), out=tuple(out))


def _put_onto(layer: Layer, below: Layer) -> list[Border]:
    """The borders of the layer below on this layer's surface, along its normals, with their turns about the axis."""
    surface, out = layer.surface, []
    offsets = surface.is_offset_of(below.surface)  # lines between points stay lines
    for curve in below.curves:
        points = curve.points if offsets else _dense(curve.points)
        points = points - surface.distance(points)[:, None] * surface.normals(points)
        out.append((points, 0 if surface.is_flat else curve.winding))
    return out


def _dense(points: Floats) -> Floats:
    """A closed polyline with points at most FINE_MM apart."""
    ends = np.roll(points, -1, axis=0)
    count = np.maximum(np.ceil(np.sqrt(((ends - points) ** 2).sum(axis=1)) / FINE_MM), 1).astype(np.int64)
    first = np.cumsum(count) - count
    piece = np.repeat(np.arange(len(points)), count)
    share = (np.arange(len(piece)) - first[piece]) / count[piece]
    return points[piece] + share[:, None] * (ends - points)[piece]


def _views_flat(
    sliced: SlicedSubVolume, layer: Layer, plane: Plane, below: Layer | None, under: Sequence[Border]
) -> tuple[list[View], View]:
    """A plane as it is, on the layer below and on the body."""
    chart = FlatChart(plane)
    region = region_of_curves(chart, [(curve.points, curve.winding) for curve in layer.curves])
    support = region_of_curves(chart, under).union(_body_below(sliced, plane, below, region))
    whole = View(chart, region, support)
    return [whole], whole


def _views_round(
    sliced: SlicedSubVolume, layer: Layer, surface: Round, below: Layer | None, under: Sequence[Border]
) -> tuple[list[View], View]:
    """What goes round the axis: unrolled right round, but about its ends as a map of the pole."""
    if below is not None and any((*poles(layer), *poles(below))):
        return views_over_ends(surface, layer, below, under)
    loops = [curve.points for curve in layer.curves]
    chart = RoundChart.around(surface, loops + [p for p, _ in under], ring=True)
    ahead = np.concatenate(loops)[:, :2].mean(axis=0) - surface.axis_point
    chart = replace(chart, angle=math.atan2(ahead[1], ahead[0]))
    region = region_of_curves(chart, [(curve.points, curve.winding) for curve in layer.curves])
    whole = View(chart, one_period(chart, region), region_of_curves(chart, under))
    return [whole], whole


VIEWS: dict[type, Callable[..., tuple[list[View], View]]] = {
    Plane: _views_flat,
    Cylinder: _views_round,
    Cone: _views_round,
    Revolved: _views_round,
}


def _body_below(sliced: SlicedSubVolume, plane: Plane, below: Layer | None, region: Any) -> Any:
    """Where the body is as high as the layer below a plane, in the plane's coordinates."""
    import shapely

    if sliced.stands_on_plate or region.is_empty:
        return shapely.Polygon()
    down = sliced.parameters.h_layer_mm
    if below is not None:
        if not plane.is_offset_of(below.surface):
            return shapely.Polygon()
        down = plane.height_over(below.surface)
    _, low, _, high = region.bounds
    low, high = (
        max(low - 1.0, sliced.body_z_mm[0] - plane.point[2]),
        min(high + 1.0, sliced.body_z_mm[1] - plane.point[2]),
    )
    if high <= low:
        return shapely.Polygon()
    # the plane below has the same axes and origin but for the step
    return body_section(plane.offset(-down), sliced.body.surface, low, high, SECTION_MM)


def _farthest(region: Any, support: Any) -> tuple[float, Floats, Floats]:
    """Of a region the point farthest from what lies below: its distance, where it is, and the nearest place below."""
    import shapely

    nowhere = np.zeros(2)
    if region.is_empty:
        return 0.0, nowhere, nowhere
    if support.is_empty:
        return math.inf, np.asarray(region.representative_point().coords[0]), nowhere
    out = region.difference(support.buffer(SIMPLE_MM))
    if out.is_empty:
        return 0.0, nowhere, nowhere
    candidates = [shapely.get_coordinates(out.segmentize(FINE_MM))]
    for part in shapely.get_parts(out):
        if part.geom_type == "Polygon" and part.area > 4.0 * LEAST_MM2:  # over a gap the farthest is within
            candidates.append(shapely.get_coordinates(shapely.maximum_inscribed_circle(part, tolerance=0.1))[:1])
            candidates += _deep_within(part, support)
    points = np.concatenate(candidates)
    shapely.prepare(support)
    away = shapely.distance(shapely.points(points), support)
    k = int(np.argmax(away))
    foot = shapely.get_coordinates(shapely.shortest_line(shapely.Point(points[k]), support))[-1]
    return float(away[k]), points[k], foot


def _deep_within(part: Any, support: Any) -> Iterator[Floats]:
    """Places (n, 2) of a part over a gap that are about as far from what lies below as any, gaps beside it or not."""
    import shapely

    x0, y0, x1, y1 = part.bounds
    beside = 0.5 * min(x1 - x0, y1 - y0)
    for air in shapely.get_parts(shapely.box(x0 - beside, y0 - beside, x1 + beside, y1 + beside).difference(support)):
        if air.geom_type == "Polygon" and air.area > LEAST_MM2:
            deep = DEEP * shapely.maximum_inscribed_circle(air, tolerance=0.1).length
            yield shapely.get_coordinates(air.buffer(-deep).intersection(part).segmentize(FINE_MM))


def worst_angle(found: Sequence[Overhang]) -> float | None:
    """Greatest overhang angle of layers, deg; None where it was found of none.

    Args:
        found: the overhangs, one a layer.
    """
    angles = [one.angle_deg for one in found if math.isfinite(one.angle_deg)]
    return max(angles, default=None)


def overhang_lines(name: str, found: Sequence[Overhang], allowed_mm: float) -> list[str]:
    """A line for every layer that overhangs somewhere.

    Args:
        name: of the sub-volume.
        found: from `overhangs`.
        allowed_mm: how far a layer may stand out.

    Returns:
        The lines.
    """
    lines: list[str] = []
    unseen = [one.layer for one in found if math.isnan(one.out_mm)]
    if unseen:
        text = f"{name}: overhang was not checked for {len(unseen)} of its layers, from layer {unseen[0]} on"
        lines.append(Warning(Code.OVERHANG, text, sub_volume=name, layer=unseen[0]))
    for one in found:
        if one.area_mm2 <= 0.0 or one.place_mm is None:
            continue
        x, y, z = one.place_mm
        says_begins = one.begins_mm2 >= LEAST_MM2 or one.area_mm2 < LEAST_MM2
        begins = f"{_mm2(one.begins_mm2)} begin with nothing below them; " if says_begins else ""
        out = f"up to {one.out_mm:.1f} mm" if math.isfinite(one.out_mm) else "with nothing below anywhere"
        text = (
            f"{name}: layer {one.layer}: {begins}{_mm2(one.area_mm2)} overhang what lies below by more than"
            f" {allowed_mm:g} mm, {out}, farthest at ({x:.1f}, {y:.1f}, {z:.1f})"
        )
        lines.append(Warning(Code.OVERHANG, text, sub_volume=name, layer=one.layer))
    return lines


def _mm2(area: float) -> str:
    return f"{area:.1f} mm²" if area >= 0.05 else "less than 0.1 mm²"
