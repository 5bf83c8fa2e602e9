"""The round body of CAD-like parts: axis, radius and what stands on it, against what is known of them."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold
from support.parts.cad_parts import FORMATS, boss_fillet, cad_part, filleted_blade, radial_cylinder, revolved
from support.parts.part_truth import judged
from support.parts.turned_meshes import box, codes, cylinder, mesh_of, shoulder, turned, volumes

from slicing.beads.overhang import overhangs
from slicing.decomposition.bands import Band
from slicing.decomposition.cut import Cut, CutPiece, Sliver
from slicing.decomposition.decompose import Decomposition, decompose
from slicing.decomposition.evidence_warnings import domed_body, what_is_left
from slicing.decomposition.outline import Outline
from slicing.layers.body_ends import body_ends
from slicing.mesh.load import load_mesh
from slicing.mesh.solid import PartError, mesh_from_arrays
from slicing.parameters import SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.warning import Code, Warning

UPRIGHT = np.array([0.0, 0.0, 1.0])


def tilt_deg(parts: Decomposition, direction=UPRIGHT) -> float:
    up = parts.T_part_input[:3, :3] @ direction
    return math.degrees(math.asin(min(float(np.hypot(*up[:2])), 1.0)))


def wedge(half: float, radius: float, height: float) -> float:
    """Adhesion area of a wall of half a width along a radius."""
    return 2 * math.asin(half / radius) * radius * height


# 30004: 14 sides far from the origin; 40241: a cone of 14 sides; 710019: a tiny cylinder below a filleted collar;
# 3007, 3044, 4090: 9, 11 and 8 sides; 3092: a rounded end and a collar's root fillet have facets of one slope
@pytest.mark.slow
@pytest.mark.parametrize("seed", [*range(300, 312), 30004, 40241, 710019, 3007, 3044, 3092, 4090])
def test_parts_of_known_truth_are_found(seed, tmp_path):
    part = cad_part(seed)
    found = judged(part, load_mesh(part.save(tmp_path, FORMATS[seed % len(FORMATS)])))
    assert found.kind == "right", f"{found.why} [{part.words}]"


@pytest.mark.parametrize("sides", [13, *(pytest.param(sides, marks=pytest.mark.slow) for sides in (8, 9))])
def test_a_hub_of_few_sides_is_the_body_and_not_its_round_boss(sides):
    one = radial_cylinder(5, 10, 40, 32).translate((0, 0, 30))
    parts = decompose(mesh_of(cylinder(20, 0, 60, sides) + one, turned(50, (1, 2, 3), (80, -20, 10))))
    assert parts.body.radius_mm == pytest.approx(20.0, abs=1e-4)
    assert volumes(parts) == pytest.approx([(one - cylinder(20, -1, 61, 4096)).volume()], rel=1e-3)
    assert Code.BODY_SMALL not in codes(parts)


def test_a_low_rib_on_a_cone_is_no_bulge_of_it():
    """As low as what a dome bulges out of the cones that stand for it, but its sides are not turned."""
    rib = cylinder(43.8, 0, 60, 100, top=26.8) ^ box((20, -3, 10), (60, 3, 50))
    parts = decompose(mesh_of(cylinder(42, 0, 60, 100, top=25) + rib))
    assert volumes(parts) == pytest.approx([(rib - cylinder(42, 0, 60, 2048, top=25)).volume()], rel=1e-3)


def test_two_hubs_side_by_side_are_told_of():
    """Either may be meant: their axes are parallel, and as much is turned about the one as about the other."""
    arm = box((0, -4, 20), (80, 4, 30))
    two = cylinder(15, 0, 50) + cylinder(15, 0, 50).translate((80, 0, 0)) + arm
    assert Code.BODY_RIVAL in codes(decompose(mesh_of(two, turned(40, (1, 2, 0)))))
    small = cylinder(15, 0, 50) + cylinder(6, 0, 50).translate((80, 0, 0)) + arm
    assert Code.BODY_RIVAL not in codes(decompose(mesh_of(small)))


def test_a_box_with_its_edges_cut_off_is_no_round_body():
    """Four of its eight sides lie as far from the axis as an octagon's, the others do not."""
    bar = box((-20, -20, 0), (20, 20, 60)) ^ Manifold.cylinder(60, 26, 26, 4)
    with pytest.raises(PartError, match="no round body"):
        decompose(mesh_of(bar + radial_cylinder(5, 5, 40, 48).translate((0, 0, 30))))


