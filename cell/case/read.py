"""Case files: everything of a run in one YAML file, checked before anything is computed.

A short case works, since every section has defaults::

    case = load_case("blade.case.yaml")
    case.slicing.h_layer_mm, case.table.E1_deg, case.path_of(case.part.sub_volumes[0])

Lengths in mm and angles in degrees, as every key says. Paths are relative to the case file. Any error is one line that
names the file, the key, the value and what is allowed; a misspelt key names the nearest right one.
"""

from __future__ import annotations

from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, TypeAdapter, ValidationError

from ..errors import InputError
from ..shipped import case_path, is_path, shipped_cases
from .cell_sections import NO_TABLE
from .fields import FileName
from .files import MESHES
from .problems import excerpt, first_problem, truth_for_number
from .sections import Case
from .yaml12 import load_yaml

MOST_BYTES = 2**22  # of a case file
YAML_IN_WORDS = {
    "cannot start any token": "a tab, @, % or ` begins a word here; indent with blanks, and put such texts in quotes",
    "hexdecimal number": "a backslash in double quotes; write paths with / or in single quotes",
    "did not find expected ',' or": "a comma is missing, or a { or [ that is opened before is not closed",
    "did not find expected key": "a line is indented otherwise than those of its section, or a text needs quotes",
    "did not find expected '-' indicator": "a line of a list that does not begin with -",
    "mapping values are not allowed": "a second : in a line; put texts that have one in quotes",
    "unknown escape character": "a backslash in double quotes; write paths with / or in single quotes",
}
EXTENDS: TypeAdapter[str] = TypeAdapter(FileName)


def load_case(path: str | Path) -> Case:
    """Read and check a case file.

    Args:
        path: the YAML file, or the name of a shipped case.

    Returns:
        The case.

    Raises:
        InputError: the file is missing or no YAML, a key is unknown or a value not allowed; one line.
    """
    read: list[Path] = []
    path = case_path(path)
    if path.suffix.lower() in MESHES:
        raise InputError(f"{path}: is a mesh; a case file is needed, such as one with part: {{mesh: {path.name}}}")
    case = parse_case(_read(path, read), path)
    case._read_from = tuple(read)
    return case


def _read(path: Path, read: list[Path]) -> object:
    """A case file's content, with what it extends merged in; ``read`` gets the files that were read."""
    try:
        with path.open("rb") as file:  # no more than allowed, whatever the file is
            raw = file.read(MOST_BYTES + 1)
        if len(raw) > MOST_BYTES:
            raise InputError(f"{path}: has more than {MOST_BYTES // 2**20} MiB, the most that is read")
        text = raw.decode("utf-8")
    except FileNotFoundError:
        named = (
            "" if is_path(str(path)) else f", and no shipped case of that name; there are {', '.join(shipped_cases())}"
        )
        by = f"{read[-1]}: extends: " if read else ""
        raise InputError(f"{by}{path}: no such file{named}") from None
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise InputError(f"{path}, line {line}: not UTF-8 text; save the file as UTF-8") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    read.append(path)
    try:
        content = load_yaml(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark else ""
        problem = getattr(error, "problem", None) or str(error).split("\n")[0]
        problem = next((words for part, words in YAML_IN_WORDS.items() if part in problem), problem)
        raise InputError(f"{path}{where}: not YAML ({problem})") from None
    if not isinstance(content, dict) or "extends" not in content:
        return content
    try:
        name = EXTENDS.validate_python(content["extends"])
    except ValidationError:
        raise InputError(
            f"{path}: extends: must be the name of a case file (is {excerpt(content['extends'])})"
        ) from None
    base = path.parent / name
    if base.resolve() in [known.resolve() for known in read]:
        raise InputError(f"{path}: extends: a case file extends itself, directly or through others")
    below = _read(base, read)
    if not isinstance(below, dict):
        raise InputError(f"{base}: must be a mapping of keys to values, with at least the section part")
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
        both = both and not (key == "table" and "mode" in value)  # another mode has keys of its own
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
    rebase(part, "toolpath")
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
        raise InputError(f"{path}: must be a mapping of keys to values, with at least the section part")
    try:
        case = Case.model_validate(content)
    except ValidationError as error:
        raise InputError(f"{path}: {first_problem(error, content)}") from None
    if (problem := truth_for_number(content, case)) is not None:
        raise InputError(f"{path}: {problem}")
    case._path = path
    _check_part(case)
    return case


def _check_toolpath(case: Case) -> None:
    """Refuse what does not go with beads of another slicer."""
    part = case.part
    if part.mesh is not None or part.sub_volumes:
        raise InputError(f"{case.path}: part: give either toolpath or meshes to slice (mesh, sub_volumes)")
    if part.body is None:
        raise InputError(
            f"{case.path}: part.body: needs radius_mm or profile_mm, the body that the toolpath's beads lie on"
        )
    if part.units != "mm" and part.body.mesh is None:
        raise InputError(f"{case.path}: part.units: leave it out: a toolpath's columns are in mm")
    for key, given in (("part.take", part.take), ("part.built", part.built), ("slicing.body", case.slicing.body)):
        if given:
            raise InputError(f"{case.path}: {key}: leave it out: a toolpath is laid whole, on its body")


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
        raise InputError(f"{case.path}: {first_problem(error, made)}") from None
    changed = case.model_copy(update={name: getattr(checked, name) for name in changes})
    _check_part(changed)
    return changed


def _data(value: Any) -> Any:
    """A section as the data it is read from, so that it is checked again; other values as they are."""
    if isinstance(value, BaseModel):
        return value.model_dump(exclude_unset=True)
    if is_dataclass(value) and not isinstance(value, type):
        return asdict(value)
    return [_data(item) for item in value] if isinstance(value, list) else value


def _check_part(case: Case) -> None:
    part = case.part
    if part.absent:
        if part.mesh is not None or part.sub_volumes or part.toolpath is not None or part.body is not None:
            raise InputError(
                f"{case.path}: part.absent: leave mesh, sub_volumes, toolpath and body out: nothing is built"
            )
        return
    if part.mesh is not None and part.sub_volumes:
        raise InputError(f"{case.path}: part: give either mesh (the whole part) or sub_volumes")
    if part.toolpath is not None:
        _check_toolpath(case)
        return
    if part.mesh is not None:
        return
    if not part.sub_volumes and part.body is not None and case.slicing.body is not None:
        return  # the body alone
    if not part.sub_volumes:
        raise InputError(
            f"{case.path}: part: needs mesh (the whole part), or sub_volumes (closed meshes) and body (radius_mm)"
        )
    if part.body is None:
        raise InputError(
            f"{case.path}: part.body: needs radius_mm, the radius of the cylinder that the sub-volumes stand on"
        )
