r"""Texts from outside in one line: what would break it or steer a terminal is written out. Numbers with their noun.

Use:

    printable("clamp\n\x1b[2J")              # 'clamp\\x0a\\x1b[2J'
    counted(1, "layer"), counted(2, "layer")  # '1 layer', '2 layers'
"""

from __future__ import annotations

ERASED = {code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160))}


def printable(text: object) -> str:
    """A text with its control characters written as their codes."""
    return str(text).translate(ERASED)


def counted(n: int, noun: str) -> str:
    """A number with its noun, in the plural unless it is one."""
    return f"{n} {noun}{'' if n == 1 else 's'}"
