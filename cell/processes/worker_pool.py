"""Work shared out among processes, with results that do not depend on how many there are.

    with working(processes=2):
        found = pool().run(function, shared, items, tick)     # [function(shared, item, tick) for item in items]

A function that is run computes its result from what is shared and from its item alone, so that who computes it changes
nothing. Results come in the order of the items, and of several errors that of the first item. Outside of
:func:`working` all is done in this process.
"""

from __future__ import annotations

import os
import pickle
import signal
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from ..errors import InputError
from .own_process import at_rest, may_fork, uninterrupted
from .worker import Tick, packed, work, work_on

S = TypeVar("S")
I = TypeVar("I")  # noqa: E741
R = TypeVar("R")

END_S = 5.0  # that a worker with nothing to do may take to end


class WorkerTraceback(Exception):
    """Where an error of a worker process came up: the cause of the error as it is raised here.

    Attributes:
        place: file and line.
    """

    def __init__(self, text: str, place: str) -> None:
        """Keep a traceback's text."""
        super().__init__(f"in a worker process:\n{text}")
        self.place = place


@dataclass(eq=False)
class _Worker:
    """A process, and what it has.

    Attributes:
        process: the process.
        pipe: to it and from it.
        shared: number of what was shared with it last.
    """

    process: BaseProcess
    pipe: Connection
    shared: int = 0


class WorkerPool:
    """Workers that are started when there is something to share out."""

    def __init__(self, processes: int) -> None:
        """Start nothing yet.

        Args:
            processes: to share work out among; with 1 it is done in this one.
        """
        self.processes = processes
        # s of processor time: of each round that of the worker that had most to do, together, but for what of its start
        # this process had something else to do meanwhile
        self.busiest = 0.0
        self.begun: float | None = None  # processor time of this process when the first worker began, s
        self._workers: list[_Worker] = []
        self._shared: object = None
        self._number = 0
        self._packed: bytes | None = None

    def run(
        self,
        function: Callable[[S, I, Tick], R],
        shared: S,
        items: Sequence[I],
        tick: Tick | None = None,
        sizes: Sequence[float] | None = None,
    ) -> list[R]:
        """Call a function for every item.

        Args:
            function: of a module, so that a worker finds it; calls its third argument whenever a step of it is done.
            shared: what all items need; sent once to every worker.
            items: one a call.
            tick: called for every step of any of them.
            sizes: how long each takes, to any scale, where that is known: what takes longest is handed out first, of
                items that take as long the last. Otherwise they are handed out in their order.

        Returns:
            The results, in the order of the items.

        Raises:
            Exception: what the function raised for the first of the items for which it raised anything.
            InputError: a worker was killed.
        """
        tick = tick or _nothing
        count = min(self.processes, len(items))
        if count <= 1:
            return [function(shared, item, tick) for item in items]
        self._share(shared)
        self._start(count)
        order = range(len(items)) if sizes is None else sorted(range(len(items)), key=lambda k: (-sizes[k], -k))
        return _Round(self, function, items, tick, order).results()

    def begin(self, count: int, module: str) -> None:
        """Have workers begin, and import what they will need, while there is something else to do here.

        Where they can be forked they begin when there is something to share, which they have at once then.

        Args:
            count: how many items there will be for them.
            module: what they import.
        """
        before, count = len(self._workers), min(self.processes, count)
        if count > 1 and not may_fork():
            self._start(count)
            for worker in self._workers[before:]:
                self._send(worker, packed(("import", module)))

    def get_ready(self, shared: object, count: int, *, copies: bool = True) -> None:
        """Have workers begin, and take what is shared, while there is something else to do here.

        Args:
            shared: what :meth:`run` will be given.
            count: how many items it will be given.
            copies: whether copies of this process begin as well: what is worked out before, they need not.
        """
        if min(self.processes, count) > 1 and (copies or not may_fork()):
            self._share(shared)
            self._start(min(self.processes, count))
            for worker in self._workers:
                self._give(worker)

    def close(self, *, at_once: bool) -> None:
        """End the workers.

        Args:
            at_once: whatever they are at.
        """
        for worker in self._workers:
            if at_once:
                worker.process.terminate()
            else:
                try:
                    worker.pipe.send_bytes(packed(None))
                except OSError:
                    worker.process.terminate()
        for worker in self._workers:
            worker.process.join(END_S)
            if worker.process.is_alive():
                worker.process.kill()
                worker.process.join()
            worker.pipe.close()
        self._workers.clear()
        self._shared = self._packed = None

    def send(self, worker: _Worker, index: int, function: Callable[..., Any], item: object) -> None:
        """Have a worker call a function; first what is shared, where it does not have it yet."""
        self._give(worker)
        self._send(worker, packed((index, function, item)))

    def _give(self, worker: _Worker) -> None:
        """What is shared, to a worker that does not have it."""
        if worker.shared != self._number:
            self._packed = self._packed or packed(("shared", self._shared))
            self._send(worker, self._packed)
            worker.shared = self._number

    def _send(self, worker: _Worker, message: bytes) -> None:
        try:
            worker.pipe.send_bytes(message)
        except OSError:
            raise _gone(worker) from None

    def receive(self, worker: _Worker) -> tuple[str, Any]:
        """What a worker has to say."""
        try:
            what, value = pickle.loads(worker.pipe.recv_bytes())
        except (EOFError, OSError):
            raise _gone(worker) from None
        return what, value

    def _share(self, shared: object) -> None:
        if self._number == 0 or shared is not self._shared:
            self._shared, self._packed = shared, None
            self._number += 1

    def _start(self, count: int) -> None:
        self.begun = time.process_time() if self.begun is None else self.begun
        while len(self._workers) < count:
            here, there = Pipe()
            forked = may_fork() and at_rest()
            with uninterrupted(ending=forked):
                process = self._forked(there, here) if forked else _spawned(there)
            there.close()  # so that the pipe ends with the worker
            self._workers.append(_Worker(process, here, self._number if forked else 0))

    def _forked(self, there: Connection, here: Connection) -> BaseProcess:
        """A worker that is a copy of this process, with what is shared."""
        others = [*(worker.pipe for worker in self._workers), here]
        process = get_context("fork").Process(target=work_on, args=(there, self._shared, others), daemon=True)
        with warnings.catch_warnings():  # Python 3.12 warns of any other thread; may_fork has looked what they are at
            warnings.filterwarnings("ignore", r".*multi-threaded.*fork", DeprecationWarning)
            process.start()
        return process

    def workers(self) -> list[_Worker]:
        """Those there are."""
        return self._workers


