"""Layers that lock the torch out, in words.

Use:

    blocked_in_words([{"sub_volume": "SV1", "layers": [4, 5, 6]}])      # "SV1 layers 4-6"
"""

from __future__ import annotations

from typing import Any

import numpy as np


def blocked_in_words(blocked: list[dict[str, Any]]) -> str:
    """Layers in a few words: "SV1 layers 3-12, SV2 layer 0"."""
    by_name: dict[str, list[int]] = {}
    for layer in blocked:
        by_name.setdefault(layer["sub_volume"], []).append(layer["layer"])
    words = []
    for name, numbers in by_name.items():
        runs = np.split(np.array(numbers), np.flatnonzero(np.diff(numbers) > 1) + 1)
        text = ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
        words.append(f"{name} layer{'s' if len(numbers) > 1 else ''} {text}")
    return ", ".join(words)
