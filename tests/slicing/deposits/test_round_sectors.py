"""Deposits on surfaces of revolution: pieces cover the whole region, its crown too, not its borders alone."""

from dataclasses import replace

import manifold3d
import numpy as np
import pytest
from support.layers.deposits import inside
from support.layers.layers import layer_on
from support.parts.meshes import box, from_manifold
from trimesh import PointCloud

from slicing.beads.lay import layer_beads
from slicing.deposits.part_shape import part_shape
from slicing.layers.layer import SlicedSubVolume
from slicing.parameters import BeadParameters
from slicing.surfaces.bodies import ConicalBody, RevolvedBody

FLAT_END = ((0.0, 30.0), (20.0, 30.0), (20.0, 0.0))
DOME = ((20.0, 0.0), (18.0, 8.0), (12.0, 14.0), (0.0, 17.0))
BULGE = ((14.0, -20.0), (19.0, -8.0), (20.0, 0.0), (19.0, 8.0), (14.0, 20.0))


def bar(size: float):
    """A square bar along z over the axis, off its middle."""
    return box((-size, 1.0 - size, -60), (size + 2.0, size, 80))


LAYERS = {
    "boss on a flat end": lambda: (bar(8.0), "revolved", RevolvedBody(FLAT_END)),
    "boss on a dome": lambda: (bar(9.0), "revolved", RevolvedBody(DOME)),
    "cap over a shaft's end": lambda: (
        from_manifold(manifold3d.Manifold.cylinder(39, 32, 32, 96).translate((0, 0, 6))),
        "revolved",
        RevolvedBody(FLAT_END),
    ),
    "boss on a cone's tip": lambda: (bar(9.0), "conical", ConicalBody(20.0, -50.0)),
    "pad on a bulge": lambda: (box((5, -9, -14), (40, 9, 14)), "revolved", RevolvedBody(BULGE)),
}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if "shaft" in name else name for name in LAYERS]
)
def test_what_lies_between_the_borders_is_covered(name):
    mesh, strategy, body = LAYERS[name]()
    layers = tuple(replace(layer_on(mesh, body, 1.73 * k), index=k) for k in range(3))
    sliced = SlicedSubVolume("SV1", strategy, mesh, body, layers)
    shape = part_shape([sliced], None, ((20.0, 0.0), (20.0, 30.0)))
    for layer in layers[:2]:
        mine = [v for n, v in shape.hulls.items() if n.startswith(f"deposit/{layer.index}/")]
        solids = [PointCloud(v).convex_hull for v in mine]
        beads = layer_beads(layer, BeadParameters("zigzag", width_mm=3.0))
        points = np.concatenate([bead.points[::9] for bead in beads if not bead.thin])
        assert len(points) > 50
        for raised in (0.0, 0.9):  # and the material above it, up to the next layer
            assert inside(solids, points + 1.73 * raised * layer.surface.normals(points)).all()


@pytest.mark.parametrize("name", ["pad on a bulge", "pad on a cone"])
def test_wide_beads_that_stand_out_along_a_bent_surface_are_covered(name):
    on_cone = (box((5, -9, -14), (40, 9, 14)), "conical", ConicalBody(20.0, 10.0))
    mesh, strategy, body = on_cone if "cone" in name else LAYERS[name]()
    half = 6.0
    layers = tuple(replace(layer_on(mesh, body, 1.73 * k), index=k) for k in range(2))
    sliced = SlicedSubVolume("SV1", strategy, mesh, body, layers)
    shape = part_shape([sliced], None, ((20.0, 0.0), (20.0, 30.0)), [np.full(2, half)])
    solids = [PointCloud(v).convex_hull for n, v in shape.hulls.items() if n.startswith("deposit/0/")]
    surface, border = layers[0].surface, layers[0].curves[0].points
    normals = surface.normals(border)
    around = np.cross([0.0, 0.0, 1.0], normals)
    around /= np.linalg.norm(around, axis=1)[:, None]
    for angle in np.linspace(0, 2 * np.pi, 12, endpoint=False):
        way = np.cos(angle) * around + np.sin(angle) * np.cross(normals, around)
        points = border + 0.97 * half * way
        points -= surface.distance(points)[:, None] * surface.normals(points)  # beads lie along the surface
        for raised in (0.0, 0.9):
            assert inside(solids, points + 1.73 * raised * surface.normals(points)).all()
