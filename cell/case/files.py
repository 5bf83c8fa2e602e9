"""The files that a case reads: the case itself and what it extends, meshes, models and all that a model names.

    case_files(load_case("blade.case.yaml"))            # paths, each once

    require_part_files(case)                            # refuses a case that names a file that is missing

For code that must not overwrite them, and code that asks whether they have changed.
"""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote

from ..errors import InputError
from ..shipped import MODELS_DIR, is_path
from .cell_sections import NO_TABLE
from .sections import Case

if TYPE_CHECKING:
    from mujoco import MjSpec

LIBRARY = re.compile(rb"^mtllib[ \t]+(.+?)[ \t\r]*$", re.MULTILINE)
STRIPS = b"strippath"  # of a model: the folders of files that it names do not count
HEAD = 2**16  # bytes of an OBJ that name its materials
MOST_BYTES = 2**24  # of a glTF that names buffers
MESHES = (".stl", ".obj", ".ply", ".off", ".3mf", ".glb", ".gltf", ".step", ".stp")
MOST_NAMES = 10_000  # of a folder that a misspelt name is compared with


def case_files(case: Case) -> tuple[Path, ...]:
    """All files that a case reads.

    Args:
        case: the case.

    Returns:
        Paths in a fixed order, each once; some may be missing.
    """
    return tuple(dict.fromkeys([*(case.read_from or (case.path,)), *content_files(case)]))


def content_files(case: Case) -> Iterator[Path]:
    """The files beside the case files themselves: of meshes and models.

    Args:
        case: the case.

    Yields:
        Paths; some may be missing, or come twice.
    """
    for _, name in (*_files_of_part(case), *_fixture_meshes(case)):
        yield from _mesh_files(case.path_of(name))
    for _, model in _models(case):
        if is_path(model):
            yield from _model_files(case.path_of(model))
        elif (MODELS_DIR / model).is_dir():
            yield from sorted(path for path in (MODELS_DIR / model).rglob("*") if path.is_file())


def model_path(case: Case, model: str) -> Path:
    """Where a model is that a case names: its file, or the shipped model of that name."""
    return case.path_of(model) if is_path(model) else MODELS_DIR / model / f"{model}.xml"


def require_part_files(case: Case) -> None:
    """Refuse a case whose part names a file that is not there.

    Args:
        case: the case.

    Raises:
        InputError: the first such key and file, or a mesh in place of a toolpath; one line.
    """
    for key, name in _files_of_part(case):
        path = case.path_of(name)
        _require_file(case, key, path)
        if key == "part.toolpath" and path.suffix.lower() in MESHES:
            raise InputError(f"{case.path}: {key}: {path} is a mesh; part.mesh and part.sub_volumes take meshes")


def require_cell_files(case: Case) -> None:
    """Refuse a case whose cell names a model or a fixture's mesh that is not there.

    Args:
        case: the case.

    Raises:
        InputError: the first such key and file or name, or a mesh in place of a model; one line.
    """
    for key, model in _models(case):
        if is_path(model):
            path = case.path_of(model)
            _require_file(case, key, path)
            if path.suffix.lower() in MESHES:
                raise InputError(f"{case.path}: {key}: {path} is a mesh; an MJCF is needed, with the mesh in a geom")
        elif model != NO_TABLE and not model_path(case, model).is_file():
            shipped = sorted(path.parent.name for path in MODELS_DIR.glob("*/*.xml"))
            near = difflib.get_close_matches(model, shipped, n=1)
            hint = f"did you mean {near[0]}?" if near else f"shipped are {', '.join(shipped)}"
            raise InputError(f"{case.path}: {key}: {model} is neither a file nor a shipped model; {hint}")
    for key, name in _fixture_meshes(case):
        _require_file(case, key, case.path_of(name))


def _files_of_part(case: Case) -> Iterator[tuple[str, str]]:
    """Keys and names of the files of the part: meshes or a toolpath, and the body's mesh."""
    part = case.part
    yield from ((f"part.{key}", name) for key, name in (("mesh", part.mesh), ("toolpath", part.toolpath)) if name)
    yield from ((f"part.sub_volumes.{i}", name) for i, name in enumerate(part.sub_volumes))
    if part.body is not None and part.body.mesh:
        yield "part.body.mesh", part.body.mesh


def _fixture_meshes(case: Case) -> Iterator[tuple[str, str]]:
    yield from ((f"fixtures.{fixture.name}.mesh", fixture.mesh) for fixture in case.fixtures if fixture.mesh)


def _models(case: Case) -> Iterator[tuple[str, str]]:
    for what in ("robot", "tool", "positioner"):
        yield f"{what}.model", getattr(case, what).model


def _require_file(case: Case, key: str, path: Path) -> None:
    if path.is_file():
        return
    what, hint = "is not a file" if path.exists() else "no such file", ""
    if "\\" in str(path):
        hint = "; folders are separated by /"
    elif path.parent.is_dir() and not path.exists():
        there = [other.name for other in islice(path.parent.iterdir(), MOST_NAMES) if other.is_file()]
        near = difflib.get_close_matches(path.name, there, n=1, cutoff=0.7)
        hint = f"; did you mean {near[0]}?" if near else ""
    elif not path.exists():
        hint = f"; there is no folder {path.parent}"
    raise InputError(f"{case.path}: {key}: {path}: {what}{hint}")


def asset_path(file: str, spec: MjSpec, folder: Path) -> Path:
    """Where MuJoCo reads a file that a model names.

    Args:
        file: as the model names it.
        spec: the model; with its `strippath` the folders in the name do not count.
        folder: of the model's meshes, or of its textures.

    Returns:
        The whole path; the file may be missing.
    """
    return (folder / (re.split(r"[\\/]", file)[-1] if spec.strippath else file)).resolve()


def _mesh_files(path: Path) -> Iterator[Path]:
    """A mesh and the files that it names."""
    yield path
    named: list[str] = []
    try:
        if path.suffix.lower() == ".obj":
            with path.open("rb") as file:
                named = [name.decode("utf-8", "replace") for name in LIBRARY.findall(file.read(HEAD))]
        elif path.suffix.lower() == ".gltf" and path.stat().st_size <= MOST_BYTES:
            buffers = json.loads(path.read_bytes())["buffers"]
            named = [unquote(one["uri"]) for one in buffers if not one.get("uri", "data:").startswith("data:")]
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return  # reading the mesh reports what is wrong with it
    yield from (path.parent / name for name in named)


def _model_files(path: Path) -> Iterator[Path]:
    """A model and all that it names: included and attached models, meshes, textures, height fields."""
    import mujoco  # heavy: only where a case names a model of its own

    yield path
    try:
        if path.is_file():
            named = [Path(name) for name in sorted(mujoco.mju_getXMLDependencies(str(path)))]
            yield from named
            if any(STRIPS in file.read_bytes() for file in (path, *named) if file.suffix.lower() == ".xml"):
                # the files are read from elsewhere than MuJoCo says here
                spec = mujoco.MjSpec.from_file(str(path))
                for element in (*spec.meshes, *spec.hfields):
                    if element.file:
                        yield asset_path(element.file, spec, path.parent / spec.meshdir)
    except (OSError, ValueError, RuntimeError):
        return  # composing the cell reports what is wrong with it
