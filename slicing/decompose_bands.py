"""Cylinders and cones about the z axis, found in a mesh: which of its faces are turned about the axis.

A turned face is a facet of a cylinder or a cone about z: its plane touches the axis's circle squarely, within
half the angle of the coarsest polygon that still passes for round. Facets of one cylinder share their plane's
distance from the axis however the mesh is cut up, so they are gathered by (slope, distance) into *bands*:

    bands = find_bands(vertices, faces)          # frame: z is the axis; the largest first
    bands[0].band.radius_low, bands[0].coverage(0.0, 10.0)

Bores look inward and do not matter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from slicing.part import Bools, Floats, Ints

HALF_FACET_RAD = np.deg2rad(13.0)  # a body of fewer than 14 sides is no round one
STEEPEST = 0.1  # least radial part of a turned face's normal: cones up to 84° from the axis
SLOPE_WINDOW_RAD = np.deg2rad(2.5)
CYLINDER_RAD = np.deg2rad(1.0)
WINDOW_SHARE = 4e-3  # of the part's greatest radius: bands closer than this are one
LEAST_TURN = 0.55  # of 24 directions that a body's surface faces: rounded edges and ends are none
HINTED_TURN = 0.2  # where the radius is given
LEAST_COVERAGE = 0.1  # of the full turn: a band with less is no body's surface
MOST_BANDS = 60
SAME_PLANE = 2e-4  # unit normals and distances (as a share of the extent) of one plane


@dataclass(frozen=True)
class Band:
    """A cylinder or cone about z between two heights, as found in a mesh or as a section of a body.

    Attributes:
        low: its lower end, mm.
        high: its upper end, mm.
        radius_low: radius at the lower end, through the corners of the mesh, mm.
        radius_high: radius at the upper end, mm.
        flat_mm: how far the middles of its facets lie inside it.
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
    """

    band: Band
    faces: Ints
    face_low: Floats
    face_high: Floats
    face_area: Floats
    turn: float

    def is_round(self, least_turn: float = LEAST_TURN) -> bool:
        """A cylinder that goes far enough round the axis to be a body's surface."""
        return self.band.is_cylinder and self.goes_round(least_turn)

    def goes_round(self, least_turn: float) -> bool:
        """Enough of its surface is there, and a cylinder has enough directions and sides."""
        band = self.band
        if self.coverage(band.low, band.high) < 0.5 * LEAST_COVERAGE:
            return False
        sided = band.flat_mm <= (1.0 - np.cos(HALF_FACET_RAD)) * band.radius_low
        return not band.is_cylinder or bool(self.turn >= least_turn and sided)

    def coverage(self, low: float, high: float) -> float:
        """Share of the full turn that its faces cover between two heights (their area spread evenly over z)."""
        overlap = np.minimum(self.face_high, high) - np.maximum(self.face_low, low)
        height = np.maximum(self.face_high - self.face_low, 1e-12)
        part = self.band.between(low, high)
        slant = float(np.hypot(part.length, part.radius_high - part.radius_low))
        whole = 2 * np.pi * part.middle_radius * slant
        return float((self.face_area * np.clip(overlap / height, 0.0, 1.0)).sum() / max(whole, 1e-12))


@dataclass(frozen=True, eq=False)
class Facets:
    """Faces seen from the z axis: azimuth unit vector (m, 2), slope (m,), distance (m,) of the plane, area."""

    outward: Floats
    slope: Floats
    distance: Floats
    area: Floats
    centroid: Floats


def facets_of(vertices: Floats, faces: Ints) -> Facets:
    """Faces seen from the z axis.

    Args:
        vertices: (n, 3) mm, z the axis.
        faces: (m, 3).

    Returns:
        Per face; `distance` is that of the plane's horizontal line at the centroid's height, mm.
    """
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.sqrt((normal**2).sum(axis=1))
    across = np.hypot(normal[:, 0], normal[:, 1])
    outward = normal[:, :2] / np.maximum(across, 1e-300)[:, None]
    centroid = corners.mean(axis=1)
    distance = (outward * centroid[:, :2]).sum(axis=1)
    return Facets(outward, np.arctan2(normal[:, 2], across), distance, 0.5 * length, centroid)


def turned_faces(vertices: Floats, faces: Ints, facets: Facets) -> Bools:
    """Which faces (m,) are facets of outward-looking cylinders and cones about z.

    A face counts if all its corners lie within half a facet of where its plane is nearest to the axis. Small
    faces of a large flat do so as well, so a plane must pass as a whole.
    """
    corners = vertices[faces][:, :, :2]
    ahead = (corners * facets.outward[:, None]).sum(axis=2)
    aside = corners[:, :, 1] * facets.outward[:, None, 0] - corners[:, :, 0] * facets.outward[:, None, 1]
    square = (np.abs(aside) <= np.tan(HALF_FACET_RAD) * ahead).all(axis=1)
    turned = square & (np.cos(facets.slope) > STEEPEST) & (facets.distance > 0) & (facets.area > 0)
    extent = float(np.abs(vertices).max())
    offset = (facets.distance + np.tan(facets.slope) * facets.centroid[:, 2]) * np.cos(facets.slope)
    keys = np.round(np.column_stack([facets.outward, np.sin(facets.slope), offset / max(extent, 1e-300)]) / SAME_PLANE)
    plane = _numbered(keys)
    total = np.bincount(plane, facets.area)
    failing = np.bincount(plane, facets.area * ~turned)
    return turned & (failing <= 0.1 * total)[plane]


