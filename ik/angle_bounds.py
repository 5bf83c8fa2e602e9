"""Enclosures of angles: a middle and a half width that surely hold every value a quantity can take.

The building blocks of ``ik.roll_bounds``, one geometric fact each::

    at, half = triangle(near, far, high, low)     # every angle of the triangle is within half of at

Half widths are padded by ``PAD_ANGLE``, orders of magnitude more than rounding comes to. Radians.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .chain import Floats

PAD_ANGLE = 1e-7


def middle_and_half_width(one: Floats, other: Floats) -> tuple[Floats, Floats]:
    """Middle and padded half width of the angles between two, given in either order."""
    return (one + other) / 2, np.abs(other - one) / 2 + PAD_ANGLE


def sight(distance: Floats, radius: Floats | float, outside: NDArray[np.bool_]) -> Floats:
    """Half the angle that a disc or ball subtends, asin(radius / distance); half a turn from inside of it."""
    half = np.full(distance.shape, np.pi)
    np.divide(radius, distance, out=half, where=outside)
    np.minimum(half, 1.0, out=half, where=outside)  # a rounding error beyond
    return np.arcsin(half, out=half, where=outside)


def triangle(near: float, far: float, high: Floats, low: Floats) -> tuple[Floats, Floats]:
    """The angle between a link and the line to the arm's other end, middle and padded half width.

    With the cosine c of the bend the angle is atan2(far sin, near + far c). It is monotone in the bend where the other
    link is the longer one; else it rises to asin(far/near) at c = -far/near and falls again.

    Args:
        near: length of the link at which the angle is, m.
        far: length of the other, m.
        high: largest cosine of the bend, any shape.
        low: smallest, likewise.
    """
    ends = [np.arctan2(far * np.sqrt((1 - c) * (1 + c)), near + far * c) for c in (high, low)]
    first, last = np.minimum(*ends), np.maximum(*ends)
    if far <= near:
        last = np.where((low <= -far / near) & (-far / near <= high), np.arcsin(far / near), last)
    return middle_and_half_width(first, last)


def lead(constants: tuple[float, float, float], low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """How far A6's axis leads A4 (or A4's axis A6) for deltas from low to high, middle and padded half width.

    The angle of the point (l0 + l1 cos, l2 sin) of half an ellipse; it turns back where the tangent points at the
    origin, at cos = -l1/l0, and is monotone on either side. Where the ellipse goes through the origin (at an end only),
    A4 and A6 are in line and :func:`azimuth` leaves their angles open.
    """
    l0, l1, l2 = constants
    ends = [np.arctan2(l2 * np.sin(x), l0 + l1 * np.cos(x)) for x in (low, high)]
    first, last = np.minimum(*ends), np.maximum(*ends)
    if abs(l0) > abs(l1):
        turn = float(np.arccos(-l1 / l0))
        there = float(np.arctan2(l2 * np.sin(turn), l0 + l1 * np.cos(turn)))
        inside = (low < turn) & (turn < high)
        first = np.where(inside, np.minimum(first, there), first)
        last = np.where(inside, np.maximum(last, there), last)
    return middle_and_half_width(first, last)


def azimuth(gamma: Floats, cap: Floats) -> Floats:
    """Greatest change of azimuth of a vector within ``cap`` of one at the polar angle ``gamma``, rad.

    The great circles through the pole that touch the cap stand asin(sin cap / sin gamma) from its middle's (right
    spherical triangle); where the cap holds a pole, any azimuth is possible.
    """
    clear = cap < np.minimum(gamma, np.pi - gamma)
    return sight(np.sin(gamma), np.sin(np.minimum(cap, np.pi / 2)), clear) + PAD_ANGLE


def into_forearm(v: Floats, q1: Floats, q23: Floats) -> Floats:
    """Vectors of the arm's own axes with A1 to A3 taken out, (3, k)."""
    c, s = np.cos(q1), np.sin(q1)
    x, y, z = c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]
    c, s = np.cos(q23), np.sin(q23)
    return np.stack([c * x - s * z, y, c * z + s * x])


def from_forearm(v: Floats, q1: Floats, q23: Floats) -> Floats:
    """One vector of the forearm turned by A1 to A3 into the arm's own axes, (3,) -> (3, k)."""
    c, s = np.cos(q23), np.sin(q23)
    x, y, z = c * v[0] + s * v[2], v[1], c * v[2] - s * v[0]
    c, s = np.cos(q1), np.sin(q1)
    return np.stack([c * x - s * y, s * x + c * y, z])
