"""How much is said on the terminal, and what takes how long.

    with speaking(args.quiet, args.verbose, sys.stderr):
        ...                               # @stage functions are timed, and show that they are at work
    @stage("slicing")
    def slice_part(...): ...

Outside of :func:`speaking`, as in a library, nothing is said and nothing is timed.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import IO, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")


@dataclass
class Speech:
    """What the user asked for, and what has been timed so far.

    Attributes:
        quiet: nothing but errors is said.
        verbose: everything is said.
        stream: where progress goes.
        seconds: by stage.
    """

    quiet: bool = False
    verbose: bool = False
    stream: IO[str] | None = None
    seconds: dict[str, float] = field(default_factory=dict)


_speech: ContextVar[Speech | None] = ContextVar("speech", default=None)


def is_quiet() -> bool:
    """Whether nothing but errors is to be said."""
    speech = _speech.get()
    return speech is not None and speech.quiet


def is_verbose() -> bool:
    """Whether everything is to be said."""
    speech = _speech.get()
    return speech is not None and speech.verbose


@contextmanager
def speaking(quiet: bool, verbose: bool, stream: IO[str]) -> Iterator[None]:
    """Say as much as asked for; at the end, if verbose, what took how long.

    Args:
        quiet: nothing but errors.
        verbose: everything.
        stream: where progress and timings go.
    """
    speech = Speech(quiet, verbose, stream)
    token = _speech.set(speech)
    start = time.perf_counter()
    try:
        yield
    finally:
        _speech.reset(token)
    if verbose:
        stages = "".join(f"{name} {seconds:.2f} s, " for name, seconds in speech.seconds.items())
        stream.write(f"time: {stages}in all {time.perf_counter() - start:.2f} s\n")


def stage(name: str, *, spins: bool = True) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Time a function as a stage of the work.

    Args:
        name: of the stage.
        spins: whether it is shown to be at work; off for what has a bar of its own.

    Returns:
        A decorator.
    """

    def timed(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            speech = _speech.get()
            if speech is None:
                return function(*args, **kwargs)
            start = time.perf_counter()
            try:
                with _spinner(speech, name) if spins else nullcontext():
                    return function(*args, **kwargs)
            finally:
                speech.seconds[name] = speech.seconds.get(name, 0.0) + time.perf_counter() - start

        return call

    return timed


@contextmanager
def _spinner(speech: Speech, name: str) -> Iterator[None]:
    if speech.quiet or speech.stream is None or not speech.stream.isatty():
        yield
        return
    from rich.console import Console

    with Console(file=speech.stream).status(name):
        yield
