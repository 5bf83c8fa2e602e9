"""The exit code is the verdict: whatever becomes of the streams, and whatever goes wrong in the program itself."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
import trimesh
from support.paths import ROOT

from cell.atomic_files import beside
from cell.cli import main as cli
from cell.cli.main import main
from cell.errors import InputError, WorkerKilledError
from cell.motion.motion_file import write_motion
from cell.printable import printable
from cell.streams import Stream
from cell.termination import Terminated
from cell.verdict.result import Result


class Gone(io.StringIO):
    """A pipe whose reader has left."""

    def write(self, text: str) -> int:
        raise BrokenPipeError

    def flush(self) -> None:
        raise BrokenPipeError


@pytest.fixture
def cases(make_case: Callable[..., Path]) -> dict[int, str]:
    """A feasible and an infeasible case by their exit codes."""
    far = {"position_mm": [4000, 0, 0]}
    return {0: str(make_case("near")), 1: str(make_case("far", positioner=far))}


def test_a_reader_that_leaves_changes_no_verdict(cases: dict[int, str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", Gone())
    monkeypatch.setattr(sys, "stderr", Gone())
    for code, case in cases.items():
        assert main(["check", case, "--no-remedies"]) == code
    assert main(["check", cases[1], "--no-remedies", "--json", "-"]) == 1
    assert main(["check", "missing.case.yaml"]) == 2


def test_nothing_infeasible_ends_with_0(make_case: Callable[..., Path], little: Result, tmp_path: Path) -> None:
    motion, far = str(tmp_path / "m.csv"), str(make_case("far", positioner={"position_mm": [4000, 0, 0]}))
    write_motion(motion, little.motion)
    assert main(["check", far, "-q", "--motion-in", motion]) == 1
    assert main(["sweep", far, "-q", "--e1", "90", "--e2", "180", "--jobs", "1"]) == 1


@pytest.mark.slow
def test_every_command_that_judges_ends_with_its_verdict(cases: dict[int, str], tmp_path: Path) -> None:
    motion = str(tmp_path / "m.csv")
    assert main(["check", cases[0], "-q", "--motion", motion]) == 0
    for code, case in cases.items():
        assert main(["check", case, "-q", "--no-remedies"]) == code
        assert main(["check", case, "-q", "--motion-in", motion]) == code
        assert main(["sweep", case, "-q", "--e1", "90", "--e2", "180", "--jobs", "1"]) == code
        assert main(["export", case, "-q", "--csv", str(tmp_path / f"points{code}.csv")]) == code
    assert not (tmp_path / "points1.csv").exists()


def test_a_standard_output_that_cannot_be_written_is_one_line(
    cases: dict[int, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    case = cases[1]
    with monkeypatch.context() as patch:
        patch.setattr(sys, "stdout", None)
        assert main(["check", "-q", case]) == 1  # nothing is to be said
        assert main(["check", case, "--no-remedies"]) == 2
    assert capsys.readouterr().err == "rbam: standard output: cannot be written (it is closed)\n"
    if os.path.exists("/dev/full"):
        with open("/dev/full", "w") as full, monkeypatch.context() as patch:
            patch.setattr(sys, "stdout", full)
            assert main(["check", case, "--no-remedies"]) == 2
        assert capsys.readouterr().err == "rbam: standard output: cannot be written (No space left on device)\n"


def test_characters_that_an_encoding_lacks_are_no_error(
    make_case: Callable[..., Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding="cp1252"))
    case = make_case()
    case.write_text(case.read_text() + "name: Flügel Ω\n", encoding="utf-8")
    assert main(["check", str(case)]) == 0
    assert raw.getvalue().startswith("Flügel ?  E1 = 90".encode("cp1252"))


@pytest.mark.parametrize("error", [RuntimeError("two\nlines"), KeyError("x"), MemoryError(), RecursionError()])
def test_an_unexpected_error_is_no_verdict(
    error: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(_: object) -> int:
        raise error

    monkeypatch.setitem(cli.COMMANDS, "check", fail)
    monkeypatch.delenv("RBAM_TRACEBACK", raising=False)
    assert main(["check"]) == 70
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("rbam: ")
    assert said.err.count("\n") == 1
    assert ("RBAM_TRACEBACK" in said.err) != isinstance(error, MemoryError)
    assert main(["check", "--verbose"]) == 70
    assert "Traceback" in capsys.readouterr().err
    monkeypatch.setenv("RBAM_TRACEBACK", "1")
    assert main(["check"]) == 70
    assert "Traceback" in capsys.readouterr().err


def test_a_worker_that_is_killed_is_no_verdict_and_no_fault_of_the_input(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(_: object) -> int:
        raise WorkerKilledError("a worker process was killed")

    monkeypatch.setitem(cli.COMMANDS, "check", fail)
    assert main(["check", "--verbose"]) == 70
    # nothing is to be reported: the program is not at fault either
    assert capsys.readouterr() == ("", "rbam: a worker process was killed\n")


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP] if os.name == "posix" else [])
def test_a_signal_leaves_nothing_half_written(
    number: signal.Signals, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def write(_: object) -> int:
        with beside(tmp_path / "film.mp4") as file:
            file.write_bytes(b"half")
            assert len(list(tmp_path.iterdir())) == 1
            os.kill(os.getpid(), number)
            time.sleep(5)
        return 0

    monkeypatch.setitem(cli.COMMANDS, "check", write)
    before = signal.getsignal(signal.SIGINT)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where the tests run behind a shell
    try:
        assert main(["check"]) == 128 + number
    finally:
        signal.signal(signal.SIGINT, before)
    assert list(tmp_path.iterdir()) == []
    assert capsys.readouterr().err.count("\n") == 1
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


@pytest.mark.parametrize(("ended", "code"), [(KeyboardInterrupt(), 130), (Terminated(15), 143)])
@pytest.mark.parametrize("error", [ImportError("initialization failed"), InputError("MUJOCO_GL=egl: cannot draw")])
def test_a_signal_is_no_error_whatever_a_library_makes_of_it(
    error: Exception,
    ended: BaseException,
    code: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(_: object) -> int:
        try:
            try:
                raise ended
            except BaseException as first:  # as pybind11 does where a signal comes while a module is imported
                raise ImportError("initialization failed") from first
        except ImportError:
            raise error from None

    monkeypatch.setitem(cli.COMMANDS, "check", fail)
    assert main(["check"]) == code
    assert capsys.readouterr().err in ("rbam: interrupted\n", "rbam: terminated\n")


INTERRUPTING = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # ignored where the tests run behind a shell
class Interrupting:
    def find_spec(self, name, path=None, target=None):
        if name == {module!r}:
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupting())
sys.argv = ["rbam", "slice", "no.stl"]
"""
AS_A_MODULE = "import runpy; runpy.run_module('cell', run_name='__main__', alter_sys=True)"


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")
@pytest.mark.parametrize(
    ("module", "as_module"), [("cell.cli.main", False), ("multiprocessing", True), ("cell.cli.slice_command", False)]
)
def test_ctrl_c_while_the_program_is_imported_is_one_line(module: str, as_module: bool) -> None:
    script = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["scripts"]["rbam"].split(":")
    start = AS_A_MODULE if as_module else "from {} import {} as begin; sys.exit(begin())".format(*script)
    program = INTERRUPTING.format(module=module) + start
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "rbam: interrupted\n")


