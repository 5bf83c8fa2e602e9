"""Deposits of rings that are open: their opening is free."""

from __future__ import annotations

import manifold3d
import numpy as np
import trimesh
from support.layers.deposits import inside
from support.parts.meshes import box_solid, from_manifold

from slicing.deposits.part_shape import part_shape
from slicing.layers.layer import CylindricalBody
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume

R, TOP, HALF = 20.0, 32.0, 6.0


def test_the_opening_of_a_ring_is_free_and_all_of_the_ring_collides() -> None:
    ring = manifold3d.Manifold.cylinder(8.0, TOP, TOP, 256, True) - box_solid((0.0, -HALF, -9.0), (40.0, HALF, 9.0))
    sliced = slice_sub_volume(from_manifold(ring), CylindricalBody(R), SlicingParameters("cylindrical", 2.0))
    hulls = part_shape([sliced], None, ((R, -30.0), (R, 30.0)), [np.zeros(len(sliced.layers))]).hulls
    for layer in sliced.layers:
        own = [v for name, v in hulls.items() if name.startswith(f"deposit/{layer.index}/")]
        assert len(own) == 2
        solids = [trimesh.PointCloud(v).convex_hull for v in own]
        radius = R + 2.0 * layer.index + 1.0
        assert not inside(solids, np.array([[radius, y, 0.0] for y in (-4.0, 0.0, 4.0)])).any()
        half = np.arcsin(HALF / (radius - 1.0)) + 1e-3  # its border is that of its surface, carried outward
        angle = np.linspace(half, 2 * np.pi - half, 181)
        for z in (-3.9, 0.0, 3.9):
            points = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(len(angle), z)], axis=1)
            assert inside(solids, points).all()
