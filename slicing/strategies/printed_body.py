"""The central body itself, printed: planar layers along its axis, from its lower end up.

    solid = turned_solid(((20.0, 0.0), (20.0, 40.0)), (0.0, 0.0), tolerance_mm=0.01)
    sliced = slice_body(solid, CylindricalBody(20.0), SlicingParameters(h_layer_mm=1.73))
    sliced.name, len(sliced.layers)           # ("BODY", 24)

As layer 0 of a sub-volume lies on the body, layer 0 here lies on what the body stands on, the plate or the support:
its plane is that of the body's lower end, and its curves are the footprint. Planes follow at h_layer; each bead
reaches up to the next plane, the last one up to a layer above the body's upper end at most. Below layer 0 there is
the plate, which leaves no thickness to be measured: it gets the nominal h_layer, like every layer above it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from ..curves.intersect import intersect_offsets
from ..layers.layer import Layer, SlicedSubVolume, require_layers
from ..mesh.solid import Floats, Mesh, PartError, mesh_from_arrays
from ..parameters import SlicingParameters
from ..surfaces.bodies import Body
from ..surfaces.surfaces import Plane
from ..volume.layer_areas import MOST_OFF

BODY_NAME = "BODY"
ON_AXIS_MM = 1e-9
CORNERS = (48, 4096)  # of a circle, at least and at most


def slice_body(mesh: Mesh, body: Body, parameters: SlicingParameters) -> SlicedSubVolume:
    """Slice the body across its axis.

    Args:
        mesh: the body as a solid, part frame (axis along z), mm.
        body: its round surface, which the sub-volumes stand on.
        parameters: h_layer_mm and tolerance_mm count.

    Returns:
        Its layers, lowest first, under the name BODY and the strategy planar.

    Raises:
        PartError: it is so thin that no plane meets it, or the layers are thinner than is sliced.
    """
    require_layers(mesh, parameters.h_layer_mm)
    low, high = (float(z) for z in mesh.bounds[:, 2])
    x, y = (float(v) for v in body.axis_xy_mm)
    base, step = Plane((x, y, low), (0.0, 0.0, 1.0)), parameters.h_layer_mm
    heights = step * np.arange(math.floor((high - low) / step) + 1)
    layers: list[Layer] = []
    found = intersect_offsets(mesh, base, heights, parameters.tolerance_mm)
    for height, curves in zip(heights.tolist(), found, strict=True):
        if curves:
            area = sum(curve.area_mm2 for curve in curves)
            layers.append(Layer(len(layers), base.offset(height), tuple(curves), area, (step, step)))
    if not layers:
        raise PartError(f"{BODY_NAME}: thinner than one layer ({step} mm) along its axis")
    laid = step * sum(layer.area_mm2 for layer in layers)
    return SlicedSubVolume(
        BODY_NAME,
        "planar",
        mesh,
        body,
        tuple(layers),
        (*mesh.warnings, *_volume_line(mesh, base, layers)),
        parameters,
        stands_on_plate=True,
        volume_mm3=mesh.volume,
        laid_volume_mm3=laid,
        end_mm=float(heights[-1]) + step - (high - low),
    )


def _volume_line(mesh: Mesh, base: Plane, layers: list[Layer]) -> list[str]:
    """A line where the sections, joined by the trapezoidal rule, do not make the body's volume."""
    area = np.array([layer.area_mm2 for layer in layers])
    height = np.array([layer.surface.level - base.level for layer in layers])
    top = float(np.ptp(mesh.bounds[:, 2]))
    held = float(np.trapezoid(area, height) + area[-1] * (top - height[-1]))
    if abs(held - mesh.volume) <= MOST_OFF * mesh.volume:
        return []
    return [f"{BODY_NAME}: its sections hold {held:.1f} mm³, its mesh {mesh.volume:.1f} mm³"]


def turned_solid(profile: Sequence[tuple[float, float]], axis_xy_mm: tuple[float, float], tolerance_mm: float) -> Mesh:
    """A profile turned about an axis parallel to z, as a closed mesh.

    Args:
        profile: (r, z) points, mm, lowest first; flat ends are added where r is above 0 there.
        axis_xy_mm: where the axis is.
        tolerance_mm: how far the mesh may lie inside the round solid; its corners lie on it.

    Returns:
        The mesh, named BODY.

    Raises:
        PartError: it encloses nothing.
    """
    widest = max(max(r for r, _ in profile), ON_AXIS_MM)
    turn = 2.0 * math.acos(max(1.0 - tolerance_mm / widest, 0.5))
    corners = int(np.clip(math.ceil(2.0 * math.pi / turn), *CORNERS))
    points = [(max(float(r), 0.0), float(z)) for r, z in profile]
    if points[0][0] > ON_AXIS_MM:
        points.insert(0, (0.0, points[0][1]))
    if points[-1][0] > ON_AXIS_MM:
        points.append((0.0, points[-1][1]))
    rings = [_ring(axis_xy_mm, point, corners) for point in points]
    first = np.append(0, np.cumsum([len(ring) for ring in rings]))
    i = np.arange(corners)
    j = (i + 1) % corners
    faces = []
    for k, (below, above) in enumerate(itertools.pairwise(rings)):
        a, b = first[k], first[k + 1]
        # at a ring that is one point, on the axis, one of the two triangles of each quadrilateral has no area
        if len(below) > 1:
            faces.append(np.stack([a + i, a + j, b + (j if len(above) > 1 else 0 * j)], axis=1))
        if len(above) > 1:
            faces.append(np.stack([a + (i if len(below) > 1 else 0 * i), b + j, b + i], axis=1))
    if not faces:
        raise PartError(f"{BODY_NAME}: its profile lies on the axis; a solid is needed")
    return mesh_from_arrays(BODY_NAME, np.concatenate(rings), np.concatenate(faces))


def _ring(axis: tuple[float, float], point: tuple[float, float], corners: int) -> Floats:
    """Corners of a ring about the axis; one point where it lies on the axis."""
    r, z = point
    if r <= ON_AXIS_MM:
        return np.array([[axis[0], axis[1], z]])
    angle = 2.0 * np.pi * np.arange(corners) / corners
    return np.stack([axis[0] + r * np.cos(angle), axis[1] + r * np.sin(angle), np.full(corners, z)], axis=1)
