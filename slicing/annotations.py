"""What the annotations of a dataclass say of its fields: the range, the choices, and the meaning in words.

    width_mm: Annotated[float, Ge(0.05), Le(1000), Meaning("of a bead")] = 5.0

A case file is checked by the same annotations.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Hashable
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin, get_type_hints

from annotated_types import Ge, Le

from .errors import PartError

T = TypeVar("T")


@dataclass(frozen=True)
class Meaning:
    """What a parameter is, in words, as part of its annotation."""

    text: str


def documented(cls: type[T]) -> type[T]:
    """Add what the parameters of a class mean to its docstring."""
    of: Any = cls
    lines = [f"    {name}: {meaning_of(hint)}." for name, hint in _hints(of).items()]
    cls.__doc__ = "\n".join([cls.__doc__ or "", "", "Attributes:", *lines])
    return cls


def meaning_of(annotation: Any) -> str:
    """What a parameter is, in words; empty where its annotation does not say."""
    return next((one.text for one in getattr(annotation, "__metadata__", ()) if isinstance(one, Meaning)), "")


def require_allowed(parameters: Any) -> None:
    """Refuse values that are out of their range, or not among those that are named.

    Args:
        parameters: an instance of a dataclass whose annotations say what is allowed.

    Raises:
        PartError: one line that names the parameter, its value and what is allowed.
    """
    of: Any = type(parameters)
    for name, hint in _hints(of).items():
        _require(name, getattr(parameters, name), hint)


@cache
def _hints(cls: Hashable) -> dict[str, Any]:
    of: Any = cls
    hints = get_type_hints(of, include_extras=True)
    return {field.name: hints[field.name] for field in dataclasses.fields(of)}


def _require(name: str, value: Any, hint: Any) -> None:
    if get_origin(hint) is Annotated:
        kind, *of = get_args(hint)
        low: Any = next((one.ge for one in of if isinstance(one, Ge)), None)
        high: Any = next((one.le for one in of if isinstance(one, Le)), None)
        if low is not None and high is not None:
            if not (isinstance(value, int | float) and math.isfinite(value) and low <= value <= high):
                raise PartError(f"{name}: {value} is not allowed; a number from {low:g} to {high:g} is needed")
            return
        _require(name, value, kind)
    elif get_origin(hint) is Literal:
        if value not in get_args(hint):
            raise PartError(f"{name}: {value!r} unknown; allowed: {', '.join(map(str, get_args(hint)))}")
    elif type(None) in (kinds := get_args(hint)):
        if value is not None:
            _require(name, value, next(kind for kind in kinds if kind is not type(None)))
    elif get_origin(hint) is tuple and Ellipsis not in kinds:
        if not isinstance(value, tuple | list) or len(value) != len(kinds):
            raise PartError(f"{name}: {value!r} is not allowed; {len(kinds)} numbers are needed")
        for one, kind in zip(value, kinds, strict=True):
            _require(name, one, kind)
