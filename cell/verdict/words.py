"""Verdicts in words.

Use:

    in_words(row)                             # "collision: torch_neck - link_3 -2.1 mm, needs 5"
"""

from __future__ import annotations

from typing import Any

from ..motion.deposition_speed import KEPT_SHARE
from .failure_words import failure_in_words
from .result import TargetVerdict


def in_words(row: TargetVerdict) -> str:
    """What is wrong with a target in a few words; empty where it is feasible."""
    return "" if row.failure is None else failure_in_words(row.failure)


def unit_word(unit: str) -> str:
    """A unit as it follows a number."""
    return "" if unit == "1" else f" {unit}"


def speed_in_words(d: dict[str, Any]) -> str:
    """How far the deposition speed is kept, of what ``cell.motion.deposition_speed.speed_document`` says."""
    if not d["slowed"]:
        return "kept all along"
    why = f" ({d['axis']}'s {d['by']})" if d["axis"] else ""
    return (
        f"kept to {100 * d['least_share']:.0f} % or more over every 5 mm, least from target "
        f"{d['from_target']}{why}; {d['slowed_s']:.0f} s below {100 * KEPT_SHARE:.0f} %"
    )
