"""The outline of a round body: cylinders and cones about its axis, one after the other along z.

Along z, the innermost band of the mesh that looks outward (`slicing.decomposition.turned_faces`) is the body; what lies
outside it stands on it:

    bands = find_bands(PartFaces.of(vertices, faces, noise_mm))     # frame: z is the axis
    outline = body_outline(bands)
    outline.radius_at(z), outline.sections                  # lowest first

A section that sticks out farther than it is long is a flange: a ring that stands on the body, no step of it. Not so
what grooves leave of a bar (`slicing.decomposition.lands`).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..mesh.solid import Floats, Ints
from .bands import LEAST_COVERAGE, LEAST_TURN, Band, FoundBand
from .lands import is_land
from .turned_faces import HINTED_TURN

SAME_POINT_MM, SAME_POINT = 1e-5, 1e-6  # points of an outline closer than this (and that share of r) are one
SHORT_AND_HIGH = 0.999  # of its length: a ring that stands out this far is a flange
NO_CYLINDER = 1e-2  # of how far a flank has come down: a shorter cylinder does not end it
SHORT_GAP = 0.05  # of the radius: what is not seen there is no hidden step


@dataclass(frozen=True)
class Outline:
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

    @property
    def widest(self) -> float:
        """Its greatest radius, mm."""
        return max(max(section.radius_low, section.radius_high) for section in self.sections)

    @property
    def points(self) -> tuple[tuple[float, float], ...]:
        """Its polyline, (r, z) in mm, lowest first; at a step two points at one height."""
        kept: list[tuple[float, float]] = []
        exact = False  # cylinders' radii are rounded, cones' are as fitted: where they meet the cylinder's counts
        for section in self.sections:
            for r, z in ((section.radius_low, section.low), (section.radius_high, section.high)):
                if kept and max(abs(r - kept[-1][0]), abs(z - kept[-1][1])) <= SAME_POINT_MM + SAME_POINT * r:
                    kept[-1] = kept[-1] if exact else (r, z)
                else:
                    kept.append((r, z))
                exact = section.is_cylinder
        return tuple(kept)

    def section_at(self, z: Floats) -> Ints:
        """Number (n,) of the section at heights (n,), mm; the end ones beyond the ends."""
        joints = np.array([section.low for section in self.sections[1:]])
        return np.searchsorted(joints, z).astype(np.int64)

    def radius_at(self, z: Floats) -> Floats:
        """Radius (n,) of the body at heights (n,), mm."""
        numbers = self.section_at(z)
        radii = np.stack([section.radius_at(z) for section in self.sections])
        return np.take_along_axis(radii, numbers[None], axis=0)[0]

    def lifted(self, height: float) -> Outline:
        """The outline moved along z by a height, mm."""
        return Outline(tuple(replace(s, low=s.low + height, high=s.high + height) for s in self.sections))

    def off(self, r: Floats, z: Floats) -> Floats:
        """Distances (n,) of points (r, z), mm, from the body of revolution; 0 within it."""
        points = [(0.0, self.low), *((r, z) for s in self.sections for r, z in _ends(s)), (0.0, self.high)]
        a = np.array(points)
        best = np.full(len(r), np.inf)
        for (r0, z0), (r1, z1) in itertools.pairwise(a.tolist()):
            run = (r1 - r0) ** 2 + (z1 - z0) ** 2
            t = np.clip(((r - r0) * (r1 - r0) + (z - z0) * (z1 - z0)) / max(run, 1e-300), 0.0, 1.0)
            best = np.minimum(best, np.hypot(r - r0 - t * (r1 - r0), z - z0 - t * (z1 - z0)))
        inside = (z >= self.low) & (z <= self.high) & (r <= self.radius_at(z))
        return np.where(inside, 0.0, best)

    def dominant(self) -> Band | None:
        """The cylinder with the largest area of the part's own faces; the largest cone where there is none."""
        totals: dict[float, float] = {}
        for section in self.sections:
            if section.is_cylinder:
                totals[section.radius_low] = totals.get(section.radius_low, 0.0) + section.area_mm2
        if not totals:
            return max(self.sections, key=lambda s: s.area_mm2) if self.sections[0].area_mm2 else None
        best = max(totals, key=lambda radius: totals[radius])
        return next(s for s in self.sections if s.is_cylinder and s.radius_low == best)


