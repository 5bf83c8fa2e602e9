"""Parts of other shapes taken apart: steps, cones, domes, bridges, shells, and parts that have no round body."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold
from support.parts.meshes import box_section, box_solid, from_manifold
from support.parts.simple_parts import boss, cylinder, footprint_area, refusal, shaft, volumes

from slicing.decomposition.body_hint import BodyHint
from slicing.decomposition.decompose import decompose
from slicing.mesh.solid import PartError, mesh_from_arrays
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.bodies import CylindricalBody


def test_bosses_and_ribs():
    solid = shaft() + boss(8, 40, 0, 50) + boss(5, 35, 120, 20)
    for turn in (60, 180, 300):
        solid += box_solid((15, -2, 0), (28, 2, 100)).rotate((0, 0, turn))
    parts = decompose(from_manifold(solid, "part"))
    assert parts.body == CylindricalBody(20.0)
    assert len(parts.sub_volumes) == 5
    ribs = [mesh for mesh in parts.sub_volumes if np.ptp(mesh.vertices[:, 2]) > 99]
    assert len(ribs) == 3
    assert np.ptp([rib.volume for rib in ribs]) < 1e-2


def test_flanges_are_rings_that_stand_on_the_body():
    parts = decompose(from_manifold(shaft() + cylinder(40, 20, 28) + cylinder(35, 90, 100), "part"))
    assert parts.body == CylindricalBody(20.0)
    polygon = math.sin(2 * math.pi / 128) / (2 * math.pi / 128)  # of the rings' outside; inside is the cylinder
    want = [math.pi * 8 * (1600 * polygon - 400), math.pi * 10 * (35**2 * polygon - 400)]
    assert volumes(parts) == pytest.approx(want, rel=1e-4)
    assert footprint_area(parts, 0) == pytest.approx(2 * math.pi * 20 * 8, rel=1e-5)


def test_a_low_collar_is_a_step_unless_the_radius_is_given():
    mesh = from_manifold(shaft() + cylinder(24, 50, 60) + boss(6, 45, 10, 20), "part")
    assert len(decompose(mesh).sub_volumes) == 1
    assert len(decompose(mesh, BodyHint(radius_mm=20.0)).sub_volumes) == 2


def test_a_stepped_body_gives_each_its_radius():
    solid = shaft() + cylinder(30, 100, 160) + boss(6, 45, 10, 30) + boss(6, 45, 10, 130) - cylinder(8, -1, 170)
    parts = decompose(from_manifold(solid, "part"))
    assert parts.bodies == (CylindricalBody(20.0), CylindricalBody(30.0))
    assert np.allclose(parts.outline.points, [(20, 0), (20, 100), (30, 100), (30, 160)])
    assert [footprint_area(parts, 0), footprint_area(parts, 1)] == pytest.approx(
        [boss_footprint(6, 20), boss_footprint(6, 30)], rel=2e-3
    )


def boss_footprint(radius, body) -> float:
    """Area on a cylinder of a circular boss along a radius."""
    y = np.linspace(-radius, radius, 200_001)
    return float(np.trapezoid(2 * np.sqrt(np.maximum(radius**2 - y**2, 0)) / np.sqrt(1 - (y / body) ** 2), y))


def test_across_a_step_it_stands_on_the_lesser_radius():
    solid = shaft() + cylinder(30, 100, 160) + box_solid((10, -5, 90), (50, 5, 110))
    parts = decompose(from_manifold(solid, "part"))
    assert parts.bodies == (CylindricalBody(20.0),)
    assert any("stands on a step" in line for line in parts.warnings)


@pytest.mark.slow
def test_a_body_with_a_cone():
    solid = shaft() + cylinder(20, 100, 140, 128, 35) + cylinder(35, 140, 190)
    parts = decompose(from_manifold(solid + boss(5, 45, 90, 30) + boss(5, 55, 0, 120) + boss(5, 55, 0, 165), "part"))
    assert [body.radius_mm for body in parts.bodies] == pytest.approx([20.0, 27.5, 35.0], abs=0.01)
    assert np.allclose(parts.outline.points, [(20, 0), (20, 100), (35, 140), (35, 190)])
    assert [line.split(":")[0] for line in parts.warnings] == ["SV2"]
    assert "stands on a cone" in parts.warnings[0]
    assert [cone is None for cone in parts.cones] == [True, False, True]
    assert parts.bodies_for("cylindrical") == parts.bodies
    cone = parts.bodies_for("conical")[1]
    assert cone.half_angle_deg == pytest.approx(math.degrees(math.atan(15 / 40)), abs=0.01)
    assert cone.radius_mm == pytest.approx(20 - 100 * 15 / 40, abs=0.02)
    # one boss by each way of seeing what it stands on: the same footprint, layers h apart along the normal
    mesh = parts.sub_volumes[1]
    conical = slice_sub_volume(mesh, cone, SlicingParameters("conical"))
    revolved = slice_sub_volume(mesh, parts.bodies_for("revolved")[1], SlicingParameters("revolved"))
    assert [layer.area_mm2 for layer in revolved.layers] == pytest.approx(
        [layer.area_mm2 for layer in conical.layers], rel=1e-4
    )
    with pytest.raises(PartError, match="conical needs a cone"):
        slice_sub_volume(parts.sub_volumes[0], parts.bodies_for("conical")[0], SlicingParameters("conical"))


def dome() -> Manifold:
    return shaft() + Manifold.sphere(20, 32).translate((0, 0, 100))


def fillet() -> Manifold:
    quarter = [(25 - 5 * math.cos(t), 95 + 5 * math.sin(t)) for t in np.linspace(0, np.pi / 2, 9)]
    section = CrossSection([[(15, 95), *quarter, (25, 102), (15, 102)]])
    return shaft() + cylinder(30, 100, 160) + Manifold.revolve(section, 128)


@pytest.mark.parametrize("solid", [dome, pytest.param(fillet, marks=pytest.mark.slow)])
def test_domes_and_fillets_are_body(solid):
    parts = decompose(from_manifold(solid() + boss(8, 40, 0, 50), "part"))
    assert len(parts.sub_volumes) == 1
    assert parts.bodies == (CylindricalBody(20.0),)


def test_bridges_are_one_sub_volume():
    handle = box_solid((15, -5, 20), (50, 5, 80)) - box_solid((10, -10, 30), (40, 10, 70))
    parts = decompose(from_manifold(shaft() + handle, "part"))
    assert len(parts.sub_volumes) == 1
    assert any("2 places" in line for line in parts.warnings)


def test_what_stands_on_an_end_stays_with_the_body():
    solid = shaft() + box_solid((-8, -8, 100), (8, 8, 130)) + boss(8, 40, 0, 50)
    parts = decompose(from_manifold(solid, "part"))
    assert len(parts.sub_volumes) == 1
    assert parts.body_mesh.bounds[1, 2] == pytest.approx(130)
    assert any("left with the body" in line for line in parts.warnings)


def test_shells_that_overlap_are_united():
    shells = [from_manifold(s) for s in (shaft(), box_solid((15, -6, 30), (40, 6, 46)))]
    first = len(shells[0].vertices)
    vertices = np.concatenate([s.vertices for s in shells])
    parts = decompose(mesh_from_arrays("two", vertices, np.concatenate([shells[0].faces, shells[1].faces + first])))
    assert footprint_area(parts) == pytest.approx(box_section(12, 16, 20.0), rel=5e-5)


@pytest.mark.parametrize(
    ("solid", "says"),
    [
        (lambda: Manifold.cube((20, 20, 20), True), "no round body"),
        pytest.param(lambda: Manifold.cube((20, 20, 20), True).refine(12), "no round body", marks=pytest.mark.slow),
        (lambda: Manifold.cube((40, 40, 40), True) - cylinder(5, -50, 50), "no round body"),
        (lambda: Manifold.cube((20, 20, 20), True).minkowski_sum(Manifold.sphere(4, 24)), "no round body"),
        (lambda: Manifold.cube((40, 40, 40), True) + cylinder(5, 10, 40), "no round body"),
        pytest.param(
            lambda: Manifold.revolve(CrossSection.circle(5, 32).translate((20, 0)), 64),
            "no round body",
            marks=pytest.mark.slow,
        ),
        (lambda: cylinder(20, 0, 100, 7) + boss(5, 40, 0, 50), "at least 8 sides"),
        (lambda: shaft(), "nothing stands on its round body (radius 20 mm)"),
        (lambda: cylinder(20, 0, 100) + cylinder(30, 100, 180), "nothing stands on its round body (radius 30 mm)"),
    ],
)
def test_parts_without_a_round_body_or_sub_volumes(solid, says):
    assert says in refusal(from_manifold(solid(), "part"))


@pytest.mark.slow
def test_a_blob_and_a_ball():
    def squeeze(v):
        x, y, z = v
        return x * (1 + 0.2 * math.sin(y / 7)), y * (1 + 0.3 * math.cos(z / 9)), z + 0.1 * x

    assert "no round body" in refusal(from_manifold(Manifold.sphere(20, 48).warp(squeeze), "blob"))
    assert "round body" in refusal(from_manifold(Manifold.sphere(20, 48), "ball"))
