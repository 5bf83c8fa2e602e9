"""Non-uniform cylindrical slicing: from the body's curvature to planes, as fast as bead thickness allows.

Layer 0 lies on the body. Each next layer begins as the previous surface offset by h_layer. The arc over which
that meets the sub-volume has the ends P1 and P3; they stay where they are (h_layer above the layer below)
while the middle is let down to h_min:

- if the chord P1 P3 clears the previous surface by h_min or more, the layer is the plane through the chord,
  and planes at h_layer follow;
- otherwise it is the cylinder through P1, P3 and P2, the point h_min above the middle of the previous arc.

    layers = nonuniform_layers(mesh, body, parameters, root)

Decisions where the paper is silent:

- *Middle of the previous arc*: the point of the previous surface below the middle of the new arc P1 P3. For a
  symmetric sub-volume this is the paper's point. For one that leans it keeps the thinnest place exactly in
  the middle, h_min thick; the middle of the previous curve itself would thin the bead below h_min beside it.
  Towards the chord and towards the new arc are the same direction then, so the paper's two cylinder cases
  become one.
- *Several loops, holes, forks*: one arc spans all loops of the layer (the smallest arc about the surface's
  axis).
- *180 degrees or more, rings*: there is no usable chord; the layer stays the plain offset by h_layer. As soon
  as a layer spans less, flattening begins.
- *h_max*: a sub-volume that widens upwards meets the flattened surface beyond P1 and P3, where it lies
  further above the layer below. If the bead there exceeded h_max anywhere on the layer's curves, P2 is raised
  (by bisection, at most to the plain offset, which is h_layer thick everywhere).
- *Nearly flat*: a cylinder of more than FLAT_RADIUS_MM is taken as the plane through P2.
- h_min = h_layer: P2 lies on the offset; the stack is the uniform cylindrical one exactly.
- The stack ends where the offset by h_layer meets nothing.

Source: Lettori et al. 2024, section 3.2, figures 5 to 9, algorithms 1 and 2.
"""

from __future__ import annotations

import math

import numpy as np

from slicing.cylindrical import span
from slicing.intersect import Curve, intersect
from slicing.layers import Body, Layer, SlicingParameters, make_layer
from slicing.part import Mesh
from slicing.planar import planes_from
from slicing.surfaces import Cylinder, Plane, Surface

FLAT_RADIUS_MM = 1e6
WIDE_RAD = math.pi - 1e-3  # from here on there is no usable chord
SAME_MM = 1e-9
BISECTIONS = 20


def nonuniform_layers(mesh: Mesh, body: Body, parameters: SlicingParameters, root: list[Curve]) -> list[Layer]:
    """Slice by cylinders that flatten from layer to layer, then by planes.

    Args:
        mesh: the sub-volume.
        body: what it stands on.
        parameters: the three thicknesses and tolerance_mm.
        root: the curves of layer 0, on the body.

    Returns:
        The layers, from the body outward.
    """
    h, tolerance = parameters.h_layer_mm, parameters.tolerance_mm
    surface = body.surface
    layers = [make_layer(0, surface, root, None, body, h)]
    while True:
        offset = surface.offset(h)
        curves = intersect(mesh, offset, tolerance)
        if not curves:
            return layers
        layer = make_layer(len(layers), offset, curves, surface, body, h)
        middle, width = span(curves, offset.axis_point)
        if width < WIDE_RAD:
            layer = _flattest(mesh, body, parameters, surface, layer, middle, 0.5 * width)
        layers.append(layer)
        if isinstance(layer.surface, Plane):
            return planes_from(mesh, body, parameters, layer.surface, layers)
        assert isinstance(layer.surface, Cylinder)
        surface = layer.surface


def flattened(previous: Cylinder, h_layer_mm: float, middle: float, half: float, height_mm: float) -> Surface:
    """The surface through the ends of the offset arc and a point above its middle.

    Args:
        previous: the layer below.
        h_layer_mm: how far the ends lie above it.
        middle: angle of the arc's middle about previous' axis, rad.
        half: half the angle the arc spans, rad, less than pi / 2.
        height_mm: of P2 above the middle of the previous arc. At or below the chord's height: the plane
            through the chord.

    Returns:
        A cylinder, or a plane where the chord or the limit of flatness is reached. Its point lies above the
        middle.
    """
    outer, p2 = previous.radius + h_layer_mm, previous.radius + height_mm
    if height_mm >= h_layer_mm - SAME_MM:
        return previous.offset(h_layer_mm)
    u = np.array([math.cos(middle), math.sin(middle)])
    chord = outer * math.cos(half)
    # centre at t along u from previous' axis:  (p2 - t)² = (chord - t)² + (outer sin half)²
    t = (p2 * p2 - outer * outer) / (2.0 * (p2 - chord)) if p2 > chord else -math.inf
    if p2 - t > FLAT_RADIUS_MM:
        at = np.asarray(previous.axis_point) + max(p2, chord) * u
        return Plane((float(at[0]), float(at[1]), 0.0), (float(u[0]), float(u[1]), 0.0))
    centre = np.asarray(previous.axis_point) + t * u
    return Cylinder((float(centre[0]), float(centre[1])), p2 - t)


def _flattest(
    mesh: Mesh,
    body: Body,
    parameters: SlicingParameters,
    previous: Cylinder,
    offset: Layer,
    middle: float,
    half: float,
) -> Layer:
    """The flattest layer that keeps the thickness within h_min in the middle and h_max anywhere."""
    h = parameters.h_layer_mm
    chord_height = (previous.radius + h) * math.cos(half) - previous.radius
    low, high = max(parameters.h_min_mm, chord_height), h
    layer = _at_height(mesh, body, parameters, previous, offset, middle, half, low)
    if layer is not None:
        return layer
    best = offset
    for _ in range(BISECTIONS):
        height = 0.5 * (low + high)
        layer = _at_height(mesh, body, parameters, previous, offset, middle, half, height)
        if layer is None:
            low = height
        else:
            best, high = layer, height
    return best


def _at_height(
    mesh: Mesh,
    body: Body,
    parameters: SlicingParameters,
    previous: Cylinder,
    offset: Layer,
    middle: float,
    half: float,
    height_mm: float,
) -> Layer | None:
    """The layer with P2 at a height; None if it is thicker than h_max somewhere, or meets nothing."""
    surface = flattened(previous, parameters.h_layer_mm, middle, half, height_mm)
    if surface == offset.surface:
        return offset
    curves = intersect(mesh, surface, parameters.tolerance_mm)
    if not curves:
        return None
    layer = make_layer(offset.index, surface, curves, previous, body, parameters.h_layer_mm)
    return layer if layer.thickness_mm[1] <= parameters.h_max_mm + SAME_MM else None
