"""`cell.check` is `rbam check`: the table does what the case asks, or stands where it is told to."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case
from support.jobs.cases import little_case
from support.jobs.indexed import three_bosses

import cell
from cell.cli.main import main
from cell.job.job import Job

CASES: dict[str, Callable[[Path], Path]] = {
    "fixed": little_case,
    "indexed": three_bosses,
    "coordinated": lambda folder: boss_case(folder, table={"mode": "coordinated"}),
    "best": lambda folder: boss_case(folder, table={"mode": "best"}),
}


def job_in(folder: Path, mode: str) -> Job:
    return cell.prepare(cell.load_case(CASES[mode](folder)))


@pytest.mark.parametrize(
    "mode", [mode if mode in ("fixed", "best") else pytest.param(mode, marks=pytest.mark.slow) for mode in CASES]
)
def test_a_case_is_checked_as_the_command_checks_it(mode: str, tmp_path: Path) -> None:
    path = CASES[mode](tmp_path)
    report, motion = tmp_path / "r.json", tmp_path / "m.csv"
    assert main(["check", str(path), "-q", "--no-remedies", "--json", str(report), "--motion", str(motion)]) == 0
    result = cell.check(cell.prepare(cell.load_case(path)))
    assert result.feasible
    assert result.mode == mode
    cell.write_motion(tmp_path / "ours.csv", result.motion)
    assert (tmp_path / "ours.csv").read_bytes() == motion.read_bytes()
    assert json.loads(json.dumps(cell.report_document(result))) == json.loads(report.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("mode", "function"),
    [
        ("indexed", "cell.verdict.indexed.check_indexed"),
        ("coordinated", "cell.verdict.coordinated.check_coordinated"),
        ("best", "cell.verdict.best_pose.check_best"),
    ],
)
def test_what_moves_the_table_is_the_same_in_python_and_for_the_command(
    mode: str, function: str, little: cell.Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def checked(job: Job, progress: object = None) -> cell.Result:
        asked.append(job.case.table.mode)
        return replace(little, mode=mode)

    monkeypatch.setattr(function, checked)
    case = boss_case(tmp_path, table={"mode": mode})
    assert cell.check(replace(little.job, case=cell.load_case(case))).mode == mode
    report = tmp_path / "r.json"
    assert main(["check", str(case), "-q", "--json", str(report)]) == 0
    assert json.loads(report.read_text(encoding="utf-8"))["table"]["mode"] == mode
    assert asked == [mode, mode]


@pytest.mark.slow
def test_what_cannot_be_built_is_infeasible_in_python_too(tmp_path: Path) -> None:
    path = boss_case(tmp_path, table={"mode": "coordinated"}, positioner={"position_mm": [4000, 0, 0]})
    report = tmp_path / "r.json"
    assert main(["check", str(path), "-q", "--no-remedies", "--json", str(report)]) == 1
    result = cell.check(cell.prepare(cell.load_case(path)))
    assert not result.feasible
    assert json.loads(json.dumps(cell.report_document(result))) == json.loads(report.read_text(encoding="utf-8"))


def test_two_angles_stand_for_those_of_the_case(tmp_path: Path) -> None:
    job = job_in(tmp_path, "fixed")
    as_asked, there = cell.check(job), cell.check(job, 90, E2_deg=np.int64(180))
    assert as_asked.asked == there.asked == (90, 180)
    np.testing.assert_array_equal(as_asked.motion.q, there.motion.q)
    elsewhere = cell.check(job, E1_deg=-30, E2_deg=0)
    assert elsewhere.asked == (-30, 0)
    assert np.rad2deg(elsewhere.table) == pytest.approx((-30, 0))


@pytest.mark.parametrize("mode", ["indexed", "coordinated", "best"])
def test_angles_are_refused_where_the_case_moves_the_table(mode: str, tmp_path: Path) -> None:
    job = job_in(tmp_path, mode)
    with pytest.raises(cell.InputError, match=rf"^E1_deg, E2_deg: do not go with table mode {mode}") as refused:
        cell.check(job, E1_deg=90, E2_deg=180)
    assert "\n" not in str(refused.value)


def test_the_way_round_the_refusal_is_the_one_it_names(tmp_path: Path) -> None:
    standing = cell.with_changes(cell.load_case(three_bosses(tmp_path)), table={"mode": "fixed"})
    assert cell.check(cell.prepare(standing), E1_deg=90, E2_deg=180).mode == "fixed"


@pytest.mark.parametrize(
    ("angles", "words"),
    [
        ({"E1_deg": 90}, "E2_deg: is missing beside E1_deg"),
        ({"E2_deg": 0}, "E1_deg: is missing beside E2_deg"),
        ({"E1_deg": "90", "E2_deg": 180}, "E1_deg: '90' is not an angle"),
        ({"E1_deg": 90, "E2_deg": float("nan")}, "E2_deg: nan is not an angle"),
        ({"E1_deg": float("inf"), "E2_deg": 180}, "E1_deg: inf is not an angle"),
        ({"E1_deg": True, "E2_deg": 180}, "E1_deg: True is not an angle"),
        ({"E1_deg": 10**400, "E2_deg": 180}, "is not an angle"),
        ({"E1_deg": [90], "E2_deg": 180}, "is not an angle"),
    ],
)
def test_what_is_no_pose_is_refused(angles: dict[str, Any], words: str, little: cell.Result) -> None:
    with pytest.raises(cell.InputError, match=words):
        cell.check(little.job, **angles)
