"""Sections of wedges, cones and tori on a cylinder against their formulas, and surfaces that exactly touch a solid."""

from __future__ import annotations

import math

import manifold3d
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq
from support.parts.meshes import from_manifold, grid_block, prism, subdivided

from slicing.curves.intersect import intersect
from slicing.layers.layer import CylindricalBody
from slicing.mesh.solid import mesh_from_arrays
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.surfaces import Cylinder, Plane

AXIS, TOLERANCE = (0.0, 0.0), 0.01


@pytest.mark.parametrize("radius", [20.0, 24.4, 37.0])
@pytest.mark.parametrize("finer", [0, 3])
def test_wedge(radius, finer):
    """A wedge that narrows from 9 to 2 mm beside its middle plane: |y| <= 11 - 0.225 x."""
    mesh = subdivided(prism([(8.8889, -9), (40, -2), (40, 2), (8.8889, 9)], -7, 7), finer)
    slope = 7 / (40 - 8.8889)
    half = brentq(lambda t: radius * math.sin(t) - (2 + slope * (40 - radius * math.cos(t))), 0, 1)
    (curve,) = intersect(mesh, Cylinder(AXIS, radius), TOLERANCE)
    assert curve.area_mm2 == pytest.approx(2 * half * radius * 14, rel=1e-6)
    arcs = 2 * 2 * half * radius  # chords that stay within the tolerance of an arc are this much shorter at most
    shorter = arcs * TOLERANCE / (3 * radius) * 1.01
    assert -1e-6 <= 2 * 14 + arcs - curve.length_mm <= shorter + 1e-6


@pytest.mark.parametrize("radius", [20.0, 26.0, 33.0])
@pytest.mark.parametrize("lean", [0.0, 0.12, -0.1])
def test_cone_boss(radius, lean):
    """A round boss along x, its radius 8 at x = 25 and growing by `lean`; as many sides have the circle's area."""
    n = 900
    even = math.sqrt(2 * math.pi / n / math.sin(2 * math.pi / n))
    low, high = (even * (8 + lean * (x - 25)) for x in (10, 45))
    boss = manifold3d.Manifold.cylinder(35.0, low, high, n).rotate((0, 90, 0)).translate((10, 0, 0))
    (curve,) = intersect(from_manifold(boss), Cylinder(AXIS, radius), TOLERANCE)

    def height2(t):
        return (8 + lean * (radius * math.cos(t) - 25)) ** 2 - (radius * math.sin(t)) ** 2

    end = brentq(height2, 0, 0.6)
    exact = quad(lambda t: 2 * radius * math.sqrt(max(height2(t), 0.0)), -end, end)[0]
    assert curve.area_mm2 == pytest.approx(exact, rel=1e-4)
    t = end * np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, 20001))
    z = np.sqrt(np.maximum([height2(v) for v in t], 0.0))
    exact = 2 * float(np.hypot(radius * np.diff(t), np.diff(z)).sum())
    assert curve.length_mm == pytest.approx(exact, rel=1e-4)


@pytest.mark.parametrize("radius", [20.5, 24.0, 28.0, 33.0])
def test_torus_segment(radius):
    """Tube of 10 mm about a ring of 25 mm, 1 rad of it; its section reaches as far along z as the tube does there."""
    n, rounds = 140, 360
    even = 10 * math.sqrt(2 * math.pi / rounds / math.sin(2 * math.pi / rounds))
    angle = np.arange(rounds) / rounds * 2 * np.pi
    turn = np.linspace(-0.5, 0.5, n + 1)
    r, z = 25 + even * np.cos(angle), even * np.sin(angle)
    points = np.stack([np.outer(np.cos(turn), r), np.outer(np.sin(turn), r), np.tile(z, (n + 1, 1))], axis=-1)
    i, j = np.meshgrid(np.arange(n), np.arange(rounds), indexing="ij")
    k = (j + 1) % rounds
    a, b, c, d = (p.ravel() for p in (i * rounds + j, (i + 1) * rounds + j, (i + 1) * rounds + k, i * rounds + k))
    ends = [np.stack([np.zeros(rounds - 2, int), np.arange(1, rounds - 1), np.arange(2, rounds)], axis=1)]
    ends.append(ends[0][:, ::-1] + n * rounds)
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1), *(e[:, ::-1] for e in ends)])
    mesh = mesh_from_arrays("torus", points.reshape(-1, 3), faces)
    assert mesh.volume == pytest.approx(math.pi * 100 * 25, rel=1e-4)
    (curve,) = intersect(mesh, Cylinder(AXIS, radius), TOLERANCE)
    high = math.sqrt(100 - (radius - 25) ** 2)
    assert curve.area_mm2 == pytest.approx(radius * 2 * high, rel=1e-4)
    assert curve.length_mm == pytest.approx(2 * radius + 4 * high, rel=1e-4)


