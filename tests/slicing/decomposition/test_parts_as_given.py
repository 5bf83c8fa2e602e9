"""The same part given otherwise: far away, rounded, in another file, under another axis. It is taken apart alike."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from support.parts.cad_parts import FORMATS, cad_part, radial_cylinder
from support.parts.turned_meshes import box, codes, cylinder, mesh_of, shoulder, turned, volumes

from slicing.decomposition.body_hint import BodyHint
from slicing.decomposition.decompose import Decomposition, decompose
from slicing.mesh.load import load_mesh
from slicing.mesh.solid import Mesh, mesh_from_arrays
from slicing.warning import Code


@pytest.mark.parametrize(
    ("sides", "digits"), [(24, 2), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((40, 2), (48, 3)))]
)
def test_rounded_coordinates_hide_no_body(sides, digits):
    solid = cylinder(25, 0, 50, sides) + cylinder(20, 50, 90, sides) + box((3, -3, 55), (50, 3, 85))
    parts = decompose(mesh_of(solid, digits=digits))
    assert (parts.T_part_input == np.eye(4)).all()
    assert parts.body.radius_mm == 25.0
    assert volumes(parts) == pytest.approx([5413.5], rel=1e-3)


def test_rounding_makes_no_plane_of_a_fine_cylinder():
    solid = cylinder(20, 0, 60, 300) + box((3, -2.5, 20), (50, 2.5, 40))
    assert decompose(mesh_of(solid, digits=2)).body.radius_mm == 20.0


@pytest.mark.slow
def test_a_part_far_from_the_origin_gets_no_further_sub_volume():
    near = decompose(mesh_of(shoulder()))
    far = decompose(mesh_of(shoulder(), turned(0, shift=(0, 0, 10_000)), digits=6))
    beyond = decompose(mesh_of(shoulder(), turned(0, shift=(10_000, -20_000, 5_000)), digits=6))
    for parts in (near, far, beyond):
        assert len(parts.sub_volumes) == 1
        assert parts.bodies[0].radius_mm == 30.0
        assert volumes(parts) == pytest.approx(volumes(near), rel=1e-5)
    assert beyond.body.axis_xy_mm == pytest.approx((10_000.0, -20_000.0), abs=1e-5)


def test_coordinates_of_two_decimals_leave_no_wedges():
    shaft = cylinder(25, 0, 40) + cylinder(20, 40, 80) + cylinder(15, 80, 120)
    parts = decompose(mesh_of(shaft + box((10, -3, 45), (50, 3, 75)), turned(20, (1, 1, 0)), digits=2))
    assert len(parts.sub_volumes) == 1
    assert parts.bodies[0].radius_mm == pytest.approx(20.0, abs=0.01)


def test_a_branch_is_cut_alike_however_it_is_tessellated_and_the_rival_is_told():
    cuts = []
    for sides in (48, 96):
        tee = cylinder(20, 0, 70, sides) + radial_cylinder(15, 0, 160, sides).translate((0, 0, 35))
        parts = decompose(mesh_of(tee))
        assert parts.body.radius_mm == pytest.approx(15.0, abs=1e-4)
        assert Code.BODY_RIVAL in codes(parts)
        cuts.append(volumes(parts)[0])
    assert cuts[0] == pytest.approx(cuts[1], rel=5e-3)


def test_an_exact_axis_is_used_as_it_stands_and_the_difference_told():
    solid = cylinder(20, 0, 60) + box((10, -4, 20), (40, 4, 40))
    mesh = mesh_of(solid, turned(0, shift=(0.05, 0, 0)))
    parts = decompose(mesh, BodyHint((0, 0, 0), (0, 0, 1), 20.0))
    assert parts.body.axis_xy_mm == (0.0, 0.0)
    assert Code.BODY_AXIS in codes(parts)
    assert len(parts.sub_volumes) == 1
    assert Code.BODY_AXIS not in codes(decompose(mesh_of(solid), BodyHint((0, 0, 0), (0, 0, 1), 20.0)))


def metamorphoses() -> dict[str, tuple[Mesh, float]]:
    part = cad_part(301)
    vertices, faces = part.vertices, part.faces
    rng = np.random.default_rng(1)
    solid = trimesh.Trimesh(vertices, faces, process=False)
    fine = solid.subdivide()
    order = rng.permutation(len(vertices))
    number = np.argsort(order)
    return {
        "as it is": (mesh_from_arrays("part", vertices, faces), 1.0),
        "turned": (mesh_from_arrays("part", vertices @ turned(50, (3, 1, -2))[:3, :3].T, faces), 1.0),
        "moved": (mesh_from_arrays("part", vertices + np.array([700.0, -300.0, 90.0]), faces), 1.0),
        "scaled": (mesh_from_arrays("part", vertices * 10, faces), 10.0),
        "refined": (mesh_from_arrays("part", fine.vertices, fine.faces), 1.0),
        "shuffled": (mesh_from_arrays("part", vertices[order], number[faces[rng.permutation(len(faces))]]), 1.0),
    }


@pytest.mark.slow
def test_the_same_part_otherwise_is_taken_apart_alike():
    first: Decomposition | None = None
    for name, (mesh, scale) in metamorphoses().items():
        parts = decompose(mesh)
        first = first or parts
        assert sorted(volumes(parts)) == pytest.approx(sorted(v * scale**3 for v in volumes(first)), rel=1e-4), name
        assert sorted(b.radius_mm for b in parts.bodies) == pytest.approx(
            sorted(b.radius_mm * scale for b in first.bodies), rel=1e-5
        ), name


@pytest.mark.slow
@pytest.mark.parametrize("kind", FORMATS)
def test_the_file_format_changes_nothing(kind, tmp_path):
    part = cad_part(308)
    parts = decompose(load_mesh(part.save(tmp_path, kind)))
    want = decompose(mesh_from_arrays("part", part.vertices, part.faces))
    assert volumes(parts) == pytest.approx(volumes(want), rel=1e-4)
    assert parts.body.radius_mm == pytest.approx(want.body.radius_mm, rel=1e-5)


def test_the_motion_to_the_part_frame_is_told(tmp_path: Path, capsys):
    from cell.cli.main import main

    solid = cylinder(20, 0, 60) + box((10, -4, 20), (40, 4, 40))
    motion = turned(90, (0, 1, 0), (0, 400, -250))
    mesh = mesh_of(solid, motion)
    trimesh.Trimesh(mesh.vertices, mesh.faces).export(tmp_path / "part.stl")
    assert main(["slice", str(tmp_path / "part.stl"), "--json", str(tmp_path / "o.json")]) == 0
    told = capsys.readouterr().out
    assert "turned by 90°" in told
    assert "cylinder of radius 20 mm" in told
    document = json.loads((tmp_path / "o.json").read_text())
    T = np.array(document["T_part_input"])
    assert T[:3, :3] @ T[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)
    # the first layer, put back on the model, lies on its cylinder about (y, z) = (400, -250)
    points = np.array(document["sub_volumes"][0]["layers"][0]["curves"][0]["points"])
    back = (points - T[:3, 3]) @ T[:3, :3]
    assert np.hypot(back[:, 1] - 400, back[:, 2] + 250) == pytest.approx(20.0, abs=1e-3)
    assert document["body"]["axis_direction"] == pytest.approx([1, 0, 0], abs=1e-6)
    assert document["body"]["share"] > 0.3
