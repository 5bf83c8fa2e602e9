"""Beads that go further round than the table turns: few pieces, each of which the table can follow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, job_of
from support.parts.helix import helix

from cell.coordination.table_schedule import Schedule
from cell.job.job import Job
from cell.job.table_winding import split_beads
from cell.scene.table_freedom import NAMES, TableFreedom
from slicing import Targets

CONE = np.deg2rad(10.0)


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    return job_of(boss_case(tmp_path_factory.mktemp("boss")))


def free(job: Job, **more: object) -> TableFreedom:
    return TableFreedom.of(job.scene, NAMES, (0.0, 0.0))


def fits(job: Job, targets: Targets) -> bool:
    length = np.linalg.norm(np.diff(targets.position, axis=0), axis=1) * 1e-3
    way = Schedule(free(job), CONE, np.deg2rad([100.0, 150.0])).along(targets.normal, targets.bead, length)
    return bool(way.off.max() <= CONE)


@pytest.mark.parametrize(("turns", "pieces"), [(0.5, 1), (1.0, 2), (3.0, 6)])
def test_pieces_that_the_table_can_follow(job: Job, turns: float, pieces: int) -> None:
    whole = helix(turns)
    split, count = split_beads(whole, free(job), CONE)
    assert count == {0: pieces}
    assert split.bead.max() + 1 == pieces
    assert fits(job, split)
    assert fits(job, whole) == (pieces == 1)
    # a piece begins at the target where the one before ended; nothing else changes
    again = np.flatnonzero(np.diff(split.bead))
    assert (split.position[again] == split.position[again + 1]).all()
    assert (split.normal[again] == split.normal[again + 1]).all()
    kept = np.delete(np.arange(len(split)), again + 1)
    assert (split.position[kept] == whole.position).all()
    assert not split.closed[:pieces].any()
    assert len(split.closed) == pieces


def test_other_beads_keep_their_targets(job: Job) -> None:
    own = job.targets
    split, count = split_beads(own, free(job), CONE)
    assert set(count.values()) == {1}
    assert split is own


def test_an_endless_axis_needs_no_pieces(tmp_path: Path) -> None:
    from support.cells.skew_tables import skew_job

    job = skew_job(tmp_path, turn="")
    endless = TableFreedom.of(job.scene, NAMES, (0.0, 0.0))
    assert np.isinf(endless.high[1])
    whole = helix(3.0)
    split, _ = split_beads(whole, endless, CONE)
    assert split is whole
    length = np.linalg.norm(np.diff(whole.position, axis=0), axis=1) * 1e-3
    way = Schedule(endless, CONE, np.deg2rad([100.0, 150.0])).along(whole.normal, whole.bead, length)
    assert way.off.max() <= CONE
    assert np.ptp(way.tables[:, 1]) > 2 * np.pi * 2.9
