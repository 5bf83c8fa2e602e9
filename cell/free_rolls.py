"""Rolls at which a target can be stood at, between the samples too.

    found = free_rolls(setup, i, step)           # [(low, high), ...] rad: stretches of the roll that are free
    rolls = stabbing(found_of_many)              # (m,) few rolls of which one is in every stretch

Between two samples of a branch the arm has only so far to go: where it is deeper in a collision than that at both of
them, nothing between them is free, and it is not looked at. All else is halved until ``FINEST``. A search, and no
proof: depths are what the collision engine says. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from ik.roll import apply_roll, wrap
from ik.singularity import margins

from .setup import Setup

FINEST = np.deg2rad(0.3)  # closer samples are not looked at
ROUNDABOUT = 1.5  # how much longer the way between two samples can be than the straight one in joints
Stretches = list[tuple[float, float]]


@dataclass(frozen=True, eq=False)
class _Looked:
    """What is known of one branch of a target: rolls, ascending, (m,), configurations, (m, j), and room, (m,), m.

    Room is the least clearance less what is asked for; -inf where limits or margins forbid the configuration.
    """

    roll: Floats
    q: Floats
    room: Floats


def free_rolls(setup: Setup, i: int, step: float, also: Iterable[float] = ()) -> Stretches:
    """Stretches of the roll at which a target is free by itself.

    Args:
        setup: the arm and the cell.
        i: the target.
        step: distance of the rolls that are looked at in any case, rad.
        also: further ones, rad.

    Returns:
        Lowest and highest of neighbouring rolls that were found free, rad, of every branch by itself.
    """
    window = setup.window
    rolls = np.unique(np.concatenate([window.samples(step), np.array(list(also), dtype=float)]))
    if window.is_full and len(rolls) > 1:
        rolls = np.append(rolls, rolls[0] + 2 * np.pi)
    T = setup.placed.rows([i]).Ts_base_target[0]
    stage = int(setup.stage[i])
    branches, total = _looked_at(setup, T, stage, rolls, None), []
    for g, branch in enumerate(branches):
        if setup.solver.form is not None:
            branch = _halved(setup, T, stage, branch, g)
        total += _stretches(branch)
    return total


def _looked_at(setup: Setup, T: Floats, stage: int, rolls: Floats, group: int | None) -> list[_Looked]:
    """Every branch at some rolls, or one of them."""
    solver = setup.solver
    found = solver.candidates(apply_roll(T, rolls))
    groups = range(found.q.shape[1]) if group is None else [group]
    q = found.q if solver.form is not None else np.swapaxes(found.q, 1, 2)  # without branches each by itself
    groups = groups if solver.form is not None else range(q.shape[1])
    least = setup.limits.values(solver.geometry is not None)
    out = []
    for g in groups:
        here = q[:, g]  # (m, k, j)
        good = np.isfinite(here[..., 0]) & (margins(solver.chain, solver.geometry, here) >= least).all(axis=-1)
        k = np.argmax(good, axis=1)
        mine, some = here[np.arange(len(rolls)), k], good.any(axis=1)
        room = np.full(len(rolls), -np.inf)
        if some.any():
            seen = setup.screen.clearances(mine[some], np.full(int(some.sum()), stage))
            room[some] = seen.distance - setup.settings.clearance
        out.append(_Looked(rolls, mine, room))
    return out


def _halved(setup: Setup, T: Floats, stage: int, known: _Looked, group: int) -> _Looked:
    """A branch looked at more closely wherever something free may hide."""
    while True:
        at = np.flatnonzero(_may_hide(setup, known))
        if not len(at):
            return known
        roll = (known.roll[at] + known.roll[at + 1]) / 2
        (new,) = _looked_at(setup, T, stage, roll, group)
        known = _Looked(*(np.insert(getattr(known, n), at + 1, getattr(new, n), axis=0) for n in ("roll", "q", "room")))


def _may_hide(setup: Setup, known: _Looked) -> NDArray[np.bool_]:
    """Steps between neighbouring rolls that may hide something free, (m - 1,)."""
    a, b = known.room[:-1], known.room[1:]
    out = (np.diff(known.roll) > FINEST) & ((a < 0) | (b < 0)) & ~(np.isinf(a) & np.isinf(b))
    both = np.flatnonzero(out & np.isfinite(a) & np.isfinite(b) & (a < 0) & (b < 0))
    if len(both):
        from_q = known.q[both]
        to_q = from_q + wrap(known.q[both + 1] - from_q)
        way = ROUNDABOUT * setup.screen.way(setup.radius, from_q, to_q)
        out[both] = -(a[both] + b[both]) < way
    return out


def _stretches(known: _Looked) -> Stretches:
    free = known.room >= 0
    ends = np.flatnonzero(np.diff(free, prepend=False, append=False))
    return [(float(known.roll[a]), float(known.roll[b - 1])) for a, b in zip(ends[::2], ends[1::2], strict=True)]


def stabbing(stretches: Iterable[tuple[float, float]]) -> Floats:
    """Few rolls of which at least one is in each of some stretches, in [-pi, pi), ascending, (m,), rad."""
    out: list[float] = []
    low, high = np.inf, -np.inf
    for a, b in sorted(stretches, key=lambda s: s[1]):
        if a <= high:  # ends are ascending, so that what all have in common reaches to the first of them
            low = max(low, a)
            continue
        out.append((low + high) / 2)
        low, high = a, b
    return np.unique(wrap(np.array([*out, (low + high) / 2])[1:]))
