"""Processes that are the program's own, or work for it: how they start, and which of them Ctrl-C interrupts.

begin_own_process()             # before MuJoCo is imported
may_fork()                      # whether workers begin as copies of this process, with all that it has imported
with uninterrupted():           # a process that is started here never sees Ctrl-C
process.start()
"""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import parent_process

from ..errors import InputError

AT_REST_S = 0.0, 0.002, 0.008, 0.03, 0.06  # waited until other threads sleep
GARBAGE = 20_000  # objects made, between two searches for circles of them: what is large is in none
ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


def begin_own_process(*, draws: bool = False) -> None:
    """Of a process that is the program's own, before MuJoCo is imported: start and work with less ado.

    Args:
        draws: MuJoCo is to draw in it. Otherwise it need not look for a window system, which it would do in processes
            of their own; what MUJOCO_GL says for others is of no concern to it.

    Raises:
        InputError: it is to draw, and MuJoCo cannot with what MUJOCO_GL says.
    """
    if not draws:
        os.environ["MUJOCO_GL"] = "disable"
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # it would look for some in all that is installed
    gc.set_threshold(GARBAGE)
    atexit.register(gc.freeze)  # and at the end all there is would be searched once more
    if draws and os.environ.get("MUJOCO_GL"):
        _require_backend(os.environ["MUJOCO_GL"])


def _require_backend(wanted: str) -> None:
    """Refuse a backend of drawing that is none, or whose library is missing: MuJoCo does not even begin with it."""
    try:
        import mujoco  # noqa: F401
    except (AttributeError, ImportError, OSError, RuntimeError) as error:
        said = " ".join(str(error).split())
        raise InputError(
            f"MUJOCO_GL={wanted}: MuJoCo cannot draw with it ({said}); unset it, or set egl or glfw"
        ) from None


def may_fork() -> bool:
    """Whether workers may begin as copies of this process.

    They may on Linux, where Python runs one thread and those of libraries sleep: a thread that is at something while it
    is copied would leave it half done in the copy, and its locks shut. Threads that libraries keep for later (OpenBLAS
    begins its own anew in a copy, manifold3d's are for slicing) wait for work, which :func:`at_rest` makes sure of.
    """
    return sys.platform == "linux" and len(sys._current_frames()) == 1


def at_rest() -> bool:
    """Whether all other threads of this process sleep; those of libraries look for more to do for a moment."""
    for wait_s in AT_REST_S:
        time.sleep(wait_s)
        try:
            if all(_sleeps(int(thread)) for thread in os.listdir("/proc/self/task")):
                return True
        except OSError:  # a thread that is gone
            pass
    return False


def _sleeps(thread: int) -> bool:
    """Whether a thread of this process waits for something; this one, which asks, counts as well."""
    if thread == threading.get_native_id():
        return True
    with open(f"/proc/self/task/{thread}/stat", encoding="ascii", errors="replace") as file:
        return file.read().rpartition(")")[2].split()[0] == "S"


def begin_worker() -> None:
    """Of a worker process: leave Ctrl-C to the parent, end on a signal as processes do, and do not outlive the parent.

    A process that was forked has its parent's handlers of signals until here.
    """
    begin_own_process()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for number in ENDING:
        if callable(signal.getsignal(number)):
            signal.signal(number, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
    parent = parent_process()
    if parent is None:
        return

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


@contextmanager
def uninterrupted(*, ending: bool = False) -> Iterator[None]:
    """Hold Ctrl-C back: processes started meanwhile never see it, for it is their parent that ends them.

    Args:
        ending: signals that end a process are held back as well, in what is forked until :func:`begin_worker`.
    """
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, *(ENDING if ending else ())})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
