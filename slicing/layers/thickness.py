"""How thick the bead at a point is: the distance to the layer below, against the direction of deposition.

It is what the process must deliver there. From the point one goes back along the outward normal of the
point's own surface until one meets the surface of the layer below, or the body if that comes first:

    bead_thickness(points, surface, below, body, h_layer_mm)

Conventions. A first layer that lies on the body has nothing below it: measured to the body its thickness
would be 0, which no process can lay, so it is given the nominal h_layer, the bead that the first pass is set
to. Planar layers start one h_layer above the lowest point of the root: below the first plane lies the plane
through that point, or the body. Seen this way every planar bead that runs into the body gets thinner towards
it, down to 0 (the paper's figure 18). Layers that are offsets of a cone or another profile are h_layer thick
everywhere: going back along the normal of an offset one meets the next offset after just that.
"""

from __future__ import annotations

import math

import numpy as np

from ..mesh.solid import Floats
from ..surfaces.bodies import RoundBody
from ..surfaces.offset_families import radius_at
from ..surfaces.surfaces import Cone, Cylinder, Plane, Revolved, Surface

MOST_STEPS = 400  # of the march back to a surface of revolution
NEAR_MM, FAR_MM = 1e-10, 1e5  # how near it must come; how far it goes
STEP_MM = 1e-9  # to either side of a height, so that a step there is seen


