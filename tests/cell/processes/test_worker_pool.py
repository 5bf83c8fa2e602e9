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
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from support.paths import ROOT

from cell.case.read import load_case
from cell.errors import InputError, WorkerKilledError
from cell.job.job import prepare
from cell.processes.own_process import ENDING, at_rest, may_fork
from cell.processes.work_round import SWITCH_S, Aside, Task, WorkerTraceback, WorkRound
from cell.processes.worker import Tick, _heard
from cell.processes.worker_pool import WorkerPool, cores, pool, processor_time, working
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
@pytest.mark.slow
def test_all_holds_of_copies() -> None:
    options = ["-q", "-p", "no:xdist", "-p", "no:cacheprovider", "-k", "copied", "-m", "slow or not slow"]
    argv, env = [sys.executable, "-m", "pytest", *options, __file__], {**os.environ, ALONE: "1"}
    done = subprocess.run(argv, cwd=ROOT, env=env, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    assert "passed" in done.stdout


def powered(shared: float, item: int, tick: Tick) -> tuple[int, float]:
    """What is computed, and where."""
    for _ in range(item):
        tick()
    return os.getpid(), shared**item


def knows(shared: str, item: float, __: Tick) -> tuple[int, bool]:
    """Who computes, and whether a module was imported there."""
    time.sleep(item)
    return os.getpid(), shared in sys.modules


def stands_still(shared: float, item: float, _: Tick) -> int:
    """Takes a while by the clock."""
    time.sleep(item)
    return os.getpid()


def fails(shared: None, item: int, _: Tick) -> int:
    """The later the sooner: what is handed out last fails first."""
    time.sleep(0.3 if item <= 1 else 0.0)
    if item == 1:
        raise InputError("the first that fails")
    if item > 1:
        raise ValueError(f"item {item}")
    return item


def fails_in_one(shared: tuple[int, bool], item: float, _: Tick) -> None:
    """In the process that shares the work out, or in the others; those that do not fail take a while."""
    parent, here = shared
    if (os.getpid() == parent) == here:
        raise InputError("it fails")
    time.sleep(item)


class Stubborn(Exception):
    """Cannot be made again from what it was made of."""

    def __init__(self, a: int, b: int) -> None:
        super().__init__(f"{a} and {b}")


def fails_oddly(shared: int, item: float, _: Tick) -> None:
    """With an error that cannot be sent; in workers alone."""
    if os.getpid() != shared:
        raise Stubborn(1, 2)
    time.sleep(item)


def ends_itself(shared: int, item: int, tick: Tick) -> None:
    """By a signal, in workers alone; who shares the work out is at its item for long."""
    if os.getpid() != shared:
        faulthandler.disable()  # a copy has pytest's, which would tell of it
        os.kill(os.getpid(), item)
    for _ in range(600):
        time.sleep(0.1)
        tick()


def gone(pids: list[int]) -> bool:
    """Whether none of these processes is a child of this one any more."""
    return not {child.pid for child in multiprocessing.active_children()} & set(pids)


def spins(shared: Any, item: float, _: Tick) -> float:
    """Takes processor time."""
    item = item[os.getpid() == shared] if isinstance(item, tuple) else item
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
    assert os.getpid() in pids
    # what is shared is what was given last, not what was sent first
    shared = np.arange(3.0)
    assert [float(v.sum()) for _, v in two.run(powered, shared, [1, 2])] == [3.0, 5.0]


@pytest.mark.slow
def test_no_worker_waits_for_an_item_that_is_done_here(two: WorkerPool) -> None:
    two.run(stands_still, 0.0, [0.0] * 2)
    found = two.run(waits_here, os.getpid(), [2.0] + [0.01] * 8)
    assert found.count(os.getpid()) <= 2  # one took two seconds, in which all others were done


@pytest.mark.slow
def test_what_is_done_meanwhile_is_done_here_and_once(two: WorkerPool) -> None:
    for mine, items in ((two, [1, 2]), (two, [1]), (WorkerPool(1), [1, 2])):
        done: list[tuple[int, threading.Thread]] = []
        found = mine.run(
            powered, 2.0, items, meanwhile=lambda done=done: done.append((os.getpid(), threading.current_thread()))
        )
        assert [value for _, value in found] == [2.0**item for item in items]
        assert done == [(os.getpid(), threading.main_thread())]
    # workers do not wait for it
    pids = two.run(stands_still, 0.0, [0.0] * 4, meanwhile=lambda: time.sleep(1.0))
    assert os.getpid() not in pids


def waits_here(shared: int, item: float, _: Tick) -> int:
    """Takes two seconds in the process that shares the work out."""
    time.sleep(2.0 if os.getpid() == shared else item / 10)
    return os.getpid()


@pytest.mark.slow
def test_steps_are_told_where_they_are_asked_for_and_nobody_listens_longer_than_a_round(two: WorkerPool) -> None:
    told: list[threading.Thread] = []
    found = two.run(powered, 1.0, [200] * 8, lambda: told.append(threading.current_thread()))
    assert len({pid for pid, _ in found}) == 2
    assert told == [threading.current_thread()] * 1600
    assert not [thread for thread in threading.enumerate() if thread.name == "listens to workers"]


def interval(_: None, item: int, __: Tick) -> tuple[int, float]:
    """Who computes, and how long Python lets a thread go on there."""
    time.sleep(0.05)
    if item < 0:
        raise ValueError(item)
    return os.getpid(), sys.getswitchinterval()


@pytest.mark.slow
def test_who_listens_is_let_on_soon_as_long_as_a_round_lasts(two: WorkerPool) -> None:
    usual = sys.getswitchinterval()
    found = two.run(interval, None, range(6))
    assert {s for who, s in found if who == os.getpid()} == {SWITCH_S}
    assert sys.getswitchinterval() == usual
    with pytest.raises(ValueError, match="-1"):
        two.run(interval, None, [-1, 1, -2])
    assert sys.getswitchinterval() == usual


@pytest.mark.slow
def test_the_first_item_that_fails_is_told(two: WorkerPool) -> None:
    with pytest.raises(InputError, match="the first that fails"):
        two.run(fails, None, [0, 1, 2, 3, 4])
    # also where what fails first is handed out first
    with pytest.raises(InputError, match="the first that fails"):
        two.run(fails, None, [0, 1, 2, 3, 4], sizes=[0, 1, 2, 3, 4])
    with pytest.raises(RuntimeError, match="Stubborn: 1 and 2"):
        two.run(fails_oddly, os.getpid(), [0.5, 0.5])
    assert [value for _, value in two.run(powered, 2.0, [1, 2])] == [2.0, 4.0]  # the workers go on


@pytest.mark.slow
def test_an_error_tells_its_place_wherever_it_came_up(two: WorkerPool) -> None:
    with pytest.raises(InputError, match="it fails") as found:
        two.run(fails_in_one, (os.getpid(), False), [0.5, 0.5])
    cause = found.value.__cause__
    assert isinstance(cause, WorkerTraceback)
    assert "in fails_in_one" in str(cause)
    assert cause.place.startswith("processes/test_worker_pool.py:")
    with pytest.raises(InputError, match="it fails") as found:
        two.run(fails_in_one, (os.getpid(), True), [0.5, 0.5])
    assert found.value.__cause__ is None
    assert found.traceback[-1].name == "fails_in_one"


@pytest.mark.slow
def test_what_takes_longest_is_handed_out_first_and_of_what_takes_as_long_the_last(
    two: WorkerPool, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[Any] = []
    take = WorkRound._next

    def noted(self: WorkRound, *, here: bool) -> Task | None:
        task = take(self, here=here)
        if task is not None:
            sent.append(task.key)
        return task

    monkeypatch.setattr(WorkRound, "_next", noted)
    found = two.run(powered, 2.0, [0, 1, 2, 3, 4, 5], sizes=[1, 3, 2, 3, 4, 1])
    assert sent == [4, 3, 1, 2, 5, 0]
    assert [value for _, value in found] == [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]


def told_of(shared: int, item: float, _: Tick) -> tuple[bool, int, bool, bool]:
    """Who does an item, who is at work there, and how it ends on a signal."""
    phase("in a worker")(int)()
    time.sleep(item)
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    default = all(signal.getsignal(k) == signal.SIG_DFL for k in ENDING)
    return os.getpid() == shared, pool().processes, blocked.isdisjoint(ENDING), default


class Nobody:
    """Is told of phases, and does not want to be."""

    def during(self, phase: str, spins: bool, /) -> Any:
        raise AssertionError(phase)


@POSIX
def test_nothing_that_goes_on_around_a_round_goes_on_in_an_item() -> None:
    with terminable(), watched(Nobody()), working(2) as mine:
        mine.run(powered, 2.0, [1, 1])
        found = mine.run(told_of, os.getpid(), [0.5, 0.5])
        # in a worker signals end the process; in this one they are heard as they were
        assert sorted(found) == [(False, 1, True, True), (True, 1, True, False)]
        assert pool() is mine


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
        assert len(mine.workers()) == 1
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
    """Takes about a second of processor time, as a library's own thread does."""
    hashlib.pbkdf2_hmac("sha256", b"of", b"salt", 3_000_000)


@pytest.mark.slow
def test_the_time_of_workers_counts(two: WorkerPool) -> None:
    two.run(stands_still, 0.0, [0.3] * 2)  # what their start takes counts with the first
    before, here, busiest = processor_time(), time.process_time(), two.busiest
    two.run(spins, os.getpid(), [(0.5, 0.1)] * 2)  # in the worker, and here
    spent, here = processor_time() - before, time.process_time() - here
    assert spent == pytest.approx(0.6, abs=0.1)
    # on the critical path is what the worker had more to do than this process
    assert two.busiest - busiest + here == pytest.approx(0.5, abs=0.1)
    busiest = two.busiest
    two.run(spins, os.getpid(), [(0.1, 0.5)] * 2)
    assert two.busiest == busiest


@POSIX
@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "error", "text"),
    [
        (signal.SIGKILL, WorkerKilledError, "a worker process was killed .too little memory.*--jobs 1"),
        (signal.SIGSEGV, RuntimeError, "a worker process is gone .exit code -11"),
    ],
)
def test_a_killed_worker_is_one_line_and_a_broken_one_an_error_of_the_program(
    number: int, error: type[Exception], text: str
) -> None:
    begun = time.monotonic()
    with working(2) as mine:
        mine.run(powered, 2.0, [1, 1])
        (worker,) = mine.workers()
        with pytest.raises(error, match=text):
            mine.run(ends_itself, os.getpid(), [number, number])
        assert time.monotonic() - begun < 30.0  # the item that is done here is not waited for
        assert gone([worker.process.pid or 0])
        # whoever goes on has others
        assert [value for _, value in mine.run(powered, 2.0, [1, 2])] == [2.0, 4.0]


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
    assert len(pids) == 1
    assert gone(pids)


