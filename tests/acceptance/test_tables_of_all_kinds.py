"""Rings right round a shaft on tables of all kinds, as whole runs that plain MuJoCo looks at again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.cells.lathes import lathe_job, ring_part
from support.jobs.boss_motion import boss_case, job_of
from support.jobs.cases import at, bosses, turned
from support.oracles.bystander import Bystander

from cell.verdict.by_table_mode import check
from cell.verdict.check import check_fixed
from cell.verdict.result import Result

pytestmark = pytest.mark.slow
ALONG = {"mode": "coordinated"}


def codes(result: Result) -> list[str]:
    return [str(getattr(line, "code", "")) for line in result.job.warnings]


def accepted(result: Result) -> None:
    assert result.motion is not None
    assert np.rad2deg(result.gravity).max() <= 10.0
    assert Bystander(result).problems() == []


def test_a_flange_right_round_a_shaft_is_welded_in_pieces(tmp_path: Path) -> None:
    """E2 has 320 degrees."""
    result = check(job_of(boss_case(tmp_path, part=ring_part(tmp_path), table=ALONG)))
    accepted(result)
    assert "bead_split" in codes(result)
    motion = result.motion
    beads = np.unique(motion.bead[motion.arc == 1])
    assert len(beads) == 2
    # the pieces meet, and together they go right round
    p, path = result.job.targets.position, result.job.targets.bead
    ends = [p[path == k][[0, -1]] for k in beads.tolist()]
    assert np.allclose(ends[0][1], ends[1][0])
    assert np.allclose(ends[1][1], ends[0][0], atol=1e-6)


def test_a_rotator_turns_a_flange_in_one_piece(tmp_path: Path) -> None:
    """One level axis without end, and nothing else: the torch stays on top."""
    result = check(lathe_job(tmp_path, part=ring_part(tmp_path), table=ALONG))
    accepted(result)
    assert "bead_split" not in codes(result)
    motion = result.motion
    welding = motion.arc == 1
    assert len(np.unique(motion.bead[welding])) == 1
    assert np.ptp(motion.table[welding, 0]) > np.deg2rad(330)
    assert not motion.table[:, 1].any()


def test_a_rotator_indexes_bosses_all_round(tmp_path: Path) -> None:
    part = bosses(tmp_path, *(turned(at(20, height=2.4), angle) for angle in (0.0, 120.0, 240.0)), length=40)
    result = check(lathe_job(tmp_path, 'range="-300 300"', part=part, table={"mode": "indexed"}))
    assert result.motion is not None
    assert np.rad2deg(result.gravity).max() < 30
    assert {pose.E2_deg for pose in result.poses} == {0.0}
    assert len({pose.E1_deg for pose in result.poses}) == 3
    assert Bystander(result).problems() == []
    one = check_fixed(result.job, *result.asked)
    assert np.rad2deg(one.gravity).max() > 60


def test_a_tilt_alone_keeps_upright_what_it_can(tmp_path: Path) -> None:
    """A positioner whose turn is not planned: `joints: [E1]` of the shipped one."""
    one = {"position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90], "joints": ["E1"]}
    one |= {"max_speed_deg_s": [100], "max_acceleration_deg_s2": [200]}
    result = check(job_of(boss_case(tmp_path, positioner=one, table={"mode": "coordinated", "upright_deg": 25})))
    assert result.motion is not None
    assert 10 < np.rad2deg(result.gravity).max() <= 25.0
    assert Bystander(result).problems() == []
    strict = check(job_of(boss_case(tmp_path, positioner=one, table=ALONG)))
    lost = [row for row in strict.rows if row.reason is not None]
    assert lost
    assert {row.reason for row in lost} == {"gravity"}
