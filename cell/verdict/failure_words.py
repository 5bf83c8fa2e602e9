"""Failures in words: what was found, what is needed, and the key to set. No other module says them.

Use:

    failure_in_words(Failure(Kind.JOINT_LIMIT, measure=2.1, axis="A5"))      # "A5 2.1 deg over its limit"
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..failure import (
    BeadOrder,
    CollisionPlace,
    Contact,
    Failure,
    FailurePlace,
    Kind,
    LaidLayer,
    OverhangArea,
    SlowdownCause,
    Where,
)
from ..units import MARGIN_UNITS

KEYS = {
    "wrist": "checks.wrist_deg",
    "elbow": "checks.elbow_deg",
    "shoulder": "checks.shoulder_mm",
    "sigma": "checks.sigma",
}


def failure_in_words(failure: Failure) -> str:
    """A failure in a few words: of a target, of the way to it, or of rows of a motion.

    Args:
        failure: of a verdict's row or a motion's finding.

    Returns:
        One line without the reason itself.
    """
    if failure.kind is Kind.OVERHANG:
        return _overhang(failure)
    if failure.kind is Kind.GRAVITY:
        return f"{_number(failure.measure):.1f} deg off upright, limit {failure.limit:g}"
    if failure.where is Where.ROWS:
        return _rows(failure)
    if failure.kind is Kind.DEPOSITION_SPEED:
        return _deposition(failure)
    if failure.where is Where.TARGET and failure.kind in (Kind.UNREACHABLE, Kind.SINGULAR):
        return _reach(failure) if failure.kind is Kind.UNREACHABLE else _margin(failure)
    return f"{_way(failure.place)}{_on_a_way(failure)}"


def _number(value: float | None) -> float:
    """A measure that its kind always has."""
    assert value is not None
    return value


def _reach(failure: Failure) -> str:
    effort, measure = failure.effort, failure.measure
    if measure is not None:
        beyond = np.copysign(1.0, measure) > 0
        return f"{abs(measure):.1f} mm " + ("beyond the arm's reach" if beyond else "inside the arm's least reach")
    assert effort is not None
    return effort.note or f"not found from {effort.seeds} seeds at {effort.rolls} roll{'s' * (effort.rolls != 1)}"


def _margin(failure: Failure) -> str:
    """A singularity's margin and what is needed."""
    unit = MARGIN_UNITS[failure.singularity][0]
    return f"{failure.singularity} at {failure.measure:g}{'' if unit == '1' else ' ' + unit}, needs {failure.limit:g}"


def _overhang(failure: Failure) -> str:
    """How far a layer stands out over what lies below it."""
    assert isinstance(failure.cause, OverhangArea)
    out = "with nothing below anywhere" if failure.measure is None else f"up to {failure.measure:.1f} mm"
    area = failure.cause.area_mm2
    return f"{area:.1f} mm2 overhang what lies below, {out}, limit {failure.limit:g} mm"


def _deposition(failure: Failure) -> str:
    assert isinstance(failure.cause, SlowdownCause)
    why = f"; {failure.axis}'s {failure.cause.by}" if failure.axis else ""
    kept = f"{100 * _number(failure.measure):.0f} % of the speed kept, needs {100 * _number(failure.limit):.0f} %"
    return f"from target {failure.from_target}: {kept}{why}"


def _hit(failure: Failure, contact: Contact) -> str:
    """A pair with its distance and the one that is needed; figures in which the one is less than the other."""
    distance, needed = _number(failure.measure), _number(failure.limit)
    digits = 1 if round(distance, 1) < needed or distance >= needed else 3
    words = f"{' - '.join(contact.pair)} {distance:.{digits}f} mm"
    if contact.seen is CollisionPlace.ROUNDED and distance >= needed:
        return f"{words} where it was looked at; {needed:g} mm are not proved where a corner is rounded"
    if contact.seen is CollisionPlace.BETWEEN_SAMPLES:
        return f"{words} at a sample; {needed:g} mm are not proved between this sample and the next"
    return f"{words}, needs {needed:g}" + (
        " where a corner is rounded" if contact.seen is CollisionPlace.ROUNDED else ""
    )


