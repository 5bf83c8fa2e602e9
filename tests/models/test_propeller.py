"""The propeller: what the paper gives of it, held by means that do not use the slicer."""

import runpy
import subprocess
import sys

import numpy as np
import pytest
import trimesh
from support.paths import ROOT

PARTS = ROOT / "models" / "parts"
NAMES = ("propeller", "propeller_hub", "propeller_blade")


@pytest.fixture(scope="module")
def meshes():
    return {name: trimesh.load_mesh(PARTS / f"{name}.stl") for name in NAMES}


@pytest.fixture(scope="module")
def builder():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(PARTS)  # as when it is run as a script
        return runpy.run_path(str(PARTS / "propeller.py"))


@pytest.mark.slow
def test_the_shipped_meshes_are_what_the_builder_makes(meshes, tmp_path):
    script = [sys.executable, str(PARTS / "propeller.py"), "--out", str(tmp_path)]
    subprocess.run(script, check=True, capture_output=True)
    for name in NAMES:
        built = trimesh.load_mesh(tmp_path / f"{name}.stl")
        assert np.allclose(built.bounds, meshes[name].bounds, atol=1e-4)
        assert built.volume == pytest.approx(meshes[name].volume, rel=1e-6)


@pytest.mark.parametrize("name", NAMES)
def test_every_mesh_is_a_closed_solid(meshes, name):
    assert meshes[name].is_watertight
    assert meshes[name].is_winding_consistent
    assert meshes[name].volume > 0


def test_the_whole_has_the_papers_bounding_box(meshes):
    assert np.allclose(meshes["propeller"].extents, [82.6, 80.7, 43.2], atol=0.05)


def test_the_root_lies_on_the_hub_inside_its_height(meshes, builder):
    radius = builder["Propeller"]().hub_radius
    v = meshes["propeller_blade"].vertices
    r = np.hypot(v[:, 0], v[:, 1])
    root = np.abs(r - radius) < 1e-5
    assert root.sum() == builder["AROUND"]
    assert r.min() == pytest.approx(radius, abs=1e-5)
    assert v[:, 2].min() > 5
    assert v[:, 2].max() < 38.2


def test_the_footprint_is_the_papers_adhesion_area(meshes, builder):
    radius = builder["Propeller"]().hub_radius
    v = meshes["propeller_blade"].vertices
    root = v[np.abs(np.hypot(v[:, 0], v[:, 1]) - radius) < 1e-5]
    arc = radius * np.arctan2(root[:, 0], -root[:, 1])  # unrolled about the blade's direction
    flat = np.column_stack([arc, root[:, 2]])
    middle = flat.mean(axis=0)
    flat = flat[np.argsort(np.arctan2(*(flat - middle).T[::-1]))]
    x, y = flat.T
    area = 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))
    assert area == pytest.approx(25.37, rel=0.01)


def test_nineteen_cylinders_cut_the_blade(meshes, builder):
    radius = builder["Propeller"]().hub_radius
    v = meshes["propeller_blade"].vertices
    tip = np.hypot(v[:, 0], v[:, 1]).max()
    assert int(np.floor((tip - radius) / 1.73)) + 1 == 19


def test_blade_and_hub_are_parts_of_the_whole(meshes):
    whole, hub, blade = (meshes[name].volume for name in NAMES)
    # five blades less what of their chords lies inside the hub's polygon
    assert whole == pytest.approx(hub + 5 * blade, rel=2e-3)
