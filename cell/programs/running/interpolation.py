"""The TCP between two programmed poses: on a line or a circle, its orientation about one axis.

Use:

    T = on_lines(T_start, T_end, share)       # (m, 4, 4), (m, 4, 4), (m,) 0 to 1
    unsure_circles(start, via, end, at_angle)  # (m,) those that their three points do not settle
    arcs = Circles.through(start, via, end)   # (m, 3) each
    arcs.at(share), arcs.length               # (m, 3), (m,) m

Assumed of the controller: from pose to pose the orientation turns about one axis that stands still in the base, by the
shorter way and in proportion to the length gone (KUKA: $ORI_TYPE = #VAR; of a circle $CIRC_TYPE = #BASE, the auxiliary
point's orientation left out). The maker's own rule is not public. Whatever it is, the TCP, which is the wire's tip,
stays on the line; and a rule under which the orientation is never further from either end than the ends are from one
another differs from this one by that angle at most. So the greatest turn between two points of a program bounds what
the assumption can change, and it is reported.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ik.chain import Floats

STRAIGHT = 1e-7  # m: an arc whose auxiliary point is nearer to the chord is the chord
SURE = 1e-5  # m: three points nearer to a line make no sure circle, since programs and controllers round them


def turned_shares(R_start: Floats, R_end: Floats, share: Floats) -> Floats:
    """Rotations on the way from one to another about a constant axis.

    Args:
        R_start: (m, 3, 3), or (3, 3) of all.
        R_end: likewise.
        share: of the way, (m,), 0 to 1.

    Returns:
        (m, 3, 3).
    """
    start = Rotation.from_matrix(R_start)
    way = (start.inv() * Rotation.from_matrix(R_end)).as_rotvec()
    out: Floats = (start * Rotation.from_rotvec(share[:, None] * way)).as_matrix()
    return out


def angles_between(R: Floats, other: Floats) -> Floats:
    """Angles between orientations, (m,), rad."""
    # the sine of half the angle is exact for small ones
    gap = np.linalg.norm(R - other, axis=(-2, -1)) / (2 * np.sqrt(2))
    out: Floats = 2 * np.arcsin(np.clip(gap, 0.0, 1.0))
    return out


def on_lines(T_start: Floats, T_end: Floats, share: Floats) -> Floats:
    """Poses on straight lines.

    Args:
        T_start: (m, 4, 4), m.
        T_end: (m, 4, 4), m.
        share: of the way, (m,), 0 to 1.

    Returns:
        (m, 4, 4), m.
    """
    T = np.zeros_like(T_start)
    T[:, :3, :3] = turned_shares(T_start[:, :3, :3], T_end[:, :3, :3], share)
    T[:, :3, 3] = T_start[:, :3, 3] + share[:, None] * (T_end[:, :3, 3] - T_start[:, :3, 3])
    T[:, 3, 3] = 1.0
    return T


def unsure_circles(start: Floats, via: Floats, end: Floats, at_angle: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Circles that three points nearly in a line, or at one place, do not settle, (m,).

    Where the auxiliary point is between the others and the circle ends at its end, the arc is their chord all the same.

    Args:
        start: (m, 3), m.
        via: auxiliary points, (m, 3), m.
        end: (m, 3), m.
        at_angle: whether the circle ends at an angle of its own (CA), (m,).
    """
    a, b, c = (np.linalg.norm(side, axis=1) for side in (via - start, end - start, end - via))
    between = (b >= np.maximum(a, c)) & (np.minimum(a, c) > SURE)
    out: NDArray[np.bool_] = (_height(start, via, end) <= SURE) & (at_angle | ~between)
    return out


def _height(start: Floats, via: Floats, end: Floats) -> Floats:
    """Least height of the triangle of three points, (m,), m."""
    return _least_height(np.linalg.norm(np.cross(via - start, end - start), axis=1), start, via, end)


def _least_height(twice_area: Floats, start: Floats, via: Floats, end: Floats) -> Floats:
    """The same where twice the triangle's area is known, (m,), m2."""
    sides = np.stack([np.linalg.norm(side, axis=1) for side in (via - start, end - start, end - via)])
    out: Floats = twice_area / np.maximum(sides.max(axis=0), np.finfo(float).tiny)
    return out


@dataclass(frozen=True, eq=False)
class Circles:
    """Arcs of circles, one a row.

    Attributes:
        centre: (m, 3), m.
        x: from the centre to the start, (m, 3), m.
        y: at right angles to it in the plane, as long, the way round that passes the auxiliary point, (m, 3), m.
        angle: from start to end, (m,), rad; 0 where the three points are in a line.
        start: (m, 3), m.
        end: (m, 3), m.
    """

    centre: Floats
    x: Floats
    y: Floats
    angle: Floats
    start: Floats
    end: Floats

    @classmethod
    def through(cls, start: Floats, via: Floats, end: Floats) -> Circles:
        """Arcs from start to end through an auxiliary point each, (m, 3), m; three points in a line are a line."""
        a, b = via - start, end - start
        n = np.cross(a, b)
        twice_area = np.linalg.norm(n, axis=1)
        flat = _least_height(twice_area, start, via, end) <= STRAIGHT
        safe = np.where(flat, 1.0, twice_area)[:, None]
        n = np.where(flat[:, None], np.array([0.0, 0.0, 1.0]), n / safe)
        squares = (a**2).sum(axis=1)[:, None] * b - (b**2).sum(axis=1)[:, None] * a
        to_centre = np.cross(squares, n) / (2 * safe)
        x = -to_centre
        y = np.cross(n, x)
        out = end - start - to_centre
        angle = np.arctan2((out * y).sum(axis=1), (out * x).sum(axis=1))
        return cls(
            start + to_centre, x, y, np.where(flat, 0.0, np.where(angle <= 0, angle + 2 * np.pi, angle)), start, end
        )

    def turned(self, k: int, angle: float) -> Circles:
        """The same with arc k over another angle, rad; below 0 the other way round."""
        y, angles, end = self.y.copy(), self.angle.copy(), self.end.copy()
        y[k], angles[k] = self.y[k] * np.sign(angle), abs(angle)
        end[k] = self.centre[k] + np.cos(angle) * self.x[k] + np.sin(angle) * self.y[k]
        return Circles(self.centre, self.x, y, angles, self.start, end)

    @property
    def length(self) -> Floats:
        """Of the arcs, (m,), m."""
        return np.where(
            self.angle > 0, self.angle * np.linalg.norm(self.x, axis=1), np.linalg.norm(self.end - self.start, axis=1)
        )

    def at(self, share: Floats) -> Floats:
        """Points on the arcs, (m, 3), m.

        Args:
            share: of the arc, (m,), 0 to 1.
        """
        turn = (share * self.angle)[:, None]
        arc = self.centre + np.cos(turn) * self.x + np.sin(turn) * self.y
        line = self.start + share[:, None] * (self.end - self.start)
        return np.where(self.angle[:, None] > 0, arc, line)
