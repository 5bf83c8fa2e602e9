"""What the reader makes of KRL: of programs in the style of four makers, and of single statements."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.paths import ROOT
from support.programs.programs import FRAMES, LIN, controller, module

from cell.errors import InputError
from cell.programs.controller import ReadLimits
from cell.programs.krl_read import read_krl
from cell.programs.orientation import frames_of_poses, pose_of
from cell.programs.program import EventKind, MoveKind, Program

DATA = ROOT / "tests" / "data" / "programs"
OUTPUT = {"arc_on": [r"^\$OUT\[1\]\s*=\s*TRUE"], "arc_off": [r"^\$OUT\[1\]\s*=\s*FALSE"]}


def events(program: Program) -> list[tuple[str, int]]:
    return [(event.kind.value, event.before) for event in program.events]


def run(folder: Path, body: str, **section: object) -> Program:
    return read_krl(module(folder, body), controller(**section))


# -- programs of others ------------------------------------------------------------------------------------------


def test_robots_style() -> None:
    program = read_krl(DATA / "robots" / "WALL_T_ROB1.src", controller(read=OUTPUT))
    moves = program.moves
    assert moves.kind.tolist() == [0, 0, 1, 1, 1, 1, 2]
    assert (moves.status[1], moves.turn[1]) == (2, 2)
    np.testing.assert_allclose(np.degrees(moves.external[:, 1]), [0, 0, 0, 5.5, 11, 16.5, 16.5])
    np.testing.assert_allclose(moves.speed[2:], [0.1, 0.008, 0.008, 0.008, 0.008])
    np.testing.assert_allclose(moves.blend[3:], [0.001, 0.001, 0, 0.001])
    assert events(program) == [("arc_on", 3), ("arc_off", 6), ("wait", 6)]
    (tool,), (base,) = program.tools, program.bases
    np.testing.assert_allclose(tool.T_flange_tcp[:3, 3], [0.0635, 0, 0.41225])
    assert (base.coupled, base.machine) == (True, 2)
    np.testing.assert_allclose(base.T, frames_of_poses(np.array([0, 0, 0.1, math.radians(30), 0, 0])), atol=1e-12)
    assert str(program.line_of(5)) == "WALL_T_ROB1_001.src:5"


def test_prc_style() -> None:
    program = read_krl(DATA / "prc" / "PRC_TEST.src", controller())
    moves = program.moves
    assert len(moves) == 13
    assert (program.tools[0].number, program.bases[0].number, program.bases[0].coupled) == (1, 2, False)
    assert (moves.status[1], moves.turn[1]) == (6, -1)
    # LIN_REL {Z 2.5} in the third round; along the tool's x, which B 90 turns to -z, in all others
    np.testing.assert_allclose(moves.pose[2:10, 2], [0.3, 0.301, 0.3, 0.301, 0.3, 0.3025, 0.3, 0.301], atol=1e-12)
    assert moves.speed[10] == 0.1  # WITH, in the spline block alone
    assert program.passed_over["segments of splines, taken as straight lines"] == 2
    np.testing.assert_allclose(np.degrees(moves.joints[-1]), [0, -90, 90, 0, 0, 0])


def test_robodk_style() -> None:
    program = read_krl(DATA / "robodk" / "Prog1Main.src", controller())
    moves = program.moves
    assert moves.kind.tolist() == [0, 1, 1, 1]
    assert moves.blend.tolist() == [0, 0, 0, 0]  # $OUT and WAIT FOR stop the advance run behind C_DIS
    assert moves.blend_share[0] == 0.1
    assert moves.axis_share[0] == 0.5
    assert events(program) == [("arc_on", 2), ("arc_off", 4), ("wait", 4)]
    assert program.files == ("Prog1Main.src", "Prog1.src", "Prog11.src")


def test_adaone_style() -> None:
    section = {"tool_data": {4: {"position_mm": [1, 2, 3]}}, "base_data": {7: {"machine": 2}}}
    program = read_krl(DATA / "adaone" / "PART_main.src", controller(read=section))
    assert (program.bases[0].coupled, program.bases[0].number, program.tools[0].number) == (True, 7, 4)
    assert events(program) == [
        *(("layer_start", 1), ("arc_on", 2), ("arc_off", 4)),
        *(("layer_start", 4), ("arc_on", 5), ("arc_off", 7)),
    ]
    np.testing.assert_allclose(program.moves.speed[1:], [0.1, 0.008, 0.008, 0.1, 0.008, 0.008])
    assert program.moves.blend_share.tolist() == [0, 0, 0.6, 0, 0, 0.6, 0]


# -- statements --------------------------------------------------------------------------------------------------


def test_what_a_point_leaves_out_stays(tmp_path: Path) -> None:
    program = run(tmp_path, FRAMES + LIN + "LIN {Y 20}\nLIN {E1 30}\nlin {z 60,b 45} c_dis\n")
    moves = program.moves
    np.testing.assert_allclose(moves.pose[3, :3], [0.1, 0.02, 0.06])
    np.testing.assert_allclose(np.degrees(moves.pose[3, 3:]), [0, 45, 0], atol=1e-12)
    np.testing.assert_allclose(np.degrees(moves.external[:, 0]), [0, 0, 30, 30])


def test_axes_that_are_left_out_stay(tmp_path: Path) -> None:
    body = "PTP {A1 10,A2 -90,A3 90,A4 0,A5 0,A6 5,E1 1,E2 2}\nPTP {A5 30}\nPTP_REL {A1 -4,E2 3}\nPTP $AXIS_ACT\n"
    moves = run(tmp_path, body).moves
    np.testing.assert_allclose(np.degrees(moves.joints[-1]), [6, -90, 90, 0, 30, 5])
    np.testing.assert_allclose(np.degrees(moves.external[-1]), [1, 5])
    assert len(moves) == 3  # the last goes to where the arm is


def test_frames_in_frames(tmp_path: Path) -> None:
    body = (
        "DECL FRAME F,G\nF={X 10,Y 0,Z 0,A 90,B 0,C 0}\nG={X 5,Y 0,Z 0,A 0,B 0,C 0}\n$TOOL=F:G\n$BASE=INV_POS(F)\n"
        "LIN F:{X 0,Y 1,Z 0,A 0,B 90,C 0}\n"
    )
    program = run(tmp_path, body)
    np.testing.assert_allclose(program.tools[0].T_flange_tcp[:3, 3], [0.01, 0.005, 0], atol=1e-12)
    np.testing.assert_allclose(program.bases[0].T[:3, 3], [0, 0.01, 0], atol=1e-12)
    np.testing.assert_allclose(program.moves.pose[0, :3], [0.009, 0, 0], atol=1e-12)


def test_a_coupled_base_takes_offsets_and_knows_its_root(tmp_path: Path) -> None:
    offset = "{X 0,Y 0,Z 7,A 0,B 0,C 0}"
    body = f"$TOOL=$NULLFRAME\n$BASE=EK(MACHINE_DEF[3].ROOT,MACHINE_DEF[3].MECH_TYPE,BASE_DATA[1]:{offset})\n"
    section = {"base_data": {1: {"position_mm": [0, 0, 3]}}, "machines": {3: {"position_mm": [1500, 0, 0]}}}
    (base,) = run(tmp_path, body + LIN, read=section, machine=3).bases
    assert (base.coupled, base.machine, base.number) == (True, 3, None)
    np.testing.assert_allclose(base.T[2, 3], 0.01)
    assert base.root is not None
    assert base.root[0, 3] == 1.5
    body = "$TOOL=$NULLFRAME\n$BASE=EK(EX_AX_DATA[1].ROOT,EX_AX_DATA[1].EX_KIN,{X 0,Y 0,Z 0,A 0,B 0,C 0})\n"
    assert run(tmp_path, body + LIN).bases[0].machine == 2  # the first external kinematic


@pytest.mark.parametrize(
    ("statements", "times"),
    [
        ("FOR I=1 TO 7 STEP 3\nLIN {Y 1}\nENDFOR\n", 3),
        ("FOR I=3 TO 1 STEP -1\nLIN {Y 1}\nENDFOR\n", 3),
        ("I=0\nWHILE I<4\nI=I+1\nLIN {Y 1}\nENDWHILE\n", 4),
        ("I=9\nREPEAT\nLIN {Y 1}\nUNTIL I>3\n", 1),
        ("I=0\nLOOP\nI=I+2\nIF I>6 THEN\nEXIT\nENDIF\nLIN {Y 1}\nENDLOOP\n", 3),
        ("I=7/2\nSWITCH I\nCASE 1,2\nHALT\nCASE 3\nLIN {Y 1}\nDEFAULT\nLIN {Y 1}\nLIN {Y 2}\nENDSWITCH\n", 1),
        ("R=7\nIF R/2==3.5 THEN\nLIN {Y 1}\nENDIF\n", 1),
        ("IF NOT (TRUE AND FALSE) AND (2*3+1 == 7) THEN\nLIN {Y 1}\nELSE\nLIN {Y 1}\nLIN {Y 1}\nENDIF\n", 1),
        ("IF FALSE == TRUE OR TRUE THEN\nLIN {Y 1}\nENDIF\n", 0),  # comparisons bind least
        ("I='B101' B_AND 'H0C'\nFOR J=1 TO I\nLIN {Y 1}\nENDFOR\n", 4),
        ("FOR J=1 TO TWICE(3)\nLIN {Y 1}\nENDFOR\n", 6),
        ("I=1\nBUMP(I)\nFOR J=1 TO I\nLIN {Y 1}\nENDFOR\n", 11),
        ("IF $IN[3] THEN\n$OUT[2]=TRUE\nELSE\nWAIT SEC 0\nENDIF\n", 0),
    ],
)
def test_loops_and_conditions(tmp_path: Path, statements: str, times: int) -> None:
    path = tmp_path / "T.src"
    path.write_text(
        f"DEF T ( )\nDECL INT I,J\nDECL REAL R\n{FRAMES}{LIN}{statements}END\n"
        "DEFFCT INT TWICE(N:IN)\nINT N\nRETURN 2*N\nENDFCT\nDEF BUMP(N:OUT)\nDECL INT N\nN=N+10\nEND\n"
    )
    assert len(read_krl(path, controller()).moves) == 1 + times


def test_the_advance_run_stops(tmp_path: Path) -> None:
    blended = "$APO.CDIS=2\n" + LIN.replace("\n", " C_DIS\n")
    for stop in ("WAIT SEC 0\n", "HALT\n", "WAIT FOR $IN[1]\n", "$OUT[1]=TRUE\n"):
        assert run(tmp_path, FRAMES + blended + stop + LIN).moves.blend.tolist() == [0, 0]
    for kept in ("", "CONTINUE\n$OUT[1]=TRUE\n", ";WAIT SEC 0\n", "$FLAG[1]=TRUE\n"):
        assert run(tmp_path, FRAMES + blended + kept + LIN).moves.blend.tolist() == [0.002, 0]
    assert run(tmp_path, FRAMES + "$ADVANCE=0\n" + blended).moves.blend.tolist() == [0]


def test_triggers_stand_at_the_end_of_the_motion_behind_them(tmp_path: Path) -> None:
    on = "TRIGGER WHEN DISTANCE={} DELAY=20 DO ARC_ON( ) PRIO=-1\n"
    section = {"arc_on": ["ARC_ON"], "arc_off": ["ARC_OFF"]}
    for distance, before in ((0, 1), (1, 2)):
        program = run(tmp_path, FRAMES + LIN + on.format(distance) + LIN + LIN + "ARC_OFF( )\n", read=section)
        assert events(program) == [("arc_on", before), ("arc_off", 3)]
        assert program.events[0].fields == {"delay_ms": 20.0}


def test_a_hook_that_is_a_file_is_run_as_well(tmp_path: Path) -> None:
    module(tmp_path, "LIN {Z 70}\n", name="ARC_ON")
    program = run(tmp_path, FRAMES + LIN + "ARC_ON ( )\n" + LIN)
    np.testing.assert_allclose(program.moves.pose[:, 2], [0.05, 0.07, 0.05])
    assert events(program) == [("arc_on", 1)]


def test_global_parts_and_data_of_other_files_are_found(tmp_path: Path) -> None:
    (tmp_path / "tools.SRC").write_text("DEF tools()\nEND\nGLOBAL DEF Step(d:IN)\nREAL d\nLIN_REL {X d}\nEND\n")
    (tmp_path / "points.dat").write_text("DEFDAT POINTS PUBLIC\nDECL GLOBAL REAL far=25\nENDDAT\n")
    program = run(tmp_path, FRAMES + LIN + "step(FAR)\n")
    np.testing.assert_allclose(program.moves.pose[:, 0], [0.1, 0.125])


def test_relative_motions_after_axes_ask_for_the_arm(tmp_path: Path) -> None:
    path = module(tmp_path, FRAMES + "PTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0,E1 0,E2 0}\nLIN_REL {X 10}\nLIN $POS_ACT\n")
    its = replace(controller(), forward=lambda q, external, tool, base: pose_of(np.eye(4)) + 0.5)
    moves = read_krl(path, its).moves
    np.testing.assert_allclose(moves.pose[1], [0.51, 0.5, 0.5, 0.5, 0.5, 0.5])
    assert len(moves) == 2  # LIN $POS_ACT goes to where the arm is


def test_relative_points_count_from_where_the_motion_begins(tmp_path: Path) -> None:
    body = "PTP_REL {X 10,Z -5}\nCIRC_REL {X 5,Y 5},{X 10,E1 3} C_DIS\nCIRC_REL {Z 1},{Z 2} #TOOL\n"
    moves = run(tmp_path, FRAMES + LIN.replace("B 0", "B 90") + body).moves
    start = moves.pose[0]
    np.testing.assert_allclose(moves.pose[1] - start, [0.01, 0, -0.005, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(moves.pose[2] - moves.pose[1], [0.01, 0, 0, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose(moves.via[2, :3] - moves.pose[1, :3], [0.005, 0.005, 0], atol=1e-12)
    # B 90 turns the tool's z to the base's x
    np.testing.assert_allclose(moves.pose[3, :3] - moves.pose[2, :3], [0.002, 0, 0], atol=1e-12)
    np.testing.assert_allclose(moves.via[3, :3] - moves.pose[2, :3], [0.001, 0, 0], atol=1e-12)
    assert moves.kind.tolist() == [MoveKind.LINEAR, MoveKind.AXES, MoveKind.CIRCULAR, MoveKind.CIRCULAR]


def test_speeds(tmp_path: Path) -> None:
    body = (
        "$VEL={CP 0.5,ORI1 100,ORI2 50}\n$ACC.CP=1.5\nBAS(#VEL_PTP,40)\n$VEL_AXIS[3]=20\n$OV_PRO=50\n"
        + LIN
        + "$OV_PRO=100\nSLIN {Y 5} WITH $VEL.CP=0.02, $APO.CDIS=4 C_DIS\n"
        + LIN
        + "BAS(#INITMOV,0)\n"
        + FRAMES
        + LIN
    )
    moves = run(tmp_path, FRAMES + body).moves
    np.testing.assert_allclose(moves.speed, [0.25, 0.02, 0.5, np.nan])
    np.testing.assert_allclose(moves.blend, [0, 0.004, 0, 0])
    np.testing.assert_allclose(moves.axis_share, [0.1, 0.2, 0.2, np.nan])
    np.testing.assert_allclose(np.degrees(moves.turn_speed[:3]), 50)
    assert moves.acceleration[0] == 1.5


def test_percents_of_the_controller_are_whole_numbers(tmp_path: Path) -> None:
    axes = "PTP {A1 0,A2 -90,A3 90,A4 0,A5 30,A6 0,E1 90,E2 0} C_PTP\n"
    body = FRAMES + "$OV_PRO=49.7\nBAS(#VEL_PTP,12.6)\n$ACC_AXIS[3]=20.2\n$VEL_EXTAX[1]=7.7\n$APO.CPTP=30.6\n" + axes
    moves = run(tmp_path, body + "$APO.CVEL=40.4\n" + LIN.strip() + " C_VEL\n").moves
    np.testing.assert_allclose(moves.axis_share[0], 0.13 * 0.5)
    np.testing.assert_allclose(moves.axis_acceleration[0], 0.2)
    np.testing.assert_allclose(moves.external_share[0], 0.08 * 0.5)
    np.testing.assert_allclose(moves.blend_share, [0.31, 0.4])
    with pytest.raises(InputError, match=r"VEL_AXIS\[i\] is above 0"):
        run(tmp_path, FRAMES + "$VEL_AXIS[1]=0.4\n" + axes)


def test_what_moves_nothing_is_counted(tmp_path: Path) -> None:
    body = (
        "GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )\n"
        "INTERRUPT DECL 4 WHEN $IN[1]==TRUE DO RETRACT ( )\n"
        'INTERRUPT ON 3\n;a word\n$OUT[1]=TRUE\n$OUT[2]=TRUE\nWAIT FOR $IN[1]\nMsgNotify("hello")\nmine ( )\n'
    )
    program = run(tmp_path, FRAMES + body + LIN, read={"harmless": ["^mine"]})
    assert program.passed_over == {
        "WAIT FOR": 1,
        "comments": 1,
        "interrupts": 2,
        "interrupts whose sub-programs are not run": 1,
        "messages": 1,
        "outputs": 2,
        "statements that the case calls harmless": 1,
    }


def test_the_largest_values_are_taken(tmp_path: Path) -> None:
    body = FRAMES + "$VEL.CP=3.0\n$VEL_AXIS[1]=100\n$ADVANCE=5\nWAIT SEC 86400\n" + LIN.replace("X 100", "X 1E6")
    assert run(tmp_path, body).moves.pose[0, 0] == 1000.0


def test_inline_forms(tmp_path: Path) -> None:
    (tmp_path / "T.dat").write_text(
        "DEFDAT T\nDECL E6POS XP1={X 100,Y 0,Z 50,A 0,B 90,C 0,S 6,T 27,E1 0,E2 0,E3 0}\n"
        'DECL FDAT FP1={TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE,POINT2[] " "}\n'
        "DECL LDAT LCPDAT1={VEL 2.0,ACC 100.0,APO_DIST 7.0,APO_FAC 50.0,ORI_TYP #VAR}\n"
        "DECL PDAT PPDAT1={VEL 100.0,ACC 60.0,APO_DIST 30.0}\nENDDAT\n"
    )
    body = (
        "PDAT_ACT=PPDAT1\nFDAT_ACT=FP1\nBAS(#PTP_PARAMS,25)\nPTP XP1 C_PTP\n"
        ";FOLD LIN P1 CONT Vel=0.2 m/s CPDAT1 Tool[1] Base[0];%{PE}\n$BWDSTART=FALSE\nLDAT_ACT=LCPDAT1\nFDAT_ACT=FP1\n"
        "BAS(#CP_PARAMS,0.2)\nLIN XP1 C_DIS C_DIS\n;ENDFOLD\n"
    )
    program = run(tmp_path, body, read={"tool_data": {1: {}}})
    moves = program.moves
    assert (moves.status[0], moves.turn[0], moves.axis_share[0], moves.axis_acceleration[0]) == (6, 27, 0.25, 0.6)
    assert moves.blend_share[0] == 0.3
    assert (moves.speed[1], moves.blend[1]) == (0.2, 0.007)
    assert program.tools[0].number == 1


def test_circles(tmp_path: Path) -> None:
    body = FRAMES + LIN + "CIRC {X 110,Y 10,Z 50},{X 120,Y 0,Z 50}, CA 270 C_DIS\n"
    moves = run(tmp_path, body).moves
    assert moves.kind[1] == MoveKind.CIRCULAR
    np.testing.assert_allclose(moves.via[1, :3], [0.11, 0.01, 0.05])
    np.testing.assert_allclose(np.degrees(moves.arc_angle[1]), 270)


def test_home_is_the_cases(tmp_path: Path) -> None:
    its = replace(controller(), home=np.radians([0, -90, 90, 0, 30, 0]))
    moves = read_krl(module(tmp_path, "PTP HOME\n"), its).moves
    np.testing.assert_allclose(np.degrees(moves.joints[0]), [0, -90, 90, 0, 30, 0])
    assert any("HOME is taken from the case" in doubt.kind for doubt in read_krl(tmp_path / "T.src", its).doubts)


def test_events_carry_what_a_template_says(tmp_path: Path) -> None:
    hooks = {"arc_on": "WELD_ON ( )\nWAIT_FOR_GAS ({bead}, {speed_mm_s:.2f}) ;{sub_volume} {layer:03d}"}
    body = FRAMES + LIN + "WELD_ON ( )\nWAIT_FOR_GAS (12, 8.50) ;SV2 007\n"
    (event,) = run(tmp_path, body, hooks=hooks).events
    assert event.kind == EventKind.ARC_ON  # told by the first line; the second one adds its fields
    assert event.fields == {"bead": 12.0, "speed_mm_s": 8.5, "sub_volume": "SV2", "layer": 7.0}
    hooks = {"arc_on": "WELD_ON ({bead}, {speed_mm_s:.2f}) ;{sub_volume} {layer:03d}"}
    (event,) = run(tmp_path, FRAMES + LIN + "WELD_ON (12, 8.50) ;SV2 007\n", hooks=hooks).events
    assert event.fields == {"bead": 12.0, "speed_mm_s": 8.5, "sub_volume": "SV2", "layer": 7.0}


def test_bounds_are_kept(tmp_path: Path) -> None:
    from cell.errors import InputError

    its = replace(controller(), limits=ReadLimits(statements=500, moves=50, file_bytes=3000, lines=100))
    for body, message in (
        (FRAMES + "LOOP\nI=1\nENDLOOP\n", r"T\.src:\d+: more than 500 statements"),
        (FRAMES + "WHILE TRUE\nENDWHILE\n", r"T\.src:4: more than 500 statements"),
        (FRAMES + "LOOP\n" + LIN + "ENDLOOP\n", r"T\.src:5: is more than move 50"),
        (FRAMES + "T( )\n", r"T\.src:4: calls more than 40"),
        (FRAMES + LIN * 80, r"T\.src: the program has more than"),
        ("\n" * 200, r"T\.src:100: the file has more than 100 lines"),
    ):
        with pytest.raises(InputError, match=message):
            read_krl(module(tmp_path, body), its)
