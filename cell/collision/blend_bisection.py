"""Roundings that the other proofs leave open, bisected until all of them are proved free or one is not.

    hits = colliding_blends(checker, radius, path, known, steps)         # steps of BlendedPath(q, s, zone)
    hits.step, hits.zone, hits.nearest

All roundings of a step, over any zone up to the path's, form a sheet of configurations with two parameters: the path's
length and the zone. A rectangle of the sheet keeps a clearance if the configuration in its middle exceeds it by the
farthest that any point can travel from there to the rest of the rectangle; otherwise the rectangle is halved. Between
its corners the sheet is off their bilinear mean by no more than an eighth of the squares of its sides times the second
derivatives. Both of these are less than the change of the slope along the window that is averaged over, divided by the
width of the window. Radians and metres; a path's length may be in either.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from ..timing.blending import kept_zone, mirrored
from .blend_proofs import KnownRows, PathCorners, every_blend_kept
from .blended_paths import BlendedPath, PathBlends, SheetRectangles, on_rows
from .clearances import Clearances, SeesClearances
from .pair_groups import groups_of

NEARLY_ALL = 2.5e-4  # m: between roundings that are checked no other is nearer than the clearance less this
MANY, NEARLY_MANY = 20_000, 0.5  # likewise, once so many have been checked: this share of the clearance
LIKELY = 1.1  # times the room that was seen may be there half a rectangle further
MOST, FEW = 200_000, 20_000  # rectangles of a path that are weighed; of one that is known not to be free
HALVINGS = 2  # of the zone, in search of the widest that is proved


@dataclass(frozen=True, eq=False)
class CollidingBlends:
    """Roundings that come too near to something, at most one for each step.

    Attributes:
        step: of the path, (k,).
        zone: over which it is rounded there, (k,).
        nearest: what it comes near to.
    """

    step: Ints
    zone: Floats
    nearest: Clearances


@dataclass(frozen=True, eq=False)
class _StepSheetRectangles(SheetRectangles):
    """Rectangles of the sheets of steps.

    Attributes:
        step: of the path, (k,).
        room: what was seen beyond the clearance where it was checked last, (k,), m; infinite where that was nowhere.
    """

    step: Ints
    room: Floats


def colliding_blends(
    checker: SeesClearances, radius: Floats, path: BlendedPath, known: KnownRows, steps: Ints
) -> CollidingBlends:
    """Check all roundings of steps.

    Args:
        checker: collision detection.
        radius: from ``cell.collision.proofs.reach_radii.radii``, (j,), m.
        path: the rows.
        known: what is known of them.
        steps: those in question, ascending, (k,).

    Returns:
        Those that do not keep the clearance; all others keep it, but for ``NEARLY_ALL``, or half of it where a path
        needs more than ``MANY`` looks: nothing is touched in either case where the clearance is more than that. What
        is not proved by ``MOST`` rectangles counts as too near, whatever was seen. Of a path that is known not to be
        free, ``FEW`` are weighed, and what they leave open is left out.
    """
    s = path.s - path.s[0]
    path = BlendedPath(path.q, s, kept_zone(path.zone, s[-1]))
    # what is not seen at rows is beyond the reach of what looked; a group that sees further knows no more of them
    low = np.minimum(known.found.distance, checker.reach)
    known = replace(known, found=replace(known.found, distance=low))
    hits = [_checked_rectangles(group, radius, path, known, steps) for group in groups_of(checker)]
    nearest = Clearances.joined([one.nearest for one in hits])
    step, zone = (np.concatenate(some) for some in zip(*((one.step, one.zone) for one in hits), strict=True))
    order = np.argsort(nearest.distance, kind="stable")
    first, index = np.unique(step[order], return_index=True)
    return CollidingBlends(first, zone[order[index]], nearest.rows(order[index]))


def _checked_rectangles(
    checker: SeesClearances, radius: Floats, path: BlendedPath, known: KnownRows, steps: Ints
) -> CollidingBlends:
    """The same of some pairs."""
    s, least = path.s, known.least
    steps = steps[~every_blend_kept(checker, radius, path, known, _only(steps, path))[steps]]
    sheet = _SheetDistances(checker, radius, path)
    ends, narrow = (s[steps], s[steps + 1]), _proved_zone(checker, radius, path, known, steps)
    open_ = _StepSheetRectangles(*ends, narrow, np.full(len(steps), path.zone), steps, np.full(len(steps), np.inf))
    step, zone, what, looks = [np.zeros(0, dtype=np.int64)], [np.zeros(0)], [Clearances.none(0)], 0
    weighed, lost, laid = 0, known.lost, known.laid_on_steps
    while len(open_.step):
        weighed += len(open_.step)
        if weighed > (FEW if lost else MOST):
            break
        middle, far, along = sheet.extent(open_)
        # where there is hardly more room than there was, to check so large a one is of no use
        enough = NEARLY_ALL if looks < MANY else max(NEARLY_ALL, NEARLY_MANY * least)
        near = (far < np.minimum(checker.reach - least, LIKELY * open_.room)) | (far <= enough)
        some = open_.rows(near)
        seen = checker.clearances(middle[near], laid[some.step])
        looks += len(some.step)
        hit = seen.distance < least
        first, row = np.unique(some.step[hit], return_index=True)
        step.append(first)
        zone.append(((some.narrow + some.wide) / 2)[hit][row])
        what.append(seen.rows(np.flatnonzero(hit)[row]))
        left = np.ones(len(far), dtype=bool)
        open_.room[near] = np.minimum(seen.distance, checker.reach) - least
        left[near] = (open_.room[near] < far[near]) & (far[near] > enough)
        left &= ~np.isin(open_.step, first)
        lost |= bool(len(first))
        open_ = open_.rows(left).halves(along[left])
    if len(open_.step) and not lost:
        some = open_.rows(_nearest_of_each(open_))
        middle, _, _ = sheet.extent(some)
        step.append(some.step)
        zone.append((some.narrow + some.wide) / 2)
        seen = checker.clearances(middle, laid[some.step])
        what.append(replace(seen, distance=np.minimum(seen.distance, checker.reach)))
    return CollidingBlends(np.concatenate(step), np.concatenate(zone), Clearances.joined(what))


def _nearest_of_each(some: _StepSheetRectangles) -> NDArray[np.bool_]:
    """The rectangle with the least room of each step."""
    order = np.lexsort((some.room, some.step))
    _, first = np.unique(some.step[order], return_index=True)
    out = np.zeros(len(order), dtype=bool)
    out[order[first]] = True
    return out


def _proved_zone(checker: SeesClearances, radius: Floats, path: BlendedPath, known: KnownRows, steps: Ints) -> Floats:
    """The zone up to which every rounding of a step is proved free, (k,); 0 where none was found."""
    low, high = np.zeros(len(steps)), np.full(len(steps), 1.0)
    for _ in range(HALVINGS):
        share = (low + high) / 2
        proved = np.zeros(len(steps), dtype=bool)
        for one in np.unique(share).tolist():
            mine = share == one
            narrower, which = BlendedPath(path.q, path.s, one * path.zone), _only(steps[mine], path)
            proved[mine] = every_blend_kept(checker, radius, narrower, known, which)[steps[mine]]
        low, high = np.where(proved, share, low), np.where(proved, high, share)
    return low * path.zone


def _only(steps: Ints, path: BlendedPath) -> NDArray[np.bool_]:
    """Some steps of a path, (m - 1,)."""
    out = np.zeros(len(path.s) - 1, dtype=bool)
    out[steps] = True
    return out


class _SheetDistances:
    """How far configurations of a sheet are from one another."""

    def __init__(self, checker: SeesClearances, radius: Floats, path: BlendedPath) -> None:
        self._checker, self._radius, self._path = checker, radius, path
        self._run, self._corners = PathBlends(path.q, path.s), PathCorners.of(path)
        changes = np.cumsum(np.abs(self._corners.bend) @ radius)
        self._changes = np.concatenate([[0.0], changes])
        self._t, q = mirrored(path.q, path.s)
        self._travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(q, axis=0)) @ radius)])

    def extent(self, some: _StepSheetRectangles) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        """The middle configuration of each, how far anything can move from there, and in which direction it moves more.

        Args:
            some: rectangles.

        Returns:
            (k, j), rad; (k,), m, at most; and whether it is along the path rather than by the zone, (k,).
        """
        rows = some.narrow <= 0.0
        m = (some.u + some.v) / 2
        middle = np.empty((len(m), self._path.q.shape[1]))
        far, along = np.empty(len(m)), np.empty(len(m), dtype=bool)
        if rows.any():
            middle[rows], far[rows], along[rows] = self._near_rows(some.rows(rows), m[rows])
        if not rows.all():
            middle[~rows], far[~rows], along[~rows] = self._between_zones(some.rows(~rows), m[~rows])
        return middle, far, along

    def _near_rows(self, some: _StepSheetRectangles, m: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        path, radius, checker = self._path, self._radius, self._checker
        middle, begin = on_rows(path.q, path.s, m), on_rows(path.q, path.s, some.u)
        off = np.empty((2, len(m)))
        for zone in np.unique(some.wide).tolist():
            k = np.flatnonzero(some.wide == zone)
            corners = PathCorners(self._corners.s, self._corners.bend, zone)
            off[:, k] = corners.off(radius, some.u[k]), corners.off(radius, some.v[k])
        # where hardly any length is gone while axes turn, that is far less than what the slopes change by
        most = np.minimum(off.max(axis=0), self._travelled(some) / 2)
        # a straight way: as far to either end, but for what it bends
        way = checker.travel_bound(radius, middle, begin) + checker.bend_bound(radius, np.abs(begin - middle))
        return middle, way + most, way > most

    def _between_zones(self, some: _StepSheetRectangles, m: Floats) -> tuple[Floats, Floats, NDArray[np.bool_]]:
        radius, checker = self._radius, self._checker
        middle = self._run.at(m, (some.narrow + some.wide) / 2)
        ends = [self._run.at(at, zone) - middle for at in (some.u, some.v) for zone in (some.narrow, some.wide)]
        far = np.zeros(len(m))
        for one, across in ((ends[0], ends[3]), (ends[1], ends[2])):
            # the corner across is as far, but for what the way bends and for what they are off its middle
            way = checker.travel_bound(radius, middle, middle + one)
            way += checker.bend_bound(radius, np.abs(one)) + np.abs(one + across) @ radius
            far = np.maximum(far, way)
        far += checker.bend_bound(radius, np.ptp(ends, axis=0)) / 2
        # no rounding is steeper than half of what is travelled in its window, over half the window
        steep = self._travelled(some) / (2 * some.narrow)
        steepest = steep * (some.v - some.u + some.wide - some.narrow) / 2
        first = np.searchsorted(self._corners.s, some.u - some.wide)
        stop = np.searchsorted(self._corners.s, some.v + some.wide, side="right")
        curved = (self._changes[stop] - self._changes[first]) / (2 * some.narrow)
        far += ((some.v - some.u) ** 2 + (some.wide - some.narrow) ** 2) / 8 * curved
        length = np.abs(ends[2] + ends[3] - ends[0] - ends[1]) @ radius + (some.v - some.u) ** 2 / 4 * curved
        width = np.abs(ends[1] + ends[3] - ends[0] - ends[2]) @ radius + (some.wide - some.narrow) ** 2 / 4 * curved
        along = np.where(far <= steepest, length > width, some.v - some.u > some.wide - some.narrow)
        return middle, np.minimum(far, steepest), along

    def _travelled(self, some: _StepSheetRectangles) -> Floats:
        """How far anything moves at most within the widest window about each rectangle, (k,), m."""
        low, high = (np.interp(at, self._t, self._travel) for at in (some.u - some.wide, some.v + some.wide))
        out: Floats = high - low
        return out
