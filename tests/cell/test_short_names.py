"""What is printed of a job, a result, a motion and targets: a line of what it is, its verdict and counts."""

from __future__ import annotations

import pytest

import cell
from cell.errors import InputError
from cell.motion.motion_file import read_motion, write_motion
from cell.verdict.result import Result
from cell.verification.motion_check import check_motion


def test_large_objects_are_printed_in_a_line(little: Result, tmp_path) -> None:
    assert little.motion is not None
    write_motion(tmp_path / "m.csv", little.motion)
    read = read_motion(tmp_path / "m.csv", little.job)
    found = check_motion(little.job, read)
    for thing in (little, little.job, little.job.targets, little.motion, read, found):
        assert repr(thing).startswith(f"<{type(thing).__name__}")
        assert len(repr(thing)) < 150
        assert "\n" not in repr(thing)
    count = len(little.job.targets)
    assert f"feasible, {count} of {count} targets" in repr(little)
    assert ": feasible, " in repr(found)


def test_a_name_or_a_case_in_place_of_a_job_is_one_line(make_case) -> None:
    with pytest.raises(InputError, match=r"^prepare takes a case, not a str; cell.load_case reads one$"):
        cell.prepare("propeller")  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"^check takes a job, not a Case; cell.prepare makes one of a case$"):
        cell.check(cell.load_case(make_case()))  # type: ignore[arg-type]
