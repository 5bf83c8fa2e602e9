"""No output destroys what a run reads, what another output writes, or anything that is no ordinary file."""

from __future__ import annotations

import ast
import os
from collections.abc import Callable
from pathlib import Path

import pytest
import trimesh
from support.paths import ROOT
from support.source_trees import nodes_of

from cell.atomic_files import check_outputs, write_text
from cell.case.files import case_files
from cell.case.read import load_case
from cell.cli.main import main
from cell.errors import InputError

TABLE = """<mujoco>
  <compiler meshdir="../shared"/>
  <include file="clamp.xml"/>
  <worldbody><body name="base"/></worldbody>
</mujoco>"""
CLAMP = """<mujoco>
  <asset><mesh name="clamp" file="clamp.obj"/></asset>
  <worldbody><geom type="mesh" mesh="clamp"/></worldbody>
</mujoco>"""


@pytest.fixture
def case(make_case: Callable[..., Path], tmp_path: Path) -> Path:
    """A case that extends another, with a table whose model includes another, which names a mesh elsewhere."""
    (tmp_path / "mj").mkdir()
    (tmp_path / "shared").mkdir()
    (tmp_path / "mj" / "table.xml").write_text(TABLE)
    (tmp_path / "mj" / "clamp.xml").write_text(CLAMP)
    trimesh.creation.box((1, 1, 1)).export(tmp_path / "shared" / "clamp.obj")
    make_case("base")
    top = tmp_path / "top.case.yaml"
    top.write_text("extends: base.case.yaml\npositioner: {model: mj/table.xml}\n")
    return top


READ = ["top.case.yaml", "base.case.yaml", "boss.stl", "mj/table.xml", "mj/clamp.xml", "shared/clamp.obj"]


def test_all_that_a_case_reads_is_known(case: Path, tmp_path: Path) -> None:
    found = {path.resolve() for path in case_files(load_case(case))}
    assert {(tmp_path / name).resolve() for name in READ} <= found


@pytest.mark.parametrize("name", READ)
@pytest.mark.parametrize("link", ["", "soft", "hard"])
def test_an_output_that_is_an_input_is_refused(
    name: str, link: str, case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target, out = tmp_path / name, tmp_path / "out.json"
    before = target.read_bytes()
    if link:
        {"soft": os.symlink, "hard": os.link}[link](target, out)
    assert main(["check", str(case), "--json", str(out if link else target)]) == 2
    assert "is read by this run" in capsys.readouterr().err
    assert target.read_bytes() == before


@pytest.mark.parametrize(
    ("argv", "says"),
    [
        (["slice", "boss.stl", "--targets", "boss.stl"], "is read by this run"),
        (["check", "base.case.yaml", "--json", "x", "--html", "x"], "--html: x is also the file of --json"),
        (["check", "base.case.yaml", "--json", "x", "--html", "mj/../x"], "is also the file of --json"),
        (["check", "base.case.yaml", "--json", "mj"], "is a folder"),
        (["check", "base.case.yaml", "--json", "/dev/null"], "is a device"),
        (["check", "base.case.yaml", "--json", "pipe"], "is not an ordinary file"),
        (["check", "base.case.yaml", "--json", "loop"], "in a circle"),
        (["check", "base.case.yaml", "--json", "a\0b"], "cannot be written"),
        (["check", "base.case.yaml", "--json", "a" * 300], "cannot be written"),
        (["check", "base.case.yaml", "--motion-in", "m.csv", "--json", "m.csv"], "is read by this run"),
        (["check", "base.case.yaml", "--program", "main.src", "--json", "main.src"], "is read by this run"),
        (["check", "base.case.yaml", "--program", "main.src", "--html", "called.src"], "is read by this run"),
        (["replay", "base.case.yaml", "--program", "main.src", "--picture", "main.dat"], "is read by this run"),
        (["sweep", "base.case.yaml", "--out", "base.case.yaml"], "is read by this run"),
        (["scene", "base.case.yaml", "--xml", "boss.stl"], "is read by this run"),
        (["replay", "base.case.yaml", "--picture", "boss.stl"], "is read by this run"),
    ],
)
def test_outputs_that_would_destroy_something_are_refused(
    argv: list[str],
    says: str,
    case: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.csv").write_text("t_s\n")
    for name in ("main.src", "main.dat", "called.src"):
        (tmp_path / name).write_text("DEF MAIN ( )\nEND\n")
    os.mkfifo(tmp_path / "pipe")
    os.symlink("loop", tmp_path / "loop")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert main(argv) == 2
    said = capsys.readouterr().err
    assert says in said
    assert said.count("\n") == 1
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


def test_a_symbolic_link_is_written_through_and_stays(tmp_path: Path) -> None:
    real, link, dangling = tmp_path / "real.json", tmp_path / "link.json", tmp_path / "new.json"
    real.write_text("old")
    real.chmod(0o640)
    link.symlink_to("real.json")
    dangling.symlink_to("made.json")
    for path in (link, dangling):
        write_text(path, "new")
        assert path.is_symlink()
    assert real.read_text() == (tmp_path / "made.json").read_text() == "new"
    assert real.stat().st_mode & 0o777 == 0o640
    assert len(list(tmp_path.iterdir())) == 4


def test_outputs_that_are_no_files_are_left_alone(tmp_path: Path) -> None:
    check_outputs({"--json": "-", "--html": None, "--csv": str(tmp_path / "new.csv")}, [tmp_path / "case.yaml"])
    with pytest.raises(InputError, match="does not exist"):
        check_outputs({"--json": str(tmp_path / "no" / "new.csv")})


# what writes into files by itself, and why nothing of it is left half-written
WRITES = {
    "cell/atomic_files.py": "it writes beside the file, and renames",
    "cell/pose_sweep/log.py": "it adds line by line, each with a checksum",
    "cell/programs/export.py": "into a folder that is gone afterwards",
    "cell/programs/exported/written_files.py": "into files of atomic_files",
    "cell/view/film.py": "into a file of atomic_files",
    "cell/view/picture.py": "into memory",
    "cell/view/layer_picture.py": "into memory",
    "cell/view/sweep_map_picture.py": "into memory",
    "cell/motion/motion_file.py": "into memory",
    "cell/streams.py": "to nowhere",
}
WRITING = {"write_text", "write_bytes", "save", "savez", "savez_compressed", "savetxt", "tofile", "export", "mkdir"}


def _writes(node: ast.AST) -> bool:
    if not isinstance(node, ast.Call):
        return False
    if isinstance(node.func, ast.Attribute) and node.func.attr in WRITING:
        return True
    name = node.func.id if isinstance(node.func, ast.Name) else getattr(node.func, "attr", "")
    given = [*node.args, *(keyword.value for keyword in node.keywords)]
    modes = [one.value for one in given if isinstance(one, ast.Constant) and isinstance(one.value, str)]
    flags = {one.attr for arg in given for one in ast.walk(arg) if isinstance(one, ast.Attribute)}
    return name == "open" and (any(mode.strip("bt") in ("w", "a", "x", "r+") for mode in modes) or "O_WRONLY" in flags)


def test_nothing_else_writes_files() -> None:
    found = {
        path.relative_to(ROOT).as_posix()
        for package in ("cell", "slicing", "ik")
        for path in (ROOT / package).rglob("*.py")
        if any(map(_writes, nodes_of(path)))
    }
    assert found == set(WRITES)
