"""A motion from memory is judged as its file is, in whatever order its layers come."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.jobs.indexed import backwards, three_case

import cell
from cell.cli.main import main
from cell.motion.motion import Motion
from cell.verification.motion_check import MotionResult


def through_a_file(folder: Path, job: cell.Job, motion: Motion) -> MotionResult:
    cell.write_motion(folder / "m.npz", motion)
    return cell.check_motion(job, cell.read_motion(folder / "m.npz", job))


def said(found: MotionResult) -> dict[str, Any]:
    return cell.motion_document(found, "m.npz")


@pytest.fixture(scope="module")
def three(tmp_path_factory: pytest.TempPathFactory) -> cell.Result:
    """Layers in an order that is not that of the sub-volumes, because the case gives it."""
    result = cell.check(cell.prepare(backwards(tmp_path_factory.mktemp("three"))))
    assert result.motion is not None
    assert result.motion.order is not None
    return result


def test_a_motion_is_judged_as_its_file(little: cell.Result, tmp_path: Path) -> None:
    assert little.motion is not None
    found = cell.check_motion(little.job, little.motion)
    assert found.feasible
    assert said(found) == said(through_a_file(tmp_path, little.job, little.motion))


def test_a_bad_motion_is_found_bad_as_its_file(little: cell.Result, tmp_path: Path) -> None:
    assert little.motion is not None
    off = replace(little.motion, q=little.motion.q + np.deg2rad([0.5, 0, 0, 0, 0, 0]))
    found = cell.check_motion(little.job, off)
    assert not found.feasible
    assert said(found) == said(through_a_file(tmp_path, little.job, off))


@pytest.mark.slow
def test_a_motion_brings_its_order_of_layers(three: cell.Result, tmp_path: Path) -> None:
    assert three.motion is not None
    free = cell.prepare(three_case(tmp_path))  # gives neither poses nor an order
    assert free.order is None
    for job in (three.job, free):
        found = cell.check_motion(job, three.motion)
        assert found.findings == ()
        assert found.welded == len(job.targets)
        assert said(found) == said(through_a_file(tmp_path, job, three.motion))
    # read for one order of the part and checked in another
    cell.write_motion(tmp_path / "m.npz", three.motion)
    for job, other in ((three.job, free), (free, three.job)):
        assert cell.check_motion(job, cell.read_motion(tmp_path / "m.npz", other)).findings == ()


@pytest.mark.slow
def test_a_file_is_judged_as_the_command_judges_it(three: cell.Result, tmp_path: Path) -> None:
    assert three.motion is not None
    cell.write_motion(tmp_path / "m.npz", three.motion)
    case, out = three_case(tmp_path), tmp_path / "r.json"
    argv = ["check", str(case.path), "-q", "--motion-in", str(tmp_path / "m.npz"), "--json", str(out)]
    assert main(argv) == 0
    job = cell.prepare(case)
    found = cell.check_motion(job, cell.read_motion(tmp_path / "m.npz", job))
    ours = cell.motion_document(found, str(tmp_path / "m.npz"))
    assert json.loads(json.dumps(ours)) == json.loads(out.read_text(encoding="utf-8"))


def test_layers_in_an_order_that_the_case_forbids_are_found(three: cell.Result) -> None:
    """Where the case gives the poses, and with them the order, the motion does not choose."""
    assert three.motion is not None
    poses = [pose.document() for pose in reversed(three.poses)]
    job = cell.prepare(cell.with_changes(three.job.case, table={"mode": "indexed", "poses": poses}))
    assert {finding.reason for finding in cell.check_motion(job, three.motion).findings} == {"order"}


def broken(motion: Motion, name: str, row: int, value: float) -> Motion:
    column = np.array(getattr(motion, name), dtype=float)
    column[row] = value
    return replace(motion, **{name: column})


@pytest.mark.parametrize(
    ("name", "row", "value", "words"),
    [
        ("q", 5, np.nan, "row 6: A1_deg is not a finite number"),
        ("table", 5, np.inf, "row 6: E1_deg is not a finite number"),
        ("t_s", 5, np.nan, "row 6: t_s is not a finite number"),
        ("t_s", 5, 0.0, "row 6: t_s 0 is not later"),
        ("target", 5, 999, "target 999 does not exist"),
        ("bead", 5, 77, "belongs to bead"),
        ("arc", 5, 2, "arc is 0 or 1"),
    ],
)
def test_what_no_file_may_hold_is_refused(little: cell.Result, name: str, row: int, value: float, words: str) -> None:
    assert little.motion is not None
    with pytest.raises(cell.InputError, match=words):
        cell.check_motion(little.job, broken(little.motion, name, row, value))


def test_columns_of_other_shapes_are_refused(little: cell.Result, three: cell.Result) -> None:
    assert little.motion is not None
    assert three.motion is not None
    for changed, words in (
        (replace(little.motion, q=little.motion.q[:, :5]), "motion: q has the shape"),
        (replace(little.motion, arc=little.motion.arc[1:]), "motion: arc has the shape"),
        (replace(little.motion, names=("J1", *little.motion.names[1:])), "motion: has no column A1_deg"),
    ):
        with pytest.raises(cell.InputError, match=words):
            cell.check_motion(little.job, changed)
    for value, shown in ((999, "999"), (np.nan, "nan"), (0.5, "0.5")):
        with pytest.raises(cell.InputError, match=f"motion: target {shown} does not exist"):
            cell.check_motion(three.job, broken(three.motion, "target", 5, value))
    same = broken(three.motion, "target", 5, three.motion.target[5])
    assert same.target.dtype == float
    assert cell.check_motion(three.job, same).feasible


def test_no_motion_is_told_in_one_line(little: cell.Result, tmp_path: Path) -> None:
    for call in (
        lambda: cell.check_motion(little.job, None),  # type: ignore[arg-type]
        lambda: cell.export_program(little.job, None),  # type: ignore[arg-type]
        lambda: cell.write_motion(tmp_path / "m.csv", None),  # type: ignore[arg-type]
    ):
        with pytest.raises(cell.InputError, match=r"^no motion: an infeasible part has none"):
            call()
    assert not list(tmp_path.iterdir())