@POSIX
@pytest.mark.slow
def test_a_signal_is_heard_at_once_while_only_workers_are_at_something(two: WorkerPool) -> None:
    """Whichever thread it goes to."""
    before = signal.signal(signal.SIGUSR1, stop_here)
    begun = time.monotonic()
    try:
        threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGUSR1)).start()
        with pytest.raises(KeyboardInterrupt):
            two.run(stands_still_there, os.getpid(), [60.0, 60.0])
    finally:
        signal.signal(signal.SIGUSR1, before)
    assert time.monotonic() - begun < 30.0
    assert not two.workers()


def stop_here(*_: Any) -> None:
    """As Ctrl-C does."""
    raise KeyboardInterrupt


def stands_still_there(shared: int, item: float, _: Tick) -> None:
    """In a worker."""
    time.sleep(0.0 if os.getpid() == shared else item)


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


@pytest.mark.slow
def test_workers_that_begin_early_import_what_they_will_need(how: str) -> None:
    if how == "copied":
        pytest.skip("they have what was imported before")
    with working(2) as mine:
        mine.begin(3, "this")
        early = [worker.process.pid for worker in mine.workers()]
        assert len(early) == 1
        there = dict(mine.run(knows, "this", [0.5, 0.5, 0.5]))
        assert there.keys() == {*early, os.getpid()}
        assert there[early[0] or 0]
    with working(2) as mine:
        there = dict(mine.run(knows, "this", [3.0, 3.0]))
        assert not there[next(pid for pid in there if pid != os.getpid())]
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