def _ends(section: Band) -> tuple[tuple[float, float], tuple[float, float]]:
    """The (r, z) points of a section."""
    return (section.radius_low, section.low), (section.radius_high, section.high)


def body_outline(bands: list[FoundBand], radius_mm: float | None = None) -> Outline | None:
    """The body's outline: along z the innermost band, flanges left out.

    Args:
        bands: of the part.
        radius_mm: of the body where it is known: larger sections then stand on it, and it wins over inner
            ones.

    Returns:
        The outline, or None if no band is wide enough round the axis.
    """
    found = [f for f in bands if f.goes_round(LEAST_TURN if radius_mm is None else HINTED_TURN)]
    if not found:
        return None
    heights = np.sort([z for f in found for z in (f.band.low, f.band.high, *_gaps(f))])
    least = 1e-5 * max(float(heights[-1] - heights[0]), 1e-9)
    heights = heights[np.append(True, np.diff(heights) > least)]
    sections: list[Band] = []
    for low, high in itertools.pairwise(heights.tolist()):
        section = _innermost(found, low, high, radius_mm)
        if section is not None:
            sections.append(section)
    sections = _joined(sections)
    sections = _without_flanges(sections) if radius_mm is None else _without_larger(sections, radius_mm)
    return Outline(tuple(sections)) if sections else None


def _gaps(f: FoundBand) -> list[float]:
    """Heights at which stretches of a band begin and end that are hardly there: the lands between two grooves."""
    ends = np.concatenate([f.face_low, f.face_high])
    density = f.face_area / np.maximum(f.face_high - f.face_low, 1e-12)
    order = np.argsort(ends)
    z, there = ends[order], np.cumsum(np.concatenate([density, -density])[order])
    part = 2 * np.pi * f.band.radius_at(z) * f.band.slant / max(f.band.length, 1e-12)
    # what lies between two ends that are one but for rounding is no stretch
    bare = (there[:-1] < LEAST_COVERAGE * part[:-1]) & (np.diff(z) > 1e-5 * max(f.band.length, 1e-9))
    edges = np.flatnonzero(np.diff(np.concatenate([[0], bare.astype(np.int8), [0]])))
    return [float(v) for k, v in zip(edges, z[edges], strict=True) if 0 < k < len(z) - 1]


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
            if section.low - before.high < SHORT_GAP * min(before.radius_high, section.radius_low):
                filler = Band(before.high, section.low, before.radius_high, section.radius_low, before.flat_mm)
            elif before.radius_high <= section.radius_low:
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


@dataclass(frozen=True)
class OutlineBump:
    """A stretch of an outline that is wider than what is beside it.

    Attributes:
        low: where it begins to stand out, mm.
        high: where it ends.
        base: radius of what it stands on: the wider of its two feet.
        top: its greatest radius.
        length: its length at half its height.
        between: it has a foot on either side.
    """

    low: float
    high: float
    base: float
    top: float
    length: float
    between: bool

    @property
    def is_flange(self) -> bool:
        """It stands out at least as far as it is long."""
        return self.top - self.base >= SHORT_AND_HIGH * self.length


