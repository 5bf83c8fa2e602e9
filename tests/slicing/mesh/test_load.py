"""Reading solids: what is repaired, what is warned of, and what is refused in one line."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from support.parts.meshes import box

from slicing.mesh.load import load_mesh
from slicing.mesh.solid import PartError, mesh_from_arrays


def refusal(call, *args, **kwargs) -> str:
    with pytest.raises(PartError) as caught:
        call(*args, **kwargs)
    line = str(caught.value)
    assert "\n" not in line
    return line


@pytest.fixture
def cube() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=(10, 20, 30))


@pytest.mark.parametrize("kind", ["stl", "obj", "ply", "off"])
def test_every_kind_gives_the_same_solid(cube, tmp_path, kind):
    cube.export(tmp_path / f"cube.{kind}")
    mesh = load_mesh(tmp_path / f"cube.{kind}")
    assert mesh.name == "cube"
    assert len(mesh.vertices) == 8
    assert len(mesh.faces) == 12
    assert mesh.volume == pytest.approx(6000)
    assert mesh.warnings == ()
    assert np.allclose(mesh.bounds, [[-5, -10, -15], [5, 10, 15]])


@pytest.mark.parametrize(("units", "scale"), [("mm", 1), ("cm", 10), ("m", 1000), ("inch", 25.4)])
def test_units(cube, tmp_path, units, scale):
    cube.export(tmp_path / "cube.stl")
    assert load_mesh(tmp_path / "cube.stl", units).volume == pytest.approx(6000 * scale**3, rel=1e-6)


def test_bad_files_are_refused_in_one_line(cube, tmp_path):
    assert "no such file" in refusal(load_mesh, tmp_path / "none.stl")
    assert "not a file" in refusal(load_mesh, tmp_path)
    cube.export(tmp_path / "cube.stl")
    assert "mm, cm, m, inch" in refusal(load_mesh, tmp_path / "cube.stl", units="furlong")
    (tmp_path / "empty.stl").write_bytes(b"")
    assert "empty" in refusal(load_mesh, tmp_path / "empty.stl")
    (tmp_path / "text.stl").write_text("solid nothing\nendsolid\n")
    assert "text.stl" in refusal(load_mesh, tmp_path / "text.stl")
    (tmp_path / "noise.stl").write_bytes(bytes(range(256)) * 3)
    assert "noise.stl" in refusal(load_mesh, tmp_path / "noise.stl")
    (tmp_path / "noise.ply").write_bytes(bytes(range(256)) * 3)
    assert "noise.ply" in refusal(load_mesh, tmp_path / "noise.ply")
    cut = (tmp_path / "cube.stl").read_bytes()[:300]
    (tmp_path / "cut.stl").write_bytes(cut)
    assert "cut.stl" in refusal(load_mesh, tmp_path / "cut.stl")
    (tmp_path / "part.step").write_text("ISO-10303-21;")
    assert "unknown kind" in refusal(load_mesh, tmp_path / "part.step")


def test_open_mesh_says_how_many_edges(cube, tmp_path):
    trimesh.Trimesh(cube.vertices, cube.faces[:-1], process=False).export(tmp_path / "open.stl")
    line = refusal(load_mesh, tmp_path / "open.stl")
    assert "3 open edges" in line
    assert "open.stl" in line


def test_numbers_that_are_none(cube, tmp_path):
    vertices = cube.vertices.copy()
    vertices[3, 1] = np.nan
    assert "not finite" in refusal(mesh_from_arrays, "x", vertices, cube.faces)
    trimesh.Trimesh(vertices, cube.faces, process=False).export(tmp_path / "nan.stl")
    assert "not finite" in refusal(load_mesh, tmp_path / "nan.stl")


def test_bad_arrays_are_refused(cube):
    assert "empty" in refusal(mesh_from_arrays, "x", np.zeros((0, 3)), np.zeros((0, 3)))
    assert "outside" in refusal(mesh_from_arrays, "x", cube.vertices, cube.faces + 1)
    assert "degenerate" in refusal(mesh_from_arrays, "x", cube.vertices, [[0, 0, 1]])
    flat = cube.vertices * [1, 1, 0]
    assert "no volume" in refusal(mesh_from_arrays, "x", flat, cube.faces)


def test_inside_out_is_turned_and_said(cube):
    mesh = mesh_from_arrays("x", cube.vertices, cube.faces[:, ::-1])
    assert mesh.volume == pytest.approx(6000)
    assert "inside out" in mesh.warnings[0]


def test_faces_that_disagree_are_turned_and_said(cube):
    faces = cube.faces.copy()
    faces[[1, 4, 7]] = faces[[1, 4, 7], ::-1]
    mesh = mesh_from_arrays("x", cube.vertices, faces)
    assert mesh.volume == pytest.approx(6000)
    assert "disagreed" in mesh.warnings[0]


def test_suspicious_size_names_the_likely_unit(cube, tmp_path):
    assert "m or inch" in mesh_from_arrays("x", cube.vertices / 1000, cube.faces).warnings[0]
    assert "scaled" in mesh_from_arrays("x", cube.vertices * 1000, cube.faces).warnings[0]
    trimesh.Trimesh(cube.vertices / 375, cube.faces).export(tmp_path / "cube.stl")  # 0.08 long
    (line,) = load_mesh(tmp_path / "cube.stl").warnings
    assert "extent 0.08 mm; is the file in cm, m or inch? (units: m would make it 80 mm)" in line
    trimesh.Trimesh(cube.vertices / 0.375, cube.faces).export(tmp_path / "cube.stl")
    (line,) = load_mesh(tmp_path / "cube.stl", units="m").warnings  # 80 m
    assert "extent 8e+04 mm; is the file in mm, cm or inch? (units: mm would make it 80 mm)" in line


def test_noise_is_single_precision_only_for_single_precision_numbers():
    plain = box((10.125, -6, -8), (40, 6, 8))
    assert plain.noise_mm == pytest.approx(np.spacing(np.float32(40.0)))
    assert mesh_from_arrays("x", plain.vertices * 1.1, plain.faces).noise_mm == 1e-6
