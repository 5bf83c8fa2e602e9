"""Planar sections of real meshes, as vendors draw them, against manifold3d's and trimesh's; and dirty ones among them.

The meshes are those that the package airo-models ships (robots, grippers, mobile platforms).
"""

from __future__ import annotations

import importlib.util
import os
import zlib
from pathlib import Path

import manifold3d
import numpy as np
import pytest
import trimesh

from slicing.curves.intersect import intersect
from slicing.mesh.load import load_mesh
from slicing.mesh.solid import Mesh, PartError
from slicing.surfaces.surfaces import Plane

FOUND = importlib.util.find_spec("airo_models")
pytestmark = pytest.mark.skipif(
    FOUND is None and not os.environ.get("CI"), reason="needs the meshes of the package airo-models"
)
ROOT = Path(next(iter(FOUND.submodule_search_locations or ["."]))) if FOUND else Path()

ARM, GRIPPER, BASE = "arms/ur5e/collision", "grippers/robotiq_2f_85/meshes", "mobile_platforms/kelo_robile/meshes"
CLEAN = {
    f"{ARM}/shoulder.obj": "m",
    f"{ARM}/upperarm.obj": "m",
    f"{ARM}/wrist1.obj": "m",
    f"{ARM}/wrist2.obj": "m",
    f"{ARM}/wrist3.obj": "m",
    f"{GRIPPER}/collision/robotiq_arg2f_85_base_link.stl": "m",
    f"{GRIPPER}/visual/robotiq_arg2f_85_inner_finger.obj": "mm",
    f"{GRIPPER}/visual/robotiq_arg2f_85_inner_knuckle.obj": "mm",
    f"{GRIPPER}/visual/robotiq_arg2f_85_outer_finger.obj": "mm",
    f"{GRIPPER}/visual/robotiq_gripper_coupling.stl": "mm",
    "grippers/fingertips/originals/robotiq_adapter.stl": "mm",
    "grippers/fingertips/originals/backing.stl": "mm",
    f"{BASE}/lid.obj": "m",
    f"{BASE}/lid_cover.obj": "m",
}
REPAIRED = {
    "grippers/fingertips/originals/camera_arduino_holder.stl": ("mm", "closed 6 open edges by joining vertices"),
    f"{BASE}/kelo_drive_wheel.obj": ("m", "united 3 shells that overlap"),
    f"{BASE}/kelo_drive_base.obj": ("m", "united 10 shells that overlap"),
}
REFUSED = {
    "arms/ur5e/visual/base.obj": "4 open edges round 1 hole, the widest 4.9 mm",
    "arms/ur5e/visual/wrist3.obj": "57 open edges round 1 hole",
    "grippers/schunk_egk40/meshes/EGK40-MB-M-B.obj": "2319 open edges",
}


def manifold(mesh: Mesh) -> manifold3d.Manifold:
    data = manifold3d.Mesh64(np.ascontiguousarray(mesh.vertices), np.ascontiguousarray(mesh.faces, dtype=np.uint64))
    return manifold3d.Manifold(data)


def turned(mesh: Mesh, rng: np.random.Generator) -> Mesh:
    """In any direction about its middle: no face lies along a plane across z."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn[:, 0] *= np.linalg.det(turn)
    return Mesh(mesh.name, (mesh.vertices - mesh.bounds.mean(axis=0)) @ turn.T, mesh.faces)


def compare(mesh: Mesh, heights: np.ndarray) -> None:
    solid, reference = manifold(mesh), trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    for z in heights:
        curves = intersect(mesh, Plane((0.0, 0.0, float(z)), (0.0, 0.0, 1.0)))
        area, length = sum(c.area_mm2 for c in curves), sum(c.length_mm for c in curves)
        theirs = solid.slice(float(z))
        assert area == pytest.approx(theirs.area(), rel=1e-6, abs=1e-6)
        loops = [c for c in curves if abs(c.area_mm2) > 1e-4]
        assert len(loops) == sum(
            abs(manifold3d.CrossSection([p]).area()) > 1e-4 or _hole(p) for p in theirs.to_polygons()
        )
        lines = trimesh.intersections.mesh_plane(reference, plane_normal=[0, 0, 1], plane_origin=[0, 0, z])
        assert length == pytest.approx(np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum(), rel=1e-6)
        section = reference.section(plane_origin=[0, 0, z], plane_normal=[0, 0, 1])
        assert area == pytest.approx(section.to_2D()[0].area, rel=1e-6)


def _hole(polygon: np.ndarray) -> bool:
    x, y = polygon.T
    return bool(0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() < -1e-4)


@pytest.mark.parametrize("name", CLEAN)
@pytest.mark.parametrize("straight", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_sections_agree_with_manifold3d_and_trimesh(name, straight):
    mesh = load_mesh(ROOT / name, CLEAN[name])
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    if not straight:
        mesh = turned(mesh, rng)
    compare(mesh, rng.uniform(*mesh.bounds[:, 2], 4))


@pytest.mark.parametrize("name", REPAIRED)
def test_repaired_meshes_are_solids(name):
    units, words = REPAIRED[name]
    mesh = load_mesh(ROOT / name, units)
    assert any(words in line for line in mesh.warnings)
    assert mesh.volume == pytest.approx(manifold(mesh).volume(), rel=1e-9)
    compare(mesh, np.random.default_rng(3).uniform(*mesh.bounds[:, 2], 4))


@pytest.mark.parametrize("name", REFUSED)
def test_what_no_repair_makes_a_solid_is_refused_with_its_place(name):
    with pytest.raises(PartError) as caught:
        load_mesh(ROOT / name, "m")
    assert REFUSED[name] in str(caught.value)
    assert "mm); a watertight solid is needed" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", list(CLEAN)[:3])
def test_a_mesh_that_is_spoilt_is_itself_again(name, tmp_path):
    """Faces turned, doubled and degenerate, vertices unused, a shell inside out, all at once."""
    mesh = load_mesh(ROOT / name, CLEAN[name])
    rng = np.random.default_rng(7)
    faces = np.where(rng.random(len(mesh.faces))[:, None] < 0.3, mesh.faces[:, ::-1], mesh.faces)
    doubled = faces[rng.choice(len(faces), 40, replace=False)]
    flat = np.repeat(rng.integers(0, len(mesh.vertices), (20, 1)), 3, axis=1)
    points = np.concatenate([mesh.vertices, rng.uniform(-1e4, 1e4, (5, 3))])
    solid = trimesh.Trimesh(
        points, np.concatenate([faces, doubled, flat])[rng.permutation(len(faces) + 60)], process=False
    )
    solid.export(tmp_path / "spoilt.ply")
    again = load_mesh(tmp_path / "spoilt.ply")
    assert len(again.warnings) >= 4
    assert again.volume == pytest.approx(mesh.volume, rel=1e-5)
    assert len(again.faces) == len(mesh.faces)
    assert np.allclose(again.bounds, mesh.bounds, atol=1e-3)
