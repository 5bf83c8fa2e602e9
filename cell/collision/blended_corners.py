"""Rounded corners checked: a controller leaves the rows at corners, so the path that it may run is checked as well.

    step, nearest = cut_corners(checker, radius, BlendedPath(q, s, zone), deposits_laid, found, least)  # steps not free

A controller may round less than is asked. For most corners every rounding is proved free (``blend_proofs``,
``blend_sheets``). Only the remaining steps are checked further: the path with the full rounding, which
``cell.timing.time_law`` times (``blend_chords``), and all smaller roundings (``blend_bisection``). A rounded path is
made of parabolas (``blended_paths``), of which it is known exactly how far they are off the rows and how far off their
own chords.

Radians and metres; a path's length may be in either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from ..timing.blending import blended, kept_zone, mirrored
from .blend_bisection import colliding_blends
from .blend_chords import BlendedSteps, not_proved_by_chords
from .blend_proofs import KnownRows, every_blend_kept
from .blend_sheets import StepSheets, sheets_kept
from .blended_paths import NOTHING, BlendedPath, Parabolas, PathBlends, on_rows, pieces
from .clearances import Clearances, SeesClearances
from .proofs.motion_bounds import curvature, joint_travel_bound
from .proofs.plane_proofs import has_proofs, proofs_of

HALVED = 6  # times that a step is halved before it is checked by chords
STEPS_AGAIN, PLACES_AGAIN = 100, 12  # of what is too near so many steps are checked again, in so many places


def _off_rows(checker: SeesClearances, radius: Floats, path: BlendedPath, p: Parabolas, most: Floats) -> Floats:
    """How far anything is off where the rows have it on each step, at most, (m - 1,), m.

    Args:
        checker: of what moves.
        radius: of the arm about its joints.
        path: the rows.
        p: its parabolas.
        most: where it is more than this by the joints' radii, (m - 1,), m, it is checked more closely.
    """
    off = np.zeros(len(path.s) - 1)
    np.maximum.at(off, p.row, p.off)
    close = np.flatnonzero((off > most) & (most >= 0))
    if len(close):
        off[close] = np.minimum(off[close], _off_closely(checker, radius, path, p, close))
    return off


def _off_closely(checker: SeesClearances, radius: Floats, path: BlendedPath, p: Parabolas, steps: Ints) -> Floats:
    """How far anything is off where the rows have it on some steps, by where the arm's links are, (k,), m.

    Where the parabolas end that is measured; between, the difference of both ways bends by so much at most: by the
    joints' bend times their radii, and each way by what its joints' turning bends it, of two parts of the arm each.
    """
    piece = np.flatnonzero(np.isin(p.row, steps))
    ends, at = np.unique(np.stack([p.s[piece], p.s[piece + 1]], axis=1), return_inverse=True)
    at = at.reshape(-1, 2)
    there = blended(path.q, path.s, path.zone, ends)
    away = checker.travel_bound(radius, on_rows(path.q, path.s, ends), there)
    t, far = mirrored(path.q, path.s - path.s[0])
    zone, off = kept_zone(path.zone, path.s[-1] - path.s[0]), ends - path.s[0]
    slope = np.abs(on_rows(far, t, off + zone) - on_rows(far, t, off - zone)) / (2 * zone)
    straight = np.abs(np.diff(path.q, axis=0)) / np.diff(path.s)[:, None]
    steepest = np.maximum.reduce([slope[at[:, 0]], slope[at[:, 1]], straight[p.row[piece]]])
    bends = p.bend[piece] + 4 * curvature(radius, steepest)
    here = away[at].max(axis=1) + np.diff(ends[at], axis=1)[:, 0] ** 2 / 8 * bends
    out = np.zeros(len(path.s))
    np.maximum.at(out, p.row[piece], here)
    return out[steps]


def cut_corners(
    checker: SeesClearances,
    radius: Floats,
    path: BlendedPath,
    deposits_laid: Ints,
    found: Clearances,
    least: float,
    which: NDArray[np.bool_] | None = None,
    kept: Floats | None = None,
    *,
    lost: bool = False,
    laid_between: Ints | None = None,
) -> tuple[Ints, Clearances]:
    """Steps of a path that come, or may come, too near to something once the corners are rounded.

    Args:
        checker: collision detection at the table pose.
        radius: from ``cell.collision.proofs.reach_radii.radii``, (j,), m.
        path: rows that are free themselves, between them as well.
        deposits_laid: deposits laid at each row, (m,).
        found: clearances at the rows, at least.
        least: clearance to be kept, m; 0: nothing is touched.
        which: steps that are checked, (m - 1,); all of them where left out.
        kept: clearance kept on each of them, at least, (m - 1,), m; where it is not known, left out or -inf.
        lost: whether the motion is known not to be free already: then not every such step is found.
        laid_between: deposits laid from each row to the next, (m - 1,), at neither end fewer; where left out, as many
            as at the end with more.

    Returns:
        First rows of these steps, (k,), ascending, and the nearest pair on each.
    """
    steps = len(path.s) - 1
    every = np.ones(steps, dtype=bool) if which is None else which
    kept = np.full(steps, -np.inf) if kept is None else kept
    known = KnownRows(deposits_laid, found, least, every, kept, lost, laid_between)
    return cut_corners_of(checker, radius, [(path, known)])[0]


def cut_corners_of(
    checker: SeesClearances, radius: Floats, paths: Sequence[tuple[BlendedPath, KnownRows]]
) -> list[tuple[Ints, Clearances]]:
    """As :func:`cut_corners`, for several paths with the same clearance: one proof costs less than many.

    Args:
        checker: collision detection at the table pose.
        radius: from ``cell.collision.proofs.reach_radii.radii``, (j,), m.
        paths: each with what is known of its rows.

    Returns:
        For each path what :func:`cut_corners` gives.
    """
    by_sheets = has_proofs(checker)
    left = [_not_by_rows(checker, radius, *one, by_sheets=by_sheets) for one in paths]
    asked = [
        StepSheets(path, rows, np.flatnonzero(open_ & (rows.kept > rows.least)))
        for (path, rows), open_ in zip(paths, left, strict=True)
    ]
    some = [i for i, one in enumerate(asked) if len(one.steps)]
    proofs = proofs_of(checker) if some else None
    if proofs is not None:
        for i, kept in zip(some, sheets_kept(proofs, radius, [asked[i] for i in some]), strict=True):
            left[i][asked[i].steps[kept]] = False
    return [_cut_where(checker, radius, *one, open_) for one, open_ in zip(paths, left, strict=True)]


def _not_by_rows(
    checker: SeesClearances, radius: Floats, path: BlendedPath, rows: KnownRows, *, by_sheets: bool
) -> NDArray[np.bool_]:
    """Steps of which what is known of the rows does not prove that any rounding is free, (m - 1,).

    What sheets can be made of is left to them, unless it takes next to nothing to prove.
    """
    if len(path.s) < 3:
        return np.zeros(len(path.s) - 1, dtype=bool)
    closely = not by_sheets or not (rows.kept[rows.which] > rows.least).all()
    return rows.which & ~every_blend_kept(checker, radius, path, rows, closely=closely)


def _cut_where(
    checker: SeesClearances, radius: Floats, path: BlendedPath, rows: KnownRows, left: NDArray[np.bool_]
) -> tuple[Ints, Clearances]:
    """As :func:`cut_corners`, for steps of which nothing is proved yet."""
    if not left.any():
        return np.zeros(0, dtype=np.int64), Clearances.none(0)
    step, nearest = _cut_on(checker, radius, path, replace(rows, which=left))
    left[step] = False
    less = colliding_blends(checker, radius, path, rows, np.flatnonzero(left))
    both = np.concatenate([step, less.step])
    order = np.argsort(both, kind="stable")
    first, nearest = np.asarray(both[order]), Clearances.joined([nearest, less.nearest]).rows(order)
    zone = np.concatenate([np.full(len(step), path.zone), less.zone])[order]
    _look_closely(checker, path, zone, first, rows.laid_on_steps, nearest)
    return first, nearest


def _look_closely(
    checker: SeesClearances, path: BlendedPath, zone: Floats, steps: Ints, laid: Ints, nearest: Clearances
) -> None:
    """Note what is nearer on steps that are too near, rounded over so much, than what they were found by.

    Along each as it was found; where that is nearest, rounded over other zones; and along it by the best of these.
    """
    run, s = PathBlends(path.q, path.s - path.s[0]), path.s - path.s[0]
    widest = kept_zone(path.zone, s[-1])
    for n, k in enumerate(steps[:STEPS_AGAIN].tolist()):
        deposits_laid, places = np.full(PLACES_AGAIN, laid[k]), np.linspace(s[k], s[k + 1], PLACES_AGAIN)
        at, over = places, np.full(PLACES_AGAIN, kept_zone(float(zone[n]), s[-1]))
        for _ in range(3):
            there = checker.clearances(run.at(at, over), deposits_laid)
            best = int(np.argmin(there.distance))
            nearest.nearer(np.array([n]), there.rows(np.array([best])))
            if at is places:
                at, over = np.full(PLACES_AGAIN, at[best]), widest * np.arange(1, PLACES_AGAIN + 1) / PLACES_AGAIN
            else:
                at, over = places, np.full(PLACES_AGAIN, over[best])


def _cut_on(checker: SeesClearances, radius: Floats, path: BlendedPath, rows: KnownRows) -> tuple[Ints, Clearances]:
    """As :func:`_cut`, of the part of a path on which there are steps to be checked: the rest is not taken apart.

    Rows further than the zone from a step say nothing of how it is rounded.
    """
    steps = np.flatnonzero(rows.which)
    if not len(steps):
        return steps, Clearances.none(0)
    # by another zone, so that the part is long enough for its zone
    low = int(np.searchsorted(path.s, path.s[steps[0]] - 2.1 * path.zone, side="right")) - 1
    high = int(np.searchsorted(path.s, path.s[steps[-1] + 1] + 2.1 * path.zone))
    low, high = max(low, 0), min(high, len(path.s) - 1)
    if high - low < 2:
        low, high = 0, len(path.s) - 1
    mine = slice(low, high + 1)
    found, which = rows.found.rows(np.arange(low, high + 1)), rows.which[low:high]
    laid_at, laid = rows.deposits_laid[mine], rows.laid_on_steps[low:high]
    known = KnownRows(laid_at, found, rows.least, which, rows.kept[low:high], laid_between=laid)
    step, nearest = _cut(checker, radius, BlendedPath(path.q[mine], path.s[mine], path.zone), known)
    return step + low, nearest


def _cut(checker: SeesClearances, radius: Floats, path: BlendedPath, rows: KnownRows) -> tuple[Ints, Clearances]:
    """As :func:`cut_corners`, of one rounded path."""
    p, deposits_laid, found, least = pieces(path, radius), rows.deposits_laid, rows.found, rows.least
    bend = np.zeros(len(path.s) - 1)
    np.maximum.at(bend, p.row, p.bend)
    off = _off_rows(checker, radius, path, p, rows.kept - least)
    # off the rows' own way by so much at most
    steps = rows.which & (off > NOTHING) & (rows.kept - off < least)
    q = blended(path.q, path.s, path.zone)
    known, sagitta = np.minimum(found.distance, checker.reach), np.diff(path.s) ** 2 / 8 * bend
    # clearances where the rows come to lie, at least; by the costlier bound where the cheap one is not enough
    low = known - joint_travel_bound(radius, path.q, q)
    near = _ends(steps) & (low < least)
    # between its ends a point is off the chord by the sagitta at most, and the chord no nearer than half of what the
    # ends' clearances have beyond its way: the rounded path keeps `least` where low + low - 2 least > way + 2 sagitta
    maybe = steps & (low[:-1] + low[1:] - 2 * least <= joint_travel_bound(radius, q[:-1], q[1:]) + 2 * sagitta)
    again = np.flatnonzero(near | _ends(maybe))
    low[again] = known[again] - checker.travel_bound(radius, path.q[again], q[again])
    at = np.flatnonzero(near & (low < least))
    seen = checker.clearances(q[at], deposits_laid[at])
    low[at] = np.minimum(seen.distance, checker.reach)
    hit = np.flatnonzero(seen.distance < least)
    k = np.flatnonzero(maybe)
    k = k[low[k] + low[k + 1] - 2 * least <= checker.travel_bound(radius, q[k], q[k + 1]) + 2 * sagitta[k]]
    run = BlendedSteps(path, p, sagitta, low, rows.laid_on_steps)
    open_, nearest = not_proved_by_chords(checker, radius, run, _left_by_halving(checker, radius, run, k, least), least)
    both = Clearances.joined([seen.rows(hit), nearest])
    first, index = np.unique(np.concatenate([np.minimum(at[hit], len(path.s) - 2), open_]), return_index=True)
    return first, both.rows(index)


def _ends(steps: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Rows at the ends of some steps."""
    out: NDArray[np.bool_] = np.append(steps, False) | np.append(False, steps)
    return out


