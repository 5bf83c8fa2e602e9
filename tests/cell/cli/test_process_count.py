"""``--jobs``: the same documents with any number of processes, errors as themselves, nobody left behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import trimesh
import yaml
from support.jobs.cases import little_case
from support.paths import ROOT

from cell.cli.main import main
from cell.processes.work_round import WorkerTraceback
from cell.processes.worker_pool import cores
from cell.verdict.result import Result

POSIX = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")


def round_case(folder: Path) -> Path:
    """A round boss of many thin layers: more targets than one chunk has."""
    boss = trimesh.creation.cylinder(14.0, 24.0, sections=120)
    boss.apply_transform(trimesh.transformations.rotation_matrix(1.5707963267948966, [0, 1, 0]))
    boss.apply_translation([-27.0, 0.0, 37.5])
    boss.export(folder / "boss.stl")
    content = {
        "part": {"sub_volumes": ["boss.stl"], "body": {"radius_mm": 30, "z_mm": [0, 75]}},
        "slicing": {"strategy": "planar", "h_layer_mm": 0.3, "h_min_mm": 0.3, "h_max_mm": 0.3},
        "sampling": {"chord_tolerance_mm": 0.02, "min_segment_mm": 1.0},
        "support": {"radius_mm": 20, "height_mm": 120},
        "positioner": {"position_mm": [1550, 0, 0], "rotation_deg": [0, 0, -90]},
        "table": {"E1_deg": 90, "E2_deg": 180},
    }
    path = folder / "round.case.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


@pytest.mark.parametrize("command", ["check", "export", "replay"])
def test_a_number_that_is_none_is_one_line(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    case = str(little_case(tmp_path))
    monkeypatch.chdir(tmp_path)
    out = {"check": [], "export": ["--krl", "out"], "replay": ["--picture", "out.png"]}[command]
    assert main([command, case, "--jobs", "0", *out]) == 2
    assert capsys.readouterr().err == "rbam: --jobs: 0 is not a number of processes; 1 or more is needed\n"
    assert not list(tmp_path.glob("out*"))


def test_a_motion_is_exported_without_a_search(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["export", str(little_case(tmp_path)), "--motion-in", "m.csv", "--krl", str(tmp_path), "--jobs", "2"]
    assert main(argv) == 2
    assert capsys.readouterr().err.startswith("rbam: --jobs: leave it out with --motion-in")


def test_all_cores_are_used_unless_it_says_otherwise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, little: Result
) -> None:
    asked: list[int] = []

    def checked(*_: object, processes: int = 1) -> Result:
        asked.append(processes)
        return little

    monkeypatch.setattr("cell.verdict.by_table_mode.prepare_and_check", checked)
    case = str(little_case(tmp_path))
    assert main(["check", case, "-q"]) == 0
    assert main(["check", case, "-q", "--jobs", "3"]) == 0
    assert asked == [cores(), 3]


def test_an_error_of_a_worker_is_told_with_its_own_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def checked(*_: object, **__: object) -> Result:
        error = ZeroDivisionError("division by zero")
        error.__cause__ = WorkerTraceback("Traceback: in there\n", "planning/travel.py:7")
        raise error

    monkeypatch.setattr("cell.verdict.by_table_mode.prepare_and_check", checked)
    case = str(little_case(tmp_path))
    assert main(["check", case]) == 70
    assert "(ZeroDivisionError: division by zero; at planning/travel.py:7)" in capsys.readouterr().err
    assert main(["check", case, "--verbose"]) == 70
    assert "Traceback: in there" in capsys.readouterr().err


@pytest.mark.slow
def test_documents_are_the_same_in_one_process_and_in_two(tmp_path: Path) -> None:
    case = str(round_case(tmp_path))
    for name, program, jobs in (("1", AS_IT_IS, "1"), ("2", AS_IT_IS, "2"), ("spawned", SPAWNED, "2")):
        outputs = ["--motion", str(tmp_path / f"{name}.csv"), "--json", str(tmp_path / f"{name}.json")]
        argv = [sys.executable, "-c", program, "check", case, "--jobs", jobs, "-q", *outputs]
        assert subprocess.run(argv, cwd=ROOT, check=False).returncode == 0
    for name, kind in ((name, kind) for name in ("2", "spawned") for kind in ("csv", "json")):
        assert (tmp_path / f"1.{kind}").read_bytes() == (tmp_path / f"{name}.{kind}").read_bytes()


AS_IT_IS = "from cell.cli.main import main; raise SystemExit(main())"
SPAWNED = (
    "import cell.processes.worker_pool as c; c.may_fork = lambda: False; "
    "import cell.job.job as j; j.WORTH_A_START = 0; " + AS_IT_IS
)


def children(pid: int) -> list[int]:
    """Processes that a process has started."""
    return [int(p) for p in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


@POSIX
@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
@pytest.mark.parametrize(("program", "least"), [(AS_IT_IS, 1), (SPAWNED, 2)])  # one worker, and multiprocessing's own
@pytest.mark.parametrize(
    ("number", "code", "told"),
    [
        (signal.SIGINT, 130, "rbam: interrupted\n"),
        (signal.SIGTERM, 143, "rbam: terminated\n"),
        (signal.SIGKILL, -9, ""),
    ],
)
def test_a_stopped_check_leaves_nothing_behind(
    number: int, code: int, told: str, program: str, least: int, tmp_path: Path
) -> None:
    out = tmp_path / "out.json"
    argv = [sys.executable, "-c", program, "check", str(round_case(tmp_path)), "--jobs", "2", "--json", str(out)]
    run = subprocess.Popen(argv, cwd=ROOT, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    end = time.monotonic() + 120
    while len(started := children(run.pid)) < least:
        assert run.poll() is None
        assert time.monotonic() < end
        time.sleep(0.02)
    time.sleep(0.2)
    run.send_signal(number)
    _, error = run.communicate(timeout=60)
    assert (run.returncode, error) == (code, told)
    while any(Path(f"/proc/{pid}").exists() for pid in started):
        assert time.monotonic() < end
        time.sleep(0.05)
    assert not out.exists()


@POSIX
@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
def test_a_worker_that_the_system_kills_is_no_verdict(tmp_path: Path) -> None:
    out = tmp_path / "out.json"
    argv = [sys.executable, "-c", AS_IT_IS, "check", str(round_case(tmp_path)), "--jobs", "2", "--json", str(out)]
    run = subprocess.Popen(argv, cwd=ROOT, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    end = time.monotonic() + 120
    while not (started := children(run.pid)):
        assert run.poll() is None
        assert time.monotonic() < end
        time.sleep(0.01)
    os.kill(started[0], signal.SIGKILL)
    said, error = run.communicate(timeout=60)
    assert (run.returncode, said) == (70, "")
    assert error == (
        "rbam: a worker process was killed (too little memory?): no verdict; --jobs 1 needs the least memory\n"
    )
    assert not out.exists()
