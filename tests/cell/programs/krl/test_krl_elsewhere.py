"""What is set in one place and counts in another: variables of all, triggers, waits and halts, the override."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.programs.programs import FRAMES, LIN, controller, module

from cell.programs.krl_read import read_krl
from cell.programs.program import Program

PTP = "PTP {A1 0,A2 -90,A3 90,A4 0,A5 30,A6 0,E1 0,E2 0}\n"
IN_CASE = {"tool_data": {1: {"position_mm": [0, 0, 100]}}, "base_data": {5: {"position_mm": [0, 0, 1], "machine": 2}}}


def run(folder: Path, body: str, **section: object) -> Program:
    return read_krl(module(folder, body), controller(**section))


def doubts(program: Program) -> list[tuple[str, int]]:
    """What is doubted and the line of the move it is told at."""
    return [(doubt.kind, int(program.moves.line[doubt.move])) for doubt in program.doubts]


def test_what_no_part_declares_is_one_for_all(tmp_path: Path) -> None:
    sub = "END\nDEF CHANGE ( )\nV=2\n"
    program = run(tmp_path, FRAMES + "V=1\nCHANGE ( )\n$VEL.CP=V\n" + LIN + sub)
    assert program.moves.speed.tolist() == [2.0]


def test_what_a_part_declares_is_its_own(tmp_path: Path) -> None:
    sub = "END\nDEF CHANGE ( )\nDECL REAL V\nV=0.08\n"
    program = run(tmp_path, "DECL REAL V\n" + FRAMES + "V=0.008\nCHANGE ( )\n$VEL.CP=V\n" + LIN + sub)
    assert program.moves.speed.tolist() == [0.008]


@pytest.mark.parametrize("declared", ["beside", "other"])
def test_a_global_of_a_dat_has_one_value(declared: str, tmp_path: Path) -> None:
    name = "T" if declared == "beside" else "OTHER"
    (tmp_path / f"{name}.dat").write_text(f"DEFDAT {name} PUBLIC\nDECL GLOBAL REAL V=0.008\nDECL REAL W=1\nENDDAT\n")
    (tmp_path / "NEXT.src").write_text(f"DEF NEXT ( )\n$VEL.CP=V\n{LIN}END\n")
    program = run(tmp_path, FRAMES + "V=0.08\nNEXT ( )\n" + LIN)
    assert program.moves.speed.tolist() == [0.08, 0.08]


def test_a_dat_that_another_reads_first_still_belongs_to_its_program(tmp_path: Path) -> None:
    (tmp_path / "NEXT.dat").write_text("DEFDAT NEXT PUBLIC\nDECL GLOBAL REAL V=0.02\nDECL REAL OWN=0.03\nENDDAT\n")
    (tmp_path / "NEXT.src").write_text(f"DEF NEXT ( )\n$VEL.CP=OWN\n{LIN}END\n")
    program = run(tmp_path, FRAMES + "$VEL.CP=V\n" + LIN + "NEXT ( )\n")
    assert program.moves.speed.tolist() == [0.02, 0.03]


@pytest.mark.parametrize("call", ["$TOOL=TOOL_DATA[1]", "BAS(#TOOL,1)"])
def test_a_tool_that_another_part_sets_is_not_the_cases(call: str, tmp_path: Path) -> None:
    sub = "END\nDEF FRAMES ( )\nTOOL_DATA[1]={X 0,Y 0,Z 300,A 0,B 0,C 0}\n"
    body = f"FRAMES ( )\n$BASE=$NULLFRAME\n{call}\n" + LIN + sub
    (tool,) = run(tmp_path, body, read=IN_CASE).tools
    assert tool.T_flange_tcp[2, 3] == pytest.approx(0.3)


def test_a_coupled_base_that_the_program_sets_is_not_the_cases(tmp_path: Path) -> None:
    body = "$TOOL=$NULLFRAME\nBASE_DATA[5]={X 0,Y 0,Z 7,A 0,B 0,C 0}\nBAS(#EX_BASE,5)\n" + LIN
    (base,) = run(tmp_path, body, read=IN_CASE).bases
    assert base.coupled
    assert base.T[2, 3] == pytest.approx(0.007)


def test_the_override_outlasts_the_ini(tmp_path: Path) -> None:
    program = run(tmp_path, "$OV_PRO=50\nBAS(#INITMOV,0)\n" + FRAMES + "$VEL.CP=0.02\n" + LIN)
    assert program.moves.speed.tolist() == [0.01]


def test_corners_rounded_by_the_orientation_may_be_rounded_anywhere(tmp_path: Path) -> None:
    program = run(tmp_path, FRAMES + LIN.strip() + " C_ORI\n" + LIN)
    assert program.moves.blend[0] >= 0.5  # m: the half of the move bounds it


@pytest.mark.parametrize(
    ("trigger", "before"),
    [
        ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO ARC_ON ( ) PRIO=-1", 1),
        ("TRIGGER WHEN DISTANCE=1 DELAY=0 DO ARC_ON ( ) PRIO=-1", 2),
    ],
)
def test_a_trigger_that_calls_a_hook_is_the_arc(trigger: str, before: int, tmp_path: Path) -> None:
    program = run(tmp_path, FRAMES + PTP + trigger + "\n" + LIN + LIN + "ARC_OFF ( )\n")
    assert [(event.kind.value, event.before) for event in program.events] == [("arc_on", before), ("arc_off", 3)]
    assert not program.doubts


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("TRIGGER WHEN DISTANCE=0 DELAY=500 DO ARC_ON ( )", "a TRIGGER with DELAY = 500 ms: arc_on is taken"),
        ("TRIGGER WHEN PATH=ArcGetPath(1) DELAY=0 DO ARC_ON ( )", "a TRIGGER with a computed PATH or DELAY"),
        ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO ELSEWHERE ( )", "a TRIGGER calls ELSEWHERE, which is not run"),
        ("INTERRUPT DECL 5 WHEN $IN[1]==TRUE DO EVADE ( )", "an interrupt is declared"),
        ("GLOBAL INTERRUPT DECL 5 WHEN $IN[1]==TRUE DO EVADE ( )", "an interrupt is declared"),
    ],
)
def test_what_is_not_followed_is_doubted_with_its_line(statement: str, words: str, tmp_path: Path) -> None:
    found = doubts(run(tmp_path, FRAMES + PTP + statement + "\n" + LIN))
    assert [line for _, line in found] == [6]
    assert found[0][0].startswith(words)
    assert found[0][0].endswith("(T.src:5)")


@pytest.mark.parametrize("stands", ["WAIT FOR $IN[1]==TRUE", "HALT"])
def test_a_stand_of_unknown_length_inside_a_bead_is_noted(stands: str, tmp_path: Path) -> None:
    on, off = "ARC_ON ( )\n", "ARC_OFF ( )\n"
    inside = run(tmp_path, FRAMES + PTP + on + LIN + stands + "\n" + LIN + off)
    assert [inside.line_of(move).number for move in inside.stands] == [8]
    # the arc is waited for where it starts, and the crater filled where it ends
    assert not run(tmp_path, FRAMES + PTP + on + stands + "\n" + LIN + stands + "\n" + off + LIN).stands


def test_a_wait_that_the_case_calls_harmless_stops_the_advance_run_alone(tmp_path: Path) -> None:
    text = FRAMES + PTP + "ARC_ON ( )\n" + LIN.strip() + " C_DIS\nWAIT FOR $IN[7]\n" + LIN + "ARC_OFF ( )\n"
    its = controller(read={"harmless": [r"WAIT FOR \$IN\[7\]"]})
    program = read_krl(module(tmp_path, text), its)
    assert not program.stands
    assert not program.moves.blend.any()
    assert len(read_krl(module(tmp_path, text.replace("[7]", "[8]")), its).stands) == 1


def test_the_arc_is_struck_once_by_lines_that_follow_one_another(tmp_path: Path) -> None:
    on, off = "ARC_ON ( )\n", "ARC_OFF ( )\n"
    program = run(tmp_path, FRAMES + PTP + on + on + LIN + on + LIN + off + off)
    assert [(event.kind.value, event.before) for event in program.events] == [
        ("arc_on", 1),
        ("arc_on", 2),  # while it burns: a fault
        ("arc_off", 3),
    ]
    np.testing.assert_array_equal(program.moves.line, [4, 7, 9])
