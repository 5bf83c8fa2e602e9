"""The outline of a round body: cylinders and cones about its axis, one after the other along z.

Along z, the innermost band of the mesh that looks outward (`slicing.decompose_bands`) is the body; what lies
outside it stands on it:

    outline = body_outline(find_bands(vertices, faces))     # frame: z is the axis
    outline.radius_at(z), outline.sections                  # lowest first

A section that sticks out farther than it is long is a flange: a ring that stands on the body, no step of it.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from slicing.decompose_bands import HINTED_TURN, LEAST_COVERAGE, LEAST_TURN, Band, FoundBand
from slicing.part import Floats, Ints

SAME_POINT_MM, SAME_POINT = 1e-5, 1e-6  # points of an outline closer than this (and that share of r) are one
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
    heights = np.sort([z for f in found for z in (f.band.low, f.band.high)])
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
