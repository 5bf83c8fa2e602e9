"""How thick the bead at a point is: the distance to the layer below, against the direction of deposition.

The process must deliver that thickness there. It is measured from the point back along the outward normal of its
surface to the surface of the layer below, or to the body if that comes first:

    bead_thickness(points, surface, below, body, h_layer_mm)

Conventions. A first layer that lies on the body has nothing below it: measured to the body its thickness
would be 0, which no process can lay, so it is given the nominal h_layer, the bead that the first pass is set
to. Planar layers start one h_layer above the lowest point of the root: below the first plane lies the plane
through that point, or the body. Seen this way every planar bead that runs into the body gets thinner towards
it, down to 0 (the paper's figure 18). Layers that are offsets of a cone or another profile are h_layer thick
everywhere: going back along the normal of an offset one meets the next offset after just that.
"""

from __future__ import annotations

from functools import singledispatch

import numpy as np

from ..mesh.solid import Floats
from ..surfaces.bodies import Body
from ..surfaces.offsets import Offsets
from ..surfaces.surfaces import Cylinder, Plane, Surface


def bead_thickness(points: Floats, surface: Surface, below: Surface | None, body: Body, h_layer_mm: float) -> Floats:
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
    if below is None and not surface.is_flat:
        return np.full(len(points), h_layer_mm)
    if not surface.is_straight and below is not None and surface.is_offset_of(below):
        return np.full(len(points), surface.level - below.level)
    normals = surface.normals(points)
    if below is None:
        to_below = np.full(len(points), h_layer_mm)
    else:
        to_below = below.ray_distance(points, normals)
        passed = ~np.isfinite(to_below)
        to_below[passed] = below.distance(points[passed])  # beside a cylinder: the shortest way instead
    to_body = body.surface.ray_distance(points, normals)
    return np.maximum(np.minimum(to_below, to_body), 0.0)


@singledispatch
def _is_even(surface: Offsets, below: Surface | None, body: Body, h_layer_mm: float) -> bool:
    """Whether a layer is known to have one thickness everywhere."""
    return False


@_is_even.register(Cylinder)
def _(surface: Cylinder, below: Surface | None, body: Body, h_layer_mm: float) -> bool:
    """Cylinders about the body's axis are."""
    return below is None or (surface.is_offset_of(below) and surface.is_offset_of(body.surface))


@_is_even.register(Plane)
def _(surface: Plane, below: Surface | None, body: Body, h_layer_mm: float) -> bool:
    """Planes one above the other are that pass the body by."""
    if surface.normal[2] != 0.0:
        return False
    if below is None:
        gap = h_layer_mm
    elif surface.is_offset_of(below):
        gap = surface.height_over(below)
    else:
        return False
    beside = -float(surface.distance(np.array([[*body.surface.axis_point, 0.0]]))[0])
    return beside - body.surface.widest >= gap >= 0.0


def thickness_range(
    loops: list[Floats], surface: Surface, below: Surface | None, body: Body, h_layer_mm: float
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
    if _is_even(surface, below, body, h_layer_mm):  # one place is as good as any
        thickness = bead_thickness(loops[0][:1], surface, below, body, h_layer_mm)
        return float(thickness[0]), float(thickness[0])
    axes = [axis for s in (body.surface, below) if s is not None for axis in s.axis_points]
    points = np.concatenate([*loops, *(_facing(loop, surface, axis) for loop in loops for axis in axes)])
    thickness = bead_thickness(points, surface, below, body, h_layer_mm)
    return float(thickness.min()), float(thickness.max())


def _facing(loop: Floats, surface: Surface, axis: tuple[float, float]) -> Floats:
    """Where a closed curve crosses the line of its surface that faces an axis."""
    line = surface.facing(axis)
    if line is None:
        return loop[:0]
    origin, across = line
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
