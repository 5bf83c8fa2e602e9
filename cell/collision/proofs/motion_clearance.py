"""Whether a clearance is kept all along a motion, with as few collision queries as possible.

    found = clearance_along(checker, radius, MotionSamples(q, deposits_laid, motion, stretch), least)
    found.open, found.nearest                # steps on which it is not kept, or not proved to be
    found.seen, found.low, found.kept        # what was seen, and what is kept at least at samples and on steps

Most of a motion is proved from few samples (``plane_proofs``). The rest is checked sample by sample, and steps between
samples are halved (``between_samples``). Motions in which the table moves are checked in this second way only. Metres,
radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ...arrays import Ints
from ..clearances import Clearances, SeesClearances
from .between_samples import halved, steps_between
from .open_steps import OpenSteps
from .plane_proofs import proofs_of

AIMED_ABOVE = 3e-3  # m: so much more is aimed at, for what is put in between or rounded afterwards
AIMED_SHARE = 0.975  # of the least that is seen is aimed at as well: the least clearance need not be looked for again
GIVEN_BETWEEN = 4e-4  # m that may be given for what is between samples


@dataclass(frozen=True, eq=False)
class MotionSamples:
    """Samples of motions, between which the joints move on straight lines.

    Attributes:
        q: configurations, (m, n), rad.
        deposits_laid: deposits laid at each, (m,).
        motion: the motion that each belongs to, (m,); each has two samples at least.
        stretch: the stretch of it that the step to each belongs to, (m,). Of a stretch that does not keep a clearance
            for certain not every step is named, but one is.
    """

    q: Floats
    deposits_laid: Ints
    motion: Ints
    stretch: Ints


@dataclass(frozen=True, eq=False)
class MotionClearance:
    """What is known of a motion of m samples.

    Attributes:
        seen: nearest pairs where it was checked; nothing where it was not.
        low: nothing is nearer at each sample, (m,), m.
        kept: nothing is nearer from each sample to the next, (m,), m; -inf where that is not known, as at a last one.
        open: first samples of the steps on which the clearance is not proved to be kept, ascending, (k,).
        nearest: the nearest pair on each of these.
    """

    seen: Clearances
    low: Floats
    kept: Floats
    open: Ints
    nearest: Clearances


def clearance_along(checker: SeesClearances, radius: Floats, samples: MotionSamples, least: float) -> MotionClearance:
    """Prove that a clearance is kept.

    Args:
        checker: collision detection.
        radius: from ``cell.collision.proofs.reach_radii.radii``, (n,), m.
        samples: the motion.
        least: clearance to be kept, m.

    Returns:
        What is known.
    """
    q, deposits_laid = samples.q, samples.deposits_laid
    step, kept = steps_between(q, samples.motion), np.full(len(q), -np.inf)
    laid = np.maximum(deposits_laid[step], deposits_laid[step + 1])
    seen = Clearances.none(len(q))
    proofs = proofs_of(checker)
    if proofs is not None:
        proved = proofs.along(q, step, laid, least + AIMED_ABOVE, GIVEN_BETWEEN, AIMED_SHARE)
        kept[step], seen = proved.kept, proved.seen
    low = np.maximum(kept, np.append(-np.inf, kept[:-1]))
    k = np.flatnonzero(kept[step] < least)
    left = step[k]
    if not len(left):
        return MotionClearance(seen, low, kept, left, Clearances.none(0))
    rows = np.unique(np.concatenate([left, left + 1]))
    found = checker.clearances(q[rows], deposits_laid[rows])
    seen.put(rows, found)
    low[rows] = np.minimum(found.distance, checker.reach)
    part = samples.stretch[left + 1]
    steps = OpenSteps(np.arange(len(left)), q[left], q[left + 1], low[left], low[left + 1], laid[k])
    open_, hit, nearest = halved(checker, radius, steps, part, least)
    bad = np.concatenate([hit, open_])
    closed = left[~np.isin(part, part[bad])]
    kept[closed] = np.maximum(kept[closed], least)
    order = np.argsort(bad, kind="stable")
    nearest = Clearances.joined([nearest, seen.rows(left[open_])])
    return MotionClearance(seen, low, kept, left[bad[order]], nearest.rows(order))
