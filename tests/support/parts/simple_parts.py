"""Parts of cylinders and boxes, and what a decomposition says of them."""

from __future__ import annotations

import pytest
from manifold3d import Manifold

from slicing.decomposition.decompose import decompose
from slicing.mesh.solid import PartError
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume

from .meshes import box_solid

ROUND = SlicingParameters("cylindrical")


def cylinder(radius, low, high, sides=128, top=None) -> Manifold:
    return Manifold.cylinder(high - low, radius, radius if top is None else top, sides).translate((0, 0, low))


def boss(radius, reach, azimuth, z, inner=10.0) -> Manifold:
    """A cylinder along a radius."""
    solid = Manifold.cylinder(reach - inner, radius, radius, 96).rotate((0, 90, 0)).translate((inner, 0, z))
    return solid.rotate((0, 0, azimuth))


def shaft(sides=128) -> Manifold:
    return cylinder(20, 0, 100, sides)


def refusal(mesh, hint=None) -> str:
    with pytest.raises(PartError) as caught:
        decompose(mesh, hint)
    line = str(caught.value)
    assert "\n" not in line
    return line


def volumes(parts) -> list[float]:
    return [mesh.volume for mesh in parts.sub_volumes]


def footprint_area(parts, k=0) -> float:
    return slice_sub_volume(parts.sub_volumes[k], parts.bodies[k], ROUND).layers[0].area_mm2


def three_boxes(sides=128) -> Manifold:
    """Boxes of 12 x 16, 10 x 10 and 10 x 20 (across x along z) on +x, -x and +y."""
    return (
        shaft(sides)
        + box_solid((15, -6, 30), (40, 6, 46))
        + box_solid((-45, -5, 60), (-15, 5, 70))
        + box_solid((-5, 15, 20), (5, 35, 40))
    )
