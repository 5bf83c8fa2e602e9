"""Work shared out among processes: the same results, the first error, and nobody left behind.

Workers are copies of this process where they may be, and begin with nothing elsewhere: both are tested alike. Runners
of tests have threads of their own: copies are tested in a process without.
"""

from __future__ import annotations

import faulthandler
import hashlib
import multiprocessing
import os
import pickle
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from support.paths import ROOT

from cell.case.read import load_case
from cell.errors import InputError
from cell.job.job import prepare
from cell.processes.own_process import ENDING, at_rest, may_fork
from cell.processes.worker import Tick, _heard
from cell.processes.worker_pool import WorkerPool, WorkerTraceback, cores, pool, processor_time, working
from cell.progress import phase, watched
from cell.shipped import DEFAULT_CASE
from cell.termination import Terminated, terminable

POSIX = pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")
LINUX = pytest.mark.skipif(sys.platform != "linux", reason="nowhere else are processes copied")
ALONE = "RBAM_TEST_COPIES"  # set in the process that tests copies


@pytest.fixture(scope="module", params=["spawned", "copied"], autouse=True)
def how(request: pytest.FixtureRequest) -> Iterator[str]:
    """How workers begin."""
    copied = request.param == "copied"
    if copied and ALONE not in os.environ:
        pytest.skip("tested in a process of its own")
    with pytest.MonkeyPatch.context() as patch:
        for name in ("may_fork", "at_rest"):
            patch.setattr(f"cell.processes.worker_pool.{name}", lambda: copied)
        yield request.param


