"""What begins in the air or stands out over what lies below: areas and angles by hand, warnings, and the limit."""

from __future__ import annotations

import math

import manifold3d
import numpy as np
import pytest
import shapely
from support.parts.meshes import BODY, box, box_solid, from_manifold, ring

from cell.case.read import load_case
from cell.job.job import prepare
from cell.job.overhang_check import past_horizontal, unsupported_targets
from slicing.beads.lay import lay_beads
from slicing.beads.overhang import _farthest, overhangs
from slicing.parameters import BeadParameters, SlicingParameters
from slicing.strategies.slice import slice_sub_volume
from slicing.warning import Code


def united(*boxes) -> manifold3d.Manifold:
    return manifold3d.Manifold.batch_boolean([box_solid(*b) for b in boxes], manifold3d.OpType.Add)


T = united(((10, -8, 0), (46, 8, 15)), ((45, -20, 0), (60, 20, 15)))
LIP = united(((10, -8, 0), (50, 8, 12)), ((41, -8, 12), (50, 8, 30)), ((24, -8, 24), (50, 8, 30)))


def told(mesh, strategy="nonuniform"):
    sliced = slice_sub_volume(mesh, BODY, SlicingParameters(strategy))
    (laid,) = lay_beads([sliced], BeadParameters())
    return laid, [line for line in laid.warnings if getattr(line, "code", None) == Code.OVERHANG]


def test_arms_that_stand_out_on_both_sides_are_told_of_with_their_area():
    laid, (line,) = told(from_manifold(T, "T"))
    hanging = [one for one in laid.overhangs if one.area_mm2 > 0]
    (one,) = hanging
    assert one.area_mm2 == pytest.approx(2 * (12 - 2.5) * 15, rel=1e-3)
    assert one.out_mm == pytest.approx(12.0, abs=1e-3)
    assert one.angle_deg == pytest.approx(math.degrees(math.atan2(12.0, 1.73)), abs=0.2)
    assert line.layer == one.layer
    assert one.begins_mm2 == 0.0  # they are joined to what has something below
    assert abs(one.place_mm[1]) == pytest.approx(20.0, abs=1e-3)
    points = np.array([[one.place_mm[0], y, 7.0] for y in (-19.0, -11.0, -9.0, 0.0, 9.0, 11.0, 19.0)])
    assert one.holds(points).tolist() == [True, True, False, False, False, True, True]


@pytest.mark.parametrize("strategy", ["planar", "cylindrical", "nonuniform"])
def test_a_lip_that_comes_back_begins_in_the_air(strategy):
    laid, lines = told(from_manifold(LIP, "lip"), strategy)
    first = next(one for one in laid.overhangs if one.begins_mm2 > 0)
    layer = laid.sliced.layers[first.layer]
    lip = min((curve for curve in layer.curves), key=lambda c: -c.points[:, 2].min())
    assert first.begins_mm2 == pytest.approx(lip.area_mm2, rel=1e-3)
    assert "begin with nothing below" in str(lines[0])
    assert lines[0].layer == first.layer


def in_rounds(*boxes):
    """Boxes in cylindrical layers of 2 mm, at radii 20, 22, .., of beads 4 mm wide."""
    parameters = SlicingParameters("cylindrical", 2.0, 1.4, 2.8)
    sliced = slice_sub_volume(from_manifold(united(((15, -6, -3), (40, 6, 3)), *boxes)), BODY, parameters)
    return lay_beads([sliced], BeadParameters(width_mm=4.0))[0]


def test_a_face_that_a_layer_just_touches_carries_nothing():
    """At 26 mm the roof is a line along the axis, without a bead: the layer above has the stem alone below it."""
    laid = in_rounds(((26, -6, -15), (34, 6, 15)))
    assert max(np.abs(bead.points[:, 2]).max() for bead in laid.beads if bead.layer == 3) < 4.0
    above = laid.overhangs[4]
    assert above.out_mm == pytest.approx(12.0, abs=0.01)
    assert above.area_mm2 == pytest.approx(2 * 10 * 28 * 2 * math.asin(6 / 28), rel=0.01)


