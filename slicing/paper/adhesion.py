"""How much of a layer's region lies close to the body: the part within a given distance of its surface.

On a plane parallel to the axis, or on a cylinder, the distance to the body depends only on the coordinate
across z (u, or the arc length s). So the part of a region close to the body lies in bands of that coordinate,
and its area is

    A = - sum over the borders of the integral of z ds within the bands      (Green, region on the left)

    area_near_body(layer, body, 0.5 * h_layer)

Layers that are offsets of the body are near it as a whole or not at all. For a plane on a body of revolution that is
no cylinder the region is met with the plane's section of the body's offset instead (shapely).
"""

from __future__ import annotations

import math

import numpy as np

from ..layers.layer import Body, ConicalBody, CylindricalBody, Layer, RevolvedBody
from ..layers.outside_body import body_section, region_of
from ..mesh.solid import Floats
from ..surfaces.surfaces import Cylinder, Plane

SECTION_MM = 1e-3  # how true the sampled section of a body is
SLACK_MM = 1e-4  # layer 0 is cut a nudge outside the body


def area_near_body(
    layer: Layer, body: Body, within_mm: float, z_mm: tuple[float, float] = (-math.inf, math.inf)
) -> float:
    """Area of a layer's region whose distance to the body is at most within_mm.

    Args:
        layer: on an offset of the body, on a cylinder, or on a plane parallel to z.
        body: the body.
        within_mm: the distance.
        z_mm: where the body ends along z; counts for planes.

    Returns:
        mm².
    """
    if isinstance(layer.surface, Plane):
        heights = np.concatenate([curve.points[:, 2] for curve in layer.curves])
        if heights.min() < z_mm[0] - SLACK_MM or heights.max() > z_mm[1] + SLACK_MM:
            return _near_between(layer, body, within_mm, z_mm)
    if not isinstance(body, CylindricalBody):
        return _near_revolved(layer, body, within_mm)
    assert isinstance(layer.surface, Cylinder | Plane)
    least, most = math.inf, -math.inf
    for curve in layer.curves:
        away = body.surface.distance(curve.points)
        least, most = min(least, float(away.min())), max(most, float(away.max()))
    if isinstance(layer.surface, Cylinder) and math.dist(layer.surface.axis_point, body.surface.axis_point) < 1e-9:
        return layer.area_mm2 if abs(layer.surface.radius - body.radius_mm) <= within_mm + SLACK_MM else 0.0
    if least > within_mm:
        # a region's nearest place may lie between its borders only where it passes over the body's middle
        least = min(least, _foot_distance(layer.surface, body))
        if least > within_mm:
            return 0.0
    bands = _bands(layer.surface, body, within_mm)
    return max(sum(_area_in_bands(layer, k, bands) for k in range(len(layer.curves))), 0.0)


def _near_between(layer: Layer, body: Body, within_mm: float, z_mm: tuple[float, float]) -> float:
    """The same on a plane that reaches beyond the body's ends."""
    import shapely

    assert isinstance(layer.surface, Plane)
    loops = [layer.surface.unrolled(curve.points) for curve in layer.curves]
    (low_u, low_v), (high_u, high_v) = (f(np.concatenate(loops), axis=0) for f in (np.min, np.max))
    # the second axis of a plane beside the axis is z
    low_v, high_v = (float(np.clip(z - layer.surface.point[2], low_v, high_v)) for z in z_mm)
    if high_v <= low_v:
        return 0.0
    if isinstance(body, CylindricalBody):
        bands = _bands(layer.surface, body, within_mm)
        near = shapely.union_all([shapely.box(a, low_v, b, high_v) for a, b in bands])
    else:
        near = body_section(layer.surface, body.surface.offset(within_mm), low_v, high_v, SECTION_MM)
        near = near.intersection(shapely.box(low_u, low_v, high_u, high_v))
    return float(region_of(loops).intersection(near).area)


