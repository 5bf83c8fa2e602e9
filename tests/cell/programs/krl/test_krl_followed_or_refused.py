"""A program goes where the controller would have it go; where that is not known, it is refused with its line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.programs.programs import FRAMES, LIN, controller, module

from cell.errors import InputError
from cell.programs.krl_read import read_krl
from cell.programs.program import ANYWHERE, Program

DECLARED = "DECL INT I,N\nDECL REAL R\nDECL E6AXIS SV\nDECL FRAME F,G\nDECL POS PO\nDECL E6POS XP,P[3]\n"
PTP = "PTP {A1 0,A2 -90,A3 90,A4 0,A5 30,A6 0,E1 0,E2 0}\n"
POINT = "{X 100,Y 0,Z 50,A 0,B 90,C 0,S 2,T 10,E1 90,E2 0}"
BEGIN = DECLARED + FRAMES + LIN


def read(folder: Path, body: str, others: str = "", files: dict[str, str] | None = None, **section: object) -> Program:
    path = folder / "T.src"
    path.write_text(f"DEF T ( )\n{body}END\n{others}")
    for name, text in (files or {}).items():
        (folder / name).write_text(text)
    return read_krl(path, controller(**section))


REFUSED = [
    # where the arm is, kept and driven back to
    ("SV=$AXIS_ACT\n" + PTP + "PTP SV\n", "AXIS_ACT after a motion to a point"),
    (PTP + "PTP $AXIS_RET\n", r"goes to an unknown value: \$AXIS_RET"),
    ("XP=$POS_ACT\nPTP XP\n", r"S or T of \$POS_ACT"),
    ("XP=$POS_ACT\nXP.B=XP.B-30\n", "takes one of A B C alone"),
    ("F={X 0,Y 0,Z 0,A 0,B 90,C 0}\nG=$NULLFRAME\nF=G:F\nF.B=0\nLIN F\n", "takes one of A B C alone"),
    # of what it is not known what it holds
    ("RR=7\nLIN {Z RR/2}\n", "may both be INT"),
    ("RR=3.6\nLIN {Z RR}\n", "RR may be INT, and round 3.6"),
    ("P[1]=FORWARD({A1 0},I)\nP[1].Z=100\nLIN P[1]\n", "FORWARD is not among the files"),
    ("XGLOB.Z=200\nLIN XGLOB\n", "XGLOB is declared neither"),
    (f"XP={POINT}\nXP={{Z 9}}\nLIN XP\n", "of XP, which was given without it"),
    ('N=5\nSREAD(S[],ST,OF,"%d",N)\nLIN {Z N}\n', "N is set by what is not followed"),
    ("TRIGGER WHEN DISTANCE=1 DELAY=0 DO N=5\nN=1\nLIN {X 1}\nLIN {Z N}\n", "N is set by the TRIGGER"),
    ("ANIN ON R=1.0*$ANIN[1]\n", "ANIN ON sets a variable over and over"),
    ("DIGIN ON I=$DIGIN1\n", "DIGIN ON sets a variable over and over"),
    ("IMPORT REAL X IS /R1/OTHER..X\nX=50\n", "assigns to X, which is imported"),
    ("IMPORT REAL X IS /R1/OTHER..X\nLIN {Z X}\n", "X is imported"),
    ("PTP XHOME\n", "XHOME is declared neither"),
    # numbers
    ("LIN {Z ATAN2(-1,1)/2}\n", "an angle of ATAN2 that may be -45 or 315"),
    ("R=0\nWHILE R<1.0\nR=R+0.1\nENDWHILE\n", "closer than the seven digits"),
    ("R=0.1*5\nN=R\n", "may round otherwise"),
    ("I=50000\nLIN {Z I*I/50000000}\n", "beyond INT"),
    ("LIN {Z 'HFFFFFFFF'}\n", "beyond INT"),
    ("R=0\nFOR I=1 TO 30000\nR=R+0.1\nENDFOR\nLIN {X R}\n", "may be off by"),
    # modes, frames and what WITH sets
    ("$IPO_MODE=#TCP\nPTP {X 1,Y 2,Z 3,A 0,B 0,C 0}\n", r"\$IPO_MODE is #TCP"),
    ("$ORI_TYPE=#CONSTANT\nSLIN {Z 60} WITH $ORI_TYPE=#VAR\nLIN {Z 70,B 0}\n", r"\$ORI_TYPE is #CONSTANT"),
    ("$TOOL=INV_POS($NULLFRAME)\n$TOOL.B=5\n$TOOL={X 0}\n", "needs X Y Z A B C"),
    # what is not followed
    ("SPLINE\nSPL {X 200}\nENDSPLINE\n", "SPL: the curve of a spline"),
    ("SPLINE\nTIME_BLOCK START\nENDSPLINE\n", "TIME_BLOCK"),
    ("IF I==2 THEN\nELSE IF I==3 THEN\nENDIF\n", "has IF where the line should end"),
    ("CONTINUE\nWAIT SEC 1\n", "CONTINUE before WAIT SEC"),
    ("IF $IN[1] THEN\nMACHINE_DEF[2].ROOT.X=5\nENDIF\n", "a condition decides on moves"),
    ("IF $IN[1] THEN\n$ASYNC_AXIS='B11'\nENDIF\n", "a condition decides on moves"),
    ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO $ASYNC_AXIS='B11'\n", r"sets \$ASYNC_AXIS"),
    ("TRIGGER WHEN PATH=R DELAY=0 DO ARC_ON ( )\n", "a computed PATH or DISTANCE"),
    ("TRIGGER WHEN DISTANCE=I DELAY=0 DO ARC_ON ( )\n", "a computed PATH or DISTANCE"),
    ("TRIGGER WHEN DISTANCE=0 DELAY=FX() DO ARC_ON ( )\n", "sub-program FX is missing"),
    ("LDAT_ACT={VEL 0.1,CIRC_TYP #PATH}\nBAS(#CP_DAT)\n", "LDAT_ACT.CIRC_TYP is #BASE here"),
    ("PDAT_ACT={VEL 50.0,EXAX_IGN 1}\nBAS(#PTP_DAT)\n", "PDAT_ACT.EXAX_IGN is 0 here"),
    ("I=STRLEN(FX())\n", "sub-program FX is missing"),
    ("IR_STOPM(FX())\n", "sub-program FX is missing"),
    ("IF $IN[1] THEN\nBASE_DATA[1].Z=100\nENDIF\n$BASE=BASE_DATA[1]\n", "BASE_DATA is set where line"),
    ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO BASE_DATA[1].Z=1\nBASE_DATA[1]={Z 2}\n$BASE=BASE_DATA[1]\n", "by the TRIGGER"),
    ("N=1\nTRIGGER WHEN DISTANCE=1 DELAY=0 DO SX(N)\nN=1\nLIN {X 1}\nLIN {Z N}\n", "N is set by what is not followed"),
    ("TRIGGER WHEN DISTANCE=1 DELAY=0 DO SX(BASE_DATA[1])\n$BASE=BASE_DATA[1]\n", "is set by what is not followed"),
    ("LIN {E1 ATAN2(SIN(180),COS(180))}\n", "an angle of ATAN2 that may be"),
    ("P[1]=XP\nLIN P\n", "goes to a point or to axes"),
    ("N=5\nV[1]=3\n$VEL=V\n", "depends on an unknown value|is a structure"),
    ("CONFIRM FX()\n", "sub-program FX is missing"),
]


@pytest.mark.parametrize(("body", "why"), REFUSED)
def test_what_is_not_known_is_refused(body: str, why: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"T\.src:\d+: .*" + why):
        read(tmp_path, BEGIN + body)


def heights(program: Program) -> list[float]:
    return [round(1e3 * float(z), 6) for z in program.moves.pose[1:, 2]]


@pytest.mark.parametrize(
    ("body", "others", "z"),
    [
        ("R=0.1*3\nRR=1\nF.X=R\nR=F.X\nIF R==F.X THEN\nLIN {Z 8}\nENDIF\n", "", [8.0]),  # one number, copied
        ("R=0\nWHILE R<1.0\nR=R+0.125\nENDWHILE\nLIN {Z R}\n", "", [1.0]),  # exact on every controller
        ("IR_STOPM()\n", "DEF IR_STOPM()\nLIN {Z 3}\nEND\n", [3.0]),  # the program's own
        ("I=STRLEN(FX())\n", "DEFFCT INT FX()\nLIN {Z 4}\nRETURN 1\nENDFCT\n", [4.0]),
        ("LIN {Z ATAN2(1,1)/2,A ATAN2(-1,1)}\n", "", [22.5]),  # of an angle whole turns do not matter
        ("XP=$POS_ACT\nXP.Z=XP.Z+10\nLIN XP\n", "", [60.0]),
        ("$BASE={X 0,Y 0,Z 5,A 0,B 120,C 0}\n$BASE.B=100\nLIN {X 0,Y 0,Z 1,A 0,B 0,C 0}\n", "", [1.0]),
    ],
)
def test_what_is_known_is_followed(body: str, others: str, z: list[float], tmp_path: Path) -> None:
    assert heights(read(tmp_path, BEGIN + body, others)) == z


def test_a_component_of_a_frame_is_set_as_it_was_given(tmp_path: Path) -> None:
    program = read(tmp_path, BEGIN + "$BASE={X 0,Y 0,Z 0,A 0,B 120,C 0}\n$BASE.B=100\n" + LIN)
    c, s = np.cos(np.deg2rad(100)), np.sin(np.deg2rad(100))
    np.testing.assert_allclose(program.bases[-1].T[:3, :3], [[c, 0, s], [0, 1, 0], [-s, 0, c]], atol=1e-12)


def test_a_variable_holds_what_its_type_has(tmp_path: Path) -> None:
    body = f"XP={POINT}\nF=XP\nLIN F\nPO=XP\nPTP PO\nF={{X 0,Y 0,Z 10,A 0,B 0,C 0}}\nLIN F:XP\n"
    moves = read(tmp_path, BEGIN + body).moves
    assert np.degrees(moves.external[1:, 0]).round(6).tolist() == [0, 0, 90]  # a FRAME and a POS have no E1
    assert (moves.status[2], moves.turn[2]) == (2, 10)
    assert round(1e3 * float(moves.pose[3, 2]), 6) == 60


def test_a_variable_keeps_no_coupling_to_the_table(tmp_path: Path) -> None:
    coupled = "F=$NULLFRAME\n$BASE=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[2].MECH_TYPE,F)\n"
    assert read(tmp_path, BEGIN + coupled + LIN).bases[-1].coupled
    for kept in (
        "G=$BASE\n$BASE=G\n",
        "G=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[2].MECH_TYPE,F)\n$BASE=G\n",
        "$BASE=$BASE:F\n",
    ):
        with pytest.raises(InputError, match="external kinematic"):
            read(tmp_path, BEGIN + coupled + kept + LIN)
    ek = "G=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[2].MECH_TYPE,F)\n"
    with pytest.raises(InputError, match="external kinematic"):
        read(tmp_path, BEGIN + coupled + ek + f"S{LIN.strip()} WITH $BASE=G\n")


def test_what_with_sets_holds_for_its_block_alone(tmp_path: Path) -> None:
    with_ = "SPLINE WITH $BASE={X 0,Y 0,Z 500,A 0,B 0,C 0}\nS" + LIN + "ENDSPLINE\n"
    program = read(tmp_path, BEGIN + with_ + LIN)
    assert [program.bases[k].T[2, 3] for k in program.moves.base] == [0, 0.5, 0]


@pytest.mark.parametrize(
    ("body", "blend"),
    [
        ("LIN {X 200} C_DIS\n$OUT_C[1]=TRUE\n", 0.003),  # set at the corner itself
        ("LIN {X 200} C_DIS\nIF $FLAG[1] THEN\n$FLAG[2]=TRUE\nENDIF\n", 0.003),
        ("LIN {X 200} C_DIS\nIF $IN[1] THEN\n$FLAG[2]=TRUE\nENDIF\n", 0.0),
        ("LIN {X 200} C_DIS\nCONTINUE\nN=1\n$OUT[1]=TRUE\n", 0.0),  # CONTINUE holds for the next statement alone
        ("SPLINE\nSLIN {X 200}\nENDSPLINE C_SPL\n", ANYWHERE),
        ("SPTP {A1 1,A2 -90,A3 90,A4 0,A5 30,A6 0} C_SPL\n", ANYWHERE),
        ("PTP {A1 1,A2 -90,A3 90,A4 0,A5 30,A6 0} C_ORI\n", ANYWHERE),
        ("$APO.CDIS=1\nLDAT_ACT={VEL 2.0}\nBAS(#CP_DAT)\nLIN {X 200} C_DIS\n", ANYWHERE),  # which may be any
        ("LIN {X 200} C_DIS\nTRIGGER WHEN DISTANCE=0 DELAY=0 DO GAS=TRUE\n", 0.003),  # it fires later
        ("$APO.CDIS=1\nLDAT_ACT=LGLOB\nBAS(#CP_DAT)\nLIN {X 200} C_DIS\n", ANYWHERE),  # of a file that is not there
    ],
)
def test_a_corner_is_rounded_unless_it_is_known_not_to_be(body: str, blend: float, tmp_path: Path) -> None:
    assert read(tmp_path, BEGIN + body).moves.blend[-1] == blend


def test_speeds_are_real(tmp_path: Path) -> None:
    moves = read(tmp_path, BEGIN + "$VEL.CP=3\n$VEL.CP=$VEL.CP/2\n" + LIN).moves
    assert moves.speed[-1] == 1.5


OUT = {"arc_on": [r"\$OUT\[7\]\s*=\s*TRUE"], "arc_off": [r"\$OUT\[7\]\s*=\s*FALSE"]}


def happened(program: Program) -> list[tuple[str, int]]:
    return [(event.kind.value, event.before) for event in program.events if event.kind.value != "wait"]


@pytest.mark.parametrize("on", ["ARC=TRUE", "I=7\n$OUT[I]=TRUE", "$OUT[7]=NOT FALSE", "$OUT [7]=true", "$OUT[7]=TRUE"])
def test_an_output_is_the_arc_however_it_is_named(on: str, tmp_path: Path) -> None:
    body = f"SIGNAL ARC $OUT[7]\n{BEGIN}{on}\n{LIN}$OUT[7]=FALSE\n"
    assert happened(read(tmp_path, body, read=OUT)) == [("arc_on", 1), ("arc_off", 2)]


def test_an_output_that_is_not_known_is_doubted(tmp_path: Path) -> None:
    program = read(tmp_path, BEGIN + "$OUT[7]=$IN[1]\n" + LIN, read=OUT)
    assert any("an output is set whose number or value is not known" in doubt.kind for doubt in program.doubts)


@pytest.mark.parametrize(
    "body",
    [
        "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[I]=TRUE\n",
        "TRIGGER WHEN DISTANCE=0 DELAY=0 DO ARC=TRUE\n",
        "IF $IN[1] THEN\n$OUT[I]=TRUE\nENDIF\n",
        "IF $IN[1] THEN\nARC=TRUE\nENDIF\n",
        "UNDECLARED=TRUE\n",
    ],
)
def test_an_output_that_may_be_the_arc_is_doubted(body: str, tmp_path: Path) -> None:
    program = read(tmp_path, f"SIGNAL ARC $OUT[7]\n{BEGIN}I=7\n{body}{LIN}", read=OUT)
    assert any("an output is set whose number or value is not known" in doubt.kind for doubt in program.doubts)


def test_a_name_of_an_output_may_be_another_files_and_be_given_on(tmp_path: Path) -> None:
    files = {"OTHER.dat": "DEFDAT OTHER PUBLIC\nGLOBAL SIGNAL ARC $OUT[7]\nENDDAT\n"}
    given_on = "DEF SWITCH_ON(K)\nBOOL K\nK=TRUE\nEND\n"
    for on, others in (("ARC=TRUE", ""), ("SWITCH_ON(ARC)", given_on), ("$OUT_C[7]=TRUE", "")):
        program = read(tmp_path, f"{BEGIN}{on}\n{LIN}", others, files, read=OUT)
        assert happened(program) == [("arc_on", 1)], on


def test_a_variable_copied_whole_holds_what_the_other_holds(tmp_path: Path) -> None:
    first = "DECL LDAT LA={VEL 1.0,ACC 100.0,APO_DIST 2.0,CIRC_TYP #BASE}\n"
    second = "DECL LDAT LB={VEL 2.0,ACC 100.0,APO_DIST 5.0}\n"
    files = {"T.dat": f"DEFDAT T\n{first}{second}ENDDAT\n"}
    body = "LDAT_ACT=LA\nBAS(#CP_DAT)\nLDAT_ACT=LB\nBAS(#CP_DAT)\nLIN {X 200} C_DIS\n"
    moves = read(tmp_path, BEGIN + body, files=files).moves
    assert (moves.speed[-1], moves.blend[-1]) == (2.0, 0.005)


def test_a_trigger_may_fire_at_the_start(tmp_path: Path) -> None:
    for at, before in (("ONSTART ", 1), ("", 2)):
        arc = f"TRIGGER WHEN PATH=0 {at}DELAY=0 DO ARC_ON ( )\n" + LIN
        assert happened(read(tmp_path, BEGIN + arc)) == [("arc_on", before)]


def test_an_interrupt_is_no_event_where_it_is_declared(tmp_path: Path) -> None:
    line = "INTERRUPT DECL 4 WHEN $IN[1] DO $OUT[7]=TRUE\n"
    program = read(tmp_path, BEGIN + line + LIN, read=OUT)
    assert not happened(program)
    assert any("an interrupt is declared" in doubt.kind for doubt in program.doubts)
    named = read(tmp_path, BEGIN + "INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO MY_IR_STOPM ( )\n")
    assert any("an interrupt is declared" in doubt.kind for doubt in named.doubts)


def test_a_statement_made_a_comment_is_no_event(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a comment that may be a statement"):
        read(tmp_path, BEGIN + ";$OUT[7]=FALSE\n", read=OUT)
    with pytest.raises(InputError, match="fits a text"):
        read(tmp_path, BEGIN + 'S[]="$OUT[7]=TRUE"\n', read=OUT)
    assert happened(read(tmp_path, BEGIN + ";weld start\n" + LIN, read={"arc_on": ["weld start"]})) == [("arc_on", 1)]


def test_later_lines_of_a_hook_are_run_as_well(tmp_path: Path) -> None:
    hooks = {"arc_on": "ARC_ON ( )\nLAYER ( )"}
    body = BEGIN + "ARC_ON ( )\nLAYER ( )\n" + LIN
    assert heights(read(tmp_path, body, hooks=hooks)) == [50]  # missing: the user's own
    assert heights(read(tmp_path, body, "DEF LAYER ( )\nLIN {Z 3}\nEND\n", hooks=hooks)) == [3, 50]
    # a motion ends the hook: the wait behind it is the program's
    waits = {"arc_on": "ARC_ON ( )\nWAIT SEC 0.5"}
    assert len(read(tmp_path, BEGIN + "ARC_ON ( )\n" + LIN + "WAIT SEC 0.5\n", hooks=waits).events) == 2


def test_a_trigger_may_call_what_sets_outputs_alone(tmp_path: Path) -> None:
    line = BEGIN + "TRIGGER WHEN DISTANCE=0 DELAY=0 DO BUMP ( )\n" + LIN
    program = read(tmp_path, line, "DEF BUMP ( )\n$OUT[3]=TRUE\nEND\n")
    assert any("calls BUMP, which is not run" in doubt.kind for doubt in program.doubts)
    with pytest.raises(InputError, match="a TRIGGER calls BUMP, which does more than set outputs"):
        read(tmp_path, line, "DEF BUMP ( )\nLIN {Z 0}\nEND\n")


def test_two_globals_of_one_name_are_refused(tmp_path: Path) -> None:
    data = "DEFDAT {} PUBLIC\nDECL GLOBAL REAL V=0.02\nENDDAT\n"
    with pytest.raises(InputError, match=r"V is GLOBAL here and in B\.dat"):
        read(tmp_path, BEGIN + "$VEL.CP=V\n", files={"A.dat": data.format("A"), "B.dat": data.format("B")})


def test_a_parameter_that_stands_for_a_variable_of_the_controller_is_not_skipped(tmp_path: Path) -> None:
    other = "DEF SETF(FF)\nDECL FRAME FF\nIF $IN[1] THEN\nFF={X 0,Y 0,Z 500,A 0,B 0,C 0}\nENDIF\nEND\n"
    with pytest.raises(InputError, match="a condition decides on moves"):
        read(tmp_path, BEGIN + "SETF($BASE)\n" + LIN, other)


def test_arrays_of_another_type_do_not_stand_for_each_other(tmp_path: Path) -> None:
    other = "DEF HALVE(K[])\nREAL K[]\nK[1]=K[1]/2\nEND\n"
    with pytest.raises(InputError, match="is REAL and stands for AI, which is INT"):
        read(tmp_path, "DECL INT AI[3]\n" + BEGIN + "AI[1]=7\nHALVE(AI[])\n", other)


def test_a_sub_program_of_the_programs_own_is_not_the_controllers(tmp_path: Path) -> None:
    move = "PTP {A1 0,A2 -90,A3 90,A4 0,A5 30,A6 0,E1 0,E2 0}\n"
    own = "DEF BAS ( word :IN, share :IN )\nPTP {A1 20}\nEND\n"
    path = module(tmp_path, move + "BAS (#VEL_PTP, 20)\n")
    assert len(read_krl(path, controller()).moves) == 1
    path.write_text(path.read_text() + own)
    assert len(read_krl(path, controller()).moves) == 2
