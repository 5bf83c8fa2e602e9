"""A table that moves along the beads: upright all along, judged like any motion, and refused for what it is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, job_of

from cell import html_report
from cell.failure import IN_ROWS, Failure, Kind
from cell.html.series import _gravity, drawn_path
from cell.job.job import Job
from cell.motion.motion_file import read_motion, write_motion
from cell.planning.context import Span
from cell.verdict import coordinated
from cell.verdict.by_table_mode import check
from cell.verdict.check import SpanVerdict, _failures_aside
from cell.verdict.coordinated import _with_table_met
from cell.verdict.result import Result
from cell.verdict.table_use import table_use
from cell.verdict.words import in_words
from cell.verification.bead_order import Finding
from cell.verification.motion_check import check_motion


def boss(folder: Path, **sections: Any) -> Job:
    table = {"mode": "coordinated", **sections.pop("table", {})}
    return job_of(boss_case(folder, table=table, **sections))


@pytest.fixture(scope="module")
def upright(tmp_path_factory: pytest.TempPathFactory) -> Result:
    return check(boss(tmp_path_factory.mktemp("boss")))


def off_up(result: Result) -> np.ndarray:
    """Angle of every target's direction off up at the table's angles in the motion, by MuJoCo's kinematics, deg."""
    t, scene = result.job.targets, result.job.scene
    up = scene.T_world_base()[2, :3]
    normal = np.array([scene.T_base_part(*E)[:3, :3] @ n for E, n in zip(result.tables, t.normal, strict=True)])
    return np.rad2deg(np.arccos(np.clip(normal @ up, -1, 1)))


def test_every_target_is_laid_upright(upright: Result) -> None:
    assert upright.feasible
    assert off_up(upright).max() <= 10.0
    assert np.rad2deg(upright.gravity) == pytest.approx(off_up(upright), abs=1e-6)
    # standing, the same part is further off at any angle of E2: its directions span 35 degrees
    assert table_use(upright).max_deg <= 10.0


def test_the_rows_of_the_motion_move_the_table(upright: Result) -> None:
    motion = upright.motion
    assert np.abs(np.diff(motion.table, axis=0)).max() > 0
    passed = np.flatnonzero((motion.arc == 1) & (np.diff(motion.target, prepend=-1) != 0))
    for row in passed.tolist():
        assert motion.table[row] == pytest.approx(upright.tables[motion.target[row]], abs=1e-9)


def test_the_judge_of_any_motion_accepts_it(upright: Result, tmp_path: Path) -> None:
    write_motion(tmp_path / "m.npz", upright.motion)
    found = check_motion(upright.job, read_motion(tmp_path / "m.npz", upright.job))
    assert [(f.reason, f.row, f.detail) for f in found.findings] == []
    assert found.bead_distance[0] < 0.05e-3
    assert found.wire_angle[0] < np.deg2rad(0.05)


def test_the_judge_holds_upright_deg(upright: Result, tmp_path: Path) -> None:
    """The same motion is refused where a smaller angle is asked for."""
    write_motion(tmp_path / "m.npz", upright.motion)
    strict = boss(tmp_path, table={"upright_deg": 5})
    found = check_motion(strict, read_motion(tmp_path / "m.npz", strict))
    assert {f.reason for f in found.findings} == {"gravity"}


def test_the_table_use_is_counted_from_the_rows(upright: Result) -> None:
    use, table = table_use(upright), np.rad2deg(upright.motion.table)
    assert use.travel_deg == pytest.approx(np.abs(np.diff(table, axis=0)).sum(axis=0), abs=1e-6)
    assert use.share_within == 1.0
    assert use.mean_deg <= use.max_deg
    assert use.reversals[1] >= 3  # to and fro in every layer


def test_the_page_says_what_the_table_does_and_no_pose(upright: Result) -> None:
    page = html_report(upright)
    assert "move along the beads: up to" in page
    assert "E1 = 0°" not in page


