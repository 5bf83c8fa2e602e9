"""The sub-program BAS, which sets frames and speeds by words.

Use:

    run_bas(state, "#VEL_CP", (0.2,), scope)

Its text is not public; what its words do is put together from programs that use them (see docs/programs.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from ..program import ANYWHERE, BaseFrame, ToolFrame
from .lexing import quoted, refuse
from .setting import assign
from .state import NAN, ControllerState, Speeds
from .values.evaluation import CARTESIAN, ListedFrame, Scope, UnknownValue, integer, matrix, number, shown

EXTERNAL = 6  # external axes that shares are set for


class BasScope(Scope, Protocol):
    """What BAS asks for beside."""

    def listed(self, name: str, place: int) -> Any:
        """A frame of TOOL_DATA or BASE_DATA; not known: ``UnknownValue``."""


def run_bas(state: ControllerState, word: str, values: tuple[Any, ...], scope: BasScope) -> None:
    """Run BAS.

    Args:
        state: what holds, which is changed.
        word: the first argument.
        values: the others.
        scope: variables and lists of frames.

    Raises:
        InputError: the word is not known, or a number is none that it takes.
    """
    if word == "#INITMOV":
        state.speeds = Speeds(override=state.speeds.override)
        state.set_tool(None)
        state.set_base(None)
    elif word in ("#TOOL", "#BASE", "#EX_BASE"):
        _frame(state, word, integer(_first(word, values, scope), scope), scope)
    elif word in ("#VEL_PTP", "#ACC_PTP"):
        _axes(state, "$VEL_AXIS" if word == "#VEL_PTP" else "$ACC_AXIS", _first(word, values, scope), scope)
    elif word in ("#VEL_CP", "#ACC_CP"):
        assign(state, ("$VEL" if word == "#VEL_CP" else "$ACC", "CP"), (), _first(word, values, scope), scope)
    elif word == "#FRAMES":
        _frames(state, scope)
    elif word in ("#PTP_DAT", "#PTP_PARAMS", "#CP_DAT", "#CP_PARAMS"):
        _parameters(state, word, values, scope)
    else:
        raise refuse(scope.where, f"BAS ({quoted(word)}, ..) is not known")


def _first(word: str, values: tuple[Any, ...], scope: Scope) -> Any:
    if not values:
        raise refuse(scope.where, f"BAS ({word}, ..) needs a number")
    return values[0]


def _frame(state: ControllerState, word: str, place: int, scope: BasScope) -> None:
    name = "TOOL_DATA" if word == "#TOOL" else "BASE_DATA"
    if name == "BASE_DATA" and (base := state.controller.base_data.get(place)) is not None and base.coupled:
        root = state.controller.machines.get(base.machine or 0)
        T = matrix(scope.listed(name, place), scope)  # what the program has put there counts
        state.set_base(BaseFrame(T, coupled=True, number=place, machine=base.machine, root=root))
        state.external_active = True
        return
    if word == "#EX_BASE" and place:
        raise refuse(
            scope.where,
            f"BAS (#EX_BASE,{place}): which external kinematic carries BASE_DATA[{place}] is not known; "
            f"controller.read.base_data of the case says it: {{{place}: {{machine: .., position_mm: ..}}}}",
        )
    frame = scope.listed(name, place)
    if isinstance(frame, UnknownValue):
        raise refuse(scope.where, f"depends on an unknown value: {frame.why}")
    if name == "TOOL_DATA":
        state.set_tool(ToolFrame(matrix(frame, scope), number=place))
    else:
        state.set_base(BaseFrame(matrix(frame, scope), coupled=False, number=place))
    state.numbers["$TOOL" if name == "TOOL_DATA" else "$BASE"] = {one: frame[one] for one in CARTESIAN}


def _axes(state: ControllerState, name: str, share: Any, scope: Scope) -> None:
    external = {"$VEL_AXIS": "$VEL_EXTAX", "$ACC_AXIS": "$ACC_EXTAX"}[name]
    for axis in range(1, state.controller.axes + 1):
        assign(state, (name, ""), (axis,), share, scope)
    for axis in range(1, EXTERNAL + 1):
        assign(state, (external, ""), (axis,), share, scope)


def _held(scope: Scope, name: str) -> Mapping[str, Any] | None:
    """A structure; None where it is not known."""
    value = scope.variable(name)
    if isinstance(value, UnknownValue):
        return None
    if not isinstance(value, dict):
        raise refuse(scope.where, f"{name} is a structure, not {shown(value)}")
    return value


def _frames(state: ControllerState, scope: BasScope) -> None:
    held = _held(scope, "FDAT_ACT")
    if not held:
        raise refuse(scope.where, "FDAT_ACT, which gives tool and base, has no value")
    if held.get("IPO_FRAME", "#BASE") != "#BASE":
        raise refuse(scope.where, f"FDAT_ACT.IPO_FRAME is #BASE here, not {shown(held['IPO_FRAME'])}")
    for word, part in (("#TOOL", "TOOL_NO"), ("#BASE", "BASE_NO")):
        if part not in held:
            raise refuse(scope.where, f"FDAT_ACT has no {part}")
        _frame(state, word, integer(held[part], scope), scope)


def _parameters(state: ControllerState, word: str, values: tuple[Any, ...], scope: BasScope) -> None:
    """What inline forms set: speed, acceleration, approximation, and with _PARAMS the frames."""
    path = word.startswith("#CP")
    name = "LDAT_ACT" if path else "PDAT_ACT"
    held = _held(scope, name)
    if held is None:
        if path:
            state.speeds.speed = NAN
        held = {}
    for part, known in (("ORI_TYP", "#VAR"), ("CIRC_TYP", "#BASE"), ("EXAX_IGN", 0)):
        if held.get(part, known) != known:
            raise refuse(scope.where, f"{name}.{part} is {known} here, not {shown(held[part])}")
    if "APO_DIST" not in held:  # corners may be rounded as far as they can be
        state.speeds.distance, state.speeds.share, state.speeds.axes_share = ANYWHERE, 1.0, 1.0
    if "APO_DIST" in held and not path:
        assign(state, ("$APO", "CPTP"), (), min(100.0, number(held["APO_DIST"], scope)), scope)
    if "APO_DIST" in held:
        assign(state, ("$APO", "CDIS"), (), held["APO_DIST"], scope)
    if "VEL" in held:
        _velocity(state, path, held["VEL"], scope)
    if "ACC" in held and not path:
        _axes(state, "$ACC_AXIS", held["ACC"], scope)
    if word.endswith("_PARAMS"):
        _frames(state, scope)
        if values:
            _velocity(state, path, values[0], scope)


def _velocity(state: ControllerState, path: bool, value: Any, scope: Scope) -> None:
    if path:
        assign(state, ("$VEL", "CP"), (), value, scope)
    else:
        _axes(state, "$VEL_AXIS", value, scope)


def null_frame(place: str) -> ListedFrame:
    """Number 0 of a list of frames."""
    return ListedFrame(dict.fromkeys("XYZABC", 0.0), place, 0)