def _near_revolved(layer: Layer, body: ConicalBody | RevolvedBody, within_mm: float) -> float:
    """The same on a body that is no cylinder."""
    if isinstance(layer.surface, Plane):
        loops = [layer.surface.unrolled(curve.points) for curve in layer.curves]
        low, high = min(float(p[:, 1].min()) for p in loops), max(float(p[:, 1].max()) for p in loops)
        near = body_section(layer.surface, body.surface.offset(within_mm), low - 1.0, high + 1.0, SECTION_MM)
        return float(region_of(loops).intersection(near).area)
    points = layer.curves[0].points
    away = float(body.surface.distance(points[:1])[0])  # the same anywhere on an offset
    return layer.area_mm2 if abs(away) <= within_mm + SLACK_MM else 0.0


def _foot_distance(surface: Cylinder | Plane, body: CylindricalBody) -> float:
    """Least distance of a whole surface from the body's, 0 where they cut."""
    axis = np.append(body.surface.axis_point, 0.0)
    if isinstance(surface, Plane):
        return max(abs(float(surface.distance(axis[None])[0])) - body.radius_mm, 0.0)
    apart = math.dist(surface.axis_point, body.surface.axis_point)
    return max(abs(surface.radius - apart) - body.radius_mm, 0.0)


def _bands(surface: Cylinder | Plane, body: CylindricalBody, within_mm: float) -> list[tuple[float, float]]:
    """Intervals of the surface's first unrolled coordinate that lie within a distance of the body."""
    near, far = max(body.radius_mm - within_mm, 0.0), body.radius_mm + within_mm
    if isinstance(surface, Plane):
        axis = np.append(body.surface.axis_point, 0.0)
        height = float(surface.distance(axis[None])[0])
        if far <= abs(height):
            return []
        foot = float(surface.unrolled(axis[None])[0, 0])
        low, high = math.sqrt(max(near**2 - height**2, 0.0)), math.sqrt(far**2 - height**2)
        return [(foot - high, foot - low), (foot + low, foot + high)]
    dx, dy = (a - b for a, b in zip(surface.axis_point, body.surface.axis_point, strict=True))
    apart, towards = math.hypot(dx, dy), math.atan2(dy, dx)
    # squared distance to the body's axis: apart² + r² + 2 apart r cos(angle - towards)
    c_near, c_far = (
        min(max((d * d - apart**2 - surface.radius**2) / (2 * apart * surface.radius), -1.0), 1.0) for d in (near, far)
    )
    low, high = math.acos(c_far), math.acos(c_near)
    r, turns = surface.radius, [towards + 2 * math.pi * k for k in range(-2, 3)]
    return [b for t in turns for b in ((r * (t - high), r * (t - low)), (r * (t + low), r * (t + high)))]


def _area_in_bands(layer: Layer, curve_number: int, bands: list[tuple[float, float]]) -> float:
    """One border's share of the area within the bands."""
    curve, surface = layer.curves[curve_number], layer.surface
    flat = surface.unrolled(curve.points)
    last = flat[0].copy()
    assert isinstance(surface, Plane | Cylinder)  # by `area_near_body`
    last[0] += surface.turn_mm * curve.winding
    flat = np.concatenate([flat, last[None]])
    (s0, z0), (s1, z1) = flat[:-1].T, flat[1:].T
    run = s1 - s0
    area = 0.0
    for low, high in bands:
        area -= float(_integral(s0, s1, z0, z1, run, low, high).sum())
    return area


def _integral(s0: Floats, s1: Floats, z0: Floats, z1: Floats, run: Floats, low: float, high: float) -> Floats:
    """Integral of z ds over each segment's part within low .. high."""
    begin, end = np.clip(s0, low, high), np.clip(s1, low, high)
    middle = np.where(run == 0, 0.0, (0.5 * (begin + end) - s0) / np.where(run == 0, 1.0, run))
    return (z0 + middle * (z1 - z0)) * (end - begin)
