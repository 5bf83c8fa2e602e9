"""The outline of a round body: which faces of a mesh are turned about the z axis, and the profile they make.

A turned face is a facet of a cylinder or a cone about z: its plane touches the axis's circle squarely, within
half the angle of the coarsest polygon that still passes for round. Facets of one cylinder share their plane's
distance from the axis however the mesh is cut up, so they are gathered by (slope, distance) into *bands*.
Along z, the innermost band that looks outward is the body; what lies outside it stands on it:

    bands = find_bands(vertices, faces)          # frame: z is the axis
    profile = body_profile(bands)
    profile.radius_at(z), profile.sections       # cylinders and cones, lowest first

A section that sticks out farther than it is long is a flange: a ring that stands on the body, no step of it.
Bores look inward and do not matter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from slicing.part import Bools, Floats, Ints

HALF_FACET_RAD = np.deg2rad(13.0)  # a body of fewer than 14 sides is no round one
STEEPEST = 0.3  # least radial part of a turned face's normal: cones up to 72° from the axis
SLOPE_WINDOW_RAD = np.deg2rad(2.5)
CYLINDER_RAD = np.deg2rad(1.0)
WINDOW_SHARE = 4e-3  # of the part's greatest radius: bands closer than this are one
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
    """

    low: float
    high: float
    radius_low: float
    radius_high: float
    flat_mm: float = 0.0
    area_mm2: float = 0.0

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
    """A band and the faces (k,) of the mesh that make it."""

    band: Band
    faces: Ints
    face_low: Floats
    face_high: Floats
    face_area: Floats

    def coverage(self, low: float, high: float) -> float:
        """Share of the full turn that its faces cover between two heights (their area spread evenly over z)."""
        overlap = np.minimum(self.face_high, high) - np.maximum(self.face_low, low)
        height = np.maximum(self.face_high - self.face_low, 1e-12)
        part = self.band.between(low, high)
        slant = float(np.hypot(part.length, part.radius_high - part.radius_low))
        whole = 2 * np.pi * part.middle_radius * slant
        return float((self.face_area * np.clip(overlap / height, 0.0, 1.0)).sum() / max(whole, 1e-12))


@dataclass(frozen=True)
class Profile:
    """Outline of a body of revolution about z: sections without gaps, lowest first."""

    sections: tuple[Band, ...]

    @property
    def low(self) -> float:
        """Lower end, mm."""
        return self.sections[0].low

    @property
    def high(self) -> float:
        """Upper end, mm."""
        return self.sections[-1].high

    def section_at(self, z: Floats) -> Ints:
        """Number (n,) of the section at heights (n,), mm; the end ones beyond the ends."""
        joints = np.array([section.low for section in self.sections[1:]])
        return np.searchsorted(joints, z).astype(np.int64)

    def radius_at(self, z: Floats) -> Floats:
        """Radius (n,) of the body at heights (n,), mm."""
        numbers = self.section_at(z)
        radii = np.stack([section.radius_at(z) for section in self.sections])
        return np.take_along_axis(radii, numbers[None], axis=0)[0]

    def dominant(self) -> Band | None:
        """The cylinder with the largest area of the part's own faces; None if it has none."""
        totals: dict[float, float] = {}
        for section in self.sections:
            if section.is_cylinder:
                totals[section.radius_low] = totals.get(section.radius_low, 0.0) + section.area_mm2
        if not totals:
            return None
        best = max(totals, key=lambda radius: totals[radius])
        return next(s for s in self.sections if s.is_cylinder and s.radius_low == best)


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
    keys = np.round(
        np.column_stack([facets.outward, np.sin(facets.slope), offset / max(extent, 1e-300)]) / SAME_PLANE
    )
    _, plane = np.unique(keys, axis=0, return_inverse=True)
    total = np.bincount(plane.ravel(), facets.area)
    failing = np.bincount(plane.ravel(), facets.area * ~turned)
    return turned & (failing <= 0.1 * total)[plane.ravel()]