def _way(place: FailurePlace) -> str:
    """Which way does not hold, as the beginning of a sentence."""
    if place.at_home:
        return "the arm at home: "
    if place.where in (Where.FROM_HOME, Where.TO_HOME):
        return "way from home: " if place.where is Where.FROM_HOME else "way home: "
    if place.where is Where.TABLE_TURN:
        return f"the table's turn after target {place.from_target}: "
    if place.from_target is None:
        return ""
    return f"{'travel' if place.where is Where.TRAVEL else 'bead'} from target {place.from_target}: "


def _on_a_way(failure: Failure) -> str:
    words, effort = _what(failure.root), failure.effort
    if failure.kind is Kind.CONFIGURATION_CHANGE:
        words = f"no configuration goes on{': ' if words else ''}{words}"
    if effort is not None:
        if effort.retract_mm is not None and effort.reached_mm is not None:
            drawn = f"{effort.reached_mm:.0f} of {effort.retract_mm:g} mm drawn back"
            words += f" after {drawn} (1, 2 and 4 times process.retract_mm are tried)"
        if effort.attempts is not None:
            shut = f", the torch is shut in while {effort.shut_in}" if effort.shut_in else ""
            words = f"no way found in {effort.attempts} attempts (process.travel_attempts){shut}; {words}"
        elif effort.shut_in:
            words += f" while {effort.shut_in}"
        if effort.searches is not None:
            words = f"no way found in {effort.searches} searches; {words}"
    if failure.locked_by:
        words += f"; locked out by {layers_in_words(failure.locked_by)}"
    return words


def _what(failure: Failure) -> str:
    """What stops the arm."""
    kind, axis, measure = failure.kind, failure.axis, failure.measure
    if failure.contact is not None:
        return _hit(failure, failure.contact)
    if kind is Kind.JOINT_LIMIT and axis:
        return f"{axis} at its limit" if measure is None else f"{axis} {measure:.1f} deg over its limit"
    if kind is Kind.SINGULAR and failure.singularity:
        return f"{_margin(failure)} ({KEYS[failure.singularity]})"
    if kind is Kind.JOINT_SPEED:
        return f"{axis} needs {measure:g} deg/s, has {failure.limit:g}"
    if kind is Kind.ARRIVES_OFF:
        return f"{axis} arrives {_number(measure):.1f} deg off"
    words = {Kind.CONFIGURATION_CHANGE: "", Kind.UNREACHABLE: "out of reach on the way"}
    return words.get(kind, kind.word.replace("_", " "))


def _program(failure: Failure) -> str:
    """What is wrong with a robot program; empty where it is wrong with any motion."""
    measure, limit = failure.measure or 0.0, failure.limit or 0.0
    return {
        Kind.OUT_OF_REACH: "the arm cannot reach the point in its present configuration",
        Kind.NO_CONFIGURATION: f"the arm would jump by {measure:g} deg: its configuration ends here",
        Kind.TOOL_OFF: f"its tool is {measure:g} mm off the case's torch, {limit:g} are allowed",
        Kind.TOOL_TURNED: f"its tool is turned by {measure:g} deg off the case's torch, {limit:g} are allowed",
        Kind.BASE_STANDS: f"its base stands still while the table moves by {measure:g} deg",
        Kind.BASE_ROOT: f"its table's root is {measure:g} mm off the case's positioner, {limit:g} are allowed",
        Kind.NOT_GIVEN: f"no point up to here gives {failure.axis}: the position of the table is not known",
        Kind.HALF_TURN: f"{failure.axis} is endless and turns by {measure:g} deg in one move: it may go either way",
        Kind.BLEND: f"corners are rounded over {measure:g} mm (C_DIS), {limit:g} are checked (process.blend_mm)",
        Kind.ARC_CORNER: f"the corner where the arc goes on or off is rounded over {measure or '?'} mm",
        Kind.PTP_WITH_ARC: "a PTP with the arc on: the speed of the TCP is not controlled",
        Kind.ARC_LEFT_ON: "the arc is left on",
        Kind.ARC_ON_AGAIN: "the arc is on already",
        Kind.ARC_OFF_AGAIN: "the arc is off already",
        Kind.PATH_SPEED: f"{measure:g} m/s set for the TCP, no arm reaches more than {limit:g}",
    }.get(failure.kind, "")


