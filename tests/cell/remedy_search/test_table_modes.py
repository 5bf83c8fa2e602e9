"""Another way for the table to move: said where the whole part is feasible with it, and where nothing smaller helps."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from support.jobs.boss_motion import boss_case, job_of
from support.jobs.indexed import three_bosses, with_table

from cell.case.read import load_case
from cell.job.job import Job, prepare
from cell.remedy_search import table_modes
from cell.remedy_search.search import remedies
from cell.remedy_search.table_modes import mode_trials
from cell.verdict.by_table_mode import check
from cell.verdict.check import check_fixed
from cell.verdict.result import Result

LIMIT = {"gravity_max_deg": 45}  # three bosses a third of a turn apart: at no one pose


def fixed(folder: Path) -> Result:
    case = load_case(three_bosses(folder, table={"E1_deg": 90, "E2_deg": 0}, checks=LIMIT))
    return check_fixed(prepare(case), 90, 0)


@pytest.mark.parametrize("feasible", [True, False])
def test_another_mode_holds_where_the_whole_part_is_checked_with_it(
    feasible: bool, little: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def checked(job: Job) -> SimpleNamespace:
        asked.append(job.case.table.mode)
        return SimpleNamespace(feasible=feasible)

    monkeypatch.setattr(table_modes, "check", checked)
    trials = list(mode_trials(little))
    assert [trial.holds() for trial in trials] == [feasible]
    assert asked == ["coordinated"]


@pytest.mark.slow
def test_a_table_that_indexes_is_what_helps_bosses_all_round(tmp_path: Path) -> None:
    result = fixed(tmp_path)
    assert not result.feasible
    found = next(remedies(result))
    assert found.change == {"key": "table.mode", "from": "fixed", "to": "indexed"}
    assert found.checked == "part"
    assert "table.mode fixed -> indexed (checked: whole part feasible)" in found.sentence
    assert found.targets.tolist() == [i for i, row in enumerate(result.rows) if row.reason]
    again = with_table(result.job.case, {"mode": found.change["to"]}, checks=LIMIT)
    assert check(prepare(again)).feasible


@pytest.mark.slow
def test_nothing_of_the_kind_is_said_where_it_does_not_help(tmp_path: Path) -> None:
    far = {"position_mm": [6000, 0, 0], "rotation_deg": [0, 0, -90]}
    case = load_case(three_bosses(tmp_path, positioner=far))
    found = list(remedies(check(prepare(case))))
    assert [remedy.change for remedy in found] == [None]
    assert "tried: table.mode coordinated" in found[0].sentence


@pytest.mark.slow
def test_given_poses_that_do_not_serve_are_left_to_be_searched(tmp_path: Path) -> None:
    poses = [{"sub_volume": name, "E1_deg": 0, "E2_deg": 0} for name in ("SV1", "SV2", "SV3")]
    case = load_case(three_bosses(tmp_path, table={"mode": "indexed", "poses": poses}, checks=LIMIT))
    found = next(remedies(check(prepare(case))))
    assert (found.change["key"], found.change["to"], found.checked) == ("table.poses", [], "part")


@pytest.mark.slow
def test_upright_deg_is_widened_from_what_is_needed_on(tmp_path: Path) -> None:
    # E2 alone, tilted by 75 degrees: a boss that stands out level is laid up to 15 degrees off up, and no less
    table = {"mode": "coordinated", "axes": ["E2"], "E1_deg": 75, "upright_deg": 12}
    job = job_of(boss_case(tmp_path, table=table))
    result = check(job)
    assert {row.reason for row in result.rows} == {"gravity"}
    first = next(mode_trials(result))
    assert (first.key, first.was, first.to) == ("table.upright_deg", 12.0, 20.0)
    found = next(remedies(result))
    assert found.change["key"] == "table.upright_deg"
    assert 20.0 <= found.change["to"] <= 30.0
    assert f"table.upright 12 -> {found.change['to']:g} deg (checked: whole part feasible)" in found.sentence


def test_a_search_without_time_tries_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result = fixed(tmp_path)
    monkeypatch.setattr("cell.remedy_search.table_modes.ModeTrial.holds", lambda self: pytest.fail("tried"))
    assert not [remedy for remedy in remedies(result, seconds=0.0) if remedy.change]
