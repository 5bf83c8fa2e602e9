"""Deposits of planes: their metal lies below them, and borders that touch themselves keep their corners."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.layers.deposits import inside
from support.layers.layers import planar_layer

from slicing.deposits.part_shape import part_shape
from slicing.layers.layer import CylindricalBody, SlicedSubVolume
from slicing.mesh.solid import mesh_from_arrays
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume

R, H = 20.0, 2.0
BODY = ((R, -30.0), (R, 30.0))


def mushroom() -> trimesh.Trimesh:
    """A stem, and from x = 28 on a head that is wider than it by 6 mm."""
    stem, head = trimesh.creation.box((14, 8, 8)), trimesh.creation.box((8, 20, 20))
    stem.apply_translation([R + 2, 0, 0])
    head.apply_translation([R + 12, 0, 0])
    return stem.union(head)


def pieces(sliced: SlicedSubVolume, layer: int) -> list[trimesh.Trimesh]:
    found = part_shape([sliced], None, BODY).hulls.items()
    return [trimesh.PointCloud(v).convex_hull for name, v in found if name.startswith(f"deposit/{layer}/")]


def test_what_lies_between_a_plane_and_the_one_below_is_among_its_pieces() -> None:
    solid = mushroom()
    mesh = mesh_from_arrays("SV1", np.asarray(solid.vertices), np.asarray(solid.faces))
    sliced = slice_sub_volume(mesh, CylindricalBody(R), SlicingParameters("planar", H, H, H))
    yz = np.array([[-3.9, -3.9], [3.9, -3.9], [3.9, 3.9], [-3.9, 3.9]])
    base = np.sqrt(R**2 - 16)  # the footprint's lowest point: planes lie at base + 2, base + 4, ..
    foot = np.column_stack([np.full(4, base + 0.05), yz])
    assert inside(pieces(sliced, 0), foot).all()
    first = int(np.ceil((28 - base) / H)) - 1  # the first plane in the head
    wide = np.column_stack([np.full(4, base + H * first + 0.05), 2.5 * yz])
    assert inside(pieces(sliced, first), wide).all()
    assert not inside(pieces(sliced, first - 1), wide).any()
    # nothing is laid above a plane before the next one is
    above = np.column_stack([np.full(4, base + H * (first + 1) + 0.1), 2.5 * yz])
    assert not inside(pieces(sliced, first), above).any()
    assert inside(pieces(sliced, first + 1), above).all()


@pytest.mark.parametrize("spike_mm", [1e-5, 1e-7])
def test_a_border_that_runs_over_its_corner_by_rounding_keeps_the_corner(spike_mm: float) -> None:
    # the second corner is overrun, and the line comes back a way before it goes on: no valid polygon
    a, b = 5.3, 6.0
    loop = [(a, -b), (a, b), (a + spike_mm, b), (a - 1e-4, b), (a - 0.02, b), (-a, b), (-a, -b)]
    layer = planar_layer(loop)
    mesh = mesh_from_arrays("SV1", *_arrays(trimesh.creation.box((1, 1, 1))))
    sliced = SlicedSubVolume("SV1", "nonuniform", mesh, CylindricalBody(R), (layer,))
    shape = part_shape([sliced], None, BODY, [np.array([1.5])])
    solids = [trimesh.PointCloud(v).convex_hull for name, v in shape.hulls.items() if name.startswith("deposit/")]
    turn = np.linspace(0, 2 * np.pi, 33)
    round_the_corner = np.array([a, b]) + 1.49 * np.column_stack([np.cos(turn), np.sin(turn)])
    u, v = layer.surface.axes()
    points = np.asarray(layer.surface.point) + round_the_corner @ np.stack([u, v])
    assert inside(solids, points).all()


def _arrays(solid: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(solid.vertices), np.asarray(solid.faces)
