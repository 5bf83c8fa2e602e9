"""Numbers as a grid is written: one, a list of them, or LO:HI:STEP.

    values_of("-90:90:45")        # [-90.0, -45.0, 0.0, 45.0, 90.0]
    values_of([0, "10:20:5"])     # [0.0, 10.0, 15.0, 20.0]

The command line and the case files share this.
"""

from __future__ import annotations

import math

MOST_VALUES = 100_000
FORMS = "a number, LO:HI:STEP with LO <= HI and STEP > 0, or a list of them"


def values_of(text: object) -> list[float]:
    """The numbers that a text, a number or a list stands for.

    Args:
        text: see the module.

    Returns:
        At least one finite number.

    Raises:
        ValueError: it is nothing of that, or more than 100,000 numbers.
    """
    if isinstance(text, (list, tuple)):
        found: list[float] = []
        for item in text:
            found += _few(item)
            if len(found) > MOST_VALUES:
                raise ValueError(f"has more than {MOST_VALUES} values")
        if not found:
            raise ValueError(f"must be {FORMS}")
        return found
    return _few(text)


def _few(text: object) -> list[float]:
    """The numbers of one text or number."""
    if isinstance(text, bool) or not isinstance(text, (int, float, str)):
        raise ValueError(f"must be {FORMS}")
    try:
        numbers = [float(v) for v in str(text).split(":")]
    except (ValueError, OverflowError):  # a whole number may be larger than any other
        numbers = []
    if not all(map(math.isfinite, numbers)):
        numbers = []
    if len(numbers) == 1:
        return numbers
    if len(numbers) != 3 or not numbers[0] <= numbers[1] or not numbers[2] > 0:
        raise ValueError(f"must be {FORMS}")
    low, high, step = numbers
    count = (high - low) / step  # infinite where the step is next to nothing
    if not count <= MOST_VALUES:
        raise ValueError(f"has {count:.3g} values; at most {MOST_VALUES} are allowed")
    return [low + i * step for i in range(math.floor(count + 1e-9) + 1)]
