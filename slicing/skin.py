"""The faces of a solid, small, and what is known from them alone: volumes and areas of sections, without any curve.

    skin = Skin.of(mesh)
    skin.volume_beyond(Cylinder((0.0, 0.0), 20.0))        # mm³ of the solid outside it
    skin.area_on(Cylinder((0.0, 0.0), 20.0), 1.73)        # mm² of its section by the cylinder 1.73 mm further out

Both are fluxes. What lies beyond a surface is bounded by the region on the surface and by the faces out there; a field
without divergence passes as much through the one as through the others. For a plane the field is its normal, for
surfaces of revolution (x, y, 0) / rho² about their axis, which passes a ring of radius r evenly. A field of divergence
1 that is zero on the surface gives the volume: (rho² - r²) / (2 rho²) (x, y, 0), or the height over a plane.

Faces are divided until a round surface leaves them by no more than SAG_MM. Those cut by the surface count by the
share of them beyond it, as if it were plane there. Faces are sorted by height once for each family of offsets.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from slicing.part import Floats, Ints, Mesh
from slicing.surfaces import Cone, Cylinder, Plane, Surface

SAG_MM = 0.02
ENOUGH_FACES, MOST_FACES = 6_000, 60_000


def radius_at(surface: Surface, z: Floats) -> Floats:
    """Radius (n,) of a surface of revolution at heights; 0 where there is nothing."""
    if isinstance(surface, Cylinder):
        return np.full(len(z), surface.radius)
    assert not isinstance(surface, Plane)
    chain = surface.chain(1e-3)
    radius = np.interp(z, chain.z, chain.r)
    below, above = chain.slope
    radius = np.where(z < chain.z[0], chain.r[0] + below * (z - chain.z[0]), radius)
    radius = np.where(z > chain.z[-1], chain.r[-1] + above * (z - chain.z[-1]), radius)
    return np.maximum(np.nan_to_num(radius), 0.0)


@dataclass(frozen=True, eq=False)
class Skin:
    """The faces of a solid.

    Attributes:
        vertices: (n, 3) mm.
        faces: (m, 3) vertex indices, outward.
    """

    vertices: Floats
    faces: Ints
    _families: dict[object, _Family] = field(default_factory=dict)

    @classmethod
    def of(cls, mesh: Mesh, finer: float = 1.0) -> Skin:
        """A mesh's faces, the large ones divided; `finer` times smaller than usual."""
        most = int(MOST_FACES * finer**2)
        if len(mesh.faces) >= most:
            return cls(mesh.vertices, mesh.faces)
        area = 0.5 * float(np.sqrt((mesh.normals**2).sum(axis=1)).sum())
        around = 0.5 * float(np.ptp(mesh.bounds, axis=0)[:2].max())
        limit = max(math.sqrt(8.0 * SAG_MM * around), math.sqrt(2.0 * area / ENOUGH_FACES)) / finer
        vertices, faces = mesh.vertices, mesh.faces
        done: list[Ints] = []
        while len(faces) and sum(map(len, done)) + len(faces) <= most:
            side = vertices[np.roll(faces, -1, axis=1)] - vertices[faces]
            length2 = (side**2).sum(axis=2)
            longest = np.argmax(length2, axis=1)
            large = length2.max(axis=1) > limit**2
            done.append(faces[~large])
            faces, longest = faces[large], longest[large]
            rows = np.arange(len(faces))
            a, b, c = (faces[rows, (longest + k) % 3] for k in range(3))
            middle = len(vertices) + rows
            vertices = np.concatenate([vertices, 0.5 * (vertices[a] + vertices[b])])
            faces = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
        return cls(vertices, np.concatenate([*done, faces]))

    @cached_property
    def _centres(self) -> Floats:
        return (self.vertices[self.faces[:, 0]] + self.vertices[self.faces[:, 1]] + self.vertices[self.faces[:, 2]]) / 3

    @cached_property
    def _vectors(self) -> Floats:
        """Normals (m, 3) as long as the faces are large, mm²."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return 0.5 * np.cross(b - a, c - a)

    def _about(self, axis: tuple[float, float]) -> tuple[Floats, Floats]:
        """Squared distance (m,) of the centres from an axis, and the flux (m,) of (x, y, 0) about it."""
        x, y = self._centres[:, 0] - axis[0], self._centres[:, 1] - axis[1]
        return x * x + y * y, x * self._vectors[:, 0] + y * self._vectors[:, 1]

    def volume_beyond(self, surface: Surface) -> float:
        """Volume of the solid on the outer side of a surface, mm³."""
        if isinstance(surface, Plane):
            height = np.maximum(surface.distance(self._centres), 0.0)
            return float(height @ (self._vectors @ np.asarray(surface.normal)))
        rho2, flux = self._about(surface.axis_point)
        radius = radius_at(surface, self._centres[:, 2])
        out = rho2 > radius**2
        return float((0.5 * (1.0 - radius[out] ** 2 / rho2[out]) * flux[out]).sum())

    def area_on(self, surface: Surface, by_mm: float = 0.0) -> float:
        """Area of the solid's section by the offset of a surface, mm²."""
        key, level = _family_of(surface)
        if key not in self._families:
            self._families[key] = _Family.of(self, surface, level)
        return self._families[key].area_at(surface.offset(by_mm), level + by_mm)


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
    """Faces by their height among the offsets of a surface, sorted by their lowest corners.

    Attributes:
        height: (m, 3) of the corners.
        low: (m,) lowest of them, ascending.
        high: (m,) highest.
        flux: (m,) of the field that passes the offsets evenly.
        z: (m,) heights of the centres along the axis.
    """

    height: Floats
    low: Floats
    high: Floats
    flux: Floats
    z: Floats

    @classmethod
    def of(cls, skin: Skin, surface: Surface, level: float) -> _Family:
        height = surface.distance(skin.vertices)[skin.faces] + level
        low = height.min(axis=1)
        order = np.argsort(low)
        if isinstance(surface, Plane):
            flux = skin._vectors @ np.asarray(surface.normal)
        else:
            rho2, flux = skin._about(surface.axis_point)
            flux = flux / np.maximum(rho2, 1e-9 * max(float(rho2.max()), 1e-300))
        return cls(height[order], low[order], height.max(axis=1)[order], flux[order], skin._centres[order, 2])

    @cached_property
    def _above(self) -> tuple[Floats, Floats]:
        """Flux, and flux times height along the axis, (m + 1,) of the faces from each on."""
        return self._sums(self.flux), self._sums(self.flux * self.z)

    @staticmethod
    def _sums(values: Floats) -> Floats:
        return np.append(np.cumsum(values[::-1])[::-1], 0.0)

    def area_at(self, surface: Surface, level: float) -> float:
        """Area of the section by the offset at a level, which is `surface`."""
        begin = int(np.searchsorted(self.low, level, side="right"))
        cut = np.flatnonzero(self.high[:begin] > level)
        share = _share_above(self.height[cut] - level)
        flux, moment = (float(v[begin]) for v in self._above)
        if isinstance(surface, Plane):
            return flux + float(share @ self.flux[cut])
        flux += float(share @ self.flux[cut])
        moment += float((share * self.flux[cut]) @ self.z[cut])
        if isinstance(surface, Cylinder):
            return surface.radius * flux
        if isinstance(surface, Cone):
            return (surface.radius * flux + surface.slope * moment) / math.cos(math.radians(surface.half_angle_deg))
        rows = np.append(np.arange(begin, len(self.z)), cut)
        weight = np.append(np.ones(len(self.z) - begin), share) * self.flux[rows]
        z, step = self.z[rows], 1e-4
        slope = (radius_at(surface, z + step) - radius_at(surface, z - step)) / (2.0 * step)
        return float((radius_at(surface, z) * np.hypot(1.0, slope)) @ weight)


def _share_above(heights: Floats) -> Floats:
    """How much of each face (m,) lies above 0, from the heights (m, 3) of its corners: some above, some not."""
    h1, h2, h3 = np.sort(heights, axis=1).T
    with np.errstate(divide="ignore", invalid="ignore"):
        one = h3 * h3 / ((h3 - h1) * (h3 - h2))
        two = 1.0 - h1 * h1 / ((h2 - h1) * (h3 - h1))
    return np.clip(np.nan_to_num(np.where(h2 > 0, two, one)), 0.0, 1.0)
