"""A convex shape of few corners that holds many points.

    shape = shape_of_few_corners(points, 1e-3)      # points (k, 3) m; a thousandth larger than their hull at most

The points that reach furthest in some directions have a hull. Those that are beyond its faces are taken as well, until
none is beyond by more than a share of what is within. The hull is grown about its middle by what is left, so that it
holds all points. Points lie in groups with boxes: where a group's box is not beyond a face, none of its points is
multiplied with the face's normal, which leaves a tenth of the products. Metres.
"""

from __future__ import annotations

import numpy as np

from ik.chain import Floats
from slicing import convex_hull

from ...arrays import Ints
from .convex_shapes import ConvexShape

DIRECTIONS = 150  # in which points are looked for that reach furthest
ROUNDS = 5  # hulls that are tried, each with the points that were beyond the last one
MOST_GROWN = 0.01  # share by which a hull may be grown; one that needs more is of no use
ROUNDING = 1e-6  # share by which a shape is thicker: faces are known as well as that
FLAT = 1e-4  # share of its width that a shape is thick at least: no faces are known of the rim of a flat one
LEAST_DEEP = 1e-9  # m from a hull's middle to its faces
GROUP = 256  # points that have a box together
LOOSE = 16  # every such point tells the middle, the form and how far the points reach at least
CELLS = 32  # along the longest way through the points: points of a cell, and of neighbours, are grouped
Z = np.array([0.0, 0.0, 1.0])


def shape_of_few_corners(points: Floats, enough: float) -> ConvexShape:
    """A convex shape that holds points.

    Args:
        points: (k, 3), at least two, m.
        enough: share by which it may be larger than their hull, as seen from its middle; if that takes too many
            rounds, it may be larger by ``MOST_GROWN``.

    Returns:
        The shape; the points as they are where they lie in a plane, or nearly so.
    """
    cloud = _PointGroups.of(points)
    taken = cloud.furthest()
    middle, grown = taken.mean(axis=1), np.inf  # within the hull
    taken, beyond = taken - middle[:, None], cloud.seen_from(middle)
    width = np.linalg.svd(taken, compute_uv=False)
    for _ in range(ROUNDS if width[-1] > FLAT * width[0] else 0):
        corners, normals = convex_hull(np.ascontiguousarray(taken.T))
        normals /= np.maximum((corners @ normals.T).max(axis=0), LEAST_DEEP)[:, None]
        # by half of what is enough the hull is grown anyway: points that are beyond by less are not looked at
        far, which, left = beyond.over(normals, np.full(len(normals), 1.0 + enough / 2))
        grown = float(far.max())
        if grown <= 1.0 + enough:
            break
        more = np.unique(which[far > 1.0 + enough])
        taken = np.concatenate([taken, beyond.points[:, more]], axis=1)
        beyond = _PointGroups(beyond.points[:, left])  # of a hull of more points all others are within as well
    if grown > 1.0 + MOST_GROWN:  # or flat
        return ConvexShape(points, 0.0, Z, 0.0)
    corners *= grown
    thicker = ROUNDING * float(np.linalg.norm(corners, axis=1).max())
    return ConvexShape(middle + corners, thicker, Z, 0.0)


class _PointGroups:
    """Points in groups, each with a box; coordinates first, so that what is worked out runs along memory."""

    def __init__(self, points: Floats) -> None:
        """Group points, (3, k), m, as they follow one another."""
        self.points, self._first = points, np.arange(0, points.shape[1], GROUP)
        low, high = (each.reduceat(points, self._first, axis=1) for each in (np.minimum, np.maximum))
        self._middle, self._half = (low + high) / 2, (high - low) / 2

    @classmethod
    def of(cls, points: Floats) -> _PointGroups:
        """Group points, (k, 3), m, so that those of a group are close together."""
        along = np.ascontiguousarray(points.T)
        return cls(along[:, _neighbours_together(along)])

    def seen_from(self, place: Floats) -> _PointGroups:
        """The same points relative to another origin, (3,), m."""
        return _PointGroups(self.points - place[:, None])

    def furthest(self) -> Floats:
        """Points that reach furthest in directions spread evenly where the points are as wide every way, (3, f), m."""
        some = self.points[:, ::LOOSE]
        spread, turn = np.linalg.eigh(np.cov(some if some.shape[1] >= LOOSE else self.points))
        directions = EVENLY @ (turn / np.sqrt(np.maximum(spread, 1e-12))).T
        reach = directions @ some
        first = reach.argmax(axis=1)
        _, which, _ = self.over(directions, reach[np.arange(len(first)), first])
        return self.points[:, np.unique(np.where(which >= 0, which, LOOSE * first))]

    def over(self, directions: Floats, known: Floats) -> tuple[Floats, Ints, Ints]:
        """How far points reach in directions.

        Args:
            directions: of any length, (d, 3).
            known: what they are compared with, (d,).

        Returns:
            How far they reach, or what is known where none reaches further, (d,); which does, -1 where none, (d,); and
            the points that reach further than is known in any direction, ascending.
        """
        far, which, left = known.copy(), np.full(len(known), -1), [np.zeros(0, dtype=np.int64)]
        may_be = directions @ self._middle + np.abs(directions) @ self._half > far[:, None]
        for first, maybe in zip(self._first.tolist(), may_be.T, strict=True):
            of = np.flatnonzero(maybe)
            if not len(of):
                continue
            reach = directions[of] @ self.points[:, first : first + GROUP]
            at = reach.argmax(axis=1)
            reached = reach[np.arange(len(of)), at]
            more = reached > known[of]
            if more.any():
                left.append(first + np.flatnonzero((reach[more] > known[of[more], None]).any(axis=0)))
                more &= reached > far[of]
                far[of[more]], which[of[more]] = reached[more], first + at[more]
        return far, which, np.concatenate(left)


def _evenly(count: int) -> Floats:
    """Directions spread evenly, (count, 3)."""
    k = np.arange(count)
    z, about = 1 - (2 * k + 1) / count, k * np.pi * (3 - np.sqrt(5))
    flat = np.sqrt(1 - z**2)
    return np.stack([np.cos(about) * flat, np.sin(about) * flat, z], axis=1)


def _neighbours_together(points: Floats) -> Ints:
    """An order of points (3, k) in which neighbours are close together: along a curve through all cells of a grid."""
    low = points.min(axis=1)
    width = max(float((points.max(axis=1) - low).max()), 1e-12)
    x, y, z = THINNED[((points - low[:, None]) * ((CELLS - 0.001) / width)).astype(np.int64)]
    return np.argsort(x | y << 1 | z << 2, kind="stable")


EVENLY = _evenly(DIRECTIONS)
# numbers with two noughts between their binary digits: of three such numbers the digits take turns
THINNED = np.array([sum((n >> b & 1) << 3 * b for b in range(5)) for n in range(CELLS)], dtype=np.uint16)
