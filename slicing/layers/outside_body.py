"""The part of a planar layer that lies outside the body.

A plane parallel to the axis cuts the body in a strip |u| < u0 of the plane, u measured from the foot of the
axis. What is left of the layer are two half planes, and a region is cut to a half plane loop by loop:

    curves = outside_body(curves, plane, body)

Loops are cut where they cross the line; each place where a loop leaves the half plane is joined along the
line to the next place where one comes back. Orientation is kept: outer loops counter-clockwise, holes
clockwise. Other bodies of revolution meet the plane in a region of another shape (`body_section`), sampled to the
tolerance, which is taken away with shapely.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np

from ..curves.loops import Curve
from ..curves.slabs import Bands
from ..mesh.solid import Floats
from ..surfaces.bodies import RoundBody
from ..surfaces.surfaces import Cone, Cylinder, Plane, Revolved

LEAST_AREA_MM2 = 1e-6  # what is left of a region that only touches the body's side


def outside_body(
    curves: list[Curve],
    plane: Plane,
    body: RoundBody,
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
    if not isinstance(body.surface, Cylinder) or math.isfinite(z_mm[0]) or math.isfinite(z_mm[1]):
        return _outside_section(curves, plane, body.surface, tolerance_mm, z_mm)
    axis = np.append(body.surface.axis_point, 0.0)
    height = -float(plane.distance(axis[None])[0])
    half = body.surface.radius**2 - height**2
    if half <= 0 or not curves:
        return curves
    u_axis, v_axis = plane.axes()
    if all(
        (body.surface.distance(curve.points) > -1e-7).all() and not _crosses(curve, body.surface) for curve in curves
    ):
        return curves
    foot = axis + height * np.asarray(plane.normal)
    loops = [np.stack([(c.points - foot) @ u_axis, (c.points - foot) @ v_axis], axis=1) for c in curves]
    kept: list[Curve] = []
    for side in (1.0, -1.0):
        for loop in clip_half_plane([p * [side, 1.0] for p in loops], float(np.sqrt(half)), side):
            flat = loop * [side, 1.0]
            area = float(0.5 * _twice_area(flat))
            if abs(area) > LEAST_AREA_MM2:
                points = foot + flat[:, :1] * u_axis + flat[:, 1:] * v_axis
                kept.append(Curve(points, True, area < 0, area))
    return kept


def _outside_section(
    curves: list[Curve],
    plane: Plane,
    surface: Cylinder | Cone | Revolved,
    tolerance_mm: float,
    z_mm: tuple[float, float],
) -> list[Curve]:
    """The region outside a body of revolution, which may end along its axis."""
    import shapely

    if not curves:
        return curves
    loops = [plane.unrolled(curve.points) for curve in curves]
    low, high = (float(f([f(loop[:, 1]) for loop in loops])) for f in (np.min, np.max))
    # the second coordinate of a plane beside the axis is z
    low, high = (max(low - 1.0, z_mm[0] - plane.point[2]), min(high + 1.0, z_mm[1] - plane.point[2]))
    if high <= low:
        return curves
    body = body_section(plane, surface, low, high, tolerance_mm)
    region = region_of(loops)
    if not body.intersection(region).area > LEAST_AREA_MM2:
        return curves
    kept: list[Curve] = []
    for polygon in shapely.get_parts(region.difference(body)):
        if polygon.geom_type != "Polygon" or polygon.area <= LEAST_AREA_MM2:
            continue
        for sign, ring in ((1.0, polygon.exterior), *((-1.0, hole) for hole in polygon.interiors)):
            flat = np.asarray(ring.coords)[:-1, :2]
            area = sign * abs(0.5 * _twice_area(flat))
            flat = flat if sign * _twice_area(flat) > 0 else flat[::-1]
            if abs(area) > LEAST_AREA_MM2:
                points = plane.lifted(flat)
                kept.append(Curve(points, True, area < 0, area))
    return kept


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


def body_section(
    plane: Plane, surface: Cylinder | Cone | Revolved, low: float, high: float, tolerance_mm: float
) -> Any:
    """Where a plane parallel to z cuts a body of revolution.

    Args:
        plane: parallel to z.
        surface: the body's.
        low: least second coordinate of `Plane.unrolled` that counts, mm.
        high: the greatest.
        tolerance_mm: how far the sampled border may be off.

    Returns:
        A shapely geometry in the coordinates of `Plane.unrolled`.
    """
    import shapely

    axis = np.append(surface.axis_point, 0.0)
    centre = plane.unrolled(axis[None])[0]
    height = abs(float(plane.distance(axis[None])[0]))
    if isinstance(surface, Cylinder):
        half = math.sqrt(max(surface.radius**2 - height**2, 0.0))
        return shapely.box(centre[0] - half, low, centre[0] + half, high) if half > 0.0 else shapely.Polygon()
    bands = Bands.of(surface.chain(0.05 * tolerance_mm))
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


def _cut_span(bands: Bands, slab: int, begin: float, end: float, height: float) -> tuple[float, float] | None:
    """The heights of a slab at which its cone is wider than the plane's distance from the axis."""
    if end - begin <= 1e-9 or bands.empty[slab]:
        return None
    at = np.array([begin, end])
    r = bands.radius(np.array([slab, slab]), at)
    if (r <= height).all():
        return None
    meet = begin + (height - r[0]) / (r[1] - r[0]) * (end - begin) if (r <= height).any() else begin
    return (begin if r[0] > height else float(meet)), (end if r[1] > height else float(meet))


