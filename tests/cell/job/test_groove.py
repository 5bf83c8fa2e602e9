"""In a groove the first bead of a layer lays metal on one side that is in the torch's way on the other."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

from cell.case.read import load_case
from cell.job.job import Job, prepare
from slicing import CylindricalBody, RevolvedBody

GROOVE = [[40, -60], [40, -30], [12, 0], [40, 30], [40, 60]]
BARREL = [[20, -60], [22, 0], [20, 60]]
THICK_MM = 6.0


def block(folder: Path, profile: list[list[int]]) -> Job:
    """A block on a body with a profile, in layers that follow it, each with one bead round its border."""
    solid = trimesh.creation.box((33, 10, 50))
    solid.apply_translation((20.5, 0, 0))
    solid.export(folder / "block.stl")
    case = {
        "part": {"sub_volumes": ["block.stl"], "body": {"profile_mm": profile}},
        "slicing": {"strategy": "revolved", "h_layer_mm": THICK_MM, "h_min_mm": 4, "h_max_mm": 8},
        "support": {"radius_mm": 10, "height_mm": 100},
    }
    path = folder / "block.case.yaml"
    path.write_text(yaml.safe_dump(case), encoding="utf-8")
    return prepare(load_case(path))


@pytest.mark.parametrize(("profile", "faces_itself"), [(GROOVE, True), (BARREL, False)])
def test_a_layer_counts_from_its_first_bead_on_where_that_stands_above_itself(tmp_path, profile, faces_itself):
    job = block(tmp_path, profile)
    t, layer = job.targets, job.laid - 1
    for number in (0, 1):
        rows = np.flatnonzero(layer == number)
        first = rows[t.bead[rows] == t.bead[rows[0]]]
        tops = t.position[first] + THICK_MM * t.normal[first]
        above = max(((tops[:k] - t.position[i]) @ t.normal[i]).max() for k, i in enumerate(first.tolist()) if k > 0)
        assert (above > 10.0) == faces_itself  # 6 mm of it is the bead's own thickness
        assert (job.deposits_before[first] == number + faces_itself).all()


def test_a_profile_has_grooves_where_it_turns_outwards_from_whichever_end_it_is_told() -> None:
    for profile, grooved in ((GROOVE, True), (BARREL, False), ([[20, 0], [20, 10], [30, 10], [30, 20]], True)):
        for told in (profile, profile[::-1]):
            assert RevolvedBody(tuple(map(tuple, told))).has_grooves == grooved
    assert not RevolvedBody(((20, 0), (20, 50))).has_grooves
    assert not CylindricalBody(20.0).has_grooves
