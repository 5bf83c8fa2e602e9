"""The faces of a solid as columns, divided where a round surface needs them smaller.

    faces = SolidFaces.of(mesh).fit_for(Cylinder((0.0, 0.0), 20.0))
    faces.about((0.0, 0.0), np.arange(9))              # squared distance from the axis, and flux of (x, y, 0), of nine

Faces are divided until a round surface leaves them by no more than SAG_MM: for cylinders only across the axis, for
planes not at all. Sums over faces are taken by columns (see `slicing.mesh.face_measures`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np

from ..mesh.face_measures import chunks, total_area
from ..mesh.solid import Bools, Floats, Ints, Mesh
from ..surfaces.surfaces import Surface

SAG_MM = 0.02
LEVEL = 1e-9  # share of a normal that is rounding
ENOUGH_FACES, MOST_FACES = 6_000, 60_000


@dataclass(frozen=True, eq=False)
class SolidFaces:
    """The faces of a solid.

    Attributes:
        mesh: the solid.
        limit_mm: longest side where faces are divided; 0 where they are as they are.
    """

    mesh: Mesh
    limit_mm: float = 0.0
    _divided: dict[tuple[bool, float], Self | None] = field(default_factory=dict)

    @classmethod
    def of(cls, mesh: Mesh) -> Self:
        """A mesh's faces."""
        area = total_area(mesh.normals)
        around = 0.5 * float(np.ptp(mesh.bounds, axis=0)[:2].max())
        limit = max(math.sqrt(8.0 * SAG_MM * around), math.sqrt(2.0 * area / ENOUGH_FACES))
        return cls(mesh, limit)

    def fit_for(self, surface: Surface, finer: float = 1.0) -> Self:
        """The faces as small as a surface needs them; `finer` times smaller than usual.

        None needs to be divided for planes, and none along the axis for cylinders; nor where there are most of them
        already. What faces straight along the axis passes nothing through round surfaces.
        """
        if surface.is_flat or not self.limit_mm:
            return self
        key = (surface.is_straight, finer)
        if key not in self._divided:
            self._divided[key] = self._divide(self.limit_mm / finer, int(MOST_FACES * finer), key[0])
        return self._divided[key] or self

    def _divide(self, limit_mm: float, most: int, across: bool) -> Self | None:
        """The faces divided, what faces along the axis left out; None where they stay as they are."""
        steep = np.empty(len(self.mesh.faces), dtype=bool)
        count = 0
        for part in chunks(len(steep)):
            x, y, z = self.mesh.normals[part].T
            np.greater(x * x + y * y, LEVEL**2 * (z * z), out=steep[part])
            count += int(np.count_nonzero(steep[part]))
            if count > most:
                return None
        small = _divided(self.mesh.vertices, self.mesh.faces[steep], limit_mm, most, across)
        return type(self)(Mesh(self.mesh.name, *small))

    @cached_property
    def places(self) -> Floats:
        """The vertices' coordinates (3, n)."""
        return np.ascontiguousarray(self.mesh.vertices.T)

    def of_corners(self, values: Floats, faces: Ints) -> list[Floats]:
        """What the vertices have (n,) for each of the three corners of some faces."""
        return [values.take(column.take(faces)) for column in self.mesh.corners]

    def touching(self, marked: Bools) -> Ints:
        """Faces of which any corner is marked (n,)."""
        if not marked.any():
            return np.zeros(0, dtype=np.int64)
        a, b, c = (marked.take(column) for column in self.mesh.corners)
        return np.flatnonzero(a | b | c)

    def _middles(self, k: int) -> Floats:
        """One coordinate (m,) of the faces' centroids."""
        centre, place = np.empty(len(self.mesh.faces)), self.places[k]
        for part in chunks(len(centre)):
            a, b, c = (place.take(column[part]) for column in self.mesh.corners)
            a += b
            a += c
            np.divide(a, 3.0, out=centre[part])
        return centre

    @cached_property
    def centres(self) -> tuple[Floats, Floats]:
        """The faces' centroids across the axis, x and y (m,) each."""
        return self._middles(0), self._middles(1)

    @cached_property
    def centre_z(self) -> Floats:
        """The faces' centroids along the axis (m,); flux about an axis is seldom asked where along it it passes."""
        return self._middles(2)

    def about(self, axis: tuple[float, float], faces: Ints) -> tuple[Floats, Floats]:
        """Squared distance (k,) of some faces' centroids from an axis, and the flux (k,) of (x, y, 0) about it."""
        x, y = (self.centres[k].take(faces) - axis[k] for k in (0, 1))
        normals = self.mesh.normals
        return x * x + y * y, 0.5 * (x * normals[:, 0].take(faces) + y * normals[:, 1].take(faces))

    def squares(self, axis: tuple[float, float]) -> Floats:
        """Squared distances (n,) of the vertices from an axis."""
        x, y = (self.places[k] - axis[k] for k in (0, 1))
        x *= x
        y *= y
        x += y
        return x

    @cached_property
    def around(self) -> float:
        """How far its corners lie from its middle across the axis, mm, at most."""
        return 0.5 * math.hypot(*np.ptp(self.mesh.bounds, axis=0)[:2])

    @cached_property
    def middle(self) -> Floats:
        """Its middle (2,) across the axis, mm."""
        return np.asarray(self.mesh.bounds.mean(axis=0)[:2])

    @cached_property
    def on_axis(self) -> float:
        """Squared distance from an axis, mm², at which a face is on it."""
        return max(1e-9 * float((np.ptp(self.mesh.bounds, axis=0)[:2] ** 2).sum()), 1e-300)


def _divided(vertices: Floats, faces: Ints, limit_mm: float, most: int, across: bool) -> tuple[Floats, Ints]:
    """Halve faces until no side (across the axis alone, if so) is longer than the limit or there are most."""
    done: list[Ints] = []
    count = 0
    while len(faces) and count + len(faces) <= most:
        places = [vertices[faces[:, k], : 2 if across else 3] for k in range(3)]
        length2 = [((places[(k + 1) % 3] - places[k]) ** 2).sum(axis=1) for k in range(3)]
        most2 = np.maximum(np.maximum(length2[0], length2[1]), length2[2])
        large = most2 > limit_mm**2
        done.append(faces[~large])
        count += len(done[-1])
        longest = np.where(length2[0] == most2, 0, np.where(length2[1] == most2, 1, 2))[large]
        faces = faces[large]
        rows = np.arange(len(faces))
        a, b, c = (faces[rows, (longest + k) % 3] for k in range(3))
        middle = len(vertices) + rows
        vertices = np.concatenate([vertices, 0.5 * (vertices[a] + vertices[b])])
        faces = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return vertices, np.concatenate([*done, faces])
