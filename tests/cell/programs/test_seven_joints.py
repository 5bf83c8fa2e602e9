"""Poses leave one joint of an arm of seven to the controller: no program of them is written or called feasible."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.cells.arm_models import arm
from support.jobs.boss_motion import boss_case, job_of, result_of

from cell.cli.main import main
from cell.errors import InputError
from cell.job.job import Job
from cell.programs.export import export_program
from cell.programs.program import BaseFrame, MoveKind, Moves, Program, ToolFrame
from cell.programs.program_check import check_program

NAMES = ["A0", "A1", "A2", "A3", "A4", "A5", "A6"]


def seven_joints(folder: Path) -> Path:
    """The boss under an arm that stands on a turning base."""
    text = arm(under='<joint name="A0" axis="0 0 1" range="-30 30"/>', before=(0.0,))
    text = text.replace('data="180 158', 'data="90 180 158').replace('data="350 69', 'data="100 350 69')
    (folder / "arm.xml").write_text(text, encoding="utf-8")
    robot = {"model": "arm.xml", "base": "world", "position_mm": [0, 0, 10], "joints": NAMES}
    return boss_case(folder, robot=robot, roll={"fixed_deg": 20.0})


def small_program(job: Job, to: MoveKind | None) -> Program:
    """Two moves of all axes, and one to the pose where the arm stands."""
    joints = np.tile(job.scene.home, (3, 1))
    joints[1, 0] += 0.1
    moves = Moves.empty(3, axes=job.scene.chain.n)
    kind, pose = np.full(3, int(MoveKind.AXES)), moves.pose.copy()
    if to is not None:
        kind[2], joints[2], pose[2] = int(to), np.nan, 0.0
    zeros, external = np.zeros(3, dtype=np.int64), np.zeros((3, 2))
    moves = replace(moves, kind=kind, joints=joints, pose=pose, external=external, tool=zeros, base=zeros)
    return Program("SMALL", moves, (), (ToolFrame(np.eye(4)),), (BaseFrame(np.eye(4), coupled=True),))


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return seven_joints(tmp_path_factory.mktemp("seven"))


@pytest.mark.parametrize("to", [MoveKind.LINEAR, MoveKind.CIRCULAR, MoveKind.AXES])
def test_a_pose_is_refused_and_axes_are_run(case, to):
    job = job_of(case)
    with pytest.raises(InputError, match=r"SMALL: move 2: the arm has 7 joints: X Y Z A B C leave one of them"):
        check_program(job, small_program(job, to))
    assert len(check_program(job, small_program(job, None)).run.motion.t_s) > 5


def test_no_program_is_written(case, tmp_path, capsys):
    result = result_of(case)
    assert result.motion is not None
    with pytest.raises(InputError, match=r"robot.joints: no program is written for an arm of 7 joints"):
        export_program(result.job, result.motion)
    assert main(["export", str(case), "--krl", str(tmp_path / "out")]) == 2
    assert "--motion of rbam check" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
