"""Every motion called feasible, looked at again by plain MuJoCo on the scene as it is written out.

Nothing of the checker is used: joints on straight lines from row to row in steps of 0.2 mm and 0.2 degrees, the wire
against the chords between the targets, contacts among what is there at that moment, the sign of MuJoCo's own Jacobian.
Of long motions whole beads are looked at, with the ways to them, spread over the part; RBAM_EVERY_SAMPLE=1 takes all.
On the way across from bead to bead the wire is solid for the part as well. Speeds are held against the MJCF's own.
The shipped cases are looked at in test_shipped_cases.py.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.cells.skew_tables import skew_job
from support.jobs.boss_motion import boss_case, job_of
from support.jobs.indexed import three_case
from support.oracles.bystander import Bystander
from support.parts.helix import helix

from cell.case.read import load_case
from cell.job.job import prepare
from cell.job.table_winding import for_moving_table
from cell.verdict.by_table_mode import check


@pytest.mark.slow
def test_the_bystander_sees_what_is_wrong(make_case) -> None:
    case = load_case(make_case(slicing={"h_layer_mm": 2.2}))
    result = check(prepare(case))
    motion = result.motion
    assert motion is not None
    welding = np.flatnonzero(motion.arc)
    motion.q[welding[5], 4] += np.deg2rad(0.3)  # 0.3 degrees of the wrist
    off = [line for line in Bystander(result).problems() if "off its bead" in line]
    assert off
    motion.q[welding[5], 4] -= np.deg2rad(0.3)
    assert Bystander(result).problems() == []
    motion.q[welding[-20:], 1] += np.deg2rad(8.0)  # the whole arm lower
    assert "deposit/" in "".join(Bystander(result).problems())


@pytest.mark.slow
def test_the_bystander_sees_a_wire_that_is_dragged_and_an_arm_that_races(make_case) -> None:
    case = load_case(make_case(slicing={"h_layer_mm": 2.2}, process={"retract_mm": 3.5}))
    result = check(prepare(case))
    motion = result.motion
    assert motion is not None
    assert Bystander(result).problems() == []
    before = motion.q.copy()
    travel = np.flatnonzero((motion.bead == 1) & (motion.arc == 0))
    laid = np.flatnonzero((motion.bead == 0) & (motion.arc == 1))
    back = np.concatenate([motion.q[laid[::-1]], motion.q[travel[-1] + 1][None]])
    at = np.linspace(0, len(back) - 1, len(travel) + 2)[1:-1]
    motion.q[travel] = np.stack([np.interp(at, np.arange(len(back)), column) for column in back.T], axis=1)
    assert any("drawn through" in line for line in Bystander(result).problems())
    motion.q[:] = before
    motion.t_s[:] /= 100
    assert any("too fast" in line for line in Bystander(result).problems())


@pytest.mark.slow
def test_a_table_that_moves_along_the_beads(make_case) -> None:
    case = load_case(make_case(slicing={"h_layer_mm": 2.2}, table={"mode": "coordinated"}))
    result = check(prepare(case))
    motion = result.motion
    assert motion is not None
    assert np.ptp(motion.table[motion.arc == 1, 1]) > np.deg2rad(10)
    assert Bystander(result).problems() == []
    before = motion.table.copy()
    motion.table[np.flatnonzero(motion.arc)[5], 0] += np.deg2rad(0.3)
    assert any("off its bead" in line for line in Bystander(result).problems())
    motion.table[:] = before
    motion.t_s[:] /= 100
    assert any("too fast" in line for line in Bystander(result).problems())


@pytest.mark.slow
def test_a_helix_of_one_endless_bead(tmp_path: Path) -> None:
    """Right round and on: in pieces between which the table turns back."""
    job = job_of(boss_case(tmp_path, table={"mode": "coordinated"}))
    whole = helix(1.5, per_turn=24)
    targets, told = for_moving_table(job.case, job.scene, whole)
    assert [line.code for line in told] == ["bead_split"]
    result = check(replace(job, targets=targets, beads=()))
    assert result.motion is not None
    assert np.rad2deg(result.gravity).max() <= 10.0
    assert Bystander(result).problems() == []
    # every place of the helix is welded: the pieces meet
    beads = int(targets.bead.max()) + 1
    assert beads == 3
    assert np.unique(result.motion.bead[result.motion.arc == 1]).tolist() == list(range(beads))


@pytest.mark.slow
def test_a_table_that_is_neither_square_nor_crossing_moves_along(tmp_path: Path) -> None:
    result = check(skew_job(tmp_path, table={"mode": "coordinated"}))
    assert result.motion is not None
    assert np.rad2deg(result.gravity).max() <= 10.0
    assert Bystander(result).problems() == []


@pytest.mark.slow
def test_the_bystander_sees_a_table_that_is_off_or_too_fast(tmp_path: Path) -> None:
    result = check(prepare(three_case(tmp_path)))
    motion = result.motion
    assert motion is not None
    assert Bystander(result).problems() == []
    before = motion.table.copy()
    welding = np.flatnonzero(motion.arc)
    motion.table[welding[5], 0] += np.deg2rad(0.3)
    assert any("off its bead" in line for line in Bystander(result).problems())
    motion.table[:] = before
    turning = np.flatnonzero(np.diff(motion.table, axis=0).any(axis=1))
    motion.t_s[turning[0] + 1 :] -= 0.5 * (motion.t_s[turning[0] + 1] - motion.t_s[turning[0]])
    assert any("the table too suddenly" in line for line in Bystander(result).problems())
