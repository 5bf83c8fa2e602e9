"""Corners proved free for every rounding, by the distance of any rounding from the rows; without collision queries.

    every_blend_kept(checker, radius, path, known)      # (m - 1,): on which steps any rounding keeps the clearance

A controller may round less than is asked: over any zone up to the one that is set. Rows have a corner i where the slope
of the joints changes by D_i. Rounded over a zone z they are off by the sum of D_i (z - u_i)^2 / 4z, over the corners no
further than z from there along the path, where u_i is how far. With a smaller zone each of these factors is smaller,
and those of the farther corners more so than those of the nearer ones: off the rows is then some mean of nothing and of
the sums over the nearest corners alone (summation by parts). So the full zone bounds all of them.

Where the arm reverses, this bound is large, although a rounded path only reverses earlier and stays close to the rows.
There another bound is used. A rounded path is a mean of the rows over a stretch of them. Split the motion into its
component along one direction and the remainder. Some row of the stretch has the mean's component along that direction,
and differs from the mean by no more than the remainder varies along the stretch. Radians and metres; a path's length
may be in either.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints, repeat_with_index
from ..timing.blending import kept_zone, mirrored
from .blended_paths import NOTHING, BlendedPath
from .clearances import Clearances, SeesClearances
from .proofs.between_samples import laid_on_steps
from .proofs.motion_bounds import joint_travel_bound

TOGETHER = 200_000  # corners that are weighed at once


@dataclass(frozen=True, eq=False)
class KnownRows:
    """Clearances of the rows of a path; the rows are free, and so are the straight motions between them.

    Attributes:
        deposits_laid: deposits laid at each row, (m,).
        found: clearances at the rows, at least.
        least: clearance to be kept, m; 0: nothing is touched.
        which: steps that are checked, (m - 1,).
        kept: clearance kept on each of them, at least, (m - 1,), m; -inf where it is not known.
        lost: whether the motion is known not to be free for another reason: then less is looked for.
        laid_between: deposits laid from each row to the next, (m - 1,), at neither end fewer; None: as many as at the
            end with more.
    """

    deposits_laid: Ints
    found: Clearances
    least: float
    which: NDArray[np.bool_]
    kept: Floats
    lost: bool = False
    laid_between: Ints | None = None

    @property
    def laid_on_steps(self) -> Ints:
        """Deposits laid on each step, (m - 1,)."""
        return laid_on_steps(self.deposits_laid, self.laid_between)


@dataclass(frozen=True, eq=False)
class PathCorners:
    """Where the slope of a path changes, those of its mirror images beyond its ends among them.

    Attributes:
        s: path length of each, ascending, (c,); row i's is number m - 2 + i.
        bend: change of slope, (c, j), rad per unit of path length.
        zone: the widest over which they are rounded.
    """

    s: Floats
    bend: Floats
    zone: float

    @classmethod
    def of(cls, path: BlendedPath) -> PathCorners:
        """Those of a path whose length begins with 0."""
        t, far = mirrored(path.q, path.s)
        slope = np.diff(far, axis=0) / np.diff(t)[:, None]
        return cls(t[1:-1], np.diff(slope, axis=0), path.zone)

    def share(self, away: Floats) -> Floats:
        """Distance of a rounded path from its rows at a distance from a corner, as a share of the corner's bend."""
        out: Floats = np.maximum(self.zone - away, 0.0) ** 2 / (4 * self.zone)
        return out

    def off(self, radius: Floats, at: Floats) -> Floats:
        """How far anything is off where the rows have it, at most, whatever the rounding, (k,), m.

        Between two rows this is a convex function of the path's length: no more than the chord of its values.
        """
        first, stop = (np.searchsorted(self.s, at + by) for by in (-self.zone, self.zone))
        weight, out = np.abs(self.bend) @ radius, np.zeros(len(at))
        for some in _in_blocks(stop - first):
            of, corner = _ragged(first[some], stop[some])
            away = np.abs(at[some][of] - self.s[corner])
            out[some] = np.bincount(of, self.share(away) * weight[corner], len(some))
        return out


