"""Motion files: what is written comes back, and what cannot be a motion is refused in one line."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, result_of

from cell.cli.main import main
from cell.errors import InputError
from cell.motion.motion_file import read_motion, write_motion
from cell.verdict.result import Result


@pytest.fixture(scope="module")
def boss(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return boss_case(tmp_path_factory.mktemp("boss"))


@pytest.fixture(scope="module")
def result(boss: Path) -> Result:
    return result_of(boss)


@pytest.mark.parametrize("suffix", [".csv", ".npz"])
def test_what_is_written_comes_back(result: Result, tmp_path: Path, suffix: str) -> None:
    motion = result.motion
    write_motion(tmp_path / f"m{suffix}", motion)
    read = read_motion(tmp_path / f"m{suffix}", result.job)
    assert read.repaired == ()
    for name in ("arc", "bead", "layer", "target"):
        np.testing.assert_array_equal(getattr(read.motion, name), getattr(motion, name))
    for name, tolerance in (("t_s", 1e-6), ("q", 1e-8), ("table", 1e-8)):
        np.testing.assert_allclose(getattr(read.motion, name), getattr(motion, name), atol=tolerance)


@pytest.mark.parametrize("suffix", [".csv", pytest.param(".npz", marks=pytest.mark.slow)])
def test_the_command_passes_its_own_motion(boss: Path, tmp_path: Path, capsys, suffix: str) -> None:
    motion, report = tmp_path / f"m{suffix}", tmp_path / "r.json"
    assert main(["check", str(boss), "--motion", str(motion)]) == 0
    assert main(["check", str(boss), "--motion-in", str(motion), "--json", str(report)]) == 0
    assert "feasible" in capsys.readouterr().out
    assert '"rbam-motion-report/1"' in report.read_text()


@pytest.mark.slow
def test_the_shipped_propeller_passes_its_own_motion(tmp_path: Path) -> None:
    motion = tmp_path / "m.csv"
    assert main(["check", "--motion", str(motion)]) == 0
    assert main(["check", "--motion-in", str(motion)]) == 0


Table = list[list[str]]


def at(row: int, name: str, value: str) -> Callable[[Table], None]:
    def change(table: Table) -> None:
        table[row][table[0].index(name)] = value

    return change


def without(name: str) -> Callable[[Table], None]:
    def change(table: Table) -> None:
        k = table[0].index(name)
        for row in table:
            del row[k]

    return change


def cut(first: int, last: int | None = None) -> Callable[[Table], None]:
    def change(table: Table) -> None:
        del table[first:last]

    return change


def only_one_row_of_a_bead(table: Table) -> None:
    arc, bead = table[0].index("arc"), table[0].index("bead")
    mine = [i for i, row in enumerate(table) if row[arc] == "1" and row[bead] == "1"]
    for i in reversed(mine[1:]):
        del table[i]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (without("A4_deg"), "has no column A4_deg"),
        (without("E2_deg"), "has no column E2_deg"),
        (without("arc"), "has no column arc"),
        (at(3, "A1_deg", "nan"), "row 3: A1_deg is not a finite number"),
        (at(3, "A1_deg", "east"), "row 3: A1_deg is not a number (is 'east')"),
        (at(4, "t_s", "0.0"), "row 4: t_s 0 is not later than that of the row before"),
        (at(5, "A6_deg", "170"), "row 5: A6_deg"),
        (at(3, "arc", "2"), "row 3: arc is 0 or 1 (is 2)"),
        (at(3, "arc", "0.5"), "row 3: arc is not a whole number"),
        (at(3, "target", "9999"), "row 3: target 9999 does not exist; the case has 0 to"),
        (at(3, "target", "-1"), "row 3: target -1 does not exist"),
        (at(3, "bead", "1"), "belongs to bead 0, not 1"),
        (at(3, "layer", "1"), "belongs to layer 0, not 1"),
        (at(0, "A1_deg", "A2_deg"), "has the column A2_deg twice"),
        (lambda table: table[6].pop(), "row 6: has 12 values for 13 columns"),
        (cut(2), "a motion needs at least two"),
        (cut(0), "is empty"),
        (only_one_row_of_a_bead, "bead 1 has one row with the arc on"),
    ],
)
def test_bad_files_are_refused_in_one_line(
    result: Result, tmp_path: Path, change: Callable[[Table], None], said: str
) -> None:
    path = tmp_path / "m.csv"
    write_motion(path, result.motion)
    table = list(csv.reader(path.open()))
    change(table)
    path.write_text("\n".join(",".join(row) for row in table) + "\n")
    # a jump is said with its axis
    said = said.replace("A6_deg", "A6 jumps by")
    with pytest.raises(InputError) as caught:
        read_motion(path, result.job)
    assert said in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_bad_names_and_arguments_exit_with_2(boss: Path, tmp_path: Path, capsys) -> None:
    for argv, said in (
        (["--motion-in", "m.txt"], "m.txt: a motion file must end in .csv or .npz"),
        (["--motion", str(tmp_path / "m.xls")], "a motion file must end in .csv or .npz"),
        (["--motion-in", str(tmp_path / "none.csv")], "none.csv: no such file"),
        (["--motion-in", str(tmp_path / "none.npz")], "none.npz: no such file"),
        (["--motion-in", "m.csv", "--html", str(tmp_path / "r.html")], "--html: does not go with --motion-in"),
        (["--motion-in", "m.csv", "--e1", "10"], "--e1: does not go with --motion-in"),
    ):
        assert main(["check", str(boss), *argv]) == 2
        error = capsys.readouterr().err
        assert said in error
        assert error.count("\n") == 1
    (tmp_path / "no.npz").write_bytes(b"no archive")
    assert main(["check", str(boss), "--motion-in", str(tmp_path / "no.npz")]) == 2
    np.savez(tmp_path / "uneven.npz", t_s=np.zeros(3), A1_deg=np.zeros(2))
    assert main(["check", str(boss), "--motion-in", str(tmp_path / "uneven.npz")]) == 2
    assert "equally long" in capsys.readouterr().err


def test_repeated_rows_are_left_out_and_said(result: Result, tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    write_motion(path, result.motion)
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines[:5], lines[4], lines[4], *lines[5:]]) + "\n")
    read = read_motion(path, result.job)
    assert len(read.motion.t_s) == len(result.motion.t_s)
    assert read.repaired == (f"{path}: 2 row(s) that repeat the row before were left out, the first is row 5",)
    assert read.row[4] == 7  # rows keep the numbers they have in the file
