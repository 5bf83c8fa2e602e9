"""The faces of a solid, small, and what is known from them alone: volumes and areas of sections, without any curve.

    skin = Skin.of(mesh)
    skin.volume_beyond(Cylinder((0.0, 0.0), 20.0))        # mm³ of the solid outside it
    skin.area_on(Cylinder((0.0, 0.0), 20.0), 1.73)        # mm² of its section by the cylinder 1.73 mm further out

Both are fluxes. What lies beyond a surface is bounded by the region on the surface and by the faces out there; a field
without divergence passes as much through the one as through the others. For a plane the field is its normal, for
surfaces of revolution (x, y, 0) / rho² about their axis, which passes a ring of radius r evenly. A field of divergence
1 that is zero on the surface gives the volume: (rho² - r²) / (2 rho²) (x, y, 0), or the height over a plane.

Faces are divided until a round surface leaves them by no more than SAG_MM: for cylinders only across the axis, for
planes not at all. Those cut by the surface count by the share of them beyond it, as if it were plane there. Heights and
fluxes of faces are found once for each family of offsets.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from slicing.meridian import Chain
from slicing.part import Bools, Floats, Ints, Mesh
from slicing.surfaces import Cone, Cylinder, Plane, Revolved, Round, Surface

SAG_MM = 0.02
LEVEL = 1e-9  # share of a normal that is rounding
ENOUGH_FACES, MOST_FACES = 6_000, 60_000


def radius_at(surface: Surface, z: Floats) -> Floats:
    """Radius (n,) of a surface of revolution at heights; 0 where there is nothing."""
    if isinstance(surface, Cylinder):
        return np.full(len(z), surface.radius)
    assert not isinstance(surface, Plane)
    return _along(surface.chain(1e-3), z)


def _along(chain: Chain, z: Floats) -> Floats:
    radius = np.interp(z, chain.z, chain.r)
    for end, slope, out in ((0, chain.slope[0], z < chain.z[0]), (-1, chain.slope[1], z > chain.z[-1])):
        radius[out] = chain.r[end] + slope * (z[out] - chain.z[end])
    return np.fmax(radius, 0.0)  # 0 for NaN


@dataclass(frozen=True, eq=False)
class Skin:
    """The faces of a solid.

    Attributes:
        vertices: (n, 3) mm.
        faces: (m, 3) vertex indices, outward.
        limit_mm: longest side where faces are divided; 0 where they are as they are.
    """

    vertices: Floats
    faces: Ints
    limit_mm: float = 0.0
    _families: dict[object, _Family] = field(default_factory=dict)
    _divided: dict[tuple[bool, float], Skin] = field(default_factory=dict)

    @classmethod
    def of(cls, mesh: Mesh) -> Skin:
        """A mesh's faces."""
        area = 0.5 * float(np.sqrt((mesh.normals**2).sum(axis=1)).sum())
        around = 0.5 * float(np.ptp(mesh.bounds, axis=0)[:2].max())
        limit = max(math.sqrt(8.0 * SAG_MM * around), math.sqrt(2.0 * area / ENOUGH_FACES))
        return cls(mesh.vertices, mesh.faces, limit)

    def fit_for(self, surface: Surface, finer: float = 1.0) -> Skin:
        """The faces as small as a surface needs them; `finer` times smaller than usual.

        None needs to be divided for planes, and none along the axis for cylinders. What faces straight along the axis
        passes nothing through round surfaces and is left out.
        """
        if isinstance(surface, Plane):
            return self
        key = (isinstance(surface, Cylinder), finer)
        if key not in self._divided:
            level = np.hypot(self._vectors[:, 0], self._vectors[:, 1]) > LEVEL * np.abs(self._vectors[:, 2])
            small = _divided(self.vertices, self.faces[level], self.limit_mm / finer, int(MOST_FACES * finer), key[0])
            self._divided[key] = Skin(*small)
        return self._divided[key]

    @cached_property
    def _centres(self) -> Floats:
        a, b, c = self._columns
        return np.asfortranarray((self.vertices[a] + self.vertices[b] + self.vertices[c]) / 3)

    @cached_property
    def _columns(self) -> tuple[Ints, Ints, Ints]:
        a, b, c = (np.ascontiguousarray(self.faces[:, k]) for k in range(3))
        return a, b, c

    @cached_property
    def _vectors(self) -> Floats:
        """Normals (m, 3) as long as the faces are large, mm²."""
        a, b, c = (self.vertices[column] for column in self._columns)
        return np.asfortranarray(0.5 * np.cross(b - a, c - a))

    def _about(self, axis: tuple[float, float]) -> tuple[Floats, Floats]:
        """Squared distance (m,) of the centres from an axis, and the flux (m,) of (x, y, 0) about it."""
        x, y = self._centres[:, 0] - axis[0], self._centres[:, 1] - axis[1]
        return x * x + y * y, x * self._vectors[:, 0] + y * self._vectors[:, 1]

    def volume_beyond(self, surface: Surface) -> float:
        """Volume of the solid on the outer side of a surface, mm³."""
        if isinstance(surface, Plane):
            heights = self._heights(surface)
            above = np.flatnonzero(np.maximum(np.maximum(heights[0], heights[1]), heights[2]) > 0)
            mean = _mean_above(np.stack([h[above] for h in heights], axis=1))
            return float(mean @ (self._vectors[above] @ np.asarray(surface.normal)))
        small = self.fit_for(surface) if self.limit_mm else self
        rho2, flux = small._about(surface.axis_point)
        radius = radius_at(surface, small._centres[:, 2])
        out = rho2 > radius**2
        return float((0.5 * (1.0 - radius[out] ** 2 / rho2[out]) * flux[out]).sum())

    def deepest(self, surface: Round) -> float:
        """Least distance from a round surface, mm, below 0 inside; of the axis where it enters the solid."""
        x, y = (self.vertices[:, k] - surface.axis_point[k] for k in (0, 1))
        points = [self.vertices]
        if not isinstance(surface, Cylinder):  # for cylinders the sides tell
            points.append(self.fit_for(surface).vertices)
        turns = []
        a, b, c = self._columns
        for p, q in ((a, b), (b, c), (c, a)):
            turns.append(x[p] * y[q] - x[q] * y[p])
            dx, dy = x[q] - x[p], y[q] - y[p]
            with np.errstate(divide="ignore", invalid="ignore"):
                share = np.nan_to_num(np.clip(-(x[p] * dx + y[p] * dy) / (dx * dx + dy * dy), 0.0, 1.0))
            points.append(self.vertices[p] + share[:, None] * (self.vertices[q] - self.vertices[p]))
        pierced = np.minimum(np.minimum(turns[0], turns[1]), turns[2]) > 0
        pierced |= np.maximum(np.maximum(turns[0], turns[1]), turns[2]) < 0
        points.append(self._centres[pierced] * (0.0, 0.0, 1.0) + (*surface.axis_point, 0.0))
        return float(surface.distance(np.concatenate(points)).min())

    def _heights(self, surface: Surface) -> list[Floats]:
        """Heights over a surface (m,) of each of the three corners of the faces."""
        height = surface.distance(self.vertices)
        return [height[column] for column in self._columns]

    def area_on(self, surface: Surface, by_mm: float = 0.0, finer: float = 1.0) -> float:
        """Area of the solid's section by the offset of a surface, mm²; from faces `finer` times smaller than usual."""
        return float(self.areas_on([surface.offset(by_mm)], finer)[0])

    def areas_on(self, surfaces: Sequence[Surface], finer: float = 1.0) -> Floats:
        """The same of several surfaces (k,)."""
        rows: dict[object, list[int]] = {}
        for k, surface in enumerate(surfaces):
            rows.setdefault(_family_of(surface)[0], []).append(k)
        areas = np.zeros(len(surfaces))
        for key, own in rows.items():
            members = [surfaces[k] for k in own]
            small = self.fit_for(members[0], finer) if self.limit_mm else self
            if key not in small._families:
                small._families[key] = _Family.of(small, members[0])
            areas[own] = small._families[key].areas_at(members)
        return areas


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


