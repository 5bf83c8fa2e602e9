"""What cannot be followed and could move the arm is refused in one line with file and line number."""

from __future__ import annotations

import random
import re
from dataclasses import replace
from pathlib import Path

import pytest
from support.programs.broken_programs import broken
from support.programs.programs import FRAMES, LIN, controller, module

from cell.errors import InputError
from cell.programs.controller import ReadLimits
from cell.programs.krl_read import read_krl
from cell.programs.program import Program

PTP = "PTP {A1 0,A2 -90,A3 90,A4 0,A5 30,A6 0,E1 0,E2 0}\n"


def refused(folder: Path, body: str) -> str:
    """The message, after the file's path."""
    path = module(folder, body)
    with pytest.raises(InputError) as caught:
        read_krl(path, controller())
    message = str(caught.value)
    assert message.startswith(f"{path}:")
    assert "\n" not in message
    return message.removeprefix(str(path))


@pytest.mark.parametrize(
    ("body", "line", "words"),
    [
        (LIN, 2, "no tool"),
        ("$TOOL=$NULLFRAME\n" + LIN, 3, "no base"),
        (FRAMES + "BAS(#INITMOV,0)\n" + LIN, 5, "no tool"),
        (FRAMES + "LIN {X 1,Y 2,Z 3}\n", 4, "gives no A B C"),
        (FRAMES + PTP + "LIN {X 1}\n", 5, "gives no Y Z A B C"),
        (FRAMES + PTP + "LIN_REL {X 1}\n", 5, "the position of the TCP"),
        ("PTP {A1 0,A2 -90}\n", 2, "gives no A3"),
        ("PTP {A1 0,A2 -90,A3 90,A4 0,A5 30,A6 0,A7 0}\n", 2, "A7 is not an axis"),
        ("PTP {J1 0}\n", 2, "J1 is not an axis"),
        ("PTP {A1 0,A2 -90,A3 90,A4 0,A5 30,A6 0,E3 5}\n", 2, "E1 and E2 alone"),
        (FRAMES + LIN.replace("E2 0", "E1 0"), 4, "twice"),
        (FRAMES + LIN.replace("X 100", "X nan"), 4, "NAN"),
        (FRAMES + LIN.replace("X 100", "X 1e400"), 4, "not finite"),
        (FRAMES + LIN.replace("X 100", "X 1e30"), 4, "is allowed"),
        (FRAMES + LIN.replace("X 100,", "X 100"), 4, "needs"),
        (FRAMES + LIN.replace("X 100", "X 1/0"), 4, "divides by 0"),
        (FRAMES + "LIN {X 100,Y 0,Z 50,A 0,B 90,A1 0}\n", 4, "at once"),
        (FRAMES + "LIN XP1\n", 4, "XP1"),
        (FRAMES + "PTP HOME\n", 4, "HOME"),
        ("NEXT ( )\n" + PTP, 2, "sub-program NEXT is missing"),
        ("$TOOL=TOOL_DATA[3]\n" + PTP, 2, "TOOL_DATA[3]"),
        ("BAS(#TOOL,3)\n" + PTP, 2, "TOOL_DATA[3]"),
        ("BAS(#EX_BASE,3)\n" + PTP, 2, "controller.read.base_data"),
        ("BAS(#UNHEARD,3)\n" + PTP, 2, "#UNHEARD"),
        ("$BASE=TOOL_DATA[0]:{X 1}\n" + PTP, 2, "needs X Y Z A B C"),
        ("$BASE=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[3].MECH_TYPE,$NULLFRAME)\n" + PTP, 2, "machine 2"),
        ("$BASE=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[2].MECH_TYPE)\n" + PTP, 2, "EK takes"),
        ("$ROBROOT={X 0,Y 0,Z 0,A 0,B 0,C 0}\n" + PTP, 2, "$ROBROOT is not known"),
        ("$ASYNC_AXIS='B10'\n" + PTP, 2, "asynchronous"),
        ("$TORQUE_AXIS=1\n" + PTP, 2, "$TORQUE_AXIS is not known"),
        ("$VEL.CP=8\n" + PTP, 2, "in m/s, not 8"),
        ("$VEL.CP=-1\n" + PTP, 2, "$VEL.CP is above 0"),
        ("$VEL_AXIS[1]=300\n" + PTP, 2, "above 0 and up to 100 %"),
        ("$VEL_EXTAX[1]=0\n" + PTP, 2, "above 0 and up to 100 %"),
        ("$OV_PRO=0\n" + PTP, 2, "above 0 and up to 100 %"),
        ("$TOOL=$NULLFRAME\n$BASE=EK(MACHINE_DEF[3].ROOT,MACHINE_DEF[3].MECH_TYPE,$NULLFRAME)\n" + LIN, 4, "[2]"),
        ("MACHINE_DEF[2].ROOT={X 0,Y 0,Z 5,A 0,B 0,C 0}\n" + PTP, 2, "where the table stands"),
        ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO $VEL.CP=0.5\n" + PTP, 2, "a TRIGGER sets $VEL"),
        ("TRIGGER WHEN PATH=-5 DELAY=0 DO ARC_ON ( )\n" + PTP, 2, "PATH = -5 mm"),
        ("TRIGGER WHEN DISTANCE=0 DELAY=0 DO N=2\n" + PTP + "IF N==2 THEN\n" + PTP + "ENDIF\n", 4, "TRIGGER of line 2"),
        (PTP + "TRIGGER WHEN DISTANCE=1 DELAY=0 DO ARC_ON ( )\n", 3, "has no motion after it"),
        ("$ADVANCE=6\n" + PTP, 2, "0 to 5"),
        ("WAIT SEC -1\n" + PTP, 2, "WAIT SEC"),
        (FRAMES + "$ORI_TYPE=#JOINT\n" + LIN, 5, "$ORI_TYPE is #JOINT"),
        (FRAMES + LIN + "LIN_REL {A 5}\n", 5, "turn about the base"),
        (FRAMES + LIN + "PTP_REL {X 5,A 5}\n", 5, "turn about the base"),
        (FRAMES + LIN + "PTP_REL {X 5,S 2}\n", 5, "with S or T"),
        (FRAMES + LIN + "CIRC {X 1},{X 2}\n", 5, "auxiliary point"),
        (FRAMES + LIN + "CIRC {X 110,Y 10,Z 50},{X 120}, CA 90\nLIN {X 1}\n", 6, "gives no Y Z A B C"),
        (FRAMES + LIN + "$TOOL={X 1,Y 0,Z 0,A 0,B 0,C 0}\nLIN {X 1}\n", 6, "gives no Y Z A B C"),
        (FRAMES + LIN + "$BASE={X 1,Y 0,Z 0,A 0,B 0,C 0}\nLIN {X 1}\n", 6, "gives no Y Z A B C"),
        (FRAMES + LIN + "LIN {X 1} C_FOO\n", 5, "C_FOO"),
        ("IF $IN[1] THEN\n" + PTP + "ENDIF\n" + PTP, 2, "depends on an unknown value"),
        (FRAMES + "I=1\nIF $IN[1] THEN\nI=2\nENDIF\n" + LIN.replace("X 100", "X I"), 8, "I is set where line 5"),
        ("IF TRUE THEN\n" * 30 + "T ( )\n" + "ENDIF\n" * 30, 28, "blocks and sub-programs inside each other"),
        ("GOTO AGAIN\nAGAIN:\n" + PTP, 2, "GOTO"),
        ("FOR I=1 TO 3 STEP 0\nENDFOR\n" + PTP, 2, "STEP is 0"),
        ("EXIT\n" + PTP, 2, "EXIT stands outside a loop"),
        ("IF TRUE THEN\n" + PTP, 4, "IF of line 2 is open"),
        ("ENDLOOP\n" + PTP, 2, "ENDLOOP stands where"),
        ("one two three\n" + PTP, 2, "is an unknown statement"),
        ("T ( )\n" + PTP, 2, "calls more than"),
        ("I=" + "(" * 60 + "1" + ")" * 60 + "\n" + PTP, 2, "in each other"),
        ("IF TRUE THEN\n" * 60 + "ENDIF\n" * 60 + PTP, 42, "blocks inside each other"),
        ("@\n" + PTP, 2, "cannot be read"),
        ('MSG="open\n' + PTP, 2, "cannot be read"),
        ("X=" + "9" * 50 + "\n" + PTP, 2, "50 digits"),
        ("X=" + "1" * 3000 + "\n" + PTP, 2, "more than 2000 characters"),
    ],
)
def test_one_line_says_where_and_what(tmp_path: Path, body: str, line: int, words: str) -> None:
    message = refused(tmp_path, body)
    assert message.startswith(f":{line}: "), message
    assert words in message


