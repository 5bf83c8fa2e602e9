"""The standard streams of a command: what is wrong with them never changes a verdict.

    with standard_streams():
        print("feasible")

A reader that goes away early (``rbam check | head -1``) is not an error. A standard output that is closed or full is
one, and is reported in one line. A character that the terminal's encoding lacks is printed as a question mark.
What cannot be written to standard error is left out.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO, Any, cast

from .errors import InputError
from .printable import printable


class Stream:
    """A text stream that outlives its reader.

    Attributes are those of the stream itself.
    """

    def __init__(self, stream: IO[str] | None, name: str, required: bool) -> None:
        """Wrap a stream.

        Args:
            stream: the stream; None where it was closed before the program began.
            name: in messages.
            required: whether what cannot be written is an error; otherwise it is left out.
        """
        self._stream, self._name, self._required = stream, name, required
        self._gone = False

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def isatty(self) -> bool:
        """Whether it is a terminal."""
        return self._stream is not None and not self._gone and self._stream.isatty()

    def write(self, text: str) -> int:
        """Write, as far as there is a reader.

        Raises:
            InputError: a required stream is closed or its device is full.
        """
        self._try(lambda stream: stream.write(text))
        return len(text)

    def flush(self) -> None:
        """Write what waits; raises as :meth:`write`."""
        if self._stream is not None:
            self._try(lambda stream: stream.flush())

    def _try(self, act: Any) -> None:
        if self._gone:
            return
        try:
            if self._stream is None:
                raise OSError(0, "it is closed")
            act(self._stream)
        except BrokenPipeError:
            self._leave()
        except (OSError, ValueError) as error:  # ValueError: closed while the program ran
            self._leave()
            if self._required:
                raise InputError(f"{self._name}: cannot be written ({reason(error)})") from None

    def _leave(self) -> None:
        """Stop writing; Python would try once more when it ends."""
        self._gone = True
        try:
            number = cast("IO[str]", self._stream).fileno()
            null = os.open(os.devnull, os.O_WRONLY)
            os.dup2(null, number)
            os.close(null)
        except (OSError, ValueError, AttributeError):
            return  # no stream of the system's


def reason(error: Exception) -> str:
    """What an OSError says, without its number and file."""
    return printable(getattr(error, "strerror", None) or error)


@contextmanager
def standard_streams() -> Iterator[None]:
    """Let ``sys.stdout`` and ``sys.stderr`` behave as :class:`Stream` does, inside the block."""
    before = sys.stdout, sys.stderr
    _hold_numbers()
    for stream, errors in ((sys.stdout, "replace"), (sys.stderr, "backslashreplace")):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors=errors)
    sys.stdout = cast("Any", Stream(before[0], "standard output", required=True))
    sys.stderr = cast("Any", Stream(before[1], "standard error", required=False))
    try:
        yield
    finally:
        sys.stdout, sys.stderr = before


def _hold_numbers() -> None:
    """Take the numbers of closed standard streams, so that no file that is opened later gets one of them."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, os.O_RDWR)  # the lowest free number: this one
            if null != number:
                os.dup2(null, number)
                os.close(null)
