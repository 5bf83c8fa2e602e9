"""A fixture's mesh file: what is seen of it, and the convex pieces that collide.

    found = fixture_mesh(path, "mm")          # STL, OBJ, PLY, OFF, GLB or 3MF
    found.vertices, found.pieces, found.centre

All that the file holds counts, several solids and what a scene places too. The numbers are about the mesh's own centre:
MuJoCo keeps them in single precision, of which a mesh in a plant's coordinates would have none left. Metres.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from ik.chain import Floats
from slicing import UNITS_MM, Code, PartError, Warning, read_triangles

from ..arrays import Ints
from ..units import METRES_PER_MM
from .convex_pieces import ConvexPieces, convex_pieces, is_thick

LEAST_MM = 1e-3  # that a mesh is large
SMALL_MM = 5.0  # of a fixture's mesh, that is rather in another unit
FILLED = 0.01  # of a fixture's volume that its convex pieces may hold besides it without a word
FARTHEST_MM = 1e8  # that a mesh may be off its own origin


@dataclass(frozen=True, eq=False)
class FixtureMesh:
    """A mesh about its centre.

    Attributes:
        vertices: (n, 3), m.
        faces: (k, 3).
        centre: where its centre is in the file's frame, (3,), m.
        solid: the convex pieces, about the centre as well.
        lines: what was odd about the file.
    """

    vertices: Floats
    faces: Ints
    centre: Floats
    solid: ConvexPieces
    lines: tuple[str, ...]

    def warnings(self, name: str, units: str) -> Iterator[Warning]:
        """What a user should know of it.

        Args:
            name: the fixture's.
            units: what a length of 1 in the file was taken for.

        Yields:
            Typed warnings.
        """
        for line in self.lines:
            yield Warning(getattr(line, "code", Code.MESH_FILE), f"fixtures.{name}.mesh: {line}")
        extent = float(np.ptp(self.vertices, axis=0).max()) / METRES_PER_MM
        if extent < SMALL_MM:
            text = f"largest extent {extent:.4g} mm with units: {units}; is it in another?"
            yield Warning(Code.MESH_UNITS, f"fixtures.{name}.mesh: {text}")
        if self.solid.excess > FILLED:
            more = "collisions are checked with its convex hull, since it is not closed"
            if np.isfinite(self.solid.excess):
                share = 100 * self.solid.excess
                more = f"the shape for collisions has {share:.0f} % more volume, which fills some of its hollows"
            text = f"fixtures.{name}.mesh: {more}; several fixtures of simple shapes are exact"
            yield Warning(Code.CONCAVE_FIXTURE, text)


def fixture_mesh(path: Path, units: str) -> FixtureMesh:
    """Read a fixture's mesh; one that has been read already is taken from memory.

    Args:
        path: the file.
        units: what a length of 1 means: mm, cm, m or inch.

    Returns:
        The mesh.

    Raises:
        PartError: it cannot be read, holds no triangle, or is flat; one line.
        ValueError: a part of it is too thin a sheet.
    """
    changed = path.stat()
    return _read(str(path), units, changed.st_mtime_ns, changed.st_size)


@lru_cache(maxsize=32)
def _read(path: str, units: str, *_changed: int) -> FixtureMesh:
    import trimesh  # heavy: only where a fixture is a mesh

    found = read_triangles(path, units)
    used, faces = np.unique(found.faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    vertices = found.vertices[used] * (UNITS_MM[units] * METRES_PER_MM)
    farthest = float(np.abs(vertices).max())
    if not farthest <= FARTHEST_MM * METRES_PER_MM:
        far = f"{farthest / METRES_PER_MM:.3g}"
        raise PartError(f"{path}: a coordinate of {far} mm; numbers up to {FARTHEST_MM:g} mm are taken")
    centre = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    vertices = vertices - centre
    extent = float(np.ptp(vertices, axis=0).max()) / METRES_PER_MM
    if extent < LEAST_MM:
        raise PartError(f"{path}: largest extent {extent:.4g} mm with units: {units}; is it in another?")
    solid = convex_pieces(trimesh.Trimesh(vertices, faces, process=False))
    if not all(map(is_thick, solid.pieces)):
        raise PartError(f"{path}: all of the mesh is in one plane; give it a thickness, or use a box")
    same = (faces == np.roll(faces, 1, axis=1)).any(axis=1)  # of two corners at one place
    return FixtureMesh(vertices, faces[~same], centre, solid, found.lines)
