"""Programs for a table of one axis, and for a part that stands still."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.cells.arm_models import table
from support.jobs.boss_motion import boss_case, result_of

from cell.programs.export import export_program
from cell.programs.exported.exported import Exported
from cell.programs.orientation import frames_of_poses
from cell.programs.robodk_script import robodk_script
from cell.verdict.result import Result
from slicing import Code

BENCH = """<mujoco><compiler angle="degree"/><worldbody><geom name="slab" type="box" size="0.2 0.2 0.15"
pos="0 0 0.15"/><frame pos="0 0 0.3" euler="0 0 20"><site name="table" euler="0 0 50"/></frame></worldbody></mujoco>"""
AT_ZERO = {"E1_deg": 0, "E2_deg": 0}


def exported(folder: Path, model: str, joints: list[str], **sections: Any) -> tuple[Result, Exported]:
    (folder / "table.xml").write_text(model, encoding="utf-8")
    positioner = {"model": "table.xml", "joints": joints, "position_mm": [1500, 0, 0], "rotation_deg": [0, 0, -90]}
    result = result_of(boss_case(folder, positioner=positioner, **{"table": AT_ZERO, **sections}))
    assert result.motion is not None, "the part can be built at this table"
    made = export_program(result.job, result.motion)
    assert made.fault is None
    assert made.result is not None
    assert made.result.feasible
    return result, made


@pytest.mark.parametrize(
    ("missing", "kept", "active"), [("tilt", "E2", 2), pytest.param("turn", "E1", 1, marks=pytest.mark.slow)]
)
def test_an_axis_that_the_table_has_not_stands_in_no_point(tmp_path, missing, kept, active):
    _, made = exported(tmp_path, table(**{missing: None}), [kept])
    text = "".join(made.files.values())
    other = {"E1": "E2", "E2": "E1"}[kept]
    assert f",{kept} " in text
    assert f"{other} " not in text
    assert f"$ACT_EX_AX = {active}\r\n" in text
    assert ("$VEL_EXTAX[2]" in text) == (active == 2)
    assert "EK(" in text
    script = robodk_script(made.written.program, "BOSS")
    steps = ast.literal_eval("[" + script.partition("STEPS = [")[2].partition("\n]")[0] + "]")
    assert {len(step[7]) for step in steps if step[0] != "event"} == {1}


@pytest.mark.parametrize("name", [pytest.param("E2", marks=pytest.mark.slow), "TURN"])
def test_what_a_program_calls_the_one_axis_of_a_table_is_told(tmp_path, name):
    _, made = exported(tmp_path, table(tilt=None).replace('"E2"', f'"{name}"'), [name])
    said = [str(line) for line in made.warnings if getattr(line, "code", None) is Code.PROGRAM_TABLE]
    assert [line.startswith(f"program: the table's axis {name} is E2 in the program") for line in said] == (
        [] if name == "E2" else [True]
    )


def test_a_part_that_stands_still_has_a_base_that_no_axis_moves(tmp_path):
    result, made = exported(tmp_path, BENCH, [])
    text = "".join(made.files.values())
    for word in ("E1 ", "E2 ", "EK", "$ACT_EX_AX", "$VEL_EXTAX", "$ASYNC_AXIS"):
        assert word not in text
    assert not any("MACHINE_DEF" in line for line in made.warnings)
    told = [str(line) for line in made.warnings if getattr(line, "code", None) is Code.PROGRAM_FRAME]
    assert [
        line.startswith("program: the base is given in the arm's base: the controller must have $ROBROOT")
        for line in told
    ] == [True]
    assert made.result is not None
    read = [str(line) for line in made.result.warnings if getattr(line, "code", None) is Code.PROGRAM_FRAME]
    assert len(read) == 1
    assert read[0].endswith("its base stands in the world: taken in the arm's base ($WORLD = $ROBROOT)")
    base = made.written.program.bases[0]
    np.testing.assert_allclose(base.T, result.job.scene.T_base_part(0.0, 0.0), atol=1e-9)
    # the points are the part's: the first of a bead is its first target
    moves, motion = made.written.program.moves, result.motion
    assert motion is not None
    welded = int(np.flatnonzero(motion.arc)[0])
    T = frames_of_poses(moves.pose[made.written.row.tolist().index(welded)])
    np.testing.assert_allclose(T[:3, 3] * 1e3, result.job.targets.position[0], atol=2e-3)


@pytest.mark.slow
def test_a_base_by_number_stands_still_as_well(tmp_path):
    _, made = exported(tmp_path, BENCH, [], controller={"base": 3})
    assert "$BASE = BASE_DATA[3]" in "".join(made.files.values())
    assert not made.written.program.bases[0].coupled
