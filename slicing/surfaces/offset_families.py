"""Offsets of one surface taken together, and what flux through the faces beyond them says of the areas on them.

    family = family_of([Cylinder((0.0, 0.0), 20.0), Cylinder((0.0, 0.0), 21.73)])
    family.whole(below, flux, z) + family.parts(by, flux, z)

`slicing.volume.solid_flux` tells which field passes a family evenly, and sums its flux over the faces; here that
becomes areas: on a cylinder the flux of (x, y, 0) / rho² is area by radius, on other surfaces of revolution by a
factor that changes with z. Faces beyond count whole, those cut by the share of them beyond.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..mesh.solid import Bools, Floats, Ints
from .profile import ProfileChain
from .surfaces import Cone, Cylinder, Plane, Revolved, Surface


@dataclass(frozen=True, eq=False)
class Family(ABC):
    """Offsets of one surface, k of them, and what flux says of the areas on them.

    Attributes:
        surfaces: k, ascending.
    """

    surfaces: Sequence[Any]

    @cached_property
    def levels(self) -> Floats:
        """How far out each lies (k,), mm."""
        return np.array([surface.level for surface in self.surfaces])

    @property
    def is_turned(self) -> bool:
        """Whether it matters at what height along the axis flux passes."""
        return not self.surfaces[0].is_straight

    @abstractmethod
    def whole(self, below: Ints, flux: Floats, z: Floats) -> Floats:
        """What faces add to the areas (k,).

        Args:
            below: (m,) how many levels each face lies beyond: the first so many.
            flux: (m,) through it.
            z: (m,) height along the axis, where that matters.
        """

    @abstractmethod
    def parts(self, by: Ints, flux: Floats, z: Floats) -> Floats:
        """What parts of faces add to the areas (k,): those (p,) beyond one level each, as above."""


class _SummedFamily(Family):
    """Members whose areas follow from the sums of their flux, and of its moment along the axis."""

    def whole(self, below: Ints, flux: Floats, z: Floats) -> Floats:
        """What faces add to the areas (k,)."""

        def beyond(values: Floats) -> Floats:
            if len(self.levels) == 1:
                return np.array([values @ below.astype(np.float64)])
            sums = np.bincount(below, values, len(self.levels) + 1)
            return np.asarray(np.cumsum(sums[::-1])[::-1][1:], dtype=np.float64)

        return self._areas(beyond(flux), beyond(flux * z) if self.is_turned else flux[:0])

    def parts(self, by: Ints, flux: Floats, z: Floats) -> Floats:
        """What parts of faces add to the areas (k,)."""

        def beyond(values: Floats) -> Floats:
            return np.asarray(np.bincount(by, values, len(self.levels)), dtype=np.float64)

        return self._areas(beyond(flux), beyond(flux * z) if self.is_turned else flux[:0])

    @abstractmethod
    def _areas(self, flux: Floats, moment: Floats) -> Floats:
        """Areas (k,) from the flux on each member, and its moment along the axis."""


class _ParallelPlanes(_SummedFamily):
    """Parallel planes: flux is area."""

    def _areas(self, flux: Floats, moment: Floats) -> Floats:
        return flux


class _CoaxialCylinders(_SummedFamily):
    """Cylinders about one axis: the flux of (x, y, 0) / rho² is area by radius."""

    def _areas(self, flux: Floats, moment: Floats) -> Floats:
        return self.levels * flux


class _CoaxialCones(_SummedFamily):
    """Cones of one angle about one axis: the radius grows with z."""

    def _areas(self, flux: Floats, moment: Floats) -> Floats:
        radius, cone = np.array([surface.radius for surface in self.surfaces]), self.surfaces[0]
        return np.asarray((radius * flux + cone.slope * moment) / math.cos(math.radians(cone.half_angle_deg)))


class _ProfileOffsets(Family):
    """Offsets of one profile: each stretches the flux of its own faces by a factor that changes with z."""

    @cached_property
    def _chains(self) -> Sequence[ProfileChain]:
        return [surface.chain(1e-3) for surface in self.surfaces]

    def whole(self, below: Ints, flux: Floats, z: Floats) -> Floats:
        """What faces add to the areas (k,)."""
        return self._stretched([below > k for k in range(len(self.levels))], flux, z)

    def parts(self, by: Ints, flux: Floats, z: Floats) -> Floats:
        """What parts of faces add to the areas (k,)."""
        return self._stretched([by == k for k in range(len(self.levels))], flux, z)

    def _stretched(self, rows: Sequence[Bools], flux: Floats, z: Floats) -> Floats:
        step, areas = 1e-4, np.zeros(len(self.levels))
        for k, (chain, own) in enumerate(zip(self._chains, rows, strict=True)):
            at = z[own]
            slope = (chain.radius_at(at + step) - chain.radius_at(at - step)) / (2.0 * step)
            areas[k] = (chain.radius_at(at) * np.hypot(1.0, slope)) @ flux[own]
        return areas


FAMILIES: dict[type, Callable[[Sequence[Any]], Family]] = {
    Plane: _ParallelPlanes,
    Cylinder: _CoaxialCylinders,
    Cone: _CoaxialCones,
    Revolved: _ProfileOffsets,
}


def family_of(surfaces: Sequence[Surface]) -> Family:
    """The family of its members.

    Args:
        surfaces: offsets of one another, ascending.
    """
    return FAMILIES[type(surfaces[0])](surfaces)


def ascending(columns: list[Floats]) -> tuple[Floats, Floats, Floats]:
    """The least, the middle and the greatest (m,) of three numbers each."""
    a, b, c = columns
    low, high = np.minimum(a, b), np.maximum(a, b)
    return np.minimum(low, c), np.maximum(low, np.minimum(high, c)), np.maximum(high, c)


def mean_above(heights: list[Floats]) -> Floats:
    """Mean over faces (m,) of their height where it is above 0, 0 where not, from the heights of their corners."""
    h1, h2, h3 = ascending(heights)
    with np.errstate(divide="ignore", invalid="ignore"):
        one = h3**3 / (3.0 * (h3 - h1) * (h3 - h2))  # what is above has heights 0, 0 and h3
        two = (h1 + h2 + h3) / 3.0 - h1**3 / (3.0 * (h2 - h1) * (h3 - h1))
    return np.where(h1 >= 0, (h1 + h2 + h3) / 3.0, np.nan_to_num(np.where(h2 > 0, two, one)))


def share_above(heights: list[Floats]) -> Floats:
    """How much of each face (m,) lies above 0, from the heights of its corners: some above, some not."""
    h1, h2, h3 = ascending(heights)
    with np.errstate(divide="ignore", invalid="ignore"):
        one = h3 * h3 / ((h3 - h1) * (h3 - h2))
        two = 1.0 - h1 * h1 / ((h2 - h1) * (h3 - h1))
    return np.clip(np.nan_to_num(np.where(h2 > 0, two, one)), 0.0, 1.0)
