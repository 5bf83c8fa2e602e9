"""Rows of a motion that is run without a stop, and the parabolas of its path with rounded corners.

    p = pieces(BlendedPath(q, s, zone), radius)
    p.off, p.bend                    # how far off the rows each is at most, and how much it bends

The rounded path is the one that ``cell.timing.time_law`` times, the rows' moving average. Radians and metres; a path's
length may be in either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from ..timing.blending import blended, kept_zone, mirrored

NOTHING = 1e-9  # m: a path that is off its rows by less is on them


@dataclass(frozen=True, eq=False)
class BlendedPath:
    """Rows of a motion that is run without a stop between its ends.

    Attributes:
        q: rows, (m, j), rad.
        s: path length at each, (m,), ascending.
        zone: distance each way over which corners are rounded; at most half the path.
    """

    q: Floats
    s: Floats
    zone: float


@dataclass(frozen=True, eq=False)
class Parabolas:
    """The parabolas that a rounded path is made of.

    Attributes:
        s: path lengths between which they lie, (g + 1,); the rows' are among them.
        row: the row that each follows, (g,).
        off: bound on how far any point of the arm is off where the rows have it, (g,), m.
        bend: bound on the second derivative of its place, (g,), m per unit of path length squared.
    """

    s: Floats
    row: Ints
    off: Floats
    bend: Floats


def pieces(path: BlendedPath, radius: Floats) -> Parabolas:
    """Take a rounded path apart.

    Args:
        path: the rows.
        radius: from ``cell.collision.proofs.reach_radii.radii``, (j,), m.

    Returns:
        Its parabolas.
    """
    s = path.s - path.s[0]
    end = s[-1]
    zone = kept_zone(path.zone, end)
    # a parabola ends where either end of the average's window passes a row, or its mirror image beyond an end
    far = np.concatenate([-s[1:], s, 2 * end - s[:-1]])
    grid = np.concatenate([s, far - zone, far + zone])
    grid = np.unique(grid[(grid >= 0) & (grid <= end)])
    slope = np.diff(path.q, axis=0) / np.diff(s)[:, None]
    off = np.abs(blended(path.q, s, zone, grid) - on_rows(path.q, s, grid)) @ radius
    middle = (grid[:-1] + grid[1:]) / 2
    bend = (_slope_at(slope, s, middle + zone) - _slope_at(slope, s, middle - zone)) / (2 * zone)
    bends = np.abs(bend) @ radius
    row = np.clip(np.searchsorted(s, middle) - 1, 0, len(s) - 2)
    return Parabolas(grid + path.s[0], row, np.maximum(off[:-1], off[1:]) + np.diff(grid) ** 2 / 8 * bends, bends)


class PathBlends:
    """All roundings of one path: ``cell.timing.blending.blended`` with a zone for each place."""

    def __init__(self, q: Floats, s: Floats) -> None:
        """Prepare.

        Args:
            q: rows, (m, j), rad.
            s: path length at each, (m,), ascending from 0.
        """
        self._t, self._q = mirrored(q, s)
        self._slope = np.diff(self._q, axis=0) / np.diff(self._t)[:, None]
        steps = (self._q[:-1] + self._q[1:]) / 2 * np.diff(self._t)[:, None]
        self._area = np.concatenate([np.zeros((1, q.shape[1])), np.cumsum(steps, axis=0)])

    def at(self, at: Floats, zone: Floats) -> Floats:
        """Where the path is.

        Args:
            at: path lengths, (k,).
            zone: over which it is rounded each way, (k,); more than 0 and at most half the path.

        Returns:
            (k, j), rad.
        """
        out: Floats = (self._integral(at + zone) - self._integral(at - zone)) / (2 * zone)[:, None]
        return out

    def _integral(self, u: Floats) -> Floats:
        k = np.clip(np.searchsorted(self._t, u, side="right") - 1, 0, len(self._slope) - 1)
        h = (u - self._t[k])[:, None]
        return np.asarray(self._area[k] + self._q[k] * h + self._slope[k] * h**2 / 2)


def on_rows(q: Floats, s: Floats, at: Floats) -> Floats:
    """Where the rows' own straight lines are at path lengths, (k, j), rad."""
    return np.stack([np.interp(at, s, column) for column in q.T], axis=1)


def _slope_at(slope: Floats, s: Floats, at: Floats) -> Floats:
    """Slope of the path; beyond its ends that of its point reflection, which is the same."""
    inside = np.where(at < 0, -at, np.where(at > s[-1], 2 * s[-1] - at, at))
    out: Floats = slope[np.clip(np.searchsorted(s, inside) - 1, 0, len(slope) - 1)]
    return out


@dataclass(frozen=True, eq=False)
class SheetRectangles:
    """All roundings of steps, as rectangles over the path's length and the zone.

    Attributes:
        u: path length where each begins, (k,).
        v: where it ends, (k,).
        narrow: its smallest zone, (k,); 0: the rows themselves.
        wide: its largest zone, (k,).
    """

    u: Floats
    v: Floats
    narrow: Floats
    wide: Floats

    def rows(self, index: NDArray[np.bool_]) -> Self:
        """Some of them."""
        return type(self)(*(getattr(self, one.name)[index] for one in fields(self)))

    def halves(self, along: NDArray[np.bool_]) -> Self:
        """Both halves of each, of those ``along`` by length, of the others by zone."""
        m, zone = (self.u + self.v) / 2, (self.narrow + self.wide) / 2
        first = replace(self, v=np.where(along, m, self.v), wide=np.where(along, self.wide, zone))
        second = replace(self, u=np.where(along, m, self.u), narrow=np.where(along, self.narrow, zone))
        return self.joined([first, second])

    @classmethod
    def joined(cls, some: Sequence[Self]) -> Self:
        """Those of several, one after the other."""
        return cls(*(np.concatenate([getattr(x, one.name) for x in some]) for one in fields(cls)))