def find_bands(vertices: Floats, faces: Ints) -> list[FoundBand]:
    """Cylinders and cones about z that look outward.

    Args:
        vertices: (n, 3) mm, z the axis.
        faces: (m, 3), outward.

    Returns:
        Bands, the largest first.
    """
    facets = facets_of(vertices, faces)
    left = np.flatnonzero(turned_faces(vertices, faces, facets))
    reach = float(np.hypot(vertices[:, 0], vertices[:, 1]).max())
    window = WINDOW_SHARE * reach
    least = 1e-4 * float(facets.area.sum())
    offset = facets.distance * np.cos(facets.slope) + facets.centroid[:, 2] * np.sin(facets.slope)
    bands = []
    for _ in range(MOST_BANDS):
        if len(left) == 0:
            break
        chosen = _heaviest(facets.slope[left], offset[left], facets.area[left], window)
        members, left = left[chosen], left[~chosen]
        if facets.area[members].sum() < least:
            break
        bands.append(_fit_band(vertices, faces[members], members, facets))
    return bands


def _heaviest(slope: Floats, offset: Floats, area: Floats, window: float) -> Bools:
    """The faces around the place of (slope, offset) that holds the largest area."""
    cells = np.round(np.column_stack([slope / SLOPE_WINDOW_RAD, offset / window]))
    _, cell = np.unique(cells, axis=0, return_inverse=True)
    cell = cell.ravel()
    near = cell == int(np.bincount(cell, area).argmax())
    for _ in range(3):  # the heaviest cell may hold only part of the band: move to where the area is
        weight = area[near] / area[near].sum()
        here = (np.abs(slope - weight @ slope[near]) <= SLOPE_WINDOW_RAD) & (
            np.abs(offset - weight @ offset[near]) <= window
        )
        near = here if here.any() else near
    return near


def _fit_band(vertices: Floats, triangles: Ints, members: Ints, facets: Facets) -> FoundBand:
    """The cylinder or cone through the outer corners of its faces."""
    area = facets.area[members]
    weight = area / area.sum()
    slope = float(weight @ facets.slope[members])
    rise = 0.0 if abs(slope) < CYLINDER_RAD else -float(np.tan(slope))
    level = float(weight @ (facets.distance[members] - rise * facets.centroid[members, 2]))
    corners = vertices[triangles]
    above = np.hypot(corners[..., 0], corners[..., 1]) - level - rise * corners[..., 2]
    top = above.max(axis=1)
    order = np.argsort(top)
    usual = float(top[order][np.searchsorted(np.cumsum(weight[order]), 0.9 - 1e-9).clip(max=len(top) - 1)])
    # the outermost corners; a face that strayed into the band does not count
    flat = float(above[above <= usual + 0.5 * abs(usual) + 1e-9].max(initial=usual))
    low, high = float(corners[..., 2].min()), float(corners[..., 2].max())
    base = level + flat
    band = Band(low, high, base + rise * low, base + rise * high, max(flat, 0.0), float(area.sum()))
    return FoundBand(band, members, corners[..., 2].min(axis=1), corners[..., 2].max(axis=1), area)


def body_profile(bands: list[FoundBand], radius_mm: float | None = None) -> Profile | None:
    """The body's outline: along z the innermost band, flanges left out.

    Args:
        bands: of the part.
        radius_mm: of the body where it is known: larger sections then stand on it, and it wins over inner
            ones.

    Returns:
        The profile, or None if no band is wide enough round the axis.
    """
    found = [f for f in bands if f.coverage(f.band.low, f.band.high) >= 0.5 * LEAST_COVERAGE]
    if not found:
        return None
    heights = np.sort([z for f in found for z in (f.band.low, f.band.high)])
    least = 1e-5 * max(float(heights[-1] - heights[0]), 1e-9)
    heights = heights[np.append(True, np.diff(heights) > least)]
    sections: list[Band] = []
    for low, high in zip(heights[:-1], heights[1:], strict=True):
        section = _innermost(found, float(low), float(high), radius_mm)
        if section is not None:
            sections.append(section)
    sections = _joined(sections)
    if radius_mm is None:
        sections = _without_flanges(sections)
    else:
        sections = _without_larger(sections, radius_mm)
    return Profile(tuple(sections)) if sections else None


