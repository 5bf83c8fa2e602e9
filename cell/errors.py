"""The one error a user can cause: it ends a command with one line and exit code 2."""

from __future__ import annotations


class InputError(ValueError):
    """Bad input: a file, key or value that cannot be used. The message is one line that says what is allowed."""
