"""The body itself in planar layers: areas, holes, and its growing in the cell."""

import numpy as np
import pytest
import trimesh
from support.jobs.cases import boss_mesh

from cell.case.read import load_case
from cell.errors import InputError
from cell.job.job import prepare, slice_part
from cell.job.part_input import read_part
from cell.verdict.check import check_fixed
from slicing.layers.layer import ConicalBody, CylindricalBody
from slicing.mesh.solid import PartError, mesh_from_arrays
from slicing.paper.indices import indices
from slicing.parameters import SlicingParameters
from slicing.strategies.printed_body import slice_body, turned_solid
from slicing.strategies.slice import slice_sub_volume
from slicing.targets.targets import sample_targets

H = 1.5
PARAMETERS = SlicingParameters("nonuniform", H, 1.2, 2.0)
AXIS = (3.0, -2.0)
SHORT = {"radius_mm": 20, "z_mm": [14, 26]}  # a body just longer than the boss is wide
ON_PLATE = {"body": SHORT, "position_mm": [0, 0, -14]}


def turned(*profile, tolerance=0.01):
    return turned_solid(profile, AXIS, tolerance)


def test_stacked_layers_of_a_cylinder_are_its_volume():
    mesh = turned((20.0, 5.0), (20.0, 5.0 + 8 * H), tolerance=1e-4)
    sliced = slice_body(mesh, CylindricalBody(20.0, AXIS), PARAMETERS)
    assert len(sliced.layers) == 8
    assert sum(layer.area_mm2 * H for layer in sliced.layers) == pytest.approx(mesh.volume, rel=1e-9)
    assert mesh.volume == pytest.approx(np.pi * 400 * 8 * H, rel=2e-5)


def test_layers_stand_on_the_lower_end_and_follow_at_h_layer():
    sliced = slice_body(turned((20.0, 5.0), (20.0, 15.0)), CylindricalBody(20.0, AXIS), PARAMETERS)
    assert [layer.index for layer in sliced.layers] == list(range(7))  # the last bead reaches half a millimetre too far
    for k, layer in enumerate(sliced.layers):
        (curve,) = layer.curves
        assert np.allclose(curve.points[:, 2], 5.0 + k * H, atol=1e-6)
        assert np.hypot(*(curve.points[:, :2] - AXIS).T) == pytest.approx(np.full(len(curve.points), 20.0), abs=0.01)
        assert layer.thickness_mm == (H, H)
        assert (sliced.thickness_at(k, curve.points) == H).all()
        assert layer.surface.normal == (0.0, 0.0, 1.0)
    assert (sliced.name, sliced.strategy) == ("BODY", "planar")
    found = indices(sliced, sample_targets([sliced]))
    assert (found.NL, found.R_rad) == (7, 0.0)
    assert found.A_mm2 == sliced.layers[0].area_mm2  # what it stands on the plate with


def test_a_hollow_body_gives_rings_with_holes():
    tube = trimesh.creation.annulus(12.0, 20.0, 30.0, sections=200)
    mesh = mesh_from_arrays("tube", tube.vertices, tube.faces)
    sliced = slice_body(mesh, CylindricalBody(20.0), PARAMETERS)
    assert len(sliced.layers) == 20
    for layer in sliced.layers:
        outer, hole = sorted(layer.curves, key=lambda curve: curve.hole)
        assert not outer.hole
        assert hole.hole
        assert layer.area_mm2 == pytest.approx(mesh.volume / 30.0, rel=1e-9)


def test_a_cone_and_a_stepped_profile_that_starts_on_the_axis():
    cone = slice_body(turned((10.0, 0.0), (22.0, 12.0), tolerance=1e-3), ConicalBody(10.0, 45.0, AXIS), PARAMETERS)
    for k, layer in enumerate(cone.layers):
        assert layer.area_mm2 == pytest.approx(np.pi * (10.0 + k * H) ** 2, rel=2e-4)
    bobbin = turned((0.0, 0.0), (15.0, 0.0), (15.0, 5.0), (6.0, 5.0), (6.0, 20.0), (0.0, 26.0), tolerance=1e-3)
    assert bobbin.volume == pytest.approx(np.pi * (225 * 5 + 36 * 15 + 36 * 6 / 3), rel=2e-4)
    assert len(slice_body(bobbin, CylindricalBody(6.0, AXIS), PARAMETERS).layers) == 18


@pytest.mark.parametrize("profile", [((20.0, 0.0), (20.0, 9.0)), ((0.0, 0.0), (8.0, 4.0), (0.0, 9.0))])
def test_the_poles_of_a_turned_solid_are_fans(profile):
    mesh = turned(*profile)
    assert not mesh.warnings
    assert (mesh.normals**2).sum(axis=1).min() > 0.0
    rings = sum(r > 0 for r, _ in profile)
    around = (len(mesh.vertices) - 2) // rings
    assert len(mesh.faces) == 2 * around * rings
    assert trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).is_watertight


def test_a_profile_that_lies_on_the_axis_is_refused():
    with pytest.raises(PartError, match="lies on the axis"):
        turned((0.0, 0.0), (0.0, 9.0))


