r"""Texts from outside in one line: what would break it or steer a terminal is written out.

Use:

    printable("clamp\n\x1b[2J")              # 'clamp\\x0a\\x1b[2J'
"""

from __future__ import annotations

ERASED = {code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160))}


def printable(text: object) -> str:
    """A text with its control characters written as their codes."""
    return str(text).translate(ERASED)
