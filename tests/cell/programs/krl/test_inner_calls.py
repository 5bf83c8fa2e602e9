"""Functions that are called inside other statements move the arm like any other: none is passed over."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.programs.programs import controller, module

from cell.errors import InputError
from cell.programs.krl.inner_calls import called_in
from cell.programs.krl_read import read_krl
from cell.programs.program import Program

HOME = "PTP {A1 0,A2 -90,A3 90,A4 0,A5 30,A6 0,E1 0,E2 0}\n"
AWAY = "PTP {A1 0,A2 -30,A3 90,A4 0,A5 30,A6 0,E1 0,E2 0}\n"


def read(folder: Path, body: str, function: str = "") -> Program:
    """A program that calls NEXT, which is missing or moves the arm away and back."""
    path = module(folder, HOME + body)
    path.write_text(path.read_text() + function)
    return read_krl(path, controller())


def moving(kind: str, value: str) -> str:
    return f"DEFFCT {kind} NEXT ( )\n{AWAY}{HOME}RETURN {value}\nENDFCT\n"


CALLED = (
    "X=NEXT ( )\n",
    "X=NOT NEXT ( )\n",
    "$OUT[1]=NEXT ( )\n",
    "IF NEXT ( ) THEN\nENDIF\n",
    "IF $IN[1] AND NEXT ( ) THEN\nENDIF\n",
    "ARC_ON (1, NEXT ( ))\n",
    'MsgNotify ("done", NEXT ( ))\n',
)
NOT_FOLLOWED = (
    "WAIT FOR NEXT ( )\n",
    "WAIT FOR $IN[1] AND (NEXT ( ))\n",
    "PULSE ($OUT[NEXT ( )],TRUE,0.5)\n",
    "ANOUT ON DT = NEXT ( )\n",
    "INTERRUPT ON NEXT ( )\n",
    "IF $IN[1] THEN\nX=NEXT ( )\nENDIF\n",
    "IF $IN[1] THEN\nWAIT SEC NEXT ( )\nENDIF\n",
    "IF $IN[1] THEN\nWAIT FOR NEXT ( )\nENDIF\n",
    "WHILE $IN[1]\nIF NEXT ( ) THEN\nENDIF\nENDWHILE\n",
)


@pytest.mark.parametrize("body", [*CALLED, *NOT_FOLLOWED])
def test_a_function_that_is_missing_is_refused_wherever_it_is_called(body: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"T\.src:[34]: (sub-program NEXT is missing|a condition decides on moves)"):
        read(tmp_path, body)


@pytest.mark.parametrize("body", CALLED)
def test_a_function_runs_where_it_is_called(body: str, tmp_path: Path) -> None:
    assert len(read(tmp_path, body, moving("BOOL", "TRUE")).moves) == 3


@pytest.mark.parametrize("body", NOT_FOLLOWED)
def test_a_function_is_refused_where_it_is_not_followed(body: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"T\.src:[34]: (calls function NEXT where|a condition decides on moves)"):
        read(tmp_path, body, moving("BOOL", "TRUE"))


@pytest.mark.parametrize("function", ["", moving("INT", "1")])
def test_a_function_inside_a_call_that_is_known_to_be_harmless_is_not_passed_over(
    function: str, tmp_path: Path
) -> None:
    assert len(read(tmp_path, "ArcMainNG (#PreDefinition,WDAT1,(1)) ;of bead (3)\n").moves) == 1
    with pytest.raises(InputError, match=r"T\.src:3: sub-program ARCMAINNG is missing"):
        read(tmp_path, "ArcMainNG (#PreDefinition,WDAT1,NEXT ( ))\n", function)


def test_a_trigger_that_calls_a_function_is_named(tmp_path: Path) -> None:
    body = "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[NEXT ( )]=TRUE\n" + AWAY
    doubts = read(tmp_path, body, moving("INT", "1")).doubts
    assert any("a TRIGGER calls NEXT, which is not run" in doubt.kind for doubt in doubts)


@pytest.mark.parametrize(
    "body",
    [
        'IF VARSTATE("X")==#DEFINED THEN\nENDIF\n',
        'X=STRLEN("(NEXT ( )")\n',
        "WAIT FOR ($IN[1] OR NOT ($IN[2]))\n",
        "PULSE ($OUT[2],TRUE,0.5)\n",
        "X=ABS(-1)+SQRT(4)\n",
    ],
)
def test_functions_of_the_controller_that_move_nothing_are_none(body: str, tmp_path: Path) -> None:
    assert len(read(tmp_path, body).moves) == 1


def test_names_in_texts_and_words_of_the_language_are_no_calls() -> None:
    assert called_in(' FOR (NOT (A) AND B_NOT (C)) OR f1 ("g ( )", $X[h(2)]) ') == ("F1", "H")