def test_a_file_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    text = f"DEF T ( )\n{FRAMES}{LIN}{LIN}END\n"
    path = tmp_path / "T.src"
    for length in range(len(text) - 2):
        path.write_text(text[:length])
        with pytest.raises(InputError):
            read_krl(path, controller())


@pytest.mark.parametrize(
    ("raw", "words"),
    [
        (b"", r":1: holds no program"),
        (b"DEF T ( )\nEND\n", r"moves nothing"),
        (b"DEF T ( )\n\0\nEND\n", r":2: has a byte 0"),
        (b"DEFDAT T\nENDDAT\n", r":1: T is data or a function, not a program"),
        (b"DEF T (a:IN)\nEND\n", r":1: T has parameters"),
        (b"DEF T ( )\nDEF U ( )\nEND\n", r":2: DEF stands within T"),
        (b"X=1\nDEF T ( )\nEND\n", r":1: stands outside"),
        (b"DEF T ( )\nEND\nDEF t ( )\nEND\n", r":3: T is declared twice"),
    ],
)
def test_what_is_no_program(tmp_path: Path, raw: bytes, words: str) -> None:
    path = tmp_path / "T.src"
    path.write_bytes(raw)
    with pytest.raises(InputError, match=words):
        read_krl(path, controller())


def test_what_is_no_file(tmp_path: Path) -> None:
    for name, words in (
        ("none.src", "no such file"),
        ("none.txt", r"is a \.src file"),
        ("folder.src", "not an ordinary"),
    ):
        (tmp_path / "folder.src").mkdir(exist_ok=True)
        with pytest.raises(InputError, match=words):
            read_krl(tmp_path / name, controller())


