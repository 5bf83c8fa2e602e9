"""Rounded paths proved free by their chords, with the arm thickened by the distance of the path from the chords.

    left, nearest = not_proved_by_chords(checker, radius, run, steps, least)       # steps that are not proved

Radians and metres; a path's length may be in either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..timing.blending import blended
from .blended_paths import BlendedPath, Parabolas
from .clearances import Clearances, SeesClearances
from .proofs.between_samples import unproven_steps

CHORD = 20e-6  # m: most that any point of the arm is off a chord of the rounded path by which it is proved free
FINE_CHORD = 1e-6  # m: likewise where that is too much; less than what is proved beyond a clearance that is asked for


class _Nearer:
    """Collision detection that reports every distance less by a constant."""

    def __init__(self, checker: SeesClearances, by: float) -> None:
        self.checker, self.by, self.reach = checker, by, checker.reach - by

    def travel_bound(self, radius: Floats, a: Floats, b: Floats, /) -> Floats:
        """As of the checker."""
        return self.checker.travel_bound(radius, a, b)

    def bend_bound(self, radius: Floats, turn: Floats, /) -> Floats:
        """As of the checker."""
        return self.checker.bend_bound(radius, turn)

    def clearances(self, q: Floats, deposits_laid: Ints, /) -> Clearances:
        """As of the checker, less the distance."""
        found = self.checker.clearances(q, deposits_laid)
        return Clearances(found.distance - self.by, found.pair, found.position)


@dataclass(frozen=True, eq=False)
class BlendedSteps:
    """A rounded path with its chords, and the clearances of its rows.

    Attributes:
        path: the rows.
        pieces: its parabolas.
        sagitta: how far each step's rounded path is off its chord at most, (m - 1,), m.
        low: clearance at least where the rows come to lie, (m,), m.
        laid: deposits laid on each step, (m - 1,).
    """

    path: BlendedPath
    pieces: Parabolas
    sagitta: Floats
    low: Floats
    laid: Ints


def not_proved_by_chords(
    checker: SeesClearances, radius: Floats, run: BlendedSteps, steps: Ints, least: float
) -> tuple[Ints, Clearances]:
    """Steps whose rounded path is not proved to keep a clearance by its chords and a thickened arm.

    Args:
        checker: collision detection.
        radius: of the arm about its joints.
        run: the rounded path.
        steps: those in question, ascending.
        least: clearance to be kept, m.

    Returns:
        Those that are not proved, and the nearest pair on each.
    """
    left, nearest = _by_chords(checker, radius, run, steps, least, CHORD)
    # what fails for the thickness alone is checked once more with less of it
    close = np.flatnonzero(nearest.distance >= least - 2 * CHORD)
    if not len(close):
        return left, nearest
    again, found = _by_chords(checker, radius, run, left[close], least, FINE_CHORD)
    far = np.setdiff1d(np.arange(len(left)), close)
    both = np.concatenate([left[far], again])
    order = np.argsort(both, kind="stable")
    return both[order], Clearances.joined([nearest.rows(far), found]).rows(order)


def _by_chords(
    checker: SeesClearances, radius: Floats, run: BlendedSteps, steps: Ints, least: float, off: float
) -> tuple[Ints, Clearances]:
    """As :func:`not_proved_by_chords`, with chords from which no point of the arm is further away than this, m."""
    path, p, sagitta, low = run.path, run.pieces, run.sagitta, run.low
    if not len(steps):
        return steps, Clearances.none(0)
    first = np.searchsorted(p.row, np.arange(len(path.s)))
    s = [_chords(p, int(first[k]), int(first[k + 1]), float(sagitta[k]), off) for k in steps]
    at, of = np.concatenate(s), np.repeat(steps, [len(some) for some in s])
    q, laid = blended(path.q, path.s, path.zone, at), run.laid[of]
    begins = np.diff(of, prepend=-1) != 0
    ends_ = np.append(begins[1:], True)
    thick = _Nearer(checker, off)
    found = Clearances.none(len(at))
    found.distance[begins], found.distance[ends_] = low[steps] - off, low[steps + 1] - off
    inner = np.flatnonzero(~begins & ~ends_)
    seen = thick.clearances(q[inner], laid[inner])
    found.distance[inner], found.pair[inner], found.position[inner] = seen.distance, seen.pair, seen.position
    open_, nearest = unproven_steps(thick, radius, q, laid, found, of, least=least)
    # what is left open after the last halving may have a bound at its ends and no pair
    unnamed = np.flatnonzero(nearest.pair[:, 0] < 0)
    named = checker.clearances(q[open_[unnamed]], laid[open_[unnamed]])
    nearest.distance[unnamed] = np.minimum(named.distance, checker.reach)
    nearest.pair[unnamed], nearest.position[unnamed] = named.pair, np.nan_to_num(named.position)
    left, index = np.unique(of[open_], return_index=True)
    return left, nearest.rows(index)


def _chords(p: Parabolas, first: int, last: int, sagitta: float, off: float) -> Floats:
    """Path lengths on a step, its ends among them, between which its parabolas are within ``off`` of straight."""
    if sagitta <= off:
        return p.s[[first, last]]
    sagittas = np.diff(p.s[first : last + 1]) ** 2 / 8 * p.bend[first:last]
    count = np.maximum(np.ceil(np.sqrt(sagittas / off)), 1).astype(np.int64)
    some = [np.linspace(p.s[first + i], p.s[first + i + 1], n + 1)[:-1] for i, n in enumerate(count.tolist())]
    return np.concatenate([*some, p.s[last : last + 1]])
