"""Reading solids from files: with the readers of each kind (`slicing.mesh.files.stl` and others) all that touches any.

    mesh = load_mesh("blade.stl", units="mm")
    mesh.volume, mesh.bounds, mesh.warnings

What is wrong with a file is reported in one line (`PartError`). Each shell of what it holds is examined by itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..parameters import UNITS_MM
from .files.bounds import require_bounded
from .files.glb import read_glb
from .files.obj import read_obj
from .files.ply import read_off, read_ply
from .files.polygons import Triangles
from .files.stl import read_stl
from .shells import one_solid
from .solid import Floats, Ints, Mesh, PartError, mesh_from_arrays, noise_of, require_few_faces, require_near

# how a 3MF names the units that are allowed here
STATED_UNITS = {"millimeter": "mm", "centimeter": "cm", "meter": "m", "inch": "inch"}


def _read_3mf(path: Path) -> Triangles:
    from .files.three_mf import read_3mf  # it brings the readers of XML with it

    return read_3mf(path)


READERS: dict[str, Callable[[Path], Triangles]] = {
    ".stl": read_stl,
    ".obj": read_obj,
    ".ply": read_ply,
    ".off": read_off,
    ".3mf": _read_3mf,
    ".glb": read_glb,
}


def solid_from_arrays(
    name: str, vertices: npt.ArrayLike, faces: npt.ArrayLike, noise_mm: float | None = None, units: str = "mm"
) -> Mesh:
    """One solid from arrays, such as the vertices and faces of a `trimesh.Trimesh`; checked and repaired like a file.

    Args:
        name: what messages call it.
        vertices: (n, 3) positions in the part frame, mm.
        faces: (m, 3) vertex indices.
        noise_mm: rounding of the coordinates, mm; found from the numbers when not given.
        units: what a length of 1 was before it was mm; for the line about an unlikely size.

    Returns:
        The mesh of one solid.

    Raises:
        PartError: a mesh that is not closed or not a solid, faces that cross, or shells of which it is not clear
            what is solid.
    """
    return one_solid(mesh_from_arrays(name, vertices, faces, noise_mm, units, outward=False))


def load_mesh(path: str | Path, units: str = "mm", name: str | None = None) -> Mesh:
    """Read one solid from a file: STL, OBJ, PLY, OFF, GLB or 3MF.

    The meshes of a scene (GLB, 3MF) are placed as the scene says and joined; together they must be closed.

    Args:
        path: the file.
        units: what a length of 1 in the file means: mm, cm, m or inch.
        name: what messages and documents call it; the file's stem when not given.

    Returns:
        The mesh in mm, duplicate vertices merged.

    Raises:
        PartError: an unknown unit or another than the file states (3MF), a missing or unreadable file, or a mesh
            that `solid_from_arrays` refuses.
    """
    file = Path(path)
    if units not in UNITS_MM:
        raise PartError(f"{file}: units {units!r} unknown; allowed: {', '.join(UNITS_MM)}")
    if not file.is_file():
        raise PartError(f"{file}: {'not a file' if file.exists() else 'no such file'}")
    found = _read(file, units)
    require_near(str(file), found.vertices * UNITS_MM[units])
    vertices, faces = _merge_duplicates(found.vertices, found.faces)
    scale = UNITS_MM[units]
    noise = max(noise_of(vertices) * scale, 1e-9)
    mesh = solid_from_arrays(str(file), vertices * scale, faces, noise, units)
    return replace(mesh, name=name or file.stem, warnings=(*found.lines, *mesh.warnings))


def read_triangles(path: str | Path, units: str = "mm") -> Triangles:
    """Triangles of a mesh file as they stand there, whatever they are triangles of: a sheet, or several solids.

    Args:
        path: the file: STL, OBJ, PLY, OFF, GLB or 3MF.
        units: what a length of 1 in the file is taken for; the vertices stay in it.

    Returns:
        Its vertices, in the file's own unit, those at one place joined, and its triangles.

    Raises:
        PartError: it cannot be read, holds no triangle or a vertex that is not a number, or states another unit (3MF).
    """
    file = Path(path)
    found = _read(file, units)
    if not np.isfinite(found.vertices[found.faces]).all():
        raise PartError(f"{file}: a vertex is not a number")
    places, of = np.unique(found.vertices, axis=0, return_inverse=True)
    return replace(found, vertices=places, faces=of.ravel()[found.faces])


def _require_unit(file: Path, stated: str | None, units: str) -> None:
    """Refuse a unit that contradicts the file (a 3MF states its own; GLB's metres are hardly ever meant)."""
    if file.suffix.lower() != ".3mf" or stated is None:
        return
    said = STATED_UNITS.get(stated.removesuffix("s"))
    if said != units:
        allowed = f"set units: {said}" if said else f"allowed: {', '.join(UNITS_MM)}"
        raise PartError(f"{file}: the file's unit is {stated}, but units: {units} was given; {allowed}")


def _read(file: Path, units: str) -> Triangles:
    """What the file holds, all its solids together, in its own unit."""
    if file.stat().st_size == 0:
        raise PartError(f"{file}: the file is empty")
    reader = READERS.get(file.suffix.lower())
    if reader is None:
        raise PartError(f"{file}: unknown kind of mesh file {file.suffix!r}; allowed: {', '.join(READERS)}")
    require_bounded(file)
    found = reader(file)
    _require_unit(file, found.unit, units)
    if len(found.faces) == 0:
        raise PartError(f"{file}: no triangles in the file; a closed solid is needed")
    require_few_faces(str(file), len(found.faces))
    if found.faces.min() < 0 or found.faces.max() >= len(found.vertices):
        raise PartError(f"{file}: a face names a vertex outside 0 .. {len(found.vertices) - 1}")
    return found


def _merge_duplicates(vertices: Floats, faces: Ints) -> tuple[Floats, Ints]:
    """Give vertices at the same place one number (STL repeats every vertex in every face)."""
    rounded = np.round(vertices / max(1e-9, 1e-9 * float(np.abs(vertices[np.isfinite(vertices)]).max(initial=0.0))))
    order = np.lexsort(rounded.T)
    new = np.ones(len(order), dtype=bool)
    new[1:] = (rounded[order[1:]] != rounded[order[:-1]]).any(axis=1)
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.cumsum(new) - 1
    return vertices[order[new]], number[faces]