def test_control_characters_do_not_reach_the_message(tmp_path: Path) -> None:
    assert "\x1b" not in refused(tmp_path, "foo \x1b[2Jbar\n" + PTP)


@pytest.mark.parametrize("seed", range(150))
def test_a_broken_program_ends_in_a_program_or_one_line(seed: int, tmp_path: Path) -> None:
    path = broken(random.Random(seed), tmp_path)
    message = ""
    try:
        its = replace(controller(), limits=ReadLimits(moves=5000, statements=20_000))
        assert isinstance(read_krl(path, its), Program)
    except InputError as error:
        message = str(error)
    assert message == "" or re.fullmatch(rf"{re.escape(str(tmp_path))}/[^:\n]*(:\d+)?: [^\n]*", message)


@pytest.mark.parametrize("text", ["LIN {X １２}", "LIN {X ١٢}", "LIN\u00a0{X 12}", "LIN {X 1+２}"])
def test_digits_and_blanks_that_no_controller_has_are_refused(text: str, tmp_path: Path) -> None:
    assert refused(tmp_path, FRAMES + PTP + LIN + f"{text}\n").startswith(":6: ")


def test_a_line_that_may_end_in_a_comment_is_refused(tmp_path: Path) -> None:
    text = f"DEF T ( )\n{FRAMES}{PTP}{LIN};then\rLIN {{X 999}}\nEND\n"
    path = tmp_path / "T.src"
    path.write_bytes(text.encode())
    with pytest.raises(InputError, match=rf"^{re.escape(str(path))}:6: has a CR without LF"):
        read_krl(path, controller())
    for ends in ("\r", "\r\n"):
        path.write_bytes(text.replace("\rLIN", "").replace("\n", ends).encode())
        assert len(read_krl(path, controller()).moves) == 2


def test_two_sub_programs_whose_names_differ_in_capitals_alone_are_refused(tmp_path: Path) -> None:
    path = module(tmp_path, PTP + "NEXT ( )\n")
    for name, angle in (("NEXT.src", 10), ("next.src", 20)):
        (tmp_path / name).write_text(f"DEF NEXT ( )\nPTP {{A1 {angle}}}\nEND\n")
    if len(list(tmp_path.iterdir())) < 3:
        pytest.skip("this file system tells no capitals apart")
    with pytest.raises(InputError, match=r"beside it is the same name to a controller"):
        read_krl(path, controller())
