"""Reading solids from files: the only module of the package that touches any.

    mesh = load_mesh("blade.stl", units="mm")
    mesh.volume, mesh.bounds, mesh.warnings

What is wrong with a file is said in one line (`PartError`). Each shell of what it holds is looked at by itself.
"""

from __future__ import annotations

import re
import struct
import zipfile
import zlib
from collections.abc import Iterable
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import numpy.typing as npt

from slicing.file_bounds import require_bounded
from slicing.part import UNITS_MM, Floats, Ints, Mesh, PartError, mesh_from_arrays, noise_of, require_near, require_size
from slicing.repair_shells import one_solid

# what a kind of file needs beyond trimesh itself
READERS = {".3mf": ("networkx", "lxml")}
# how a 3MF names the units that are allowed here
STATED_UNITS = {"millimeter": "mm", "centimeter": "cm", "meter": "m", "inch": "inch"}
# what trimesh's readers raise on damaged files (each format its own)
READ_ERRORS = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    BufferError,
    EOFError,
    ImportError,
    LookupError,
    MemoryError,
    OSError,
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)


def solid_from_arrays(
    name: str, vertices: npt.ArrayLike, faces: npt.ArrayLike, noise_mm: float | None = None, units: str = "mm"
) -> Mesh:
    """A mesh of arrays as `slicing.part.mesh_from_arrays` makes it, but each of its shells looked at by itself.

    Args:
        name: what messages call it.
        vertices: (n, 3) positions in the part frame, mm.
        faces: (m, 3) vertex indices.
        noise_mm: rounding of the coordinates, mm; found from the numbers when not given.
        units: what a length of 1 was before it was mm; for the line about an unlikely size.

    Returns:
        The mesh of one solid.

    Raises:
        PartError: what `mesh_from_arrays` refuses, faces that cross, or shells of which it cannot be told what is
            solid.
    """
    return one_solid(mesh_from_arrays(name, vertices, faces, noise_mm, units, outward=False))


def load_mesh(path: str | Path, units: str = "mm", name: str | None = None) -> Mesh:
    """Read one solid from a file: STL, OBJ, PLY, OFF, GLB and, with networkx and lxml installed, 3MF.

    The meshes of a scene (GLB, 3MF) are put where it says and taken together; together they must be closed.

    Args:
        path: the file.
        units: what a length of 1 in the file means: mm, cm, m or inch.
        name: what messages and documents call it; the file's stem when not given.

    Returns:
        The mesh in mm, duplicate vertices merged.

    Raises:
        PartError: an unknown unit or another than the file states (3MF), a missing or unreadable file, a kind of
            file that needs a package which is not installed, or a mesh that `mesh_from_arrays` refuses.
    """
    file = Path(path)
    if units not in UNITS_MM:
        raise PartError(f"{file}: units {units!r} unknown; allowed: {', '.join(UNITS_MM)}")
    if not file.is_file():
        raise PartError(f"{file}: {'not a file' if file.exists() else 'no such file'}")
    vertices, faces = _read(file, units)
    require_near(str(file), vertices * UNITS_MM[units])
    vertices, faces = _merge_duplicates(vertices, faces)
    scale = UNITS_MM[units]
    noise = max(noise_of(vertices) * scale, 1e-9)
    mesh = solid_from_arrays(str(file), vertices * scale, faces, noise, units)
    return replace(mesh, name=name or file.stem)


def _require_reader(file: Path, kinds: Iterable[str]) -> None:
    """Refuse a kind of file that trimesh does not read, or not without other packages."""
    kind = file.suffix.lower()
    if kind.lstrip(".") in kinds:
        return
    missing = [package for package in READERS.get(kind, ()) if find_spec(package) is None]
    if missing:
        raise PartError(
            f"{file}: reading {kind} needs {' and '.join(missing)}, not installed: pip install {' '.join(missing)}"
        )
    raise PartError(f"{file}: unknown kind of mesh file {file.suffix!r}; allowed: .stl, .obj, .ply, .off, .3mf, .glb")


def _require_unit(file: Path, stated: str | None, units: str) -> None:
    """Refuse a unit that contradicts the file (a 3MF states its own; GLB's metres are hardly ever meant)."""
    if file.suffix.lower() != ".3mf" or stated is None:
        return
    said = STATED_UNITS.get(stated.removesuffix("s"))
    if said != units:
        allowed = f"say units: {said}" if said else f"allowed: {', '.join(UNITS_MM)}"
        raise PartError(f"{file}: the file's unit is {stated}, but units: {units} was given; {allowed}")


def _read(file: Path, units: str) -> tuple[Floats, Ints]:
    """Vertices and faces of the file as they stand, all its solids together."""
    import trimesh  # heavy: only when a file is read

    if file.stat().st_size == 0:
        raise PartError(f"{file}: the file is empty")
    _require_reader(file, trimesh.available_formats())
    require_bounded(file)
    require_size(str(file), _stated_faces(file))
    try:
        loaded = trimesh.load(str(file), process=False, force="mesh")
    except READ_ERRORS as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        if isinstance(error, ImportError):  # trimesh asks for a guesser of encodings
            reason = "its text is not UTF-8"
        raise PartError(f"{file}: not readable as a {file.suffix.lstrip('.').upper()} mesh ({reason[:120]})") from None
    _require_unit(file, getattr(loaded, "units", None), units)
    vertices = np.asarray(getattr(loaded, "vertices", np.zeros((0, 3))), dtype=np.float64)
    faces = np.asarray(getattr(loaded, "faces", np.zeros((0, 3))), dtype=np.int64)
    if len(faces) == 0:
        raise PartError(f"{file}: no triangles in the file; a closed solid is needed")
    return vertices, faces


def _stated_faces(file: Path) -> int:
    """How many faces a file says that it holds before it is read, where it does (binary STL, PLY); else 0."""
    with file.open("rb") as stream:
        head = stream.read(4096)
    if file.suffix.lower() == ".stl" and len(head) >= 84:
        count = struct.unpack("<I", head[80:84])[0]
        return int(count) if file.stat().st_size == 84 + 50 * count else 0
    if file.suffix.lower() == ".ply":
        found = re.search(rb"element face (\d+)", head.split(b"end_header")[0])
        return int(found[1]) if found else 0
    return 0


def _merge_duplicates(vertices: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Give vertices at the same place one number (STL repeats every vertex in every face)."""
    rounded = np.round(vertices / max(1e-9, 1e-9 * float(np.abs(vertices[np.isfinite(vertices)]).max(initial=0.0))))
    order = np.lexsort(rounded.T)
    new = np.ones(len(order), dtype=bool)
    new[1:] = (rounded[order[1:]] != rounded[order[:-1]]).any(axis=1)
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.cumsum(new) - 1
    return vertices[order[new]], number[faces]
