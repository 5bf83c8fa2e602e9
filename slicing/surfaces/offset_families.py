"""Offsets of one surface taken together, and what flux through the faces beyond them says of the areas on them.

    family = Family.of([Cylinder((0.0, 0.0), 20.0), Cylinder((0.0, 0.0), 21.73)])
    family.whole(below, flux, z) + family.parts(by, flux, z)

`slicing.volume.solid_flux` tells which field passes a family evenly, and sums its flux over the faces; here that
becomes areas: on a cylinder the flux of (x, y, 0) / rho² is area by radius, on other surfaces of revolution by a
factor that changes with z. Faces beyond count whole, those cut by the share of them beyond.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..mesh.solid import Bools, Floats, Ints
from .profile import ProfileChain
from .surfaces import Cone, Cylinder, Plane, Revolved, Surface


@dataclass(frozen=True, eq=False)
class Family:
    """Offsets of one surface, k of them, and what flux says of the areas on them.

    Attributes:
        surfaces: k, ascending.
        levels: (k,) how far out each lies.
        chains: profiles of those whose radius changes with z by more than a slope.
    """

    surfaces: Sequence[Surface]
    levels: Floats
    chains: Sequence[ProfileChain]

    @classmethod
    def of(cls, surfaces: Sequence[Surface]) -> Family:
        """A family of its members, ascending."""
        chains = [surface.chain(1e-3) for surface in surfaces if isinstance(surface, Revolved)]
        return cls(surfaces, np.array([surface.level for surface in surfaces]), chains)

    @property
    def is_turned(self) -> bool:
        """Whether it matters at what height along the axis flux passes."""
        return not self.surfaces[0].is_straight

    def whole(self, below: Ints, flux: Floats, z: Floats) -> Floats:
        """What faces add to the areas (k,).

        Args:
            below: (m,) how many levels each face lies beyond: the first so many.
            flux: (m,) through it.
            z: (m,) height along the axis, where that matters.
        """
        if self.chains:
            return self._stretched([below > k for k in range(len(self.levels))], flux, z)

        def beyond(values: Floats) -> Floats:
            if len(self.levels) == 1:
                return np.array([values @ below.astype(np.float64)])
            sums = np.bincount(below, values, len(self.levels) + 1)
            return np.asarray(np.cumsum(sums[::-1])[::-1][1:], dtype=np.float64)

        return self._weighed(beyond(flux), beyond(flux * z) if self.is_turned else flux[:0])

    def parts(self, by: Ints, flux: Floats, z: Floats) -> Floats:
        """What parts of faces add to the areas (k,): those (p,) beyond one level each, as above."""
        if self.chains:
            return self._stretched([by == k for k in range(len(self.levels))], flux, z)

        def beyond(values: Floats) -> Floats:
            return np.asarray(np.bincount(by, values, len(self.levels)), dtype=np.float64)

        return self._weighed(beyond(flux), beyond(flux * z) if self.is_turned else flux[:0])

    def _weighed(self, flux: Floats, moment: Floats) -> Floats:
        """Areas (k,) from the flux on each member, and its moment along the axis."""
        if isinstance(self.surfaces[0], Plane):
            return flux
        radius = np.array([surface.radius for surface in self.surfaces if isinstance(surface, Cylinder | Cone)])
        if isinstance(self.surfaces[0], Cone):
            cone = self.surfaces[0]
            return (radius * flux + cone.slope * moment) / math.cos(math.radians(cone.half_angle_deg))
        return radius * flux

    def _stretched(self, rows: Sequence[Bools], flux: Floats, z: Floats) -> Floats:
        """The same where each member stretches the flux of its own rows by a factor that changes with z."""
        step, areas = 1e-4, np.zeros(len(self.chains))
        for k, (chain, own) in enumerate(zip(self.chains, rows, strict=True)):
            at = z[own]
            slope = (chain.radius_at(at + step) - chain.radius_at(at - step)) / (2.0 * step)
            areas[k] = (chain.radius_at(at) * np.hypot(1.0, slope)) @ flux[own]
        return areas


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
