"""Cases of a table that indexes, small enough for tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

from cell.case.read import load_case, parse_case
from cell.case.sections import Case
from support.cases import at, bosses, turned


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