def test_layers_without_end_are_refused_at_once():
    mesh, thin = turned((20.0, 0.0), (20.0, 1001.0)), SlicingParameters("nonuniform", 0.01, 0.01, 1.0)
    boss = mesh_from_arrays("boss", 100.0 * boss_mesh().vertices, boss_mesh().faces)
    for cut in (slice_body, slice_sub_volume):
        with pytest.raises(PartError, match=r"h_layer_mm 0\.01 is too thin"):
            cut(*((mesh, CylindricalBody(20.0)) if cut is slice_body else (boss, CylindricalBody(2000.0))), thin)
    in_metres = turned((20e3, 0.0), (20e3, 40e3))
    with pytest.raises(PartError, match="is the mesh in another unit"):
        slice_body(in_metres, CylindricalBody(20e3), SlicingParameters("nonuniform", 2.0, 1.0, 3.0))


def test_the_body_comes_first_and_is_not_there_before_it_is_printed(make_case):
    job = prepare(load_case(make_case(part=ON_PLATE, slicing={"body": "planar"})))
    assert [s.name for s in job.sliced] == ["BODY", "SV1"]
    assert job.targets.sub_volume == ("BODY", "SV1")
    body, boss = job.sliced
    assert job.shape.first_deposit == (0, len(body.layers))
    assert not [name for name in job.shape.hulls if name.startswith("body/")]
    # all of the body is laid before the first bead of the boss, nothing before the body's own
    first_of_boss = int(np.flatnonzero(job.targets.sub_volume_index == 1)[0])
    assert job.deposits_before[0] == 0
    assert job.deposits_before[first_of_boss] == len(body.layers)
    assert {line.code for line in job.warnings} == {"deposit_share"}  # borders alone do not fill
    standing = prepare(load_case(make_case(part=ON_PLATE)))
    assert [name for name in standing.shape.hulls if name.startswith("body/")]
    assert [layer.area_mm2 for layer in standing.sliced[0].layers] == [layer.area_mm2 for layer in boss.layers]


def test_a_check_of_the_body_alone_runs(make_case):
    case = load_case(
        make_case(part={**ON_PLATE, "take": ["BODY"]}, slicing={"body": "planar"}, table={"E1_deg": 0, "E2_deg": 0})
    )
    result = check_fixed(prepare(case), 0.0, 0.0)
    assert result.feasible
    assert {len(s.layers) for s in result.job.sliced} == {7}


def test_a_body_with_a_mesh_of_its_own_and_one_found_in_a_whole_part(make_case, tmp_path):
    hub = trimesh.creation.annulus(8.0, 20.0, 40.0, sections=96)
    hub.apply_translation([0, 0, 20])
    hub.export(tmp_path / "hub.stl")
    case = load_case(make_case(part={"body": {"radius_mm": 20, "mesh": "hub.stl"}}, slicing={"body": "planar"}))
    body, _ = slice_part(case, read_part(case))
    assert {len(layer.curves) for layer in body.layers} == {2}
    assert body.layers[0].area_mm2 == pytest.approx(hub.volume / 40.0, rel=1e-6)
    trimesh.boolean.union([hub, boss_mesh()], engine="manifold").export(tmp_path / "whole.stl")
    whole = load_case(
        make_case(part={"mesh": "whole.stl", "sub_volumes": [], "body": None}, slicing={"body": "planar"})
    )
    found = slice_part(whole, read_part(whole))
    assert [s.name for s in found] == ["BODY", "SV1"]
    assert [layer.area_mm2 for layer in found[0].layers] == pytest.approx([x.area_mm2 for x in body.layers], rel=1e-4)


@pytest.mark.parametrize(
    ("body", "strategy", "radii"),
    [
        ({"radius_mm": 19, "half_angle_deg": 5, "z_mm": [12, 28]}, "conical", (20.05, 21.41)),
        ({"radius_mm": None, "profile_mm": [[18, 12], [20, 18], [20, 30]], "z_mm": None}, "revolved", (18.0, 20.0)),
    ],
)
def test_bodies_that_are_told_by_angle_or_profile(make_case, body, strategy, radii):
    part = {"body": body, "position_mm": [0, 0, -12]}
    case = load_case(make_case(part=part, slicing={"body": "planar", "strategy": strategy}))
    part_input = read_part(case)
    printed, boss = slice_part(case, part_input)
    assert (printed.strategy, boss.strategy) == ("planar", strategy)
    for layer, radius in ((printed.layers[0], radii[0]), (printed.layers[-1], radii[1])):
        away = np.hypot(*layer.curves[0].points[:, :2].T)
        assert away.min() <= radius + 0.02
        assert away.max() >= radius - 0.02
    assert not part_input.warnings


def test_what_a_case_may_take(make_case):
    with pytest.raises(InputError, match=r"part\.take: BODY is printed only with slicing: \{body: planar\}"):
        read_part(load_case(make_case(part={"take": ["BODY"]})))
    with pytest.raises(InputError, match="no sub-volume 'SV9'; there are SV1"):
        read_part(load_case(make_case(part={"take": ["SV9"]}, slicing={"body": "planar"})))
    alone = read_part(load_case(make_case(part={"take": ["BODY"]}, slicing={"body": "planar"})))
    assert not alone.meshes
    assert alone.body_solid is not None


def test_where_the_body_ends_and_stands_is_said_if_it_is_not_plain(make_case):
    loose = read_part(load_case(make_case(part={"body": {"radius_mm": 20, "z_mm": None}}, slicing={"body": "planar"})))
    assert loose.warnings == (
        "BODY: part.body.z_mm is not given; the body ends where its sub-volumes end, z = 16 .. 24 mm",
        "BODY: its lower end is 16.000 mm off what the part stands on (part.position_mm)",
    )
