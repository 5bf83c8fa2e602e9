"""A body alone can be built; pictures and comparisons are of the beads that are laid."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import trimesh
from support.parts.meshes import BODY, box

from cell.case.read import load_case
from cell.cli.main import main
from cell.compare.compare import compare_case
from cell.view.layer_picture import _Scale, slice_picture
from slicing.beads.lay import lay_beads
from slicing.parameters import BeadParameters, SlicingParameters
from slicing.strategies.slice import slice_sub_volume


@pytest.mark.parametrize(
    "part", ["{mesh: disc.stl}", "{body: {radius_mm: 40, z_mm: [0, 12]}, take: [BODY]}"], ids=["mesh", "told"]
)
def test_a_disc_on_the_plate_is_sliced_by_itself(tmp_path, part):
    disc = trimesh.creation.cylinder(40, 12, sections=96)
    disc.apply_translation((0, 0, 6))
    disc.export(tmp_path / "disc.stl")
    case = tmp_path / "disc.case.yaml"
    process = "{density_g_cm3: 2.7, wire_diameter_mm: 1.6}"
    case.write_text(f"part: {part}\nslicing: {{body: planar}}\nbeads: {{pattern: zigzag}}\nprocess: {process}\n")
    assert main(["slice", str(case), "--json", str(tmp_path / "o.json"), "--quiet"]) == 0
    (body,) = json.loads((tmp_path / "o.json").read_text())["sub_volumes"]
    assert body["name"] == "BODY"
    assert len(body["layers"]) == 7
    assert body["indices"]["A_mm2"] == pytest.approx(math.pi * 1600, rel=2e-3)
    metal = body["metal"]
    assert metal["wanted_mm3"] == pytest.approx(sum(layer["area_mm2"] for layer in body["layers"]) * 1.73)
    assert metal["mass_g"] == pytest.approx(metal["laid_mm3"] * 2.7e-3)
    assert metal["wire_m"] == pytest.approx(metal["laid_mm3"] / (math.pi * 0.64) * 1e-3)
    assert max(one["out_mm"] for one in body["overhangs"]) < 1e-3


def test_a_body_alone_needs_its_ends(tmp_path, capsys):
    case = tmp_path / "a.case.yaml"
    case.write_text("part: {body: {radius_mm: 40}}\nslicing: {body: planar}\n")
    assert main(["slice", str(case)]) == 2
    assert "part.body.z_mm" in capsys.readouterr().err
    case.write_text("part: {body: {radius_mm: 40, z_mm: [0, 12]}}\n")  # there from the start, and nothing on it
    assert main(["slice", str(case)]) == 2


def test_pictures_show_the_beads_that_are_laid():
    sliced = slice_sub_volume(box((10, -12, -12), (30, 12, 12)), BODY, SlicingParameters())
    pictures = [
        slice_picture([sliced], None, title="boss", width=300, height=240, laid=lay_beads([sliced], BeadParameters(p)))
        for p in ("contour", "contour_parallel", "zigzag")
    ]
    assert len(set(pictures)) == 3
    assert all(math.copysign(1.0, tick) == 1.0 for tick in _Scale(0.0, 21.0, np.zeros((2, 3)), "layer").ticks())


def test_a_comparison_counts_the_targets_of_the_beads_that_are_laid(make_case, tmp_path):
    case = load_case(make_case(beads={"pattern": "zigzag", "width_mm": 3.0}))
    (found,) = compare_case(case)
    assert main(["slice", str(case.path), "--json", str(tmp_path / "o.json"), "--quiet"]) == 0
    (sliced,) = json.loads((tmp_path / "o.json").read_text())["sub_volumes"]
    (ours,) = [row for row in found.rows if row.strategy == "nonuniform"]
    assert ours.indices is not None
    assert ours.indices.to_dict() == pytest.approx(sliced["indices"])
    assert ours.metal_share == pytest.approx(sliced["metal"]["share"])
    assert ours.overhang_deg == pytest.approx(max(one["angle_deg"] for one in sliced["overhangs"]))
