"""The roll about the wire as the command line and the documents write it.

    parse_roll("range:-90:90")           # Roll(range_deg=(-90, 90))
    roll_text(case.roll)                 # "free", "fixed:-60", "range:-90:90"

Degrees.
"""

from __future__ import annotations

from typing import Literal

from pydantic import ValidationError

from ..errors import InputError
from .sections import Roll


def parse_roll(text: str) -> Literal["free"] | Roll:
    """A roll as the command line writes it.

    Raises:
        InputError: it must be free, fixed:DEG, range:LO:HI.
    """
    kind, *numbers = text.split(":")
    try:
        values = [float(v) for v in numbers]
        if kind == "free" and not values:
            return "free"
        if kind == "fixed" and len(values) == 1:
            return Roll(fixed_deg=values[0])
        if kind == "range" and len(values) == 2:
            return Roll(range_deg=(values[0], values[1]))
    except (ValueError, ValidationError):
        pass
    raise InputError(
        f"--roll: {text!r} is not a roll; free, fixed:DEG or range:LO:HI is needed (LO <= HI, at most 360 apart)"
    )


def roll_text(roll: Roll | str) -> str:
    """What :func:`parse_roll` reads as this roll."""
    if isinstance(roll, str):
        return roll
    if roll.fixed_deg is not None:
        return f"fixed:{roll.fixed_deg:g}"
    low, high = roll.range_deg or (0.0, 0.0)
    return f"range:{low:g}:{high:g}"
