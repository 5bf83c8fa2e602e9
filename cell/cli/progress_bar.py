"""Progress bars on a terminal, and nothing in a pipe.

Use:

    bars = Bars(sys.stderr)
    bars("beads", 3, 140)                     # shown
    bars("beads", 140, 140)                   # gone
"""

from __future__ import annotations

from typing import IO, Any

from .verbosity import is_quiet


class Bars:
    """Shows one bar at a time: a `cell.progress.Progress`."""

    def __init__(self, stream: IO[str]) -> None:
        """Prepare; nothing is shown yet.

        Args:
            stream: where to; bars are shown only if it is a terminal.
        """
        self._stream = stream
        self._bar: Any = None
        self._task: Any = None
        self._what = ""

    def __call__(self, what: str, done: int, total: int) -> None:
        """Show how far something is; a bar is gone when all are done.

        Args:
            what: what is counted.
            done: how many are done.
            total: how many there are.
        """
        if not self._stream.isatty() or is_quiet():
            return
        if self._bar is not None and (what != self._what or done >= total):
            if what == self._what:
                self._bar.update(self._task, completed=total)  # so that the last that is seen is all of them
            self._bar.stop()
            self._bar = None
        if done >= total:
            return
        if self._bar is None:
            from rich.console import Console
            from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

            text = TextColumn("{task.description}", markup=False)
            columns = text, BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
            self._bar = Progress(*columns, console=Console(file=self._stream), transient=True)
            self._task, self._what = self._bar.add_task(what, total=total, completed=done), what
            self._bar.start()
        self._bar.update(self._task, completed=done)
