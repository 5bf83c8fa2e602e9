"""Support, boiler and valve: what the paper gives of them, held by means that do not use the slicer."""

import runpy
import subprocess
import sys
from dataclasses import dataclass

import numpy as np
import pytest
import trimesh
import yaml
from support.paths import ROOT

PARTS = ROOT / "models" / "parts"
PAPER = yaml.safe_load((PARTS / "paper_tables.yaml").read_text(encoding="utf-8"))
H_LAYER = PAPER["parameters"]["h_layer_mm"]
LARGEST_FILE = 500_000


@dataclass(frozen=True)
class SubVolume:
    """part, file, area of the footprint (mm2) and layers of uniform cylindrical slicing, as in the paper."""

    part: str
    file: str
    towards: int  # axis it points along, 0 for x, 1 for y
    area: float
    layers: int

    @property
    def mesh(self):
        return trimesh.load_mesh(PARTS / f"{self.file}.stl")

    @property
    def radius(self):
        return PAPER["parts"][self.part]["body_radius_mm"]


SUB_VOLUMES = [
    SubVolume("support", "support_sv1", 1, 233.88, 31),
    SubVolume("support", "support_sv2", 1, 272.86, 15),
    SubVolume("support", "support_sv3", 1, 247.45, 5),
    SubVolume("boiler", "boiler_sv1", 1, 315.76, 11),
    SubVolume("boiler", "boiler_sv2", 1, 2623.23, 54),
    SubVolume("valve", "valve_sv1", 0, 1274.80, 69),
]
FILES = {
    "support": ("support", "support_body", "support_sv1", "support_sv2", "support_sv3"),
    "boiler": ("boiler", "boiler_body", "boiler_sv1", "boiler_sv2"),
    "valve": ("valve", "valve_body", "valve_sv1"),
}
each_sub_volume = pytest.mark.parametrize("sv", SUB_VOLUMES, ids=lambda sv: sv.file)


@pytest.mark.slow
@pytest.mark.parametrize("part", FILES)
def test_the_shipped_meshes_are_what_the_builder_makes(part, tmp_path):
    subprocess.run([sys.executable, str(PARTS / f"{part}.py"), "--out", str(tmp_path)], check=True, capture_output=True)
    assert sorted(path.stem for path in tmp_path.iterdir()) == sorted(FILES[part])
    for name in FILES[part]:
        built, shipped = (trimesh.load_mesh(folder / f"{name}.stl") for folder in (tmp_path, PARTS))
        assert np.allclose(built.bounds, shipped.bounds, atol=1e-4)
        assert built.volume == pytest.approx(shipped.volume, rel=1e-6)


@pytest.mark.parametrize("name", [name for names in FILES.values() for name in names])
def test_every_mesh_is_one_closed_solid_of_modest_size(name):
    mesh = trimesh.load_mesh(PARTS / f"{name}.stl")
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    assert mesh.body_count == 1
    assert (PARTS / f"{name}.stl").stat().st_size < LARGEST_FILE


@pytest.mark.parametrize("part", FILES)
def test_the_whole_has_the_papers_bounding_box(part):
    whole = trimesh.load_mesh(PARTS / f"{part}.stl")
    assert np.allclose(whole.extents, PAPER["parts"][part]["bounding_box_mm"], atol=0.05)


@pytest.mark.parametrize("part", FILES)
def test_the_body_is_the_builders_and_the_tables(part, monkeypatch):
    monkeypatch.syspath_prepend(PARTS)  # as when it is run as a script
    builder = runpy.run_path(str(PARTS / f"{part}.py"))
    assert builder[part.capitalize()]().radius == PAPER["parts"][part]["body_radius_mm"]


@pytest.mark.parametrize("part", FILES)
def test_body_and_sub_volumes_are_the_whole(part):
    whole, *pieces = (trimesh.load_mesh(PARTS / f"{name}.stl").volume for name in FILES[part])
    # the body's polygon lies a little inside its cylinder, on which the roots lie
    assert whole == pytest.approx(sum(pieces), rel=2e-4)


def root_edges(sv):
    """Ends (k, 2, 3) of the edges that lie on the cylinder and end the sides: where the footprint ends.

    Of the two faces at such an edge one is the root's (all corners on the cylinder), the other a side's.
    """
    mesh = sv.mesh
    on_body = np.abs(np.hypot(mesh.vertices[:, 0], mesh.vertices[:, 1]) - sv.radius) < 1e-4
    root = on_body[mesh.faces].all(axis=1)
    edge = root[mesh.face_adjacency].sum(axis=1) == 1
    return mesh.vertices[mesh.face_adjacency_edges[edge]]


@each_sub_volume
def test_the_root_lies_on_the_body_within_its_height(sv):
    v = sv.mesh.vertices
    r = np.hypot(v[:, 0], v[:, 1])
    assert r.min() == pytest.approx(sv.radius, abs=1e-4)
    body = trimesh.load_mesh(PARTS / f"{sv.part}_body.stl").bounds[:, 2]
    assert body[0] + 5 < v[:, 2].min()
    assert v[:, 2].max() < body[1] - 5


@each_sub_volume
def test_the_footprint_is_the_papers_adhesion_area(sv):
    a, b = root_edges(sv).transpose(1, 0, 2)
    # unrolled about the sub-volume's direction; sorted loops are not needed: bands of z between the borders
    turn = (lambda p: np.arctan2(p[:, 1], p[:, 0])) if sv.towards == 0 else (lambda p: np.arctan2(p[:, 0], p[:, 1]))
    sa, sb, za, zb = sv.radius * turn(a), sv.radius * turn(b), a[:, 2], b[:, 2]
    lines = np.linspace(min(sa.min(), sb.min()), max(sa.max(), sb.max()), 4001)
    lines = 0.5 * (lines[:-1] + lines[1:])
    inside = 0.0
    for s in lines:
        cut = (sa - s) * (sb - s) < 0
        z = np.sort(za[cut] + (s - sa[cut]) / (sb[cut] - sa[cut]) * (zb[cut] - za[cut]))
        assert len(z) % 2 == 0
        inside += (z[1::2] - z[::2]).sum()
    area = inside * (lines[1] - lines[0])
    assert area == pytest.approx(sv.area, rel=2e-3)


@each_sub_volume
def test_as_many_cylinders_cut_it_as_in_the_paper(sv):
    v = sv.mesh.vertices
    top = np.hypot(v[:, 0], v[:, 1]).max()
    assert int(np.floor((top - sv.radius) / H_LAYER)) + 1 == sv.layers


@each_sub_volume
def test_its_end_is_flat(sv):
    mesh = sv.mesh
    far = mesh.bounds[1, sv.towards]
    end = mesh.triangles_center[:, sv.towards] > far - 1e-3
    assert end.any()
    assert np.allclose(mesh.face_normals[end][:, sv.towards], 1.0, atol=1e-6)


@each_sub_volume
def test_the_numbers_are_those_of_the_paper(sv):
    row = PAPER["rows"][f"{sv.part}/{sv.file.removeprefix(sv.part + '_').upper()}"]
    assert (row["NL"][1], row["A"][1]) == (sv.layers, sv.area)