def every_blend_kept(
    checker: SeesClearances,
    radius: Floats,
    path: BlendedPath,
    known: KnownRows,
    which: NDArray[np.bool_] | None = None,
    *,
    closely: bool = True,
) -> NDArray[np.bool_]:
    """Steps on which the clearance is kept however much the corners are rounded, up to the path's zone.

    Args:
        checker: collision detection, of which only what bounds its motion is asked.
        radius: from ``cell.collision.proofs.reach_radii.radii``, (j,), m.
        path: the rows.
        known: what is known of them.
        which: steps in question, (m - 1,); those of ``known`` where left out.
        closely: whether what the joints' radii leave is compared with where the arm's links are as well.

    Returns:
        (m - 1,) booleans: it is proved on these of the steps in question.
    """
    s = path.s - path.s[0]
    path = BlendedPath(path.q, s, kept_zone(path.zone, s[-1]))
    corners, least = PathCorners.of(path), known.least
    left = np.flatnonzero(known.which if which is None else which)
    rows = np.unique(np.concatenate([left, left + 1]))
    off, most, proved = np.zeros(len(s)), np.zeros(len(s) - 1), np.zeros(len(s) - 1, dtype=bool)
    off[rows] = corners.off(radius, path.s[rows])
    most[left] = np.maximum(off[left], off[left + 1])
    proved[left] = (most[left] <= NOTHING) | (known.kept[left] - most[left] >= least)
    left = left[~proved[left]]
    low, kept = np.minimum(known.found.distance, checker.reach), known.kept.copy()
    # a row counts for a step if no less is laid at it
    fewest = np.minimum(known.deposits_laid[left], known.deposits_laid[left + 1])
    alike = left[fewest >= known.laid_on_steps[left]]
    proved[alike] = _by_rows_near_corners(radius, path, corners, (off, low - least), alike)
    left, alike = left[~proved[left]], alike[~proved[alike]]
    if not len(left) or not closely:
        return proved
    way = checker.travel_bound(radius, path.q[alike], path.q[alike + 1])
    kept[alike] = np.maximum(kept[alike], (low[alike] + low[alike + 1] - way) / 2)
    close = left[kept[left] > least]
    off_there = np.minimum(most[close], _off_by_links(checker, radius, path, corners, close))
    proved[close] = kept[close] - off_there >= least
    left = left[~proved[left]]
    proved[left] = _by_turning_back(radius, path, known, kept, left)
    return proved


def _by_rows_near_corners(
    radius: Floats, path: BlendedPath, corners: PathCorners, at_rows: tuple[Floats, Floats], steps: Ints
) -> NDArray[np.bool_]:
    """Whether what is known where steps begin and end is enough for them, (k,): for all that is off the rows at all.

    Each half of a step is compared with its own end. How far a point of the half is from there, and how far it is off
    the rows, add up to a convex function of the path's length, which is greatest where the half begins or ends.
    """
    off, room = at_rows
    length = path.s[steps + 1] - path.s[steps]
    half = np.minimum(length / 2, corners.zone)
    way = joint_travel_bound(radius, path.q[steps], path.q[steps + 1]) * half / length
    out = np.ones(len(steps), dtype=bool)
    for row, inwards in ((steps, half), (steps + 1, -half)):
        out &= np.maximum(off[row], way + corners.off(radius, path.s[row] + inwards)) <= room[row]
    return out