def test_a_turned_bar_with_an_octagonal_flange_is_a_bar():
    parts = decompose(mesh_of(cylinder(20, 0, 120) + cylinder(34, 50, 60, 8)))
    assert parts.body.radius_mm == 20.0
    assert len(parts.sub_volumes) == 1


@pytest.mark.parametrize(
    ("fillet", "steps"),
    [
        *[(0.0, 1), (5.0, 16)],
        *(pytest.param(*one, marks=pytest.mark.slow) for one in ((2.0, 3), (10.0, 6), (10.0, 40))),
    ],
)
def test_root_fillets_of_a_blade_leave_radius_and_axis(fillet, steps):
    blade = Manifold.extrude(filleted_blade(20.0, 10.0, 50.0, fillet, steps), 60.0)
    parts = decompose(mesh_of(cylinder(20, 0, 60) + blade))
    assert parts.body.radius_mm == 20.0
    assert parts.body.axis_xy_mm == (0.0, 0.0)
    fine = blade - cylinder(20, -1, 61, 4096)
    assert volumes(parts) == pytest.approx([fine.volume()], rel=5e-4)


@pytest.mark.parametrize(("sides", "steps"), [(26, 5), pytest.param(63, 12, marks=pytest.mark.slow)])
def test_a_boss_with_a_root_fillet_is_no_body(sides, steps):
    boss = radial_cylinder(12, 10, 60, 63) + boss_fillet(30, 12, 8, 63, steps)
    boss = boss.translate((0, 0, 28))
    parts = decompose(mesh_of(cylinder(30, 0, 100, sides) + boss, turned(33, (1, 2, 3), (50, -20, 10))))
    assert parts.body.radius_mm == pytest.approx(30.0, abs=1e-4)
    assert volumes(parts) == pytest.approx([(boss - cylinder(30, -1, 101, 4096)).volume()], rel=1e-3)


def test_four_filleted_blades_are_alike():
    blade = Manifold.extrude(filleted_blade(25.0, 6.0, 65.0, 4.0, 5), 60.0)
    solid = cylinder(25, 0, 60, 26)
    for k in range(4):
        solid += blade.rotate((0, 0, 90.0 * k + 7.0))
    parts = decompose(mesh_of(solid))
    assert parts.body.radius_mm == 25.0
    assert tilt_deg(parts) < 1e-4
    assert volumes(parts) == pytest.approx([(blade - cylinder(25, -1, 61, 4096)).volume()] * 4, rel=1e-3)


def test_a_ring_shaped_cavity_in_a_collar_is_no_body():
    ring = revolved([(10, 40), (60, 40), (60, 55), (10, 55)], 64)
    cavity = revolved([(35, 43), (50, 43), (50, 52), (35, 52)], 64)
    parts = decompose(mesh_of(cylinder(25, 0, 150) + ring - cavity))
    assert [body.radius_mm for body in parts.bodies] == [25.0]
    assert volumes(parts) == pytest.approx([(ring - cavity - cylinder(25, -1, 151, 4096)).volume()], rel=1e-3)


@pytest.mark.parametrize("angle", [0.1, 3.0, *(pytest.param(a, marks=pytest.mark.slow) for a in (0.5, 1.5, 12.0))])
def test_a_drafted_hub_is_a_cone_and_no_tilted_cylinder(angle):
    top = 25 - 100 * math.tan(math.radians(angle))
    parts = decompose(mesh_of(cylinder(25, 0, 100, 48, max(top, 1)) + box((3, -3, 30), (50, 3, 70))))
    assert tilt_deg(parts) < 1e-3
    assert parts.cones[0] is not None
    assert parts.cones[0].half_angle_deg == pytest.approx(-angle, abs=5e-3)
    assert parts.evidence is not None
    assert parts.evidence.kind == "cone"


