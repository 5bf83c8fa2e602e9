"""Case files: everything of a run in one YAML file, checked before anything is computed.

A short case works, since every section has defaults::

    case = load_case("blade.case.yaml")
    case.slicing.h_layer_mm, case.table.E1_deg, case.path_of(case.part.sub_volumes[0])

Lengths in mm and angles in degrees, as every key says. Paths are relative to the case file. Any error is one line that
names the file, the key, the value and what is allowed; a misspelt key names the nearest right one.
"""

from __future__ import annotations

import difflib
import reprlib
from pathlib import Path
from typing import Any

import yaml
from annotated_types import Ge, Le
from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from .errors import InputError
from .section import FileName
from .sections import NO_TABLE, Case
from .yaml_loader import load_yaml

MODELS_DIR = Path(__file__).resolve().parents[1] / "models"
DEFAULT_CASE = MODELS_DIR / "cases" / "propeller.case.yaml"
MOST_BYTES = 2**22  # of a case file
EXTENDS: TypeAdapter[str] = TypeAdapter(FileName)


def load_case(path: str | Path) -> Case:
    """Read and check a case file.

    Args:
        path: the YAML file.

    Returns:
        The case.

    Raises:
        InputError: the file is missing or no YAML, a key is unknown or a value not allowed; one line.
    """
    read: list[Path] = []
    case = parse_case(_read(Path(path), read), path)
    case._read_from = tuple(read)
    return case