@LINUX
@pytest.mark.skipif(ALONE in os.environ, reason="this is that process")
@pytest.mark.parametrize("which", ["not slow", pytest.param("slow", marks=pytest.mark.slow)])
def test_all_holds_of_copies(which: str) -> None:
    options = ["-q", "-p", "no:xdist", "-p", "no:cacheprovider", "-k", "copied", "-m", which]
    argv, env = [sys.executable, "-m", "pytest", *options, __file__], {**os.environ, ALONE: "1"}
    done = subprocess.run(argv, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert "passed" in done.stdout


def powered(shared: float, item: int, tick: Tick) -> tuple[int, float]:
    """What is computed, and where."""
    for _ in range(item):
        tick()
    return os.getpid(), shared**item


def knows(shared: str, _: int, __: Tick) -> tuple[int, bool]:
    """Who computes, and whether a module was imported there."""
    return os.getpid(), shared in sys.modules


def stands_still(shared: float, item: float, _: Tick) -> int:
    """Takes a while by the clock."""
    time.sleep(item)
    return os.getpid()


def fails(shared: None, item: int, _: Tick) -> int:
    """The later the sooner: what is handed out last fails first."""
    time.sleep(0.3 if item == 1 else 0.0)
    if item == 1:
        raise InputError("the first that fails")
    if item > 1:
        raise ValueError(f"item {item}")
    return item


class Stubborn(Exception):
    """Cannot be made again from what it was made of."""

    def __init__(self, a: int, b: int) -> None:
        super().__init__(f"{a} and {b}")


def fails_oddly(shared: None, item: int, _: Tick) -> None:
    """With an error that cannot be sent."""
    raise Stubborn(1, 2)


def ends_itself(shared: None, item: int, _: Tick) -> None:
    """By a signal."""
    faulthandler.disable()  # a copy has pytest's, which would tell of it
    os.kill(os.getpid(), item)
    time.sleep(60)


def gone(pids: list[int]) -> bool:
    """Whether none of these processes is a child of this one any more."""
    return not {child.pid for child in multiprocessing.active_children()} & set(pids)


def spins(shared: None, item: float, _: Tick) -> float:
    """Takes processor time."""
    end = time.process_time() + item
    while time.process_time() < end:
        pass
    return item


@pytest.fixture(scope="module")
def two(how: str) -> Iterator[WorkerPool]:
    mine = WorkerPool(2)
    yield mine
    mine.close(at_once=False)


def test_alone_work_is_done_here() -> None:
    steps: list[None] = []
    found = WorkerPool(1).run(powered, 1.1, [0, 1, 2], lambda: steps.append(None))
    assert {pid for pid, _ in found} == {os.getpid()}
    assert len(steps) == 3
    assert pool().processes == 1
    with working(1) as mine:
        assert mine.processes == 1
        assert not mine.workers()


def test_one_item_starts_nobody() -> None:
    with working(3) as mine:
        assert mine.run(powered, 2.0, [3]) == [(os.getpid(), 8.0)]
        assert not mine.workers()


@pytest.mark.slow
def test_results_come_in_order_whoever_has_them(two: WorkerPool) -> None:
    items = [5, 0, 3, 1, 4, 2, 6]
    steps: list[None] = []
    alone = [value for _, value in WorkerPool(1).run(powered, 1.1, items)]
    assert [value for _, value in two.run(powered, 1.1, items, lambda: steps.append(None))] == alone
    assert len(steps) == sum(items)
    pids = set(two.run(stands_still, 0.0, [0.2] * 4))
    assert len(pids) == 2
    assert os.getpid() not in pids
    # what is shared is what was given last, not what was sent first
    shared = np.arange(3.0)
    assert [float(v.sum()) for _, v in two.run(powered, shared, [1, 2])] == [3.0, 5.0]


@pytest.mark.slow
def test_the_first_item_that_fails_is_told(two: WorkerPool) -> None:
    with pytest.raises(InputError, match="the first that fails") as found:
        two.run(fails, None, [0, 1, 2, 3, 4])
    cause = found.value.__cause__
    assert isinstance(cause, WorkerTraceback)
    assert "in fails" in str(cause)
    assert cause.place.startswith("processes/test_worker_pool.py:")
    # also where what fails first is handed out first
    with pytest.raises(InputError, match="the first that fails"):
        two.run(fails, None, [0, 1, 2, 3, 4], sizes=[0, 1, 2, 3, 4])
    with pytest.raises(RuntimeError, match="Stubborn: 1 and 2"):
        two.run(fails_oddly, None, [0, 1])
    assert [value for _, value in two.run(powered, 2.0, [1, 2])] == [2.0, 4.0]  # the workers go on


@pytest.mark.slow
def test_what_takes_longest_is_handed_out_first_and_of_what_takes_as_long_the_last(
    two: WorkerPool, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[int] = []
    send = two.send

    def noted(worker: Any, index: int, *call: Any) -> None:
        sent.append(index)
        send(worker, index, *call)

    monkeypatch.setattr(two, "send", noted)
    found = two.run(powered, 2.0, [0, 1, 2, 3, 4, 5], sizes=[1, 3, 2, 3, 4, 1])
    assert sent == [4, 3, 1, 2, 5, 0]
    assert [value for _, value in found] == [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]


def told_of(shared: Any, item: int, _: Tick) -> tuple[int, bool, bool]:
    """Who is at work in a worker, and how it ends on a signal."""
    phase("in a worker")(int)()
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    return pool().processes, blocked.isdisjoint(ENDING), all(signal.getsignal(k) == signal.SIG_DFL for k in ENDING)


class Nobody:
    """Is told of phases, and does not want to be."""

    def during(self, phase: str, spins: bool, /) -> Any:
        raise AssertionError(phase)


@POSIX
def test_nothing_of_the_parent_goes_on_in_a_worker() -> None:
    with terminable(), watched(Nobody()), working(2) as mine:
        assert mine.run(told_of, None, [0, 1]) == [(1, True, True)] * 2


def called(shared: Any, item: float, _: Tick) -> float:
    """What is shared, of an item."""
    return float(shared(item))


def test_a_copy_has_what_is_shared_from_the_beginning(how: str) -> None:
    if how == "spawned":
        with working(2) as mine, pytest.raises((AttributeError, pickle.PicklingError)):
            mine.run(called, lambda x: 2 * x, [1.0, 2.0])
        return
    with working(2) as mine:
        mine.get_ready(lambda x: 2 * x, 2, copies=False)
        assert not mine.workers()
        mine.begin(2, "this")
        assert not mine.workers()
        double = lambda x: 2 * x  # noqa: E731 (cannot be sent)
        mine.get_ready(double, 2)
        assert len(mine.workers()) == 2
        assert mine.run(called, double, [1.0, 2.0]) == [2.0, 4.0]
        assert mine.run(called, np.sqrt, [4.0, 9.0]) == [2.0, 3.0]


@LINUX
def test_no_copy_is_made_while_another_thread_is_at_something(how: str, monkeypatch: pytest.MonkeyPatch) -> None:
    end = threading.Event()
    other = threading.Thread(target=end.wait, daemon=True)
    other.start()
    assert not may_fork()
    end.set()
    other.join()
    if how == "copied":
        assert may_fork()
    monkeypatch.setattr("sys.platform", "darwin")
    assert not may_fork()


@LINUX
def test_a_thread_of_a_library_is_at_rest_when_it_sleeps() -> None:
    end = threading.Event()
    asleep = threading.Thread(target=end.wait, daemon=True)
    asleep.start()
    latest = time.monotonic() + 60
    while not at_rest():
        assert time.monotonic() < latest
    end.set()
    asleep.join()
    busy = threading.Thread(target=busy_outside_of_python, daemon=True)
    busy.start()
    assert not at_rest()
    busy.join()


def busy_outside_of_python() -> None:
    """Takes a second or two of processor time, as a library's own thread does."""
    hashlib.pbkdf2_hmac("sha256", b"of", b"salt", 6_000_000)


@pytest.mark.slow
def test_the_time_of_workers_counts(two: WorkerPool) -> None:
    two.run(stands_still, 0.0, [0.3] * 2)  # what their start takes counts with the first
    before, here, busiest = processor_time(), time.process_time(), two.busiest
    two.run(spins, None, [0.2, 0.2, 0.2])
    spent = processor_time() - before
    assert spent - (time.process_time() - here) == pytest.approx(0.6, abs=0.1)
    assert two.busiest - busiest == pytest.approx(0.4, abs=0.1)


@POSIX
@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "error", "text"),
    [
        (signal.SIGKILL, InputError, "a worker process was killed .too little memory.*--jobs 1"),
        (signal.SIGSEGV, RuntimeError, "a worker process is gone .exit code -11"),
    ],
)
def test_a_killed_worker_is_one_line_and_a_broken_one_an_error_of_the_program(
    number: int, error: type[Exception], text: str
) -> None:
    pids: list[int] = []

    def work() -> None:
        with working(2) as mine:
            pids.extend(pid for pid, _ in mine.run(powered, 2.0, [1, 1]))
            mine.run(ends_itself, None, [number, number])

    with pytest.raises(error, match=text):
        work()
    assert gone(pids)


