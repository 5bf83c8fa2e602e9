"""Turned features are body: threads, pulleys' lands, balls, curved hubs; augers and discs are not."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from manifold3d import CrossSection, Manifold
from support.parts.cad_parts import arrays, from_arrays, radial_cylinder, revolved

from slicing.decomposition.body_hint import BodyHint
from slicing.decomposition.decompose import Decomposition, decompose
from slicing.mesh.solid import Mesh, mesh_from_arrays
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.warning import Code, Warning

SIDES = 48


def mesh_of(*solids: Manifold) -> Mesh:
    whole = solids[0]
    for solid in solids[1:]:
        whole += solid
    return mesh_from_arrays("part", *arrays(whole))


def cylinder(radius: float, low: float, high: float) -> Manifold:
    return Manifold.cylinder(high - low, radius, radius, SIDES).translate((0, 0, low))


def rib(radius: float, low: float, high: float) -> Manifold:
    """A wall of 5 mm that stands 10 mm out of a cylinder."""
    return Manifold.cube((15.0, 5.0, high - low)).translate((radius - 5.0, -2.5, low))


def helix(pitch: float, turns: float, section: list[tuple[float, float]]) -> Manifold:
    """A section (r, z) wound about z."""
    angles = 2 * np.pi * np.arange(int(turns * SIDES) + 1) / SIDES
    r, z = np.array(section).T
    rings = [np.column_stack([r * math.cos(a), r * math.sin(a), z + pitch * a / 2 / math.pi]) for a in angles]
    count, faces = len(section), []
    for k in range(len(rings) - 1):
        for j in range(count):
            p, q = k * count + j, k * count + (j + 1) % count
            faces += [(p, q, q + count), (p, q + count, p + count)]
    last = (len(rings) - 1) * count
    for j in range(1, count - 1):
        faces += [(0, j + 1, j), (last, last + j, last + j + 1)]
    return from_arrays(np.concatenate(rings), np.array(faces))


def ridge(foot_radius: float, top_radius: float, foot: float, top: float) -> list[tuple[float, float]]:
    """A thread's section, carried on into the body."""
    inner, slope = 0.4, 0.5 * (foot - top) / (top_radius - foot_radius)
    return [
        (foot_radius - inner, -0.5 * foot - slope * inner),
        (top_radius, -0.5 * top),
        (top_radius, 0.5 * top),
        (foot_radius - inner, 0.5 * foot + slope * inner),
    ]


def codes(parts: Decomposition) -> set[Code]:
    return {line.code for line in parts.warnings if isinstance(line, Warning)}


def rib_mm3(radius: float, height: float) -> float:
    """Volume of such a rib outside of a cylinder."""
    half, reach = 2.5, radius + 10.0
    inside = half * math.sqrt(radius**2 - half**2) + radius**2 * math.asin(half / radius)
    return (2 * half * reach - inside) * height


def threaded(height: float, foot: float, pitch: float = 6.0) -> Mesh:
    """A bar of radius 20 with a rib, and a thread on its thinner end."""
    thread = helix(pitch, 3, ridge(15.0, 15.0 + height, foot, 0.4 * foot)).translate((0, 0, 50))
    return mesh_of(cylinder(20, 0, 40), cylinder(15, 40, 76), rib(20, 5, 30), thread)


def test_a_thread_is_body_and_told():
    parts = decompose(threaded(3.0, 3.8))
    assert [mesh.volume for mesh in parts.sub_volumes] == pytest.approx([rib_mm3(20, 25)], rel=2e-3)
    assert Code.BODY_STEP in codes(parts)
    # the ridge is in the body: a section of mean width 0.7 * 3.8 wound three times
    plain = math.pi * (20**2 * 40 + 15**2 * 36)
    assert parts.body_mesh.volume - plain * np.sinc(2 / SIDES) == pytest.approx(
        0.7 * 3.8 * 3.0 * 3 * 2 * math.pi * 16.3, rel=0.05
    )


def test_a_flight_that_stands_out_farther_than_its_foot_is_wide_is_a_sub_volume():
    parts = decompose(threaded(4.5, 3.8))
    assert len(parts.sub_volumes) == 2
    assert Code.BODY_STEP not in codes(parts)


@pytest.mark.parametrize(("radius_mm", "count"), [pytest.param(15.0, 2, marks=pytest.mark.slow), (20.0, 1)])
def test_a_radius_that_is_told_makes_what_is_wider_a_sub_volume(radius_mm, count):
    parts = decompose(threaded(3.0, 3.8), BodyHint(radius_mm=radius_mm))
    assert len(parts.sub_volumes) == count
    assert (Code.BODY_STEP in codes(parts)) == (radius_mm == 20.0)


@pytest.mark.slow
def test_a_thread_alone_on_a_bar_is_a_sub_volume_and_told():
    parts = decompose(mesh_of(cylinder(15, 0, 40), helix(6.0, 3, ridge(15, 18, 3.8, 1.5)).translate((0, 0, 10))))
    assert len(parts.sub_volumes) == 1
    assert Code.BODY_COLLAR in codes(parts)


