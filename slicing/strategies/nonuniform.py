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
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..curves.face_intervals import FaceIntervals
from ..curves.intersect import Curve, intersect
from ..layers.layer import CylindricalBody, Layer, make_layer, without_slivers
from ..mesh.solid import Floats, Mesh
from ..parameters import SlicingParameters
from ..surfaces.surfaces import Cylinder, Plane
from .cylindrical import span
from .planar import planes_from

FLAT_RADIUS_MM = 1e6
WIDE_RAD = math.pi - 1e-3  # from here on there is no usable chord
SAME_MM = 1e-9
BISECTIONS = 20


def nonuniform_layers(
    mesh: Mesh, body: CylindricalBody, parameters: SlicingParameters, root: list[Curve]
) -> list[Layer]:
    """Slice by cylinders that flatten from layer to layer, then by planes.

    Args:
        mesh: the sub-volume.
        body: what it stands on.
        parameters: the three thicknesses and tolerance_mm.
        root: the curves of layer 0, on the body.

    Returns:
        The layers, from the body outward.
    """
    h, surface = parameters.h_layer_mm, body.surface
    layers = [make_layer(0, surface, root, None, body, h)]
    cut = _Cutter(mesh, FaceIntervals.about(mesh, surface), surface, parameters.tolerance_mm)
    while True:
        offset = surface.offset(h)
        curves = cut.curves(offset) if cut.over_mm(offset) > parameters.tolerance_mm else []
        if not curves:
            return layers
        middle, width = span(curves, offset.axis_point)
        found = None
        if width < WIDE_RAD:
            found = _flattest(cut, body, parameters, len(layers), _MeetingArc(surface, middle, 0.5 * width))
        above, layer = found or (offset, make_layer(len(layers), offset, curves, surface, body, h))
        layers.append(layer)
        if isinstance(above, Plane):  # from here on the stack is planar
            return planes_from(mesh, body, parameters, above, layers)
        surface = above


@dataclass(frozen=True)
class _MeetingArc:
    """The arc over which the offset of a layer meets the sub-volume.

    Attributes:
        below: the layer's surface.
        middle: angle of the arc's middle about its axis, rad.
        half: half the angle that it spans, rad.
    """

    below: Cylinder
    middle: float
    half: float


@dataclass(frozen=True, eq=False)
class _Cutter:
    """A mesh to be cut by surfaces of which each depends on what the one before met.

    Attributes:
        mesh: the sub-volume.
        intervals: of its triangles' distances from the body.
        body: the body's surface.
        tolerance_mm: of the curves.
    """

    mesh: Mesh
    intervals: FaceIntervals
    body: Cylinder
    tolerance_mm: float

    def curves(self, surface: Cylinder | Plane) -> list[Curve]:
        """Where a surface meets the mesh; only triangles as far from the body as it lies there are examined."""
        low, high = (mm - self.body.radius for mm in surface.away_from(self.body.axis_point, *self._sector))
        faces = self.intervals.between(low, high)
        return without_slivers(intersect(self.mesh, surface, self.tolerance_mm, faces=faces))

    def over_mm(self, surface: Cylinder) -> float:
        """How far the mesh reaches above a surface, mm."""
        return float(surface.distance(self._corners_about).max())

    @cached_property
    def _corners_about(self) -> Floats:
        """Corners (n, 3), z = 0, of the mesh's outline seen along the axis: one of them is farthest from any axis."""
        import shapely

        outline = shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(self.mesh.vertices[:, :2])))
        return np.column_stack([outline, np.zeros(len(outline))])

    @cached_property
    def _sector(self) -> tuple[float, float]:
        """The angle about the body's axis in which the mesh lies: its middle and half its width, rad."""
        x, y = (self.mesh.vertices[:, k] - self.body.axis_point[k] for k in range(2))
        middle = math.atan2(float(y.mean()), float(x.mean()))
        cosine, sine = math.cos(middle), math.sin(middle)
        ahead, aside = x * cosine + y * sine, np.abs(y * cosine - x * sine)
        if ahead.min() > 0:
            return middle, math.atan(float((aside / ahead).max()))
        return middle, float(np.arctan2(aside, ahead).max())


def flattened(previous: Cylinder, h_layer_mm: float, middle: float, half: float, height_mm: float) -> Cylinder | Plane:
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


Flattened = tuple[Cylinder | Plane, Layer]


def _flattest(
    cut: _Cutter, body: CylindricalBody, parameters: SlicingParameters, index: int, arc: _MeetingArc
) -> Flattened | None:
    """The flattest layer that keeps the thickness within h_min in the middle and h_max anywhere, and its surface.

    None where that is the plain offset of the layer below.
    """
    h, previous = parameters.h_layer_mm, arc.below
    chord_height = (previous.radius + h) * math.cos(arc.half) - previous.radius
    low, high = max(parameters.h_min_mm, chord_height), h
    if low >= h - SAME_MM:
        return None
    found = _at_height(cut, body, parameters, index, arc, low)
    if found is not None:
        return found
    best = None
    for _ in range(BISECTIONS):
        height = 0.5 * (low + high)
        found = _at_height(cut, body, parameters, index, arc, height)
        if found is None:
            low = height
        else:
            best, high = found, height
    return best


def _at_height(
    cut: _Cutter, body: CylindricalBody, parameters: SlicingParameters, index: int, arc: _MeetingArc, height_mm: float
) -> Flattened | None:
    """The layer with P2 at a height; None if it is thicker than h_max somewhere, or meets nothing."""
    surface = flattened(arc.below, parameters.h_layer_mm, arc.middle, arc.half, height_mm)
    curves = cut.curves(surface)
    if not curves:
        return None
    layer = make_layer(index, surface, curves, arc.below, body, parameters.h_layer_mm)
    return (surface, layer) if layer.thickness_mm[1] <= parameters.h_max_mm + SAME_MM else None