def hills(sections: Sequence[Band]) -> list[OutlineBump]:
    """The stretches of an outline that are wider than what is beside them, lowest first.

    Args:
        sections: of the outline.

    Returns:
        Cylinders and ridges that have a foot on one side or both.
    """
    z = np.array([v for s in sections for v in (s.low, s.high)])
    r = np.array([v for s in sections for v in (s.radius_low, s.radius_high)])
    slack = SAME_POINT * float(r.max())
    found: list[OutlineBump] = []
    k = 0
    while k < len(r):
        last = k
        while last + 1 < len(r) and abs(r[last + 1] - r[k]) <= slack:
            last += 1
        i, j = k, last
        while i > 0 and _falls(r[k], (r[i], r[i - 1]), z[i] - z[i - 1], slack):
            i -= 1
        while j + 1 < len(r) and _falls(r[k], (r[j], r[j + 1]), z[j + 1] - z[j], slack):
            j += 1
        feet = [float(r[n]) for n in (i, j) if r[n] < r[k] - slack]
        highest = not ((k > 0 and r[k - 1] > r[k] + slack) or (last + 1 < len(r) and r[last + 1] > r[k] + slack))
        if feet and highest and (len(feet) == 2 or z[last] > z[k]):
            found.append(_hill(z[i : j + 1], r[i : j + 1], max(feet), len(feet) == 2))
        k = last + 1
    return found


def _falls(top: float, radii: tuple[float, float], length: float, slack: float) -> bool:
    """A flank goes on: down a step or a short cone. It ends where a cylinder, or a long cone, begins."""
    drop = radii[0] - radii[1]
    # of a fillet's facets, which meet at heights that are rounded, tiny cylinders are left
    if drop < -slack or (drop <= slack and length > max(slack, NO_CYLINDER * (top - radii[0]))):
        return False
    return length <= max(2 * drop, 0.5 * (top - radii[0]))


def _hill(z: Floats, r: Floats, base: float, between: bool) -> OutlineBump:
    """A hill of points, where its flanks pass its base and half its height."""
    top = float(r.max())

    def ends(level: float) -> tuple[float, float]:
        above = np.flatnonzero(r > level)
        first, last = int(above[0]), int(above[-1])
        low, high = float(z[first]), float(z[last])
        if first > 0:
            low = float(np.interp(level, r[first - 1 : first + 1], z[first - 1 : first + 1]))
        if last + 1 < len(r):
            high = float(np.interp(level, r[last : last + 2][::-1], z[last : last + 2][::-1]))
        return low, high

    low, high = ends(base * (1.0 + 1e-9))
    middle = ends(0.5 * (base + top))
    return OutlineBump(low, high, base, top, middle[1] - middle[0], between)


def _without_flanges(sections: list[Band]) -> list[Band]:
    """Leave out what sticks out farther than it is long, the shortest first, but for lands between grooves."""
    while flanges := [hill for hill in hills(sections) if hill.is_flange and not _is_land(sections, hill)]:
        sections = _levelled(sections, min(flanges, key=lambda hill: hill.length))
    return sections


def _is_land(sections: Sequence[Band], hill: OutlineBump) -> bool:
    """What grooves leave of a bar."""
    z = np.array([v for s in sections for v in (s.low, s.high)])
    r = np.array([v for s in sections for v in (s.radius_low, s.radius_high)])
    return is_land(z, r, np.flatnonzero((z >= hill.low) & (z <= hill.high)), hill.top)


def without_collars(outline: Outline) -> Outline:
    """The outline with every ring between narrower stretches left out, however low it is.

    Args:
        outline: of a body.

    Returns:
        The narrower outline; the same where it has no such ring.
    """
    sections = list(outline.sections)
    while rings := [hill for hill in hills(sections) if hill.between]:
        sections = _levelled(sections, min(rings, key=lambda hill: hill.length))
    return Outline(tuple(sections))


def _levelled(sections: list[Band], hill: OutlineBump) -> list[Band]:
    """The sections with a hill cut down to its base."""
    kept: list[Band] = []
    for s in sections:
        low, high = max(s.low, hill.low), min(s.high, hill.high)
        if high - low <= 1e-9 * max(hill.high - hill.low, 1e-12) or max(s.radius_low, s.radius_high) <= hill.base:
            kept.append(s)
            continue
        if low > s.low:
            kept.append(s.between(s.low, low))
        kept.append(Band(low, high, hill.base, hill.base))
        if high < s.high:
            kept.append(s.between(high, s.high))
    return _joined(kept)


def _without_larger(sections: list[Band], radius_mm: float) -> list[Band]:
    """Leave out what is wider than the given body."""
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
