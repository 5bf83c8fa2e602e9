"""Between two samples of a motion: a clearance is kept on the way, by what there is at its ends against travel.

    radius = radii(scene)                                               # (n,) m
    open_at = unproven_steps(checker, radius, q, stage, found, least=0.005)   # steps of q on which it is not proved
    kept at, nearest = least_on_the_way(checker, radius, q, stage, found)    # how near it comes

A step keeps a clearance if what the clearances at its ends are beyond it adds up to more than the longest way any point
of the arm can travel on it; otherwise it is halved, and its middle looked at. What is still open after the last halving
counts as not kept.

Source: Schwarzer, Saha, Latombe, Adaptive dynamic collision checking for single and multiple articulated robots in
complex environments, IEEE T-RO 2005.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from .clearances import Clearances, Sees
from .motion_bounds import joint_travel_bound
from .open_steps import OpenSteps, asked_sparsely
from .pair_groups import groups_of, travel_bounds

HALVINGS = 12
NEAREST = 1e-4  # m: least clearances of the way are known to this
NEAREST_SHARE = 0.03  # of the least clearance, likewise
MANY_STEPS = 500  # steps, from which to have checkers of groups of pairs made costs less than they save
CLOSER = 20  # halvings about the nearest sample found


def unproven_steps(
    checker: Sees,
    radius: Floats,
    q: Floats,
    stage: Ints,
    found: Clearances,
    apart: Ints | None = None,
    *,
    least: float = 0.0,
) -> tuple[Ints, Clearances]:
    """Steps of a motion on which a clearance is not proved to be kept.

    Args:
        checker: collision detection at the table pose.
        radius: from :func:`radii`, (n,), m.
        q: samples, (m, n), rad; between neighbours the joints move on straight lines.
        stage: deposits laid at each sample, (m,).
        found: clearances at the samples.
        apart: motion that each sample belongs to, (m,); steps from one motion to the next are left out.
        least: clearance to be kept, m; 0: nothing is touched.

    Returns:
        First samples of the open steps, (k,), ascending, and the nearest pair seen on each of them. Of a motion that
        has one at which it is too near for certain, others need not be named.
    """
    step = _steps(q, apart)
    motion = np.zeros(len(q), dtype=np.int64) if apart is None else apart
    known = np.minimum(found.distance, checker.reach) - least
    a, b, da, db = q[step], q[step + 1], known[step], known[step + 1]
    laid = np.maximum(stage[step], stage[step + 1])
    hits: list[tuple[Ints, Clearances]] = []
    for _ in range(HALVINGS):
        open_ = _open(checker, radius, a, b, da + db)
        step, laid = step[open_], laid[open_]
        a, b, da, db = (x[open_] for x in (a, b, da, db))
        if not len(step):
            break
        middle = (a + b) / 2
        seen = checker.clearances(middle, laid)
        dm = np.minimum(seen.distance, checker.reach) - least
        hit = dm <= 0
        if hit.any():
            left, row = np.unique(step[hit], return_index=True)
            hits.append((left, seen.rows(np.flatnonzero(hit)[row])))
        # a motion that is known not to be free is not looked at any further; all others are
        on = ~np.isin(motion[step], motion[step[hit]])
        step, laid = step[on], laid[on]
        a, b, middle, da, db, dm = (x[on] for x in (a, b, middle, da, db, dm))
        step, laid = np.concatenate([step, step]), np.concatenate([laid, laid])
        a, b = np.concatenate([a, middle]), np.concatenate([middle, b])
        da, db = np.concatenate([da, dm]), np.concatenate([dm, db])
    open_ = _open(checker, radius, a, b, da + db)
    left = np.unique(step[open_])
    steps, nearest = zip(*hits, (left, found.rows(left)), strict=True)
    all_steps = np.concatenate(steps)
    order = np.argsort(all_steps, kind="stable")
    return all_steps[order], Clearances.joined(nearest).rows(order)


def least_on_the_way(
    checker: Sees,
    radius: Floats,
    q: Floats,
    stage: Ints,
    found: Clearances,
    apart: Ints | None = None,
    *,
    known: float = np.inf,
    many: int = MANY_STEPS,
) -> tuple[int, Clearances]:
    """How near a motion comes to anything, between its samples too.

    Args:
        checker: collision detection at the table pose.
        radius: from :func:`radii`, (n,), m.
        q: samples, (m, n), rad; at least one.
        stage: deposits laid at each sample, (m,).
        found: clearances at the samples.
        apart: motion that each sample belongs to, (m,); steps from one motion to the next are left out.
        known: a distance that is come to elsewhere, m: what is no nearer than that is not looked for.
        many: steps, from which to have checkers of groups of pairs made costs less than they save.

    Returns:
        The sample at which it is or after which it comes, and the one nearest pair; a distance that is too large by
        ``NEAREST`` or ``NEAREST_SHARE`` of it at most, whichever is more.
    """
    step = _steps(q, apart)
    nearest = _Nearest.of(checker, q, stage, found, step, known)
    seen_at = np.minimum(found.distance, checker.reach)
    laid = np.maximum(stage[step], stage[step + 1])
    steps = OpenSteps(step, q[step], q[step + 1], seen_at[step], seen_at[step + 1], laid)
    steps = steps.rows(steps.beyond(nearest.limit) <= joint_travel_bound(radius, steps.a, steps.b))
    groups = groups_of(checker, found) if len(steps.step) > many else ()
    if not groups:
        open_ = _open(checker, radius, steps.a, steps.b, steps.beyond(nearest.limit))
        _halve(checker, radius, steps.rows(open_), nearest)
    for k, (group, way) in enumerate(zip(groups, travel_bounds(groups, q) if groups else (), strict=True)):
        # a group's clearances are those at the samples at least; of the first one that is much
        left = steps.rows(steps.beyond(nearest.limit) <= way[steps.step])
        if k > 0:
            left = asked_sparsely(group, q, left, way, nearest.limit)
        _halve(group, group.radius, left, nearest)
    best = nearest.best
    return nearest.at, best if best.distance[0] > known else _closest(checker, nearest.about, nearest.there, best)


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
    def of(cls, checker: Sees, q: Floats, stage: Ints, found: Clearances, step: Ints, known: float) -> _Nearest:
        """Of the samples."""
        at = int(np.argmin(found.distance))
        about = (q[at - 1] if at - 1 in step else q[at], q[at], q[at + 1] if at in step else q[at])
        return cls(found.rows(np.array([at])), at, int(stage[at]), about, min(known, checker.reach))

    @property
    def limit(self) -> float:
        """Where it comes no nearer than this, there is nothing to be found, m."""
        least = min(float(self.best.distance[0]), self.most)
        return least - max(NEAREST, NEAREST_SHARE * least)


def _halve(checker: Sees, radius: Floats, steps: OpenSteps, nearest: _Nearest) -> None:
    """Look at the middles of steps for what is nearer, until no step can hold anything."""
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


def _closest(checker: Sees, about: tuple[Floats, Floats, Floats], laid: int, best: Clearances) -> Clearances:
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


def _steps(q: Floats, apart: Ints | None) -> Ints:
    """Steps between samples of one motion."""
    step = np.arange(len(q) - 1)
    return step if apart is None else step[apart[:-1] == apart[1:]]


def _open(checker: Sees, radius: Floats, a: Floats, b: Floats, room: Floats) -> NDArray[np.bool_]:
    """Steps whose clearances at both ends together do not prove them free; most are settled by the cheaper bound."""
    open_: NDArray[np.bool_] = room <= joint_travel_bound(radius, a, b)
    k = np.flatnonzero(open_)
    open_[k] = room[k] <= checker.travel_bound(radius, a[k], b[k])
    return open_
