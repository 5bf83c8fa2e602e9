"""Collisions and ways that do not hold in words: what was found, what is needed, and the key to set.

Use:

    way_in_words({"from_target": 3, "on_the_way": "joint_limit", "axis": "A5", "over_deg": 2.1})
"""

from __future__ import annotations

from typing import Any

from .layer_words import blocked_in_words as layers_in_words

KEYS = {
    "wrist": "checks.wrist_deg",
    "elbow": "checks.elbow_deg",
    "shoulder": "checks.shoulder_mm",
    "sigma": "checks.sigma",
}


def hit_in_words(d: dict[str, Any]) -> str:
    """A pair with its distance and the one that is needed; figures in which the one is less than the other."""
    distance, needed = d["distance_mm"], d["required_mm"]
    digits = 1 if round(distance, 1) < needed or distance >= needed else 3
    words = f"{' - '.join(d['pair'])} {distance:.{digits}f} mm"
    if d.get("between_samples"):
        return f"{words} at a sample, not proved to keep {needed:g} between it and the next"
    return f"{words}, needs {needed:g}" + (" where a corner is rounded" if d.get("rounded") else "")


def margin_in_words(d: dict[str, Any]) -> str:
    """A singularity's margin and what is needed."""
    unit = "" if d["unit"] == "1" else f" {d['unit']}"
    return f"{d['singularity']} at {d['margin']:g}{unit}, needs {d['limit']:g}"


def way_in_words(d: dict[str, Any]) -> str:
    """Why a way does not hold, on a bead, between beads or from home and back."""
    what = _what(d)
    if "at_home" in d:
        return f"the arm at home: {what}"
    if d.get("from") == "home" or d.get("to") == "home":
        return f"{'way from home' if d.get('from') == 'home' else 'way home'}: {what}"
    if d.get("table_turns"):
        return f"the table's turn after target {d['from_target']}: {what}"
    if "from_target" not in d:
        return what
    return f"{'travel' if d.get('travel') else 'bead'} from target {d['from_target']}: {what}"


def _what(d: dict[str, Any]) -> str:
    words = _cause(d.get("because") or d.get("on_the_way", "collision"), d)
    if d.get("on_the_way") == "configuration change":
        words = f"no configuration leads on{': ' if words else ''}{words}"
    if "retract_mm" in d and "reached_mm" in d:
        words += f" after {d['reached_mm']:.0f} of {d['retract_mm']:g} mm drawn back (process.retract_mm)"
    if "attempts" in d:
        shut = f", shut in while {d['while']}" if "while" in d else ""
        words = f"no way found in {d['attempts']} attempts (process.travel_attempts){shut}; {words}"
    elif "while" in d:
        words += f" while {d['while']}"
    if "searches" in d:
        words = f"no way found in {d['searches']} searches; {words}"
    if "blocked_by_layers" in d:
        words += f"; locked out by {layers_in_words(d['blocked_by_layers'])}"
    return words


def _cause(cause: str, d: dict[str, Any]) -> str:
    if "pair" in d:
        return hit_in_words(d)
    if cause == "joint_limit" and "axis" in d:
        return f"{d['axis']} {d['over_deg']:.1f} deg over its limit" if "over_deg" in d else f"{d['axis']} at its limit"
    if cause == "singular" and "singularity" in d:
        return f"{margin_in_words(d)} ({KEYS[d['singularity']]})"
    if cause == "speed" and "needed_deg_s" in d:
        return f"{d['axis']} needs {d['needed_deg_s']:g} deg/s, has {d['allowed_deg_s']:g}"
    if cause == "jump" and "arrives_off_deg" in d:
        return f"{d['axis']} arrives {d['arrives_off_deg']:.1f} deg off"
    return {"configuration change": "", "unreachable": "out of reach on the way"}.get(cause, cause.replace("_", " "))
