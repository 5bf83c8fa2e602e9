"""Ending on a signal as on Ctrl-C: everything that is open is closed, and nothing half-written is left behind.

Use:

    with terminable():
    ...                           # SIGTERM and SIGHUP raise Terminated here
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

NAMES = ("SIGTERM", "SIGHUP")  # SIGHUP: the terminal is closed; Windows has none


class Terminated(BaseException):
    """The process was asked to end; no error, so that nothing that handles errors stops it.

    Attributes:
        number: of the signal.
    """

    def __init__(self, number: int) -> None:
        """Say which signal."""
        super().__init__(number)
        self.number = number


def _raise(number: int, _: FrameType | None) -> None:
    signal.signal(number, signal.SIG_IGN)  # a second one would break off the closing
    raise Terminated(number)


@contextmanager
def terminable() -> Iterator[None]:
    """Have signals that end the process raise :class:`Terminated` in the main thread; others' handlers stay."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    signals = [getattr(signal, name) for name in NAMES if hasattr(signal, name)]
    mine = [number for number in signals if signal.getsignal(number) == signal.SIG_DFL]
    for number in mine:
        signal.signal(number, _raise)
    try:
        yield
    finally:
        for number in mine:
            signal.signal(number, signal.SIG_DFL)
