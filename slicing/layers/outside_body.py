"""The part of a planar layer that lies outside the body.

A plane parallel to the axis cuts the body in a region (`body_section`): a strip of a cylinder, and of other bodies of
revolution another shape, sampled to the tolerance. Shapely takes it away:

    curves = outside_body(curves, plane, body)

Outer loops come counter-clockwise, holes clockwise. What is left of a loop begins where it began, so that seams stay
in place.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..curves.loops import Curve
from ..curves.slabs import ProfileSlabs
from ..mesh.solid import Floats
from ..surfaces.bodies import Body
from ..surfaces.surfaces import Cone, Cylinder, Plane, Revolved, Round

LEAST_AREA_MM2 = 1e-6  # what is left of a region that only touches the body's side


def outside_body(
    curves: list[Curve],
    plane: Plane,
    body: Body,
    tolerance_mm: float = 0.01,
    z_mm: tuple[float, float] = (-math.inf, math.inf),
) -> list[Curve]:
    """Cut a planar layer where the body begins.

    Args:
        curves: closed loops on the plane, the region on their left.
        plane: parallel to z.
        body: the body.
        tolerance_mm: of the sampled border of a body that is no cylinder.
        z_mm: where the body ends along its axis.

    Returns:
        The loops of the region outside the body; the same ones if the plane passes the body by, or none goes
        inside.
    """
    import shapely

    if not curves:
        return curves
    loops = [plane.unrolled(curve.points) for curve in curves]
    low, high = (float(f([f(loop[:, 1]) for loop in loops])) for f in (np.min, np.max))
    # the second coordinate of a plane beside the axis is z
    low, high = (max(low - 1.0, z_mm[0] - plane.point[2]), min(high + 1.0, z_mm[1] - plane.point[2]))
    if high <= low:
        return curves
    section = body_section(plane, body.surface, low, high, tolerance_mm)
    region = region_of(loops)
    if not section.intersection(region).area > LEAST_AREA_MM2:
        return curves
    centre = float(plane.unrolled(np.append(body.surface.axis_point, 0.0)[None])[0, 0])
    rings: list[tuple[Floats, float]] = []
    for polygon in shapely.get_parts(region.difference(section)):
        if polygon.geom_type != "Polygon" or polygon.area <= LEAST_AREA_MM2:
            continue
        for sign, ring in ((1.0, polygon.exterior), *((-1.0, hole) for hole in polygon.interiors)):
            flat = np.asarray(ring.coords)[:-1, :2]
            area = sign * abs(0.5 * _twice_area(flat))
            flat = flat if sign * _twice_area(flat) > 0 else flat[::-1]
            if abs(area) > LEAST_AREA_MM2:
                rings.append((flat, area))
    return [Curve(plane.lifted(flat), True, area < 0, area) for flat, area in _as_they_began(rings, loops, centre)]


def _as_they_began(rings: list[tuple[Floats, float]], loops: list[Floats], centre: float) -> list[tuple[Floats, float]]:
    """Loops that are left of others, begun and ordered as those are, for shapely does neither.

    A loop begins at the first point of the loop that it is, or where the first stretch that it kept of one begins.
    First come those beyond the axis, and of each side those that are whole.

    Args:
        rings: (n, 2) each, with its area.
        loops: (n, 2) each, what they were cut from.
        centre: first coordinate of the axis.
    """
    at = {tuple(p): (k, i) for k, loop in enumerate(loops) for i, p in enumerate(loop.tolist())}
    begun = []
    for flat, area in rings:
        was = [at.get(tuple(p)) for p in flat.tolist()]
        entries = [(was[i], i - 1) for i in range(len(was)) if was[i] and not was[i - 1]]
        whole = not entries
        first, begin = min(entries or [(one, i) for i, one in enumerate(was) if one], default=((0, 0), 0))
        begun.append(((bool(flat[:, 0].mean() < centre), not whole, first), np.roll(flat, -begin, axis=0), area))
    return [(flat, area) for _, flat, area in sorted(begun, key=lambda one: one[0])]


def region_of(loops: list[Floats]) -> Any:
    """The region on the left of plane loops, however deep they lie within one another.

    Args:
        loops: (n, 2) each, closed; counter-clockwise round material, clockwise round holes.

    Returns:
        A shapely geometry: an island within a hole is in it, as is a hole within that.
    """
    import shapely

    region = shapely.Polygon()
    # from the largest inward: what lies within a loop is smaller than it
    twice = [_twice_area(loop) for loop in loops]
    order = sorted(range(len(loops)), key=lambda k: -abs(twice[k]))
    for material, run in itertools.groupby(order, key=lambda k: twice[k] > 0):
        own = shapely.union_all([shapely.Polygon(loops[k]).buffer(0) for k in run])
        region = region.union(own) if material else region.difference(own)
    return region


def body_section(plane: Plane, surface: Round, low: float, high: float, tolerance_mm: float) -> Any:
    """The section of a body of revolution by a plane parallel to z.

    Args:
        plane: parallel to z.
        surface: the body's.
        low: least second coordinate of `Plane.unrolled` that counts, mm.
        high: the greatest.
        tolerance_mm: how far the sampled border may be off.

    Returns:
        A shapely geometry in the coordinates of `Plane.unrolled`.
    """
    axis = np.append(surface.axis_point, 0.0)
    centre = plane.unrolled(axis[None])[0]
    height = abs(float(plane.distance(axis[None])[0]))
    return SECTIONS[type(surface)](surface, centre, height, (low, high), tolerance_mm)


def _strip(surface: Cylinder, centre: Floats, height: float, between: tuple[float, float], tolerance_mm: float) -> Any:
    """Of a cylinder: a strip along its axis.

    Args:
        surface: the body's.
        centre: (2,) its axis at z = 0 in the plane's coordinates.
        height: of the plane over the axis, mm.
        between: least and greatest second coordinate that count, mm.
        tolerance_mm: it does not matter: the border is straight.
    """
    import shapely

    half = math.sqrt(max(surface.radius**2 - height**2, 0.0))
    low, high = between
    return shapely.box(centre[0] - half, low, centre[0] + half, high) if half > 0.0 else shapely.Polygon()


def _section_by_bands(
    surface: Cone | Revolved, centre: Floats, height: float, between: tuple[float, float], tolerance_mm: float
) -> Any:
    """Of a cone or a profile: band by band between hyperbolas, sampled to the tolerance."""
    import shapely

    low, high = between
    bands = ProfileSlabs.of(surface.chain(0.05 * tolerance_mm))
    border = np.concatenate([[low - centre[1]], bands.z, [high - centre[1]]])
    border = np.clip(border, low - centre[1], high - centre[1])
    parts = []
    for slab, (begin, end) in enumerate(itertools.pairwise(border.tolist())):
        span = _cut_span(bands, slab, begin, end, height)
        if span is None:
            continue
        count = int(np.clip(np.ceil(4.0 * np.sqrt((span[1] - span[0]) / tolerance_mm)), 8, 512))
        # closer towards the ends, where the border may start like a root
        v = span[0] + (span[1] - span[0]) * 0.5 * (1.0 - np.cos(np.linspace(0.0, np.pi, count + 1)))
        radius = bands.radius(np.full(len(v), slab), v)
        u = np.sqrt(np.maximum(radius**2 - height**2, 0.0))
        side = np.stack([centre[0] + u, centre[1] + v], axis=1)
        other = np.stack([centre[0] - u, centre[1] + v], axis=1)
        parts.append(shapely.Polygon(np.concatenate([side, other[::-1]])).buffer(0))
    return shapely.union_all(parts)


SECTIONS: dict[type, Callable[..., Any]] = {
    Cylinder: _strip,
    Cone: _section_by_bands,
    Revolved: _section_by_bands,
}


def _cut_span(bands: ProfileSlabs, slab: int, begin: float, end: float, height: float) -> tuple[float, float] | None:
    """The heights of a slab at which its cone is wider than the plane's distance from the axis."""
    if end - begin <= 1e-9 or bands.empty[slab]:
        return None
    at = np.array([begin, end])
    r = bands.radius(np.array([slab, slab]), at)
    if (r <= height).all():
        return None
    meet = begin + (height - r[0]) / (r[1] - r[0]) * (end - begin) if (r <= height).any() else begin
    return (begin if r[0] > height else float(meet)), (end if r[1] > height else float(meet))


def _twice_area(loop: Floats) -> float:
    after = np.roll(loop, -1, axis=0)
    return float((loop[:, 0] * after[:, 1] - loop[:, 1] * after[:, 0]).sum())