class Beside(Aside):
    """Puts items in late, and has tasks made from what is found."""

    early = 1

    def __init__(self, items: list[float], late: list[float], first_s: float = 0.0) -> None:
        """What takes ``first_s`` before the late items are there."""
        self.items, self.late, self.first_s = items, late, first_s
        self.given: set[int] = set()
        self.results: dict[Any, Any] = {}
        self.seen_early: list[bool] = []

    def __call__(self) -> None:
        time.sleep(self.first_s)
        self.seen_early = [item < 0 for item in self.items]
        self.items[:] = self.late

    def next_task(self, found: Sequence[Any], *, here: bool) -> Task | None:
        for k, one in enumerate(found):
            if one is not None and k not in self.given:
                self.given.add(k)
                return Task(f"aside {k}", powered_aside, (k, one[1]), (k,))
        return None

    def done(self, task: Task, result: Any) -> None:
        self.results[task.key] = result


def powered_aside(shared: float, item: tuple[int, float], _: Tick) -> float:
    """Fails on the third."""
    time.sleep(0.05)
    if item[0] == 2:
        raise InputError("the third")
    return shared + item[1]


@pytest.mark.slow
def test_what_is_done_aside_is_made_from_what_is_found_and_its_errors_are_left_aside(two: WorkerPool) -> None:
    for mine in (two, WorkerPool(1)):
        items: list[float] = [1, -1, -1, -1]
        beside = Beside(items, [1, 2, 3, 4], 0.3)
        found = mine.run(powered, 2.0, items, None, [9, 1, 1, 1], beside)  # type: ignore[arg-type]
        assert [value for _, value in found] == [2.0, 4.0, 8.0, 16.0]
        # no item was taken before it was there
        assert beside.seen_early == [False, True, True, True]
        # where nobody waits nothing is done aside
        assert beside.results == ({"aside 0": 4.0, "aside 1": 6.0, "aside 3": 18.0} if mine is two else {})
    assert not [thread for thread in threading.enumerate() if thread.name == "listens to workers"]


