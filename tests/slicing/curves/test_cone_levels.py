"""All offsets of a cone in one go give what each gives by itself."""

import manifold3d
import numpy as np
import pytest
from support.layers.curves import same
from support.parts.meshes import blade, box, from_manifold, ring, subdivided

from slicing.curves import cone_levels
from slicing.curves.intersect import intersect, intersect_offsets
from slicing.surfaces.surfaces import Cone

AXIS = (0.3, -0.2)
SOLIDS = {
    "box": lambda: box(),
    "blade": lambda: subdivided(blade(8, 8, thickness=8.0, inner=18.0), 1),
    "ring": lambda: ring(15.0, 50.0, -7.0, 6.0),
    "over the tip": lambda: box((-15, -14, -60), (13, 17, 60)),
    "axis within one face": lambda: from_manifold(manifold3d.Manifold.tetrahedron().scale((80, 80, 80))),
    "corners on the levels": lambda: box((20.0 + AXIS[0], -6.0, 0.0), (40.0, 6.0, 9.0)),
}


@pytest.mark.parametrize("name", SOLIDS)
@pytest.mark.parametrize("half", [15.0, -40.0, *(pytest.param(a, marks=pytest.mark.slow) for a in (65.0, -2.0))])
def test_together_as_alone(name, half):
    mesh, cone = SOLIDS[name](), Cone(AXIS, 20.0, half)
    heights = 1.73 * np.arange(-4, 22)
    together = intersect_offsets(mesh, cone, heights)
    assert any(together)
    for h, curves in zip(heights.tolist(), together, strict=True):
        same(curves, intersect(mesh, cone.offset(h)))


def test_small_batches_change_nothing():
    mesh, cone, heights = SOLIDS["blade"](), Cone(AXIS, 20.0, 15.0), 0.7 * np.arange(40)
    whole = intersect_offsets(mesh, cone, heights)
    for a, b in zip(cone_levels.cone_curves(mesh, cone, heights, 0.01, batch=300), whole, strict=True):
        same(a, b)


def test_areas_of_a_block_from_side_to_side():
    """A slab between two planes across the axis: the cone's area between them, right round."""
    slab, cone = box((-90, -90, 5), (90, 90, 15)), Cone((0.0, 0.0), 20.0, 30.0)
    k = cone.slope
    for h, curves in zip((0.0, 2.0, 9.0), intersect_offsets(slab, cone, [0.0, 2.0, 9.0]), strict=True):
        low, high = (cone.offset(h).radius + k * z for z in (5, 15))
        assert len(curves) == 2
        expected = np.pi * (low + high) * np.hypot(10, high - low)
        assert sum(c.area_mm2 for c in curves) == pytest.approx(expected, rel=1e-6)


def test_levels_that_miss_and_almost_upright_cones():
    mesh = box()
    assert intersect_offsets(mesh, Cone(AXIS, 20.0, 15.0), []) == []
    assert intersect_offsets(mesh, Cone(AXIS, 20.0, 15.0), [80.0, 90.0]) == [[], []]
    upright = Cone(AXIS, 20.0, 0.1)  # moved along its axis it would be far away
    for h, curves in zip((1.0, 2.0), intersect_offsets(mesh, upright, [1.0, 2.0]), strict=True):
        same(curves, intersect(mesh, upright.offset(h)))