def _off_by_links(
    checker: SeesClearances, radius: Floats, path: BlendedPath, corners: PathCorners, steps: Ints
) -> Floats:
    """How far anything is off where the rows have it, at most, by where the links are, whatever the rounding, (k,), m.

    On either side of a step the sums over its nearest corners lie along the sum over all of them, but for what is
    counted by the joints' radii. The links are put where a step has its middle: elsewhere on it they move otherwise by
    what joints that turn together bend their ways.
    """
    out = np.empty(len(steps))
    before = len(path.s) - 1 + steps  # so many are there up to its first row's; the others begin with its last row's
    low = np.searchsorted(corners.s, path.s[steps] - corners.zone, side="right")
    high = np.searchsorted(corners.s, path.s[steps + 1] + corners.zone)
    widest = np.maximum(before - low, high - before)
    for some in _in_blocks(np.maximum(widest, 1)):
        k = steps[some]
        middle, turned = (path.q[k] + path.q[k + 1]) / 2, np.abs(path.q[k + 1] - path.q[k]) / 2
        total = np.zeros(len(k))
        n = np.arange(max(int(widest[some].max()), 1))
        for corner, s in ((before[some, None] - 1 - n, path.s[k]), (before[some, None] + n, path.s[k + 1])):
            corner = np.clip(corner, 0, len(corners.s) - 1)
            mine = (corner >= low[some, None]) & (corner < high[some, None])
            share = np.where(mine, corners.share(np.abs(corners.s[corner] - s[:, None])), 0.0)
            sums = np.cumsum(share[..., None] * corners.bend[corner], axis=1)
            whole = sums[:, -1]
            square = np.maximum(np.einsum("kj,kj->k", whole, whole), 1e-30)
            along = np.einsum("knj,kj->kn", sums, whole) / square[:, None]
            aside = np.abs(sums - np.clip(along, 0.0, 1.0)[..., None] * whole[:, None]) @ radius
            total += checker.travel_bound(radius, middle, middle + whole) + aside.max(axis=1)
            total += _otherwise(checker, radius, turned, np.abs(whole))
            turned = turned + np.abs(whole)
        out[some] = total
    return out


def _otherwise(checker: SeesClearances, radius: Floats, a: Floats, b: Floats) -> Floats:
    """By how much a motion b moves anything otherwise once the joints have turned by a, (k,), m."""
    both, one, other = (checker.bend_bound(radius, turn) for turn in (a + b, a, b))
    return both - one - other


def _by_turning_back(
    radius: Floats, path: BlendedPath, known: KnownRows, kept: Floats, steps: Ints
) -> NDArray[np.bool_]:
    """Whether all means of the rows about steps are by some row that keeps more than they are off it, (k,)."""
    first = np.searchsorted(path.s, path.s[steps] - path.zone, side="right") - 1
    last = np.searchsorted(path.s, path.s[steps + 1] + path.zone)
    out = np.zeros(len(steps), dtype=bool)
    laid = known.laid_on_steps
    enough = np.where(known.which, kept, -np.inf) - known.least
    inside = np.flatnonzero((first >= 0) & (last < len(path.s)))  # beyond its ends there are no rows
    for block in _in_blocks((last - first + 1)[inside]):
        some = inside[block]
        n = np.arange(int((last - first)[some].max()) + 1)
        row = np.minimum(first[some, None] + n, last[some, None])  # the last one again
        q = path.q[row] * radius
        off = q - q.mean(axis=1, keepdims=True)
        direction = np.linalg.eigh(np.swapaxes(off, 1, 2) @ off)[1][:, :, -1]
        aside = off - np.einsum("knj,kj->kn", off, direction)[..., None] * direction[:, None]
        differs = np.ptp(aside, axis=1).sum(axis=1)
        step = np.minimum(row, last[some, None] - 1)
        room = enough[step].min(axis=1)
        out[some] = (differs <= room) & (laid[step].min(axis=1) >= laid[steps[some]])
    return out


def _in_blocks(count: Ints) -> Iterator[Ints]:
    """Numbers of things of so many parts each, in blocks of parts that fit together."""
    if not len(count):
        return
    block = np.cumsum(count) // TOGETHER
    for stop in np.unique(block):
        yield np.flatnonzero(block == stop)


def _ragged(first: Ints, stop: Ints) -> tuple[Ints, Ints]:
    """All numbers from each first one up to its stop, and whose they are."""
    of, place = repeat_with_index(stop - first)
    return of, first[of] + place
