"""One round of work: items handed out one by one, to workers and to this process, until all are back.

    found = WorkRound(work, workers, send, tick, path).results()

This process works like the others. Meanwhile a thread of its own hears what workers say, so that none of them waits
until an item is done here. The next free process takes the next item; results do not depend on which one that is.
Where no item is left, an :class:`Aside` may have something else to do with the results that have come.
"""

from __future__ import annotations

import sys
import threading
from collections import deque
from collections.abc import Callable, Hashable, Iterable, Sequence
from contextvars import Context, copy_context
from dataclasses import dataclass
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import Any

from .critical_path import CriticalPath
from .worker import Tick
from .worker_link import WorkerLink

LOOK_S = 0.2  # between two looks whether there is news: a wait without an end may not hear Ctrl-C
# until Python lets the listener go on while there is work here: a large result comes in dozens of pieces, and whoever
# sends it waits
SWITCH_S = 5e-4
MEANWHILE = "meanwhile"  # as a task: what is done in this process before it takes an item


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
class Task:
    """What one process does.

    Attributes:
        key: the number of an item, or a name of what is done aside.
        function: called with what is shared, the item, and what to call for every step of it.
        item: what it is done with.
        after: keys of the tasks whose results it is made from.
    """

    key: Hashable
    function: Callable[..., Any]
    item: Any
    after: tuple[Hashable, ...] = ()


class Aside:
    """What is done beside the items of a round: before this process takes one, and where no item is left.

    Attributes:
        early: how many items, of those handed out first, are there before it has been called; None: all. The call may
            put the others into the list of items.
        both_ends: whether workers take items from the first on and this process from the last: neighbours are done by
            one process then, which has worked out what they have in common.
    """

    early: int | None = None
    both_ends: bool = False

    def __call__(self) -> None:
        """Do what comes before this process takes an item; raises nothing."""

    def next_task(self, found: Sequence[Any], *, here: bool) -> Task | None:
        """What a process may do that would wait for others; called once all items are handed out.

        Whatever such a task raises is left aside, and there is no result of it.

        Args:
            found: the results of the items, None where there is none yet.
            here: it is for this process.

        Returns:
            A task that has not been given out; None where there is none by now.
        """
        return None

    def done(self, task: Task, result: Any) -> None:
        """Take the result of such a task."""


@dataclass(frozen=True, eq=False)
class Work:
    """What is to be done.

    Attributes:
        function: called with what is shared, an item, and what to call for every step of it.
        shared: what all items need.
        items: one a call.
        order: numbers of the items as they are handed out.
        aside: what is done beside them.
    """

    function: Callable[..., Any]
    shared: object
    items: Sequence[Any]
    order: Iterable[int]
    aside: Aside


