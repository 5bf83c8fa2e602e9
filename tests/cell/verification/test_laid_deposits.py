"""A bead's layer is there for the step away from the bead, and not yet for the one that welds its last piece.

For the table, which turns it while it is welded, it is there from its first bead on.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.jobs.boss_motion import NEAR_HOME, boss_case, job_of, result_of
from support.jobs.random_jobs import own_result

from cell.motion.motion import Motion
from cell.shipped import MODELS_DIR
from cell.verification.arm_clearances import arm_along_motion, nearest_along_motion
from cell.verification.bead_samples import COARSE, dense, rows_of
from cell.verification.laid_deposits import LaidDeposits
from cell.verification.motion_check import check_motion

# beside the wire, so low that it is nearer to the layer just laid than what is welded may be to anything
PIN = '<geom name="pin" class="torch_collision" type="sphere" size="0.0015" pos="-0.007 0 0.116"/>'


def motion(arc: list[int], target: list[int]) -> SimpleNamespace:
    """Rows of a motion."""
    on = np.array(arc)
    welding = (on[:-1] & on[1:]).astype(bool)
    return SimpleNamespace(t_s=np.arange(len(arc)), arc=on, target=np.array(target), welding=welding)


def test_the_layer_counts_from_where_its_bead_ends() -> None:
    # two layers of two beads each, of two targets
    job = SimpleNamespace(
        targets=range(8),
        laid=np.array([1, 1, 1, 1, 2, 2, 2, 2]),
        deposits_before=np.array([0, 0, 0, 0, 1, 1, 1, 1]),
    )
    rows = motion([0, 1, 1, 0, 1, 1, 0, 1, 1, 0], [0, 0, 1, 1, 2, 3, 3, 4, 5, 5])
    laid = LaidDeposits.of(job, rows, np.repeat(np.arange(9), 2))  # type: ignore[arg-type]
    # to the first bead, it, from it to the second, it, from it to the next layer's, it, and from it
    assert laid.between.tolist() == [0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 1, 1, 1, 1, 1, 1, 2]
    assert laid.at.tolist() == [0, 0, 0, 0, 1, 1, 1, 1, 1, 0, 1, 1, 1, 1, 1, 1, 2, 2]
    # for the table a layer is there as soon as its first bead begins
    table = LaidDeposits.of(job, rows, np.repeat(np.arange(9), 2), for_table=True)  # type: ignore[arg-type]
    assert table.between.tolist() == [0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2]
    part = laid.part(7, 10)
    assert part.at.tolist() == [1, 1, 0, 1]
    assert part.between.tolist() == [1, 0, 0]


def test_where_nothing_is_welded_nothing_is_laid() -> None:
    laid = LaidDeposits.of(SimpleNamespace(targets=()), motion([0, 0], [0, 0]), np.zeros(3, dtype=np.int64))  # type: ignore[arg-type]
    assert laid.at.tolist() == [0, 0, 0]
    assert laid.between.tolist() == [0, 0]


def test_what_is_being_welded_is_not_turned_through_a_fixture(tmp_path: Path) -> None:
    """The table turns there and back while one bead is welded: at the bead's ends nothing is met."""
    there, away = np.deg2rad([[90.0, 180.0], [90.0, 150.0]])
    free = job_of(boss_case(tmp_path))
    t, T = free.targets, free.scene.T_world_base() @ free.scene.T_base_part(*away)
    inside = (t.position[0] + 1.3 * t.normal[0]) * 1e-3  # of a layer 2.2 mm thick
    at_mm = ((T[:3, :3] @ inside + T[:3, 3]) * 1e3).tolist()
    pin = {"name": "pin", "box": {"size_mm": [1, 1, 1]}, "position_mm": at_mm}
    job = job_of(boss_case(tmp_path, fixtures=[pin]))
    turning = np.linspace(there, away, 16)
    table = np.concatenate([[there], turning, turning[::-1]])
    count, zero = len(table), np.zeros(len(table), dtype=np.int64)
    rows = Motion(
        t_s=np.arange(float(count)),
        q=np.tile(job.scene.home, (count, 1)),
        table=table,
        arc=np.array([0] + [1] * (count - 1)),
        bead=zero,
        layer=zero,
        target=zero,
        names=job.scene.chain.names,
    )

    def met(motion: Motion) -> bool:
        return any("pin" in f.detail.get("pair", ()) for f in check_motion(job, motion).findings)

    assert met(rows)
    assert not met(replace(rows, arc=np.array([0] * (count - 2) + [1, 1])))  # nothing is laid as it turns


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """One layer by a torch with a pin, and a clearance that the pin does not keep from it while its end is welded."""
    text = (MODELS_DIR / "cmt_torch" / "cmt_torch.xml").read_text(encoding="utf-8")
    (tmp_path / "torch.xml").write_text(text.replace('<site name="tcp"', f'{PIN}<site name="tcp"'), encoding="utf-8")
    return boss_case(
        tmp_path,
        tool={"model": "torch.xml"},
        checks={"clearance_mm": 2.3},
        beads={"pattern": "zigzag", "width_mm": 4.0},
        robot=NEAR_HOME,
        roll={"fixed_deg": 20.0},
        slicing={"strategy": "cylindrical", "h_layer_mm": 6.6, "h_max_mm": 7.0},
    )


def test_the_last_piece_of_a_bead_is_welded_where_its_layer_would_be_too_near(case: Path) -> None:
    result = result_of(case)
    job, motion = result.job, result.motion
    assert motion is not None
    end = int(np.flatnonzero(motion.welding)[-1])
    steps = np.arange(len(motion.t_s) - 1)
    sampled = dense(job, motion, rows_of(job, motion), COARSE, (steps >= end - 8) & (steps <= end + 3))
    laid = LaidDeposits.of(job, motion, sampled.row)
    seen = arm_along_motion(job, sampled, laid, [])
    assert seen.clear.distance.min() >= 2.3e-3
    assert not len(seen.unproven[0])
    _, nearest = nearest_along_motion(job, sampled, laid, seen.clear, [])
    assert nearest.distance[0] >= 2.3e-3
    # the last step is too near to the layer as it is laid from its end on
    most = replace(laid, between=np.maximum(laid.at[:-1], laid.at[1:]))
    assert arm_along_motion(job, sampled, most, []).unproven[0].size
    _, nearest = nearest_along_motion(job, sampled, most, seen.clear, [])
    assert nearest.distance[0] < 2.3e-3


@pytest.mark.slow
def test_such_a_motion_is_feasible_to_its_own_check(case: Path) -> None:
    result, wrong = own_result(case)
    assert result.motion is not None
    assert wrong == []