def _numbered(keys: Floats) -> Ints:
    """One number (m,) for each different row of whole numbers (m, k)."""
    order = np.lexsort(keys.T)
    new = np.append(False, (np.diff(keys[order], axis=0) != 0).any(axis=1))
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.cumsum(new)
    return number


def find_bands(vertices: Floats, faces: Ints, most: int = MOST_BANDS) -> list[FoundBand]:
    """Cylinders and cones about z that look outward.

    Args:
        vertices: (n, 3) mm, z the axis.
        faces: (m, 3), outward.
        most: how many to look for.

    Returns:
        Bands, the largest first.
    """
    facets = facets_of(vertices, faces)
    left = np.flatnonzero(turned_faces(vertices, faces, facets))
    reach = float(np.hypot(vertices[:, 0], vertices[:, 1]).max())
    window = WINDOW_SHARE * reach
    least = 1e-4 * float(facets.area.sum())
    offset = facets.distance * np.cos(facets.slope) + facets.centroid[:, 2] * np.sin(facets.slope)
    cell = _numbered(np.round(np.column_stack([facets.slope / SLOPE_WINDOW_RAD, offset / window])))
    bands: list[FoundBand] = []
    while len(left) and len(bands) < most:
        area = facets.area[left]
        chosen = _heaviest(facets.slope[left], offset[left], area, cell[left], window)
        members, left = left[chosen], left[~chosen]
        if area[chosen].sum() < least:
            break
        bands.append(fit_band(vertices, faces[members], members))
    return bands


def _heaviest(slope: Floats, offset: Floats, area: Floats, cell: Ints, window: float) -> Bools:
    """The faces around the place of (slope, offset) that holds the largest area."""
    near = cell == int(np.bincount(cell, area).argmax())
    for _ in range(3):  # the heaviest cell may hold only part of the band: move to where the area is
        weight = area[near] / area[near].sum()
        here = (np.abs(slope - weight @ slope[near]) <= SLOPE_WINDOW_RAD) & (
            np.abs(offset - weight @ offset[near]) <= window
        )
        near = here if here.any() else near
    return near


def fit_band(vertices: Floats, triangles: Ints, members: Ints) -> FoundBand:
    """The cylinder or cone through the outer corners of its faces.

    Args:
        vertices: (n, 3) mm, z the axis.
        triangles: (k, 3) its faces.
        members: (k,) what they are numbered in the mesh.

    Returns:
        The band.
    """
    facets = facets_of(vertices, triangles)
    area = facets.area
    weight = area / area.sum()
    slope = float(weight @ facets.slope)
    rise = 0.0 if abs(slope) < CYLINDER_RAD else -float(np.tan(slope))
    level = float(weight @ (facets.distance - rise * facets.centroid[:, 2]))
    corners = vertices[triangles]
    heights = corners[..., 2]
    line = np.maximum(level + rise * heights, 1e-3 * level)
    # corners lie outside the facets' middles by one factor, on a cone as on a cylinder
    beyond = np.hypot(corners[..., 0], corners[..., 1]) / line - 1.0
    top = beyond.max(axis=1)
    order = np.argsort(top)
    usual = float(top[order][np.searchsorted(np.cumsum(weight[order]), 0.9 - 1e-9).clip(max=len(top) - 1)])
    # the outermost corners; a face that strayed into the band does not count
    factor = 1.0 + float(beyond[beyond <= usual + 0.5 * abs(usual) + 1e-9].max(initial=usual))
    low, high = float(heights.min()), float(heights.max())
    first, last = ((level + rise * z) * factor for z in (low, high))
    # a dome is a stack of cones that its corners bulge out of
    over = 0.0 if rise == 0.0 else float(((1.0 + beyond - factor) * line).max())
    flat = max((factor - 1.0) / factor * 0.5 * (first + last), 0.0)
    band = Band(low, high, first, last, flat, float(area.sum()), over)
    return FoundBand(band, members, heights.min(axis=1), heights.max(axis=1), area, _turn(corners))


def _turn(corners: Floats) -> float:
    """Share of 24 directions about z in which triangles (k, 3, 3) are: their corners, middles of sides and centres."""
    places = np.concatenate([corners, 0.5 * (corners + np.roll(corners, 1, axis=1)), corners.mean(axis=1)[:, None]], 1)
    azimuth = np.arctan2(places[..., 1], places[..., 0])
    return len(np.unique(np.floor(azimuth * (12 / np.pi)).astype(np.int64).clip(-12, 11))) / 24