@pytest.mark.parametrize("strategy", ["planar", "cylindrical", pytest.param("nonuniform", marks=pytest.mark.slow)])
def test_a_boss_of_12_triangles_and_of_100000_has_the_same_layers(strategy):
    def where(u, v, w):
        return 10 + 30 * u, 12 * v - 6, 16 * w - 8

    coarse, fine = (grid_block(where, n, n, n, "box") for n in (1, 92))
    assert len(coarse.faces) == 12
    assert len(fine.faces) > 100_000
    a, b = (slice_sub_volume(mesh, CylindricalBody(20.0), SlicingParameters(strategy)) for mesh in (coarse, fine))
    assert [layer.surface.kind for layer in a.layers] == [layer.surface.kind for layer in b.layers]
    for p, q in zip(a.layers, b.layers, strict=True):
        assert len(p.curves) == len(q.curves)
        assert q.area_mm2 == pytest.approx(p.area_mm2, rel=1e-6)
        assert q.thickness_mm == pytest.approx(p.thickness_mm, abs=1e-3)
    assert a.warnings == b.warnings


BOXES = st.lists(
    st.tuples(*(st.integers(-6, 5) for _ in range(3)), *(st.integers(1, 7) for _ in range(3))), min_size=1, max_size=3
)
TRIPLES = [(3, 4, 5), (4, 3, 5), (6, 8, 10), (5, 12, 13), (0, 5, 5), (8, 6, 10)]  # corners exactly at a radius


@settings(max_examples=60, deadline=None)
@given(
    BOXES,
    st.sampled_from(["x", "z", "diagonal", "cylinder"]),
    st.integers(-4, 5),
    st.sampled_from(TRIPLES),
    st.integers(0, 1),
)
def test_surfaces_through_vertices_edges_and_faces(boxes, kind, at, triple, finer):
    """On whole numbers everything touches; the section is that a hair further out, no loop more and none less."""
    solid = manifold3d.Manifold()
    for x, y, z, a, b, c in boxes:
        solid += manifold3d.Manifold.cube((float(a), float(b), float(c))).translate((float(x), float(y), float(z)))
    mesh = subdivided(from_manifold(solid), finer)
    x, y, z = boxes[0][:3]
    if kind == "cylinder":  # through the first corner of a box
        surface: Cylinder | Plane = Cylinder((float(x - triple[0]), float(y - triple[1])), float(triple[2]))
    elif kind == "diagonal":
        half = math.sqrt(0.5)
        surface = Plane((float(x), float(y), float(z)), (half, 0.0, half))
    else:
        surface = Plane((float(at), 0.0, float(at)), (1.0, 0.0, 0.0) if kind == "x" else (0.0, 0.0, 1.0))
    here, beyond = intersect(mesh, surface), intersect(mesh, surface.offset(1e-5))
    # what only grazes is a sliver: at 1e-5 mm beyond a face that touches a cylinder 0.03 mm wide
    assert sum(abs(c.area_mm2) > 0.3 for c in here) == sum(abs(c.area_mm2) > 0.3 for c in beyond)
    assert sum(c.area_mm2 for c in here) == pytest.approx(sum(c.area_mm2 for c in beyond), rel=1e-3, abs=0.3)
    for curve in here:
        assert curve.closed
        steps = np.linalg.norm(np.roll(curve.points, -1, axis=0) - curve.points, axis=1)
        assert (steps > 0).all()
