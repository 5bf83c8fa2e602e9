"""All roundings of many corners proved free together, by separating planes: for large rotations far from anything.

    sheets_kept(proofs, radius, [StepSheets(path, known, steps)])     # for each path: which of the steps are proved

All roundings of a step, over any zone up to the path's, form a sheet of configurations over the path's length u and the
zone z: q(u, z) = (A(u + z) - A(u - z)) / 2z, A the integral of the rows. A rectangle of the sheet is
off the mean of its corners by an eighth of the squares of its sides times the second derivatives. These follow from
the corners D_i of the rows, at u_i: of u it is the difference of the rows' slopes at both ends of the window that is
averaged over, by 2z; of z the sum over that window of D_i (u_i - u)^2 / 2z^3. Rectangles of all paths are divided
together until that is small, without collision queries; then planes prove them with few queries
(``proofs.plane_proofs``). Zones up to the smallest of them are proved by how far they are off the rows.

Radians and metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints, distinct
from ..timing.blending import kept_zone, mirrored
from .blend_proofs import KnownRows, PathCorners
from .blended_paths import BlendedPath, SheetRectangles
from .proofs.motion_bounds import curvature
from .proofs.plane_proofs import PlaneProofs
from .proofs.sheet_pieces import SheetPieces

# m: most that a rectangle is off the mean of its corners; and travel between what is checked, one after the other
ROUNDS = ((4e-3, (0.03, 0.01)), (1e-3, (0.01, 0.004)), (2.5e-4, (0.004, 0.001)))
DIVIDED, MOST = 20, 30_000  # times that a rectangle is halved at most, and how many there may be of them
ROUNDED = 4 * float(np.finfo(float).eps)  # share of a sum that an addition, and what is added, is rounded by at most
SHARES = tuple(0.5**n for n in range(1, 12))  # of a zone: the greatest of these up to which the rows are enough


class _JoinedPaths:
    """The rows of several paths one after the other, with the integrals that their roundings are made of."""

    def __init__(self, paths: Sequence[BlendedPath], radius: Floats) -> None:
        self.radius = radius
        far = [mirrored(path.q, path.s - path.s[0]) for path in paths]
        self._first = np.concatenate([[0], np.cumsum([len(t) for t, _ in far])])
        self.zone = np.array([kept_zone(path.zone, path.s[-1] - path.s[0]) for path in paths])
        # paths are laid end to end, so far apart that no window reaches from one into the next
        ends, apart = np.array([(t[0], t[-1]) for t, _ in far]), float(self.zone.max())
        self.shift = np.cumsum(ends[:, 1] - ends[:, 0] + apart) - ends[:, 1]
        self._t = np.concatenate([t + by for (t, _), by in zip(far, self.shift, strict=True)])
        self._q = np.concatenate([q for _, q in far])
        self._local = np.concatenate([t for t, _ in far])
        step = np.diff(self._t)[:, None]  # as they are rounded where they are laid: what is integrated is continuous
        between = np.ones(len(step), dtype=bool)
        between[self._first[1:-1] - 1] = False  # from the end of one path to the beginning of the next
        length = np.where(between[:, None], step, 1.0)
        self._slope = np.where(between[:, None], np.diff(self._q, axis=0) / length, 0.0)
        area = np.where(between[:, None], (self._q[:-1] + self._q[1:]) / 2 * length, 0.0)
        self._area = _summed(area, self._first[1:-1] - 1)
        bend = np.abs(np.diff(self._slope, axis=0))
        bend[~(between[:-1] & between[1:])] = 0.0
        self._corner, at = self._t[1:-1], self._local[1:-1, None]
        # where one path ends and where the next begins is a corner that bends nothing
        self._sums = tuple(_summed(bend * at**power, self._first[1:-1] - 2) for power in range(3))

    def at(self, u: Floats) -> tuple[Floats, Floats, Floats]:
        """Integral, place and slope of the rows at lengths, (k, j) each."""
        k = np.clip(np.searchsorted(self._t, u, side="right") - 1, 0, len(self._slope) - 1)
        h = (u - self._t[k])[:, None]
        q, slope = self._q[k], self._slope[k]
        return self._area[k] + q * h + slope * h**2 / 2, q + slope * h, slope

    def rounded(self, u: Floats, zone: Floats) -> Floats:
        """Configurations of the sheet, (k, j), rad."""
        begin, end = u - zone, u + zone  # far out along the paths each is rounded by more than the zone itself
        out: Floats = (self.at(end)[0] - self.at(begin)[0]) / (end - begin)[:, None]
        return out

    def bends(self, some: _JoinedRectangles) -> tuple[Floats, Floats]:
        """What rectangles are off the mean of their corners by.

        Returns:
            Of each joint by its second derivatives along both sides, (2, k, j), rad; and how far each joint turns
            along both sides at most, (2, k, j), rad.
        """
        u, v, z, w = some.u, some.v, some.narrow, some.wide
        du, dz = ((v - u) / 2)[:, None], ((w - z) / 2)[:, None]
        zero, one, two = self._sums
        # the windows that are averaged over at the corners (u, z), (u, w), (v, z) and (v, w): where they begin and end
        ends = np.array([[u - z, u + z], [u - w, u + w], [v - z, v + z], [v - w, v + w]])
        area, q, slope = (each.reshape(4, 2, len(u), -1) for each in self.at(ends.ravel()))
        # the corners of the rows between lengths, both ends among them
        first, inner = np.searchsorted(self._corner, np.stack([ends[1, 0], ends[0, 1]]))
        end, stop = np.searchsorted(self._corner, np.stack([ends[2, 0], ends[3, 1]]), side="right")
        zeros = zero[stop] - zero[first]
        most = zeros / (2 * z)[:, None]
        # of z: convex in u, so greatest at one of the ends
        twos, ones = two[stop] - two[first], one[stop] - one[first]
        x, y = ((at - self.shift[some.path])[:, None] for at in (u, v))
        moment = np.maximum(*(twos - 2 * at * ones + at**2 * zeros for at in (x, y)))
        # of sums over the whole path up to here little is left: what each addition in the window may round is put on
        large = (np.sqrt(two[stop]) + np.maximum(np.abs(x), np.abs(y)) * np.sqrt(zero[stop])) ** 2
        moment = np.maximum(moment, 0.0) + ROUNDED * (stop - first + 4)[:, None] * large
        by_zone = np.minimum(moment / (2 * z**3)[:, None], most)
        # of u: by the slopes at both ends of the window, and what they change by as it moves
        changes = zero[end] - zero[first] + zero[stop] - zero[inner]
        slopes = np.abs(slope[3, 1] - slope[1, 0])
        by_length = np.minimum((slopes + changes) / (2 * z)[:, None], most)
        size = (ends[:, 1] - ends[:, 0])[..., None] / 2
        mean = (area[:, 1] - area[:, 0]) / (2 * size)
        speed_u = (np.abs(q[:, 1] - q[:, 0]) / (2 * size)).max(axis=0)
        speed_z = (np.abs((q[:, 1] + q[:, 0]) / 2 - mean) / size).max(axis=0)
        # every place is no further from some corner than half of each side
        speed_u += du * by_length + dz * most
        speed_z += dz * by_zone + du * most
        return np.stack([du**2 / 2 * by_length, dz**2 / 2 * by_zone]), np.stack([2 * du * speed_u, 2 * dz * speed_z])


def _summed(x: Floats, ends: Ints) -> Floats:
    """Sums of rows (k, j) up to each, (k + 1, j), anew for each path: after rows ``ends``, which are nothing."""
    out = np.zeros((len(x) + 1, x.shape[1]))
    for first, stop in pairwise([0, *(ends + 1).tolist(), len(x)]):
        np.cumsum(x[first:stop], axis=0, out=out[first + 1 : stop + 1])
    out[ends + 1] = 0.0
    return out


@dataclass(frozen=True, eq=False)
class _JoinedRectangles(SheetRectangles):
    """Rectangles of the sheets of several paths, whose lengths are laid end to end.

    Attributes:
        path: whose, (k,).
        laid: deposits laid there, (k,).
    """

    path: Ints
    laid: Ints


@dataclass(frozen=True, eq=False)
class StepSheets:
    """Steps of a path that is rounded.

    Attributes:
        path: the rows.
        known: what is known of them.
        steps: those in question, ascending, (k,).
    """

    path: BlendedPath
    known: KnownRows
    steps: Ints


def sheets_kept(proofs: PlaneProofs, radius: Floats, asked: Sequence[StepSheets]) -> list[NDArray[np.bool_]]:
    """The steps on which every rounding of the corners is proved to keep the clearance.

    Args:
        proofs: of the checker that the steps are checked against.
        radius: from ``cell.collision.proofs.reach_radii.radii``, (j,), m.
        asked: steps of paths, which all have one clearance to keep.

    Returns:
        For each path whether that is proved of each of its steps in question, (k,).
    """
    curves = _JoinedPaths([one.path for one in asked], radius)
    lost, by_rows = _whole(curves, asked)
    least = asked[0].known.least
    for most, spacings in ROUNDS:
        if not len(lost.path):
            break
        lost, bends, turn = _divided(curves, lost, most)
        each, corner = _corners(lost)
        kept = proofs.of_pieces(curves.rounded(*each), SheetPieces(corner, lost.laid, bends, turn), least, spacings)
        lost = lost.rows(kept < least)
    out = []
    for i, one in enumerate(asked):
        mine = lost.path == i
        s = one.path.s - one.path.s[0] + curves.shift[i]
        proved = by_rows[i].copy()
        for u, v in zip(lost.u[mine].tolist(), lost.v[mine].tolist(), strict=True):
            proved &= (s[one.steps + 1] <= u) | (s[one.steps] >= v)
        out.append(proved)
    return out


def _whole(curves: _JoinedPaths, asked: Sequence[StepSheets]) -> tuple[_JoinedRectangles, list[NDArray[np.bool_]]]:
    """The sheets of all steps, each run of steps one rectangle, from zones on up to which the rows are enough.

    Returns:
        The rectangles, and of each path which steps are among them.
    """
    found, there = [], []
    for i, one in enumerate(asked):
        k, zone = one.steps, curves.zone[i]
        alone = one.path.s - one.path.s[0]
        s, corners = alone + curves.shift[i], PathCorners.of(BlendedPath(one.path.q, alone, float(zone)))
        room, share = one.known.kept[k] - one.known.least, np.zeros(len(k))
        for some in SHARES:
            left = np.flatnonzero(share == 0)
            if not len(left):
                break
            ends = alone[np.concatenate([k[left], k[left] + 1])]
            off = replace(corners, zone=some * zone).off(curves.radius, ends).reshape(2, -1).max(axis=0)
            share[left[off <= room[left]]] = some
        there.append(share > 0)
        laid = one.known.laid_on_steps[k]
        apart = (np.diff(k) != 1) | (np.diff(share) != 0) | (np.diff(laid) != 0)
        for run in np.split(np.arange(len(k)), np.flatnonzero(apart) + 1):
            if len(run) and share[run[0]] > 0:
                found.append((i, laid[run[0]], s[k[run[0]]], s[k[run[-1]] + 1], share[run[0]] * zone, zone))
    path, laid_there, u, v, narrow, wide = np.array(found).reshape(-1, 6).T
    return _JoinedRectangles(u, v, narrow, wide, path.astype(np.int64), laid_there.astype(np.int64)), there


def _divided(curves: _JoinedPaths, some: _JoinedRectangles, most: float) -> tuple[_JoinedRectangles, Floats, Floats]:
    """Rectangles divided until they are little off their corners; and what they are off, (k, j) and (2, k, j)."""
    done: list[tuple[_JoinedRectangles, Floats, Floats]] = []
    radius = curves.radius
    for n in range(DIVIDED + 1):
        if not len(some.path):
            break
        bend, turn = curves.bends(some)
        by_side = bend @ radius + np.stack([curvature(radius, side) for side in turn]) / 8
        enough = (by_side.sum(axis=0) <= most) | (n == DIVIDED or 2 * len(some.path) > MOST)
        done.append((some.rows(enough), bend.sum(axis=0)[enough], turn[:, enough]))
        some = some.rows(~enough).halves((by_side[0] > by_side[1])[~enough])
    rectangles, bends, turns = zip(*done, strict=True)
    return _JoinedRectangles.joined(rectangles), np.concatenate(bends), np.concatenate(turns, axis=1)


def _corners(some: _JoinedRectangles) -> tuple[Floats, Ints]:
    """Lengths and zones of all corners, (2, m), and which of them are those of each rectangle, (k, 4)."""
    at = np.concatenate([some.u, some.v, some.u, some.v])
    zone = np.concatenate([some.narrow, some.narrow, some.wide, some.wide])
    first, of = distinct(at, zone)
    return np.stack([at[first], zone[first]]), of.reshape(4, -1).T
