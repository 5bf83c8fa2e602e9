"""A long boss with a wall hanging over its middle: some of its beads get through below it, some do not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import trimesh
import yaml

from cell.job.job import Job

from .boss_motion import job_of


def walled_boss(folder: Path, above_mm: float | None) -> Job:
    """The boss with a wall so far above it, between targets that are far apart; None: without the wall."""
    box = trimesh.creation.box((8.0, 30.0, 90.0))
    box.apply_translation((-43.0, 0.0, 60.0))
    box.export(folder / "boss.stl")
    content: dict[str, Any] = {
        "part": {"sub_volumes": ["boss.stl"], "body": {"radius_mm": 40, "z_mm": [0, 120]}},
        "support": {"radius_mm": 30, "height_mm": 100},
        "slicing": {"h_layer_mm": 2.2},
        "beads": {"pattern": "contour"},
        "positioner": {"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90]},
        "table": {"E1_deg": 90, "E2_deg": 180},
    }
    if above_mm is not None:
        wall = {"box": {"size_mm": [1000, 10, 800]}, "position_mm": [1500, 310, 397 + above_mm + 400]}
        content["fixtures"] = [{"name": "wall", **wall}]
    path = folder / f"{above_mm}.case.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return job_of(path)