@pytest.mark.skipif(os.name != "posix", reason="closed streams are the shell's")
def test_streams_that_are_closed_from_the_start() -> None:
    command = f"{sys.executable} -m cell slice no.stl >&- 2>&- <&-"
    root = ROOT
    assert subprocess.run(["sh", "-c", command], cwd=root, check=False).returncode == 2


@pytest.mark.skipif(os.name != "posix", reason="closed streams are the shell's")
def test_no_file_gets_the_number_of_a_closed_stream(tmp_path: Path) -> None:
    """What a library prints by that number would be in the file."""
    program = """
import os, sys
from cell.streams import standard_streams
for number in range(3):
    os.close(number)
with standard_streams(), open(sys.argv[1], "w") as file:
    file.write(str(file.fileno()))
"""
    subprocess.run([sys.executable, "-c", program, str(tmp_path / "number")], cwd=ROOT, check=False)
    assert int((tmp_path / "number").read_text()) > 2


@pytest.mark.parametrize(
    "argv",
    [
        ["check", ""],
        ["check", "CASE", "--motion-in", ""],
        ["check", "CASE", "--program", ""],
        ["compare", ""],
        ["export", "", "--csv", "points.csv"],
        ["replay", "", "--picture", "cell.png"],
        ["scene", ""],
        ["slice", ""],
        ["sweep", "", "--e1", "90", "--e2", "180"],
    ],
)
def test_an_empty_argument_is_no_verdict_on_something_else(
    argv: list[str],
    cases: dict[int, str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    code = main([cases[0] if arg == "CASE" else arg for arg in argv])
    out, err = capsys.readouterr()
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    assert "is empty" in err
    assert not {"points.csv", "cell.png"} & {path.name for path in tmp_path.iterdir()}


def test_a_part_that_is_refused_is_one_line(tmp_path: Path) -> None:
    """Solids that an error's frames still hold when the process ends would be told of by the library they are of."""
    trimesh.creation.cylinder(50, 20, sections=64).export(tmp_path / "disc.stl")
    command = [sys.executable, "-m", "cell", "slice", str(tmp_path / "disc.stl")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("rbam: disc: nothing stands on its round body (radius 50 mm)")
    assert done.stderr.count("\n") == 1


def test_what_is_said_stays_one_line() -> None:
    assert printable("a\nb\x1b[2Jc\x9b") == "a\\x0ab\\x1b[2Jc\\x9b"
    assert printable("Flügel [left] 叶") == "Flügel [left] 叶"
    stream = Stream(None, "standard error", required=False)
    assert stream.write("lost") == 4
    assert not stream.isatty()


def test_brackets_in_names_are_no_markup(make_case: Callable[..., Path], capsys: pytest.CaptureFixture[str]) -> None:
    case = make_case()
    case.write_text(case.read_text() + 'name: "rig [bold] [/rev] :smile:"\n', encoding="utf-8")
    assert main(["check", str(case)]) == 0
    assert "rig [bold] [/rev] :smile:" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("command", "code"), [(["scene"], 0), (["check", "-q", "--no-remedies"], 0), (["replay", "--picture", "p.png"], 2)]
)
def test_a_backend_of_drawing_that_is_none_concerns_what_draws_alone(
    command: list[str], code: int, make_case: Callable[..., Path]
) -> None:
    case = make_case()
    env = {**os.environ, "MUJOCO_GL": "nonsense", "PYTHONPATH": str(ROOT)}
    argv = [sys.executable, "-m", "cell", *command, case.name]
    done = subprocess.run(argv, cwd=case.parent, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    if code:
        assert done.stderr.startswith("rbam: MUJOCO_GL=nonsense: MuJoCo cannot draw with it (")
        assert done.stderr.count("\n") == 1
        assert not (case.parent / "p.png").exists()
