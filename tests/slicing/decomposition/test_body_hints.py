"""Hints at the body: taken where they fit the part, refused where they do not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from support.parts.meshes import from_manifold
from support.parts.simple_parts import boss, cylinder, refusal, volumes

from slicing.decomposition.body_hint import BodyHint
from slicing.decomposition.decompose import decompose
from slicing.mesh.solid import PartError
from slicing.surfaces.bodies import CylindricalBody


@pytest.mark.parametrize(
    "hint",
    [
        BodyHint(radius_mm=20.0),
        BodyHint((0, 0, 5)),
        BodyHint((0.3, 0, 50)),  # roughly measured
        BodyHint(None, (0, 0, -3)),
        BodyHint((0, 0, 5), (0, 0, 2), 20.0),
    ],
)
def test_hints_that_fit(boxes, plain, hint):
    parts = decompose(boxes, hint)
    assert parts.body == plain.body
    assert volumes(parts) == pytest.approx(volumes(plain), rel=1e-6)


@pytest.mark.parametrize(
    ("hint", "says"),
    [
        (BodyHint(radius_mm=15.0), "radius_mm 15 is not the radius of an outer cylinder"),
        (BodyHint(radius_mm=20.1), "the radii are 20"),
        (BodyHint((3, 0, 50)), "3 mm off the axis"),
        (BodyHint((5, 0, 5), (0, 0, 1)), "5 mm off the axis"),
        (BodyHint(None, (1, 0, 0)), "no round body found about the axis that the hint gives"),
    ],
)
def test_hints_that_do_not_fit(boxes, hint, says):
    assert says in refusal(boxes, hint)


@pytest.mark.slow
def test_a_hint_chooses_between_two_bodies():
    tee = cylinder(20, 0, 100) + boss(10, 70, 0, 50, inner=0.0)
    mesh = from_manifold(tee, "tee")
    assert decompose(mesh).body == CylindricalBody(20.0)
    other = decompose(mesh, BodyHint(None, (1, 0, 0)))
    assert other.body == CylindricalBody(10.0)
    assert np.allclose(other.T_part_input[:3, :3] @ [1, 0, 0], [0, 0, 1], atol=1e-9)
    radii = [decompose(from_manifold(tee + cylinder(30, 100, 160)), BodyHint(radius_mm=r)).body for r in (20.0, 30.0)]
    assert radii == [CylindricalBody(20.0), CylindricalBody(30.0)]


@pytest.mark.parametrize(
    "values", [{"axis_point_mm": (0, math.nan, 0)}, {"axis_direction": (0, 0, 0)}, {"radius_mm": -1.0}]
)
def test_hints_that_are_none(values):
    with pytest.raises(PartError, match=next(iter(values))):
        BodyHint(**values)