@pytest.mark.parametrize("strategy", ["cylindrical", pytest.param("nonuniform", marks=pytest.mark.slow)])
def test_cylindrical_layers_begin_with_the_whole_root_on_a_drafted_hub(strategy):
    top = 25 - 100 * math.tan(math.radians(0.5))
    parts = decompose(mesh_of(cylinder(25, 0, 100, 48, top) + box((3, -3, 30), (50, 3, 70))))
    (body,) = parts.bodies
    assert any("0.17 mm off the cone" in line for line in parts.warnings)
    ends = body_ends(parts.outline.points, body)
    assert ends[1] >= 69.9
    sliced = slice_sub_volume(parts.sub_volumes[0], body, SlicingParameters(strategy), ends)
    assert sliced.layers[0].area_mm2 == pytest.approx(wedge(3, 24.56, 40), rel=5e-3)
    assert not any(getattr(line, "code", None) == Code.BODY_END for line in sliced.warnings)
    assert not any(over.area_mm2 for over in overhangs(sliced, 2.5))


@pytest.mark.parametrize("angle", [45.0, *(pytest.param(a, marks=pytest.mark.slow) for a in (10.0, 77.0))])
def test_flats_that_outweigh_the_round_turn_no_axis(angle):
    solid = cylinder(15, 0, 20, 48)
    for k in range(3):
        solid += box((5, -2, 0), (75, 2, 20)).rotate((0, 0, 120.0 * k))
    motion = turned(angle)
    parts = decompose(mesh_of(solid, motion))
    assert parts.body.radius_mm == 15.0
    assert tilt_deg(parts, motion[:3, 2]) < 1e-4
    assert len(parts.sub_volumes) == 3


@pytest.mark.parametrize(("count", "length"), [(4, 150), pytest.param(12, 80, marks=pytest.mark.slow)])
def test_fins_longer_than_the_hub(count, length):
    solid = cylinder(20, 0, 100, 48)
    for k in range(count):
        solid += box((10, -1.5, 5), (20 + length, 1.5, 95)).rotate((0, 0, 360.0 * k / count))
    parts = decompose(mesh_of(solid))
    assert parts.body.radius_mm == 20.0
    assert len(parts.sub_volumes) == count
    layers = slice_sub_volume(parts.sub_volumes[0], parts.bodies[0], SlicingParameters("cylindrical")).layers
    assert layers[0].area_mm2 == pytest.approx(wedge(1.5, 20, 90), rel=1e-4)


@pytest.mark.slow
def test_a_shoulder_fillet_is_body_however_large_the_rest():
    solid = shoulder() + cylinder(300, 2, 6, 64)
    parts = decompose(mesh_of(solid))
    assert len(parts.sub_volumes) == 2
    assert min(volumes(parts)) == pytest.approx(volumes(decompose(mesh_of(shoulder())))[0], rel=1e-4)


def test_a_ring_alone_on_a_shaft_is_a_sub_volume():
    solid = cylinder(90, 0, 260) + cylinder(130, 100, 160)
    parts = decompose(mesh_of(solid))
    assert len(parts.sub_volumes) == 1
    assert volumes(parts)[0] == pytest.approx((solid - cylinder(90, -1, 261, 4096)).volume(), rel=1e-4)
    assert Code.BODY_COLLAR in codes(parts)


def test_a_flange_with_root_fillets_is_one_ring():
    arc = [(24 + 4 * math.cos(a), 54 + 4 * math.sin(a)) for a in np.linspace(-math.pi / 2, -math.pi, 7)]
    ring = revolved([(10, 44), (60, 44), (60, 50), *arc, (10, 54)], 64)
    parts = decompose(mesh_of(cylinder(20, 0, 100) + ring))
    assert [r for r, _ in parts.outline.points] == pytest.approx([20.0] * len(parts.outline.points), rel=1e-6)
    assert volumes(parts) == pytest.approx([(ring - cylinder(20, -1, 101, 4096)).volume()], rel=1e-3)


def test_a_piece_that_touches_nothing_is_told():
    solid = cylinder(40, 0, 60) + box((20, -5, 10), (60, 5, 30)) + box((-60, -10, 20), (-44, 10, 35))
    parts = decompose(mesh_of(solid))
    assert len(parts.sub_volumes) == 1
    line = next(w for w in parts.warnings if isinstance(w, Warning) and w.code is Code.FLOATING_PIECE)
    assert "touches nothing" in line
    assert "4800 mm³" in line
    assert " 4.000 mm off" in line  # its near face, not its corners, which are sqrt(44² + 10²) - 40 = 5.122 mm off
    assert not any("ends or steps" in w for w in parts.warnings)


