"""What a worker process does: calls, one after the other, with what is shared.

    context.Process(target=work, args=(pipe,))                    # until the pipe ends
    context.Process(target=work_on, args=(pipe, shared, others))  # forked: with what is shared from the beginning

Every message is pickled: ``("shared", value)``, ``("import", module)``, ``(index, function, item)``, and None at the
end. Answers are ``("tick", None)``, ``("done", ..)`` and ``("failed", ..)``.
"""

from __future__ import annotations

import gc
import importlib
import os
import pickle
import time
import traceback
from collections.abc import Callable, Sequence
from contextvars import Context
from multiprocessing.connection import Connection
from typing import Any

from .own_process import begin_worker

Tick = Callable[[], None]


def packed(message: object) -> bytes:
    """A message as it is sent."""
    return pickle.dumps(message, pickle.HIGHEST_PROTOCOL)


def work_on(pipe: Connection, shared: object, others: Sequence[Connection]) -> None:
    """Of a worker process that is a copy of its parent: what is the parent's own is left to it.

    Args:
        pipe: to the parent.
        shared: what is shared, which came with the copy.
        others: the parent's ends of pipes, this one's as well: they would not end with the parent.
    """
    for other in others:
        other.close()
    gc.freeze()  # nothing of the parent's is searched for garbage, which would copy it
    Context().run(work, pipe, shared)  # nobody is at work here, and no phases are reported


def work(pipe: Connection, shared: object = None) -> None:
    """Of a worker process: do what comes until nothing more does, or until the parent is gone."""
    begin_worker()

    def tick() -> None:
        pipe.send_bytes(packed(("tick", None)))

    while True:
        message = pickle.loads(_heard(pipe))
        if message is None:
            return
        if message[0] == "shared":
            shared = message[1]
            continue
        if message[0] == "import":
            importlib.import_module(message[1])
            continue
        _, function, item = message
        del message
        _Told.start = time.process_time() if _Told.start is None else 0.0
        answer = _answer(function, shared, item, tick)
        try:
            pipe.send_bytes(answer)
        except OSError:  # nobody listens any more
            return


def _heard(pipe: Connection) -> bytes:
    """The next message; the end, once the parent is gone, be it in the middle of one (then the error is an OSError)."""
    try:
        return pipe.recv_bytes()
    except (EOFError, OSError):
        return packed(None)


class _Told:
    """Processor time of this process that has been reported, s; starting up, and sending and receiving, count."""

    seconds = 0.0
    start: float | None = None  # what passed until the first call


def _answer(function: Callable[..., Any], shared: object, item: object, tick: Tick) -> bytes:
    """What a call gives, or what it raises, to be sent."""
    try:
        found = function(shared, item, tick)
        spent, _Told.seconds = time.process_time() - _Told.seconds, time.process_time()
        return packed(("done", (found, spent, _Told.start or 0.0)))
    except Exception as error:  # noqa: BLE001 (it is raised again where the work was asked for)
        last = traceback.extract_tb(error.__traceback__)[-1]
        folder = os.path.basename(os.path.dirname(last.filename))
        place = f"{folder}/{os.path.basename(last.filename)}:{last.lineno}"
        return packed(("failed", (_sendable(error), "".join(traceback.format_exception(error)), place)))


def _sendable(error: Exception) -> Exception:
    """An error as it can be sent; what cannot be is put into words."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # noqa: BLE001 (whatever an error's own code does)
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
