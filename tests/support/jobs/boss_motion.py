"""A boss on a hub with its motion, for tests that look at motions."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from cell.case.read import load_case
from cell.job.job import Job, prepare
from cell.verdict.check import check_fixed
from cell.verdict.result import Result

from .cases import boss_mesh

# joint angles near the boss: of ways from there and back there is little to plan and to judge
NEAR_HOME = {"home_deg": [-20, -62, 85, 35, 72, -119]}


def boss_case(folder: Path, name: str = "boss", **sections: Any) -> Path:
    """Write a case of three layers; sections given take the place of its own."""
    boss_mesh().export(folder / "boss.stl")
    content = {
        "part": {"sub_volumes": ["boss.stl"], "body": {"radius_mm": 20, "z_mm": [0, 40]}},
        "support": {"radius_mm": 15, "height_mm": 100},
        "slicing": {"strategy": "cylindrical", "h_layer_mm": 2.2},
        "positioner": {"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90]},
        "table": {"E1_deg": 90, "E2_deg": 180},
        **sections,
    }
    path = folder / f"{name}.case.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def job_of(path: Path) -> Job:
    """The case, prepared."""
    return prepare(load_case(path))


def result_of(path: Path) -> Result:
    """The case, checked."""
    job = job_of(path)
    return check_fixed(job, job.case.table.E1_deg, job.case.table.E2_deg)
