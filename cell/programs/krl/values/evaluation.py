"""What expressions of KRL come to: numbers, truths, texts, structures, frames.

Use:

    evaluate(expression, scope)               # 3.0, True, "#BASE", {"X": 1.0, ..}, CoupledFrame(..)

Words of enumerations are texts with their sign (``#BASE``), structures are mappings by their components. What depends
on inputs or on what is not among the files is ``UnknownValue``: it may be assigned and passed on, and is refused where
it would move the arm. Nothing of Python's own evaluation is used.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ik.chain import Floats

from ....rigid import inverse
from ...orientation import frames_of_poses, pose_of
from ...program import SourceLine
from ..expressions import Aggregate, Binary, Component, Constant, Element, Expression, FunctionCall, Unary, Variable
from ..lexing import quoted, refuse
from .number_kinds import (
    LARGEST_INTEGER,
    ComputedReal,
    MaybeInteger,
    TiedAngle,
    TurnAngle,
    calculated,
    compares_alike,
    direction,
    function_value,
    is_real,
    rounds_alike,
)

CARTESIAN = ("X", "Y", "Z", "A", "B", "C")
LARGEST = 3.4e38  # of the language's numbers


@dataclass(frozen=True, slots=True)
class UnknownValue:
    """A value that is not known here, and why."""

    why: str


class ListedFrame(dict[str, Any]):
    """A frame of the controller's lists, which remembers its number.

    Attributes:
        place: TOOL_DATA or BASE_DATA.
        number: in it; 0 is the null frame.
    """

    def __init__(self, frame: Mapping[str, Any], place: str, number: int) -> None:
        super().__init__(frame)
        self.place, self.number = place, number


@dataclass(frozen=True, eq=False, slots=True)
class CoupledFrame:
    """A frame that an external kinematic carries: what EK gives.

    Attributes:
        T: (4, 4), m, in the flange of the kinematic.
        machine: its index in MACHINE_DEF.
        root: (4, 4), m, of the kinematic in the world; None where it is not known.
        number: in BASE_DATA, None where it is given literally.
    """

    T: Floats
    machine: int
    root: Floats | None
    number: int | None = None


@dataclass(frozen=True, slots=True)
class MachineReference:
    """An entry of MACHINE_DEF, or its ROOT or MECH_TYPE."""

    machine: int
    component: str = ""


class Scope(Protocol):
    """What evaluation asks for."""

    where: SourceLine

    def variable(self, name: str) -> Any:
        """The value of a variable."""

    def function(self, name: str, arguments: tuple[Expression | None, ...]) -> Any:
        """The value of a function that is not built in."""


def evaluate(of: Expression, scope: Scope) -> Any:
    """The value of an expression.

    Raises:
        InputError: it has none.
    """
    if isinstance(of, Constant):
        return of.value
    if isinstance(of, Variable):
        return scope.variable(of.name)
    if isinstance(of, Unary):
        return _unary(of.operator, evaluate(of.of, scope), scope)
    if isinstance(of, Binary):
        return _binary(of.operator, evaluate(of.left, scope), evaluate(of.right, scope), scope)
    if isinstance(of, Aggregate):
        return {name: evaluate(item, scope) for name, item in of.items}
    if isinstance(of, Component):
        return component(evaluate(of.of, scope), of.name, scope)
    if isinstance(of, Element):
        indices = tuple(integer(evaluate(index, scope), scope) for index in of.indices)
        return element(evaluate(of.of, scope), indices, scope)
    return _call(of, scope)


def component(value: Any, name: str, scope: Scope) -> Any:
    """A component of a structure."""
    if isinstance(value, UnknownValue):
        return value
    if isinstance(value, MachineReference):
        return MachineReference(value.machine, name)
    if not isinstance(value, dict):
        raise refuse(scope.where, f".{name} is a component of a structure, not of {shown(value)}")
    return value[name] if name in value else UnknownValue(f"component {name} has no value")


def element(value: Any, indices: tuple[int, ...], scope: Scope) -> Any:
    """An element of an array; an array is a mapping by its indices, or a function of them."""
    if isinstance(value, UnknownValue) or not indices:
        return value
    if callable(value):
        return value(indices)
    if not isinstance(value, dict):
        raise refuse(scope.where, f"[..] is an element of an array, not of {shown(value)}")
    return value[indices] if indices in value else UnknownValue(f"element {list(indices)} has no value")


class FloatingValue(UnknownValue):
    """The value of a variable that something sets at a time that is not known: it stays so whatever is assigned."""


class ImportedValue(UnknownValue):
    """The value of a variable that belongs to another file (IMPORT)."""


def number(value: Any, scope: Scope, *, angle: bool = False) -> float:
    """A value as a number.

    Args:
        value: the value.
        scope: for messages.
        angle: whether what it is needed for is the same after whole turns.

    Raises:
        InputError: it is none, or not known.
    """
    if isinstance(value, UnknownValue):
        raise refuse(scope.where, f"depends on an unknown value: {value.why}")
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise refuse(scope.where, f"needs a number, not {shown(value)}")
    if not abs(value) <= LARGEST:
        raise refuse(scope.where, f"comes to {value:g}, which is not a number of KRL")
    if isinstance(value, int) and abs(value) > LARGEST_INTEGER:
        raise refuse(scope.where, f"comes to {value}, which is beyond INT")
    if isinstance(value, TurnAngle) and not angle:
        raise refuse(
            scope.where, f"depends on an angle of ATAN2 that may be {value % 360 - 360:g} or {value % 360:g} degrees"
        )
    if isinstance(value, TiedAngle):
        raise refuse(scope.where, TIED)
    return value


TIED = "takes one of A B C alone where they were read, and the controller may have read others for the same orientation"


def angles(frame: Mapping[str, Any], scope: Scope) -> dict[str, float]:
    """A B C of a frame or point, degrees, as many as it has: read from the controller all three, or none of them.

    Raises:
        InputError: one of them alone was read where others stand for the same orientation; or as :func:`number`.
    """
    given = {name: frame[name] for name in "ABC" if name in frame}
    if len(given) == 3 and all(isinstance(value, TiedAngle) for value in given.values()):
        return {name: float(value) for name, value in given.items()}
    return {name: number(value, scope, angle=True) for name, value in given.items()}


def integer(value: Any, scope: Scope) -> int:
    """A value as a whole number.

    Raises:
        InputError: it is none, or not known.
    """
    found = number(value, scope)
    if abs(found) > LARGEST_INTEGER:
        raise refuse(scope.where, f"comes to {found:g}, which is not a whole number of KRL")
    if not rounds_alike(found):
        raise refuse(scope.where, f"rounds {found:g}, which the controller's seven digits may round otherwise")
    if found < 0 and found % 1 == 0.5:
        raise refuse(scope.where, f"rounds {found:g}, and it is not known whether up or down")
    return math.floor(found + 0.5)


def truth(value: Any, scope: Scope) -> bool:
    """A value as true or false.

    Raises:
        InputError: it is none, or not known.
    """
    if isinstance(value, UnknownValue):
        raise refuse(scope.where, f"depends on an unknown value: {value.why}")
    if not isinstance(value, bool):
        raise refuse(scope.where, f"needs true or false, not {shown(value)}")
    return value


def shown(value: Any) -> str:
    """A value as messages name it."""
    if isinstance(value, UnknownValue):
        return f"an unknown value ({value.why})"
    if isinstance(value, CoupledFrame):
        return "a frame on an external kinematic"
    if isinstance(value, dict):
        return "a structure" if len(value) > 8 else quoted("{" + ", ".join(map(str, value)) + "}")
    if isinstance(value, (bool, int, float, str)):
        return quoted(str(value))
    return "a function" if callable(value) else "a machine"


def matrix(value: Any, scope: Scope) -> Floats:
    """A frame as a matrix.

    Returns:
        (4, 4), m.

    Raises:
        InputError: it is no frame, or a component has no value.
    """
    if isinstance(value, UnknownValue):
        raise refuse(scope.where, f"depends on an unknown frame: {value.why}")
    if not isinstance(value, dict):
        raise refuse(scope.where, f"needs a frame with X Y Z A B C, not {shown(value)}")
    missing = next((name for name in CARTESIAN if name not in value), None)
    if missing is not None:
        raise refuse(scope.where, f"a frame needs X Y Z A B C; {missing} has no value")
    numbers = [*(number(value[name], scope) for name in "XYZ"), *angles(value, scope).values()]
    return frames_of_poses(np.array([*(1e-3 * x for x in numbers[:3]), *map(math.radians, numbers[3:])]))


def frame_dict(T: Floats) -> dict[str, float]:
    """A matrix (4, 4), m, as a frame in mm and degrees."""
    pose = pose_of(T)
    values = [*(1e3 * pose[:3]), *np.degrees(pose[3:])]
    return dict(zip(CARTESIAN, map(float, values), strict=True))


NEAR_DEG = 0.01  # of B from 90 degrees, and of A and C from 180, where other A B C are as good
READ_MM, READ_DEG = 0.05, 0.01  # by which the controller may have a position otherwise than it was commanded


def frame_as_read(T: Floats) -> dict[str, float]:
    """A matrix (4, 4), m, as the controller gives a position or the result of a computation, in mm and degrees."""
    frame = frame_dict(T)
    tied = is_tied([frame[name] for name in "ABC"])
    return {
        name: ComputedReal(value, READ_MM)
        if name in "XYZ"
        else (TiedAngle(value) if tied else ComputedReal(value, READ_DEG))
        for name, value in frame.items()
    }


def is_tied(angles_deg: Sequence[float] | Floats) -> bool:
    """Whether A B C (3,), degrees, are not the only ones for their orientation, or nearly so."""
    a, b, c = (abs(float(angle)) for angle in angles_deg)
    return b > 90 - NEAR_DEG or max(a, c) > 180 - NEAR_DEG


def _unary(operator: str, value: Any, scope: Scope) -> Any:
    if isinstance(value, UnknownValue):
        return value
    if operator == "NOT":
        return not truth(value, scope)
    if operator == "B_NOT":
        return ~integer(value, scope)
    found = number(value, scope, angle=True)
    if operator != "-":
        return found
    if isinstance(found, ComputedReal):
        return ComputedReal(-found, found.deviation)
    return type(found)(-found) if isinstance(found, (MaybeInteger, TurnAngle)) else -found


_COMPARED: dict[str, Callable[[Any, Any], bool]] = {
    "==": lambda a, b: a == b,
    "<>": lambda a, b: a != b,
    "<": lambda a, b: a < b,
    ">": lambda a, b: a > b,
    "<=": lambda a, b: a <= b,
    ">=": lambda a, b: a >= b,
}
_BITS: dict[str, Callable[[int, int], int]] = {
    "B_AND": lambda a, b: a & b,
    "B_OR": lambda a, b: a | b,
    "B_EXOR": lambda a, b: a ^ b,
}
_TRUTHS: dict[str, Callable[[bool, bool], bool]] = {
    "AND": lambda a, b: a and b,
    "OR": lambda a, b: a or b,
    "EXOR": lambda a, b: a != b,
}


def _binary(operator: str, a: Any, b: Any, scope: Scope) -> Any:
    for value in (a, b):
        if isinstance(value, UnknownValue):
            return value
    if operator == ":":
        return _geometric(a, b, scope)
    if operator in _TRUTHS:
        return _TRUTHS[operator](truth(a, scope), truth(b, scope))
    if operator in _BITS:
        return _BITS[operator](integer(a, scope), integer(b, scope))
    if operator in ("==", "<>") and isinstance(a, (bool, str)) and type(a) is type(b):
        return _COMPARED[operator](a, b)
    x, y = (number(value, scope, angle=operator in ("+", "-")) for value in (a, b))
    if operator in _COMPARED:
        if x is not y and not compares_alike(x, y):
            raise refuse(scope.where, f"compares {x:g} with {y:g}, closer than the seven digits of the controller tell")
        return _COMPARED[operator](x, y)
    return number(_arithmetic(operator, x, y, scope), scope)


def _arithmetic(operator: str, x: float, y: float, scope: Scope) -> float:
    if isinstance(x, TurnAngle) or isinstance(y, TurnAngle):
        return TurnAngle(x + y if operator == "+" else x - y)
    if operator == "/" and y == 0:
        raise refuse(scope.where, "divides by 0")
    if (isinstance(x, MaybeInteger) and not is_real(y)) or (isinstance(y, MaybeInteger) and not is_real(x)):
        found = _arithmetic(operator, int(x), int(y), scope)
        if operator == "/" and found != x / y:
            raise refuse(
                scope.where,
                f"divides {x:g} by {y:g}, which may both be INT: the STRUC of one is not among the files",
            )
        return MaybeInteger(found)
    if not (isinstance(x, int) and isinstance(y, int)):
        return calculated(operator, x, y)
    if operator == "/":
        return math.trunc(x / y)
    return x + y if operator == "+" else x - y if operator == "-" else x * y


def _geometric(a: Any, b: Any, scope: Scope) -> Any:
    """A frame in a frame; the result has what else the second has: S, T, external axes."""
    if isinstance(a, CoupledFrame):
        return UnknownValue("a frame on an external kinematic, with another put into it")
    result: dict[str, Any] = frame_as_read(matrix(a, scope) @ matrix(b, scope))
    return result | {name: value for name, value in b.items() if name not in CARTESIAN}


_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "ABS": abs,
    "SQRT": lambda x: math.sqrt(x) if x >= 0 else math.nan,
    "SIN": lambda x: math.sin(math.radians(x)),
    "COS": lambda x: math.cos(math.radians(x)),
    "TAN": lambda x: math.tan(math.radians(x)),
    "ACOS": lambda x: math.degrees(math.acos(x)) if abs(x) <= 1 else math.nan,
}
_OF_ANGLES = ("SIN", "COS", "TAN")
BUILT_IN = frozenset((*_FUNCTIONS, "ATAN2", "INV_POS"))  # functions whose values are worked out here


def _call(of: FunctionCall, scope: Scope) -> Any:
    function = _FUNCTIONS.get(of.name)
    if of.name not in BUILT_IN:
        return scope.function(of.name, of.arguments)
    values = [evaluate(argument, scope) for argument in of.arguments if argument is not None]
    if len(values) != (2 if of.name == "ATAN2" else 1):
        raise refuse(scope.where, f"{of.name} is given {len(values)} values")
    unknown = next((value for value in values if isinstance(value, UnknownValue)), None)
    if unknown is not None:
        return unknown
    if of.name == "INV_POS":
        return frame_as_read(inverse(matrix(values[0], scope)))
    if function is None:
        y, x = (number(value, scope) for value in values)
        return direction(y, x)
    given = number(values[0], scope, angle=of.name in _OF_ANGLES)
    return number(function_value(function, given, rounds_rightly=of.name in ("ABS", "SQRT")), scope)