def _left_by_halving(checker: SeesClearances, radius: Floats, run: BlendedSteps, steps: Ints, least: float) -> Ints:
    """Steps whose rounded path is not proved to keep a clearance by a few halvings of it.

    Between two of its points the rounded path is off their chord by an eighth of the square of the path's length times
    the greatest second derivative there. That falls to a quarter with each halving, the way on the chord to a half, so
    that most steps are settled by far fewer looks than chords of ``CHORD`` need.

    Args:
        checker: collision detection.
        radius: of the arm about its joints.
        run: the rounded path.
        steps: those in question, ascending.
        least: clearance to be kept, m.

    Returns:
        Those that are left, ascending.
    """
    path, s = run.path, run.path.s
    of, u, v = steps, s[steps], s[steps + 1]
    a, b = blended(path.q, s, path.zone, u), blended(path.q, s, path.zone, v)
    da, db = run.low[steps] - least, run.low[steps + 1] - least
    lost: list[Ints] = []
    for _ in range(HALVED):
        if not len(of):
            break
        m = (u + v) / 2
        middle = blended(path.q, s, path.zone, m)
        laid = run.laid[of]
        dm = np.minimum(checker.clearances(middle, laid).distance, checker.reach) - least
        lost.append(of[dm <= 0])
        of, u, v = np.concatenate([of, of]), np.concatenate([u, m]), np.concatenate([m, v])
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        da, db = np.concatenate([da, dm]), np.concatenate([dm, db])
        sagitta = (v - u) ** 2 / 8 * _most_bend(run.pieces, u, v)
        open_ = (da + db <= joint_travel_bound(radius, a, b) + 2 * sagitta) & ~np.isin(of, lost[-1])
        k = np.flatnonzero(open_)
        open_[k] = da[k] + db[k] <= checker.travel_bound(radius, a[k], b[k]) + 2 * sagitta[k]
        of = of[open_]
        u, v, a, b, da, db = (x[open_] for x in (u, v, a, b, da, db))
    return np.unique(np.concatenate([*lost, of]))


def _most_bend(p: Parabolas, low: Floats, high: Floats) -> Floats:
    """The greatest bend of the parabolas between path lengths, (k,), as of :class:`Parabolas`."""
    first = np.clip(np.searchsorted(p.s, low, side="right") - 1, 0, len(p.bend) - 1)
    last = np.clip(np.searchsorted(p.s, high, side="left"), first + 1, len(p.bend))
    most: Floats = np.maximum.reduceat(np.append(p.bend, 0.0), np.stack([first, last], axis=1).ravel())[::2]
    return most
