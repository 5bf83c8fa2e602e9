"""The faces of a solid, small, and what is known from them alone: volumes and areas of sections, without any curve.

    flux = SolidFlux.of(mesh)
    flux.volume_beyond(Cylinder((0.0, 0.0), 20.0))        # mm³ of the solid outside it
    flux.area_on(Cylinder((0.0, 0.0), 20.0), 1.73)        # mm² of its section by the cylinder 1.73 mm further out

Both are fluxes. What lies beyond a surface is bounded by the region on the surface and by the faces out there; a field
without divergence passes as much through the one as through the others. For a plane the field is its normal, for
surfaces of revolution (x, y, 0) / rho² about their axis, which passes a ring of radius r evenly. A field of divergence
1 that is zero on the surface gives the volume: (rho² - r²) / (2 rho²) (x, y, 0), or the height over a plane.

Faces are divided until a round surface leaves them by no more than SAG_MM: for cylinders only across the axis, for
planes not at all. Those cut by the surface count by the share of them beyond it, as if it were plane there.

Every face is looked at for every family of offsets, but only those that a level cuts closely: the number of levels
below a vertex says of all others how many they lie beyond. Sums over faces are taken by columns (see
`slicing.mesh.face_measures`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from ..mesh.face_measures import chunks, total_area
from ..mesh.solid import Bools, Floats, Ints, Mesh
from ..surfaces.offset_families import Family, ascending, mean_above, share_above
from ..surfaces.surfaces import Cylinder, Plane, Round, Surface

SAG_MM = 0.02
LEVEL = 1e-9  # share of a normal that is rounding
FAR_AXIS = 1.1  # an axis this often as far from the solid's middle as its corners is beside it
ENOUGH_FACES, MOST_FACES = 6_000, 60_000
MOST_LEVELS, MOST_FAMILIES = 255, 8  # that are looked at together: how many lie below a vertex is one byte each
FEW_LEVELS = 6  # up to here comparing is faster than searching


@dataclass(frozen=True, eq=False)
class SolidFlux:
    """The faces of a solid.

    Attributes:
        mesh: the solid.
        limit_mm: longest side where faces are divided; 0 where they are as they are.
    """

    mesh: Mesh
    limit_mm: float = 0.0
    _divided: dict[tuple[bool, float], SolidFlux | None] = field(default_factory=dict)

    @classmethod
    def of(cls, mesh: Mesh) -> SolidFlux:
        """A mesh's faces."""
        area = total_area(mesh.normals)
        around = 0.5 * float(np.ptp(mesh.bounds, axis=0)[:2].max())
        limit = max(math.sqrt(8.0 * SAG_MM * around), math.sqrt(2.0 * area / ENOUGH_FACES))
        return cls(mesh, limit)

    def fit_for(self, surface: Surface, finer: float = 1.0) -> SolidFlux:
        """The faces as small as a surface needs them; `finer` times smaller than usual.

        None needs to be divided for planes, and none along the axis for cylinders; nor where there are most of them
        already. What faces straight along the axis passes nothing through round surfaces.
        """
        if isinstance(surface, Plane) or not self.limit_mm:
            return self
        key = (isinstance(surface, Cylinder), finer)
        if key not in self._divided:
            self._divided[key] = self._divide(self.limit_mm / finer, int(MOST_FACES * finer), key[0])
        return self._divided[key] or self

    def _divide(self, limit_mm: float, most: int, across: bool) -> SolidFlux | None:
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
        return SolidFlux(Mesh(self.mesh.name, *small))

    @cached_property
    def _places(self) -> Floats:
        """The vertices' coordinates (3, n)."""
        return np.ascontiguousarray(self.mesh.vertices.T)

    def _of_corners(self, values: Floats, faces: Ints) -> list[Floats]:
        """What the vertices have (n,) for each of the three corners of some faces."""
        return [values.take(column.take(faces)) for column in self.mesh.corners]

    def _touching(self, marked: Bools) -> Ints:
        """Faces of which any corner is marked (n,)."""
        if not marked.any():
            return np.zeros(0, dtype=np.int64)
        a, b, c = (marked.take(column) for column in self.mesh.corners)
        return np.flatnonzero(a | b | c)

    def _middles(self, k: int) -> Floats:
        """One coordinate (m,) of the faces' centroids."""
        centre, place = np.empty(len(self.mesh.faces)), self._places[k]
        for part in chunks(len(centre)):
            a, b, c = (place.take(column[part]) for column in self.mesh.corners)
            a += b
            a += c
            np.divide(a, 3.0, out=centre[part])
        return centre

    @cached_property
    def _centres(self) -> tuple[Floats, Floats]:
        """The faces' centroids across the axis, x and y (m,) each."""
        return self._middles(0), self._middles(1)

    @cached_property
    def _centre_z(self) -> Floats:
        """The faces' centroids along the axis (m,); flux about an axis is seldom asked where along it it passes."""
        return self._middles(2)

    def _about(self, axis: tuple[float, float], faces: Ints) -> tuple[Floats, Floats]:
        """Squared distance (k,) of some faces' centroids from an axis, and the flux (k,) of (x, y, 0) about it."""
        x, y = (self._centres[k].take(faces) - axis[k] for k in (0, 1))
        normals = self.mesh.normals
        return x * x + y * y, 0.5 * (x * normals[:, 0].take(faces) + y * normals[:, 1].take(faces))

    def _fluxes(self, surfaces: Sequence[Surface], part: slice) -> list[Floats]:
        """Flux (c,) through some faces of the fields that pass surfaces and their offsets evenly, of each surface."""
        far = [surface.axis_point for surface in surfaces if not isinstance(surface, Plane) and self._is_far(surface)]
        if len(far) < 2:
            return [self._evenly(surface, part) for surface in surfaces]
        rows = dict(zip(far, self._from_afar(far, part), strict=True))
        of = [None if isinstance(surface, Plane) else rows.get(surface.axis_point) for surface in surfaces]
        return [self._evenly(surface, part) if row is None else row for surface, row in zip(surfaces, of, strict=True)]

    def _evenly(self, surface: Surface, part: slice) -> Floats:
        normals = self.mesh.normals[part].T
        if isinstance(surface, Plane):
            flux = 0.5 * surface.normal[0] * normals[0]
            for along, normal in zip(surface.normal[1:], normals[1:], strict=True):
                if along:
                    flux += 0.5 * along * normal
            return flux
        x, y = (self._centres[k][part] - surface.axis_point[k] for k in (0, 1))
        square = x * x
        square += y * y
        np.maximum(square, self._nothing, out=square)
        x *= normals[0]
        y *= normals[1]
        x += y
        x *= 0.5
        x /= square
        return x

    def _from_afar(self, axes: Sequence[tuple[float, float]], part: slice) -> Floats:
        """Flux (a, c) of (x, y, 0) / rho² about axes beside the solid.

        With the faces at c and the axes at a, from the solid's middle, it is (c n - a n) / (c² - 2 a c + a²): products
        of matrices. Near an axis they would lose digits.
        """
        middle = self._middle
        x, y = (self._centres[k][part] - middle[k] for k in (0, 1))
        normal_x, normal_y = (self.mesh.normals[part, k] for k in (0, 1))
        above = np.stack([x * normal_x + y * normal_y, normal_x, normal_y])
        below = np.stack([x * x + y * y, x, y, np.ones(len(x))])
        away = np.asarray(axes) - middle
        flux = np.column_stack([np.full(len(away), 0.5), -0.5 * away]) @ above
        flux /= np.column_stack([np.ones(len(away)), -2.0 * away, (away**2).sum(axis=1)]) @ below
        return flux

    def _is_far(self, surface: Round) -> bool:
        """Whether a surface's axis passes the solid at some distance."""
        (x, y), (middle_x, middle_y) = surface.axis_point, self._middle.tolist()
        return math.hypot(x - middle_x, y - middle_y) > FAR_AXIS * self._around

    @cached_property
    def _around(self) -> float:
        return 0.5 * math.hypot(*np.ptp(self.mesh.bounds, axis=0)[:2])

    @cached_property
    def _middle(self) -> Floats:
        return np.asarray(self.mesh.bounds.mean(axis=0)[:2])

    @cached_property
    def _nothing(self) -> float:
        """Squared distance from an axis, mm², at which a face is on it."""
        return max(1e-9 * float((np.ptp(self.mesh.bounds, axis=0)[:2] ** 2).sum()), 1e-300)

    def _squares(self, axis: tuple[float, float]) -> Floats:
        """Squared distances (n,) of the vertices from an axis."""
        x, y = (self._places[k] - axis[k] for k in (0, 1))
        x *= x
        y *= y
        x += y
        return x

    def _heights(self, surface: Surface) -> Floats:
        """Heights (n,) of the vertices among the offsets of a surface (see `Plane.level`)."""
        if isinstance(surface, Plane):
            x, y, z = (n * place for n, place in zip(surface.normal, self._places, strict=True))
            x += y
            x += z
            return x
        if isinstance(surface, Cylinder):
            return np.sqrt(self._squares(surface.axis_point))
        return surface.distance(self.mesh.vertices) + surface.level

    def volume_beyond(self, surface: Surface) -> float:
        """Volume of the solid on the outer side of a surface, mm³."""
        small = self.fit_for(surface)
        if isinstance(surface, Plane):
            height = self._heights(surface) - surface.level
            above = self._touching(height > 0)
            mean = mean_above(self._of_corners(height, above))
            return float(0.5 * mean @ (self.mesh.normals[above] @ np.asarray(surface.normal)))
        if isinstance(surface, Cylinder):  # no centroid lies farther out than all of its corners
            faces = small._touching(small._squares(surface.axis_point) > surface.radius**2)
            radius = np.full(len(faces), surface.radius)
        else:
            faces = np.arange(len(small.mesh.faces))
            radius = surface.radius_at(small._centre_z)
        rho2, flux = small._about(surface.axis_point, faces)
        out = rho2 > radius**2
        return float((0.5 * (1.0 - radius[out] ** 2 / rho2[out]) * flux[out]).sum())

    def deepest(self, surface: Round, deeper_than_mm: float = math.inf) -> float:
        """Least distance from a round surface, mm, below 0 inside; of the axis where it enters the solid.

        It is exact where it is less than `deeper_than_mm`; else nothing is. Only faces are looked at that may reach
        deeper than that, and than their corners.
        """
        vertices = self.mesh.vertices
        height = surface.distance(vertices)
        least = float(height.min())
        if not isinstance(surface, Cylinder):  # for cylinders the sides tell
            least = min(least, float(surface.distance(self.fit_for(surface).mesh.vertices).min()))
        near = self._deeper(surface, height, min(least, deeper_than_mm))
        if len(near) == 0:
            return least
        corners = [vertices[column[near]] for column in self.mesh.corners]
        flat = [corner[:, :2] - surface.axis_point for corner in corners]
        points, turns = [], []
        for k in range(3):
            p, q = flat[k], flat[(k + 1) % 3]
            turns.append(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0])
            along = q - p
            with np.errstate(divide="ignore", invalid="ignore"):
                share = -(p * along).sum(axis=1) / (along**2).sum(axis=1)
            share = np.nan_to_num(np.clip(share, 0.0, 1.0))
            points.append(corners[k] + share[:, None] * (corners[(k + 1) % 3] - corners[k]))
        low, _, high = ascending(turns)
        centroids = (corners[0] + corners[1] + corners[2])[(low > 0) | (high < 0)] / 3.0
        points.append(centroids * (0.0, 0.0, 1.0) + (*surface.axis_point, 0.0))
        return min(least, float(surface.distance(np.concatenate(points)).min()))

    def _deeper(self, surface: Round, height: Floats, than_mm: float) -> Ints:
        """Faces (k,) that may reach deeper than a height, from the heights (n,) of the vertices."""
        centres, radii = self.mesh.bounding_spheres
        if not isinstance(surface, Cylinder):
            return np.flatnonzero(surface.distance(centres) - radii < than_mm)
        # a side of two radii's length between points so far from the axis comes no nearer to it than this; and a
        # triangle that the axis passes through has a corner nearer than two radii
        inner2 = max(surface.radius + than_mm, 0.0) ** 2
        distance, widest = height + surface.radius, float(radii.max(initial=0.0))
        near = self._touching((distance * distance < inner2 + widest**2) | (distance < 2.0 * widest))
        low, radii = ascending(self._of_corners(distance, near))[0], radii.take(near)
        return near[(low * low < inner2 + radii * radii) | (low < 2.0 * radii)]

    def area_on(self, surface: Surface, by_mm: float = 0.0, finer: float = 1.0) -> float:
        """Area of the solid's section by the offset of a surface, mm²; from faces `finer` times smaller than usual."""
        return float(self.areas_on([surface.offset(by_mm)], finer)[0])

    def areas_on(self, surfaces: Sequence[Surface], finer: float = 1.0) -> Floats:
        """The same of several surfaces (k,)."""
        rows: dict[object, list[int]] = {}
        for k, surface in enumerate(surfaces):
            rows.setdefault(surface.family, []).append(k)
        areas = np.zeros(len(surfaces))
        together: dict[SolidFlux, list[list[int]]] = {}
        for own in rows.values():
            own.sort(key=lambda k: surfaces[k].level)
            for first in range(0, len(own), MOST_LEVELS):
                part = own[first : first + MOST_LEVELS]
                together.setdefault(self.fit_for(surfaces[part[0]], finer), []).append(part)
        for flux, groups in together.items():
            for first in range(0, len(groups), MOST_FAMILIES):
                some = groups[first : first + MOST_FAMILIES]
                found = flux._areas_of([Family.of([surfaces[k] for k in group]) for group in some])
                for group, area in zip(some, found, strict=True):
                    areas[group] = area
        return areas

    def _areas_of(self, families: Sequence[Family]) -> list[Floats]:
        """Areas on the members of some families, from the faces as they are."""
        heights = [self._heights(family.surfaces[0]) for family in families]
        rank = _ranks(families, heights)
        areas = [np.zeros(len(family.levels)) for family in families]
        cut: list[list[tuple[Ints, Ints, Ints, Floats]]] = [[] for _ in families]
        for part in chunks(len(self.mesh.faces)):
            a, b, c = (rank.take(corner[part], axis=0) for corner in self.mesh.corners)
            below, last = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
            crossed = below != last
            whole = np.bitwise_or.reduce(last.view(f"u{last.shape[1]}").ravel())  # a row at one go
            beyond = np.flatnonzero(whole[None].view(np.uint8)).tolist()
            for k, flux in zip(beyond, self._fluxes([families[k].surfaces[0] for k in beyond], part), strict=True):
                first = below[:, k]
                areas[k] += families[k].whole(first, flux, self._centre_z[part] if families[k].is_turned else flux)
                some = np.flatnonzero(crossed[:, k])
                cut[k].append((part.start + some, first[some], last[some, k], flux[some]))
        for k, family in enumerate(families):
            if cut[k]:
                columns = [np.concatenate(column) for column in zip(*cut[k], strict=True)]
                areas[k] += self._parts(family, heights[k], *columns)
        return areas

    def _parts(self, family: Family, height: Floats, face: Ints, below: Ints, last: Ints, flux: Floats) -> Floats:
        """What faces (c,) cut by the levels below .. last - 1 add to the areas on a family's members."""
        times = last.astype(np.int64) - below
        row = np.repeat(np.arange(len(face)), times)
        by = np.arange(len(row)) - np.repeat(np.cumsum(times) - times - below, times)
        face, level = face[row], family.levels[by]
        share = share_above([column - level for column in self._of_corners(height, face)])
        return family.parts(by, share * flux[row], self._centre_z[face] if family.is_turned else share)


def _ranks(families: Sequence[Family], heights: Sequence[Floats]) -> npt.NDArray[np.uint8]:
    """How many levels of each family lie below each vertex (n, f): rows of 1, 2, 4 or 8 bytes, taken at one go."""
    width = 1 << (len(families) - 1).bit_length()
    rank = np.zeros((len(heights[0]), width), dtype=np.uint8)
    for k, (family, height) in enumerate(zip(families, heights, strict=True)):
        if len(family.levels) <= FEW_LEVELS:
            for level in family.levels.tolist():
                rank[:, k] += height > level
        else:
            rank[:, k] = np.searchsorted(family.levels, height)
    return rank


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
