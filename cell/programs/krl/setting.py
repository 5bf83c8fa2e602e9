"""Assignments to the controller's own variables: frames, speeds, approximation.

Use:

    assign(state, ("$VEL", "CP"), (), 0.008, scope)

A variable that is not known and does not move the arm alone is refused.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from ..program import BaseFrame, ToolFrame
from .lexing import quoted, refuse
from .state import ControllerState, Speeds
from .values.evaluation import CARTESIAN, CoupledFrame, ListedFrame, Scope, frame_dict, integer, matrix, number, shown

OUTPUTS = frozenset(("$OUT", "$OUT_C", "$ANOUT", "$PULSE"))
_HARMLESS = (
    "$FLAG $CYCFLAG $TIMER $TIMER_STOP $TIMER_FLAG $LOAD $LOAD_A1 $LOAD_A2 $LOAD_A3 $BWDSTART $ACT_TOOL $ACT_BASE "
    "$ACT_EX_AX $ASYNC_AXIS $LOOP_MSG $LOOP_CONT $MSG_T $GEAR_JERK $JERK $ECO_LEVEL $CP_STATMON"
)
HARMLESS = OUTPUTS | frozenset(_HARMLESS.split())
OF_TABLE = frozenset(("$ASYNC_AXIS", "$ACT_EX_AX"))  # harmless where it is known what is assigned
MODES = {  # how moves are interpolated, with what is known here
    "$IPO_MODE": "#BASE",
    "$ORI_TYPE": "#VAR",
    "$CIRC_TYPE": "#BASE",
}
MOST_KINEMATICS = 6  # external ones
LARGEST_SPEED = 3.0  # m/s; no more is known to be taken, and mm/s for m/s is a slip


def assign(state: ControllerState, path: tuple[str, str], indices: tuple[int, ...], value: Any, scope: Scope) -> None:
    """Assign to a variable of the controller.

    Args:
        state: what holds, which is changed.
        path: the variable and its component, which may be empty.
        indices: of an array.
        value: what is assigned.
        scope: for messages.

    Raises:
        InputError: the variable is not known, or the value is none that it takes.
    """
    name, part = path
    if name in ("$TOOL", "$BASE"):
        _frame(state, name, part, value, scope)
    elif name in MODES:
        state.modes[name] = shown(value)
    elif name == "$ADVANCE":
        state.speeds.advance = integer(value, scope)
        if not 0 <= state.speeds.advance <= 5:
            raise refuse(scope.where, f"$ADVANCE is 0 to 5, not {state.speeds.advance}")
    elif name in _STRUCTURES and not part and isinstance(value, dict):
        for one, inner in value.items():
            if isinstance(one, tuple):
                raise refuse(scope.where, f"{name} is a structure, not an array")
            _speed(state.speeds, (name, one), indices, inner, scope)
    elif name in _STRUCTURES or name in _ARRAYS or name == "$OV_PRO":
        _speed(state.speeds, path, indices, value, scope)
    elif name in HARMLESS:
        if name == "$ACT_EX_AX":
            state.external_active = _active_kinematic(value, scope)
        if name == "$ASYNC_AXIS" and integer(value, scope) & 0b11:
            raise refuse(scope.where, "$ASYNC_AXIS makes E1 or E2 asynchronous: only synchronous axes are supported")
        if name in OUTPUTS and name != "$OUT_C":  # which is set by the main run, at the corner itself
            state.stop()
    else:
        raise refuse(
            scope.where,
            f"{quoted(name)} is not known; if it moves nothing, controller.read.harmless of the case may say so",
        )


def _active_kinematic(value: Any, scope: Scope) -> bool:
    """Whether $ACT_EX_AX makes the table's axes count."""
    number_given = integer(value, scope)
    if not 0 <= number_given <= MOST_KINEMATICS:
        raise refuse(scope.where, f"$ACT_EX_AX is 0 to {MOST_KINEMATICS}, not {number_given}")
    return number_given > 0


def check_modes(state: ControllerState, asked: tuple[str, ...], scope: Scope) -> None:
    """Refuse a move to a pose that is interpolated in another way than is known here.

    Args:
        state: what holds.
        asked: of :data:`MODES`, those that the move depends on.
        scope: for messages.

    Raises:
        InputError: it is.
    """
    for name in asked:
        known = MODES[name]
        held = state.modes.get(name, known)
        if held != known:
            raise refuse(scope.where, f"{name} is {held}: only {known} is supported")


