"""Types of variables: what a number becomes when a variable holds it.

Use:

    types = ValueTypes()
    types.declare("STEPS", {"N": "INT", "H": "REAL"})
    types.held("INT", 3.6, scope)                          # 4
    types.held("STEPS", {"N": 7.0, "H": 2}, scope)         # {"N": 7, "H": 2.0}

It matters: 7 / 2 is 3 where both are INT, and an INT rounds what it is given. Where a structure's type is declared in
none of the files that are read, its components may be either; such a whole number is a ``MaybeInteger``.
"""

from __future__ import annotations

from typing import Any

from ..expressions import Cursor
from ..lexing import quoted, refuse
from .evaluation import CARTESIAN, CoupledFrame, Scope, UnknownValue, integer
from .number_kinds import ComputedReal, MaybeInteger, TiedAngle, TurnAngle

INT, REAL = "INT", "REAL"
EITHER = "INT or REAL"
_FRAME, _AXES, _EXTERNAL = (
    dict.fromkeys(names, REAL) for names in (CARTESIAN, *([f"{kind}{n}" for n in range(1, 7)] for kind in "AE"))
)
_POS = {**_FRAME, "S": INT, "T": INT}
_POSITIONS = {
    **{"FRAME": _FRAME, "POS": _POS, "E6POS": _POS | _EXTERNAL},
    **{"AXIS": _AXES, "E6AXIS": _AXES | _EXTERNAL},
}
OF_CONTROLLER = {  # variables that every controller declares
    **{name: name.removesuffix("_ACT") for name in ("FDAT_ACT", "PDAT_ACT", "LDAT_ACT")},
    **{"FDEFAULT": "FDAT", "PDEFAULT": "PDAT", "LDEFAULT": "LDAT", "HOME": "E6AXIS", "XHOME": "E6AXIS"},
    **{"TOOL_DATA": "FRAME", "BASE_DATA": "FRAME"},
}
_OF_REALS = ["VEL", "ACC", "APO_DIST", "APO_FAC", "AXIS_VEL", "AXIS_ACC", "JERK_FAC", "GEAR_JERK", "X", "Y", "Z"]
_OTHERS = {
    "FDAT": {"TOOL_NO": INT, "BASE_NO": INT},
    **{kind: {**dict.fromkeys(_OF_REALS, REAL), "EXAX_IGN": INT} for kind in ("PDAT", "LDAT", "ADAT")},
    "LOAD": {"M": REAL, "CM": "FRAME", "J": "INERTIA"},
    "INERTIA": dict.fromkeys("XYZ", REAL),
}


class ValueTypes:
    """The structures that a program's files declare, beside those that the controller has."""

    def __init__(self) -> None:
        self._declared: dict[str, dict[str, str]] = {}

    def declare(self, name: str, components: dict[str, str]) -> None:
        """Take a structure's type; where files declare it otherwise each, what they differ in may be either."""
        known = self._declared.get(name, components)
        self._declared[name] = {c: kind if known.get(c, kind) == kind else EITHER for c, kind in components.items()}

    def component(self, kind: str | None, name: str) -> str:
        """The type of a component of a type."""
        if kind is None:
            return EITHER
        return self._declared.get(kind, _POSITIONS.get(kind, _OTHERS.get(kind, {}))).get(name, EITHER)

    def along(self, kind: str | None, accessors: tuple[str | tuple[int, ...], ...]) -> str | None:
        """The type of a part of a variable: an element of an array has the array's."""
        for accessor in accessors:
            if isinstance(accessor, str):
                kind = self.component(kind, accessor)
        return kind

    def held(self, kind: str | None, value: Any, scope: Scope) -> Any:
        """A value as a variable of a type holds it; structures and arrays are copied.

        Args:
            kind: of the variable; None where it is not known.
            value: given to it.
            scope: for messages.
        """
        if isinstance(value, CoupledFrame):
            return UnknownValue("a frame on an external kinematic, kept in a variable")
        if type(value) is dict:
            if kind in _POSITIONS:  # what the type has not is dropped: a FRAME given an E6POS
                value = {
                    name: one for name, one in value.items() if isinstance(name, tuple) or name in _POSITIONS[kind]
                }
            return {
                name: self.held(self.component(kind, name) if isinstance(name, str) else kind, one, scope)
                for name, one in value.items()
            }
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return value
        if kind == REAL:
            return value if isinstance(value, (ComputedReal, TurnAngle, TiedAngle)) else float(value)
        if kind == INT:
            return integer(value, scope)
        either = kind in (EITHER, None) and type(value) in (int, float)
        return MaybeInteger(value) if either and float(value).is_integer() else value

    def assigned(self, name: str, kind: str | None, value: Any) -> Any:
        """What is assigned to a variable while a program runs; not known where the variable may round it."""
        if type(value) is dict:
            return {
                part: self.assigned(name, self.component(kind, part) if isinstance(part, str) else kind, one)
                for part, one in value.items()
            }
        real = isinstance(value, float) and (isinstance(value, ComputedReal) or not value.is_integer())
        if real and kind not in (INT, REAL):
            return UnknownValue(f"{quoted(name)} may be INT, and round {value:g}: its type is not among the files")
        return value


def structure(cursor: Cursor) -> tuple[str, dict[str, str]]:
    """The name and components of a structure as STRUC declares it, behind that word.

    Raises:
        InputError: it cannot be read.
    """
    name = cursor.need_name("a name")
    components: dict[str, str] = {}
    kind = ""
    while True:
        component = cursor.need_name("a type or a component")
        if cursor.token.kind == "name":
            kind, component = component, cursor.need_name("a component")
        if not kind:
            raise refuse(cursor.where, f"STRUC {quoted(name)}: a type is missing")
        if cursor.take("["):
            while not cursor.take("]"):
                if cursor.next().kind == "end":
                    raise refuse(cursor.where, "] is missing")
        components[component] = kind
        if not cursor.take(","):
            cursor.need_end()
            return name, components
