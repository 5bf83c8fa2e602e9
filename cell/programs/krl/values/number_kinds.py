"""Numbers of a program that are known here but for something, and arithmetic that keeps in mind for what.

Use:

    calculated("+", 0.1, 0.2)                 # ComputedReal(0.3.., 3e-8): the controller's may be off by that
    deviation_of(calculated("+", 0.25, 0.5))     # 0.0: exact on every controller

A controller's REAL has seven digits. So after R = R + 0.1, ten times, R < 1.0 may be true or false; such a comparison
is refused, like all that depends on what is not known of a number.

Source: single precision shows in KUKA's own results (robot-forum.com, thread 38120): 1402.64 * 1402.64 * 199.69 comes
to 392869920.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

PRECISION = 2.0**-24  # share of a number by which a REAL is off at most
EXACT_INTEGERS = 2**24  # up to which a REAL holds every whole number
FUNCTION_PRECISION = 8 * PRECISION  # of SIN, COS, ..
LARGEST_INTEGER = 2**31 - 1


class MaybeInteger(float):
    """A whole number of which it is not known whether it is INT or REAL."""


class ComputedReal(float):
    """A REAL that the controller may have a little otherwise.

    Attributes:
        deviation: by how much at most.
    """

    __slots__ = ("deviation",)
    deviation: float

    def __new__(cls, value: float, deviation: float) -> ComputedReal:
        """A value and by how much the controller's may differ."""
        made = super().__new__(cls, value)
        made.deviation = deviation
        return made


class TurnAngle(float):
    """An angle in degrees that is known but for whole turns: sources differ on whether ATAN2 gives 270 or -90."""


class TiedAngle(float):
    """One of A B C of an orientation that has other A B C as well: known with the other two alone."""


def is_real(value: float) -> bool:
    """Whether a number is known to be REAL."""
    return isinstance(value, float) and not isinstance(value, MaybeInteger)


def deviation_of(value: float) -> float:
    """By how much the controller's value may differ from a number."""
    if isinstance(value, ComputedReal):
        return value.deviation
    if isinstance(value, int) or float(value).is_integer():
        return 0.0 if abs(value) <= EXACT_INTEGERS else PRECISION * abs(value)
    return 0.0 if float(np.float32(value)) == value else PRECISION * abs(value)


def real(value: float, spread: float) -> float:
    """A REAL as it comes out of a computation whose inputs let it differ by some spread."""
    if spread == 0 and float(np.float32(value)) == value:
        return value
    return ComputedReal(value, spread + PRECISION * abs(value))


def calculated(operator: str, x: float, y: float) -> float:
    """The result of ``+ - * /`` on REALs; y is not 0 for the last."""
    by_x, by_y = deviation_of(x), deviation_of(y)
    x, y = float(x), float(y)
    if operator in "+-":
        return real(x + y if operator == "+" else x - y, by_x + by_y)
    if operator == "*":
        return real(x * y, abs(x) * by_y + abs(y) * by_x + by_x * by_y)
    value = x / y
    return real(value, (by_x + abs(value) * by_y) / max(abs(y) - by_y, 1e-300))


def function_value(function: Callable[[float], float], x: float, *, rounds_rightly: bool) -> float:
    """The value of a function of one number.

    Args:
        function: NaN where it has no value.
        x: the number.
        rounds_rightly: whether the controller's result is the nearest REAL, as of a square root.
    """
    value, by = function(float(x)), deviation_of(x)
    if not rounds_rightly:
        by = max(by, PRECISION * abs(x))
    beside = [function(float(x) + d) for d in (-by, by)] if by else []
    spread = max((abs(other - value) for other in beside if not math.isnan(other)), default=0.0)
    return real(value, spread + (0.0 if rounds_rightly else FUNCTION_PRECISION * abs(value)))


def direction(y: float, x: float) -> float:
    """ATAN2, degrees: an angle below 0 is known but for a whole turn."""
    value, length = math.degrees(math.atan2(y, x)), math.hypot(y, x)
    spread = math.degrees((deviation_of(y) + deviation_of(x)) / length) if length else 0.0
    spread += FUNCTION_PRECISION * abs(value)
    return TurnAngle(value) if y - deviation_of(y) < 0 else ComputedReal(value, spread)


def compares_alike(x: float, y: float) -> bool:
    """Whether two numbers compare on every controller as they do here."""
    if isinstance(x, ComputedReal) or isinstance(y, ComputedReal):
        return abs(x - y) > deviation_of(x) + deviation_of(y)
    return True


def rounds_alike(value: float) -> bool:
    """Whether every controller rounds a number to the same whole number."""
    by = deviation_of(value)
    return math.floor(value + 0.5 - by) == math.floor(value + 0.5 + by)
