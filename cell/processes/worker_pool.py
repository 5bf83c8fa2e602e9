"""Work shared out among processes, with results that do not depend on how many there are.

    with working(processes=2):                                # this process and one worker beside it
        found = pool().run(function, shared, items, tick)     # [function(shared, item, tick) for item in items]

A function that is run computes its result from what is shared and from its item alone, and changes no item, so that who
computes it changes nothing. Results come in the order of the items, and of several errors that of the first item.
Outside of :func:`working` all is done in this process.
"""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from threading import Thread
from typing import TypeVar

from .critical_path import CriticalPath
from .own_process import at_rest, may_fork, uninterrupted
from .work_round import Aside, Task, Work, WorkRound
from .worker import Tick, packed, work, work_on
from .worker_link import END_S, WorkerGone, WorkerLink

S = TypeVar("S")
I = TypeVar("I")  # noqa: E741
R = TypeVar("R")


class WorkerPool:
    """This process and workers beside it, which are started when there is something to share out."""

    def __init__(self, processes: int) -> None:
        """Start nothing yet.

        Args:
            processes: to share work out among, this one among them; with 1 it is all done in this one.
        """
        self.processes = processes
        # s that this process would have waited for workers by the processor time of all (``CriticalPath``), but for
        # what of their start it had something else to do meanwhile
        self.busiest = 0.0
        self.begun: float | None = None  # processor time of this process when the first worker began, s
        self._listener: Thread | None = None  # of the last round
        self._workers: list[WorkerLink] = []
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
        meanwhile: Callable[[], object] | Aside | None = None,
    ) -> list[R]:
        """Call a function for every item.

        Args:
            function: of a module, so that a worker finds it; calls its third argument whenever a step of it is done.
            shared: what all items need; sent once to every worker.
            items: one a call.
            tick: called for every step of any of them.
            sizes: how long each takes, to any scale, where that is known: what takes longest is handed out first, of
                items that take as long the last. Otherwise they are handed out in their order.
            meanwhile: what this process does before it takes an item itself; it raises nothing. An ``Aside`` may have
                more to do where processes would wait.

        Returns:
            The results, in the order of the items.

        Raises:
            Exception: what the function raised for the first of the items for which it raised anything.
            WorkerKilledError: a worker was killed; none is left then.
        """
        tick, meanwhile = tick or _nothing, meanwhile or _nothing
        count = min(self.processes, len(items))
        if count <= 1:
            meanwhile()
            return [function(shared, item, tick) for item in items]
        self.get_ready(shared, count)
        order = range(len(items)) if sizes is None else sorted(range(len(items)), key=lambda k: (-sizes[k], -k))

        def send(worker: WorkerLink, task: Task) -> None:
            self._give(worker)
            worker.send(packed((task.key, task.function, task.item)))

        path = CriticalPath(time.process_time() - (self.begun or 0.0))
        aside = meanwhile if isinstance(meanwhile, Aside) else _Meanwhile(meanwhile)
        one = WorkRound(Work(function, shared, items, order, aside), self._workers, send, tick, path)
        try:
            return one.results()
        except WorkerGone as gone:
            error = gone.worker.why_gone()
            self.close(at_once=True)
            raise error from None
        except BaseException:
            if one.unfinished:
                self._listener = one.listener
                self.close(at_once=True)
            raise
        finally:
            self.busiest += path.waited
            _worker_time.seconds += one.spent

    def begin(self, count: int, module: str) -> None:
        """Have workers begin, and import what they will need, while there is something else to do here.

        Where they can be forked they begin when there is something to share, which they have at once then.

        Args:
            count: how many items there will be for them.
            module: what they import.
        """
        before, count = len(self._workers), min(self.processes, count)
        if count > 1 and not may_fork():
            self._start(count - 1)
            for worker in self._workers[before:]:
                worker.send(packed(("import", module)))

    def get_ready(self, shared: object, count: int, *, copies: bool = True) -> None:
        """Have workers begin: as copies of this process with what is shared, or to be sent it with their first item.

        Args:
            shared: what :meth:`run` will be given.
            count: how many items it will be given.
            copies: whether copies of this process begin as well: what is worked out before, they need not.
        """
        count = min(self.processes, count)
        if count > 1 and (copies or not may_fork()):
            if self._number == 0 or shared is not self._shared:
                self._shared, self._packed = shared, None
                self._number += 1
            self._start(count - 1)
            if any(worker.shared != self._number for worker in self._workers):
                # here and now: once this process is at an item of its own, what is shared may change under the hand
                self._packed = self._packed or packed(("shared", shared))

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
        if self._listener is not None:
            self._listener.join(END_S)
            self._listener = None
        for worker in self._workers:
            worker.pipe.close()
        self._workers.clear()
        self._shared = self._packed = None

    def _give(self, worker: WorkerLink) -> None:
        """What is shared, to a worker that does not have it."""
        if worker.shared != self._number and self._packed is not None:
            worker.send(self._packed)
            worker.shared = self._number

    def _start(self, count: int) -> None:
        self.begun = time.process_time() if self.begun is None else self.begun
        while len(self._workers) < count:
            here, there = Pipe()
            forked = may_fork() and at_rest()
            with uninterrupted(ending=forked):
                process = self._forked(there, here) if forked else _spawned(there)
            there.close()  # so that the pipe ends with the worker
            self._workers.append(WorkerLink(process, here, self._number if forked else 0))

    def _forked(self, there: Connection, here: Connection) -> BaseProcess:
        """A worker that is a copy of this process, with what is shared."""
        others = [*(worker.pipe for worker in self._workers), here]
        process = get_context("fork").Process(target=work_on, args=(there, self._shared, others), daemon=True)
        with warnings.catch_warnings():  # Python 3.12 warns of any other thread; may_fork has looked what they are at
            warnings.filterwarnings("ignore", r".*multi-threaded.*fork", DeprecationWarning)
            process.start()
        return process

    def workers(self) -> list[WorkerLink]:
        """Those there are."""
        return self._workers


def _spawned(there: Connection) -> BaseProcess:
    """A worker that begins with nothing: the same on every system."""
    process = get_context("spawn").Process(target=work, args=(there,), daemon=True)
    process.start()
    return process


class _Meanwhile(Aside):
    """Only what this process does before it takes an item."""

    def __init__(self, meanwhile: Callable[[], object]) -> None:
        self._meanwhile = meanwhile

    def __call__(self) -> None:
        self._meanwhile()


def _nothing() -> None:
    """Does nothing: where no progress is reported."""


@dataclass
class _WorkerTime:
    """Processor time that workers have used for this process, s."""

    seconds: float = 0.0


_worker_time = _WorkerTime()
_pool: ContextVar[WorkerPool | None] = ContextVar("pool", default=None)


def pool(*, large: bool = True) -> WorkerPool:
    """The pool of workers that is in use here, or one of this process alone.

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
        processes: how many; with 1 the workers there are already, if any, are used.

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
    return time.process_time() + _worker_time.seconds


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
