"""A sweep's log is believed only where it holds what was written, of the case as it is now."""

from __future__ import annotations

import errno
import json
import os
import random
from collections.abc import Callable
from pathlib import Path

import pytest
import trimesh

from cell.case.fingerprint import fingerprint
from cell.case.read import load_case
from cell.cli.main import main
from cell.errors import InputError
from cell.pose_sweep.grid import Pose
from cell.pose_sweep.log import Log, line_row, read_log, row_line
from cell.pose_sweep.picked_pose import picked_pose

ROWS = [
    {"E1_deg": 60.0, "E2_deg": -180.0, "verdict": "infeasible", "infeasible": 2, "reasons": {"no_path": 2}},
    {"E1_deg": 60.0, "E2_deg": 170.5, "verdict": "feasible", "infeasible": 0, "least_clearance_mm": 11.125},
    {"E1_deg": 90.0, "E2_deg": 0.0, "verdict": "feasible", "roll": "fixed:-60", "least_joint": "Ä1", "time_s": None},
]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "sweep.jsonl"
    with Log(str(path), "abc") as book:
        for row in ROWS:
            book.add(row)
    return path


def test_what_is_written_is_read(log: Path) -> None:
    found = read_log("sweep.jsonl", log.read_bytes())
    assert (found.case, found.rows, found.damaged) == ("abc", ROWS, [])
    assert json.loads(log.read_text().splitlines()[0]) == {"schema": "rbam-sweep-log/1", "case": "abc"}
    with Log(str(log), "abc") as book:
        assert book.done == {Pose.of(row): row for row in ROWS}
        assert book.damaged == 0


def test_no_single_flipped_bit_gives_another_row(log: Path) -> None:
    whole = log.read_bytes()
    start = whole.index(b"\n") + 1
    for at in range(start, len(whole)):
        for bit in random.Random(at).sample(range(8), 2):
            damaged = bytearray(whole)
            damaged[at] ^= 1 << bit
            found = read_log("sweep.jsonl", bytes(damaged))
            assert all(row in ROWS for row in found.rows)
            # the end of the last line is all that a cut off sweep can lack
            assert found.damaged or at == len(whole) - 1 or len(found.rows) < len(ROWS)
    for at in range(start):
        damaged = bytearray(whole)
        damaged[at] ^= 4
        log.write_bytes(damaged)
        with pytest.raises(InputError), Log(str(log), "abc"):
            pass


@pytest.mark.parametrize("line", [b"", b"{}", b"[]", b"nan", b'{"crc32": 5}', b"\xff", b"[" * 9999, row_line({})[:-3]])
def test_a_line_that_is_no_row_is_none(line: bytes) -> None:
    assert line_row(line) is None


def test_damaged_poses_are_told_and_computed_again(
    make_case: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case, log, json_ = make_case(), tmp_path / "sweep.jsonl", tmp_path / "map.json"
    argv = [
        "sweep",
        str(case),
        "--e1",
        "0",
        "--e2",
        "0:90:90",
        "--jobs",
        "1",
        "--out",
        str(log),
        "--json",
        str(json_),
    ]
    code = main(argv)
    whole, first = log.read_bytes(), json_.read_bytes()
    assert b"crc32" not in first
    capsys.readouterr()
    log.write_bytes(whole.replace(b"infeasible", b"Infeasible", 1))
    with pytest.raises(InputError, match="line 2 is damaged"):
        picked_pose(load_case(case), str(log), "0")
    assert main(argv) == code
    assert "1 damaged line(s) were left out; their poses are computed again" in capsys.readouterr().err
    assert json_.read_bytes() == first
    assert sorted(log.read_bytes().splitlines()) == sorted(whole.splitlines())


def test_a_full_disk_is_one_line(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    with Log(str(log), "abc") as book:
        before = log.read_bytes()
        monkeypatch.setattr(os, "write", full)
        with pytest.raises(InputError, match=r"sweep\.jsonl: cannot be written \(No space left on device\)"):
            book.add({"E1_deg": 1.0, "E2_deg": 2.0, "verdict": "feasible"})
        assert Pose(1.0, 2.0) not in book.done
    assert log.read_bytes() == before


def test_a_log_that_cannot_be_written_anew_stays_as_it_was(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    before = log.read_bytes().replace(b"170.5", b"171.5")  # a damaged line, which an opened log is without
    log.write_bytes(before)
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        with pytest.raises(InputError, match=r"sweep\.jsonl: cannot be written \(No space left on device\)"):
            Log(str(log), "abc")
    assert log.read_bytes() == before
    assert list(log.parent.iterdir()) == [log]


MODEL = """<mujoco>
  <compiler meshdir="../shared" texturedir="{root}/pictures"/>
  <include file='inner.xml'/>
  <asset><mesh name="a" file="a.stl"/><texture name="t" type="2d" file='t.png'/></asset>
</mujoco>"""
INNER = "<mujoco><asset><mesh name='b' file='{root}/else/b.obj'/></asset></mujoco>"


def test_whatever_the_cell_is_made_of_is_in_the_fingerprint(make_case: Callable[..., Path], tmp_path: Path) -> None:
    from PIL import Image

    for folder in ("mj", "shared", "pictures", "else"):
        (tmp_path / folder).mkdir()
    files = [tmp_path / name for name in ("mj/m.xml", "mj/inner.xml", "shared/a.stl", "pictures/t.png", "else/b.obj")]
    files[0].write_text(MODEL.format(root=tmp_path))
    files[1].write_text(INNER.format(root=tmp_path))
    for path in (files[2], files[4]):
        trimesh.creation.box((1, 1, 1)).export(path)
    Image.new("RGB", (8, 8)).save(files[3])
    path = make_case(positioner={"model": "mj/m.xml"})
    case = load_case(path)
    marks = [fingerprint(case)]
    assert fingerprint(load_case(path)) == marks[0]
    for file in (*files, tmp_path / "boss.stl"):
        file.write_bytes(file.read_bytes() + b" ")
        marks.append(fingerprint(case))
    assert len(set(marks)) == len(marks)
