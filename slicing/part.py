"""The solid to slice: a closed triangle mesh in the part frame, millimetres, checked once when it is made.

This is the only module of the package that touches files. Whatever is wrong with the input is said here, in
one line (`PartError`), so that the geometry after it may rely on a closed, outward-oriented mesh of finite
numbers:

    mesh = load_mesh("blade.stl", units="mm")
    mesh.volume, mesh.bounds, mesh.warnings
    cube = mesh_from_arrays("cube", vertices, faces)
"""

from __future__ import annotations

import math
import re
import struct
import zipfile
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import numpy.typing as npt

from slicing.edges import edge_table
from slicing.faces import bounding_box, enclosed_volume, face_measures, face_normals

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

# what a kind of file needs beyond trimesh itself
READERS = {".3mf": ("networkx", "lxml")}
# how a 3MF names the units that are allowed here
STATED_UNITS = {"millimeter": "mm", "centimeter": "cm", "meter": "m", "inch": "inch"}
UNITS_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}
SMALL_MM, LARGE_MM = 1.0, 10_000.0  # extents outside these are almost always a wrong unit
USUAL_MM = 150.0  # of the units that are possible that one is likely which comes nearest
MOST_FACES = 5_000_000  # 0.7 GB of memory a million
FARTHEST_MM = 1e9  # coordinates beyond this are no part's; their squares and cubes would leave no digits
DOUBLE_NOISE_MM = 1e-6  # coordinates written as text, or computed: what two "equal" heights may differ by
# what trimesh's readers raise on damaged files (each format its own)
READ_ERRORS = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    BufferError,
    EOFError,
    ImportError,
    LookupError,
    OSError,
    RuntimeError,
    SyntaxError,
    TypeError,
    ValueError,
    struct.error,
    zipfile.BadZipFile,
    zlib.error,
)


class PartError(ValueError):
    """Bad input: one line naming the file or the part, what is wrong with it and what is allowed."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed, outward-oriented triangle mesh. Made and checked by `mesh_from_arrays` or `load_mesh`.

    Attributes:
        name: what messages and documents call it.
        vertices: (n, 3) positions in the part frame, mm.
        faces: (m, 3) vertex indices, counter-clockwise seen from outside.
        warnings: what was repaired or looks suspicious, one line each.
        noise_mm: rounding of the coordinates (single precision in an STL); heights closer than this are
            equal.
    """

    name: str
    vertices: Floats
    faces: Ints
    warnings: tuple[str, ...] = ()
    noise_mm: float = DOUBLE_NOISE_MM

    @cached_property
    def bounds(self) -> Floats:
        """(2, 3) least and greatest coordinates, mm."""
        return bounding_box(self.vertices)

    @cached_property
    def volume(self) -> float:
        """Enclosed volume, mm³."""
        return enclosed_volume(self.vertices, self.faces, self.normals)

    @property
    def normals(self) -> Floats:
        """(m, 3) outward face normals, not normalised (length: twice the area, mm²)."""
        return self._measures[0]

    @cached_property
    def corners(self) -> Ints:
        """(3, m) vertex indices of the faces' first, second and third corners, each in one piece."""
        return np.ascontiguousarray(self.faces.T)

    @cached_property
    def edge_table(self) -> tuple[Ints, Ints]:
        """Undirected edges (e, 2), lower vertex first, and the (m, 3) edge of each face's k-th side."""
        return edge_table(len(self.vertices), self.faces)

    @property
    def bounding_spheres(self) -> tuple[Floats, Floats]:
        """Centres (m, 3) and radii (m,) of spheres around the faces: a bound on any distance to a surface."""
        return self._measures[1:]

    @cached_property
    def _measures(self) -> tuple[Floats, Floats, Floats]:
        """Normals and spheres together: most of either is looking up the corners."""
        return face_measures(self.vertices, self.faces)


