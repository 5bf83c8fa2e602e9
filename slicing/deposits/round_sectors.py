"""Layers on surfaces of revolution as pieces for the hulls that collide: sector by sector about the axis.

    for points in sectors(layer, surface, sagitta_mm=0.05):      # (k, 3) mm, part frame

A layer's borders alone do not tell how far it stands out between them: what lies over a body's end is bounded by its
rim, and a profile may bulge. So profile points between the borders are among each sector's points.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from slicing.arrays import Floats

from ..layers.layer import Layer
from ..layers.poles import poles
from ..surfaces.meridians import lengths_along, meridian_of, on_surface
from ..surfaces.surfaces import Round

SECTOR = np.deg2rad(15.0)
SHARED = 0.55  # of a sector to either side of its middle
MERIDIANS = 5  # in a sector
SPACING_MM = 2.0  # of points along borders at most
STRAIGHT, STRAIGHT_MM = 1e-6, 1e-6  # of a turn, and of what a border is off its chords: none
OFF_AXIS_MM = 1e-6
OFF_CORNER_MM = 1e-3  # points so near a corner have the normals of its sides, and those between
FAN_RAD = 0.3


def sectors(layer: Layer, surface: Round, sagitta_mm: float, *, few: bool = False) -> Iterator[Floats]:
    """Points whose hulls hold a layer's region, sector by sector.

    Args:
        layer: the layer.
        surface: of revolution, that it lies on.
        sagitta_mm: how far hulls may stay inside the surface.
        few: whether points of borders that hulls do not need are left out.

    Yields:
        (k, 3) points on the surface, mm.
    """
    # straight borders have points at their corners alone: without more of them sectors would be missed
    borders = [_filled(_thinned(c.points, surface, sagitta_mm) if few else c.points, surface) for c in layer.curves]
    points = np.concatenate(borders)
    angle = np.arctan2(points[:, 1] - surface.axis_point[1], points[:, 0] - surface.axis_point[0])
    first = np.cumsum([0, *(len(border) for border in borders)])
    profile = None if surface.is_straight else _ProfileBelow(layer, surface, points, sagitta_mm)
    for low in np.arange(-np.pi, np.pi - 1e-9, SECTOR):
        near = _beside(angle, low + SECTOR / 2, SHARED * SECTOR)
        if near.any():
            for begin, end in pairwise(first.tolist()):  # and the points next to them, so that no gap opens
                own = near[begin:end].copy()
                near[begin:end] = own | np.roll(own, 1) | np.roll(own, -1)
            more = [] if profile is None else list(profile.within(angle, low + SECTOR / 2, near))
            yield np.concatenate([points[near], *more])


def _thinned(loop: Floats, surface: Round, sagitta_mm: float) -> Floats:
    """A closed curve (n, 3) on a cylinder without points on its straight stretches that hulls do not need.

    Straight are stretches that are so once the cylinder is unrolled. From one point that is left to the next, unless
    there is none between, the cylinder rises over the chord by half of what hulls may stay inside it at most.
    """
    if not surface.is_straight:
        return loop
    radius = float(surface.radius_at(loop[:1, 2])[0])
    off = loop[:, :2] - surface.axis_point
    angle = np.unwrap(np.arctan2(off[:, 1], off[:, 0]))
    flat = np.stack([radius * angle, loop[:, 2]], axis=1)
    step = np.diff(flat, axis=0)
    step /= np.maximum(np.linalg.norm(step, axis=1), 1e-12)[:, None]
    bent = np.abs(step[:-1, 0] * step[1:, 1] - step[:-1, 1] * step[1:, 0]) > STRAIGHT
    bent |= (step[:-1] * step[1:]).sum(axis=1) < 0.0
    corner = np.concatenate([[True], bent, [True]])
    of = np.maximum.accumulate(np.where(corner, np.arange(len(loop)), 0))
    part = np.floor(np.abs(angle - angle[of]) / np.sqrt(sagitta_mm / radius))
    kept = corner | np.append(True, (np.diff(of) != 0) | (np.diff(part) != 0))
    ends = np.flatnonzero(kept)
    piece = np.cumsum(kept[:-1]) - 1
    chord = np.diff(flat[ends], axis=0)
    chord /= np.maximum(np.linalg.norm(chord, axis=1), 1e-12)[:, None]
    away = flat[:-1] - flat[ends[:-1]][piece]
    aside = np.abs(away[:, 0] * chord[piece, 1] - away[:, 1] * chord[piece, 0])
    return loop[kept] if aside.max(initial=0.0) <= STRAIGHT_MM else loop


def _filled(loop: Floats, surface: Round) -> Floats:
    """A closed curve (n, 3) with points in between where its own are far apart, these put onto its surface."""
    way = np.roll(loop, -1, axis=0) - loop
    count = np.maximum(np.ceil(np.linalg.norm(way, axis=1) / SPACING_MM), 1).astype(np.int64)
    first = np.cumsum(count) - count
    piece = np.repeat(np.arange(len(loop)), count)
    share = (np.arange(len(piece)) - first[piece]) / count[piece]
    points = loop[piece] + share[:, None] * way[piece]
    new = share > 0.0
    points[new] = on_surface(surface, points[new])
    return points


def _beside(angle: Floats, middle: float, width: float) -> np.ndarray:
    return np.abs((angle - middle + np.pi) % (2 * np.pi) - np.pi) <= width


class _ProfileBelow:
    """The profile below a layer's region."""

    def __init__(self, layer: Layer, surface: Round, points: Floats, sagitta_mm: float) -> None:
        self.surface, self.poles = surface, poles(layer)
        reach, apex = points, surface.apex_z
        if apex is not None and any(self.poles):
            reach = np.concatenate([points, [[*surface.axis_point, apex]]])
        self.meridian = meridian_of(surface, reach, sagitta_mm)
        self.length = lengths_along(self.meridian, surface, points)
        self.meridian = _with_corners(self.meridian)

    def within(self, angle: Floats, middle: float, near: np.ndarray) -> Iterator[Floats]:
        """Profile points (k, 3) between a sector's borders, meridian by meridian."""
        step = 2.0 * SHARED * SECTOR / (MERIDIANS - 1)
        s = self.meridian[:, 0]
        for turn in middle + step * (np.arange(MERIDIANS) - 0.5 * (MERIDIANS - 1)):
            own = near & _beside(angle, turn, 0.75 * step)
            if not own.any():
                if not any(self.poles):
                    continue
                own = near
            low, high = self.length[own].min(), self.length[own].max()
            between = (s > low) & (s < high) | (s < high) & self.poles[0] | (s > low) & self.poles[1]
            _, r, z = self.meridian[between].T
            r = np.maximum(r, OFF_AXIS_MM)  # on the axis the normal would not be this meridian's
            x, y = self.surface.axis_point
            yield np.stack([x + r * np.cos(turn), y + r * np.sin(turn), z], axis=1)