def distance_back(points: Floats, normals: Floats, surface: Surface) -> Floats:
    """Distance from points to a surface, going against the normals.

    Args:
        points: (n, 3) mm.
        normals: (n, 3) unit outward normals at the points.
        surface: what to meet.

    Returns:
        (n,) mm; inf where the ray passes the surface by. On round surfaces the outermost crossing counts.
    """
    if isinstance(surface, Cone | Revolved):
        if (normals[:, 2] == 0.0).all() and (isinstance(surface, Cone) or surface.offset_mm == 0.0):
            return _across_axis(points, normals, surface.axis_point, _widest_at(surface, points[:, 2]))
        return _marched(points, normals, surface)
    if isinstance(surface, Plane):
        towards = normals @ np.asarray(surface.normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(np.abs(towards) > 1e-12, surface.distance(points) / towards, np.inf)
    return _across_axis(points, normals, surface.axis_point, np.full(len(points), surface.radius))


def _widest_at(surface: Cone | Revolved, z: Floats) -> Floats:
    """Radius (n,) of a surface of revolution at heights, at a step the greater of the two."""
    return np.maximum(radius_at(surface, z - STEP_MM), radius_at(surface, z + STEP_MM))


def _across_axis(points: Floats, normals: Floats, axis_point: tuple[float, float], radius: Floats) -> Floats:
    """Distances back (n,) to circles about the axis, each of its own radius (n,), across the axis."""
    relative = points[:, :2] - axis_point
    across = normals[:, :2]
    length = np.hypot(relative[:, 0], relative[:, 1])
    # |relative - t across|² = radius²:  a t² - 2 b t + c = 0, the first root met from outside
    a = (across**2).sum(axis=1)
    b = (relative * across).sum(axis=1)
    c = (length - radius) * (length + radius)
    d = b * b - a * c
    with np.errstate(divide="ignore", invalid="ignore"):
        near = c / (b + np.sqrt(np.maximum(d, 0.0)))
    return np.where((d >= 0) & (b > 0), near, np.inf)


def _marched(points: Floats, normals: Floats, surface: Cone | Revolved) -> Floats:
    """Distance back from outside (n,): each step as long as the distance to the surface, so none passes it.

    Along the surface's own normal the first step arrives; rays that graze it take many.
    """
    gone = np.maximum(surface.distance(points), 0.0)
    open_ = np.flatnonzero(gone > NEAR_MM)
    for _ in range(MOST_STEPS):
        step = surface.distance(points[open_] - gone[open_, None] * normals[open_])
        gone[open_] += np.maximum(step, 0.0)
        open_ = open_[(step > NEAR_MM) & (gone[open_] < FAR_MM)]
        if len(open_) == 0:
            break
    gone[open_] = np.inf
    return np.where(gone < FAR_MM, gone, np.inf)


def bead_thickness(
    points: Floats, surface: Surface, below: Surface | None, body: RoundBody, h_layer_mm: float
) -> Floats:
    """Thickness of the bead at points of a layer.

    Args:
        points: (n, 3) on the layer's surface, mm.
        surface: the layer's.
        below: the layer below's surface; None for the first layer.
        body: what the sub-volume stands on.
        h_layer_mm: the nominal thickness: of a first layer on the body, and from a first plane to the root's
            lowest point.

    Returns:
        (n,) mm, not below 0.
    """
    if below is None and not isinstance(surface, Plane):
        return np.full(len(points), h_layer_mm)
    gap = _parallel_gap(surface, below)
    if gap is not None:
        return np.full(len(points), gap)
    normals = surface.normals(points)
    if below is None:
        to_below = np.full(len(points), h_layer_mm)
    else:
        to_below = distance_back(points, normals, below)
        passed = ~np.isfinite(to_below)
        to_below[passed] = below.distance(points[passed])  # beside a cylinder: the shortest way instead
    to_body = distance_back(points, normals, body.surface)
    return np.maximum(np.minimum(to_below, to_body), 0.0)


def _parallel_gap(surface: Surface, below: Surface | None) -> float | None:
    """How far apart two offsets of one cone or profile are, the same everywhere; None if they are not such."""
    if isinstance(surface, Revolved) and isinstance(below, Revolved):
        gap = surface.offset_mm - below.offset_mm
        same = surface.profile == below.profile and surface.axis_point == below.axis_point
    elif isinstance(surface, Cone) and isinstance(below, Cone):
        gap = (surface.radius - below.radius) * math.cos(math.radians(surface.half_angle_deg))
        same = surface.half_angle_deg == below.half_angle_deg and surface.axis_point == below.axis_point
    else:
        return None
    return gap if same else None


def _even(surface: Surface, below: Surface | None, body: RoundBody, h_layer_mm: float) -> bool:
    """Whether a layer is known to be as thick everywhere.

    Cylinders about the body's axis are, and planes one above the other that pass the body by.
    """
    core = body.surface
    if isinstance(surface, Cylinder):
        if below is None:
            return True
        return isinstance(below, Cylinder) and surface.axis_point == below.axis_point == core.axis_point
    if not (isinstance(surface, Plane) and isinstance(core, Cylinder) and surface.normal[2] == 0.0):
        return False
    if below is None:
        gap = h_layer_mm
    elif isinstance(below, Plane) and below.normal == surface.normal:
        gap = -float(surface.distance(np.array([below.point]))[0])
    else:
        return False
    return -float(surface.distance(np.array([[*core.axis_point, 0.0]]))[0]) - core.radius >= gap >= 0.0


def thickness_range(
    loops: list[Floats], surface: Surface, below: Surface | None, body: RoundBody, h_layer_mm: float
) -> tuple[float, float]:
    """Least and greatest thickness anywhere along closed curves, between their points too.

    Along a surface the thickness only grows with the distance from where it faces an axis below (the body's,
    or that of the layer below). So its extremes lie at points of the curves or where a curve passes such a
    line, which is added.

    Args:
        loops: (n, 3) points of each closed curve, mm.
        surface: the layer's.
        below: the layer below's surface; None for the first layer.
        body: what the sub-volume stands on.
        h_layer_mm: the nominal thickness.

    Returns:
        Least and greatest, mm.
    """
    if _even(surface, below, body, h_layer_mm):  # one place is as good as any
        thickness = bead_thickness(loops[0][:1], surface, below, body, h_layer_mm)
        return float(thickness[0]), float(thickness[0])
    axes = [s.axis_point for s in (body.surface, below) if s is not None and not isinstance(s, Plane)]
    points = np.concatenate([*loops, *(_facing(loop, surface, axis) for loop in loops for axis in axes)])
    thickness = bead_thickness(points, surface, below, body, h_layer_mm)
    return float(thickness.min()), float(thickness.max())


def _facing(loop: Floats, surface: Surface, axis: tuple[float, float]) -> Floats:
    """Where a closed curve crosses the line of its surface that faces an axis."""
    if isinstance(surface, Cone | Revolved):
        return loop[:0]  # their layers are as thick everywhere
    if isinstance(surface, Cylinder):
        origin = np.asarray(surface.axis_point)
        across = np.asarray(axis) - origin
    else:
        origin, across = np.asarray(axis), np.asarray(surface.normal[:2])
    side = across[0] * (loop[:, 1] - origin[1]) - across[1] * (loop[:, 0] - origin[0])
    after = np.roll(side, -1)
    cut = np.flatnonzero(side * after < 0)
    share = (side[cut] / (side[cut] - after[cut]))[:, None]
    points = loop[cut] + share * (np.roll(loop, -1, axis=0)[cut] - loop[cut])
    return points - surface.distance(points)[:, None] * surface.normals(points)


def resampled(loop: Floats, surface: Surface, spacing_mm: float) -> Floats:
    """A closed curve at about even spacing, its new points put onto its surface.

    Args:
        loop: (n, 3) its points, mm.
        surface: what it lies on.
        spacing_mm: along the curve.

    Returns:
        (m, 3) mm, at least 8 points.
    """
    closed = np.concatenate([loop, loop[:1]])
    length = np.append(0.0, np.cumsum(np.sqrt((np.diff(closed, axis=0) ** 2).sum(axis=1))))
    count = max(int(np.ceil(length[-1] / spacing_mm)), 8)
    at = np.arange(count) / count * length[-1]
    points = np.stack([np.interp(at, length, closed[:, k]) for k in range(3)], axis=1)
    return points - surface.distance(points)[:, None] * surface.normals(points)
