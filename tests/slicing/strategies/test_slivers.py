"""Layers that just reach the top of a solid: loops a few micrometres wide are no metal."""

from __future__ import annotations

import math

import manifold3d
import numpy as np
import pytest
from support.parts.meshes import box_solid, from_manifold

from slicing import (
    WRONG_LAYER,
    CylindricalBody,
    Mesh,
    PartError,
    SlicedSubVolume,
    SlicingParameters,
    slice_sub_volume,
)
from slicing.mesh.solid import mesh_from_arrays
from slicing.surfaces.surfaces import Plane
from slicing.warning import Warning

RADIUS, HALF, STEP = 40.0, 9.5, 1.73


def prism(corners: list[tuple[float, float]]) -> Mesh:
    """Along z; corners counter-clockwise in x, y, the outline convex."""
    n = len(corners)
    faces = [(0, k + 1, k) for k in range(1, n - 1)] + [(n, n + k, n + k + 1) for k in range(1, n - 1)]
    for k in range(n):
        j = (k + 1) % n
        faces += [(k, j, n + j), (k, n + j, n + k)]
    return mesh_from_arrays("SV1", np.array([(x, y, z) for z in (10.0, 30.0) for x, y in corners]), np.array(faces))


def boss(edge: float) -> Mesh:
    """A box whose upper edges are so far from the axis."""
    x = math.sqrt(edge**2 - HALF**2)
    return prism([(36.0, -HALF), (x, -HALF), (x, HALF), (36.0, HALF)])


def roof(ridge: float) -> Mesh:
    """With an edge along z at x = ridge."""
    return prism([(36.0, -HALF), (ridge - 5.0, -HALF), (ridge, 0.0), (ridge - 5.0, HALF), (36.0, HALF)])


def sliced(mesh: Mesh, strategy: str) -> SlicedSubVolume:
    found = slice_sub_volume(mesh, CylindricalBody(RADIUS), SlicingParameters(strategy, STEP))
    lines = [line for line in found.warnings if isinstance(line, Warning)]
    assert not [line for line in lines if line.code in WRONG_LAYER]
    return found


@pytest.mark.parametrize("above_mm", [4e-4, 1e-5, 0.0, -1e-5])
def test_a_cylinder_that_just_reaches_the_edges_is_no_layer(above_mm: float) -> None:
    assert len(sliced(boss(RADIUS + 4 * STEP + above_mm), "cylindrical").layers) == 4


@pytest.mark.parametrize("above_mm", [4e-4, -1e-5, *(pytest.param(a, marks=pytest.mark.slow) for a in (1e-5, 0.0))])
@pytest.mark.parametrize("strategy", ["planar", "nonuniform"])
def test_a_plane_that_just_reaches_the_ridge_is_no_layer(strategy: str, above_mm: float) -> None:
    planes = [layer.surface for layer in sliced(roof(70.0), strategy).layers if isinstance(layer.surface, Plane)]
    heights = [float(np.dot(plane.point, plane.normal)) for plane in planes]
    layers = sliced(roof(heights[-4] + above_mm), strategy).layers
    assert isinstance(layers[-1].surface, Plane)
    assert np.dot(layers[-1].surface.point, layers[-1].surface.normal) == pytest.approx(heights[-5])


def test_metal_of_a_tenth_of_a_millimetre_stays() -> None:
    layers = sliced(boss(RADIUS + 4 * STEP + 0.02), "cylindrical").layers
    assert len(layers) == 5
    assert sum(curve.length_mm for curve in layers[4].curves) > 70.0


@pytest.mark.parametrize("off_mm", [0.0, -1e-6, -1e-4])
@pytest.mark.parametrize("strategy", ["cylindrical", "nonuniform"])
def test_a_side_tangent_to_the_body_is_no_border_of_the_layer_on_it(strategy: str, off_mm: float) -> None:
    # a post along the body that touches it in a line, and a web beside it that stands on the body
    post = manifold3d.Manifold.cylinder(20.0, 5.0, 5.0, 16).translate((RADIUS + 5.0 + off_mm, 0.0, 10.0))
    web = box_solid((30.0, 3.0, 10.0), (RADIUS + 5.0, 5.0, 30.0))
    first, *_ = sliced(from_manifold(post + web), strategy).layers
    assert len(first.curves) == 1
    assert first.area_mm2 == pytest.approx(
        20.0 * RADIUS * (math.asin(5.0 / RADIUS) - math.asin(3.0 / RADIUS)), rel=1e-6
    )


def test_a_solid_that_touches_the_body_along_a_line_has_no_footprint() -> None:
    post = manifold3d.Manifold.cylinder(20.0, 5.0, 5.0, 16).translate((RADIUS + 5.0, 0.0, 10.0))
    with pytest.raises(PartError, match="only in points or lines"):
        sliced(from_manifold(post), "cylindrical")


def test_a_plane_that_cuts_a_corner_a_micrometre_wide_beside_the_body_is_not_wrong() -> None:
    # the slab leaves a body of 20 mm tangentially; its third plane meets the edge at x = -10 where the body begins
    slab = box_solid((-10.0, 10.0, -10.0), (40.0, 20.0, 10.0))
    found = slice_sub_volume(from_manifold(slab), CylindricalBody(20.0), SlicingParameters("planar", STEP))
    assert len(found.layers[2].curves) == 1
    assert not [line for line in found.warnings if isinstance(line, Warning) and line.code in WRONG_LAYER]