@POSIX
@pytest.mark.slow
@pytest.mark.parametrize("why", [KeyboardInterrupt(), Terminated(15)])
def test_whoever_stops_leaves_nobody_behind(why: BaseException) -> None:
    def stop() -> None:
        raise why

    begun = time.monotonic()
    pids: list[int] = []

    def work() -> None:
        with working(2) as mine:
            mine.run(powered, 2.0, [1, 1])
            pids.extend(worker.process.pid or 0 for worker in mine.workers())
            mine.run(long_after_a_tick, None, [60.0, 60.0], stop)

    with pytest.raises(type(why)):
        work()
    assert time.monotonic() - begun < 30.0
    assert len(pids) == 2
    assert gone(pids)


def long_after_a_tick(shared: None, item: float, tick: Tick) -> None:
    """Says that it is there, and takes long."""
    tick()
    time.sleep(item)


def test_the_cores_are_those_that_may_be_used() -> None:
    assert 1 <= cores() <= (os.cpu_count() or 1)


@POSIX
@pytest.mark.parametrize("came", [b"", struct.pack("!i", 1000), struct.pack("!i", 1000) + b"half of it"])
def test_a_parent_that_is_gone_ends_the_work_wherever_it_was(came: bytes) -> None:
    here, there = multiprocessing.Pipe()
    os.write(here.fileno(), came)
    here.close()
    assert pickle.loads(_heard(there)) is None


def test_workers_that_begin_early_import_what_they_will_need(how: str) -> None:
    if how == "copied":
        pytest.skip("they have what was imported before")
    with working(2) as mine:
        mine.begin(3, "this")
        early = [worker.process.pid for worker in mine.workers()]
        assert len(early) == 2
        found = mine.run(knows, "this", [0, 1, 2])
        assert {pid for pid, _ in found} <= set(early)
        assert all(imported for _, imported in found)
    with working(2) as mine:
        assert not any(imported for _, imported in mine.run(knows, "this", [0, 1]))
    with working(2) as mine:
        mine.begin(1, "this")
        assert not mine.workers()
    with working(1) as mine:
        mine.begin(5, "this")
        assert not mine.workers()


@pytest.mark.parametrize(("large", "early"), [(10, True), (10_000, False)])
def test_processes_of_a_large_part_begin_while_its_cell_is_composed(
    large: int, early: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[tuple[int, str]] = []
    monkeypatch.setattr(WorkerPool, "begin", lambda _, count, module: begun.append((count, module)))
    monkeypatch.setattr("cell.job.job.LARGE_PART", 10)
    monkeypatch.setattr("cell.job.job.WORTH_A_START", large)
    monkeypatch.setattr("cell.job.job.LEAST_CHUNK", 10)
    monkeypatch.setattr("cell.job.job.compose", lambda *_: begun.append((0, "composed")) or 1 / 0)
    with pytest.raises(ZeroDivisionError):
        prepare(load_case(DEFAULT_CASE))
    assert begun == [(14, "cell.part_chunks.chunked_run"), (0, "composed")][not early :]
