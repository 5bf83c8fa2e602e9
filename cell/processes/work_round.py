"""One round of work: items handed out one by one, to workers and to this process, until all are back.

    found = WorkRound(work, workers, send, tick).results(meanwhile)

This process works like the others. Meanwhile a thread of its own hears what workers say, so that none of them waits
until an item is done here. The next free process takes the next item; results do not depend on which one that is.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from contextvars import Context, copy_context
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any

from .worker import Tick
from .worker_link import WorkerLink

LOOK_S = 0.2  # between two looks whether there is news: a wait without an end may not hear Ctrl-C


class WorkerTraceback(Exception):
    """Where an error of a worker process came up: the cause of the error as it is raised here.

    Attributes:
        place: file and line.
    """

    def __init__(self, text: str, place: str) -> None:
        """Keep a traceback's text."""
        super().__init__(f"in a worker process:\n{text}")
        self.place = place


@dataclass(frozen=True, eq=False)
class Work:
    """What is to be done.

    Attributes:
        function: called with what is shared, an item, and what to call for every step of it.
        shared: what all items need.
        items: one a call.
        order: numbers of the items as they are handed out.
    """

    function: Callable[..., Any]
    shared: object
    items: Sequence[Any]
    order: Iterable[int]


class WorkRound:
    """Items handed out one by one until all are back."""

    def __init__(
        self, work: Work, workers: Sequence[WorkerLink], send: Callable[[WorkerLink, int], None], tick: Tick
    ) -> None:
        """Hand out nothing yet.

        Args:
            work: what is to be done.
            workers: the workers beside this process.
            send: gives a worker the item of a number.
            tick: called in this thread for every step of any item.
        """
        self.work, self.workers, self.send, self.tick = work, workers, send, tick
        self.found: list[Any] = [None] * len(work.items)
        self.spent: dict[Connection, float] = {}  # processor time by worker, s
        self.started: dict[Connection, float] = {}  # what of it passed before its first call
        self.listener: threading.Thread | None = None
        self._left = iter(work.order)
        self._busy: dict[Connection, tuple[WorkerLink, int]] = {}
        self._error: tuple[int, BaseException] | None = None  # of the first item that has one
        self._news = threading.Condition()  # guards what this thread and the listener both write
        self._ticks = 0
        self._broken: BaseException | None = None  # what the listener ended with, where it did not end well

    def results(self, meanwhile: Callable[[], object]) -> list[Any]:
        """All results; or the error of the first item that has one: of the others only those before it matter then.

        Args:
            meanwhile: what is done here first, while workers begin.

        Raises:
            WorkerGone: a worker is no longer there; what the others are at is not waited for.
            Exception: what the function raised.
        """
        self.listener = threading.Thread(target=self._listen, name="listens to workers", daemon=True)
        self.listener.start()
        meanwhile()
        outside = copy_context()

        def tick() -> None:
            outside.run(self._step)

        while (index := self._next()) is not None:
            self._work_here(index, tick)
        while self.listener.is_alive():
            self._tell()
            with self._news:
                if not self._ticks and self._broken is None and self.listener.is_alive():
                    self._news.wait(LOOK_S)
        self._tell()
        if self._error is not None:
            raise self._error[1]
        return self.found

    @property
    def unfinished(self) -> bool:
        """Whether workers are still at something."""
        return bool(self._busy)

    def _work_here(self, index: int, tick: Tick) -> None:
        """An item in this process: as in a worker there are no other workers, and phases are not reported."""
        work = self.work
        try:
            self.found[index] = Context().run(work.function, work.shared, work.items[index], tick)
        except Exception as error:  # noqa: BLE001 (raised once it is known that no earlier item has one)
            self._failed(index, error)

    def _step(self) -> None:
        """A step of an item is done here."""
        self.tick()
        self._tell()

    def _tell(self) -> None:
        """Tell of the steps that workers have done, and raise what they cannot go on after."""
        with self._news:
            count, self._ticks = self._ticks, 0
        for _ in range(count):
            self.tick()
        if self._broken is not None:
            raise self._broken

    def _next(self) -> int | None:
        """The next item that matters."""
        with self._news:
            error = self._error
            return next((k for k in self._left if error is None or k < error[0]), None)

    def _failed(self, index: int, error: BaseException) -> None:
        with self._news:
            if self._error is None or index < self._error[0]:
                self._error = index, error

    def _hand_out(self, worker: WorkerLink) -> None:
        index = self._next()
        if index is not None:
            self._busy[worker.pipe] = worker, index
            self.send(worker, index)

    def _listen(self) -> None:
        """Hear workers until none is busy; in a thread of its own."""
        try:
            for worker in self.workers:
                self._hand_out(worker)
            while self._busy:
                for pipe in wait(list(self._busy)):
                    assert isinstance(pipe, Connection)
                    self._hear(*self._busy[pipe])
        except BaseException as error:  # noqa: BLE001 (it is raised where the results are waited for)
            self._broken = error
        finally:
            with self._news:
                self._news.notify()

    def _hear(self, worker: WorkerLink, index: int) -> None:
        what, value = worker.receive()
        if what == "tick":
            with self._news:
                self._ticks += 1
                self._news.notify()
            return
        del self._busy[worker.pipe]
        if what == "failed":
            error, text, place = value
            error.__cause__ = WorkerTraceback(text, place)
            self._failed(index, error)
        else:
            self.found[index], seconds, start = value
            self.spent[worker.pipe] = self.spent.get(worker.pipe, 0.0) + seconds
            self.started[worker.pipe] = self.started.get(worker.pipe, 0.0) + start
        self._hand_out(worker)