def _family_of(surface: Surface) -> tuple[object, float]:
    """What the offsets of a surface have in common, and how far out among them it lies."""
    if isinstance(surface, Plane):
        return surface.normal, float(np.dot(surface.point, surface.normal))
    if isinstance(surface, Cylinder):
        return surface.axis_point, surface.radius
    if isinstance(surface, Cone):
        return (surface.axis_point, surface.half_angle_deg), surface.radius * math.cos(
            math.radians(surface.half_angle_deg)
        )
    return (surface.axis_point, surface.profile), surface.offset_mm


@dataclass(frozen=True, eq=False)
class _Family:
    """Faces by their height among the offsets of a surface.

    Attributes:
        height: of their first, second and third corners, (m,) each.
        low: (m,) lowest of them.
        high: (m,) highest.
        flux: (m,) of the field that passes the offsets evenly.
        z: (m,) heights of the centres along the axis.
    """

    height: list[Floats]
    low: Floats
    high: Floats
    flux: Floats
    z: Floats

    @classmethod
    def of(cls, skin: Skin, surface: Surface) -> _Family:
        first, second, third = height = skin._heights(surface)
        level = _family_of(surface)[1]
        for column in height:
            column += level
        if isinstance(surface, Plane):
            flux = skin._vectors @ np.asarray(surface.normal)
        else:
            rho2, flux = skin._about(surface.axis_point)
            flux = flux / np.maximum(rho2, 1e-9 * max(float(rho2.max(initial=0.0)), 1e-300))
        low, high = np.minimum(np.minimum(first, second), third), np.maximum(np.maximum(first, second), third)
        return cls(height, low, high, flux, skin._centres[:, 2])

    def areas_at(self, surfaces: Sequence[Surface]) -> Floats:
        """Areas (k,) of the sections by some offsets."""
        level = np.array([_family_of(surface)[1] for surface in surfaces])
        order: Ints = np.argsort(level)
        ascending = level[order]
        # a face lies above all levels before `first`, and those before `last` cut it
        first, last = np.searchsorted(ascending, self.low), np.searchsorted(ascending, self.high)
        times = last - first
        cut = np.flatnonzero(times)
        times = times[cut]
        face = np.repeat(cut, times)
        by = np.arange(len(face)) - np.repeat(np.cumsum(times) - times - first[cut], times)
        share: Floats = _share_above(np.stack([column[face] - ascending[by] for column in self.height], axis=1))
        part = share * self.flux[face]
        if isinstance(surfaces[0], Revolved):
            turned = [self._turned(surfaces[i], first > k, face[by == k], part[by == k]) for k, i in enumerate(order)]
            return np.array(turned)[np.argsort(order)]

        def above(whole: Floats, parts: Floats) -> Floats:
            beyond = np.asarray(np.cumsum(np.bincount(first, whole, len(level) + 1)[::-1])[::-1][1:], dtype=np.float64)
            return np.asarray((beyond + np.bincount(by, parts, len(level)))[np.argsort(order)], dtype=np.float64)

        flux = above(self.flux, part)
        if isinstance(surfaces[0], Plane):
            return flux
        if isinstance(surfaces[0], Cylinder):
            return flux * [surface.radius for surface in surfaces if isinstance(surface, Cylinder)]
        cone, radius = surfaces[0], np.array([surface.radius for surface in surfaces if isinstance(surface, Cone)])
        moment = above(self.flux * self.z, part * self.z[face])
        return (radius * flux + cone.slope * moment) / math.cos(math.radians(cone.half_angle_deg))

    def _turned(self, surface: Revolved, above: Bools, face: Ints, part: Floats) -> float:
        """Area of the section by a surface whose radius changes with z."""
        whole = np.flatnonzero(above)
        z, weight = self.z[np.append(whole, face)], np.append(self.flux[whole], part)
        step, chain = 1e-4, surface.chain(1e-3)
        slope = (_along(chain, z + step) - _along(chain, z - step)) / (2.0 * step)
        return float((_along(chain, z) * np.hypot(1.0, slope)) @ weight)


def _mean_above(heights: Floats) -> Floats:
    """Mean over faces (m,) of their height where it is above 0, 0 where not, from the heights (m, 3) of corners."""
    h1, h2, h3 = np.sort(heights, axis=1).T
    with np.errstate(divide="ignore", invalid="ignore"):
        one = h3**3 / (3.0 * (h3 - h1) * (h3 - h2))  # what is above has heights 0, 0 and h3
        two = (h1 + h2 + h3) / 3.0 - h1**3 / (3.0 * (h2 - h1) * (h3 - h1))
    return np.where(h1 >= 0, (h1 + h2 + h3) / 3.0, np.nan_to_num(np.where(h2 > 0, two, one)))


def _share_above(heights: Floats) -> Floats:
    """How much of each face (m,) lies above 0, from the heights (m, 3) of its corners: some above, some not."""
    h1, h2, h3 = np.sort(heights, axis=1).T
    with np.errstate(divide="ignore", invalid="ignore"):
        one = h3 * h3 / ((h3 - h1) * (h3 - h2))
        two = 1.0 - h1 * h1 / ((h2 - h1) * (h3 - h1))
    return np.clip(np.nan_to_num(np.where(h2 > 0, two, one)), 0.0, 1.0)
