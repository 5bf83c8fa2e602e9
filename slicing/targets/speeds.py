"""How fast a bead is laid, by its thickness: at one feed of wire, a thicker bead is a slower one.

Use:

    BeadSpeed(8.0).at(thickness)                                     # the same everywhere
    BeadSpeed(8.0, ((1.4, 10.0), (2.2, 6.0))).at(thickness)          # between the rows by interpolation, ends held
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..mesh.solid import Floats, PartError

DEFAULT_MM_S = 8.0


@dataclass(frozen=True)
class BeadSpeed:
    """Deposition speed by thickness.

    Attributes:
        constant_mm_s: where there is no table.
        by_thickness: rows of thickness (mm, growing) and speed (mm/s); empty: constant.
    """

    constant_mm_s: float = DEFAULT_MM_S
    by_thickness: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        speeds = [self.constant_mm_s, *(speed for _, speed in self.by_thickness)]
        if not all(math.isfinite(v) and v > 0 for v in speeds):
            raise PartError("speed_by_thickness: speeds must be above 0 mm/s")
        if not all(math.isfinite(t) and t >= 0 for t, _ in self.by_thickness):
            raise PartError("speed_by_thickness: thicknesses must not be below 0 mm")
        if not all(a[0] < b[0] for a, b in pairwise(self.by_thickness)):
            raise PartError("speed_by_thickness: thicknesses must grow from row to row")

    def at(self, thickness_mm: Floats) -> Floats:
        """Speeds at thicknesses of the bead.

        Args:
            thickness_mm: of the bead, (n,), mm.

        Returns:
            Speeds, (n,), mm/s.
        """
        if not self.by_thickness:
            return np.full(len(thickness_mm), self.constant_mm_s)
        thickness, speed = np.array(self.by_thickness).T
        return np.interp(thickness_mm, thickness, speed)
