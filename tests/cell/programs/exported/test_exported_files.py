"""The files of an exported program: those of `rbam export`, all or none."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.jobs.boss_motion import NEAR_HOME, boss_case
from support.jobs.indexed import backwards, three_case
from support.programs.boss_program import boss_program

import cell
from cell.cli.main import main


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.slow
def test_files_are_those_of_the_command(tmp_path: Path) -> None:
    case = boss_case(tmp_path, roll={"fixed_deg": 20.0}, robot=NEAR_HOME, controller={"program": "KNOB"})
    theirs, ours = tmp_path / "theirs", tmp_path / "ours"
    theirs.mkdir()
    outputs = ["--krl", str(theirs), "--csv", str(theirs / "points.csv"), "--robodk", str(theirs / "station.py")]
    assert main(["export", str(case), *outputs]) == 0
    result = cell.check(cell.prepare(cell.load_case(case)))
    made = cell.export_program(result.job, result.motion)
    paths = made.write(ours, csv=tmp_path / "points.csv", robodk=tmp_path / "station.py")
    assert [path.name for path in paths[:2]] == ["KNOB.src", "KNOB_L000.src"]
    assert paths[-2:] == (tmp_path / "points.csv", tmp_path / "station.py")
    for path in paths[-2:]:
        path.rename(ours / path.name)
    assert contents(ours) == contents(theirs)
    assert {path.name for path in paths} == set(contents(theirs))


def test_one_output_can_be_written_alone(tmp_path: Path) -> None:
    made = boss_program().made
    assert made.write(csv=tmp_path / "points.csv") == (tmp_path / "points.csv",)
    assert [path.name for path in tmp_path.iterdir()] == ["points.csv"]
    with pytest.raises(cell.InputError, match="no output"):
        made.write()


def test_a_program_with_a_fault_is_not_written(tmp_path: Path) -> None:
    case = cell.load_case(boss_case(tmp_path, roll={"fixed_deg": 20.0}, robot=NEAR_HOME, controller={"blend_mm": 5}))
    result = cell.check(cell.prepare(case))
    made = cell.export_program(result.job, result.motion)
    assert made.fault is not None
    before = sorted(tmp_path.iterdir())
    with pytest.raises(cell.InputError, match=r"^no program: boss_L000.src:"):
        made.write(tmp_path / "krl", csv=tmp_path / "points.csv")
    assert sorted(tmp_path.iterdir()) == before


def test_all_files_are_written_or_none(tmp_path: Path) -> None:
    made = boss_program().made
    out = tmp_path / "krl"
    with pytest.raises(cell.InputError, match="does not exist"):
        made.write(out, robodk=tmp_path / "missing" / "station.py")
    assert not out.exists()
    (tmp_path / "keep.csv").write_text("mine")
    for csv, words in (
        (tmp_path / "keep.csv", "is read by this run"),
        (out / "boss_L001.src", "is another file of this program"),
        (tmp_path / "krl" / ".." / "krl" / "boss_L001.src", "is also the file of"),
    ):
        with pytest.raises(cell.InputError, match=words):
            made.write(out, csv=csv, reads=[tmp_path / "keep.csv"])
        assert not out.exists()
    assert (tmp_path / "keep.csv").read_text() == "mine"


def test_what_the_case_reads_is_not_replaced(tmp_path: Path) -> None:
    made = boss_program().made
    stl = boss_program().job.case.path.parent / "boss.stl"
    before = stl.read_bytes()
    with pytest.raises(cell.InputError, match="is read by this run"):
        made.write(csv=stl)
    assert stl.read_bytes() == before
    with pytest.raises(cell.InputError, match="is not a folder"):
        made.write(stl)


@pytest.mark.slow
def test_a_program_of_layers_in_another_order_needs_no_other_job(tmp_path: Path) -> None:
    result = cell.check(cell.prepare(backwards(tmp_path)))
    assert result.motion is not None
    assert result.motion.order is not None
    one = cell.export_program(result.job, result.motion)
    other = cell.export_program(cell.prepare(three_case(tmp_path)), result.motion)
    assert one.fault is other.fault is None
    assert one.files == other.files
    assert contents_of(one, tmp_path / "one") == contents_of(other, tmp_path / "other")


def contents_of(made: cell.Exported, folder: Path) -> dict[str, bytes]:
    made.write(folder)
    return contents(folder)


def test_the_text_is_what_was_checked(tmp_path: Path) -> None:
    """The files that are written, read again, are the program that was judged."""
    boss = boss_program()
    main_module = boss.made.write(tmp_path / "krl")[0]
    program = cell.read_krl(main_module, cell.cell_controller(boss.job))
    assert cell.check_program(boss.job, program).feasible