def mesh_from_arrays(
    name: str,
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    noise_mm: float | None = None,
    every_shell: bool = False,
    units: str = "mm",
) -> Mesh:
    """Check the arrays of a solid and make a `Mesh` of them.

    Args:
        name: what messages call it.
        vertices: (n, 3) positions in the part frame, mm.
        faces: (m, 3) vertex indices. What is wrong with them is repaired where that is safe, and said in
            `Mesh.warnings` (see `slicing.repair`); a solid that is inside out is turned round.
        noise_mm: rounding of the coordinates, mm; found from the numbers when not given.
        every_shell: look at each shell by itself, and for faces that cross (`slicing.repair_shells`), as
            `load_mesh` does: some 10 µs a face.
        units: what a length of 1 was before it was mm; for the line about an unlikely size.

    Returns:
        The mesh.

    Raises:
        PartError: nothing in it, more than MOST_FACES, numbers that are not finite or beyond FARTHEST_MM, indices out
            of range, not closed, or no volume; of every shell: faces that cross, or shells of which it cannot be told
            what is solid.
    """
    from slicing.repair import closed_surface  # these build on this module
    from slicing.repair_shells import one_solid

    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    if len(points) == 0 or len(triangles) == 0:
        raise PartError(f"{name}: the mesh is empty; a closed solid is needed")
    _require_size(name, len(triangles))
    if triangles.min() < 0 or triangles.max() >= len(points):
        raise PartError(f"{name}: a face names a vertex outside 0 .. {len(points) - 1}")
    a, b, c = triangles.T
    whole = (a != b) & (b != c) & (c != a)
    if not whole.any():
        raise PartError(f"{name}: every face is degenerate (uses a vertex twice)")
    _require_near(name, points)
    points, triangles, warnings = closed_surface(name, points, triangles if whole.all() else triangles[whole])
    if not whole.all():
        warnings.insert(0, f"{name}: {int((~whole).sum())} faces that use a vertex twice dropped")
    if not every_shell:
        triangles = _outward(name, points, triangles, warnings)
    warnings += _size_warnings(name, points, units)
    noise = _noise(points) if noise_mm is None else noise_mm
    mesh = Mesh(name, points, triangles, tuple(warnings), noise)
    return one_solid(mesh) if every_shell else mesh


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
    _require_near(str(file), vertices * UNITS_MM[units])
    vertices, faces = _merge_duplicates(vertices, faces)
    scale = UNITS_MM[units]
    noise = max(_noise(vertices) * scale, 1e-9)
    mesh = mesh_from_arrays(str(file), vertices * scale, faces, noise, every_shell=True, units=units)
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
    _require_size(str(file), _stated_faces(file))
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


def _noise(points: Floats) -> float:
    """Rounding of the coordinates: one step of single precision where all numbers are such numbers."""
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) == 0:
        return DOUBLE_NOISE_MM
    if (points.astype(np.float32) == points).all():
        return max(float(np.spacing(np.float32(np.abs(points).max()))), 1e-9)
    return DOUBLE_NOISE_MM


def _outward(name: str, points: Floats, faces: Ints, warnings: list[str]) -> Ints:
    """Turn a mesh that is inside out as a whole; refuse one that encloses nothing."""
    volume = enclosed_volume(points, faces, face_normals(points, faces))
    extent = float(np.ptp(points, axis=0).max())
    if abs(volume) <= 1e-12 * extent**3:
        raise PartError(f"{name}: the mesh encloses no volume; a solid is needed")
    if volume < 0:
        faces = np.ascontiguousarray(faces[:, ::-1])
        warnings.append(f"{name}: the mesh was inside out; turned")
    return faces


def _require_size(name: str, faces: int) -> None:
    """Refuse more faces than fit."""
    if faces > MOST_FACES:
        raise PartError(f"{name}: {faces:,} faces; at most {MOST_FACES:,} are taken: simplify the mesh first")


def _require_near(name: str, points: Floats) -> None:
    """Refuse coordinates that no part has; what is not finite is looked at elsewhere."""
    farthest = float(np.abs(points[np.isfinite(points)]).max(initial=0.0))
    if farthest > FARTHEST_MM:
        raise PartError(f"{name}: coordinates up to {farthest:.3g} mm; at most {FARTHEST_MM:g} mm are taken")


def _size_warnings(name: str, points: Floats, units: str) -> list[str]:
    """A line if the size suggests that the file is in another unit, naming the likely one."""
    extent = float(np.ptp(points, axis=0).max())
    if SMALL_MM <= extent <= LARGE_MM:
        return []
    given = UNITS_MM[units]
    others = {unit: extent / given * mm for unit, mm in UNITS_MM.items() if (mm > given) == (extent < SMALL_MM)}
    likely = min(others, key=lambda unit: abs(math.log(others[unit] / USUAL_MM)), default=None)
    if likely is None or not SMALL_MM <= others[likely] <= LARGE_MM:
        hint = "is it in µm, or scaled already? (units: mm expected)"
    else:
        names = [unit for unit in others if unit != units]
        asked = " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
        hint = f"is the file in {asked}? (units: {likely} would make it {others[likely]:.4g} mm)"
    return [f"{name}: largest extent {extent:.4g} mm; {hint}"]
