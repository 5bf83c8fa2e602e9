"""How much of a layer's region lies close to the body: the part within a given distance of its surface.

On a plane parallel to the axis, or on a cylinder, the distance to the body depends only on the coordinate
across z (u, or the arc length s). So the part of a region close to the body lies in bands of that coordinate,
and its area is

    A = - sum over the borders of the integral of z ds within the bands      (Green, region on the left)

    area_near_body(layer, body, 0.5 * h_layer)

Layers that are offsets of the body are near it as a whole or not at all. For a plane on a body of revolution that is
no cylinder the region is met with the plane's section of the body's offset instead (shapely). One function a kind of
layer, and for planes one a kind of body.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import singledispatch

import numpy as np

from ..curves.loops import Curve
from ..layers.layer import Body, Layer
from ..layers.outside_body import body_section, region_of
from ..mesh.solid import Floats
from ..surfaces.offsets import Offsets
from ..surfaces.surfaces import Cone, Cylinder, Plane, Revolved

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
    return _near(layer.surface, layer, body, within_mm, z_mm)


@singledispatch
def _near(surface: Offsets, layer: Layer, body: Body, within_mm: float, z_mm: tuple[float, float]) -> float:
    """On an offset of the body: it is near as a whole or not at all."""
    away = float(body.surface.distance(layer.curves[0].points[:1])[0])  # the same anywhere
    return layer.area_mm2 if abs(away) <= within_mm + SLACK_MM else 0.0


@_near.register(Cylinder)
def _(surface: Cylinder, layer: Layer, body: Body, within_mm: float, z_mm: tuple[float, float]) -> float:
    """On a cylinder over a cylindrical body, about its axis or about another."""
    core = body.as_cylinder().surface
    apart = math.dist(surface.axis_point, core.axis_point)
    if apart < 1e-9:
        return layer.area_mm2 if abs(surface.radius - core.radius) <= within_mm + SLACK_MM else 0.0
    if min(_least_away(layer, core), max(abs(surface.radius - apart) - core.radius, 0.0)) > within_mm:
        return 0.0
    return _area_in(layer, surface, _bands_on_cylinder(surface, core, within_mm))


@_near.register(Plane)
def _(surface: Plane, layer: Layer, body: Body, within_mm: float, z_mm: tuple[float, float]) -> float:
    """On a plane, as far as the body goes."""
    heights = np.concatenate([curve.points[:, 2] for curve in layer.curves])
    beyond = heights.min() < z_mm[0] - SLACK_MM or heights.max() > z_mm[1] + SLACK_MM
    return NEAR_ON_PLANE[type(body.surface)](surface, layer, body.surface, within_mm, z_mm if beyond else None)


def _near_cylinder(
    plane: Plane, layer: Layer, core: Cylinder, within_mm: float, z_mm: tuple[float, float] | None
) -> float:
    """On a plane over a cylinder: in bands along the axis; up to the body's ends where z_mm has them."""
    import shapely

    if z_mm is not None:
        loops, low, high = _between(layer, plane, z_mm)
        if high <= low:
            return 0.0
        near = shapely.union_all([shapely.box(a, low, b, high) for a, b in _bands_on_plane(plane, core, within_mm)])
        return float(region_of(loops).intersection(near).area)
    # a region's nearest place may lie between its borders only where it passes over the body's middle
    foot = abs(float(plane.distance(np.array([[*core.axis_point, 0.0]]))[0]))
    if min(_least_away(layer, core), max(foot - core.radius, 0.0)) > within_mm:
        return 0.0
    return _area_in(layer, plane, _bands_on_plane(plane, core, within_mm))


def _near_section(
    plane: Plane, layer: Layer, core: Cone | Revolved, within_mm: float, z_mm: tuple[float, float] | None
) -> float:
    """On a plane over another body: where the body's offset lies; up to its ends where z_mm has them."""
    import shapely

    if z_mm is None:
        loops = [plane.unrolled(curve.points) for curve in layer.curves]
        low, high = min(float(p[:, 1].min()) for p in loops), max(float(p[:, 1].max()) for p in loops)
        near = body_section(plane, core.offset(within_mm), low - 1.0, high + 1.0, SECTION_MM)
        return float(region_of(loops).intersection(near).area)
    loops, low, high = _between(layer, plane, z_mm)
    if high <= low:
        return 0.0
    u = np.concatenate(loops)[:, 0]
    near = body_section(plane, core.offset(within_mm), low, high, SECTION_MM)
    near = near.intersection(shapely.box(u.min(), low, u.max(), high))
    return float(region_of(loops).intersection(near).area)


NEAR_ON_PLANE: dict[type, Callable[..., float]] = {
    Cylinder: _near_cylinder,
    Cone: _near_section,
    Revolved: _near_section,
}


def _between(layer: Layer, plane: Plane, z_mm: tuple[float, float]) -> tuple[list[Floats], float, float]:
    """A layer's loops in its plane, and the range of the second coordinate in which the body lies below them."""
    loops = [plane.unrolled(curve.points) for curve in layer.curves]
    v = np.concatenate(loops)[:, 1]
    # the second axis of a plane beside the axis is z
    low, high = (float(np.clip(z - plane.point[2], v.min(), v.max())) for z in z_mm)
    return loops, low, high


def _least_away(layer: Layer, core: Cylinder) -> float:
    """Least distance of a layer's borders from a body, mm."""
    return min(float(core.distance(curve.points).min()) for curve in layer.curves)


def _bands_on_plane(plane: Plane, core: Cylinder, within_mm: float) -> list[tuple[float, float]]:
    """Intervals of a plane's first coordinate that lie within a distance of a cylinder."""
    near, far = max(core.radius - within_mm, 0.0), core.radius + within_mm
    axis = np.append(core.axis_point, 0.0)
    height = float(plane.distance(axis[None])[0])
    if far <= abs(height):
        return []
    foot = float(plane.unrolled(axis[None])[0, 0])
    low, high = math.sqrt(max(near**2 - height**2, 0.0)), math.sqrt(far**2 - height**2)
    return [(foot - high, foot - low), (foot + low, foot + high)]


def _bands_on_cylinder(surface: Cylinder, core: Cylinder, within_mm: float) -> list[tuple[float, float]]:
    """The same of a cylinder's arc length, its axis beside the other's."""
    near, far = max(core.radius - within_mm, 0.0), core.radius + within_mm
    dx, dy = (a - b for a, b in zip(surface.axis_point, core.axis_point, strict=True))
    apart, towards = math.hypot(dx, dy), math.atan2(dy, dx)
    # squared distance to the body's axis: apart² + r² + 2 apart r cos(angle - towards)
    c_near, c_far = (
        min(max((d * d - apart**2 - surface.radius**2) / (2 * apart * surface.radius), -1.0), 1.0) for d in (near, far)
    )
    low, high = math.acos(c_far), math.acos(c_near)
    r, turns = surface.radius, [towards + 2 * math.pi * k for k in range(-2, 3)]
    return [b for t in turns for b in ((r * (t - high), r * (t - low)), (r * (t + low), r * (t + high)))]


def _area_in(layer: Layer, surface: Cylinder | Plane, bands: list[tuple[float, float]]) -> float:
    """Area of a region within bands."""
    return max(sum(_area_in_bands(curve, surface, bands) for curve in layer.curves), 0.0)


def _area_in_bands(curve: Curve, surface: Cylinder | Plane, bands: list[tuple[float, float]]) -> float:
    """One border's share of the area within the bands."""
    flat = surface.unrolled(curve.points)
    last = flat[0].copy()
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
