"""What was not looked at is told as that: never as feasible, never as infeasible, never in a count."""

from __future__ import annotations

import json
from collections import Counter

import numpy as np
import pytest

from cell.case.read import load_case
from cell.cli.arguments import build_parser
from cell.cli.main import main
from cell.html.check_page import html_report
from cell.html.page_words import PageWords
from cell.job.job import prepare
from cell.planning import infeasible_part
from cell.pose_sweep.grid import Pose
from cell.pose_sweep.ranking import sweep_document
from cell.pose_sweep.sweep import _hopeless, pose_outcome
from cell.remedy_search.search import remedies
from cell.report.sweep_lines import sweep_lines
from cell.table_poses.hopeless_poses import Screened
from cell.verdict.check import check_fixed
from cell.verdict.result import NOT_LOOKED_AT
from cell.verdict.severity import worst_first
from cell.view.colours import GREY, target_colours

LID = {"name": "lid", "box": {"size_mm": [10, 300, 300]}, "position_mm": [-78, 0, 120], "on": "table"}


@pytest.fixture
def case(make_case, monkeypatch):
    monkeypatch.setattr(infeasible_part, "FLOOR", 0)
    return make_case(fixtures=[LID])


def test_the_document_and_the_text_say_how_many(case, tmp_path, capsys):
    path = tmp_path / "report.json"
    assert main(["check", str(case), "--no-remedies", "--json", str(path)]) == 1
    said, document = capsys.readouterr().out, json.loads(path.read_text())
    rows = document["rows"]
    verdicts = Counter(row["verdict"] for row in rows)
    assert set(verdicts) <= {"feasible", "infeasible", NOT_LOOKED_AT}
    assert document["not_looked_at"] == verdicts[NOT_LOOKED_AT] > 0
    assert document["looked_at"] + document["not_looked_at"] == document["targets"] == len(rows)
    assert document["infeasible"] == verdicts["infeasible"] == sum(document["reasons"].values()) > 0
    for row in rows:
        assert row["looked_at"] == (row["verdict"] != NOT_LOOKED_AT)
        if not row["looked_at"]:
            assert (row["reason"], row["detail"], row["proved"], row["q_deg"]) == (NOT_LOOKED_AT, {}, False, None)
    assert f"{document['not_looked_at']} of {len(rows)} targets" in said
    assert f"of the {document['looked_at']} targets checked" in said


def test_a_sweep_says_that_a_count_is_of_those_checked(case):
    job = prepare(load_case(case))
    row = pose_outcome(job, Pose(90, 180))
    assert row["searched"]
    assert row["looked_at"] + row["not_looked_at"] == len(job.targets)
    assert row["not_looked_at"] > 0 < row["infeasible"] <= row["looked_at"]
    said = [str(line) for line in sweep_lines(sweep_document(job.case, [row]))]
    assert f" {row['infeasible']}+" in said[2]
    assert said[3].endswith("(12+: at least 12)")
    whole = {**row, "not_looked_at": 0}
    said = [str(line) for line in sweep_lines(sweep_document(job.case, [whole]))]
    assert not any("+" in line for line in said)


def test_a_pose_that_is_settled_early_says_of_how_many_targets(case):
    job = prepare(load_case(case))
    row = _hopeless(job, Pose(90, 180), Screened(7, 9, {"collision": 7}))
    assert (row["infeasible"], row["looked_at"], row["not_looked_at"]) == (7, 9, len(job.targets) - 9)


def test_all_looks_at_every_one(case, tmp_path):
    path = tmp_path / "report.json"
    assert main(["check", str(case), "--every-target", "--no-remedies", "-q", "--json", str(path)]) == 1
    document = json.loads(path.read_text())
    assert document["not_looked_at"] == 0
    assert document["looked_at"] == document["targets"]


def test_a_motion_from_outside_is_no_case_for_all(case, tmp_path, capsys):
    assert main(["check", str(case), "--every-target", "--motion-in", str(tmp_path / "none.csv")]) == 2
    assert "--every-target: does not go with --motion-in" in capsys.readouterr().err


def test_pages_pictures_and_remedies_know_it(case):
    found = check_fixed(prepare(load_case(case)), 90, 180)
    words = PageWords(found)
    assert f"{found.not_looked_at} of the part's {len(found.rows)} targets were not checked" in words.verdict()
    assert f"the {found.looked_at} targets checked" in words.facts()
    assert NOT_LOOKED_AT not in words.reasons()
    assert NOT_LOOKED_AT in html_report(found)
    open_ = np.array([not row.looked_at for row in found.rows])
    colours, what = target_colours(found, "verdict")
    assert (colours[open_] == np.array(GREY)).all()
    assert not (colours[~open_] == np.array(GREY)).all(axis=1).any()
    assert "grey not checked" in what
    assert sorted(worst_first(found)) == sorted(found.failures)
    for remedy in remedies(found, seconds=0.0):
        assert set(remedy.targets.tolist()) == set(found.failures)


def test_the_former_name_of_the_option_is_not_taken_for_all_reasons(case):
    parser = build_parser()
    assert parser.parse_args(["check", str(case), "--all"]).every_target
    assert not parser.parse_args(["check", str(case), "--all"]).all_reasons
