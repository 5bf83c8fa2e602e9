"""What is too near only between two rows, which both keep the clearance: neither planned nor passed."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, job_of, result_of

from cell.collision.checker import Checker
from cell.failure import CollisionPlace
from cell.job.job import Job
from cell.motion.motion_file import ReadMotion
from cell.verdict.check import check_fixed
from cell.verdict.result import Result
from cell.verification import arm_clearances
from cell.verification.bead_samples import COARSE, dense, rows_of
from cell.verification.motion_check import check_motion

# one layer, and a home from which the straight way to it swings the wire sideways: of what is before its tip, the
# tip alone comes near, and only for a moment
ONE_LAYER = {
    "slicing": {"h_layer_mm": 5, "h_min_mm": 4, "h_max_mm": 6},
    "robot": {"home_deg": [-60, -120, 120, 0, 60, -100]},
}
STEP = 34  # of that way, amid it


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("near")


@pytest.fixture(scope="module")
def good(folder: Path) -> Result:
    found = result_of(boss_case(folder, **ONE_LAYER))
    assert found.motion is not None
    return found


def grained(folder: Path, at: np.ndarray, size_mm: float, **sections: Any) -> Job:
    """The job with a grain at a place, m."""
    grain = {"name": "grain", "box": {"size_mm": [size_mm] * 3}, "position_mm": (at * 1e3).tolist()}
    return job_of(boss_case(folder, "grain", fixtures=[grain], **ONE_LAYER, **sections))


def nearest_mm(result: Result, job: Job, q: np.ndarray) -> float:
    deposits_laid = np.zeros(len(q), dtype=np.int64)
    return float(Checker(job.scene, result.table, 0.05).clearances(q, deposits_laid).distance.min() * 1e3)


def closely(q: np.ndarray, count: int = 100) -> np.ndarray:
    """Many configurations on each step."""
    t = np.linspace(0, 1, count)[:, None]
    return np.concatenate([a + t * (b - a) for a, b in pairwise(q)])


def test_a_travel_that_is_too_near_between_two_rows_is_not_planned(good: Result, folder: Path) -> None:
    assert good.motion is not None
    q = good.motion.q[: STEP + 20]
    (T,) = good.job.scene.chain.forward((q[STEP] + q[STEP + 1])[None] / 2)
    job = grained(folder, T[:3, 3] + 3.1e-3 * T[:3, 2], 0.2)
    # both rows keep 5 mm, and the wire touches nothing
    assert nearest_mm(good, job, q) > 6.0
    assert 2.5 < nearest_mm(good, job, closely(q)) < 4.0
    # the way that is planned keeps the clearance all along
    other = check_fixed(job, 90, 180)
    assert other.motion is not None
    first = int(np.flatnonzero(other.motion.arc)[0])
    assert nearest_mm(good, job, closely(other.motion.q[: first + 1])) >= 5.0


def missed(good: Result, folder: Path, step: int, *clearances_mm: float) -> list[Job]:
    """The job with a grain beside the wire where it passes amid two samples of a step; with clearances asked for."""
    motion, chain = good.motion, good.job.scene.chain
    assert motion is not None
    which = np.arange(len(motion.t_s) - 1) == step
    q = dense(good.job, motion, rows_of(good.job, motion), COARSE, which).q[:, : chain.n]
    assert len(q) > 20
    k = len(q) // 2
    a, T, b = chain.forward(np.stack([q[k], (q[k] + q[k + 1]) / 2, q[k + 1]]))
    beside = np.cross(T[:3, 2], b[:3, 3] - a[:3, 3])
    place = T[:3, 3] - 2e-3 * T[:3, 2] + 0.78e-3 * beside / np.linalg.norm(beside)
    jobs = [grained(folder, place, 0.1, checks={"clearance_mm": c}) for c in clearances_mm]
    assert nearest_mm(good, jobs[0], q) > 0.23
    assert 0.05 < nearest_mm(good, jobs[0], closely(q)) < 0.15
    return jobs


def test_a_motion_that_is_too_near_between_two_samples_is_not_passed(good: Result, folder: Path) -> None:
    motion = good.motion
    assert motion is not None
    asked, free = missed(good, folder, STEP, 0.2, 0.0)
    read = ReadMotion(motion, np.arange(len(motion.t_s)) + 1, ())
    (found,) = check_motion(asked, read).findings
    assert (found.row, found.to_row, found.reason) == (STEP + 1, STEP + 1, "collision")
    assert found.failure is not None
    assert found.failure.contact is not None
    assert (set(found.failure.contact.pair), found.failure.contact.seen) == (
        {"grain", "torch_wire"},
        CollisionPlace.BETWEEN_ROWS,
    )
    # where nothing is asked for it is passed, as it touches nothing
    assert check_motion(free, read).feasible


def test_of_a_long_motion_too(good: Result, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    motion = good.motion
    assert motion is not None
    back = len(motion.t_s) - 2 - STEP  # on the way home
    (job,) = missed(good, folder, back, 0.2)
    read = ReadMotion(motion, np.arange(len(motion.t_s)) + 1, ())
    monkeypatch.setattr(arm_clearances, "LEAST_PIECE", 500)
    found = check_motion(job, read).findings
    assert [(f.row, f.to_row, f.reason) for f in found] == [(back + 1, back + 1, "collision")]