def _read(path: Path, read: list[Path]) -> object:
    """A case file's content, with what it extends merged in; ``read`` gets the files that were read."""
    try:
        with path.open("rb") as file:  # no more than allowed, whatever the file is
            raw = file.read(MOST_BYTES + 1)
        if len(raw) > MOST_BYTES:
            raise InputError(f"{path}: has more than {MOST_BYTES // 2**20} MiB; a case file has less")
        text = raw.decode("utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: cannot be read as text ({error})") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    read.append(path)
    try:
        content = load_yaml(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or str(error).split("\n")[0]
        raise InputError(f"{path}{where}: not YAML ({problem})") from None
    if not isinstance(content, dict) or "extends" not in content:
        return content
    try:
        name = EXTENDS.validate_python(content["extends"])
    except ValidationError:
        raise InputError(f"{path}: extends: is the name of a case file (is {_short(content['extends'])})") from None
    base = path.parent / name
    if base.resolve() in [known.resolve() for known in read]:
        raise InputError(f"{path}: extends: goes round in a circle")
    below = _read(base, read)
    if not isinstance(below, dict):
        raise InputError(f"{base}: a case file is a mapping with at least the section part")
    kept = {key: value for key, value in below.items() if key not in _OWN}
    _rebase(kept, Path(name).parent)
    return _merged(kept, content)


_OWN = ("extends", "name", "description", "expect")
_WHOLE = ("roll", "expect")  # of which one form excludes the other: replaced, not merged


def _merged(base: dict[str, Any], change: dict[str, Any]) -> dict[str, Any]:
    out = dict(base)
    for key, value in change.items():
        if key == "positioner" and out.get(key) == NO_TABLE:
            out[key] = {"model": NO_TABLE}  # its short form
        both = isinstance(value, dict) and isinstance(out.get(key), dict) and key not in _WHOLE
        out[key] = _merged(out[key], value) if both else value
    return out


def _rebase(content: dict[str, Any], folder: Path) -> None:
    """Make the paths of a case that is extended relative to the one that extends it."""

    def rebase(section: object, key: str) -> None:
        if (
            isinstance(section, dict)
            and isinstance(section.get(key), str)
            and (key != "model" or is_path(section[key]))
        ):
            section[key] = str(folder / section[key])

    part = content.get("part")
    rebase(part, "mesh")
    if isinstance(part, dict):
        rebase(part.get("body"), "mesh")
        names = part.get("sub_volumes")
        if isinstance(names, list):
            part["sub_volumes"] = [str(folder / name) if isinstance(name, str) else name for name in names]
    for name in ("robot", "tool", "positioner"):
        rebase(content.get(name), "model")
    fixtures = content.get("fixtures")
    for fixture in fixtures if isinstance(fixtures, list) else ():
        rebase(fixture, "mesh")


def is_path(model: str) -> bool:
    """Whether a model is a file rather than the name of a shipped one."""
    return "/" in model or "." in model


def parse_case(content: object, path: str | Path = "case.yaml") -> Case:
    """Check a case that is already data.

    Args:
        content: what the YAML holds.
        path: the file it stands for; the case's paths are relative to it.

    Returns:
        The case.

    Raises:
        InputError: as :func:`load_case`.
    """
    path = Path(path)
    if not isinstance(content, dict):
        raise InputError(f"{path}: a case file is a mapping with at least the section part")
    try:
        case = Case.model_validate(content)
    except ValidationError as error:
        raise InputError(f"{path}: {_first_problem(error, content)}") from None
    case._path = path
    _check_part(case)
    return case


def with_changes(case: Case, **changes: Any) -> Case:
    """A case with whole sections replaced, still read from the same file.

    Args:
        case: the case.
        changes: sections by their names.

    Returns:
        The changed case.

    Raises:
        InputError: a case file with such a section would be refused; one line.
    """
    made = {name: _data(value) for name, value in changes.items()}
    try:
        checked = Case.model_validate({**dict(case), **made})
    except ValidationError as error:
        raise InputError(f"{case.path}: {_first_problem(error, made)}") from None
    changed = case.model_copy(update={name: getattr(checked, name) for name in changes})
    _check_part(changed)
    return changed


def _data(value: Any) -> Any:
    """A section as the data it is read from, so that it is checked again; other values as they are."""
    if isinstance(value, BaseModel):
        return value.model_dump(exclude_unset=True)
    return [_data(item) for item in value] if isinstance(value, list) else value


def _check_part(case: Case) -> None:
    part = case.part
    if part.mesh is not None and part.sub_volumes:
        raise InputError(f"{case.path}: part: give mesh (the whole part) or sub_volumes, not both")
    if part.mesh is not None:
        return
    if not part.sub_volumes and part.body is not None and case.slicing.body is not None:
        return  # the body alone
    if not part.sub_volumes:
        raise InputError(
            f"{case.path}: part: needs mesh (the whole part), or sub_volumes (closed meshes) and body (radius_mm)"
        )
    if part.body is None:
        raise InputError(f"{case.path}: part.body: needs radius_mm, the radius of the cylinder they stand on")


def _first_problem(error: ValidationError, content: dict[str, Any]) -> str:
    problems = error.errors(include_url=False)
    # of a union pydantic lists every branch; a misspelt key is the most telling of them
    telling = ("extra_forbidden", "value_error", "greater_than_equal", "less_than_equal")
    problem = next((p for kind in telling for p in problems if p["type"] == kind), problems[0])
    where = _keys_of(problem["loc"], content, problem["type"] == "missing")
    key = ".".join(where)
    if problem["type"] == "extra_forbidden":
        known = _keys_at(where[:-1])
        near = difflib.get_close_matches(where[-1], known, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
        return f"{key}: unknown key; {hint}"
    if problem["type"] == "missing" and not isinstance(problem["input"], list):
        return f"{key}: missing"
    value = problem["input"]
    message = _IN_WORDS.get(problem["type"], problem["msg"].removeprefix("Value error, "))
    if problem["type"] in ("greater_than_equal", "less_than_equal"):
        message = _range_in_words(where, problem["ctx"]) or message
    if key == "roll" and problem["type"] == "literal_error":
        message = "is free, or {fixed_deg: ..}, or {range_deg: [low, high]}"
    shown = "" if isinstance(value, dict) and value == content else f" (is {_short(value)})"
    return f"{key}: {message[:1].lower() + message[1:]}{shown}"


_IN_WORDS = {
    "missing": "has too few values",
    "string_too_short": "is a name of at least one character",
    "string_too_long": "is a shorter name",
    "int_from_float": "is a whole number",
    "int_parsing": "is a whole number",
    "int_parsing_size": "is a whole number of fewer digits",
    "int_type": "is a whole number",
    "too_long": "has too many values",
    "too_short": "has too few values",
    "model_type": "is a section of keys and values",
    "list_type": "is a list",
    "tuple_type": "is a list of numbers",
    "float_parsing": "is a number",
    "float_type": "is a number",
    "finite_number": "is a finite number",
    "string_type": "is a text",
    "bool_parsing": "is true or false",
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


def _short(value: object) -> str:
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
    field = None if section is None else section.model_fields.get(name)
    found = [] if field is None else _ranges([field.metadata, field.annotation])
    mine = next((pair for pair in found if pair[0] == limit.get("ge") or pair[1] == limit.get("le")), None)
    return None if mine is None else f"is {mine[0]:g} to {mine[1]:g}"


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
        field = None if section is None else section.model_fields.get(name)
        section = None if field is None else _section_of(field.annotation)
    return section


def _keys_at(where: list[str]) -> list[str]:
    """Keys allowed at a place of a case file."""
    section = _section_at(where)
    return [] if section is None else list(section.model_fields)


def _section_of(annotation: Any) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for inner in getattr(annotation, "__args__", ()):
        found = _section_of(inner)
        if found is not None:
            return found
    return None
