"""How far rows of a motion are apart at most, as the README says: 16 mm and about 2 degrees."""

from __future__ import annotations

import numpy as np
import pytest
from support.paths import ROOT

from cell.case.read import load_case
from cell.job.job import Job, prepare
from cell.planning.bead_plan import plan_bead
from cell.planning.context import Context
from cell.scene.scene import table_angles
from cell.shipped import DEFAULT_CASE
from cell.verdict.check import check_fixed

# deg: how many rows a bead takes is told from its targets' configurations; between them a joint may be faster
ABOUT_2, ROUND_A_HUB = 2.2, 3.0


@pytest.mark.slow
def test_rows_of_long_straight_beads_are_no_further_apart_than_is_said() -> None:
    job = prepare(load_case(ROOT / "models" / "cases" / "boiler.case.yaml"))
    motion = check_fixed(job, job.case.table.E1_deg, job.case.table.E2_deg).motion
    assert motion is not None
    way, turn = steps(job, motion.q)
    assert 15e-3 < way[motion.welding].max() <= 16e-3
    assert 1.0 < turn[motion.welding].max() <= ABOUT_2
    assert turn[~motion.welding].max() <= 1.0


def test_rows_of_a_bead_round_a_hub_are_no_further_apart_than_is_said() -> None:
    job = prepare(load_case(DEFAULT_CASE))
    context = Context.of(job, table_angles(job.scene, job.case.table.E1_deg, job.case.table.E2_deg))
    plan = plan_bead(context, 0, int(np.searchsorted(job.targets.bead, 1)), None)
    assert plan.whole
    way, turn = steps(job, plan.stretches[0].q)  # before rows are put in for straight joint motion to follow it
    assert way.max() <= 16e-3
    assert 1.0 < turn.max() <= ROUND_A_HUB


def steps(job: Job, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Way of the TCP, m, and greatest turn of a joint, deg, from row to row, less rounding."""
    way = np.linalg.norm(np.diff(job.scene.chain.forward(q)[:, :3, 3], axis=0), axis=1)
    turn = np.rad2deg(np.abs(np.diff(q, axis=0)).max(axis=1))
    return way - 1e-9, turn - 1e-6
