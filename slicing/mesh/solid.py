"""The solid to slice: a closed triangle mesh in the part frame, millimetres, checked once when it is made.

Whatever is wrong with the input is reported here, in one line (`PartError`), so that the geometry after it may rely on
a closed, outward-oriented mesh of finite numbers:

    cube = mesh_from_arrays("cube", vertices, faces)
    cube.volume, cube.bounds, cube.warnings

Files are read by `slicing.mesh.load`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..arrays import Bools, Floats, Ints, PartError
from ..parameters import UNITS_MM
from ..warning import Code, Warning
from .closing import closed_surface, repaired
from .face_measures import bounding_box, enclosed_volume, face_measures, face_normals
from .mesh_edges import edges_of_faces

__all__ = [
    "Bools",
    "Floats",
    "Ints",
    "Mesh",
    "PartError",
    "low_part_warnings",
    "mesh_from_arrays",
    "noise_of",
    "require_few_faces",
    "require_near",
]

SMALL_MM, LARGE_MM = 1.0, 10_000.0  # extents outside these are almost always a wrong unit
FEW_LAYERS = 12.0  # a whole part of fewer layers' thickness is likely in a larger unit
USUAL_MM = 150.0  # of the units that are possible that one is likely which comes nearest
MOST_FACES = 5_000_000  # 0.7 GB of memory a million
FARTHEST_MM = 1e9  # coordinates beyond this are no part's; their squares and cubes would leave no digits
DOUBLE_NOISE_MM = 1e-6  # coordinates written as text, or computed: what two "equal" heights may differ by
DECIMALS = (2, 3, 4)  # of coordinates that count as rounded
ROUNDED_NUMBERS = 10  # different numbers, of which none has more decimals: fewer may be meant so
LAST_DIGIT = 0.4  # share of them whose last decimal is not 0: numbers that are meant have fewer decimals, most of them
HALVED = 1024.0  # multiples of its inverse are halves of halves: meant so, not rounded


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed, outward-oriented triangle mesh. `solid_from_arrays` and `load_mesh` make and check it.

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
    def edges_and_sides(self) -> tuple[Ints, Ints]:
        """Undirected edges (e, 2), lower vertex first, and the (m, 3) edge of each face's k-th side."""
        return edges_of_faces(len(self.vertices), self.faces)

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
    units: str = "mm",
    outward: bool = True,
) -> Mesh:
    """Check the arrays of a solid and make a `Mesh` of them.

    Args:
        name: what messages call it.
        vertices: (n, 3) positions in the part frame, mm.
        faces: (m, 3) vertex indices. What is wrong with them is repaired where that is safe, and said in
            `Mesh.warnings` (see `slicing.mesh.closing`).
        noise_mm: rounding of the coordinates, mm; found from the numbers when not given.
        units: what a length of 1 was before it was mm; for the line about an unlikely size.
        outward: whether a solid that is inside out is turned round, and one without a volume refused. Not of
            shells that are examined by themselves, as `slicing.mesh.load` does: some 10 µs a face.

    Returns:
        The mesh.

    Raises:
        PartError: nothing in it, more than MOST_FACES, numbers that are not finite or beyond FARTHEST_MM, indices out
            of range, not closed, or no volume.
    """
    points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
    triangles = np.array(faces, dtype=np.int64).reshape(-1, 3)
    if len(points) == 0 or len(triangles) == 0:
        raise PartError(f"{name}: the mesh is empty; a closed solid is needed")
    require_few_faces(name, len(triangles))
    if triangles.min() < 0 or triangles.max() >= len(points):
        raise PartError(f"{name}: a face names a vertex outside 0 .. {len(points) - 1}")
    a, b, c = triangles.T
    whole = (a != b) & (b != c) & (c != a)
    if not whole.any():
        raise PartError(f"{name}: every face is degenerate (uses a vertex twice)")
    require_near(name, points)
    points, triangles, warnings = closed_surface(name, points, triangles if whole.all() else triangles[whole])
    if not whole.all():
        warnings.insert(0, repaired(f"{name}: dropped {int((~whole).sum())} faces that use a vertex twice"))
    if outward:
        triangles = _outward(name, points, triangles, warnings)
    warnings += _size_warnings(name, points, units)
    noise = noise_of(points) if noise_mm is None else noise_mm
    return Mesh(name, points, triangles, tuple(warnings), noise)


