"""Records hold Python's own values, so that every document of every verdict can be written."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cell.cli.main import main
from cell.failure import AT_TARGET, IN_ROWS, CollisionPlace, Contact, Failure, Kind
from cell.plain import plain
from cell.verdict.result import TargetVerdict
from cell.verification.bead_order import Finding

CLAMP = {"name": "clamp [left]", "on": "table", "position_mm": [-120, 0, 130], "box": {"size_mm": [120, 120, 120]}}


def test_numpys_values_become_pythons() -> None:
    given = {"a": np.float32(1.5), "b": [np.bool_(True), (np.int64(3),)], "c": np.arange(3), np.str_("d"): None}
    found = plain(given)
    assert found == {"a": 1.5, "b": [True, (3,)], "c": [0, 1, 2], "d": None}
    assert json.loads(json.dumps(found)) == {"a": 1.5, "b": [True, [3]], "c": [0, 1, 2], "d": None}


def test_records_keep_plain_values() -> None:
    for place in (AT_TARGET, IN_ROWS):
        failure = Failure(
            Kind.COLLISION,
            measure=np.float32(-1.0),  # type: ignore[arg-type]
            limit=np.int64(5),  # type: ignore[arg-type]
            contact=Contact(("a", "b"), seen=CollisionPlace.ROUNDED),
            place=place,
            proved=np.bool_(True),  # type: ignore[arg-type]
        )
        row = TargetVerdict(failure, None)
        finding = Finding(failure, np.int64(3), np.int64(4))  # type: ignore[arg-type]
        assert type(row.proved) is bool
        assert type(finding.row) is type(finding.to_row) is int
        for detail in (row.detail, finding.detail):
            written = {"pair": ["a", "b"], "distance_mm": -1.0, "required_mm": 5, "rounded": True}
            assert json.loads(json.dumps(detail)) == written


def test_a_fixed_roll_at_which_all_collides_is_written(make_case: Callable[..., Path], tmp_path: Path) -> None:
    case = make_case(roll={"fixed_deg": -60}, fixtures=[CLAMP])
    report, page = tmp_path / "r.json", tmp_path / "r.html"
    argv = ["check", str(case), "-q", "--no-remedies", "--all-reasons", "--json", str(report), "--html", str(page)]
    assert main(argv) == 1
    rows = json.loads(report.read_text())["rows"]
    assert any(row["reason"] == "collision" and row["proved"] is True for row in rows)
    assert "clamp [left]" in page.read_text()
