"""Files of every kind that parts come in: the same solid whatever the kind, scenes, packages that are missing."""

from __future__ import annotations

import sys
import zipfile

import numpy as np
import pytest
import trimesh

from slicing.decomposition.decompose import decompose
from slicing.mesh.load import load_mesh
from slicing.mesh.solid import PartError


@pytest.fixture
def block() -> trimesh.Trimesh:
    return trimesh.creation.box(extents=(10, 20, 30))


def write_3mf(path, meshes, unit: str | None = "millimeter") -> None:
    """A minimal 3MF: an XML of vertices and triangles in a zip."""
    objects, items = [], []
    for k, mesh in enumerate(meshes, start=1):
        points = "".join(f'<vertex x="{x}" y="{y}" z="{z}"/>' for x, y, z in mesh.vertices)
        faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces)
        objects.append(
            f'<object id="{k}" type="model"><mesh><vertices>{points}</vertices>'
            f"<triangles>{faces}</triangles></mesh></object>"
        )
        items.append(f'<item objectid="{k}"/>')
    stated = f' unit="{unit}"' if unit else ""
    model = (
        f'<?xml version="1.0" encoding="UTF-8"?><model{stated} xml:lang="en-US"'
        ' xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
        f"<resources>{''.join(objects)}</resources><build>{''.join(items)}</build></model>"
    )
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("3D/3dmodel.model", model)


def assert_block(mesh) -> None:
    assert mesh.volume == pytest.approx(6000)
    assert np.allclose(mesh.bounds, [[-5, -10, -15], [5, 10, 15]])
    assert len(mesh.vertices) == 8
    assert mesh.warnings == ()


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj", "ply", "ply_ascii", "off", "glb"])
def test_the_same_solid_whatever_the_kind(block, tmp_path, kind):
    suffix, _, text = kind.partition("_")
    path = tmp_path / f"block.{suffix}"
    if kind == "ply_ascii":
        path.write_bytes(block.export(file_type="ply", encoding="ascii"))
    else:
        block.export(path, file_type=kind)
    assert (b"\0" in path.read_bytes()) == (not text and suffix in ("stl", "ply", "glb"))
    assert_block(load_mesh(path))


def test_suffix_in_capitals(block, tmp_path):
    block.export(tmp_path / "BLOCK.STL", file_type="stl")
    assert_block(load_mesh(tmp_path / "BLOCK.STL"))


def test_meshes_of_a_scene_are_put_in_place_and_taken_together(block, tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(block)
    scene.add_geometry(block, transform=trimesh.transformations.translation_matrix([40, 0, 0]))
    scene.export(tmp_path / "two.glb")
    mesh = load_mesh(tmp_path / "two.glb")
    assert mesh.volume == pytest.approx(12000)
    assert np.allclose(mesh.bounds, [[-5, -10, -15], [45, 10, 15]])


def test_a_scene_whose_meshes_close_each_other(block, tmp_path):
    scene = trimesh.Scene()
    for part in (range(4), range(4, 12)):  # as a viewer's file has it: one mesh a colour
        scene.add_geometry(block.submesh([list(part)], append=True, repair=False))
    scene.export(tmp_path / "colours.glb")
    assert_block(load_mesh(tmp_path / "colours.glb"))


def test_a_scene_that_stays_open_is_refused(block, tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(block)
    scene.add_geometry(trimesh.Trimesh(block.vertices + np.array([40.0, 0, 0]), block.faces[:-1], process=False))
    scene.export(tmp_path / "open.glb")
    with pytest.raises(PartError, match=r"open\.glb: the mesh is not closed") as caught:
        load_mesh(tmp_path / "open.glb")
    assert "3 open edges" in str(caught.value)


def test_a_scene_of_body_and_sub_volumes_decomposes(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(trimesh.creation.cylinder(20, 60, sections=96))
    for x in (-25, 25):  # they reach into the body
        scene.add_geometry(
            trimesh.creation.box(extents=(20, 10, 12)),
            transform=trimesh.transformations.translation_matrix([x, 0, 0]),
        )
    scene.export(tmp_path / "scene.glb")
    parts = decompose(load_mesh(tmp_path / "scene.glb"))
    assert parts.body.radius_mm == 20.0
    assert [mesh.name for mesh in parts.sub_volumes] == ["SV1", "SV2"]
    assert parts.sub_volumes[0].vertices[:, 0].mean() > 0  # from +x counter-clockwise


@pytest.mark.parametrize("unit", ["millimeter", None])
def test_3mf(block, tmp_path, unit):
    write_3mf(tmp_path / "block.3mf", [block], unit)
    assert_block(load_mesh(tmp_path / "block.3mf"))


def test_3mf_of_several_meshes(block, tmp_path):
    other = block.copy().apply_translation([40, 0, 0])
    write_3mf(tmp_path / "two.3mf", [block, other])
    assert load_mesh(tmp_path / "two.3mf").volume == pytest.approx(12000)


def test_3mf_states_its_unit(block, tmp_path):
    write_3mf(tmp_path / "inch.3mf", [block], "inch")
    assert load_mesh(tmp_path / "inch.3mf", units="inch").volume == pytest.approx(6000 * 25.4**3)
    with pytest.raises(PartError, match="set units: inch"):
        load_mesh(tmp_path / "inch.3mf")
    write_3mf(tmp_path / "foot.3mf", [block], "foot")
    with pytest.raises(PartError, match="allowed: mm, cm, m, inch"):
        load_mesh(tmp_path / "foot.3mf")


def test_3mf_needs_no_further_package(block, tmp_path, monkeypatch):
    for package in ("networkx", "lxml"):
        monkeypatch.setitem(sys.modules, package, None)
    write_3mf(tmp_path / "block.3mf", [block])
    assert_block(load_mesh(tmp_path / "block.3mf"))


def test_other_kinds_are_refused_with_those_that_are_allowed(tmp_path):
    (tmp_path / "part.step").write_text("ISO-10303-21;")
    with pytest.raises(PartError, match=r"allowed: \.stl, \.obj, \.ply, \.off, \.3mf, \.glb"):
        load_mesh(tmp_path / "part.step")
