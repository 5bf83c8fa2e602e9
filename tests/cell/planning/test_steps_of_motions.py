"""How far rows of a motion are apart at most, as the README says: 16 mm and 2 degrees."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
import yaml

from cell.case.read import load_case
from cell.job.job import prepare
from cell.shipped import DEFAULT_CASE
from cell.verdict.check import check

LONG_MM = 120.0


def test_rows_of_long_straight_beads_are_no_further_apart_than_is_said(tmp_path: Path) -> None:
    plate = trimesh.creation.box((8.0, LONG_MM, 30.0))
    plate.apply_translation((-42.0, 0.0, 60.0))
    plate.export(tmp_path / "plate.stl")
    case = {
        "part": {"sub_volumes": ["plate.stl"], "body": {"radius_mm": 40, "z_mm": [0, 120]}},
        "slicing": {"strategy": "planar", "h_layer_mm": 2, "h_min_mm": 1, "h_max_mm": 3},
        "support": {"radius_mm": 30, "height_mm": 100},
        "positioner": {"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90]},
        "table": {"E1_deg": 90, "E2_deg": 180},
    }
    path = tmp_path / "plate.case.yaml"
    path.write_text(yaml.safe_dump(case), encoding="utf-8")
    way, turn, welding = steps(path)
    assert 8e-3 < way[welding].max() <= 16e-3
    assert turn[welding].max() <= 2.0
    assert turn[~welding].max() <= 1.0


def test_rows_round_a_hub_are_no_further_apart_than_is_said() -> None:
    way, turn, welding = steps(DEFAULT_CASE)
    assert way[welding].max() <= 16e-3
    assert 1.0 < turn[welding].max() <= 2.0
    assert turn[~welding].max() <= 1.0


def steps(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of each step of a motion: way of the TCP, m, greatest turn of a joint, deg, and whether it welds."""
    job = prepare(load_case(path))
    motion = check(job, job.case.table.E1_deg, job.case.table.E2_deg).motion
    assert motion is not None
    way = np.linalg.norm(np.diff(job.scene.chain.forward(motion.q)[:, :3, 3], axis=0), axis=1)
    turn = np.rad2deg(np.abs(np.diff(motion.q, axis=0)).max(axis=1))
    return way - 1e-9, turn - 1e-6, motion.welding  # less rounding
