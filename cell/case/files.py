"""The files that a case reads: the case itself and what it extends, meshes, models and all that a model names.

    case_files(load_case("blade.case.yaml"))            # paths, each once

For code that must not overwrite them, and code that asks whether they have changed.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

from ..shipped import MODELS_DIR, is_path
from .sections import Case

LIBRARY = re.compile(rb"^mtllib[ \t]+(.+?)[ \t\r]*$", re.MULTILINE)
STRIPS = b"strippath"  # of a model: the folders of files that it names do not count
HEAD = 2**16  # bytes of an OBJ that name its materials
MOST_BYTES = 2**24  # of a glTF that names buffers


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
    body = case.part.body.mesh if case.part.body else None
    for name in (case.part.mesh, case.part.toolpath, *case.part.sub_volumes, body, *(f.mesh for f in case.fixtures)):
        if name:
            yield from _mesh_files(case.path_of(name))
    for model in (case.robot.model, case.tool.model, case.positioner.model):
        if is_path(model):
            yield from _model_files(case.path_of(model))
        elif (MODELS_DIR / model).is_dir():
            yield from sorted(path for path in (MODELS_DIR / model).rglob("*") if path.is_file())


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
                        yield path.parent / spec.meshdir / Path(element.file).name
    except (OSError, ValueError, RuntimeError):
        return  # composing the cell reports what is wrong with it
