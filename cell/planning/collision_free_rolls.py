"""Rolls at which a target has a free configuration, between the samples too.

    found = collision_free_rolls(context, targets, step)   # {i: [(low, high), ...]} rad: free stretches of the roll
    rolls = stabbing(found_of_many)              # (m,) few rolls of which one is in every stretch
    nowhere = free_nowhere(context, targets, step)  # {i: LeastBadRoll}, of those free at no roll
    hint = roll_between_samples(context, nodes, T, deposits_laid, roll)   # at this roll, or beside it

Rolls far apart are checked first, then those between them. Between two samples of a branch the arm travels a bounded
distance: if it penetrates by more than that at both samples, nothing between them is free, and it is not checked. The
tool only turns about the wire: if it penetrates, the depth divided by its distance from the wire is an angle, and no
smaller turn frees it, in any branch. All other steps are halved down to ``FINEST``. This is a search and not a proof:
depths of penetration are taken from the collision engine. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from ik.roll import apply_roll, wrap
from ik.singularity import margins

from ..arrays import Ints, distinct
from ..collision.clearances import Clearances
from ..failure import Contact, RollBetween
from .blocked_rolls import with_blocked_rolls
from .configurations import Nodes
from .context import FIRST_OF_WRIST, Context

FINEST = np.deg2rad(0.3)  # closer samples are not checked
MOST_DETOUR = 1.5  # how much longer the way between two samples can be than the straight one in joints
TARGETS_TOGETHER = 64  # targets checked together, to keep memory flat
COARSER = 3  # times as far apart are the rolls that are checked before others
FEWEST = 4  # steps between the rolls that are checked first of all
BESIDE = np.deg2rad(np.array([0.0, *(s * d for d in (0.25, 0.5, 1, 2, 3, 4, 5, 6) for s in (-1, 1))]))
STANDS = np.empty(0)  # axes of a table that does not move
Stretches = list[tuple[float, float]]


@dataclass(frozen=True, eq=False)
class KnownRolls:
    """Clearances of branches of targets at rolls, sorted by target, branch and roll.

    Attributes:
        target: (m,).
        branch: (m,).
        roll: (m,), rad.
        q: (m, j), rad.
        room: least clearance less what is asked for, (m,), m: at most that; -inf where limits or margins forbid it, NaN
            where it was not checked because the target is free in another branch.
        held: turn of the roll to either side in which what moves with the TCP stays in a collision, (m,), rad.
        pair: ids of the two geoms that are nearest, (m, 2); -1 where it was not checked.
        position: where they are, (m, 3), world, m.
    """

    target: Ints
    branch: Ints
    roll: Floats
    q: Floats
    room: Floats
    held: Floats
    pair: Ints
    position: Floats

    def rows(self, at: Ints | NDArray[np.bool_]) -> KnownRolls:
        """Some of them."""
        return KnownRolls(*(getattr(self, f.name)[at] for f in fields(self)))

    def joined(self, *others: KnownRolls) -> KnownRolls:
        """All of them, one behind the other."""
        return KnownRolls(*(np.concatenate([getattr(x, f.name) for x in (self, *others)]) for f in fields(self)))

    def sorted_with(self, *others: KnownRolls) -> KnownRolls:
        """All of them together."""
        every = self.joined(*others)
        return every.rows(np.lexsort((every.roll, every.branch, every.target)))

    def free_targets(self) -> Ints:
        """Targets that are free at a roll."""
        return np.unique(self.target[self.room >= 0])


def collision_free_rolls(
    context: Context, targets: Iterable[int], step: float, also: Mapping[int, float] | None = None
) -> dict[int, Stretches]:
    """Stretches of the roll at which targets are free by themselves.

    Args:
        context: the arm and the cell.
        targets: which.
        step: distance of the rolls that are checked in any case, rad.
        also: by target a further one, rad.

    Returns:
        By target lowest and highest of neighbouring rolls that were found free, rad, of every branch by itself.
    """
    out: dict[int, Stretches] = {i: [] for i in targets}
    for some in _some_together(out):
        more = {i: roll for i, roll in (also or {}).items() if i in some}
        for i, low, high in _stretches(_searched(context, some, step, more)):
            out[i].append((low, high))
    return out


@dataclass(frozen=True, eq=False)
class LeastBadRoll:
    """The least bad configuration that was checked of a target that is free at no roll.

    Attributes:
        q: the configuration, (j,), rad.
        roll: rad.
        clearances: of this configuration alone.
    """

    q: Floats
    roll: float
    clearances: Clearances


def free_nowhere(context: Context, targets: Iterable[int], step: float) -> dict[int, LeastBadRoll | None]:
    """Targets that are free at no roll; a target is not checked further once it is found free.

    Args:
        context: the arm and the cell.
        targets: which.
        step: distance of the rolls that are checked, rad.

    Returns:
        By target what collides least; None where limits or margins forbid all that was checked.
    """
    out: dict[int, LeastBadRoll | None] = {}
    for some in _some_together(targets):
        known = _searched(context, some, step, {}, until_free=True)
        for i in np.setdiff1d(some, known.free_targets()).tolist():
            at = np.flatnonzero((known.target == i) & (known.pair[:, 0] >= 0))
            out[i] = None
            if len(at):
                k = at[np.argmax(known.room[at])]
                near = Clearances(known.room + context.settings.clearance, known.pair, known.position)
                out[i] = LeastBadRoll(known.q[k], float(known.roll[k]), near.rows(np.array([k])))
    return out


def _some_together(targets: Iterable[int]) -> list[Ints]:
    every: Ints = np.array(sorted(targets), dtype=np.int64)
    return [every[k : k + TARGETS_TOGETHER] for k in range(0, len(every), TARGETS_TOGETHER)]


def _searched(
    context: Context, some: Ints, step: float, also: Mapping[int, float], *, until_free: bool = False
) -> KnownRolls:
    """Everything that has to be checked of some targets, or as much as decides which of them are free."""
    known = rolls_sampled(context, some, step, until_free=until_free)
    if also:
        target, roll = np.array(list(also)), np.array(list(also.values()), dtype=float)
        known = known.sorted_with(checked_rolls(context, target, roll))
    return with_rolls_between(context, known, until_free=until_free)


def with_rolls_between(
    context: Context,
    known: KnownRolls,
    *,
    until_free: bool = False,
    beside_free: bool = True,
    flips: bool = False,
    parts: int = 2,
) -> KnownRolls:
    """The same with all that has to be checked between these rolls: nothing free hides between any two of them.

    Args:
        context: the arm and the cell.
        known: rolls that were checked.
        until_free: whether no more is checked of targets that are free at a roll.
        beside_free: whether it is checked how far what is free reaches, beyond the last roll at which it was found so.
        flips: see :func:`checked_rolls`.
        parts: in which what may hide something free is cut at a time.
    """
    fractions = np.arange(1, parts) / parts
    while context.solver.form is not None:
        hides = _may_hide(context, known)
        if until_free:
            hides &= ~np.isin(known.target[:-1], known.free_targets())
        if not beside_free:
            hides &= (known.room[:-1] < 0) & (known.room[1:] < 0)
        at = np.flatnonzero(hides)
        if not len(at):
            break
        between = np.multiply.outer(known.roll[at], 1 - fractions) + np.multiply.outer(known.roll[at + 1], fractions)
        target, branch = (np.repeat(of[at], len(fractions)) for of in (known.target, known.branch))
        known = known.sorted_with(checked_rolls(context, target, between.ravel(), branch, flips=flips))
    return known


def rolls_around(context: Context, step: float) -> Floats:
    """Samples of the roll, (r,), rad; where it is free, the last is the first one again, a turn further on."""
    rolls = context.window.samples(step)
    return np.append(rolls, rolls[0] + 2 * np.pi) if context.window.is_full else rolls


def rolls_sampled(
    context: Context, some: Ints, step: float, *, until_free: bool = False, flips: bool = False
) -> KnownRolls:
    """Targets at the rolls of a step, less those between coarser ones at which the tool is held.

    Args:
        context: the arm and the cell.
        some: which targets, ascending.
        step: distance of the rolls, rad.
        until_free: whether no more is checked of targets that are free at a roll.
        flips: see :func:`checked_rolls`.
    """
    rolls = rolls_around(context, step)
    stride = 1
    while (len(rolls) - 1) // (stride * COARSER) >= FEWEST:
        stride *= COARSER
    seen, held = (np.zeros((len(some), len(rolls)), dtype=kind) for kind in (bool, float))
    looked: list[KnownRolls] = []
    while stride:
        coarse = np.unique(np.append(np.arange(0, len(rolls), stride), len(rolls) - 1))
        t, k = np.nonzero(~seen[:, coarse] & _open_between(rolls, seen, held)[:, coarse])
        if len(t):
            looked.append(checked_rolls(context, some[t], rolls[coarse[k]], until_free=until_free, flips=flips))
            seen[t, coarse[k]] = True
            at = np.searchsorted(some, looked[-1].target), np.searchsorted(rolls, looked[-1].roll)
            np.maximum.at(held, at, looked[-1].held)  # in one branch as in another
            held = _spread(rolls, held, circular=context.window.is_full)
            if until_free:  # of what is free no more is checked
                seen[np.searchsorted(some, looked[-1].free_targets())] = True
        stride //= COARSER
    known = looked[0].sorted_with(*looked[1:])
    return replace(known, held=held[np.searchsorted(some, known.target), np.searchsorted(rolls, known.roll)])


def _open_between(rolls: Floats, seen: NDArray[np.bool_], held: Floats) -> NDArray[np.bool_]:
    """Rolls (t, r) that lie between two that were checked without the tool being held all of the way."""
    every, count = np.arange(len(rolls)), len(rolls)
    before = np.maximum.accumulate(np.where(seen, every, -1), axis=1)
    after = np.minimum.accumulate(np.where(seen, every, count)[:, ::-1], axis=1)[:, ::-1]
    outside = (before < 0) | (after == count)
    a, b = np.maximum(before, 0), np.minimum(after, count - 1)
    turn = np.take_along_axis(held, a, axis=1) + np.take_along_axis(held, b, axis=1)
    return outside | (turn < rolls[b] - rolls[a])


def _spread(rolls: Floats, held: Floats, *, circular: bool) -> Floats:
    """How far the tool is held from every roll on, (t, r), rad, by what is known at any of them."""
    for _ in range(2 if circular else 1):
        if circular:  # the first and the last are one
            held[:, [0, -1]] = held[:, [0, -1]].max(axis=1, keepdims=True)
        held = np.maximum(held, np.maximum.accumulate(held + rolls, axis=1) - rolls)
        held = np.maximum(held, np.maximum.accumulate((held - rolls)[:, ::-1], axis=1)[:, ::-1] + rolls)
    return held


def checked_rolls(
    context: Context,
    target: Ints,
    roll: Floats,
    branch: Ints | None = None,
    *,
    until_free: bool = False,
    flips: bool = False,
) -> KnownRolls:
    """Targets at rolls, (m,): all their branches, or one of each; or as many as it takes to see that it is free.

    Args:
        context: the arm and the cell.
        target: which.
        roll: of each, rad.
        branch: of each; all of them where left out.
        until_free: whether no more is checked of targets that are free at a roll.
        flips: whether it is enough of a wrist's other configuration that what both have in common collides.
    """
    solver = context.solver
    first, same = distinct(target, roll)
    placed = context.placed.rows(target[first])
    found = solver.candidates(apply_roll(placed.Ts_base_target, roll[first])).q[same]
    # without a closed form there are no branches, and every configuration stands by itself
    found = found if solver.form is not None else np.swapaxes(found, 1, 2)
    if branch is None:
        branch = np.tile(np.arange(found.shape[1]), len(target))
        target, roll = np.repeat(target, found.shape[1]), np.repeat(roll, found.shape[1])
        found = found.reshape(-1, *found.shape[2:])
    else:
        found = found[np.arange(len(target)), branch]
    least = context.limits.values(solver.geometry is not None)
    good = np.isfinite(found[..., 0]) & (margins(solver.chain, solver.geometry, found) >= least).all(axis=-1)
    # configurations that differ by whole turns are checked once
    q = found[np.arange(len(found)), np.argmax(good, axis=1)]
    room = np.where(good.any(axis=1), np.nan, -np.inf)
    none = Clearances.none(len(q))
    looked = KnownRolls(target, branch, roll, q, room, np.zeros(len(q)), none.pair, none.position)
    return _with_room(context, looked.sorted_with(), until_free=until_free, flips=flips)


def _with_room(context: Context, looked: KnownRolls, *, until_free: bool, flips: bool) -> KnownRolls:
    """The same with the room where it is NaN: of one branch of each roll first, as the tool stands alike in all."""
    room, held = looked.room.copy(), looked.held.copy()
    pair, position = looked.pair.copy(), looked.position.copy()
    _, alike = distinct(looked.target, looked.roll)
    # with the same angles before the wrist, links stand alike that carry it
    flipped = distinct(looked.target, looked.roll, *looked.q[:, :FIRST_OF_WRIST].T)[1] if flips else alike
    for first_of in (alike, flipped, None) if flips else (alike, None):
        at = np.flatnonzero(np.isnan(room))
        if first_of is not None:
            at = at[np.unique(first_of[at], return_index=True)[1]]
        elif until_free:
            at = at[~np.isin(looked.target[at], looked.target[room >= 0])]
        if not len(at):
            break
        axes = context.placed.axes(looked.q[at], looked.target[at])
        seen, tools = with_blocked_rolls(context, axes, context.deposits_before[looked.target[at]])
        room[at], pair[at], position[at] = seen.distance - context.settings.clearance, seen.pair, seen.position
        tool = tools.turn > 0
        most, held_by = np.full(int(alike.max(initial=0)) + 1, np.nan), np.zeros(int(alike.max(initial=0)) + 1)
        most[alike[at[tool]]] = tools.room[tool]
        np.maximum.at(held_by, alike[at], tools.turn)
        room = np.where(np.isnan(room), most[alike], room)
        if flips:
            common = np.zeros(int(flipped.max(initial=0)) + 1)
            np.minimum.at(common, flipped[at], tools.flipped)
            common = np.where(common < 0, common, np.nan)
            room = np.where(np.isnan(room), common[flipped], room)
        held = np.maximum(held, held_by[alike])
    return replace(looked, room=room, held=held, pair=pair, position=position)


def _may_hide(context: Context, known: KnownRolls) -> NDArray[np.bool_]:
    """Steps between neighbouring rolls that may contain a free roll, (m - 1,)."""
    a, b = known.room[:-1], known.room[1:]
    out = (np.diff(known.target) == 0) & (np.diff(known.branch) == 0) & (np.diff(known.roll) > FINEST)
    out &= ((a < 0) | (b < 0)) & ~(np.isinf(a) & np.isinf(b))
    out &= known.held[:-1] + known.held[1:] < np.diff(known.roll)
    both = np.flatnonzero(out & np.isfinite(a) & np.isfinite(b) & (a < 0) & (b < 0))
    if len(both):
        from_q = known.q[both]
        to_q = from_q + wrap(known.q[both + 1] - from_q)
        ends = (context.placed.axes(q, known.target[both]) for q in (from_q, to_q))
        out[both] = -(a[both] + b[both]) < MOST_DETOUR * context.screen.travel_bound(context.radius, *ends)
    return out


def _stretches(known: KnownRolls) -> list[tuple[int, float, float]]:
    """Intervals of free rolls: their targets, lowest and highest rolls."""
    free = np.flatnonzero(known.room >= 0)
    if not len(free):
        return []
    apart = (np.diff(free) > 1) | (np.diff(known.target[free]) != 0) | (np.diff(known.branch[free]) != 0)
    return [
        (int(known.target[run[0]]), float(known.roll[run[0]]), float(known.roll[run[-1]]))
        for run in np.split(free, np.flatnonzero(apart) + 1)
    ]


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


def roll_between_samples(
    context: Context, nodes: Nodes, T: Floats, deposits_laid: int, roll: float, table: Floats = STANDS
) -> RollBetween | None:
    """A roll between the samples at which a target has a free configuration, or else its least bad one.

    Args:
        context: the cell and what is to be kept.
        nodes: of the target's bead, for the window and the margins.
        T: the target at roll 0, (4, 4), m.
        deposits_laid: deposits laid when it is welded.
        roll: a roll at which a configuration keeps limits and margins, rad.
        table: E1, E2 there, (2,), rad; (0,) where the table stands.

    Returns:
        The roll at which a configuration keeps the clearance as well, there or beside it. Else the roll of the least
        bad configuration, with its nearest pair. None where there is no configuration.
    """
    solver, window = context.solver, nodes.window
    rolls = roll + BESIDE
    rolls = rolls[window.excess(rolls) == 0.0] if not window.is_fixed else rolls[:1]
    q = solver.candidates(apply_roll(T[None], rolls)).q
    least = context.limits.values(solver.geometry is not None)
    allowed = np.isfinite(q[..., 0]) & (margins(solver.chain, solver.geometry, q) >= least).all(axis=-1)
    at = np.argwhere(allowed)
    if not len(at):
        return None
    axes = np.concatenate([q[tuple(at.T)], np.tile(table, (len(at), 1))], axis=1)
    found = context.screen.clearances(axes, np.full(len(at), deposits_laid))
    free = found.distance >= context.settings.clearance
    k = int(np.argmax(free)) if free.any() else int(np.argmax(found.distance))
    deg = round(float(np.rad2deg(rolls[at[k, 0]])), 3)
    if free.any():
        return RollBetween(deg)
    hit = context.describe(found, k)
    return RollBetween(deg, replace(hit, contact=Contact(hit.pair)))
