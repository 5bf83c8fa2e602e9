"""Progress of long work, reported to the caller.

    def tell(what: str, done: int, total: int) -> None:
        print(f"{what}: {done} of {total}")

    with counted_progress(tell, "beads", total=2) as count:
        count(); count()

A `Progress` is a callback of three values. Work that is timed as a whole is a :func:`phase`; :func:`watched` names
a `Watcher`, which is called for phases. Without either nothing is reported and nothing is timed.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from typing import ParamSpec, Protocol, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

Progress = Callable[[str, int, int], None]  # what is counted, how many are done, of how many


class Watcher(Protocol):
    """Is called for phases of the work."""

    def during(self, phase: str, spins: bool, /) -> AbstractContextManager[None]:
        """Entered when a phase begins and left when it ends.

        Args:
            phase: its name.
            spins: whether it shows no progress of its own.
        """
        ...


_watcher: ContextVar[Watcher | None] = ContextVar("watcher", default=None)


@contextmanager
def counted_progress(progress: Progress | None, what: str, total: int, done: int = 0) -> Iterator[Callable[[], None]]:
    """Count up and report every step; the end is reported as ``total`` of ``total``, whatever ended it.

    Args:
        progress: what to call; None: nothing is reported.
        what: what is counted.
        total: how many there are.
        done: how many are done already.

    Yields:
        A function to call whenever one more is done.
    """
    at = done

    def one_more() -> None:
        nonlocal at
        at += 1
        if progress is not None and at < total:
            progress(what, at, total)

    if progress is not None:
        progress(what, done, total)
    try:
        yield one_more
    finally:
        if progress is not None:
            progress(what, total, total)


@contextmanager
def watched(watcher: Watcher) -> Iterator[None]:
    """Report all phases to a watcher.

    Args:
        watcher: whom.
    """
    token = _watcher.set(watcher)
    try:
        yield
    finally:
        _watcher.reset(token)


def phase(name: str, *, spins: bool = True) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Make a function a phase of the work.

    Args:
        name: of the phase.
        spins: whether it shows no progress of its own.

    Returns:
        A decorator.
    """

    def timed(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            watcher = _watcher.get()
            if watcher is None:
                return function(*args, **kwargs)
            with watcher.during(name, spins):
                return function(*args, **kwargs)

        return call

    return timed
