"""Errors that end a command with one line: bad input, exit code 2; a process that was killed from outside, 70."""

from __future__ import annotations


class InputError(ValueError):
    """Bad input: a file, key or value that cannot be used. The message is one line that says what is allowed."""


class WorkerKilledError(RuntimeError):
    """A worker process was killed from outside, most often for want of memory: there is no verdict.

    The input is not at fault: the same command may succeed with fewer processes or on a larger machine. The message is
    one line that says so.
    """