def _innermost(found: list[FoundBand], low: float, high: float, radius_mm: float | None) -> Band | None:
    """The innermost band between two heights, of the given radius where it is there."""
    best: Band | None = None
    for f in found:
        cover = f.coverage(low, high)
        if cover < LEAST_COVERAGE or min(high, f.band.high) - max(low, f.band.low) < 0.5 * (high - low):
            continue
        part = f.band.between(low, high)
        part = replace(part, area_mm2=cover * 2 * np.pi * part.middle_radius * part.length)
        if radius_mm is not None and part.is_cylinder and part.radius_low == radius_mm:
            return part
        if best is None or part.middle_radius < best.middle_radius:
            best = part
    return best


def _joined(sections: list[Band]) -> list[Band]:
    """Sections of the same surface made one; gaps closed by the wider neighbour's narrower end."""
    joined: list[Band] = []
    for section in sections:
        if not joined:
            joined.append(section)
            continue
        before = joined[-1]
        if section.low > before.high and not _same(before, section):
            # a stretch hidden all round: the narrower neighbour goes on under it
            if before.radius_high <= section.radius_low:
                filler = Band(before.high, section.low, before.radius_high, before.radius_high, before.flat_mm)
            else:
                filler = Band(before.high, section.low, section.radius_low, section.radius_low, section.flat_mm)
            joined += [filler]
            before = filler
        if _same(before, section):
            area = before.area_mm2 + section.area_mm2
            joined[-1] = replace(before.between(before.low, section.high), area_mm2=area)
        else:
            joined.append(section)
    return joined


def _same(a: Band, b: Band) -> bool:
    """Two sections lie on one surface (carried on as far as the other's ends)."""
    ends = np.array([b.low, b.high])
    here, there = a.radius_at(ends), b.radius_at(ends)
    return bool((np.abs(here - there) <= 1e-9 * a.middle_radius).all())


def _without_flanges(sections: list[Band]) -> list[Band]:
    """Leave out sections that stick out farther than they are long, the shortest first."""
    while len(sections) > 1:
        flanges = []
        for k, section in enumerate(sections):
            beside = [
                *([sections[k - 1].radius_high] if k else []),
                *([sections[k + 1].radius_low] if k + 1 < len(sections) else []),
            ]
            height = min(section.radius_low, section.radius_high) - max(beside)
            if section.is_cylinder and height > section.length:
                flanges.append((section.length, k))
        if not flanges:
            break
        sections = _bridged(sections, min(flanges)[1])
    return sections


def _without_larger(sections: list[Band], radius_mm: float) -> list[Band]:
    """Leave out what is wider than the body is said to be."""
    while True:
        larger = [k for k, s in enumerate(sections) if max(s.radius_low, s.radius_high) > radius_mm]
        if not larger or len(sections) == 1:
            return sections
        narrow = [k for k in larger if k - 1 not in larger or k + 1 not in larger]  # from the edges inward
        sections = _bridged(sections, narrow[0])


def _bridged(sections: list[Band], k: int) -> list[Band]:
    """The sections without the k-th, its neighbours carried on in its place."""
    gone, before, after = sections[k], sections[:k], sections[k + 1 :]
    if not before:
        radius = after[0].radius_low
    elif not after:
        radius = before[-1].radius_high
    else:
        radius = min(before[-1].radius_high, after[0].radius_low)
    filler = Band(gone.low, gone.high, radius, radius)
    return _joined([*before, filler, *after])