class _Round:
    """Items handed out one by one until all are back."""

    def __init__(
        self, pool: WorkerPool, function: Callable[..., Any], items: Sequence[Any], tick: Tick, order: Iterable[int]
    ) -> None:
        self.pool, self.function, self.items, self.tick = pool, function, items, tick
        self.found: list[Any] = [None] * len(items)
        self.left = iter(order)
        self.spent: dict[Connection, float] = {}
        self.meanwhile = time.process_time() - (pool.begun or 0.0)  # s that this process had for itself, so far
        self.busy: dict[Connection, tuple[_Worker, int]] = {}
        self.error: tuple[int, BaseException] | None = None

    def results(self) -> list[Any]:
        """All results; or the error of the first item that has one: of the others only those before it matter then."""
        for worker in self.pool.workers():
            self._hand_out(worker)
        while self.busy:
            for pipe in wait(list(self.busy)):
                assert isinstance(pipe, Connection)
                self._hear(*self.busy[pipe])
        if self.error is not None:
            raise self.error[1]
        self.pool.busiest += max(self.spent.values())
        return self.found

    def _hand_out(self, worker: _Worker) -> None:
        error = self.error
        index = next((k for k in self.left if error is None or k < error[0]), None)
        if index is not None:
            self.pool.send(worker, index, self.function, self.items[index])
            self.busy[worker.pipe] = worker, index

    def _hear(self, worker: _Worker, index: int) -> None:
        what, value = self.pool.receive(worker)
        if what == "tick":
            self.tick()
            return
        del self.busy[worker.pipe]
        if what == "failed":
            error, text, place = value
            error.__cause__ = WorkerTraceback(text, place)
            if self.error is None or index < self.error[0]:
                self.error = index, error
        else:
            self.found[index], seconds, start = value
            _others.seconds += seconds
            seconds -= min(start, self.meanwhile)
            self.spent[worker.pipe] = self.spent.get(worker.pipe, 0.0) + seconds
        self._hand_out(worker)


def _spawned(there: Connection) -> BaseProcess:
    """A worker that begins with nothing: the same on every system."""
    process = get_context("spawn").Process(target=work, args=(there,), daemon=True)
    process.start()
    return process


def _gone(worker: _Worker) -> Exception:
    """What to say of a worker that is no longer there."""
    worker.process.join(END_S)
    code = worker.process.exitcode
    if code is not None and code == -getattr(signal, "SIGKILL", 0):
        return InputError(
            "a worker process was killed (too little memory?): no verdict; --jobs 1 needs the least memory"
        )
    return RuntimeError(f"a worker process is gone (exit code {code})")


def _nothing() -> None:
    """Nobody wants to know."""


@dataclass
class _Others:
    """Processor time that workers have used for this process, s."""

    seconds: float = 0.0


_others = _Others()
_pool: ContextVar[WorkerPool | None] = ContextVar("pool", default=None)


def pool(*, large: bool = True) -> WorkerPool:
    """Who does the work here.

    Args:
        large: whether the work is worth the start of processes that begin with nothing; if not, this process does it
            alone where there are neither workers yet nor may be copies of it.
    """
    mine = _pool.get() or WorkerPool(1)
    return mine if large or mine.workers() or (may_fork() and at_rest()) else WorkerPool(1)


@contextmanager
def working(processes: int) -> Iterator[WorkerPool]:
    """Share work out among processes, which end with the block and with their parent.

    Args:
        processes: how many; with 1 whoever is at work already goes on.

    Yields:
        The workers.
    """
    if processes <= 1:
        yield pool()
        return
    mine = WorkerPool(processes)
    token = _pool.set(mine)
    try:
        yield mine
    except BaseException:
        mine.close(at_once=True)
        raise
    else:
        mine.close(at_once=False)
    finally:
        _pool.reset(token)


def processor_time() -> float:
    """Processor time of this process and of the work that others have done for it, s."""
    return time.process_time() + _others.seconds


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
