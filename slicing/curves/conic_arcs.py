"""Arcs in which planes meet a cone: exact points by halving, whatever kind of conic it is.

A plane meets a cone in an ellipse, a parabola, a branch of a hyperbola or two rulings, and none of their
parametrisations is good for all. But the inside of the surface is convex, so the chord between two points of
an arc lies inside, and a ray from the chord's middle, square to it and to the outer side, leaves the inside
exactly once: one quadratic gives the point of the arc there. An arc is halved that way until it is close to
its chords. How close is known, not guessed: the height of a convex arc over its chord is nowhere more than
twice that over the middle.

    samples = sample_conics(arcs, axis_point, tolerance_mm=0.01)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..mesh.solid import Bools, Floats, Ints
from .ellipse_arcs import MAX_STEP_RAD, Samples
from .slabs import ProfileSlabs

MOST_HALVINGS = 30
SHORT_MM = 1e-5  # chords this short need no more care than their height
HAIR = 1e-150  # its square is still a number


@dataclass(frozen=True, eq=False)
class Arcs:
    """Directed pieces of curve, one a row, the inside of the surface on their right seen along the normal.

    Attributes:
        start: (p, 3) mm.
        end: (p, 3) mm.
        chord: (p, 3) direction from start to end, known even where the two coincide.
        normal: (p, 3) outward unit normals of the planes they lie in.
        slab: (p,) which band of the surface they lie on.
        bands: the surface's.
    """

    start: Floats
    end: Floats
    chord: Floats
    normal: Floats
    slab: Ints
    bands: ProfileSlabs


def sample_conics(arcs: Arcs, axis_point: tuple[float, float], tolerance_mm: float) -> Samples:
    """Points along the arcs, each piece without its end.

    Args:
        arcs: the pieces.
        axis_point: (x, y) of the surface's axis, mm.
        tolerance_mm: greatest distance of the curve from its chords.

    Returns:
        The samples; `area` is each piece's share of minus the integral of (the surface's area per radian up
        to the curve) over the angle, which is that to the left of closed loops.
    """
    axis = np.append(axis_point, 0.0)
    p = len(arcs.start)
    a, b, chord, piece, place = arcs.start - axis, arcs.end - axis, arcs.chord, np.arange(p), np.zeros(p)
    done: list[tuple[Floats, Ints, Floats]] = []
    area, turn = np.zeros(p), np.zeros(p)
    for level in range(MOST_HALVINGS + 1):
        top, height = _top(arcs, a, b, chord, piece)
        more = _coarse(arcs, a, b, height, piece, tolerance_mm) & (level < MOST_HALVINGS)
        fine = ~more
        done.append((a[fine], piece[fine], place[fine]))
        share, angle = _shares(arcs, a[fine], top[fine], b[fine], piece[fine])
        area += np.bincount(piece[fine], weights=share, minlength=p)
        turn += np.bincount(piece[fine], weights=angle, minlength=p)
        if not more.any():
            break
        a, b, top, piece, place = a[more], b[more], top[more], piece[more], place[more]
        place = np.concatenate([place, place + 0.5 ** (level + 1)])
        a, b, piece = np.concatenate([a, top]), np.concatenate([top, b]), np.concatenate([piece, piece])
        chord = b - a
    points, number, where = (np.concatenate([d[k] for d in done]) for k in range(3))
    order = np.lexsort((where, number))
    first = np.append(0, np.cumsum(np.bincount(number, minlength=p)))
    return Samples(points[order] + axis, first, area, turn)


def _top(arcs: Arcs, a: Floats, b: Floats, chord: Floats, piece: Ints) -> tuple[Floats, Floats]:
    """The arcs' points above the middles of their chords, and their heights there."""
    slab, bands = arcs.slab[piece], arcs.bands
    out = np.cross(arcs.normal[piece], chord)
    length = np.sqrt((out**2).sum(axis=1))
    out /= np.where(length > 0, length, 1.0)[:, None]
    k, d, middle = bands.slope[slab], b - a, 0.5 * (a + b)
    # the ends lie on the cone, so the quadratic's value at the middle is a quarter of its form of the chord
    form = d[:, 0] ** 2 + d[:, 1] ** 2 - (k * d[:, 2]) ** 2
    c = -0.25 * np.maximum(form, 0.0)
    square = out[:, 0] ** 2 + out[:, 1] ** 2 - (k * out[:, 2]) ** 2
    radius = bands.at_r[slab] + k * (middle[:, 2] - bands.at_z[slab])
    half = middle[:, 0] * out[:, 0] + middle[:, 1] * out[:, 1] - radius * k * out[:, 2]
    root = np.sqrt(np.maximum(half * half - square * c, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        height = np.where(half >= 0, -c / (half + root), np.where(square > 0, (root - half) / square, 0.0))
    height = np.where(bands.step[slab] | ~np.isfinite(height), 0.0, height)
    return middle + height[:, None] * out, height


def _coarse(arcs: Arcs, a: Floats, b: Floats, height: Floats, piece: Ints, tolerance_mm: float) -> Bools:
    """Arcs that are too far from their chord, reach beyond its ends, or turn far about the axis."""
    slab, bands, d = arcs.slab[piece], arcs.bands, b - a
    length = np.sqrt((d**2).sum(axis=1))
    beyond = np.zeros(len(a), dtype=bool)
    for point in (a, b):
        radius = bands.at_r[slab] + bands.slope[slab] * (point[:, 2] - bands.at_z[slab])
        gradient = np.concatenate([point[:, :2], (-bands.slope[slab] * radius)[:, None]], axis=1)
        along = np.cross(gradient, arcs.normal[piece])
        size = np.sqrt((along**2).sum(axis=1))
        beyond |= (along * d).sum(axis=1) < -1e-6 * size * length
    wide = (np.abs(_angle(a, b)) > MAX_STEP_RAD) & (length > tolerance_mm)
    curved = ~bands.step[slab]
    return ((2.0 * height > tolerance_mm) | (beyond & (length > SHORT_MM)) | wide) & curved


def _shares(arcs: Arcs, a: Floats, top: Floats, b: Floats, piece: Ints) -> tuple[Floats, Floats]:
    """Share of the signed area, and angle turned, of arcs through three points.

    On a band of a cone both the area per radian and the angle are taken as quadratic along the arc; on a step,
    which is flat, the arcs are straight and the area is that of triangles from the axis.
    """
    slab, bands = arcs.slab[piece], arcs.bands
    height = [bands.area_to(slab, np.hypot(p[:, 0], p[:, 1]), p[:, 2]) for p in (a, top, b)]
    first, second = _angle(a, top), _angle(top, b)
    turn = first + second
    # slopes of the angle at both ends and the middle of the unit interval, then Simpson: exact for quadratics
    share = (height[0] * (3 * first - second) + 4 * height[1] * turn + height[2] * (3 * second - first)) / 6.0
    if bands.step.any():
        grows = np.append(np.append(0.0, np.sign(np.diff(bands.r))), 0.0)[slab]
        base = bands.area[slab] - 0.5 * grows * bands.at_r[slab] ** 2
        flat = base * turn + 0.5 * grows * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        share = np.where(bands.step[slab], flat, share)
    return -share, turn


def _angle(a: Floats, b: Floats) -> Floats:
    """Angle about the axis from a to b, rad, within half a turn.

    A point on the axis itself counts as lying a hair off it, always the same way: on the way to it and on from it the
    angles add up to what a path beside it turns.
    """
    (ax, bx), ay, by = (np.where((p[:, 0] == 0.0) & (p[:, 1] == 0.0), HAIR, p[:, 0]) for p in (a, b)), a[:, 1], b[:, 1]
    return np.arctan2(ax * by - ay * bx, ax * bx + ay * by)
