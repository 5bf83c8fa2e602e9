"""How much is printed on the terminal, and how long each step takes.

with speaking(args.quiet, args.verbose, sys.stderr):
    check(job, 90, 180)                   # its stages are timed, and show that they are at work
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import IO

from ..progress import watched


@dataclass
class Speech:
    """What the user asked for, and what has been timed so far: a `cell.progress.Watcher`.

    Attributes:
        quiet: only errors are printed.
        verbose: everything is printed.
        stream: where progress goes.
        seconds: by phase.
    """

    quiet: bool = False
    verbose: bool = False
    stream: IO[str] | None = None
    seconds: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def during(self, phase: str, spins: bool) -> Iterator[None]:
        """Time a phase, and show that it is at work."""
        start = time.perf_counter()
        try:
            if spins and not self.quiet and self.stream is not None and self.stream.isatty():
                from rich.console import Console

                with Console(file=self.stream).status(phase):
                    yield
            else:
                yield
        finally:
            self.seconds[phase] = self.seconds.get(phase, 0.0) + time.perf_counter() - start


_speech: ContextVar[Speech | None] = ContextVar("speech", default=None)


def is_quiet() -> bool:
    """Whether only errors are printed."""
    speech = _speech.get()
    return speech is not None and speech.quiet


def is_verbose() -> bool:
    """Whether everything is printed."""
    speech = _speech.get()
    return speech is not None and speech.verbose


@contextmanager
def speaking(quiet: bool, verbose: bool, stream: IO[str]) -> Iterator[None]:
    """Say as much as asked for, what the library logs included; at the end, if verbose, what took how long.

    Args:
        quiet: nothing but errors.
        verbose: everything.
        stream: where progress and timings go.
    """
    speech = Speech(quiet, verbose, stream)
    handler, log = logging.StreamHandler(stream), logging.getLogger("cell")
    handler.setLevel(logging.ERROR if quiet else logging.WARNING)
    handler.setFormatter(logging.Formatter("rbam: %(message)s"))
    log.addHandler(handler)
    token = _speech.set(speech)
    start = time.perf_counter()
    try:
        with watched(speech):
            yield
    finally:
        log.removeHandler(handler)
        _speech.reset(token)
    if verbose:
        stages = "".join(f"{name} {seconds:.2f} s, " for name, seconds in speech.seconds.items())
        stream.write(f"time: {stages}in all {time.perf_counter() - start:.2f} s\n")