@pytest.mark.slow
def test_nothing_is_done_aside_once_an_item_has_failed(two: WorkerPool) -> None:
    beside = Beside([], [])
    beside.early = None
    with pytest.raises(InputError, match="the first that fails"):
        two.run(fails, None, [0, 1, 2, 3, 4], meanwhile=beside)
    assert not beside.results


@pytest.mark.slow
def test_a_worker_begins_with_what_is_there(two: WorkerPool) -> None:
    two.run(stands_still, 0.0, [0.0] * 2)
    begun = time.monotonic()
    items = [1.0, 0.0]
    beside = Beside(items, [1.0, 0.0], 1.0)
    beside.given = {0, 1}
    pids = two.run(stands_still, 0.0, items, None, [2, 1], beside)
    assert pids[0] != os.getpid()
    assert time.monotonic() - begun < 1.8


@pytest.mark.slow
def test_neighbours_are_done_by_one_process(two: WorkerPool) -> None:
    two.run(stands_still, 0.0, [0.0] * 2)
    beside = Beside([], [0.2] * 8)
    beside.early, beside.both_ends = None, True
    beside.items = items = [0.2] * 8
    beside.given = set(range(8))
    here = [pid == os.getpid() for pid in two.run(stands_still, 0.0, items, None, None, beside)]
    assert here == sorted(here)
    assert set(here) == {False, True}
