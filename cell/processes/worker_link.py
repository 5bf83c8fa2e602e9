"""A worker process as the process that started it sees it: messages to it, messages from it, and how it ended.

worker = WorkerLink(process, pipe)
worker.send(packed((0, function, item)))
what, value = worker.receive()
"""

from __future__ import annotations

import pickle
import signal
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from ..errors import WorkerKilledError

END_S = 5.0  # that a worker with nothing to do may take to end


class WorkerGone(Exception):
    """A worker process is no longer there.

    Attributes:
        worker: which.
    """

    def __init__(self, worker: WorkerLink) -> None:
        """Say which."""
        super().__init__("a worker process is gone")
        self.worker = worker


@dataclass(eq=False)
class WorkerLink:
    """A process, and what it has.

    Attributes:
        process: the process.
        pipe: to it and from it.
        shared: number of what was shared with it last.
    """

    process: BaseProcess
    pipe: Connection
    shared: int = 0

    def send(self, message: bytes) -> None:
        """Say something.

        Args:
            message: from :func:`cell.processes.worker.packed`.

        Raises:
            WorkerGone: it is no longer there.
        """
        try:
            self.pipe.send_bytes(message)
        except OSError:
            raise WorkerGone(self) from None

    def receive(self) -> tuple[str, Any]:
        """What it has to say.

        Raises:
            WorkerGone: it is no longer there.
        """
        try:
            what, value = pickle.loads(self.pipe.recv_bytes())
        except (EOFError, OSError):
            raise WorkerGone(self) from None
        return what, value

    def why_gone(self) -> Exception:
        """What to say of a worker that is no longer there."""
        self.process.join(END_S)
        code = self.process.exitcode
        if code is not None and code == -getattr(signal, "SIGKILL", 0):
            return WorkerKilledError(
                "a worker process was killed (too little memory?): no verdict; --jobs 1 needs the least memory"
            )
        return RuntimeError(f"a worker process is gone (exit code {code})")
