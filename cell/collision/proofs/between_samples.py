"""Between two samples of a motion: the clearance at both ends is compared with how far the arm travels between them.

    radius = radii(scene)                                               # (n,) m
    open_at = unproven_steps(checker, radius, q, deposits_laid, found, least=0.005)   # steps on which it is not proved
    row, nearest = least_between_samples(checker, radius, q, deposits_laid, found)         # how near it comes

A step keeps a clearance if the excess of the clearances at its two ends, added up, is more than the longest distance
that any point of the arm can travel on the step. Otherwise the step is halved and its middle is checked. A step that is
still open after the last halving counts as not kept.

Source: Schwarzer, Saha, Latombe, Adaptive dynamic collision checking for single and multiple articulated robots in
complex environments, IEEE T-RO 2005.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ...arrays import Ints
from ..clearances import Clearances, SeesClearances
from .motion_bounds import joint_travel_bound
from .open_steps import OpenSteps
from .plane_proofs import proofs_of

HALVINGS = 12
NEAREST = 1e-4  # m: least clearances of the way are known to this
NEAREST_SHARE = 0.03  # of the least clearance, likewise
MANY_STEPS = 100  # steps, from which to have proofs by planes prepared costs less than they save
BENT = 4  # share of what a least clearance may be too large by that proofs may give for what is between samples
CLOSER = 20  # halvings about the nearest sample found


def unproven_steps(
    checker: SeesClearances,
    radius: Floats,
    q: Floats,
    deposits_laid: Ints,
    found: Clearances,
    apart: Ints | None = None,
    *,
    least: float = 0.0,
    laid_between: Ints | None = None,
) -> tuple[Ints, Clearances]:
    """Steps of a motion on which a clearance is not proved to be kept.

    Args:
        checker: collision detection at the table pose.
        radius: from :func:`radii`, (n,), m.
        q: samples, (m, n), rad; between neighbours the joints move on straight lines.
        deposits_laid: deposits laid at each sample, (m,).
        found: clearances at the samples.
        apart: motion that each sample belongs to, (m,); steps from one motion to the next are left out.
        least: clearance to be kept, m; 0: nothing is touched.
        laid_between: deposits laid from each sample to the next, (m - 1,), at neither end fewer; where left out, as
            many as at the end with more.

    Returns:
        First samples of the open steps, (k,), ascending, and the nearest pair seen on each of them. Of a motion that
        has one at which it is too near for certain, others need not be named.
    """
    step = steps_between(q, apart)
    motion = np.zeros(len(q), dtype=np.int64) if apart is None else apart
    known = np.minimum(found.distance, checker.reach)
    laid = laid_on_steps(deposits_laid, laid_between)[step]
    steps = OpenSteps(np.arange(len(step)), q[step], q[step + 1], known[step], known[step + 1], laid)
    left, hit, seen = halved(checker, radius, steps, motion[step], least)
    # what is left after the last halving is described by what is nearest at its beginning
    every, nearest = np.concatenate([hit, left]), Clearances.joined([seen, found.rows(step[left])])
    order = np.argsort(every, kind="stable")
    return step[every[order]], nearest.rows(order)


def halved(
    checker: SeesClearances, radius: Floats, steps: OpenSteps, motion: Ints, least: float
) -> tuple[Ints, Ints, Clearances]:
    """Halve steps until each is proved to keep a clearance, is found not to, or was halved HALVINGS times.

    Args:
        checker: collision detection.
        radius: from :func:`radii`, (n,), m.
        steps: numbered from 0.
        motion: that each belongs to, (k,): of one that does not keep it, others need not be named.
        least: clearance to be kept, m.

    Returns:
        Steps still open after the last halving, steps on which something is nearer, both ascending, and what it is.
    """
    hits, what = [np.zeros(0, dtype=np.int64)], [Clearances.none(0)]
    for _ in range(HALVINGS):
        steps = steps.rows(_open(checker, radius, steps.a, steps.b, steps.beyond(least)))
        if not len(steps.step):
            break
        middle = (steps.a + steps.b) / 2
        seen = checker.clearances(middle, steps.laid)
        dm = np.minimum(seen.distance, checker.reach)
        hit = dm <= least
        if hit.any():
            new, row = np.unique(steps.step[hit], return_index=True)
            hits.append(new)
            what.append(seen.rows(np.flatnonzero(hit)[row]))
        # a motion that is known not to be free is not checked any further; all others are
        on = ~np.isin(motion[steps.step], motion[steps.step[hit]])
        steps = steps.rows(on).halves(middle[on], dm[on])
    left = np.unique(steps.step[_open(checker, radius, steps.a, steps.b, steps.beyond(least))])
    return left, np.concatenate(hits), Clearances.joined(what)


def least_between_samples(
    checker: SeesClearances,
    radius: Floats,
    q: Floats,
    deposits_laid: Ints,
    found: Clearances,
    apart: Ints | None = None,
    *,
    known: float = np.inf,
    kept: Floats | None = None,
    many: int = MANY_STEPS,
    laid_between: Ints | None = None,
) -> tuple[int, Clearances]:
    """How near a motion comes to anything, between its samples too.

    Args:
        checker: collision detection at the table pose.
        radius: from :func:`radii`, (n,), m.
        q: samples, (m, n), rad; at least one.
        deposits_laid: deposits laid at each sample, (m,).
        found: clearances at the samples; with ``kept``, what was seen at some of them.
        apart: motion that each sample belongs to, (m,); steps from one motion to the next are left out.
        known: a distance that is come to elsewhere, m: what is no nearer than that is not looked for.
        kept: nothing is nearer from each sample to the next, (m,), m, where that is known already.
        many: steps, from which to have proofs by planes prepared costs less than they save.
        laid_between: as of :func:`unproven_steps`.

    Returns:
        The sample at which it is or after which it comes, and the one nearest pair; a distance that is too large by
        ``NEAREST`` or ``NEAREST_SHARE`` of it at most, whichever is more. None where nothing is within the reach.
    """
    step = steps_between(q, apart)
    way = _Way(q, deposits_laid, laid_on_steps(deposits_laid, laid_between), step)
    laid, nearest = way.laid[step], _Nearest.of(checker, way, found, known)
    low = np.minimum(found.distance, checker.reach)
    on_step = kept_on_steps(low, q, radius) if kept is None else kept
    k = np.flatnonzero(on_step[step] <= nearest.limit)
    proofs = proofs_of(checker) if len(k) > many else None
    if proofs is not None:
        proved = proofs.along(q, step[k], laid[k], nearest.limit, nearest.allowed / BENT)
        nearest.sees(proved.seen, way)
        k = k[proved.kept <= nearest.limit]
    if kept is not None and len(k):
        rows = np.unique(np.concatenate([step[k], step[k] + 1]))
        seen = Clearances.none(len(q))
        seen.put(rows, checker.clearances(q[rows], deposits_laid[rows]))
        low = np.minimum(seen.distance, checker.reach)
        nearest.sees(seen, way)
    steps = OpenSteps(step[k], q[step[k]], q[step[k] + 1], low[step[k]], low[step[k] + 1], laid[k])
    _halve(checker, radius, steps.rows(_open(checker, radius, steps.a, steps.b, steps.beyond(nearest.limit))), nearest)
    best = nearest.best
    if best.distance[0] > checker.reach:  # of a proof that looked further: what else is out there is not known
        return nearest.at, Clearances.none(1)
    return nearest.at, best if best.distance[0] > known else _closest(checker, nearest.about, nearest.there, best)


def kept_on_steps(low: Floats, q: Floats, radius: Floats) -> Floats:
    """Least clearance on the step after each sample, from the clearances at samples, (m,), m; -inf after the last."""
    way = joint_travel_bound(radius, q[:-1], q[1:])
    return np.append((low[:-1] + low[1:] - way) / 2, -np.inf)


@dataclass(frozen=True, eq=False)
class _Way:
    """Samples, (m, n), rad; deposits laid at each and on each step, (m,) and (m - 1,); and the steps that count."""

    q: Floats
    deposits_laid: Ints
    laid: Ints
    step: Ints

    def about(self, at: int) -> tuple[Floats, Floats, Floats]:
        """A sample between its neighbours; itself in place of one that a step leads to on which there is less."""
        before, after = (k in self.step and self.laid[k] >= self.deposits_laid[at] for k in (at - 1, at))
        here = self.q[at]
        return self.q[at - 1] if before else here, here, self.q[at + 1] if after else here


@dataclass
class _Nearest:
    """The nearest that has been found on the way so far.

    Attributes:
        best: the one row of it.
        at: sample at which or after which it is.
        there: deposits laid there.
        about: configurations before it, of it and after it.
        most: what is no nearer than that need not be found, m.
    """

    best: Clearances
    at: int
    there: int
    about: tuple[Floats, Floats, Floats]
    most: float

    @classmethod
    def of(cls, checker: SeesClearances, way: _Way, found: Clearances, known: float) -> _Nearest:
        """Of the samples."""
        most = min(known, checker.reach)
        out = cls(Clearances.none(1), 0, int(way.deposits_laid[0]), (way.q[0], way.q[0], way.q[0]), most)
        out.sees(found, way)
        return out

    def sees(self, found: Clearances, way: _Way) -> None:
        """Take note of what was seen at samples."""
        at = int(np.argmin(found.distance))
        if found.distance[at] < self.best.distance[0]:
            self.best, self.at, self.there = found.rows(np.array([at])), at, int(way.deposits_laid[at])
            self.about = way.about(at)

    @property
    def limit(self) -> float:
        """Distance, m, above which nothing has to be found."""
        return min(float(self.best.distance[0]), self.most) - self.allowed

    @property
    def allowed(self) -> float:
        """By how much what is found may be too large, m."""
        return max(NEAREST, NEAREST_SHARE * min(float(self.best.distance[0]), self.most))


def _halve(checker: SeesClearances, radius: Floats, steps: OpenSteps, nearest: _Nearest) -> None:
    """Check the middles of steps until no step can hold a nearer pair."""
    for _ in range(HALVINGS):
        if not len(steps.step):
            return
        middle = (steps.a + steps.b) / 2
        seen = checker.clearances(middle, steps.laid)
        k = int(np.argmin(seen.distance))
        if seen.distance[k] < nearest.best.distance[0]:
            nearest.best, nearest.at, nearest.there = seen.rows(np.array([k])), int(steps.step[k]), int(steps.laid[k])
            nearest.about = (steps.a[k], middle[k], steps.b[k])
        steps = steps.halves(middle, np.minimum(seen.distance, checker.reach))
        # on a step it comes no nearer than half of what its ends have beyond the way
        steps = steps.rows(_open(checker, radius, steps.a, steps.b, steps.beyond(nearest.limit)))


def _closest(checker: SeesClearances, about: tuple[Floats, Floats, Floats], laid: int, best: Clearances) -> Clearances:
    """The nearest pair about a sample, between those before and after it."""
    low, middle, high = about
    if not np.isfinite(best.distance[0]):
        return best
    for _ in range(CLOSER):
        tried = np.stack([(low + middle) / 2, (middle + high) / 2])
        seen = checker.clearances(tried, np.full(2, laid))
        k = int(np.argmin(seen.distance))
        if seen.distance[k] >= best.distance[0]:
            low, high = tried
            continue
        low, middle, high = (low, tried[0], middle) if k == 0 else (middle, tried[1], high)
        best = seen.rows(np.array([k]))
    return best


def laid_on_steps(deposits_laid: Ints, laid_between: Ints | None = None) -> Ints:
    """Deposits laid on the steps between samples.

    Args:
        deposits_laid: at each sample, (m,).
        laid_between: on each step, (m - 1,), where that is known.

    Returns:
        (m - 1,); where it is not known, as many as at the end with more.
    """
    return np.maximum(deposits_laid[:-1], deposits_laid[1:]) if laid_between is None else laid_between


def steps_between(q: Floats, apart: Ints | None) -> Ints:
    """Steps between samples of one motion."""
    step = np.arange(len(q) - 1)
    return step if apart is None else step[apart[:-1] == apart[1:]]


def _open(checker: SeesClearances, radius: Floats, a: Floats, b: Floats, room: Floats) -> NDArray[np.bool_]:
    """Steps whose clearances at both ends together do not prove them free; most are settled by the cheaper bound."""
    open_: NDArray[np.bool_] = room <= joint_travel_bound(radius, a, b)
    k = np.flatnonzero(open_)
    open_[k] = room[k] <= checker.travel_bound(radius, a[k], b[k])
    return open_
