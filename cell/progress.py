"""A progress bar on a terminal, and nothing in a pipe.

with Bar(sys.stderr, "beads", total=140) as bar:
for bead in beads:
...
bar.advance()
"""

from __future__ import annotations

from typing import IO, Any

from .terminal import is_quiet


class Bar:
    """A bar that is gone when it is done."""

    def __init__(self, stream: IO[str] | None, what: str, total: int, done: int = 0) -> None:
        """Make a bar.

        Args:
            stream: where to; a bar is shown only if it is a terminal.
            what: what is counted.
            total: how many there are.
            done: how many are done already.
        """
        self._bar: Any = None
        if stream is None or not stream.isatty() or is_quiet():
            return
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
        )
        self._bar = Progress(*columns, console=Console(file=stream), transient=True)
        self._task = self._bar.add_task(what, total=total, completed=done)

    def __enter__(self) -> Bar:
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def advance(self) -> None:
        """One more is done."""
        if self._bar is not None:
            self._bar.advance(self._task)
