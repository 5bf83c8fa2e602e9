"""Bands: cylinders and cones about the z axis between two heights, and how much of one is there in a mesh.

    band = Band(0.0, 40.0, 20.0, 22.0)
    band.radius_at(np.array([10.0])), band.is_cylinder
    found.goes_round(LEAST_TURN), found.coverage(0.0, 10.0)      # a FoundBand: with the faces that make it

They are found by `slicing.decomposition.turned_faces`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..mesh.solid import Floats, Ints

HALF_FACET_RAD = np.deg2rad(13.0)  # a body of 14 sides is a round one wherever it is seen
LEAST_TURN = 0.55  # of 24 directions that a body's surface faces: rounded edges and ends are none
LEAST_COVERAGE = 0.1  # of the full turn: a band with less is no body's surface
LONG_CONE = 0.25  # of its mean radius: a shorter one is a stretch of a dome
STEEP_CONE = 1.75  # rise over length: to 60 degrees from the axis
LEAST_SHARE_ON = 0.25  # of its corners' weight that lies on a band by which an axis is known


@dataclass(frozen=True)
class Band:
    """A cylinder or cone about z between two heights, as found in a mesh or as a section of a body.

    Attributes:
        low: its lower end, mm.
        high: its upper end, mm.
        radius_low: radius at the lower end, through the corners of the mesh, mm.
        radius_high: radius at the upper end, mm.
        flat_mm: how far the middles of its facets lie inside it, at its mean radius.
        area_mm2: of the faces that belong to it.
        over_mm: how far corners of the mesh stand outside it.
    """

    low: float
    high: float
    radius_low: float
    radius_high: float
    flat_mm: float = 0.0
    area_mm2: float = 0.0
    over_mm: float = 0.0

    @property
    def is_cylinder(self) -> bool:
        """The two radii are the same."""
        return self.radius_low == self.radius_high

    @property
    def length(self) -> float:
        """Along z, mm."""
        return self.high - self.low

    @property
    def slant(self) -> float:
        """Along its meridian, mm."""
        return float(np.hypot(self.length, self.radius_high - self.radius_low))

    @property
    def middle_radius(self) -> float:
        """Mean of the two radii, mm."""
        return 0.5 * (self.radius_low + self.radius_high)

    def radius_at(self, z: Floats) -> Floats:
        """Radius (n,) at heights (n,), mm, carried on beyond its ends."""
        rise = (self.radius_high - self.radius_low) / max(self.length, 1e-12)
        return self.radius_low + rise * (np.asarray(z) - self.low)

    def between(self, low: float, high: float) -> Band:
        """The same surface between other heights."""
        first, last = (float(self.radius_at(np.array(z))) for z in (low, high))
        return replace(self, low=low, high=high, radius_low=first, radius_high=last)


@dataclass(frozen=True, eq=False)
class FoundBand:
    """A band and the faces of the mesh that make it.

    Attributes:
        band: the cylinder or cone.
        faces: (k,) numbers in the mesh.
        face_low: (k,) their lowest z, mm.
        face_high: (k,) their highest.
        face_area: (k,) mm².
        turn: share of 24 directions about the axis in which it is there.
        within_mm: how close its corners lie to it.
        share: of the faces first taken for it, how much lies that close.
        half_facet_rad: half the angle of the coarsest polygon that passes for round.
    """

    band: Band
    faces: Ints
    face_low: Floats
    face_high: Floats
    face_area: Floats
    turn: float
    within_mm: float = 0.0
    share: float = 1.0
    half_facet_rad: float = HALF_FACET_RAD

    def is_round(self, least_turn: float = LEAST_TURN) -> bool:
        """A cylinder that goes far enough round the axis to be a body's surface."""
        return self.band.is_cylinder and self.goes_round(least_turn)

    def goes_round(self, least_turn: float) -> bool:
        """Enough of its surface is there, and a cylinder has enough directions and sides."""
        band = self.band
        if self.coverage(band.low, band.high) < 0.5 * LEAST_COVERAGE:
            return False
        sided = band.flat_mm <= (1.0 - np.cos(self.half_facet_rad)) * band.radius_low
        return not band.is_cylinder or bool(self.turn >= least_turn and sided)

    def is_body(self, least_turn: float = LEAST_TURN, least_share: float = LEAST_SHARE_ON) -> bool:
        """A cylinder or a long cone that goes far enough round the axis to be what an axis is known by."""
        band = self.band
        if self.share < least_share:
            return False
        if band.is_cylinder:
            return self.is_round(least_turn)
        least = min(band.radius_low, band.radius_high)
        rise = abs(band.radius_high - band.radius_low)
        sided = band.flat_mm <= (1.0 - np.cos(self.half_facet_rad)) * band.middle_radius
        long = np.hypot(band.length, rise) >= LONG_CONE * band.middle_radius and rise <= STEEP_CONE * band.length
        return bool(self.goes_round(least_turn) and self.turn >= least_turn and sided and long and least > 0)

    def coverage(self, low: float, high: float) -> float:
        """Share of the full turn that its faces cover between two heights (their area spread evenly over z)."""
        overlap = np.minimum(self.face_high, high) - np.maximum(self.face_low, low)
        height = np.maximum(self.face_high - self.face_low, 1e-12)
        part = self.band.between(low, high)
        whole = 2 * np.pi * part.middle_radius * part.slant
        return float((self.face_area * np.clip(overlap / height, 0.0, 1.0)).sum() / max(whole, 1e-12))
