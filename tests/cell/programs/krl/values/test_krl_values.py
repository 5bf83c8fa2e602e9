"""Numbers of a program are what the controller makes of them: types of results and components, parameters, counters."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.programs.programs import FRAMES, LIN, controller

from cell.errors import InputError
from cell.programs.krl.values.evaluation import MaybeInteger
from cell.programs.krl.values.value_types import EITHER, INT, REAL, ValueTypes
from cell.programs.krl_read import read_krl

DECLARED = "DECL INT I,J,N,M\nDECL REAL R\nDECL INT A[3]\nDECL FRAME B\n"
STRUCTURES = "STRUC STEPS INT N,K,REAL H,FRAME F\nDECL STEPS P={N 7,H 2.0}\n"


def heights(folder: Path, body: str, others: str = "", data: str = "") -> list[float]:
    """Z of the moves behind the first, mm."""
    path = folder / "T.src"
    path.write_text(f"DEF T ( )\n{DECLARED}{FRAMES}{LIN}{body}END\n{others}")
    if data:
        (folder / "T.dat").write_text(f"DEFDAT T\n{data}ENDDAT\n")
    return [round(1e3 * float(z), 6) for z in read_krl(path, controller()).moves.pose[1:, 2]]


@pytest.mark.parametrize(
    ("body", "function", "z"),
    [
        ("R=F()/2\n", "REAL F()\nRETURN 7", 3.5),  # a REAL though 7 is whole
        ("R=F()*10\n", "INT F()\nRETURN 3.6", 40.0),  # an INT rounds what it gives back
        ("B=F()\nR=B.X/2\n", "FRAME F()\nRETURN {X 7,Y 0,Z 0,A 0,B 0,C 0}", 3.5),
        ("R=ABS(-7)/2\n", "INT F()\nRETURN 0", 3.5),  # functions of the language give a REAL
    ],
)
def test_a_function_gives_back_its_type(body: str, function: str, z: float, tmp_path: Path) -> None:
    assert heights(tmp_path, f"{body}LIN {{Z R}}\n", f"DEFFCT {function}\nENDFCT\n") == [z]


def test_a_function_without_return_gives_nothing_to_move_by(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="function F ends without RETURN"):
        heights(tmp_path, "LIN {Z F()}\n", "DEFFCT INT F()\nENDFCT\n")


@pytest.mark.parametrize(
    ("body", "z"),
    [
        ("P.N=7\nR=P.N/2\n", 3.0),
        ("R=P.N/2\n", 3.0),  # as the .dat file has it
        ("P.K=3.6\nR=P.K\n", 4.0),
        ("P.H=7\nR=P.H/2\n", 3.5),
        ("P.F.X=7\nR=P.F.X/2\n", 3.5),
        ("P={N 7,H 7}\nR=P.H/2+P.N/2\n", 6.5),
        ("A[1]=7\nR=A[1]/2\n", 3.0),
    ],
)
def test_a_component_is_of_the_type_that_struc_declares(body: str, z: float, tmp_path: Path) -> None:
    assert heights(tmp_path, f"{body}LIN {{Z R}}\n", data=STRUCTURES) == [z]


def test_a_component_of_a_type_that_is_not_among_the_files(tmp_path: Path) -> None:
    data = "DECL FOREIGN Q={N 6,M 7,H 0.5}\n"
    assert heights(tmp_path, "LIN {Z Q.N+Q.M*2}\nLIN {Z Q.N/2}\nLIN {Z Q.H/2}\nLIN {Z Q.M/2.0}\n", data=data) == [
        20,
        3,
        0.25,
        3.5,
    ]
    for number in ("Q.M/2", "-Q.M/2", "(Q.N+1)/2", "7/Q.N"):
        with pytest.raises(InputError, match=r"T\.src:9: divides .* which may both be INT"):
            heights(tmp_path, f"LIN {{Z {number}}}\n", data=data)
    with pytest.raises(InputError, match=r"Q may be INT, and round 3\.5"):
        heights(tmp_path, "R=7\nQ.N=R/2\nLIN {Z Q.N}\n", data=data)


def test_types_that_files_declare_differently_may_be_either() -> None:
    types = ValueTypes()
    types.declare("S", {"N": INT, "H": REAL})
    types.declare("S", {"N": REAL, "H": REAL})
    assert (types.component("S", "N"), types.component("S", "H"), types.component("FRAME", "X")) == (EITHER, REAL, REAL)
    assert (types.component("POS", "S"), types.component(None, "DEPTH")) == (INT, EITHER)

    class Here:
        where = None

    held = types.held("S", {"N": 7, "H": 2}, Here())  # type: ignore[arg-type]
    assert isinstance(held["N"], MaybeInteger)
    assert type(held["H"]) is float


@pytest.mark.parametrize(
    ("body", "other", "z"),
    [
        ("N=10\nBUMP(N)\n", "DEF BUMP(K)\nINT K\nK=K+50\nEND\n", 60.0),  # OUT where nothing is said
        ("N=10\nBUMP(N)\n", "DEF BUMP(K:IN)\nINT K\nK=K+50\nEND\n", 10.0),
        ("N=10\nBUMP(N,N)\n", "DEF BUMP(K:OUT,L:OUT)\nINT K,L\nK=20\nL=L+1\nEND\n", 21.0),  # one variable, twice
        ("N=10\nBUMP(N)\n", "DEF BUMP(K:OUT)\nINT K\nDEEP(K)\nEND\nDEF DEEP(Q:OUT)\nINT Q\nQ=77\nEND\n", 77.0),
        ("A[2]=4\nN=2\nBUMP(A[N],N)\nN=A[2]\n", "DEF BUMP(K:OUT,L:OUT)\nINT K,L\nL=1\nK=K*2\nEND\n", 8.0),
        ("A[2]=4\nBUMP(A[])\nN=A[2]\n", "DEF BUMP(B[]:OUT)\nINT B[]\nB[2]=B[2]+1\nEND\n", 5.0),
        ("BUMP(P.N)\nN=P.N\n", "DEF BUMP(K:OUT)\nINT K\nK=K+1\nEND\n", 8.0),
        ("BUMP(P)\nN=P.N\n", "DEF BUMP(K:OUT)\nDECL STEPS K\nK.N=K.N+2\nEND\n", 9.0),
        ("BUMP(P.N)\nN=0\n", "DEF BUMP(K:OUT)\nINT K\nK=20\nLIN {Z P.N}\nEND\n", 20.0),  # seen at once by its name
        ("N=3+BUMP(M)\nN=M\n", "DEFFCT INT BUMP(K)\nINT K\nK=6\nRETURN 1\nENDFCT\n", 6.0),
    ],
)
def test_a_parameter_stands_for_what_the_caller_gives(body: str, other: str, z: float, tmp_path: Path) -> None:
    assert heights(tmp_path, f"M=1\n{body}LIN {{Z N}}\n", other, STRUCTURES)[0] == z


def test_a_parameter_that_converts_what_it_stands_for_is_refused(tmp_path: Path) -> None:
    refused = "parameter K is INT and stands for R, which is REAL"
    with pytest.raises(InputError, match=refused):
        heights(tmp_path, "R=10\nBUMP(R)\n", "DEF BUMP(K)\nINT K\nK=5\nEND\n")
    with pytest.raises(InputError, match=refused):
        heights(tmp_path, "R=3.6\nBUMP(R)\n", "DEF BUMP(K)\nINT K\nLIN {Z K}\nEND\n")
    with pytest.raises(InputError, match="parameter K is REAL and stands for N, which is INT"):
        heights(tmp_path, "N=7\nBUMP(N)\n", "DEF BUMP(K)\nREAL K\nLIN {Z K/2}\nEND\n")
    assert heights(tmp_path, "N=7\nBUMP(N)\n", "DEF BUMP(K:IN)\nREAL K\nLIN {Z K/2}\nEND\n") == [3.5]


def test_a_parameter_may_stand_for_what_the_controller_has(tmp_path: Path) -> None:
    other = "DEF SLOW(V)\nREAL V\nV=V/2\nEND\n"
    path = tmp_path / "T.src"
    path.write_text(f"DEF T ( )\n{FRAMES}$VEL.CP=0.2\n{LIN}SLOW($VEL.CP)\n{LIN}END\n{other}")
    assert read_krl(path, controller()).moves.speed.tolist() == [0.2, 0.1]


@pytest.mark.parametrize("change", ["I=I+1", "N=N+1", "M=2"])
def test_a_loop_whose_block_changes_what_it_counts_by_is_refused(change: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"T\.src:11: FOR: its block changes"):
        heights(tmp_path, f"N=6\nM=1\nFOR I=1 TO N STEP M\n{change}\nLIN_REL {{Z 1}}\nENDFOR\n")


def test_a_loop_leaves_its_counter_behind_its_end(tmp_path: Path) -> None:
    assert heights(tmp_path, "FOR I=1 TO 6 STEP 2\nENDFOR\nLIN {Z I}\n") == [7.0]
    assert heights(tmp_path, "FOR I=3 TO 1\nENDFOR\nLIN {Z I}\n") == [3.0]


def test_half_of_a_negative_number_is_not_rounded(tmp_path: Path) -> None:
    assert heights(tmp_path, "R=7\nN=R/2\nLIN {Z N}\nN=-3.6\nLIN {Z N}\n") == [4.0, -4.0]
    with pytest.raises(InputError, match=r"rounds -3\.5, and it is not known whether up or down"):
        heights(tmp_path, "R=-7\nN=R/2\n")
