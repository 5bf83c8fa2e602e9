"""Every shipped case that is feasible, from mesh to program: checked once, and all that follows held against it.

The verdict is what the case expects. Its motion is looked at by plain MuJoCo (see test_independent_replay.py). Its
program is read back, run as the controller would, and judged.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from support.oracles.bystander import Bystander

from cell.case.read import load_case
from cell.job.job import prepare
from cell.programs.export import export_program
from cell.pytest_plugin import differences
from cell.shipped import MODELS_DIR
from cell.verdict.by_table_mode import check

CASES = sorted((MODELS_DIR / "cases").glob("*.case.yaml"))


def feasible_cases() -> Iterator[Path]:
    for path in CASES:
        expect = yaml.safe_load(path.read_text(encoding="utf-8")).get("expect")
        if expect == "feasible" or (isinstance(expect, dict) and expect.get("verdict") == "feasible"):
            yield path


def test_every_case_but_the_tilted_one_is_feasible() -> None:
    left = {path.name for path in CASES} - {path.name for path in feasible_cases()}
    assert left == {"propeller_tilted.case.yaml"}


def test_the_cases_readme_lists_them_all() -> None:
    listed = re.findall(r"^\| `(\w+)`", (MODELS_DIR / "cases" / "README.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(listed) == [path.name.removesuffix(".case.yaml") for path in CASES]


@pytest.mark.slow
@pytest.mark.parametrize("path", list(feasible_cases()), ids=lambda path: path.name.removesuffix(".case.yaml"))
def test_a_shipped_case_from_mesh_to_program(path: Path) -> None:
    case = load_case(path)
    result = check(prepare(case))
    assert case.expect is not None
    assert list(differences(case.expect, result)) == []
    assert Bystander(result).problems() == []
    assert result.motion is not None
    made = export_program(result.job, result.motion)
    assert made.fault is None
    assert made.result is not None
    assert made.result.feasible
    assert made.result.found.welded == len(result.job.targets)
    assert made.gap is not None
    assert made.gap.share(made.written.thinning) < 1
    assert made.written.points < made.written.rows / 2
