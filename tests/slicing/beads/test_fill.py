"""Metal that beads lay against metal that layers take: over walls of every width, shape and pattern."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold
from support.parts.meshes import box, from_manifold

from slicing.beads.deposition import LayerMetal, metal_lines
from slicing.beads.infill import Stroke
from slicing.beads.lay import lay_beads
from slicing.beads.zigzag import strokes_of_length
from slicing.curves.intersect import Curve
from slicing.layers.layer import Layer, SlicedSubVolume
from slicing.parameters import BeadParameters, SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.surfaces.bodies import CylindricalBody
from slicing.surfaces.surfaces import Cylinder, Plane
from slicing.targets.speeds import BeadSpeed
from slicing.targets.targets import sample_beads, sample_targets
from slicing.warning import Code

W, PITCH, H = 5.0, 3.75, 1.73
SHARES = (0.8, 1.1, 1.4, 2.0, 2.75, 4.0, 6.0)  # of a bead's width
PATTERNS = ("contour", "contour_parallel", "zigzag")


def area_of(loop: np.ndarray) -> float:
    after = np.roll(loop, -1, axis=0)
    return 0.5 * float((loop[:, 0] * after[:, 1] - loop[:, 1] * after[:, 0]).sum())


def sliced_of(surface, loops, points) -> SlicedSubVolume:
    """One layer with the regions between loops of a flat chart, put onto its surface."""
    curves = tuple(Curve(points(loop), True, area_of(loop) < 0, area_of(loop)) for loop in loops)
    layer = Layer(0, surface, curves, sum(area_of(loop) for loop in loops), (H, H))
    return SlicedSubVolume("SV1", "planar", box(), CylindricalBody(20.0), (layer,), (), SlicingParameters("planar"))


def wall(shape: str, wide: float) -> tuple[SlicedSubVolume, float]:
    """A wall's layer, and its area by hand."""
    plane = Plane((50.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    u, v = plane.axes()

    def on_plane(loop):
        return np.asarray(plane.point) + loop[:, :1] * u + loop[:, 1:] * v

    if shape == "round":
        t = 2 * np.pi * np.arange(120) / 120
        ring = np.stack([np.cos(t), np.sin(t)], axis=1)
        outer, inner = 40.0 * ring, (40.0 - wide) * ring[::-1]
        return sliced_of(plane, [outer, inner], on_plane), 60 * math.sin(2 * np.pi / 120) * (1600 - (40 - wide) ** 2)
    end = 0.5 if shape == "tapered" else 1.0
    loop = np.array([[-40.0, -wide / 2], [40.0, -end * wide / 2], [40.0, end * wide / 2], [-40.0, wide / 2]])
    if shape == "on the body":
        body = Cylinder((0.0, 0.0), 20.0)
        s = np.linspace(-40.0, 40.0, 200)
        loop = np.concatenate([np.stack([s, 0 * s - wide / 2], 1), np.stack([s[::-1], 0 * s + wide / 2], 1)])
        lifted = sliced_of(
            body, [loop], lambda p: np.stack([20 * np.cos(p[:, 0] / 20), 20 * np.sin(p[:, 0] / 20), p[:, 1]], 1)
        )
        return lifted, 80.0 * wide
    return sliced_of(plane, [loop], on_plane), 80.0 * wide * (1 + end) / 2


def length_of(bead) -> float:
    points = np.concatenate([bead.points, bead.points[:1]]) if bead.closed else bead.points
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())


@pytest.mark.parametrize("shape", ["straight", "tapered", "round", "on the body"])
def test_the_metal_of_every_wall_is_right_or_told_of(shape):
    for share in SHARES:
        sliced, area = wall(shape, share * W)
        for pattern in PATTERNS:
            (laid,) = lay_beads([sliced], BeadParameters(pattern, width_mm=W, thin_walls="middle"))
            by_hand = sum(length_of(bead) for bead in laid.beads) * PITCH / area
            assert laid.metal[0].share == pytest.approx(by_hand, rel=0.01), (share, pattern)
            told = [line for line in laid.warnings if getattr(line, "code", None) == Code.DEPOSIT_SHARE]
            assert bool(told) == (abs(laid.metal[0].share - 1) > 0.05), (share, pattern, by_hand)
            if pattern != "contour" and share >= 1.4:
                assert 0.85 < by_hand < 1.3, (share, pattern)


def test_a_layer_that_takes_next_to_nothing_is_told_of_by_its_volume():
    parameters = BeadParameters("zigzag")
    metal = [LayerMetal(0, 1000.0, 1080.0), LayerMetal(1, 900.0, 910.0), LayerMetal(2, 1.25, 58.0)]
    (line,) = metal_lines("SV1", metal, parameters)
    assert "2 of 3 layers are off by more than 5 %, layer 0 the most (108 %)" in line
    assert "1 of them needs almost no metal: layer 2 needs 1.25 mm³ and gets 58 mm³" in line
    (line,) = metal_lines("SV1", metal[1:], parameters)  # no other layer is off
    assert line.endswith(
        "1 of 2 layers are off by more than 5 %; 1 of them needs almost no metal:"
        " layer 2 needs 1.25 mm³ and gets 58 mm³"
    )
    (line,) = metal_lines("SV1", metal[:2], parameters)
    assert line.endswith("layer 0 the most (108 %)")


def test_beads_vary_their_speed_so_that_every_layer_gets_its_metal():
    for share in (1.0, 1.4, 2.0, 4.0):
        sliced, area = wall("straight", share * W)
        for pattern in ("contour_parallel", "zigzag"):
            laid = lay_beads([sliced], BeadParameters(pattern, width_mm=W, metal_share=(0.7, 1.5)))
            assert laid[0].metal[0].share == pytest.approx(1.0, abs=1e-6)
            targets = sample_beads(laid, speed=BeadSpeed(8.0))
            length = sum(length_of(bead) for bead in laid[0].beads)
            assert targets.speed_mm_s == pytest.approx(8.0 * length * PITCH / area, rel=0.02)
    laid = lay_beads([wall("straight", 1.1 * W)[0]], BeadParameters("zigzag", width_mm=W, metal_share=(0.9, 1.1)))
    assert {bead.metal for bead in laid[0].beads} == {1.1}  # no more than the process can do, and the rest is told of
    assert any(getattr(line, "code", None) == Code.DEPOSIT_SHARE for line in laid[0].warnings)


def test_one_bead_runs_along_the_middle_where_one_fits():
    for wide in (0.9, 3.0, 5.5):
        for pattern in PATTERNS:
            p = BeadParameters(pattern, width_mm=W, thin_walls="middle")
            (bead,) = lay_beads([wall("straight", wide)[0]], p)[0].beads
            assert not bead.closed
            across = np.sort(np.abs(bead.points[:, 2]))  # its ends may lean towards a corner
            assert across[0] < 0.05, (wide, pattern)
            assert across[-1] < 0.11 * W, (wide, pattern)
            (ring,) = lay_beads([wall("round", wide)[0]], p)[0].beads
            assert ring.closed
            assert np.hypot(ring.points[:, 1], ring.points[:, 2]) == pytest.approx(40 - wide / 2, abs=0.15)


def test_a_wall_of_ten_has_a_third_bead_between_the_two_along_its_borders():
    (laid,) = lay_beads([wall("round", 10.0)[0]], BeadParameters("contour_parallel", width_mm=W))
    radii = sorted(float(np.hypot(b.points[:, 1], b.points[:, 2]).mean()) for b in laid.beads)
    assert radii == pytest.approx([32.5, 35.0, 37.5], abs=0.05)


def test_a_thin_blade_has_its_borders_where_the_case_asks_for_them():
    sliced = wall("straight", 0.9)[0]
    (border,) = lay_beads([sliced], BeadParameters(thin_walls="border"))[0].beads
    assert border.closed
    assert border.points == pytest.approx(sliced.layers[0].curves[0].points)


def test_rings_narrower_than_a_bead_alternate_their_way_round_and_spread_their_seams():
    rings = [wall("round", 4.0)[0].layers[0]] * 8
    stack = tuple(Layer(k, one.surface.offset(k * H), one.curves, one.area_mm2, (H, H)) for k, one in enumerate(rings))
    sliced = SlicedSubVolume("SV1", "planar", box(), CylindricalBody(20.0), stack, (), SlicingParameters("planar"))
    (laid,) = lay_beads([sliced], BeadParameters("contour_parallel", width_mm=W, seam="spread", alternate=True))
    angles = [np.unwrap(np.arctan2(b.points[:, 2], b.points[:, 1])) for b in laid.beads]
    ways = [bool(a[-1] > a[0]) for a in angles]
    assert ways == [ways[0], not ways[0]] * 4
    gaps = np.abs((np.diff([a[0] for a in angles]) + np.pi) % (2 * np.pi) - np.pi) / (2 * np.pi)
    assert gaps.min() > 0.36


def test_metal_of_a_sliced_boss_is_area_times_thickness():
    sliced = slice_sub_volume(box(), CylindricalBody(20.0), SlicingParameters("cylindrical"))
    (laid,) = lay_beads([sliced], BeadParameters("zigzag"))
    for layer, metal in zip(sliced.layers, laid.metal, strict=True):
        assert metal.wanted_mm3 == pytest.approx(1.73 * layer.area_mm2, rel=1e-6)
    assert [m.laid_mm3 for m in laid.metal] == pytest.approx(
        [1.73 * PITCH * sum(length_of(b) for b in laid.beads if b.layer == k) for k in range(len(sliced.layers))]
    )


@pytest.mark.parametrize("pattern", ["zigzag", pytest.param("contour_parallel", marks=pytest.mark.slow)])
def test_middle_lines_that_do_not_go_right_round_are_laid_once(pattern: str) -> None:
    """A ring that leans about a body beside its axis: the last layers are sickles, thin at their ends."""
    section = CrossSection([[(19, 0), (27, 0), (25, 12), (19, 12)]])
    ring = from_manifold(Manifold.revolve(section, 160))
    sliced = slice_sub_volume(ring, CylindricalBody(20.0, (0.3, -0.2)), SlicingParameters("cylindrical"))
    targets = sample_targets([sliced], beads=BeadParameters(pattern=pattern))
    open_ = [targets.position[targets.bead == k] for k in np.flatnonzero(~targets.closed)]
    assert open_
    middles = np.array([line.mean(axis=0) for line in open_])
    apart = np.linalg.norm(middles[:, None] - middles, axis=2)[np.triu_indices(len(middles), 1)]
    assert apart.min() > 0.5
    layers = targets.layer[[np.flatnonzero(targets.bead == k)[0] for k in range(len(targets.closed))]]
    assert set(layers.tolist()) == set(range(len(sliced.layers)))


@pytest.mark.parametrize("angle_deg", [45.0, 90.0])
@pytest.mark.parametrize("shape", ["straight", "round", "on the body"])
def test_lines_to_and_fro_are_spread_so_that_joints_and_rounds_are_no_surplus(shape: str, angle_deg: float) -> None:
    for share in (3.2, 4.0, 5.5, 6.7):
        sliced, area = wall(shape, share * W)
        (laid,) = lay_beads([sliced], BeadParameters("zigzag", width_mm=W, angle_deg=angle_deg))
        by_hand = sum(length_of(bead) for bead in laid.beads) * PITCH / area
        assert by_hand == pytest.approx(1.0, abs=0.05), share
        assert [line for line in laid.warnings if getattr(line, "code", None) == Code.DEPOSIT_SHARE] == []


@pytest.mark.parametrize(
    ("radius", "high"), [(10.0, 30.0), *(pytest.param(20.0, high, marks=pytest.mark.slow) for high in (18.0, 25.0))]
)
def test_lines_about_a_body_lay_what_a_ring_takes(radius: float, high: float) -> None:
    tube = Manifold.cylinder(high, radius + 5, radius + 5, 256) - Manifold.cylinder(3 * high, radius - 1, -1, 256, True)
    sliced = slice_sub_volume(from_manifold(tube), CylindricalBody(radius), SlicingParameters("cylindrical"))
    for angle_deg in (45.0, 90.0, 67.0):
        (laid,) = lay_beads([sliced], BeadParameters("zigzag", width_mm=W, angle_deg=angle_deg, angle_step_deg=0.0))
        assert [metal.share for metal in laid.metal] == pytest.approx([1.0] * len(sliced.layers), abs=0.05)


def test_lines_are_never_farther_apart_than_a_bead_is_wide() -> None:
    def lines(apart_mm: float) -> list[Stroke]:
        asked.append(apart_mm)
        levels = np.linspace(0.0, 30.0, math.ceil(30.0 / apart_mm) + 1)
        return [Stroke(np.array([[0.0, y], [40.0, y]]), False, False, "infill") for y in levels]

    asked: list[float] = []
    assert len(strokes_of_length(lines, 100.0, PITCH, W)) == 7  # a third of the metal would leave gaps
    assert max(asked) == W
    assert len(strokes_of_length(lines, 40.0 * 8, PITCH, W)) == 8
    assert len(strokes_of_length(lines, 0.0, PITCH, W)) == 9  # rounds alone lay more than all of it: as asked
