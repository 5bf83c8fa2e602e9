"""Changes of a case in words.

Use:

    in_words({"key": "table.E1_deg", "from": -45.0, "to": -31.0})      # E1 -45 -> -31
"""

from __future__ import annotations

from typing import Any

from .seam_changes import KEY as SEAMS
from .seam_changes import seam_in_words


def change_in_words(change: dict[str, Any]) -> str:
    """A change as part of a sentence."""
    key, was, to = change["key"], change["from"], change["to"]
    if key == SEAMS:
        return seam_in_words(to)
    if key == "roll":
        return f"roll {_roll_words(was)} -> {_roll_words(to)}"
    if key == "table":
        return f"E1 {was['E1_deg']:g} -> {to['E1_deg']:g} and E2 {was['E2_deg']:g} -> {to['E2_deg']:g}"
    if isinstance(was, list):
        axis, a, b = next((n, a, b) for n, a, b in zip("xyz", was, to, strict=True) if a != b)
        return f"{key.split('.')[0]} {axis} {a:g} -> {b:g} mm"
    name, unit = _NAMES[key]
    return f"{name} {was:g} -> {to:g}{unit}"


_NAMES = {
    "table.E1_deg": ("E1", ""),
    "table.E2_deg": ("E2", ""),
    "support.height_mm": ("support height", " mm"),
    "tool.dimensions.stick_out_mm": ("stick-out", " mm"),
    "process.deposition_speed_mm_s": ("deposition speed", " mm/s"),
    "process.blend_mm": ("rounding of corners", " mm"),
}


def _roll_words(value: Any) -> str:
    if value == "free":
        return "free"
    if "fixed_deg" in value:
        return f"fixed:{value['fixed_deg']:g}"
    return "range:{:g}:{:g}".format(*value["range_deg"])
