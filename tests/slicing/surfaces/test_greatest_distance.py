"""How far a mesh reaches off a body: in a groove further than its corners tell, and no layer is lost for it."""

from __future__ import annotations

import manifold3d
import numpy as np
import pytest
from support.parts.meshes import from_manifold

from slicing.layers.layer import CylindricalBody, RevolvedBody
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.greatest_distance import COARSE_MM, greatest_distance
from slicing.warning import Code

GROOVE = RevolvedBody(((25.0, 0.0), (25.0, 15.0), (12.0, 20.0), (12.0, 40.0), (25.0, 45.0), (25.0, 60.0)))
REVOLVED = SlicingParameters("revolved")


def turned(*points):
    """A ring of the given section, (r, z) counter-clockwise."""
    return manifold3d.Manifold.revolve(manifold3d.CrossSection([list(points)]), 128)


def in_groove():
    return turned((11.5, 22.0), (20.0, 22.0), (20.0, 38.0), (11.5, 38.0))


def as_mesh(solid):
    return from_manifold(solid, "part")


def test_in_a_groove_the_middle_of_a_face_lies_furthest_off():
    mesh = as_mesh(in_groove())
    corners = mesh.vertices[mesh.faces]
    assert GROOVE.surface.distance(mesh.vertices).max() < 4.8
    assert greatest_distance(GROOVE.surface, corners) == pytest.approx(8.0, abs=2e-3)
    # found within one large triangle as well, and never further off than any of its points is
    large = np.array([[[0.0, 0.0, 30.0], [19.0, -30.0, -90.0], [19.0, 30.0, 150.0]]])
    share = np.random.default_rng(1).dirichlet(np.ones(3), 200_000)
    seen = float(GROOVE.surface.distance(share @ large[0]).max())
    assert seen - 1e-2 <= greatest_distance(GROOVE.surface, large) <= seen + COARSE_MM


def test_off_a_cylinder_corners_tell():
    mesh = as_mesh(in_groove())
    found = greatest_distance(CylindricalBody(12.0).surface, mesh.vertices[mesh.faces])
    assert found == CylindricalBody(12.0).surface.distance(mesh.vertices).max()


def test_a_ring_in_a_groove_has_all_of_its_layers():
    sliced = slice_sub_volume(as_mesh(in_groove()), GROOVE, REVOLVED, (0.0, 60.0))
    assert len(sliced.layers) == 5  # 8 mm of 1.73
    assert sliced.laid_volume_mm3 == pytest.approx(sliced.volume_mm3, rel=0.1)
    assert sliced.end_mm == pytest.approx(5 * 1.73 - 8.0, abs=1e-2)


@pytest.mark.slow
def test_what_fills_a_groove_is_sliced_though_all_of_its_corners_are_on_the_body():
    filling = turned((12.0, 20.0), (25.0, 15.0), (25.0, 45.0), (12.0, 40.0))
    sliced = slice_sub_volume(as_mesh(filling), GROOVE, REVOLVED, (0.0, 60.0))
    assert len(sliced.layers) == 8  # 13 mm, at the middle of the groove's mouth
    assert sliced.laid_volume_mm3 == pytest.approx(sliced.volume_mm3, rel=0.15)


def test_a_stack_that_ends_early_says_what_is_left():
    post = manifold3d.Manifold.cube((12.0, 8.0, 8.0)).translate((19.0, -4.0, -4.0))
    loose = manifold3d.Manifold.cube((8.0, 30.0, 30.0)).translate((41.0, -15.0, -15.0))
    for solid, left in ((post, False), (post + loose, True)):
        sliced = slice_sub_volume(as_mesh(solid), CylindricalBody(20.0), SlicingParameters("cylindrical"))
        said = [line for line in sliced.warnings if getattr(line, "code", None) is Code.LAYER_VOLUME]
        assert bool(said) is left
    assert "below the top" in said[0]
