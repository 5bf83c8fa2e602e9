"""Records hold Python's own values, so that every document of every verdict can be written."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cell.cli.main import main
from cell.plain import plain
from cell.planning.bead_search import Missing
from cell.verdict.check import TargetVerdict
from cell.verification.bead_order import Finding

CLAMP = {"name": "clamp [left]", "on": "table", "position_mm": [-120, 0, 130], "box": {"size_mm": [120, 120, 120]}}


def test_numpys_values_become_pythons() -> None:
    given = {"a": np.float32(1.5), "b": [np.bool_(True), (np.int64(3),)], "c": np.arange(3), np.str_("d"): None}
    found = plain(given)
    assert found == {"a": 1.5, "b": [True, (3,)], "c": [0, 1, 2], "d": None}
    assert json.loads(json.dumps(found)) == {"a": 1.5, "b": [True, [3]], "c": [0, 1, 2], "d": None}


def test_records_keep_plain_values() -> None:
    detail = {"distance_mm": np.float32(-1.0), "rounded": np.bool_(True)}
    missing = Missing("collision", detail, None, np.bool_(True))  # type: ignore[arg-type]
    row = TargetVerdict("collision", detail, np.bool_(False), None)  # type: ignore[arg-type]
    finding = Finding("collision", np.int64(3), np.int64(4), detail)  # type: ignore[arg-type]
    assert type(missing.exhaustive) is type(row.proved) is bool
    assert type(finding.row) is type(finding.to_row) is int
    for record in (missing, row, finding):
        assert json.loads(json.dumps(record.detail)) == {"distance_mm": -1.0, "rounded": True}


def test_a_fixed_roll_at_which_all_collides_is_written(make_case: Callable[..., Path], tmp_path: Path) -> None:
    case = make_case(roll={"fixed_deg": -60}, fixtures=[CLAMP])
    report, page = tmp_path / "r.json", tmp_path / "r.html"
    argv = ["check", str(case), "-q", "--no-remedies", "--all-reasons", "--json", str(report), "--html", str(page)]
    assert main(argv) == 1
    rows = json.loads(report.read_text())["rows"]
    assert any(row["reason"] == "collision" and row["proved"] is True for row in rows)
    assert "clamp [left]" in page.read_text()
