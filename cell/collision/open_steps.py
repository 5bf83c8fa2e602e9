"""Steps of a motion of which it is not known yet how near it comes on them, and what a few looks say of many.

    steps = OpenSteps(step, a, b, da, db, laid)
    steps.rows(steps.beyond(limit) <= way)                  # those that remain
    asked_sparsely(group, q, steps, travel, limit)          # likewise, where nothing is known at the samples

Metres, radians.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from .clearances import Sees


@dataclass(frozen=True, eq=False)
class OpenSteps:
    """Steps, or parts of them, of which it is not known yet how near it comes on them.

    Attributes:
        step: first sample, (k,).
        a: configuration at the beginning, (k, n), rad.
        b: at the end, (k, n), rad.
        da: clearance at the beginning, at least, (k,), m.
        db: at the end, likewise, (k,), m.
        laid: deposits laid, (k,).
    """

    step: Ints
    a: Floats
    b: Floats
    da: Floats
    db: Floats
    laid: Ints

    def rows(self, index: Ints | NDArray[np.bool_]) -> OpenSteps:
        """Some of them."""
        return OpenSteps(*(getattr(self, one.name)[index] for one in fields(self)))

    def beyond(self, limit: float) -> Floats:
        """What the clearances at both ends have beyond a limit, together, (k,), m: on the way it is gone to by half."""
        return self.da + self.db - 2 * limit

    def halves(self, middle: Floats, dm: Floats) -> OpenSteps:
        """Both halves of each, with the clearances in their middles."""
        step, laid = np.concatenate([self.step, self.step]), np.concatenate([self.laid, self.laid])
        a, b = np.concatenate([self.a, middle]), np.concatenate([middle, self.b])
        return OpenSteps(step, a, b, np.concatenate([self.da, dm]), np.concatenate([dm, self.db]), laid)


def asked_sparsely(checker: Sees, q: Floats, steps: OpenSteps, travel: Floats, limit: float) -> OpenSteps:
    """Steps that remain where pairs are looked at in some samples of the motions only, as far apart as they may be.

    Between two samples of a motion a clearance is no less than half of what both have beyond the way from one to the
    other, which is as long as the steps between them together.

    Args:
        checker: of the pairs.
        q: samples, (m, n), rad.
        steps: those in question, ascending; a step from one motion to the next is none of them.
        travel: how far things can get towards one another from each sample to the next, (m - 1,), m.
        limit: what is no nearer than this is not looked for, m.

    Returns:
        Those on which something may be nearer, with these pairs' clearances at their ends.
    """
    step, laid = steps.step, steps.laid
    way = np.append(0.0, np.cumsum(travel[step]))
    goes_on = (np.diff(step) == 1) & (np.diff(laid) == 0)
    low = np.flatnonzero(np.append(True, ~goes_on)[: len(step)])
    high = np.append(low[1:], len(step))[: len(low)]

    def look(sample: Ints, with_: Ints) -> Floats:
        return np.minimum(checker.clearances(q[sample], with_).distance, checker.reach)

    # intervals are of the steps from `low` up to `high`
    begin, end = look(step[low], laid[low]), look(step[high - 1] + 1, laid[low])
    left = [(low[:0], begin[:0], end[:0])]
    while len(low):
        open_ = begin + end - 2 * limit <= way[high] - way[low]
        one = open_ & (high - low == 1)
        left.append((low[one], begin[one], end[one]))
        on = open_ & ~one
        low, high, begin, end = low[on], high[on], begin[on], end[on]
        middle = np.clip(np.searchsorted(way, (way[low] + way[high]) / 2), low + 1, high - 1)
        there = look(step[middle], laid[middle])
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        begin, end = np.concatenate([begin, there]), np.concatenate([there, end])
    at, begin, end = (np.concatenate([some[i] for some in left]) for i in range(3))
    return replace(steps.rows(at), da=begin, db=end)
