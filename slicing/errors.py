"""The error of bad input. It is apart from the arrays, for what is read before anything is computed."""

from __future__ import annotations


class PartError(ValueError):
    """Bad input: one line naming the file or the part, what is wrong with it and what is allowed."""