@pytest.mark.parametrize("seed", [301, pytest.param(308, marks=pytest.mark.slow)])
def test_body_and_sub_volumes_add_up_to_the_part(seed):
    part = cad_part(seed)
    mesh = mesh_from_arrays("part", part.vertices, part.faces)
    parts = decompose(mesh)
    assert parts.body_mesh.volume + sum(volumes(parts)) == pytest.approx(mesh.volume, rel=2e-4)
    assert Code.BODY_VOLUME not in codes(parts)


def test_a_boss_on_a_block_is_no_body():
    with pytest.raises(PartError, match=r"no round body found.* 8 sides.* lies open along"):
        decompose(mesh_of(box((-20, -20, -20), (20, 20, 20)) + cylinder(5, 10, 40, 96)))


def test_lands_between_grooves_are_body_and_discs_are_not():
    block = box((0, -5, 10), (35, 5, 30))
    grooves = [revolved([(16, z), (21, z), (21, z + 2), (16, z + 2)], 64) for z in (50, 54, 58)]
    bar = cylinder(20, 0, 80) - grooves[0] - grooves[1] - grooves[2]  # 4 deep, the lands 2 long
    assert len(decompose(mesh_of(bar + block)).sub_volumes) == 1
    wide = cylinder(20, 0, 80) - grooves[0] - grooves[0].translate((0, 0, 20))  # the land between them 18 long
    assert len(decompose(mesh_of(wide + block)).sub_volumes) == 1
    # on a narrower stretch of the bar a disc of its diameter is a flange: no groove is so wide
    shaft = cylinder(20, 0, 40) + cylinder(12, 40, 100) + cylinder(20, 80, 84)
    parts = decompose(mesh_of(shaft + block))
    assert max(volumes(parts)) == pytest.approx(math.pi * (20**2 - 12**2) * 4, rel=5e-3)
    assert len(parts.sub_volumes) == 2


def test_a_shaft_under_a_larger_eccentric_disc_is_the_body():
    disc = cylinder(32, 15, 45).translate((6, 0, 0))
    parts = decompose(mesh_of(cylinder(20, 0, 60) + disc, turned(40, (1, 2, -1))))
    assert parts.body.radius_mm == pytest.approx(20.0, abs=1e-3)
    assert volumes(parts) == pytest.approx([math.pi * 30 * (32**2 - 20**2)], rel=5e-3)
    assert Code.BODY_RIVAL in codes(parts)


def outline_of(points) -> Outline:
    """Cones and cylinders through (r, z) points, all of them seen."""
    return Outline(tuple(Band(z, top, r, above, area_mm2=1.0) for (r, z), (above, top) in pairwise(points)))


def test_the_equator_of_a_ball_is_doubted_as_a_body():
    angles = np.deg2rad(np.arange(-81.0, 82.0, 6.0))  # a flat about the equator
    ball = outline_of([(round(30 * math.cos(a), 6), 30 * math.sin(a)) for a in angles])
    radius = max(s.radius_low for s in ball.sections if s.is_cylinder)
    (line,) = domed_body("part", ball, radius)
    assert line.code is Code.BODY_RADIUS
    assert "it was measured on 3.14 mm of a ball" in line  # 2 * 30 * sin(3 degrees)
    crowned = outline_of([(29, -20), (30, -3), (30, 3), (29, 20)])
    chamfered = outline_of([(25, -8), (30, -3), (30, 3), (25, 8)])
    assert domed_body("part", crowned, 30.0) == domed_body("part", chamfered, 30.0) == []


@pytest.mark.parametrize(("count", "doubted"), [(11, False), (12, True)])
def test_many_slivers_are_a_doubt_about_the_body(count, doubted):
    nothing = CutPiece(np.zeros((0, 3)), *(np.zeros((0, 3), dtype=np.int64),) * 3)
    lines = what_is_left("part", Cut([], nothing, [], [], [Sliver(0.02, 1e-3)] * count))
    assert [line.code for line in lines] == [Code.BODY_RADIUS] * doubted + [Code.SLIVERS]


def test_a_section_is_a_circle():  # of the support's own turned solids
    assert CrossSection.circle(20, 64).area() * 10 == pytest.approx(cylinder(20, 0, 10).volume(), rel=1e-6)
