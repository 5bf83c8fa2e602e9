"""Multi-direction planar slicing: planes across a build direction of the sub-volume's own.

    layers = planar_layers(mesh, body, parameters, root)

The build direction is radial, through the middle of the footprint on the body. The stack starts at the lowest
point of the footprint along that direction: the first plane lies one h_layer above it (the bead between the
two is the first layer), and planes follow at h_layer until nothing is left. On a round body that point lies
at the footprint's sides, lower than its middle, so there are more layers than with cylinders, and the first
ones touch the body only partly: their regions are cut off where the body begins.

Source: Lettori et al. 2024, section 4 (after Ding et al. 2016).
"""

from __future__ import annotations

import numpy as np

from ..curves.intersect import Curve, intersect_offsets
from ..layers.body_ends import NO_ENDS
from ..layers.layer import Body, Layer, make_layer, without_slivers
from ..layers.outside_body import outside_body
from ..mesh.solid import Floats, Mesh, PartError
from ..parameters import SlicingParameters
from ..surfaces.surfaces import Plane
from .cylindrical import heights_below, span

RING_RAD = 2 * np.pi - 1e-9


def build_direction(root: list[Curve], body: Body, name: str = "sub-volume") -> Floats:
    """The radial direction through the middle of a footprint.

    Args:
        root: the curves of the footprint on the body.
        body: the body.
        name: of the sub-volume, for the message.

    Returns:
        (3,) unit vector with z = 0.

    Raises:
        PartError: the footprint runs right round the body.
    """
    middle, width = span(root, body.surface.axis_point)
    if width >= RING_RAD:
        raise PartError(
            f"{name}: runs right round the body, so no planar build direction; use cylindrical or nonuniform"
        )
    return np.array([np.cos(middle), np.sin(middle), 0.0])


def planar_layers(
    mesh: Mesh,
    body: Body,
    parameters: SlicingParameters,
    root: list[Curve],
    body_z_mm: tuple[float, float] = NO_ENDS,
) -> list[Layer]:
    """Slice by planes across the build direction.

    Args:
        mesh: the sub-volume.
        body: what it stands on.
        parameters: h_layer_mm and tolerance_mm count.
        root: the curves of its footprint on the body.
        body_z_mm: where the body ends along its axis; beyond, planes reach within its surface.

    Returns:
        The layers, lowest first. The planes' points lie on the line through the axis along the build
        direction, at z = 0.

    Raises:
        PartError: the footprint runs right round the body.
    """
    direction = build_direction(root, body, mesh.name)
    axis = np.append(body.surface.axis_point, 0.0)
    lowest = min(float(((curve.points - axis) @ direction).min()) for curve in root)
    start = axis + lowest * direction
    base = Plane((float(start[0]), float(start[1]), 0.0), (float(direction[0]), float(direction[1]), 0.0))
    return planes_from(mesh, body, parameters, base, [], body_z_mm)


def planes_from(
    mesh: Mesh,
    body: Body,
    parameters: SlicingParameters,
    base: Plane,
    layers: list[Layer],
    body_z_mm: tuple[float, float] = NO_ENDS,
) -> list[Layer]:
    """Planes at h_layer above a base, onto the layers that are there already.

    Args:
        mesh: the sub-volume.
        body: what it stands on.
        parameters: h_layer_mm and tolerance_mm count.
        base: the plane that the stack stands on; not sliced itself.
        layers: what lies below (its last surface is what the first new plane is measured to).
        body_z_mm: where the body ends along its axis.

    Returns:
        `layers` and the new ones.
    """
    layers, step = list(layers), parameters.h_layer_mm
    top = float(base.distance(mesh.vertices).max())
    # planes alone are the tops of their layers, those upon other layers the bottoms
    heights = heights_below(top, parameters) if layers else step * np.arange(1, int(np.floor(top / step)) + 2)
    found = intersect_offsets(mesh, base, heights, parameters.tolerance_mm)
    for height, meeting in zip(heights.tolist(), found, strict=True):
        surface = base.offset(height)
        curves = without_slivers(outside_body(meeting, surface, body, parameters.tolerance_mm, body_z_mm))
        if curves:
            below = layers[-1].surface if layers else None
            layers.append(make_layer(len(layers), surface, curves, below, body, step))
    return layers
