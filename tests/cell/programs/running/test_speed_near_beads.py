"""A program leaves and approaches beads no faster than the case lets travels be, as the checked motion does."""

from __future__ import annotations

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, result_of

from cell.job.job import Job
from cell.motion.motion import Motion
from cell.programs.export import export_program
from cell.programs.program import MoveKind
from cell.verdict.result import Result


def boss_with(folder, **process: float) -> Result:
    return result_of(boss_case(folder, process=process))


def speeds_near_beads(job: Job, motion: Motion) -> np.ndarray:
    """Speeds of the TCP with the arc off where it leaves or approaches a bead, mm/s; the table stands still."""
    p = 1e3 * job.scene.chain.forward(motion.q)[:, :3, 3]
    speed = np.linalg.norm(np.diff(p, axis=0), axis=1) / np.diff(motion.t_s)
    found = []
    for step in (1, -1):
        for end in np.flatnonzero(motion.arc[:-1] != motion.arc[1:]) + (0 if step == 1 else 1):
            k = end
            while motion.arc[end] and 0 <= k + step < len(p) and not motion.arc[k + step]:
                k += step
                if np.linalg.norm(p[k] - p[end]) > job.case.process.retract_mm + 1e-3:
                    break
                found.append(speed[min(k, k - step)])
    return np.array(found)


# 20 mm/s is no whole percent of the axes' speed; within 60 mm of the bead a move of axes begins that goes far beyond
@pytest.mark.parametrize(
    "process",
    [
        {"retract_mm": 10, "travel_speed_mm_s": 20},
        pytest.param({"retract_mm": 60}, marks=pytest.mark.slow),
    ],
)
def test_a_program_approaches_and_leaves_as_slowly_as_the_motion(tmp_path, process):
    result = boss_with(tmp_path, **process)
    assert result.motion is not None
    made = export_program(result.job, result.motion)
    assert made.fault is None
    assert made.result is not None
    limit = result.job.case.process.travel_speed_mm_s
    seen = speeds_near_beads(result.job, made.result.run.motion)
    assert len(seen) > 10
    assert speeds_near_beads(result.job, result.motion).max() < 1.001 * limit
    assert seen.max() < 1.001 * limit
    # and no slower than whole percents of the axes' speed ask for
    assert seen.max() > 0.7 * limit


def test_farther_off_the_axes_alone_limit_a_straight_way(tmp_path):
    result = boss_with(tmp_path, retract_mm=2)
    assert result.motion is not None
    made = export_program(result.job, result.motion)
    assert made.fault is None
    moves = made.written.program.moves
    travels = moves.axis_share[(moves.kind == MoveKind.AXES)][1:]
    assert travels.max() == pytest.approx(result.job.case.controller.axis_speed_percent / 100)
