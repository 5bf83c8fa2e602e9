"""Profiles of surfaces of revolution by arc length, and points seen from them.

    meridian = meridian_of(surface, points)              # (k, 3) arc length, r and z, mm, upwards
    lengths_along(meridian, surface, points)             # (n,) mm

Lengths in mm.
"""

from __future__ import annotations

import math

import numpy as np

from ..mesh.solid import Floats
from .surfaces import Round, Surface

PROFILE_MM = 1e-4  # sagitta of a profile's sampled arcs; lifted points are put onto the exact surface
CHUNK = 2_000_000


def meridian_of(surface: Round, points: Floats, sagitta_mm: float = PROFILE_MM) -> Floats:
    """A surface's profile, upwards.

    Args:
        surface: the surface.
        points: (n, 3) what of it is needed: cylinders and cones have no ends of their own.
        sagitta_mm: how far chords may stray from the arcs of offset profiles.

    Returns:
        (k, 3) arc length, r and z, mm; of profiles that are closed on the axis up to there.
    """
    low, high = float(points[:, 2].min()), float(points[:, 2].max())
    r, z = surface.profile_between(low, high if high > low + 1e-6 else low + 1.0, sagitta_mm)
    s = np.append(0.0, np.cumsum(np.hypot(np.diff(r), np.diff(z))))
    kept = np.append(True, np.diff(s) > 1e-9)
    return np.stack([s, r, z], axis=1)[kept]


def from_pole(surface: Round, points: Floats, side: int) -> Floats:
    """Arc length from the pole, r and z of a surface's profile, as far as points lie on it."""
    reach = max(float(apart(surface, points)[0].max()), 1.0)
    ruling = surface.ruling_from_apex(reach)
    if ruling is not None:
        r, z = ruling
        return np.stack([np.append(0.0, math.hypot(reach, z[1] - z[0])), r, z], axis=1)
    meridian = meridian_of(surface, points)
    if side > 0:
        meridian = meridian[::-1] * [-1.0, 1.0, 1.0] + [meridian[-1, 0], 0.0, 0.0]
    return meridian


def apart(surface: Round, points: Floats) -> tuple[Floats, Floats]:
    """Distances (n,) of points from a surface's axis, and their heights (n,)."""
    return np.hypot(points[:, 0] - surface.axis_point[0], points[:, 1] - surface.axis_point[1]), points[:, 2]


def feet(meridian: Floats, r: Floats, z: Floats, least: float) -> Floats:
    """Arc lengths (n,) of a meridian's nearest points; it runs on beyond its end, and down to `least`."""
    start, step = meridian[:-1], np.diff(meridian, axis=0)
    low, high = np.zeros(len(start)), step[:, 0].copy()
    low[0], high[-1] = least, np.inf
    out = np.empty(len(r))
    size = max(CHUNK // len(start), 1)
    for first in range(0, len(r), size):
        rows = slice(first, first + size)
        dr, dz = r[rows, None] - start[:, 1], z[rows, None] - start[:, 2]
        t = np.clip((dr * step[:, 1] + dz * step[:, 2]) / step[:, 0], low, high)
        away = (dr - t * step[:, 1] / step[:, 0]) ** 2 + (dz - t * step[:, 2] / step[:, 0]) ** 2
        best = np.argmin(away, axis=1)
        out[rows] = start[best, 0] + t[np.arange(len(best)), best]
    return out


def lengths_along(meridian: Floats, surface: Round, points: Floats) -> Floats:
    """Arc lengths (n,) of a meridian's points nearest to points (n, 3) of its surface."""
    return feet(meridian, *apart(surface, points), -math.inf)


def point_at(meridian: Floats, s: Floats) -> tuple[Floats, Floats]:
    """Radii and heights at arc lengths; the first and last segment run on."""
    k = np.clip(np.searchsorted(meridian[:, 0], s) - 1, 0, len(meridian) - 2)
    step = meridian[k + 1] - meridian[k]
    share = (s - meridian[k, 0]) / step[:, 0]
    return meridian[k, 1] + share * step[:, 1], meridian[k, 2] + share * step[:, 2]


def share_left(shorter: Floats, up: Floats, ways: Floats) -> Floats:
    """Share of the distance of lines that is left where lengths round the axis are so much shorter, (n,)."""
    along = (up * ways).sum(axis=1) ** 2
    across = (up[:, 0] * ways[:, 1] - up[:, 1] * ways[:, 0]) ** 2
    length2 = along + across
    with np.errstate(divide="ignore", invalid="ignore"):
        share = shorter / np.sqrt((along + shorter**2 * across) / length2)
    return np.asarray(np.where(length2 > 0, share, shorter))


def on_surface(surface: Surface, points: Floats) -> Floats:
    """Points (n, 3) near a surface put onto it along its normals."""
    for _ in range(3):
        points = points - surface.distance(points)[:, None] * surface.normals(points)
    return points