class WorkRound:
    """Items handed out one by one until all are back."""

    def __init__(
        self,
        work: Work,
        workers: Sequence[WorkerLink],
        send: Callable[[WorkerLink, Task], None],
        tick: Tick,
        path: CriticalPath,
    ) -> None:
        """Hand out nothing yet.

        Args:
            work: what is to be done.
            workers: the workers beside this process.
            send: gives a worker a task.
            tick: called in this thread for every step of any task.
            path: the clocks of the round.
        """
        self.work, self.workers, self.send, self.tick, self.path = work, workers, send, tick, path
        self.found: list[Any] = [None] * len(work.items)
        self.spent = 0.0  # processor time of all workers, s
        self.listener: threading.Thread | None = None
        self._left, self._handed_out = deque(work.order), 0
        self._held = work.aside.early is not None  # only the early items are there
        self._over = False  # nothing more is handed out
        self._busy: dict[Connection, tuple[WorkerLink, Task]] = {}
        self._idle: list[WorkerLink] = []
        self._error: tuple[int, BaseException] | None = None  # of the first item that has one
        self._news = threading.Condition()  # guards what this thread and the listener both write
        self._ticks = 0
        self._broken: BaseException | None = None  # what the listener ended with, where it did not end well
        self._bell, self._button = Pipe(duplex=False)  # wakes the listener

    def results(self) -> list[Any]:
        """All results; or the error of the first item that has one: of the others only those before it matter then.

        Raises:
            WorkerGone: a worker is no longer there; what the others are at is not waited for.
            Exception: what the function raised.
        """
        self.listener = threading.Thread(target=self._listen, name="listens to workers", daemon=True)
        self.listener.start()
        usual_s = sys.getswitchinterval()
        sys.setswitchinterval(min(SWITCH_S, usual_s))
        outside = copy_context()

        def tick() -> None:
            outside.run(self._step)

        try:
            self.work.aside()
            with self._news:
                self._held = False
                self.path.done_here(MEANWHILE)
            self._wake()
            while (task := self._next_here()) is not None:
                self._work_here(task, tick)
                self._wake()
        finally:
            with self._news:
                self._over = True
            self._wake()
            sys.setswitchinterval(usual_s)
        self.listener.join()
        self._bell.close()
        self._button.close()
        self._tell()
        self.path.wait_for_all()
        if self._error is not None:
            raise self._error[1]
        return self.found

    @property
    def unfinished(self) -> bool:
        """Whether workers are still at something."""
        return bool(self._busy)

    def _work_here(self, task: Task, tick: Tick) -> None:
        """A task in this process: as in a worker there are no other workers, and phases are not reported."""
        try:
            found = Context().run(task.function, self.work.shared, task.item, tick)
        except Exception as error:  # noqa: BLE001 (raised once it is known that no earlier item has one)
            self._failed(task, error)
        else:
            with self._news:
                self.path.done_here(task.key)
                self._keep(task, found)

    def _keep(self, task: Task, found: Any) -> None:
        if isinstance(task.key, int):
            self.found[task.key] = found
        else:
            self.work.aside.done(task, found)

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

    def _next_here(self) -> Task | None:
        """The next task of this process, waited for as long as others are at something."""
        while True:
            self._tell()
            with self._news:
                task = self._next(here=True)
                if task is not None:
                    self.path.wait_for(task.after)
                    return task
                if not self._busy and self._broken is None:
                    return None
                if not self._ticks and self._broken is None:
                    self._news.wait(LOOK_S)

    def _next(self, *, here: bool) -> Task | None:
        """The next task that matters, as far as there is one by now, for this process or a worker."""
        work, error = self.work, self._error
        if error is not None:
            self._left = deque(k for k in self._left if k < error[0])
        held = self._held and self._handed_out >= (work.aside.early or 0)
        if self._over or held:
            return None
        if not self._left:
            return work.aside.next_task(self.found, here=here) if error is None else None
        index = self._left.pop() if here and work.aside.both_ends else self._left.popleft()
        self._handed_out += 1
        return Task(index, work.function, work.items[index], self._after())

    def _after(self) -> tuple[Hashable, ...]:
        """What the item that is handed out waited for."""
        early = self.work.aside.early
        return () if early is None or self._handed_out <= early else (MEANWHILE,)

    def _failed(self, task: Task, error: BaseException) -> None:
        with self._news:
            index = task.key
            if isinstance(index, int) and (self._error is None or index < self._error[0]):
                self._error = index, error

    def _wake(self) -> None:
        """Have the listener look for what idle workers may do."""
        self._button.send_bytes(b"-")

    def _hand_out(self, worker: WorkerLink) -> None:
        with self._news:
            task = self._next(here=False)
            if task is None:
                self._idle.append(worker)
                return
            self._busy[worker.pipe] = worker, task
            self.path.given(worker.pipe, task.after)
        self.send(worker, task)

    def _listen(self) -> None:
        """Hear workers until none is busy and nothing more is handed out; in a thread of its own."""
        try:
            for worker in self.workers:
                self._hand_out(worker)
            while self._busy or not self._over:
                for pipe in wait([*self._busy, self._bell]):
                    assert isinstance(pipe, Connection)
                    if pipe is self._bell:
                        pipe.recv_bytes()
                    else:
                        self._hear(*self._busy[pipe])
                idle, self._idle = self._idle, []
                for worker in idle:
                    self._hand_out(worker)
        except BaseException as error:  # noqa: BLE001 (it is raised where the results are waited for)
            self._broken = error
        finally:
            with self._news:
                self._news.notify()

    def _hear(self, worker: WorkerLink, task: Task) -> None:
        what, value = worker.receive()
        if what == "failed":
            error, text, place = value
            error.__cause__ = WorkerTraceback(text, place)
            self._failed(task, error)
        with self._news:
            if what == "tick":
                self._ticks += 1
            else:
                if what == "done":
                    found, seconds, start = value
                    self.spent += seconds
                    self.path.came(worker.pipe, task.key, seconds, start)
                    self._keep(task, found)
                del self._busy[worker.pipe]
                self._idle.append(worker)
            self._news.notify()