def noise_of(points: Floats) -> float:
    """Rounding of the coordinates: half a step of few decimals, or one step of single precision, where all are so."""
    points = points[np.isfinite(points).all(axis=1)]
    if len(points) == 0:
        return DOUBLE_NOISE_MM
    some = np.unique(np.abs(points))
    meant = len(some) < ROUNDED_NUMBERS or (some * HALVED == np.round(some * HALVED)).all()
    for digits in () if meant else DECIMALS:
        scaled = some * 10.0**digits
        slack = 1e-6 + 10.0**digits * np.spacing(some.astype(np.float32))
        if slack.max() < 0.05 and (np.abs(scaled - np.round(scaled)) <= slack).all():
            last = np.round(scaled) % 10 != 0
            return 0.5 * 10.0**-digits if last.mean() >= LAST_DIGIT else DOUBLE_NOISE_MM
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
        warnings.append(repaired(f"{name}: turned the mesh, which was inside out ({-volume:.6g} mm³)"))
    return faces


def require_few_faces(name: str, faces: int) -> None:
    """Refuse more faces than fit."""
    if faces > MOST_FACES:
        raise PartError(f"{name}: {faces:,} faces; at most {MOST_FACES:,} are taken: simplify the mesh first")


def require_near(name: str, points: Floats) -> None:
    """Refuse coordinates that no part has; what is not finite is examined elsewhere."""
    farthest = float(np.abs(points[np.isfinite(points)]).max(initial=0.0))
    if farthest > FARTHEST_MM:
        raise PartError(f"{name}: coordinates up to {farthest:.3g} mm; at most {FARTHEST_MM:g} mm are taken")


def _size_warnings(name: str, points: Floats, units: str) -> list[str]:
    """A line if the size suggests that the file is in another unit, naming the likely one."""
    extent = float(np.ptp(points, axis=0).max())
    if SMALL_MM <= extent <= LARGE_MM:
        return []
    likely = _likely_unit(extent, units, extent < SMALL_MM)
    if likely is None:
        text = "is it in µm, or scaled already? (units: mm expected)"
        return [Warning(Code.MESH_UNITS, f"{name}: largest extent {extent:.4g} mm; {text}")]
    return [_unit_line(name, extent, units, *likely)]


def low_part_warnings(mesh: Mesh, units: str, h_layer_mm: float) -> list[str]:
    """A line if a whole part is so few layers high that its file is likely in a larger unit (inches above all).

    Args:
        mesh: the whole part, mm.
        units: what a length of 1 in its file was taken for.
        h_layer_mm: thickness of its layers.

    Returns:
        One line, or none.
    """
    extent = float(np.ptp(mesh.bounds, axis=0).max())
    if extent < SMALL_MM or extent >= FEW_LAYERS * h_layer_mm:
        return []
    likely = _likely_unit(extent, units, True)
    return [] if likely is None else [_unit_line(mesh.name, extent, units, *likely)]


def _likely_unit(extent: float, units: str, larger: bool) -> tuple[str, float] | None:
    """The unit, larger or smaller than the given one, that makes an extent most usual; and that extent, mm."""
    given = UNITS_MM[units]
    others = {unit: extent / given * mm for unit, mm in UNITS_MM.items() if mm != given and (mm > given) == larger}
    likely = min(others, key=lambda unit: abs(math.log(others[unit] / USUAL_MM)), default=None)
    if likely is None or not SMALL_MM <= others[likely] <= LARGE_MM:
        return None
    return likely, others[likely]


def _unit_line(name: str, extent: float, units: str, likely: str, likely_mm: float) -> Warning:
    given = UNITS_MM[units]
    names = [unit for unit, mm in UNITS_MM.items() if mm != given and (mm > given) == (UNITS_MM[likely] > given)]
    asked = " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
    hint = f"is the file in {asked}? (units: {likely} would make it {likely_mm:.4g} mm)"
    return Warning(Code.MESH_UNITS, f"{name}: largest extent {extent:.4g} mm; {hint}")