@pytest.mark.slow
def test_an_axis_that_is_too_slow_is_named(tmp_path: Path) -> None:
    job = boss(
        tmp_path, positioner={"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90], "max_speed_deg_s": [100, 3]}
    )
    result = check(job)
    assert not result.feasible
    slow = [row for row in result.rows if row.reason == "speed"]
    assert slow
    by_E2 = [row for row in slow if row.detail["axis"] == "E2" and row.detail["by"] == "speed"]
    assert len(by_E2) > len(slow) / 2
    assert not any(row.proved for row in slow)


def test_what_nothing_keeps_upright_is_proved_out_with_the_best_there_is(tmp_path: Path) -> None:
    # E2 alone, lying flat: what points sideways stays there
    result = check(boss(tmp_path, table={"axes": ["E2"], "E1_deg": 0}))
    assert not result.feasible
    assert all(row.reason == "gravity" and row.proved for row in result.rows)
    assert result.rows[0].detail["angle_deg"] == pytest.approx(90.0, abs=1e-3)
    assert "limit 10" in in_words(result.rows[0])


def test_what_is_exactly_as_far_off_upright_as_is_allowed_is_not_refused(
    upright: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On a level table all of it points sideways: 90 degrees, which rounding tells as a little more."""
    monkeypatch.setattr(coordinated, "check_span", lambda *_: SpanVerdict(upright.rows))
    monkeypatch.setattr(coordinated, "_lost", lambda *_: 0)
    result = check(boss(tmp_path, table={"axes": ["E2"], "E1_deg": 0, "upright_deg": 90}))
    assert {row.reason for row in result.rows} == {None}
    job = boss(tmp_path, table={"mode": "fixed"}, checks={"gravity_max_deg": 90})
    span, level = Span(0, len(job.targets), None, None), np.full(len(job.targets), np.deg2rad(90) + 1e-12)
    assert not _failures_aside(job, level, span)
    assert len(_failures_aside(job, level + 1e-6, span)) == len(level)


def test_nothing_else_is_proved_on_one_way_of_the_table(tmp_path: Path) -> None:
    far = {"position_mm": [4000, 0, 0], "rotation_deg": [0, 0, -90]}
    result = check(boss(tmp_path, positioner=far))
    assert {row.reason for row in result.rows} == {"unreachable"}
    assert not any(row.proved for row in result.rows)


def test_a_table_that_would_sweep_the_work_into_a_wall_is_not_moved_there(tmp_path: Path) -> None:
    """Boxes stand where the part would lie down, to either side."""
    free = boss(tmp_path)
    T = [free.scene.T_world_base() @ free.scene.T_base_part(np.deg2rad(E1), 0.0) for E1 in (-90, 90)]
    ends = [(t @ [0, 0, 0.03, 1])[:3] * 1e3 for t in T]
    boxes = [
        {"name": f"wall_{k}", "box": {"size_mm": [40, 40, 40]}, "position_mm": [float(v) for v in end]}
        for k, end in enumerate(ends)
    ]
    result = check(boss(tmp_path, fixtures=boxes))
    assert not result.feasible
    met = [
        row
        for row in result.rows
        if row.detail.get("note") == "the table and what stands on it, in any pose of the arm"
    ]
    assert met
    assert all(row.reason == "collision" and not row.proved and "wall" in str(row.detail["pair"]) for row in met)


def test_what_is_laid_a_little_further_off_up_than_allowed_is_infeasible(
    upright: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = coordinated._schedule_trial

    def leaning(*args: Any) -> Any:
        trial = made(*args)
        off = trial.way.off.copy()
        off[3] = np.deg2rad(10.1)  # of 10
        return replace(trial, way=replace(trial.way, off=off))

    monkeypatch.setattr(coordinated, "check_span", lambda *_: SpanVerdict(upright.rows, upright.motion))
    monkeypatch.setattr(coordinated, "_schedule_trial", leaning)
    found = check(upright.job)
    assert not found.feasible
    assert {i: (f.kind, f.measure, f.proved) for i, f in found.failures.items()} == {3: (Kind.GRAVITY, 10.1, False)}


@pytest.mark.parametrize("found_by", ["table_collisions", "table_blend_collisions"])
def test_a_part_whose_table_meets_something_on_its_way_is_infeasible(
    found_by: str, upright: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(coordinated, "check_span", lambda *_: SpanVerdict(upright.rows, upright.motion))
    assert check(upright.job).feasible
    met = [Finding(Failure(Kind.COLLISION, measure=-1.0, limit=0.0, place=IN_ROWS), 7, 8)]
    monkeypatch.setattr(coordinated, found_by, lambda *_: met)
    found = check(upright.job)
    assert not found.feasible
    assert found.motion is None
    assert list(found.failures) == [upright.motion.target[8]]


def test_what_the_table_meets_in_a_rounded_corner_counts(
    upright: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    met = [Finding(Failure(Kind.COLLISION, measure=-1.0, limit=0.0, place=IN_ROWS), 7, 8)]
    monkeypatch.setattr("cell.verification.motion_check.table_blend_collisions", lambda *_: met)
    write_motion(tmp_path / "m.npz", upright.motion)
    found = check_motion(upright.job, read_motion(tmp_path / "m.npz", upright.job))
    assert [(f.reason, f.row) for f in found.findings] == [("collision", 8)]  # rows of files count from 1
    rows = list(upright.rows)
    monkeypatch.setattr("cell.verdict.coordinated.table_blend_collisions", lambda *_: met)
    told = _with_table_met(upright.job, upright.motion, rows)
    assert [i for i, row in enumerate(told) if row.reason == "collision"] == [int(upright.motion.target[8])]


def test_the_page_plots_how_far_off_up_with_what_is_asked_for(upright: Result) -> None:
    chart = _gravity(upright, drawn_path(upright))
    assert chart["limits"] == [{"y": pytest.approx(10.0), "label": "upright_deg 10 deg"}]
    (line,) = chart["lines"]
    assert np.nanmax(line["y"]) == pytest.approx(table_use(upright).max_deg, abs=0.3)
    assert chart["range"] == [0, pytest.approx(20.8)]
