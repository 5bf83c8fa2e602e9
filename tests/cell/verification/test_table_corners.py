"""A table whose corners are rounded meets what its rows keep clear of, and that is found."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, job_of

from cell.job.job import Job
from cell.motion.motion_file import BlendedRows
from cell.timing.blending import blended
from cell.verification.bead_samples import SampledMotion
from cell.verification.blended_motion import sampled_runs, table_blend_collisions
from cell.verification.collisions import table_collisions
from cell.verification.laid_deposits import LaidDeposits

TIP_MM = (300.0, 0.0, 300.0)  # of a rod that stands beside the faceplate and turns with it
SUPPORT_MM = 100.0
ROD = {
    "name": "rod",
    "on": "table",
    "cylinder": {"radius_mm": 2, "height_mm": 100},
    "position_mm": [TIP_MM[0], TIP_MM[1], TIP_MM[2] - 50],
}
CORNERS = np.deg2rad([[0.0, 0.0], [20.0, 0.0], [20.0, 30.0]])  # E1 tilts, then E2 turns
ZONE = 0.12  # rad


def rows() -> tuple[np.ndarray, np.ndarray]:
    """Table angles at samples on two straight ways, and the length to each, rad."""
    legs = [np.linspace(a, b, 26) for a, b in pairwise(CORNERS)]
    tables = np.concatenate([legs[0], legs[1][1:]])
    return tables, np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(tables, axis=0), axis=1))])


def tip(job: Job, tables: np.ndarray) -> np.ndarray:
    """Where the rod's tip is, world, mm."""
    in_part = np.array([TIP_MM[0], TIP_MM[1], TIP_MM[2] - SUPPORT_MM, 1e3]) * 1e-3
    return np.array([(job.scene.T_world_base() @ job.scene.T_base_part(*E) @ in_part)[:3] * 1e3 for E in tables])


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    folder = tmp_path_factory.mktemp("corner")
    free = job_of(boss_case(folder, fixtures=[ROD]))
    tables, s = rows()
    at = tip(free, blended(tables, s, ZONE, np.array([s[25]])))[0]
    # the rows keep well away from there
    assert np.linalg.norm(tip(free, tables) - at, axis=1).min() > 7.0
    wall = {"name": "wall", "box": {"size_mm": [2, 2, 2]}, "position_mm": at.tolist()}
    return job_of(boss_case(folder, fixtures=[ROD, wall]))


def met(job: Job, zone: float) -> list[Any]:
    tables, s = rows()
    q = np.concatenate([np.zeros((len(tables), job.scene.chain.n)), tables], axis=1)
    way = SampledMotion(np.arange(len(q)), q, np.tile(np.eye(4), (len(q), 1, 1)), np.tile(np.eye(4), (len(q), 1, 1)))
    laid = LaidDeposits(np.zeros(len(q), dtype=np.int64), np.zeros(len(q) - 1, dtype=np.int64))
    assert table_collisions(job, way, laid) == []
    read = SimpleNamespace(motion=None, row=np.arange(len(q)) + 1, blended=(BlendedRows(0, len(q) - 1, s, zone),))
    return table_blend_collisions(job, list(sampled_runs(job, read, way, way)), way, laid)


def test_what_a_rounded_corner_of_the_table_meets_is_found(job: Job) -> None:
    found = met(job, ZONE)
    assert found
    assert {f.reason for f in found} == {"collision"}
    assert all({"wall", "rod"} <= {name.split("/")[-1] for name in f.failure.pair} for f in found)
    assert all(f.row <= 25 <= f.to_row or abs(f.row - 25) <= 3 for f in found)


def test_a_sharp_corner_of_the_table_meets_nothing(job: Job) -> None:
    assert met(job, 0.01) == []


def test_a_table_that_stands_is_not_looked_at(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cell.verification.blended_motion.TableChecker", lambda *_: pytest.fail("looked at"))
    q = np.zeros((3, job.scene.chain.n + 2))
    way = SampledMotion(np.arange(3), q, np.tile(np.eye(4), (3, 1, 1)), np.tile(np.eye(4), (3, 1, 1)))
    assert table_blend_collisions(job, [], way, np.zeros(3, dtype=np.int64)) == []


def test_a_turn_about_the_tcp_is_no_stop_on_a_bead_but_a_wait_is():
    """Where the torch turns in one place the corners before and behind it are rounded across the turn."""
    at = np.array([0.0, 1.0, 2.0, 2.0, 3.0, 4.0, 4.0, 5.0]) * 1e-3
    q = np.zeros((8, 8))
    q[:, 0], q[3:, 3] = at, 0.4  # turns at 2 mm, waits at 4 mm
    Ts = np.tile(np.eye(4), (8, 1, 1))
    Ts[:, 0, 3] = at
    sampled = SampledMotion(np.minimum(np.arange(8), 6), q, Ts, np.tile(np.eye(4), (8, 1, 1)))
    read = SimpleNamespace(
        row=np.arange(8), motion=SimpleNamespace(welding=np.ones(7, dtype=bool)), blended=None, grain=(0.0, 0.0)
    )
    job = SimpleNamespace(case=SimpleNamespace(process=SimpleNamespace(blend_mm=1.0)))
    (run,) = sampled_runs(job, read, sampled, sampled)
    assert (run.low, run.high, run.zone) == (0, 5, 1e-3)
    assert (np.diff(run.length) > 0).all()
    rounded = blended(q[:6], run.length, run.zone)
    assert 0.05 < rounded[2, 3] < 0.35  # the turn has begun before its place is reached, and is done behind it
