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

from ..mesh.solid import Bools, Floats, Ints, Mesh

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
    mesh: Mesh,
    faces: Ints,
    start: Ints,
    end: Ints,
    nodes: Floats,
    tolerance_mm: float,
) -> Samples:
    """Pieces on cylinders about one axis.

    Args:
        axis_point: (x, y) of the axis, mm.
        radius: (p,) of the cylinder that each piece lies on, mm.
        mesh: its triangles, counter-clockwise seen from outside.
        faces: (p,) number of each piece's triangle.
        start: (p,) node each piece starts at; -1 for a whole circle inside its triangle.
        end: (p,) node each piece ends at.
        nodes: (k, 3) positions; node 2e + 1 lies on the same edge as node 2e.
        tolerance_mm: greatest distance of the curve from its chords.

    Returns:
        The samples.
    """
    r, centre, whole = radius, np.asarray(axis_point), start < 0
    vertical, slope, sense = _slopes(mesh, faces)
    steepness = np.sqrt(slope[0] * slope[0] + slope[1] * slope[1])
    phi = np.arctan2(slope[1], slope[0])
    corners = _TriangleCorners(mesh, faces)
    origin = _origins(corners, slope, centre, r, nodes, start, whole)
    begin = np.arctan2(origin[1] - centre[1], origin[0] - centre[0])
    finish = np.arctan2(nodes[:, 1].take(end) - centre[1], nodes[:, 0].take(end) - centre[0])
    turn = _turns(begin, finish, sense, vertical, whole)
    turn = _unwrap_slivers(turn, vertical, whole, start, end, corners, centre)
    begin_phi = begin - phi
    steps = _steps(r, steepness, begin_phi, turn, tolerance_mm)
    first = np.append(0, np.cumsum(steps)).astype(np.int64)
    piece = np.repeat(np.arange(len(steps)), steps)
    k = np.arange(first[-1]) - first.take(piece)
    points = np.empty((3, first[-1]))
    for column, place in zip(points, origin, strict=True):
        column[:] = place.take(piece)  # the nodes themselves, to the last bit
    new = np.flatnonzero(k)
    of = piece[new]
    forward = turn[of] * (k[new] / steps[of])
    angle = begin[of] + forward
    points[0, new] = centre[0] + r[of] * np.cos(angle)
    points[1, new] = centre[1] + r[of] * np.sin(angle)
    points[2, new] += 2 * (r * steepness)[of] * np.sin(begin_phi[of] + 0.5 * forward) * np.sin(0.5 * forward)
    after_z = np.append(points[2, 1:], 0.0)
    after_z[first[1:] - 1] = np.where(whole, origin[2], nodes[:, 2].take(end))
    # Simpson on every step: the arc lies below its chord by the bulge in the middle of the step
    step = turn / steps
    middle = begin_phi.take(piece) + step.take(piece) * (k + 0.5)
    bulge = (-2 * r * steepness * np.sin(0.25 * step) ** 2).take(piece) * np.cos(middle)
    mean_z = 0.5 * (points[2] + after_z) + bulge * (2.0 / 3.0)
    area = np.bincount(piece, weights=mean_z, minlength=len(steps)) * (-r * step)
    return Samples(points.T, first, area, turn)


@dataclass(frozen=True, eq=False)
class _TriangleCorners:
    """The corners of the pieces' triangles, of which few are asked for."""

    mesh: Mesh
    faces: Ints

    def of(self, pieces: Bools) -> Floats:
        """Those (k, 3, 3) of some pieces."""
        return self.mesh.vertices[self.mesh.faces[self.faces[pieces]]]


def _slopes(mesh: Mesh, faces: Ints) -> tuple[Bools, list[Floats], Floats]:
    """Of triangles whether they are vertical, by how much they rise along x and y, and how they turn about z."""
    x, y, z = (mesh.normals[:, k].take(faces) for k in range(3))
    length = np.sqrt(x * x + y * y + z * z)
    vertical = np.abs(z) <= VERTICAL * np.where(length > 0, length, 1.0)
    up = np.where(vertical, np.inf, z)
    return vertical, [x / up, y / up], -np.sign(z)


def _origins(
    corners: _TriangleCorners, slope: list[Floats], centre: Floats, r: Floats, nodes: Floats, start: Ints, whole: Bools
) -> list[Floats]:
    """Where each piece starts (x, y and z): its node, or for a whole circle the point at angle 0."""
    origin = [nodes[:, k].take(start, mode="wrap") for k in range(3)]
    if whole.any():
        at = np.stack([centre[0] + r[whole], np.full(int(whole.sum()), centre[1])], axis=1)
        corner = corners.of(whole)[:, 0]
        origin[0][whole], origin[1][whole] = at.T
        rise = [slope[k][whole] * (at[:, k] - corner[:, k]) for k in (0, 1)]
        origin[2][whole] = corner[:, 2] - (rise[0] + rise[1])
    return origin


def _turns(begin: Floats, finish: Floats, sense: Floats, vertical: Bools, whole: Bools) -> Floats:
    """Signed angle each piece turns through; `sense` +1 counter-clockwise about z, -1 clockwise."""
    turn = sense * _within_turn(sense * (finish - begin))
    some = np.flatnonzero(vertical)
    turn[some] = (finish[some] - begin[some] + np.pi) % (2 * np.pi) - np.pi
    return np.where(whole, sense * 2 * np.pi, turn)


def _within_turn(angle: Floats) -> Floats:
    """Angles % (2 pi) of angles from -2 pi to 2 pi, to the last bit, but several times faster."""
    turn = 2 * np.pi
    return np.where(angle < 0, angle + turn, np.where(angle >= turn, angle - turn, angle))


def _unwrap_slivers(
    turn: Floats, vertical: Bools, whole: Bools, start: Ints, end: Ints, corners: _TriangleCorners, centre: Floats
) -> Floats:
    """Turns that rounding made (almost) a full turn are nothing: rulings of nearly vertical triangles.

    A true near-full turn exists only where a triangle holds the whole circle but for a bit cut off by one
    edge: then both nodes lie on that edge and the axis is within the triangle.
    """
    suspect = (np.abs(turn) > 2 * np.pi - TINY_TURN_RAD) & ~vertical & ~whole
    if suspect.any():
        xy = corners.of(suspect)[:, :, :2] - centre
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
    size = np.abs(turn)
    steps = np.ones(len(turn), dtype=np.int64)
    greatest = r * np.sqrt(1.0 + steepness * steepness)
    some = np.flatnonzero((size * size * greatest > 7.9 * tolerance_mm) | (size > MAX_STEP_RAD))
    if len(some) == 0:
        return steps
    r, steepness, size, begin, turn = r[some], steepness[some], size[some], begin[some], turn[some]
    low, high = np.minimum(begin, begin + turn), np.maximum(begin, begin + turn)
    passes = np.floor(high / np.pi) > np.floor(low / np.pi)
    cosine = np.where(passes, 1.0, np.maximum(np.abs(np.cos(low)), np.abs(np.cos(high))))
    second = r * np.hypot(1.0, steepness * cosine)
    count = np.ceil(np.maximum(size * np.sqrt(second / (8.0 * tolerance_mm)), size / MAX_STEP_RAD) - 1e-9)
    steps[some] = np.maximum(count, 1).astype(np.int64)
    return steps
