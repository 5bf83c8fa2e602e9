"""Deposits of layers that flatten: the metal up to the next layer, along their own normals, and of the first bead."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.layers.deposits import inside
from support.parts.meshes import box_solid, from_manifold

from slicing.arrays import Floats
from slicing.deposits.part_shape import part_shape
from slicing.layers.layer import CylindricalBody, Layer, SlicedSubVolume
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume

R, H, LEAST = 20.0, 3.0, 0.5


@pytest.fixture(scope="module", params=[(-9.0, 9.0), (5.0, 20.0)], ids=["upright", "beside_the_axis"])
def sliced(request: pytest.FixtureRequest) -> SlicedSubVolume:
    low, high = request.param
    blade = box_solid((0.0, low, -5.0), (40.0, high, 5.0))
    parameters = SlicingParameters("nonuniform", H, LEAST, 1.4 * H)
    return slice_sub_volume(from_manifold(blade), CylindricalBody(R), parameters)


def pieces(sliced: SlicedSubVolume, layer: int) -> list[trimesh.Trimesh]:
    found = part_shape([sliced], None, ((R, -30.0), (R, 30.0))).hulls.items()
    return [trimesh.PointCloud(v).convex_hull for name, v in found if name.startswith(f"deposit/{layer}/")]


def radial(layer: Layer, points: Floats) -> Floats:
    """Unit vectors away from the axis of a layer that is a cylinder."""
    away = points - [*layer.surface.axis_point, 0.0]
    away[:, 2] = 0.0
    return away / np.linalg.norm(away, axis=1)[:, None]


def way_to(layer: Layer, points: Floats, normals: Floats) -> Floats:
    """How far it is from points along normals to a plane, or from inside to a cylinder."""
    surface = layer.surface
    if surface.kind == "plane":
        return ((np.asarray(surface.point) - points) @ surface.normal) / (normals @ surface.normal)
    away = points[:, :2] - surface.axis_point
    half = (away * normals[:, :2]).sum(axis=1)
    return -half + np.sqrt(half**2 - (away**2).sum(axis=1) + surface.radius**2)


def test_metal_up_to_the_next_layer_is_among_the_pieces_of_a_layer_that_is_bowed(sliced: SlicedSubVolume) -> None:
    bowed = [layer for layer in sliced.layers[:-1] if layer.surface.kind == "cylinder"]
    assert sliced.layers[len(bowed)].surface.kind == "plane"
    for layer in bowed:
        points = np.concatenate([curve.points for curve in layer.curves])
        normals = radial(layer, points)
        above = way_to(sliced.layers[layer.index + 1], points, normals)
        top = points + (0.99 * np.minimum(above, LEAST if layer.index else H))[:, None] * normals
        assert inside(pieces(sliced, layer.index), top).all()
        ends = above <= H + 1e-6  # where the next layer's beads lie
        assert ends.any()
        assert inside(pieces(sliced, layer.index), points[ends] + 0.99 * above[ends, None] * normals[ends]).all()


def test_the_first_bead_is_as_thick_as_it_is_laid_whatever_lies_above(sliced: SlicedSubVolume) -> None:
    layer = sliced.layers[0]
    angle = np.arctan2(layer.curves[0].points[:, 1], layer.curves[0].points[:, 0])
    along = np.linspace(angle.min(), angle.max(), 40)
    normals = np.stack([np.cos(along), np.sin(along), np.zeros(40)], axis=1)
    assert inside(pieces(sliced, 0), (R + 0.99 * H) * normals).all()