def _with_corners(meridian: Floats) -> Floats:
    """A meridian (s, r, z) with points on both sides of each of its corners, and off those that stick out.

    Layers are carried on along the normals of their points: a corner has those of its sides and all between.
    """
    step = np.diff(meridian[:, 1:], axis=0) / np.diff(meridian[:, 0])[:, None]
    outward = np.arctan2(-step[:, 0], step[:, 1])  # angle of the normal (dz, -dr) in the half plane (r, z)
    turn = (np.diff(outward) + np.pi) % (2 * np.pi) - np.pi
    more = [meridian]
    for k in (np.flatnonzero(np.abs(turn) > FAN_RAD) + 1).tolist():
        s, corner = meridian[k, 0], meridian[k, 1:]
        sides = [corner - OFF_CORNER_MM * step[k - 1], corner + OFF_CORNER_MM * step[k]]
        if turn[k - 1] > 0:  # turns towards the axis
            angle = np.linspace(outward[k - 1], outward[k - 1] + turn[k - 1], int(turn[k - 1] / FAN_RAD) + 2)
            sides += list(corner + OFF_CORNER_MM * np.stack([np.cos(angle), np.sin(angle)], axis=1))
        more.append(np.column_stack([np.full(len(sides), s), sides]))
    out = np.concatenate(more)
    return np.asarray(out[np.argsort(out[:, 0], kind="stable")])
