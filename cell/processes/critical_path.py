"""How long a round of work would take on a machine with nothing else to do, by processor time alone.

    path = CriticalPath(started_before=0.0)
    path.given("worker", [])             # it has a task that waits for no other
    path.came("worker", "a", 2.0)        # it took 2 s
    path.wait_for(["a"])                 # what this process does next is made from it
    path.waited                          # s

A clock of the wall says nothing where other programs run. So every process has a clock of its own processor time,
which is set to the end of what a task waits for where that is later. Seconds.

Source: Lamport, Time, clocks, and the ordering of events in a distributed system, CACM 1978.
"""

from __future__ import annotations

import time
from collections.abc import Hashable, Iterable


class CriticalPath:
    """The clocks of one round, which begin at 0 with it."""

    def __init__(self, started_before: float) -> None:
        """Begin a round.

        Args:
            started_before: of the start of a worker so much does not count: this process had something else to do then.
        """
        self.waited = 0.0  # by this process, s
        self._begun, self._before = time.process_time(), started_before
        self._done: dict[Hashable, float] = {}  # when each task was done
        self._free: dict[Hashable, float] = {}  # until when each worker has something to do

    def wait_for(self, tasks: Iterable[Hashable]) -> None:
        """This process goes on when some tasks are done."""
        self.waited += max(max((self._done[task] for task in tasks), default=0.0) - self._here(), 0.0)

    def wait_for_all(self) -> None:
        """This process goes on when every task is done."""
        self.wait_for(list(self._done))

    def done_here(self, task: Hashable) -> None:
        """A task is done in this process."""
        self._done[task] = self._here()

    def given(self, worker: Hashable, after: Iterable[Hashable]) -> None:
        """A worker begins a task when some others are done."""
        self._free[worker] = max([self._free.get(worker, 0.0), *(self._done[task] for task in after)])

    def came(self, worker: Hashable, task: Hashable, seconds: float, start: float = 0.0) -> None:
        """A worker has done a task.

        Args:
            worker: which.
            task: which.
            seconds: of processor time since the task before.
            start: of these, what passed before its first task.
        """
        self._free[worker] += seconds - min(start, self._before)
        self._done[task] = self._free[worker]

    def _here(self) -> float:
        return time.process_time() - self._begun + self.waited
