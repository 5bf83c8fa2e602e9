"""Who computes a sweep changes nothing, and whoever dies or is stopped leaves a log to go on from."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from support.paths import ROOT

from cell.case.read import load_case
from cell.cli.main import main
from cell.pose_sweep.grid import Pose
from cell.pose_sweep.log import read_log
from cell.pose_sweep.sweep import sweep
from cell.pose_sweep.workers import AHEAD, completed, worker_processes

POSES = [(90.0, 180.0), (0.0, 0.0), (-120.0, 45.0), (45.0, 90.0)]
POSIX = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")


class Kill:
    """A unit that takes its worker process with it."""

    def __call__(self) -> int:
        os.kill(os.getpid(), signal.SIGKILL)
        return 0


class Late(Executor):
    """Gives results in the reverse of the order they were asked for in."""

    def __init__(self) -> None:
        self.waiting: list[tuple[Future[Any], Callable[..., Any], tuple[Any, ...]]] = []
        self.most = 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        self.waiting.append((future, fn, args))
        self.most = max(self.most, len(self.waiting))
        real = future.add_done_callback

        def add(callback: Callable[[Future[Any]], object]) -> None:
            real(callback)
            if len(self.waiting) == AHEAD or args[0].last:
                while self.waiting:
                    asked, call, given = self.waiting.pop()
                    asked.set_result(call(*given))

        future.add_done_callback = add  # type: ignore[method-assign]
        return future


class Number:
    def __init__(self, value: int, last: bool = False) -> None:
        self.value, self.last = value, last

    def __call__(self) -> int:
        return self.value


def test_units_are_sent_a_few_at_a_time_and_none_is_lost() -> None:
    late = Late()
    n = 3 * AHEAD - 5
    found = list(completed(late, (Number(i, i == n - 1) for i in range(n))))
    assert sorted(found) == list(range(n))
    assert late.most <= AHEAD


def test_a_broken_executor_gives_what_was_done_first() -> None:
    class Breaks(Late):
        def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
            future: Future[Any] = Future()
            if args[0].value < 2:
                future.set_result(args[0].value)
            elif args[0].value == 2:
                future.set_exception(BrokenExecutor())
            else:
                raise BrokenExecutor
            return future

    results = completed(Breaks(), map(Number, range(9)))
    assert [next(results), next(results)] == [0, 1]
    with pytest.raises(BrokenExecutor):
        next(results)


@pytest.mark.slow
def test_who_computes_changes_nothing(make_case: Callable[..., Path]) -> None:
    case = load_case(make_case(roll={"fixed_deg": -60}))
    poses = [*POSES, Pose(90.0, 180.0, "fixed:-60", None, 110.0), Pose(90.0, 180.0, "range:-75:-45")]
    alone = sweep(case, poses, processes=1)
    assert any(row["verdict"] == "feasible" for row in alone)
    assert sweep(case, poses, processes=2) == alone
    with ThreadPoolExecutor(2) as threads:
        assert sweep(case, poses, executor=threads) == alone
        assert threads.submit(int, "5").result() == 5  # it is left running


@pytest.mark.slow
@POSIX
def test_a_killed_worker_is_one_line_and_the_log_keeps_what_was_done(
    make_case: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import cell.pose_sweep.sweep as module

    path, log = make_case(), tmp_path / "log.jsonl"
    whole = sweep(load_case(path), POSES[1:], processes=1)
    with worker_processes(1) as pool, pytest.raises(BrokenExecutor):
        list(completed(pool, [Kill()]))

    real = module._outcomes

    def dies(work: Any, workers: int | None, executor: Executor | None) -> Any:
        yield next(real(work, 1, None))
        raise BrokenExecutor

    argv = ["sweep", str(path), "--e1", "0:45:45", "--e2", "0", "--out", str(log)]
    with monkeypatch.context() as patch:
        patch.setattr(module, "_outcomes", dies)
        assert main(argv) == 70
    error = capsys.readouterr().err
    assert "killed" in error
    assert "after 1 of 2 poses" in error
    assert str(log) in error
    assert error.count("\n") == 1
    assert read_log(str(log), log.read_bytes()).rows[0] == whole[0]


def descendants(pid: int) -> list[int]:
    """Processes that come from one, from /proc."""
    parents = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parents[int(folder.name)] = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        except (OSError, ValueError, IndexError):
            continue
    found, front = [], [pid]
    while front:
        front = [child for child, parent in parents.items() if parent in front]
        found += front
    return found


def wait_until(true: Callable[[], bool], seconds: float = 60) -> None:
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.05)


def started(case: Path, log: Path) -> tuple[subprocess.Popen[str], list[int]]:
    """A sweep of its own, some poses in, and its processes."""
    argv = [sys.executable, "-m", "cell", "sweep", str(case), "--e1", "0:90:0.1", "--e2", "-180:135:45"]
    run = subprocess.Popen(
        [*argv, "--jobs", "2", "--out", str(log)],
        cwd=ROOT,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )
    wait_until(lambda: log.exists() and len(log.read_text().splitlines()) > 2)
    return run, descendants(run.pid)


def gone(pids: list[int]) -> bool:
    return not any(Path(f"/proc/{pid}").exists() for pid in pids)


@POSIX
@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc")
@pytest.mark.parametrize("stop", ["interrupted", "killed"])
def test_a_stopped_sweep_leaves_its_log_and_no_processes(
    make_case: Callable[..., Path], tmp_path: Path, stop: str
) -> None:
    case, log = make_case(roll={"fixed_deg": -60}), tmp_path / "log.jsonl"
    run, workers = started(case, log)
    assert len(workers) >= 2
    if stop == "interrupted":
        os.killpg(run.pid, signal.SIGINT)  # as a terminal does: parent and workers alike
        _, error = run.communicate(timeout=60)
        assert run.returncode == 130
        assert error == "rbam: interrupted\n"
    else:
        run.kill()
        run.communicate(timeout=60)
    wait_until(lambda: gone(workers))
    rows = read_log(str(log), log.read_bytes()).rows
    poses = [Pose.of(row) for row in rows]
    assert len(poses) >= 2
    again = sweep(load_case(case), poses, processes=1, log=str(log))  # nothing is left to do
    assert again == rows


# ---- Dask


def test_dask_that_is_not_there_is_one_line(make_case: Callable[..., Path], capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("distributed", reason="the package distributed is not installed (extra dask)")
    import cell.pose_sweep.workers as module

    wait = pytest.MonkeyPatch()
    wait.setattr(module, "CONNECT_S", 0.3)
    try:
        argv = ["sweep", str(make_case()), "--e1", "0", "--e2", "0", "--dask", "tcp://127.0.0.1:9"]
        assert main(argv) == 2
    finally:
        wait.undo()
    assert "no scheduler answers at tcp://127.0.0.1:9" in capsys.readouterr().err


def test_without_the_extra_dask_it_is_named(
    make_case: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert main(["sweep", str(make_case()), "--e1", "0", "--e2", "0", "--dask", "tcp://127.0.0.1:9"]) == 2
    assert capsys.readouterr().err == "rbam: --dask needs the extra dask: pip install 'rbam-cell[dask]'\n"


@POSIX
@pytest.mark.slow
def test_a_dask_cluster_survives_a_killed_worker(make_case: Callable[..., Path], tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="the package distributed is not installed (extra dask)")
    from distributed import LocalCluster

    case = load_case(make_case(roll={"fixed_deg": -60}))
    poses = [(float(e1), float(e2)) for e1 in (0, 90) for e2 in range(-180, 136, 45)]
    alone = sweep(case, poses, processes=1)
    log = tmp_path / "log.jsonl"
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
        from cell.pose_sweep.workers import dask_cluster

        before = {w["id"] for w in cluster.scheduler_info["workers"].values()}
        victim = next(iter(cluster.workers.values())).process.process.pid

        class Killing(Executor):
            """Kills one worker after the first units are back."""

            def __init__(self, real: Executor) -> None:
                self.real, self.back = real, 0

            def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
                future = self.real.submit(fn, *args, **kwargs)
                future.add_done_callback(self._count)
                return future

            def _count(self, _: object) -> None:
                self.back += 1
                if self.back == 2:
                    os.kill(victim, signal.SIGKILL)

        with dask_cluster(cluster.scheduler_address) as executor:
            assert len(before) == 2
            assert sweep(case, poses, log=str(log), executor=Killing(executor)) == alone
    assert len(log.read_text().splitlines()) == 1 + len(poses)