def _rows(failure: Failure) -> str:
    """What is wrong on rows of a motion."""
    kind, measure, limit = failure.kind, failure.measure, failure.limit
    of_program = _program(failure)
    if of_program:
        return of_program
    if kind is Kind.JOINT_LIMIT:
        return f"{failure.axis} {measure:g} deg outside its range"
    if failure.contact is not None:
        seen = {
            CollisionPlace.BETWEEN_ROWS: "not proved free between rows: ",
            CollisionPlace.ROUNDED: "where a corner is rounded: ",
        }
        near = "" if measure is None else f" {measure:.1f} mm"
        if failure.contact.seen is CollisionPlace.ROUNDED and (measure is None or measure >= _number(limit)):
            pair = f": {' - '.join(failure.pair)}{near}" if failure.pair else ""
            return f"not proved free where a corner is rounded{pair}, needs {limit:g}"
        return f"{seen.get(failure.contact.seen, '')}{' - '.join(failure.pair)}{near}, needs {limit:g}"
    if kind is Kind.SINGULAR:
        return f"{failure.singularity} at {measure:g} {failure.unit}, needs {limit:g}"
    if kind.reason == "no_path":
        return f"{kind.word}{', ' + failure.singularity if failure.singularity else ''} inside a bead"
    if kind.reason == "speed":
        return _rows_speed(failure)
    return _rows_place(failure)


def _rows_speed(failure: Failure) -> str:
    if failure.kind is Kind.STANDSTILL and failure.measure is None:
        return "the arc burns at a standstill for a time that is not known (HALT, WAIT FOR)"
    measure, limit = _number(failure.measure), failure.limit
    if failure.kind is Kind.DEPOSITION_SPEED:
        assert limit is not None
        return (
            f"from target {failure.from_target}: {100 * measure:.0f} % of the deposition speed reached;"
            f" {'limit' if measure > limit else 'least'} {100 * limit:.0f} %"
        )
    if failure.kind is Kind.STANDSTILL:
        return f"the arc burns for {measure:g} s at a standstill, {limit:g} s are allowed"
    return f"{failure.axis} needs {measure:.1f} {failure.unit}, has {limit:g}"


def _rows_place(failure: Failure) -> str:
    kind, measure, limit = failure.kind, failure.measure, failure.limit
    if kind is Kind.NOT_WELDED:
        more = "" if failure.to_target == failure.target else f" to {failure.to_target}"
        return f"target {failure.target}{more}"
    if isinstance(failure.cause, BeadOrder):
        after = "first" if failure.cause.after is None else f"after bead {failure.cause.after}"
        return f"bead {failure.cause.bead} {after}"
    return {
        Kind.GOES_BACK: f"goes back by {measure:g} mm along its bead",
        Kind.SKIPS: f"progress along the bead jumps {measure:g} mm",
        Kind.OFF_BEAD: f"TCP {measure:g} mm off the bead, {limit or 0:g} are allowed",
        Kind.OFF_WIRE: f"wire {measure:g} deg off its direction, {limit or 0:g} are allowed",
        Kind.ROLL_OUTSIDE: f"roll {measure:g} deg outside the rolls of the case",
    }[kind]


def layers_in_words(layers: Sequence[LaidLayer]) -> str:
    """Layers in a few words: "SV1 layers 3-12, SV2 layer 0"."""
    by_name: dict[str, list[int]] = {}
    for one in layers:
        by_name.setdefault(one.sub_volume, []).append(one.layer)
    words = []
    for name, numbers in by_name.items():
        runs = np.split(np.array(numbers), np.flatnonzero(np.diff(numbers) > 1) + 1)
        text = ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
        words.append(f"{name} layer{'s' if len(numbers) > 1 else ''} {text}")
    return ", ".join(words)
