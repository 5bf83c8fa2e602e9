"""What is wrong with a case file, in one line that names the key and what is allowed.

Use:

    first_problem(error, content)             # "slicing.h_layer: unknown key; did you mean h_layer_mm?"
"""

from __future__ import annotations

import difflib
import re
import reprlib
from typing import Any, get_origin

from annotated_types import Ge, Le
from pydantic import ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from .fields import is_section, keys_of
from .sections import Case

NUMBER_WITH_UNIT = re.compile(r"(?P<number>[+-]?\d+([.,]\d+)?)\s*(?P<unit>[a-zA-Z°\"/²]*)")
UNKNOWN = ("extra_forbidden", "unexpected_keyword_argument")


def first_problem(error: ValidationError, content: dict[str, Any]) -> str:
    """The most helpful of several problems, with its key, the value and what is allowed."""
    problems = error.errors(include_url=False)
    # of a union pydantic lists every branch; a misspelt key is the most telling of them
    telling = (*UNKNOWN, "value_error", "greater_than_equal", "less_than_equal")
    problem = next((p for kind in telling for p in problems if p["type"] == kind), problems[0])
    where = _keys_of(problem["loc"], content, problem["type"] == "missing")
    key = ".".join(where)
    if problem["type"] in UNKNOWN:
        known = _keys_at(where[:-1])
        if deeper := _within(_section_at(where[:-1]), where[-1]) or _of_torch(where, known):
            return f"{key}: unknown key; did you mean {'.'.join([*where[:-1], *deeper])}?"
        if ":" in where[-1]:
            return f"{key}: unknown key; a blank is needed after the colon"
        near = difflib.get_close_matches(where[-1], known, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
        return f"{key}: unknown key; {hint}"
    if problem["type"] == "missing" and not isinstance(problem["input"], list):
        return f"{key}: missing"
    value = problem["input"]
    message = _IN_WORDS.get(problem["type"], problem["msg"].removeprefix("Value error, "))
    message = message.replace("Input should be", "must be")
    if problem["type"] in ("greater_than_equal", "less_than_equal"):
        message = _range_in_words(where, problem["ctx"]) or message
    if key == "roll" and problem["type"] == "literal_error":
        message = "must be free, {fixed_deg: -60} or {range_deg: [-90, 90]}, with angles of your own"
    # a rule of several keys says their values itself
    says_values = isinstance(value, dict) and (value == content or problem["type"] == "value_error")
    shown = "" if says_values else f" (is {excerpt(value)})"
    return f"{key}: {message[:1].lower() + message[1:]}{_plain_number(problem)}{shown}"


def truth_for_number(content: object, made: object, keys: tuple[str, ...] = ()) -> str | None:
    """Where true or false stands for a number: pydantic takes them for 1 and 0.

    Args:
        content: of a case, as it was given.
        made: the section, list or value that was made of it.
        keys: where it stands.

    Returns:
        The key and what is wrong; None where nothing is.
    """
    if isinstance(content, bool):
        is_number = isinstance(made, (int, float)) and not isinstance(made, bool)
        return f"{'.'.join(keys)}: must be a number (is {str(content).lower()})" if is_number else None
    inner: list[tuple[object, object, object]] = []
    if isinstance(content, dict):
        held = {str(key): value for key, value in made.items()} if isinstance(made, dict) else None
        for key, value in content.items():
            inner.append((key, value, held.get(str(key)) if held is not None else getattr(made, str(key), None)))
    elif isinstance(content, list) and isinstance(made, (list, tuple)) and len(content) == len(made):
        inner = list(zip(range(len(content)), content, made, strict=True))
    found = (truth_for_number(value, of_it, (*keys, str(key))) for key, value, of_it in inner)
    return next((problem for problem in found if problem is not None), None)


def _plain_number(problem: ErrorDetails) -> str:
    """How to write what was meant for a number: 2,5 and 25mm are texts."""
    if problem["type"] != "float_parsing":
        return ""
    number = NUMBER_WITH_UNIT.fullmatch(str(problem["input"]).strip())
    if number is None:
        return ""
    unit = "" if not number["unit"] else " without the unit"
    return f": write {number['number'].replace(',', '.')}{unit}"


_IN_WORDS = {
    "missing": "has too few values",
    "string_too_short": "must be a name of at least one character",
    "string_too_long": "must be a shorter name",
    "int_from_float": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_parsing_size": "must be a whole number of fewer digits",
    "int_type": "must be a whole number",
    "too_long": "has too many values",
    "too_short": "has too few values",
    "model_type": "must be a section of keys and values",
    "dataclass_type": "must be a section of keys and values",
    "list_type": "must be a list",
    "dict_type": "must be a mapping of keys to values",
    "tuple_type": "must be a list of numbers",
    "float_parsing": "must be a number",
    "float_type": "must be a number",
    "finite_number": "must be a finite number",
    "string_type": "must be a text",
    "bool_parsing": "must be true or false",
    "invalid_key": "a key must be a name; of a number with a decimal comma the rest is read so: write 1.5, not 1,5",
}


def _keys_of(location: tuple[int | str, ...], content: object, missing: bool) -> list[str]:
    """The keys of a location that stand in the file; pydantic mixes in the names of union branches."""
    keys: list[str] = []
    here = content
    for i, item in enumerate(location):
        if isinstance(here, list) and isinstance(item, int):
            if item >= len(here):
                break  # a value that is not there: the list is what is wrong
            here = here[item]
        elif isinstance(here, dict) and item in here:
            here = here[item]
        elif not missing or i < len(location) - 1:
            continue
        keys.append(str(item))
    return keys


def excerpt(value: object) -> str:
    """A value in some sixty characters; of a large one only its beginning is written at all."""
    text = _Short().repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


class _Short(reprlib.Repr):
    """Few items, few levels, and texts as long as a line."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxlist, self.maxdict, self.maxtuple = 3, 12, 12, 12
        self.maxstring, self.maxother, self.maxlong = 80, 80, 60


def _range_in_words(where: list[str], limit: dict[str, float]) -> str | None:
    """What a number at a place of a case file has to lie within, given the end of it that was passed."""
    *sections, name = [key for key in where if not key.isdigit()]
    section = _section_at(sections)
    field = None if section is None else keys_of(section).get(name)
    found = [] if field is None else _ranges([field.metadata, field.annotation])
    mine = next((pair for pair in found if pair[0] == limit.get("ge") or pair[1] == limit.get("le")), None)
    return None if mine is None else f"must be {mine[0]:g} to {mine[1]:g}"


def _ranges(of: Any) -> list[tuple[float, float]]:
    """All ranges that an annotation, or a list of such, holds."""
    if isinstance(of, (list, tuple)):
        low = next((one.ge for one in of if isinstance(one, Ge)), None)
        high = next((one.le for one in of if isinstance(one, Le)), None)
        here = [] if low is None or high is None else [(float(str(low)), float(str(high)))]
        return here + [pair for one in of for pair in _ranges(one)]
    if isinstance(of, FieldInfo):
        return _ranges(of.metadata)
    inner = (*getattr(of, "__metadata__", ()), *getattr(of, "__args__", ()))
    return _ranges(inner) if inner else []


def _section_at(where: list[str]) -> Any:
    """The section at a place of a case file; None where there is none."""
    section: Any = Case
    for name in where:
        if name.isdigit():
            continue
        field = None if section is None else keys_of(section).get(name)
        section = None if field is None else section_of(field.annotation)
    return section


def _keys_at(where: list[str]) -> list[str]:
    """Keys allowed at a place of a case file."""
    section = _section_at(where)
    return [] if section is None else list(keys_of(section))


def _of_torch(where: list[str], known: list[str]) -> list[str]:
    """Where a measure that stands in the section ``tool`` itself belongs; empty where it is no such, or misspelt."""
    *sections, name = where
    measure = sections == ["tool"] and name.endswith(("_mm", "_deg"))
    return ["dimensions", name] if measure and not difflib.get_close_matches(name, known, cutoff=0.7) else []


def _within(section: Any, name: str) -> list[str]:
    """Where below a section a key of this name stands, the shortest way there; empty where none does."""
    found: list[list[str]] = []
    for key, field in ({} if section is None else keys_of(section)).items():
        below = None if get_origin(field.annotation) in (list, tuple, dict) else section_of(field.annotation)
        if below is None:
            continue
        deeper = [name] if name in keys_of(below) else _within(below, name)
        found += [[key, *deeper]] if deeper else []
    return min(found, key=len, default=[])


def section_of(annotation: Any) -> Any:
    """The section class that an annotation names; None where it names none."""
    if is_section(annotation):
        return annotation
    for inner in getattr(annotation, "__args__", ()):
        found = section_of(inner)
        if found is not None:
            return found
    return None
