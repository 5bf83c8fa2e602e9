"""Cases of a table that indexes, small enough for tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import trimesh
import yaml

from cell.case.read import load_case, parse_case
from cell.case.sections import Case

from .cases import at, bosses, turned


def three_bosses(folder: Path, **sections: Any) -> Path:
    """Three low boxes a third of a turn apart on a post; sections given take the place of its own."""
    meshes = [turned(at(40, height=2.4), angle) for angle in (0.0, 120.0, 240.0)]
    content = {
        "part": bosses(folder, *meshes, length=80),
        "support": {"radius_mm": 18, "height_mm": 100},
        "positioner": {"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90]},
        "slicing": {"h_layer_mm": 2.2},
        "table": {"mode": "indexed"},
        **sections,
    }
    path = folder / "three.case.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def with_table(case: Case, table: dict[str, Any], **sections: Any) -> Case:
    """The case with another table, read anew from its file."""
    content = yaml.safe_load(case.path.read_text(encoding="utf-8"))
    return parse_case({**content, "table": table, **sections}, case.path)


def three_case(folder: Path, **sections: Any) -> Case:
    """As a case."""
    return load_case(three_bosses(folder, **sections))


def backwards(folder: Path) -> Case:
    """The three bosses at given poses, the last of them built first."""
    case = three_case(folder)
    angles = {"SV1": 0.0, "SV2": -120.0, "SV3": 120.0}
    poses = [{"sub_volume": name, "E1_deg": -90.0, "E2_deg": E2_deg} for name, E2_deg in reversed(angles.items())]
    return with_table(case, {"mode": "indexed", "poses": poses})


def corner(folder: Path, *, face_first: bool = False, take: str | None = None) -> Path:
    """A block on a shaft and one on the face beside it, each in the corner that the torch needs at the other.

    The nozzle is 32 mm wide. At the block on the shaft it passes the face by some 7 mm, of which the first layer of the
    other block, 6 mm, leaves too little; at the block on the face it passes the shaft by 8 mm, likewise. Alone, either
    can be built.
    """
    shaft, face = trimesh.creation.box((16, 8, 8)), trimesh.creation.box((8, 8, 16))
    shaft.apply_translation((-24, 0, 45))
    face.apply_translation((-44, 0, 20))
    shaft.export(folder / "shaft.stl")
    face.export(folder / "face.stl")
    names = ["face.stl", "shaft.stl"] if face_first else ["shaft.stl", "face.stl"]
    content = {
        "part": {
            "sub_volumes": names if take is None else [take],
            "body": {"profile_mm": [[80, 0], [80, 10], [20, 20], [20, 90]]},
        },
        "support": {"radius_mm": 18, "height_mm": 200},
        "positioner": {"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90]},
        "slicing": {"strategy": "revolved", "h_layer_mm": 6.0, "h_min_mm": 6.0, "h_max_mm": 6.0},
        "tool": {"dimensions": {"nozzle_tip_radius_mm": 16, "nozzle_radius_mm": 16}},
        "table": {"mode": "indexed"},
    }
    path = folder / "corner.case.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path
