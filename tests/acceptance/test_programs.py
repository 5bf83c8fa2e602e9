"""Every shipped case that is feasible goes from its mesh to a robot program and back, and the program is feasible."""

from __future__ import annotations

from pathlib import Path

import pytest

from cell.case.read import load_case
from cell.job.job import prepare
from cell.programs.export import export_program
from cell.shipped import MODELS_DIR
from cell.verdict.as_asked import check_as_asked

CASES = sorted((MODELS_DIR / "cases").glob("*.case.yaml"))
# the tilted one is infeasible; five blades in one motion take minutes to be planned
LEFT_OUT = ("propeller_tilted", "propeller_indexed")
FEASIBLE = [path for path in CASES if path.name.removesuffix(".case.yaml") not in LEFT_OUT]


def test_there_are_cases() -> None:
    assert len(FEASIBLE) >= 7


@pytest.mark.slow
@pytest.mark.parametrize("path", FEASIBLE, ids=lambda path: path.name.removesuffix(".case.yaml"))
def test_a_shipped_case_becomes_a_program_and_back(path: Path) -> None:
    result = check_as_asked(prepare(load_case(path)))
    assert result.motion is not None
    made = export_program(result.job, result.motion)
    assert made.fault is None
    assert made.result is not None
    assert made.result.feasible
    assert made.result.found.welded == len(result.job.targets)
    assert made.gap is not None
    assert made.gap.share(made.written.thinning) < 1
    assert made.written.points < made.written.rows / 2
