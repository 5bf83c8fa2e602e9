"""``python -m cell`` and the command ``rbam``: Ctrl-C ends them in one line, also while the rest is imported."""

import os
import signal
import sys
from types import FrameType


def begin() -> int:
    """Import the command line and run it; exit code 130 where Ctrl-C comes before it runs."""
    # otherwise it is ignored, as by what a script runs in the background
    ours = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if ours:
        signal.signal(signal.SIGINT, _end_at_once)
    from .cli.main import main as command

    if ours:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return command()


def _end_at_once(*_: int | FrameType | None) -> None:
    """Nothing is open yet, and an exception in the middle of an import would be a traceback."""
    try:
        os.write(2, b"rbam: interrupted\n")
    finally:
        os._exit(130)


if __name__ == "__main__":
    sys.exit(begin())
