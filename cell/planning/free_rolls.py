"""Rolls at which targets can be stood at, between the samples too.

    found = free_rolls(context, targets, step)     # {i: [(low, high), ...]} rad: stretches of the roll that are free
    rolls = stabbing(found_of_many)              # (m,) few rolls of which one is in every stretch
    hint = standing_between(context, nodes, T, stage, roll)   # at a roll that kinematics alone names, and beside it

Between two samples of a branch the arm has only so far to go: where it is deeper in a collision than that at both of
them, nothing between them is free, and it is not looked at. What moves with the TCP only turns about the wire: where it
is in something, the depth over its distance from the wire is an angle by which no turn frees it, in any branch. All
else is halved until ``FINEST``. A search, and no proof: depths are what the collision engine says. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from ik.roll import apply_roll, wrap
from ik.singularity import margins

from ..arrays import Ints
from ..failure import Contact, RollBetween
from .configurations import Nodes
from .context import Context

FINEST = np.deg2rad(0.3)  # closer samples are not looked at
MOST_DETOUR = 1.5  # how much longer the way between two samples can be than the straight one in joints
TARGETS_TOGETHER = 64  # targets looked at together, to keep memory flat
COARSER = 3  # times as far apart are the rolls that are looked at first
BESIDE = np.deg2rad(np.array([0.0, *(s * d for d in (0.25, 0.5, 1, 2, 3, 4, 5, 6) for s in (-1, 1))]))
STANDS = np.empty(0)  # axes of a table that does not move
Stretches = list[tuple[float, float]]


@dataclass(frozen=True, eq=False)
class _Looked:
    """What is known of targets' branches, sorted by target, branch and roll.

    Attributes:
        target: (m,).
        branch: (m,).
        roll: (m,), rad.
        q: (m, j), rad.
        room: least clearance less what is asked for, (m,), m: at most that; -inf where limits or margins forbid it.
        held: turn of the roll to either side in which what moves with the TCP stays in a collision, (m,), rad.
    """

    target: Ints
    branch: Ints
    roll: Floats
    q: Floats
    room: Floats
    held: Floats

    def sorted_with(self, *others: _Looked) -> _Looked:
        """All of them together."""
        every = [np.concatenate([getattr(x, f.name) for x in (self, *others)]) for f in fields(self)]
        order = np.lexsort((every[2], every[1], every[0]))
        return _Looked(*(values[order] for values in every))


def free_rolls(
    context: Context, targets: Iterable[int], step: float, also: Mapping[int, float] | None = None
) -> dict[int, Stretches]:
    """Stretches of the roll at which targets are free by themselves.

    Args:
        context: the arm and the cell.
        targets: which.
        step: distance of the rolls that are looked at in any case, rad.
        also: by target a further one, rad.

    Returns:
        By target lowest and highest of neighbouring rolls that were found free, rad, of every branch by itself.
    """
    every = list(targets)
    out: dict[int, Stretches] = {i: [] for i in every}
    radius = context.tool_radius
    for first in range(0, len(every), TARGETS_TOGETHER):
        some = np.array(every[first : first + TARGETS_TOGETHER], dtype=np.int64)
        known = _sampled(context, some, step, radius)
        more = [(i, (also or {})[i]) for i in some.tolist() if i in (also or {})]
        if more:
            target, roll = np.array([i for i, _ in more]), np.array([r for _, r in more], dtype=float)
            known = known.sorted_with(_looked_at(context, target, roll, None, radius))
        while context.solver.form is not None:
            at = np.flatnonzero(_may_hide(context, known))
            if not len(at):
                break
            middle = (known.roll[at] + known.roll[at + 1]) / 2
            known = known.sorted_with(_looked_at(context, known.target[at], middle, known.branch[at], radius))
        for i, low, high in _stretches(known):
            out[i].append((low, high))
    return out


def _sampled(context: Context, some: Ints, step: float, radius: Floats) -> _Looked:
    """Targets at all rolls of a step, less those between coarser ones at which the tool is held in a collision."""
    rolls = context.window.samples(step)
    if context.window.is_full:
        rolls = np.append(rolls, rolls[0] + 2 * np.pi)
    coarse = np.unique(np.append(np.arange(0, len(rolls), COARSER), len(rolls) - 1))
    first = rolls[coarse]
    target, roll = np.repeat(some, len(first)), np.tile(first, len(some))
    known = _looked_at(context, target, roll, None, radius)
    held = np.zeros((len(some), len(first)))
    at = np.searchsorted(np.sort(some), known.target), np.searchsorted(first, known.roll)
    np.maximum.at(held, at, known.held)  # in one branch as in another
    open_ = held[:, :-1] + held[:, 1:] < np.diff(first)  # (t, gaps)
    rest = np.setdiff1d(np.arange(len(rolls)), coarse)
    t, k = np.nonzero(open_[:, np.searchsorted(coarse, rest) - 1])
    if not len(t):
        return known
    return known.sorted_with(_looked_at(context, np.sort(some)[t], rolls[rest[k]], None, radius))


def _looked_at(context: Context, target: Ints, roll: Floats, branch: Ints | None, radius: Floats) -> _Looked:
    """Targets at rolls, (m,): all their branches, or one of each."""
    solver = context.solver
    each, same = np.unique(np.stack([target, roll]), axis=1, return_inverse=True)
    placed = context.placed.rows(each[0].astype(np.int64))
    found = solver.candidates(apply_roll(placed.Ts_base_target, each[1])).q[same.reshape(-1)]
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
    # standings that differ by whole turns are one to look at
    q = found[np.arange(len(found)), np.argmax(good, axis=1)]
    room = np.where(good.any(axis=1), np.nan, -np.inf)
    return _with_room(context, _Looked(target, branch, roll, q, room, np.zeros(len(q))).sorted_with(), radius)


def _with_room(context: Context, looked: _Looked, radius: Floats) -> _Looked:
    """The same with the room where it is NaN: of one branch of each roll first, as the tool stands alike in all."""
    room, held = looked.room.copy(), np.zeros(len(looked.room))
    _, alike = np.unique(np.stack([looked.target, looked.roll]), axis=1, return_inverse=True)
    alike = alike.reshape(-1)
    for one_a_roll in (True, False):
        at = np.flatnonzero(np.isnan(room))
        if one_a_roll:
            at = at[np.unique(alike[at], return_index=True)[1]]
        if not len(at):
            break
        axes = context.placed.axes(looked.q[at], looked.target[at])
        seen = context.screen.clearances(axes, context.deposits_before[looked.target[at]])
        room[at] = seen.distance - context.settings.clearance
        mine = (room[at] < 0) & context.screen.of_tool(seen.pair)
        tool = at[mine]
        most, turn = np.full(int(alike.max(initial=0)) + 1, np.nan), np.zeros(int(alike.max(initial=0)) + 1)
        most[alike[tool]] = room[tool]
        np.maximum.at(turn, alike[tool], -room[tool] / radius[seen.pair[mine]].min(axis=1))
        room = np.where(np.isnan(room), most[alike], room)
        held = np.maximum(held, turn[alike])
    return _Looked(looked.target, looked.branch, looked.roll, looked.q, room, held)


def _may_hide(context: Context, known: _Looked) -> NDArray[np.bool_]:
    """Steps between neighbouring rolls that may hide something free, (m - 1,)."""
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


def _stretches(known: _Looked) -> list[tuple[int, float, float]]:
    """Targets, lowest and highest rolls of what is free without a gap."""
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


def standing_between(
    context: Context, nodes: Nodes, T: Floats, stage: int, roll: float, table: Floats = STANDS
) -> RollBetween | None:
    """Whether the arm can stand at a target at a roll between the samples.

    Args:
        context: the cell and what is to be kept.
        nodes: of the target's bead, for the window and the margins.
        T: the target at roll 0, (4, 4), m.
        stage: deposits laid when it is welded.
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
    found = context.screen.clearances(axes, np.full(len(at), stage))
    free = found.distance >= context.settings.clearance
    k = int(np.argmax(free)) if free.any() else int(np.argmax(found.distance))
    deg = round(float(np.rad2deg(rolls[at[k, 0]])), 3)
    if free.any():
        return RollBetween(deg)
    hit = context.describe(found, k)
    return RollBetween(deg, replace(hit, contact=Contact(hit.pair)))