def _crosses(curve: Curve, body: Cylinder) -> bool:
    """Whether a side of the loop dips into the body between its ends."""
    a = curve.points[:, :2] - body.axis_point
    step = np.roll(a, -1, axis=0) - a
    length2 = (step**2).sum(axis=1)
    t = np.clip(-(a * step).sum(axis=1) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
    closest = a + t[:, None] * step
    return bool((np.hypot(closest[:, 0], closest[:, 1]) < body.radius - 1e-7).any())


def _twice_area(loop: Floats) -> float:
    after = np.roll(loop, -1, axis=0)
    return float((loop[:, 0] * after[:, 1] - loop[:, 1] * after[:, 0]).sum())


def clip_half_plane(loops: list[Floats], limit: float, side: float) -> list[Floats]:
    """The region's part at first coordinate >= limit.

    Args:
        loops: (n, 2) closed loops in mirrored coordinates (side * u, v), the region on the left for side 1,
            on the right for side -1.
        limit: the line.
        side: 1 or -1.

    Returns:
        Loops of the part, in the same coordinates and sense.
    """
    kept: list[Floats] = []
    runs: list[Floats] = []
    for loop in loops:
        inside = loop[:, 0] > limit
        if inside.all():
            kept.append(loop)
        elif inside.any():
            runs += _runs(loop, inside, limit)
    # along the line the kept half plane is on the region's side: downwards for side 1, upwards for side -1
    leave = np.argsort([-side * run[-1, 1] for run in runs], kind="stable")
    enter = np.argsort([-side * run[0, 1] for run in runs], kind="stable")
    after = {int(a): int(b) for a, b in zip(leave, enter, strict=True)}
    while after:
        begin = next(iter(after))
        chain, run = [runs[begin]], after.pop(begin)
        while run != begin:
            chain.append(runs[run])
            run = after.pop(run)
        kept.append(np.concatenate(chain))
    return kept


def _runs(loop: Floats, inside: np.ndarray, limit: float) -> list[Floats]:
    """Stretches of a loop within the half plane, each from the line to the line."""
    n, runs = len(loop), []
    for first in np.flatnonzero(inside & ~np.roll(inside, 1)):
        last = first
        while inside[(last + 1) % n]:
            last += 1
        body = loop[np.arange(first, last + 1) % n]
        entry = _on_line(loop[first - 1], loop[first], limit)
        leave = _on_line(loop[last % n], loop[(last + 1) % n], limit)
        runs.append(np.concatenate([entry[None], body, leave[None]]))
    return runs


def _on_line(a: Floats, b: Floats, limit: float) -> Floats:
    t = (limit - a[0]) / (b[0] - a[0])
    return np.array([limit, a[1] + t * (b[1] - a[1])])