@pytest.mark.slow
def test_a_ball_of_scattered_facets_is_body():
    ball = trimesh.creation.icosphere(3, 30.0)
    whole = cylinder(15, 0, 120) + from_arrays(np.array(ball.vertices), np.array(ball.faces)).translate((0, 0, 40))
    parts = decompose(mesh_of(whole, rib(15, 85, 110)))
    assert [mesh.volume for mesh in parts.sub_volumes] == pytest.approx([rib_mm3(15, 25)], rel=2e-3)
    assert parts.bodies[0].radius_mm == pytest.approx(15.0, abs=1e-3)


def test_a_hexagon_on_a_shaft_is_a_sub_volume():
    nut = Manifold.extrude(CrossSection.circle(26, 6), 20).translate((0, 0, 10))
    parts = decompose(mesh_of(cylinder(20, 0, 100), nut, rib(20, 60, 90)))
    assert len(parts.sub_volumes) == 2


def pulley(top: float, bottom: float, hub: float, lands: list[tuple[float, float]]) -> Manifold:
    """A hub from z = 0 to 100 with lands (z from, z to) that widen towards the bottom of grooves between them."""
    points = [(0.0, 0.0), (hub, 0.0), (hub, lands[0][0])]
    for k, (low, high) in enumerate(lands):
        points += [(top, low), (top, high)]
        if k + 1 < len(lands):
            quarter = 0.25 * (lands[k + 1][0] - high)
            points += [(bottom, high + quarter), (bottom, lands[k + 1][0] - quarter)]
    return revolved([*points, (hub, lands[-1][1]), (hub, 100.0), (0.0, 100.0)], SIDES)


LANDS = [(10.0, 11.5), (20.5, 23.5), (32.5, 35.5), (44.5, 46.0)]


def test_the_lands_of_a_pulley_are_body():
    parts = decompose(mesh_of(pulley(40, 33, 30, LANDS), rib(30, 60, 90)))
    assert [mesh.volume for mesh in parts.sub_volumes] == pytest.approx([rib_mm3(30, 30)], rel=2e-3)


@pytest.mark.parametrize(
    ("top", "bottom", "lands"),
    [
        (40.0, 30.0, [(10.0, 14.0), (20.0, 24.0)]),  # two rings: the groove goes down to the hub
        # deeper than from land to land: discs
        pytest.param(60.0, 33.0, LANDS, marks=pytest.mark.slow),
        # hardly any land is left
        pytest.param(40.0, 33.0, [(10.0, 11.0), (24.0, 25.0), (38.0, 39.0)], marks=pytest.mark.slow),
    ],
)
def test_rings_that_stand_on_a_bottom_are_no_lands(top, bottom, lands):
    parts = decompose(mesh_of(pulley(top, bottom, 30, lands), rib(30, 60, 90)))
    assert len(parts.sub_volumes) == len(lands) + 1


def test_a_grooved_disc_that_stands_out_farther_than_it_is_long_is_one_ring():
    parts = decompose(mesh_of(pulley(90, 75, 30, [(10, 18), (34, 42)]), rib(30, 60, 90)))
    # the groove is 8 mm wide at radius 75 and 16 at radius 90
    groove = 2 * math.pi * (82.5 * 15 * 12 + 8 * 15**2 / 12)
    ring = math.pi * (90**2 - 30**2) * 32 - groove
    assert max(volume for volume in (mesh.volume for mesh in parts.sub_volumes)) == pytest.approx(ring, rel=5e-3)
    assert len(parts.sub_volumes) == 2


@pytest.mark.slow
def test_blades_on_a_curved_hub_are_apart():
    """A hub whose outline ends flat: the last of it is too flat for a cone."""
    angles = np.linspace(0, math.pi / 2, 33)[1:]
    curve = [(60 - 40 * math.sin(a), 45 - 45 * math.cos(a)) for a in angles]
    hub = [(0.0, 0.0), (60.0, 0.0), *curve, (20.0, 60.0), (0.0, 60.0)]
    tip = revolved([(0, 0), (60, 0), (60, 15), (35, 55), (0, 55)], 96)
    blade = Manifold.cube((60.0, 3.0, 40.0)).translate((14.0, -1.5, 0.0)) ^ tip
    blades = [blade.rotate((0, 0, 120 * k)) for k in range(3)]
    parts = decompose(mesh_of(revolved(hub, 96), *blades))
    want = (blade - revolved(hub, 4096)).volume()
    assert [mesh.volume for mesh in parts.sub_volumes] == pytest.approx([want] * 3, rel=2e-3)
    assert parts.outline.widest == pytest.approx(60.0, abs=0.01)
    # its footprint follows the bends of the hub in one border
    sliced = slice_sub_volume(parts.sub_volumes[0], parts.bodies_for("revolved")[0], SlicingParameters("revolved"))
    assert [len(layer.curves) for layer in sliced.layers[:3]] == [1, 1, 1]


@pytest.mark.slow
def test_a_boss_beside_a_thread_keeps_its_volume():
    boss = radial_cylinder(8, 5, 45, SIDES).translate((0, 0, 20))
    thread = helix(4.0, 4, ridge(15, 17, 2.6, 1.0)).translate((0, 0, 50))
    parts = decompose(mesh_of(cylinder(20, 0, 40), cylinder(15, 40, 76), boss, thread))
    want = (boss - Manifold.cylinder(60, 20, 20, 2048)).volume()
    assert [mesh.volume for mesh in parts.sub_volumes] == pytest.approx([want], rel=2e-3)
