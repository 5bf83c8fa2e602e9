"""A bead planned like a similar bead whose path was hard to find: beads of successive layers are much alike.

    hard = last_hard(beads)                        # of those planned so far
    stretch = like(context, first, stop, hard, q_before)      # the whole bead, checked; None: search it

A bead on which the roll has to turn past an obstacle is found only by the finest search, which costs twenty times as
much as the quick one. On the bead above, the roll has to turn in the same place. So the roll at each target is that of
the other bead at the nearest place, in the same branch, or beside it where that collides. The path counts only once all
of it has been tracked and checked.

Metres and radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ik import bead_path_quick as banded
from ik import closed_form
from ik.bead_path import ROLL_COST
from ik.chain import Floats
from ik.roll import apply_roll, wrap

from ..bead_outcome import BeadPlan
from ..configurations import near_cost
from ..context import FINER_ROLLS, Context
from ..edges.edge_check import SearchedBead, Stretch, check_edges
from ..stations import nodes_of_poses

MOST_APART = 0.02  # m: mean distance of a bead from one that it is taken to be like
ALONG = 0.1  # share of its length by which a bead's targets may lie before or behind those of the other
TRIED = 2  # beads that it may be like
KNOWN = 4  # last beads that were hard to find
BESIDE = np.arange(-4.0, 5.0)  # rolls beside the other bead's, in the finer step
TURNS = np.arange(-2, 3)  # of these, from target to target
ROUNDS = 4  # ways that are followed
PAIRS = 200_000  # of a target and a step of the other bead that are looked at together, for memory


def last_hard(beads: Sequence[BeadPlan]) -> list[Stretch]:
    """Ways of the last beads that were hard to find.

    Args:
        beads: planned so far, in order.
    """
    return [bead.stretches[0] for bead in beads if bead.hard and bead.whole][-KNOWN:]


def like(context: Context, first: int, stop: int, hard: Sequence[Stretch], q_before: Floats | None) -> Stretch | None:
    """A bead on the way of one of some others.

    Args:
        context: the arm and the cell.
        first: its first target.
        stop: one past its last.
        hard: ways of others.
        q_before: where the arm comes from, (j,), rad, or None.

    Returns:
        The whole bead, checked; None where that was not found.
    """
    if context.solver.form is None or context.placed.moving is not None or context.window.is_fixed or stop - first < 2:
        return None
    bead = SearchedBead.of(context, first, stop)
    guesses = [guess for guess in (_Guess.of(bead, other) for other in hard) if guess.apart <= MOST_APART]
    for guess in sorted(guesses, key=lambda guess: guess.apart)[:TRIED]:
        stretch = _followed(bead, guess, q_before)
        if stretch is not None:
            return stretch
    return None


@dataclass(frozen=True, eq=False)
class _Guess:
    """A way that a bead may take.

    Attributes:
        apart: mean distance from the bead that it is taken from, m.
        roll: at each target, (t,), rad, without whole turns between neighbours.
        branch: of the arm.
    """

    apart: float
    roll: Floats
    branch: int

    @classmethod
    def of(cls, bead: SearchedBead, other: Stretch) -> _Guess:
        """As another bead's way has it at the places nearest to a bead's targets."""
        context, there = bead.context, bead.context.placed.rows(slice(other.first, other.stop))
        known = np.concatenate([other.roll[:1], other.roll[:1] + np.cumsum(_turns(context, other.roll))])
        best = np.inf, known[:1]
        for way in (slice(None), slice(None, None, -1)):  # laid in the same direction, or the other way round
            apart, roll = _nearest(bead.placed.position, there.position[way], known[way])
            best = min(best, (float(apart.mean()), roll), key=lambda one: one[0])
        assert context.solver.form is not None
        raw = closed_form.solve(context.solver.form, apply_roll(there.Ts_base_target[0], other.roll[0]))
        off = np.abs(wrap(raw - other.q_targets[0])).max(axis=1)
        return cls(best[0], best[1], int(np.nanargmin(off)))


def _turns(context: Context, roll: Floats) -> Floats:
    turn = np.diff(roll)
    return wrap(turn) if context.window.is_full else turn


def _nearest(at: Floats, line: Floats, value: Floats) -> tuple[Floats, Floats]:
    """How far points (t, 3) are from a line through others (m, 3), and its value (m,) there: much as far along it."""
    a, step, turn = line[:-1], np.diff(line, axis=0), np.diff(value)
    squared = np.maximum(np.einsum("mi,mi->m", step, step), 1e-18)
    share, there = _share(at), _share(line)
    far, found = np.empty(len(at)), np.empty(len(at))
    together = max(PAIRS // len(step), 1)
    for first in range(0, len(at), together):
        some = slice(first, first + together)
        off = at[some, None] - a
        along = np.clip(np.einsum("tmi,mi->tm", off, step) / squared, 0.0, 1.0)
        distance = np.linalg.norm(off - along[..., None] * step, axis=2)
        away = (there[1:] < share[some, None] - ALONG) | (there[:-1] > share[some, None] + ALONG)
        k = np.argmin(np.where(away, np.inf, distance), axis=1)
        t = np.arange(len(k))
        far[some], found[some] = distance[t, k], value[k] + along[t, k] * turn[k]
    return far, found


def _share(line: Floats) -> Floats:
    """How far along a line its points are, as a share of it."""
    total = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
    return np.asarray(total / max(total[-1], 1e-12))


def _followed(bead: SearchedBead, guess: _Guess, q_before: Floats | None) -> Stretch | None:
    """The bead on a way beside a guess, checked; None where that was not found."""
    context, step = bead.context, bead.context.settings.roll_step / FINER_ROLLS
    window, least = context.window, context.settings.clearance
    rolls = guess.roll[:, None] + BESIDE * step
    if not window.is_full:
        rolls = np.clip(rolls, window.low, window.high)
    q, cost = nodes_of_poses(context, bead.placed.Ts_base_target, rolls, guess.branch)
    at, _, r = np.nonzero(np.isfinite(cost))
    seen = context.screen.clearances(q[:, at, 0, r].T, bead.deposits_before[at])
    cost[at, 0, r] += np.where(seen.distance < least, np.inf, near_cost(seen.distance, least))
    turn = np.abs(np.diff(guess.roll)) + np.abs(TURNS).max() * step
    bounds = banded.Bounds(bead.speed, bead.slowest, np.full(len(turn), np.pi), ROLL_COST / step, turn)
    edges = banded.prices(context.solver.chain, q, rolls, bounds, TURNS, circular=False)
    start = np.arange(len(bead) - 1)
    for _ in range(ROUNDS):
        path = banded.cheapest(cost, edges, TURNS)
        if path is None:
            return None
        taken = path[1]
        way = banded.with_whole_turns(context.solver.chain, q[:, np.arange(len(bead)), 0, taken].T, q_before)
        if way is None:
            return None
        roll = rolls[np.arange(len(bead)), taken]
        found = check_edges(bead, start, np.stack([roll[:-1], roll[1:]], axis=1), np.stack([way[:-1], way[1:]], axis=1))
        bad = [e for e, cause in enumerate(found.causes) if cause is not None]
        if not bad:
            return found.whole()
        for e in bad:
            edges[e, 0, np.flatnonzero(taken[e + 1] - taken[e] == TURNS), taken[e + 1]] = np.inf
    return None
