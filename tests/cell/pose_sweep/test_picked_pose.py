"""Table poses picked from sweeps."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from support.jobs.cases import little_case

from cell.case.read import load_case, with_changes
from cell.case.roll_text import parse_roll
from cell.case.sections import Case
from cell.cli.main import main
from cell.errors import InputError
from cell.pose_sweep.log import row_line
from cell.pose_sweep.picked_pose import picked_pose
from cell.pose_sweep.sweep import fingerprint, sweep_document


def row(e1: float, e2: float, verdict: str, gravity: float = 0.0) -> dict:
    more = {"least_clearance_mm": 9.0, "gravity_max_deg": gravity}
    return {"E1_deg": e1, "E2_deg": e2, "verdict": verdict, "infeasible": 0, "reasons": {}, "searched": True, **more}


ROWS = [row(0, 0, "infeasible"), row(45, 90, "feasible", 60.0), row(90, 180, "feasible", 10.0)]


@pytest.fixture
def case(tmp_path: Path) -> Case:
    return load_case(little_case(tmp_path))


def files(case: Case, folder: Path, rows: list[dict]) -> list[str]:
    head = json.dumps({"schema": "rbam-sweep-log/1", "case": fingerprint(case)}).encode()
    (folder / "map.json").write_text(json.dumps(sweep_document(case, rows), indent=1))
    (folder / "log.jsonl").write_bytes(b"\n".join([head, *map(row_line, rows), b'{"E1_deg": 4']))
    return [str(folder / "map.json"), str(folder / "log.jsonl")]


def test_the_best_or_any_other_pose_is_found_in_map_and_log(case: Case, tmp_path: Path) -> None:
    for path in files(case, tmp_path, ROWS):
        assert picked_pose(case, path, "best")[:2] == (90.0, 180.0)
        assert [picked_pose(case, path, str(k))[:2] for k in range(3)] == [(0.0, 0.0), (45.0, 90.0), (90.0, 180.0)]
        for wrong in ("3", "-1", "worst", "1.0"):
            with pytest.raises(InputError, match=r"0 \.\. 2"):
                picked_pose(case, path, wrong)


def test_a_pose_brings_the_roll_and_height_it_was_swept_with(case: Case, tmp_path: Path) -> None:
    swept = {**ROWS[2], "roll": "fixed:30", "height_mm": 80.0}
    for path in files(case, tmp_path, [*ROWS[:2], swept]):
        changed = picked_pose(case, path, "2").applied(case)
        assert changed.roll.fixed_deg == 30.0
        assert changed.support.height_mm == 80.0


def test_a_map_of_one_roll_brings_it_to_a_case_of_another(case: Case, tmp_path: Path) -> None:
    path, _ = files(with_changes(case, roll=parse_roll("fixed:30")), tmp_path, ROWS)
    assert picked_pose(case, path, "2").applied(case).roll.fixed_deg == 30.0


def test_a_sweep_without_a_feasible_pose_has_no_best(case: Case, tmp_path: Path) -> None:
    for path in files(case, tmp_path, ROWS[:1]):
        with pytest.raises(InputError, match="no pose is feasible"):
            picked_pose(case, path, "best")
        assert picked_pose(case, path, "0")[:2] == (0.0, 0.0)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "is not a sweep"),
        ("E1,E2\n1,2\n", "is not a sweep"),
        ('{"schema": "rbam-report/1"}', "is not a sweep"),
        ('{"schema": "rbam-sweep/1", "case": "another", "poses": []}', "another"),
        ('{"schema": "rbam-sweep/1", "case": "boss", "poses": []}', "no poses"),
        ('{"schema": "rbam-sweep/1", "case": "boss", "poses": [{}], "best": {}}', "no table angles"),
        ('{"schema": "rbam-sweep-log/1", "case": "0123"}\n', "another case"),
    ],
)
def test_what_is_no_sweep_of_this_case_is_refused(case: Case, tmp_path: Path, content: str, says: str) -> None:
    path = tmp_path / "sweep"
    path.write_text(content)
    with pytest.raises(InputError, match=says) as caught:
        picked_pose(case, str(path), "best")
    assert "\n" not in str(caught.value)


def test_replay_says_what_is_wrong_before_it_checks(
    case: Case, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for argv, says in (
        (["--sweep", str(tmp_path / "missing.json")], "cannot be read"),
        (["--pose", "1"], "--sweep"),
        (["--sweep", "map.json", "--e1", "3"], "--e1"),
        (["--fps", "3"], "--fps: needs --video"),
        (["--picture", "p.png", "--loop"], "--loop: needs the window or --web"),
        (["--video", "film.gif", "--target", "3"], "--target: needs --picture"),
        (["--web", "--view", "torch"], "--view: needs --picture or --video"),
        (["--web", "--size", "3x3"], "--size: needs"),
        (["--video", "film.avi"], ".mp4 or .gif"),
        (["--picture", "p.png", "--size", "large"], "--size"),
        (["--picture", str(tmp_path / "no" / "p.png")], "does not exist"),
        (["--web", "--port", "70000"], "--port"),
        (["--web", "--host", "no.such.host.invalid"], "--host"),
    ):
        assert main(["replay", str(case.path), *argv]) == 2, argv
        err = capsys.readouterr().err
        assert says in err
        assert err.count("\n") == 1
