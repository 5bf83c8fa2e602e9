"""Reasons and their measures in words.

Use:

    in_words(row)                             # "collision: torch_neck - link_3 -2.1 mm, needs 5"
"""

from __future__ import annotations

from typing import Any

from .check import TargetVerdict
from .way_words import margin_in_words, way_in_words


def in_words(row: TargetVerdict) -> str:
    """An infeasible target's reason and measure in a few words."""
    d = row.detail
    if "in_words" in d:
        return str(d["in_words"])
    if row.reason == "unreachable":
        if "beyond_reach_mm" in d:
            return f"{d['beyond_reach_mm']:.1f} mm beyond the arm's reach"
        if "inside_reach_mm" in d:
            return f"{d['inside_reach_mm']:.1f} mm too close to fold up for"
        return str(d["search"])
    if row.reason == "joint_limit":
        return f"{d['axis']} {d['over_deg']:.1f} deg over its limit"
    if row.reason == "singular":
        return margin_in_words(d)
    if row.reason == "gravity":
        return f"{d['angle_deg']:.1f} deg off up, limit {d['limit_deg']:g}"
    if row.reason == "overhang":
        return overhang_in_words(d)
    if row.reason == "speed" and "share" in d:
        why = f"; {d['axis']}'s {d['by']}" if d["axis"] else ""
        held = f"{100 * d['share']:.0f} % of the speed held, needs {100 * d['limit']:.0f} %"
        return f"from target {d['from_target']}: {held}{why}"
    return way_in_words(d)


def overhang_in_words(d: dict[str, Any]) -> str:
    """How far a layer stands out over what lies below it."""
    out = "with nothing below anywhere" if d["out_mm"] is None else f"up to {d['out_mm']:.1f} mm"
    return f"{d['area_mm2']:.1f} mm2 stand out over what lies below, {out}, limit {d['limit_mm']:g}"


def unit_word(unit: str) -> str:
    """A unit as it follows a number."""
    return "" if unit == "1" else f" {unit}"


def speed_in_words(d: dict[str, Any]) -> str:
    """How far the deposition speed is held, of what ``cell.motion.deposition_speed.pace_document`` says."""
    if not d["slowed"]:
        return "held all along"
    why = f" ({d['axis']}'s {d['by']})" if d["axis"] else ""
    return (
        f"held to {100 * d['least_share']:.0f} % or more over every 5 mm, least from target "
        f"{d['from_target']}{why}; {d['slowed_s']:.0f} s on ways below 98 %"
    )
