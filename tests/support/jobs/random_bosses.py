"""Small random parts in random cells."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import trimesh
import yaml


def random_case(rng: np.random.Generator, folder: Path, name: str = "case", **sections: Any) -> Path:
    """A boss on a hub on a table somewhere about the arm, with some boxes in the way; sections given are merged in."""
    radius, height = rng.uniform(15, 50), rng.uniform(30, 120)
    length, width, rise = rng.uniform(8, 40), rng.uniform(6, 14), rng.uniform(4, 12)
    box = trimesh.creation.box((rise + 6.0, width, length))
    box.apply_translation((-(radius - 6.0 + (rise + 6.0) / 2), 0.0, height / 2))
    box.export(folder / "boss.stl")
    window = {"fixed_deg": round(rng.uniform(-180, 180))}
    low = round(rng.uniform(-180, 90))
    roll: Any = ("free", "free", window, {"range_deg": [low, low + round(rng.uniform(10, 120))]})[rng.integers(4)]
    at = [float(rng.uniform(900, 1600)), float(rng.uniform(-400, 400)), float(rng.uniform(0, 500))]
    fixtures = [
        {
            "name": f"box{k}",
            "box": {"size_mm": rng.uniform(30, 250, 3).round().tolist()},
            "position_mm": [
                float(at[0] + rng.uniform(-500, 300)),
                float(at[1] + rng.uniform(-400, 400)),
                float(at[2] + rng.uniform(100, 1100)),
            ],
        }
        for k in range(rng.integers(0, 7))
    ]
    case: dict[str, Any] = {
        "part": {"sub_volumes": ["boss.stl"], "body": {"radius_mm": float(radius), "z_mm": [0, float(height)]}},
        "support": {"radius_mm": float(0.8 * radius), "height_mm": float(rng.uniform(60, 250))},
        "slicing": {"h_layer_mm": 2.5, "h_min_mm": 2, "h_max_mm": 3.2},
        "sampling": {"min_segment_mm": float(rng.uniform(2, 8)), "chord_tolerance_mm": float(rng.uniform(0.1, 1.0))},
        "positioner": {
            "position_mm": at,
            "rotation_deg": [0, 0, float(rng.uniform(-180, 180))],
        },
        "tool": {"dimensions": {"neck_angle_deg": float(rng.choice([0, 22, 45]))}},
        "table": {"E1_deg": float(rng.uniform(-20, 110)), "E2_deg": float(rng.uniform(-180, 180))},
        "roll": roll,
        "process": {
            "deposition_speed_mm_s": float(rng.uniform(4, 15)),
            "retract_mm": float(rng.choice([20, 30, 50, 150])),
            "least_speed_share": float(rng.choice([0.0, 0.5])),
        },
        "fixtures": fixtures,
    }
    for key, value in sections.items():
        case[key] = {**case[key], **value} if isinstance(case.get(key), dict) else value
    path = folder / f"{name}.case.yaml"
    path.write_text(yaml.safe_dump(case), encoding="utf-8")
    return path