def test_a_bead_on_a_line_in_the_air_is_told_of_however_small_its_layers_area():
    laid = in_rounds(((36, -6, -20), (40, 6, 3)), ((26, -6, -20), (40, 6, -16)))
    (line,) = [bead for bead in laid.beads if bead.layer == 3 and bead.points[:, 2].max() < -10]
    assert line.length_mm == pytest.approx(4.0, abs=0.1)
    assert laid.overhangs[3].out_mm == pytest.approx(17.0, abs=0.01)
    assert 0.0 < laid.overhangs[3].area_mm2 < 0.1
    said = [str(line) for line in laid.warnings if getattr(line, "layer", None) == 3]
    assert any("begin with nothing below them" in line and "up to 17.0 mm" in line for line in said)


def test_walls_lean_by_the_angle_that_is_found():
    for lean in (30.0, 50.0):
        out = 30 * math.tan(math.radians(lean))
        corners = [(15, -8), (45, -8 - out), (45, 8 + out), (15, 8)]
        section = manifold3d.CrossSection([[(float(x), float(y)) for x, y in corners]])
        mesh = from_manifold(manifold3d.Manifold.extrude(section, 12.0), "fan")
        sliced = slice_sub_volume(mesh, BODY, SlicingParameters("planar", 1.0, 1.0, 1.0))
        found = overhangs(sliced, 2.5)[5:-1]
        assert [one.angle_deg for one in found] == pytest.approx([lean] * len(found), abs=0.5)


def test_a_roof_beside_gaps_of_its_own_is_measured_where_it_is_farthest_from_what_lies_below():
    # over a hole 9.6 mm wide a roof as wide as two slots along it leave; across them it is 4.8 mm to the hole's sides
    plate, hole = shapely.box(-10, -20, 10, 20), shapely.box(-4.8, -11.1, 4.8, 11.1)
    for side in (-4.0, 4.0):
        roof = shapely.box(-4.0 + 0.1 * side, -11.1, 4.0 + 0.1 * side, 11.1)
        far, at, _ = _farthest(plate.difference(hole).union(roof), plate.difference(hole))
        assert far == pytest.approx(4.8, abs=0.15)
        assert abs(at[1]) < 11.1 - 4.6


def test_straight_bosses_and_rings_stand_out_nowhere():
    for mesh, strategy in ((box(), "planar"), (box(), "nonuniform"), (ring(19.9, 30, -13, 13), "cylindrical")):
        laid, lines = told(mesh, strategy)
        assert not lines
        assert max(one.out_mm for one in laid.overhangs) < 0.35  # a straight side on a rounder layer


@pytest.fixture
def t_case(make_case, tmp_path):
    mesh = T.rotate((0, 0, 180)).to_mesh64()
    import trimesh

    trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts)).export(tmp_path / "T.stl")

    def made(name: str, **checks):
        return load_case(make_case(name, part={"sub_volumes": ["T.stl"]}, checks=checks))

    return made


def test_a_limit_on_overhangs_marks_the_targets_that_lie_over_nothing(t_case):
    assert unsupported_targets(prepare(t_case("a"))) == {}
    assert unsupported_targets(prepare(t_case("b", overhang_mm=13.0))) == {}
    job = prepare(t_case("c", overhang_mm=5.0))
    found = unsupported_targets(job)
    assert found
    t = job.targets
    assert len({int(t.layer[i]) for i in found}) == 1
    assert (np.abs(t.position[list(found), 1]) > 13.0 - 0.1).all()
    (detail,) = {f.document()["limit_mm"]: f.document() for f in found.values()}.values()
    assert detail["area_mm2"] == pytest.approx(2 * (12 - 5) * 15, rel=1e-3)


def test_deposition_past_the_horizontal_is_told_of_unless_a_limit_is_set(t_case):
    free, held = t_case("a"), t_case("b", gravity_max_deg=150.0)
    (line,) = past_horizontal(free, np.deg2rad([10.0, 91.0, 148.0]))
    assert line.code == Code.PAST_HORIZONTAL
    assert "2 of 3" in line
    assert "148 deg" in line
    assert past_horizontal(free, np.deg2rad([10.0, 90.0])) == ()
    assert past_horizontal(held, np.deg2rad([10.0, 148.0])) == ()
