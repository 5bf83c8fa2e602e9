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

Every face is examined for every family of offsets, but only those that a level cuts closely: the number of levels
below a vertex says of all others how many they lie beyond. Sums over faces are taken by columns (see
`slicing.mesh.face_measures`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..mesh.face_measures import chunks
from ..mesh.solid import Floats, Ints
from ..surfaces.offset_families import Family, ascending, family_of, share_above
from ..surfaces.surfaces import Round, Surface
from .flux_fields import field_of, round_field_of
from .solid_faces import SolidFaces

FAR_AXIS = 1.1  # an axis this often as far from the solid's middle as its corners is beside it
MOST_LEVELS, MOST_FAMILIES = 255, 8  # that are examined together: how many lie below a vertex is one byte each
FEW_LEVELS = 6  # up to here comparing is faster than searching


@dataclass(frozen=True, eq=False)
class SolidFlux(SolidFaces):
    """The faces of a solid, and what fluxes through them say of it."""

    def _fluxes(self, surfaces: Sequence[Surface], part: slice) -> list[Floats]:
        """Flux (c,) through some faces of the fields that pass surfaces and their offsets evenly, of each surface."""
        far = [axis for surface in surfaces for axis in surface.axis_points if self._is_far(axis)]
        if len(far) < 2:
            return [field_of(surface).evenly(self, part) for surface in surfaces]
        rows = dict(zip(far, self._from_afar(far, part), strict=True))
        found = []
        for surface in surfaces:
            row = next((rows[axis] for axis in surface.axis_points if axis in rows), None)
            found.append(field_of(surface).evenly(self, part) if row is None else row)
        return found

    def _from_afar(self, axes: Sequence[tuple[float, float]], part: slice) -> Floats:
        """Flux (a, c) of (x, y, 0) / rho² about axes beside the solid.

        With the faces at c and the axes at a, from the solid's middle, it is (c n - a n) / (c² - 2 a c + a²): products
        of matrices. Near an axis they would lose digits.
        """
        middle = self.middle
        x, y = (self.centres[k][part] - middle[k] for k in (0, 1))
        normal_x, normal_y = (self.mesh.normals[part, k] for k in (0, 1))
        above = np.stack([x * normal_x + y * normal_y, normal_x, normal_y])
        below = np.stack([x * x + y * y, x, y, np.ones(len(x))])
        away = np.asarray(axes) - middle
        flux = np.column_stack([np.full(len(away), 0.5), -0.5 * away]) @ above
        flux /= np.column_stack([np.ones(len(away)), -2.0 * away, (away**2).sum(axis=1)]) @ below
        return flux

    def _is_far(self, axis: tuple[float, float]) -> bool:
        """Whether an axis passes the solid at some distance."""
        (x, y), (middle_x, middle_y) = axis, self.middle.tolist()
        return math.hypot(x - middle_x, y - middle_y) > FAR_AXIS * self.around

    def volume_beyond(self, surface: Surface) -> float:
        """Volume of the solid on the outer side of a surface, mm³."""
        return field_of(surface).volume_beyond(self.fit_for(surface))

    def deepest(self, surface: Round, deeper_than_mm: float = math.inf) -> float:
        """Least distance from a round surface, mm, below 0 inside; of the axis where it enters the solid.

        It is exact where it is less than `deeper_than_mm`; else nothing is. Only faces are examined that may reach
        deeper than that, and than their corners.
        """
        vertices = self.mesh.vertices
        height = surface.distance(vertices)
        least = float(height.min())
        if not surface.is_straight:  # for cylinders the sides tell
            least = min(least, float(surface.distance(self.fit_for(surface).mesh.vertices).min()))
        near = round_field_of(surface).may_lie_deeper(self, height, min(least, deeper_than_mm))
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
                found = flux._areas_of([family_of([surfaces[k] for k in group]) for group in some])
                for group, area in zip(some, found, strict=True):
                    areas[group] = area
        return areas

    def _areas_of(self, families: Sequence[Family]) -> list[Floats]:
        """Areas on the members of some families, from the faces as they are."""
        heights = [field_of(family.surfaces[0]).heights(self) for family in families]
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
                areas[k] += families[k].whole(first, flux, self.centre_z[part] if families[k].is_turned else flux)
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
        share = share_above([column - level for column in self.of_corners(height, face)])
        return family.parts(by, share * flux[row], self.centre_z[face] if family.is_turned else share)


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
