"""A program against a cell without a part: what can be looked at is, and what cannot is said."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import yaml
from support.programs.boss_program import boss_program

from cell.cli.main import main

CELL = {
    "part": "none",
    "support": {"radius_mm": 15, "height_mm": 100},
    "positioner": {"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90]},
    "table": {"E1_deg": 90, "E2_deg": 180},
}

# between the boss and home
POST = {"name": "post", "box": {"size_mm": [16, 16, 460]}, "position_mm": [1540, 298, 230]}


def written(folder: Path, **sections: Any) -> tuple[Path, Path]:
    """A case and the boss' program beside it."""
    case = folder / "cell.case.yaml"
    case.write_text(yaml.safe_dump({**CELL, **sections}))
    for name, text in boss_program().made.files.items():
        (folder / name).write_bytes(text.encode())
    return case, folder / "boss.src"


def test_a_cell_without_a_part_holds_a_program(tmp_path: Path) -> None:
    case, program = written(tmp_path)
    assert main(["check", str(case), "--program", str(program), "--json", str(tmp_path / "r.json")]) == 0
    report = json.loads((tmp_path / "r.json").read_text())
    assert (report["verdict"], report["targets"], report["off_bead"]) == ("feasible", 0, None)
    codes = [one["code"] for one in report["typed_warnings"]]
    assert codes[0] == "part_absent"


@pytest.mark.parametrize(
    ("sections", "reason"),
    [
        # where the torch draws back from the boss
        (
            {"fixtures": [POST]},
            "collision",
        ),
        pytest.param({"checks": {"elbow_deg": 80}}, "singular", marks=pytest.mark.slow),
        ({"tool": {"dimensions": {"stick_out_mm": 25}}}, "tool"),
        pytest.param({"robot": {"max_acceleration_deg_s2": [1, 1, 1, 1, 1, 1]}}, None, marks=pytest.mark.slow),
    ],
)
def test_what_is_wrong_in_the_cell_is_found_with_its_line(
    sections: dict[str, Any], reason: str | None, tmp_path: Path
) -> None:
    case, program = written(tmp_path, **sections)
    code = main(["check", str(case), "--program", str(program), "--json", str(tmp_path / "r.json")])
    report = json.loads((tmp_path / "r.json").read_text())
    found = {finding["reason"] for finding in report["findings"]}
    if reason is None:  # slower axes slow the program down, and nothing asks for a speed
        assert code == 0
        return
    assert code == 1
    assert reason in found
    assert all(finding["file"].startswith("boss") and finding["line"] > 0 for finding in report["findings"])


def test_nothing_else_takes_a_cell_without_a_part(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    case, program = written(tmp_path)
    assert main(["check", str(case)]) == 2
    assert "part: none: there is nothing to build" in capsys.readouterr().err
    assert main(["export", str(case), "--krl", str(tmp_path / "out")]) == 2
    assert main(["check", str(case), "--program", str(program), "--html", str(tmp_path / "a.html")]) == 2
    case.write_text(yaml.safe_dump({**CELL, "part": {"absent": True, "mesh": "boss.stl"}}))
    assert main(["check", str(case), "--program", str(program)]) == 2
    assert "part.absent: leave mesh, sub_volumes, toolpath and body out" in capsys.readouterr().err
