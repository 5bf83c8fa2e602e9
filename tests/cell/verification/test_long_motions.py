"""Long motions are looked at piece by piece, and side by side: the same is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cell.case.read import load_case
from cell.job.job import Job, prepare
from cell.motion.motion_file import ReadMotion
from cell.processes.worker_pool import working
from cell.report.motion_report import motion_document
from cell.shipped import DEFAULT_CASE
from cell.verdict.check import check_fixed
from cell.verification import arm_clearances
from cell.verification.motion_check import MotionResult, check_motion


@pytest.fixture(scope="module")
def run() -> tuple[Job, ReadMotion]:
    job = prepare(load_case(DEFAULT_CASE))
    motion = check_fixed(job, 90, 180).motion
    assert motion is not None
    return job, ReadMotion(motion, np.arange(len(motion.t_s)) + 1, ())


def bent(read: ReadMotion) -> ReadMotion:
    """The motion with the arm bent into the part in a few rows, late."""
    q, late = read.motion.q.copy(), 3 * len(read.motion.q) // 4
    q[late : late + 3, 1] += 0.2
    return replace(read, motion=replace(read.motion, q=q))


def told(found: MotionResult) -> dict[str, object]:
    return motion_document(found, "m.csv")


@pytest.mark.slow
@pytest.mark.parametrize("free", [True, False])
def test_what_is_found_does_not_depend_on_the_processes(
    run: tuple[Job, ReadMotion], free: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    job, read = run
    read = read if free else bent(read)
    whole = check_motion(job, read)
    assert whole.feasible is free
    monkeypatch.setattr(arm_clearances, "LEAST_PIECE", 900)
    one = check_motion(job, read)
    with working(2) as mine:
        two = check_motion(job, read)
        assert len(mine.workers()) == 1
    assert told(one) == told(two)
    assert whole.clearance is not None
    assert one.clearance is not None
    # the least on the way is known to a share of it, whoever looks for it
    assert one.clearance[0] == pytest.approx(whole.clearance[0], rel=0.03)
    places = [{(f.row, f.reason) for f in some.findings} for some in (whole, one)]
    assert places[0] <= places[1]
    assert free or any(f.reason == "collision" for f in one.findings)


@pytest.mark.slow
def test_pieces_hold_every_step_and_every_run(run: tuple[Job, ReadMotion], monkeypatch: pytest.MonkeyPatch) -> None:
    pieces = []
    monkeypatch.setattr(arm_clearances, "LEAST_PIECE", 900)
    make = arm_clearances._pieces
    monkeypatch.setattr(arm_clearances, "_pieces", lambda *args: pieces.append((args, make(*args))) or pieces[-1][1])
    check_motion(*run)
    (way, _, runs), found = pieces[0]
    assert len(found) > 2
    ends = [piece.first + len(piece.q) - 1 for piece in found]
    assert [piece.first for piece in found] == [0, *ends[:-1]]
    assert ends[-1] == len(way.q) - 1
    assert [(p.first + r.low, p.first + r.high) for p in found for r in p.runs] == [(r.low, r.high) for r in runs]
