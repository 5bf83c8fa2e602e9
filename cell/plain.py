"""Values as a record holds them: Python's own, so that every writer takes them.

    plain({"pair": ("a", "b"), "proved": np.bool_(True)})      # {"pair": ("a", "b"), "proved": True}

Comparisons and minima of arrays give numpy's numbers and truth values, which look like Python's and are no JSON.
"""

from __future__ import annotations

from typing import Any

import numpy as np


def plain(value: Any) -> Any:
    """A value without numpy's types; what holds others is copied, tuples stay tuples.

    Args:
        value: of numbers, texts, arrays, and mappings, lists and tuples of them.

    Returns:
        The same in Python's own types.
    """
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, dict):
        return {plain(key): plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [plain(item) for item in value]
    if type(value) is tuple:
        return tuple(plain(item) for item in value)
    return value
