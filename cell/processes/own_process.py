"""Processes that are the program's own, or work for it: how they start, and who hears Ctrl-C.

begin_own_process()             # before MuJoCo is imported
with uninterrupted():           # a process that is started here never sees Ctrl-C
process.start()
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import parent_process

GARBAGE = 20_000  # objects made, between two searches for circles of them: what is large is in none


def begin_own_process(*, draws: bool = False) -> None:
    """Of a process that is the program's own, before MuJoCo is imported: start and work with less ado.

    Args:
        draws: MuJoCo is to draw in it. Otherwise it need not look for a window system, which it would do in processes
            of their own.
    """
    if not draws:
        os.environ.setdefault("MUJOCO_GL", "disable")
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # it would look for some in all that is installed
    gc.set_threshold(GARBAGE)
    atexit.register(gc.freeze)  # and at the end all there is would be searched once more


def begin_worker() -> None:
    """Of a worker process: leave Ctrl-C to the parent, and do not outlive it."""
    begin_own_process()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is None:
        return

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold Ctrl-C back: processes started meanwhile never see it, for it is their parent that ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