def _frame(state: ControllerState, name: str, part: str, value: Any, scope: Scope) -> None:
    if part:
        held = state.tool if name == "$TOOL" else state.base
        if held is None or (isinstance(held, BaseFrame) and held.coupled):
            raise refuse(scope.where, f"{name}.{part} is set where {name} is {'none' if held is None else 'coupled'}")
        frame = state.numbers[name]
        if part not in CARTESIAN:
            raise refuse(scope.where, f"{name} has X Y Z A B C, not {quoted(part)}")
        if frame is None and part in "ABC":
            raise refuse(scope.where, f"{name}.{part} is set where A B C of {name} were not given by the program")
        frame = frame or frame_dict(held.T_flange_tcp if isinstance(held, ToolFrame) else held.T)
        value = {**frame, part: value}
    number_in_list = value.number if isinstance(value, ListedFrame) else None
    if name == "$TOOL":
        if isinstance(value, ListedFrame) and value.place == "BASE_DATA" and value.number:
            raise refuse(scope.where, f"$TOOL = BASE_DATA[{value.number}]: a tool is TOOL_DATA[n] or a frame")
        state.set_tool(ToolFrame(matrix(value, scope), number=number_in_list))
    elif isinstance(value, CoupledFrame):
        state.set_base(BaseFrame(value.T, coupled=True, number=value.number, machine=value.machine, root=value.root))
    else:
        if isinstance(value, ListedFrame) and value.place == "TOOL_DATA" and value.number:
            raise refuse(scope.where, f"$BASE = TOOL_DATA[{value.number}]: a base is BASE_DATA[n], EK(..) or a frame")
        state.set_base(BaseFrame(matrix(value, scope), coupled=False, number=number_in_list))
    if isinstance(value, dict):
        state.numbers[name] = {one: value[one] for one in CARTESIAN}


LEAST_SHARE = 1  # %: with less the arm stands


def _share(value: float) -> float | None:
    return value / 100.0 if 0 <= value <= 100 else None


def _moving_share(value: float) -> float | None:
    return value / 100.0 if LEAST_SHARE <= value <= 100 else None


def _speed_value(value: float) -> float | None:
    return value if 0 < value <= LARGEST_SPEED else None


def _positive(value: float) -> float | None:
    return value if 0 < value <= 1e5 else None


def _turn(value: float) -> float | None:
    return math.radians(value) if 0 < value <= 1e5 else None


def _length(value: float) -> float | None:
    return value / 1000.0 if 0 <= value <= 1e5 else None


Setter = Callable[[Speeds, float], None]


def _put(name: str) -> Setter:
    return lambda speeds, value: setattr(speeds, name, value)


def _put_turn(axis: int) -> Setter:
    return lambda speeds, value: speeds.turn_speeds.__setitem__(axis, value)


def _nothing(speeds: Speeds, value: float) -> None:
    """What is not used: accelerations of the orientation, approximation by its angle."""


_KNOWN: dict[tuple[str, str], tuple[Callable[[float], float | None], Setter, str]] = {
    ("$VEL", "CP"): (_speed_value, _put("speed"), f"above 0 and up to {LARGEST_SPEED:g}, in m/s"),
    ("$VEL", "ORI1"): (_turn, _put_turn(1), "above 0, in degrees a second"),
    ("$VEL", "ORI2"): (_turn, _put_turn(2), "above 0, in degrees a second"),
    ("$ACC", "CP"): (_positive, _put("acceleration"), "above 0, in m/s2"),
    ("$ACC", "ORI1"): (_positive, _nothing, "above 0, in degrees/s2"),
    ("$ACC", "ORI2"): (_positive, _nothing, "above 0, in degrees/s2"),
    ("$APO", "CDIS"): (_length, _put("distance"), "0 or more, in mm"),
    ("$APO", "CVEL"): (_share, _put("share"), "0 to 100 %"),
    ("$APO", "CPTP"): (_share, _put("axes_share"), "0 to 100 %"),
    ("$APO", "CORI"): (_length, _nothing, "0 or more, in degrees"),
    ("$OV_PRO", ""): (_moving_share, _put("override"), "above 0 and up to 100 %"),
}
_WHOLE = {("$APO", "CVEL"), ("$APO", "CPTP"), ("$OV_PRO", "")}  # INT, as the arrays are: a REAL is rounded
_STRUCTURES = ("$VEL", "$ACC", "$APO")
_ARRAYS = {
    "$VEL_AXIS": "axis_share",
    "$ACC_AXIS": "axis_acceleration",
    "$VEL_EXTAX": "external_share",
    "$ACC_EXTAX": "external_acceleration",
}


def _speed(speeds: Speeds, path: tuple[str, str], indices: tuple[int, ...], value: Any, scope: Scope) -> None:
    name, part = path
    given = float(integer(value, scope) if name in _ARRAYS or path in _WHOLE else number(value, scope))
    if name in _ARRAYS:
        share = _moving_share(given)
        if share is None or len(indices) != 1:
            raise refuse(scope.where, f"{name}[i] is above 0 and up to 100 %, not {given:g}")
        getattr(speeds, _ARRAYS[name])[indices[0]] = share
        return
    if path not in _KNOWN:
        raise refuse(scope.where, f"{name}.{quoted(part)} is not known")
    convert, put, allowed = _KNOWN[path]
    converted = convert(given)
    if converted is None:
        raise refuse(scope.where, f"{name}{'.' if part else ''}{part} is {allowed}, not {given:g}")
    put(speeds, converted)
