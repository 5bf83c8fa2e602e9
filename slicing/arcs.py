"""One triangle's piece of a cylindrical layer's curve: an arc of an ellipse, or a ruling.

In the plane of a triangle with normal n (n_z not 0) the height over the cylinder of radius r about c is

    z(angle) = const - r g cos(angle - phi),     g (cos phi, sin phi) = (n_x, n_y) / n_z

so a piece is given by its two ends and the angle it turns through. Heights are always taken relative to the
piece's own start, by sin differences: that stays accurate for nearly vertical triangles, where g is huge and
the turn tiny.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slicing.part import Floats, Ints

VERTICAL = 1e-12  # |n_z| / |n| below which a triangle counts as vertical
MAX_STEP_RAD = 0.5  # so that angles unwrap and small circles stay round
TINY_TURN_RAD = 1e-6


@dataclass(frozen=True, eq=False)
class Samples:
    """Points along the pieces, piece after piece, each without its end (the next piece starts there).

    Attributes:
        points: (n, 3) mm.
        first: (p + 1,) where each piece's points begin.
        area: (p,) each piece's share of the signed area to the left of its loop, mm².
        turn: (p,) angle about the axis that each piece covers, rad.
    """

    points: Floats
    first: Ints
    area: Floats
    turn: Floats


def sample_arcs(
    axis_point: tuple[float, float],
    radius: Floats,
    corners: Floats,
    start: Ints,
    end: Ints,
    nodes: Floats,
    tolerance_mm: float,
) -> Samples:
    """Pieces on cylinders about one axis.

    Args:
        axis_point: (x, y) of the axis, mm.
        radius: (p,) of the cylinder that each piece lies on, mm.
        corners: (p, 3, 3) corners of the pieces' triangles, counter-clockwise seen from outside.
        start: (p,) node each piece starts at; -1 for a whole circle inside its triangle.
        end: (p,) node each piece ends at.
        nodes: (k, 3) positions; node 2e + 1 lies on the same edge as node 2e.
        tolerance_mm: greatest distance of the curve from its chords.

    Returns:
        The samples.
    """
    r, centre = radius, np.asarray(axis_point)
    normals = _normals(corners)
    length = np.sqrt((normals**2).sum(axis=1))
    vertical = np.abs(normals[:, 2]) <= VERTICAL * np.where(length > 0, length, 1.0)
    slope = normals[:, :2] / np.where(vertical, 1.0, normals[:, 2])[:, None]
    steepness = np.where(vertical, 0.0, np.hypot(slope[:, 0], slope[:, 1]))
    phi = np.arctan2(slope[:, 1], slope[:, 0])
    whole = start < 0
    origin = _origins(corners, slope, centre, r, nodes, start, whole)
    begin = np.arctan2(origin[:, 1] - centre[1], origin[:, 0] - centre[0])
    finish = nodes[end] - np.append(centre, 0.0)
    turn = _turns(begin, np.arctan2(finish[:, 1], finish[:, 0]), -np.sign(normals[:, 2]), vertical, whole)
    turn = _unwrap_slivers(turn, vertical, whole, start, end, corners, centre, nodes)
    steps = _steps(r, steepness, begin - phi, turn, tolerance_mm)
    first = np.append(0, np.cumsum(steps)).astype(np.int64)
    piece = np.repeat(np.arange(len(steps)), steps)
    k = np.arange(first[-1]) - first[piece]
    points = origin[piece]  # the nodes themselves, to the last bit
    new = np.flatnonzero(k)
    of, begin_phi = piece[new], begin - phi
    forward = turn[of] * (k[new] / steps[of])
    angle = begin[of] + forward
    points[new, 0] = centre[0] + r[of] * np.cos(angle)
    points[new, 1] = centre[1] + r[of] * np.sin(angle)
    points[new, 2] += 2 * (r * steepness)[of] * np.sin(begin_phi[of] + 0.5 * forward) * np.sin(0.5 * forward)
    last_z = np.where(whole, origin[:, 2], nodes[end, 2])
    after_z = np.append(points[1:, 2], 0.0)
    after_z[first[1:] - 1] = last_z
    # Simpson on every step: the arc lies below its chord by the bulge in the middle of the step
    step = turn / steps
    middle = begin_phi[piece] + step[piece] * (k + 0.5)
    bulge = (-2 * r * steepness * np.sin(0.25 * step) ** 2)[piece] * np.cos(middle)
    mean_z = 0.5 * (points[:, 2] + after_z) + bulge * (2.0 / 3.0)
    area = np.bincount(piece, weights=mean_z, minlength=len(steps)) * (-r * step)
    return Samples(points, first, area, turn)


def _normals(corners: Floats) -> Floats:
    """Normals (p, 3) of triangles, not normalised."""
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    x = u[:, 1] * v[:, 2] - u[:, 2] * v[:, 1]
    y = u[:, 2] * v[:, 0] - u[:, 0] * v[:, 2]
    return np.stack([x, y, u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]], axis=1)


def _origins(
    corners: Floats, slope: Floats, centre: Floats, r: Floats, nodes: Floats, start: Ints, whole: np.ndarray
) -> Floats:
    """Where each piece starts: its node, or for a whole circle the point at angle 0."""
    origin = nodes[start]
    if whole.any():
        at = np.stack([centre[0] + r[whole], np.full(int(whole.sum()), centre[1])], axis=1)
        corner = corners[whole, 0]
        origin[whole, :2] = at
        origin[whole, 2] = corner[:, 2] - (slope[whole] * (at - corner[:, :2])).sum(axis=1)
    return origin


def _turns(begin: Floats, finish: Floats, sense: Floats, vertical: np.ndarray, whole: np.ndarray) -> Floats:
    """Signed angle each piece turns through; `sense` +1 counter-clockwise about z, -1 clockwise."""
    direct = (finish - begin + np.pi) % (2 * np.pi) - np.pi
    turn = sense * ((sense * (finish - begin)) % (2 * np.pi))
    return np.where(whole, sense * 2 * np.pi, np.where(vertical, direct, turn))


def _unwrap_slivers(
    turn: Floats,
    vertical: np.ndarray,
    whole: np.ndarray,
    start: Ints,
    end: Ints,
    corners: Floats,
    centre: Floats,
    nodes: Floats,
) -> Floats:
    """Turns that rounding made (almost) a full turn are nothing: rulings of nearly vertical triangles.

    A true near-full turn exists only where a triangle holds the whole circle but for a bit cut off by one
    edge: then both nodes lie on that edge and the axis is within the triangle.
    """
    suspect = (np.abs(turn) > 2 * np.pi - TINY_TURN_RAD) & ~vertical & ~whole
    if suspect.any():
        xy = corners[suspect, :, :2] - centre
        sides = np.stack([_cross(xy[:, k], xy[:, (k + 1) % 3]) for k in range(3)], axis=1)
        holds = (sides > 0).all(axis=1) | (sides < 0).all(axis=1)
        real = holds & (start[suspect] // 2 == end[suspect] // 2)
        turn = turn.copy()
        turn[suspect] -= np.where(real, 0.0, np.sign(turn[suspect]) * 2 * np.pi)
    return turn


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _steps(r: Floats, steepness: Floats, begin: Floats, turn: Floats, tolerance_mm: float) -> Ints:
    """Steps per piece so that chords stay within the tolerance: sagitta <= |p''| step² / 8.

    |p''|² = r² + (r g cos(angle - phi))²; the cosine's greatest size on the arc is 1 if the arc passes phi or
    its opposite, else that at one of its ends.
    """
    low, high = np.minimum(begin, begin + turn), np.maximum(begin, begin + turn)
    passes = np.floor(high / np.pi) > np.floor(low / np.pi)
    cosine = np.where(passes, 1.0, np.maximum(np.abs(np.cos(low)), np.abs(np.cos(high))))
    second = r * np.hypot(1.0, steepness * cosine)
    size = np.abs(turn)
    steps = np.ceil(np.maximum(size * np.sqrt(second / (8.0 * tolerance_mm)), size / MAX_STEP_RAD) - 1e-9)
    return np.maximum(steps, 1).astype(np.int64)
