"""Where a bead is cut: places on either side of which it can be welded, with no way from the one side to the other.

    cut = find_cut(context, first, stop, near)
    cut.first, cut.stop              # targets among which no way leads from the first to the last; None: none was found
    bead = cut_bead(context, first, stop, near)      # the bead with why it is lost

A bead can be lost though each of its targets can be welded: what stands beside it leaves some rolls free at its one
half and others at its other half. To see that by searching all its ways takes hundreds of times as long as to find a
way. Here places where it may be cut are looked at, at most ``APART`` from one another where it matters. All rolls of
each are checked, closely (``collision_free_rolls``). Between two places, a roll is blocked where the arm is deeper in a
collision at both of them than it has to go from one to the other, and where limits or margins forbid it. Blocked rolls
separate what is free at the one place from what is free at the other: on the way the roll would have to turn through
one of them. What can be reached from the first place is followed from place to place in every branch, and places are
put between others where it may go round what is in the way. A branch is cut where nothing is reached.

A search, and no proof: depths are what the collision engine says. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats
from ik.roll import wrap

from ..arrays import Ints
from ..failure import Failure, FailurePlace, Kind, Where
from ..rigid import great_circle
from ..scene.placement import PlacedTargets
from .bead_outcome import BeadPlan
from .bead_search import BeadSearch
from .collision_free_rolls import (
    MOST_DETOUR,
    KnownRolls,
    checked_rolls,
    rolls_around,
    rolls_sampled,
    with_rolls_between,
)
from .configurations import BRANCHES, nodes_at_rolls
from .context import FINER_ROLLS, Context
from .edges.edge_check import SearchedBead
from .edges.edge_tracking import EdgePoses
from .stations import Spacing, nodes_of_poses, stations

Bools = NDArray[np.bool_]
SEARCHED = 12  # targets among which a cut is searched as well, to say why it is one
AROUND = 1  # stations on either side of where a bead may be cut that are looked at as well
MOST_NEAR, MOST_PLACES = 3, 24  # such stretches of a bead, and places of each
FAR_TURN = np.deg2rad(15.0)  # of the roll from place to place: it may go round what is in the way
APART, TURNED = 5e-3, np.deg2rad(3.0)  # m along the bead and turn of the wire, rad, of neighbouring places at most


@dataclass(frozen=True)
class BeadCut:
    """Targets among which no way leads from the first to the last.

    Attributes:
        first: the first of them.
        stop: one past the last.
    """

    first: int
    stop: int


def cut_bead(context: Context, first: int, stop: int, near: Iterable[tuple[int, int]] = ()) -> BeadPlan | None:
    """A bead that is cut, as what is known of it by then: why no way leads on there; the rest is left open.

    Args:
        context: the arm and the cell.
        first: the bead's first target.
        stop: one past its last.
        near: see :func:`find_cut`.

    Returns:
        The plan; None where no cut was found.
    """
    cut = find_cut(context, first, stop, near)
    if cut is None:
        return None
    to = cut.stop - 1
    why = {to: Failure(Kind.CONFIGURATION_CHANGE, place=FailurePlace(Where.BEAD, from_target=to - 1))}
    if cut.stop - cut.first <= SEARCHED:
        bead = SearchedBead.of(context, cut.first, cut.stop)
        nodes = nodes_at_rolls(context.solver, bead.placed, context.window, context.settings.roll_step, context.limits)
        plan = BeadSearch(bead, nodes).run(None)
        if plan.whole:
            return None  # the depths were not what they seemed
        why = plan.edge_failures or why
    return BeadPlan(first, stop, (), why, {}, frozenset(range(first, stop)) - why.keys())


def may_be_cut(context: Context, first: int, stop: int) -> bool:
    """Whether a bead is one of which cuts are known: of a roll to choose, an arm with a closed form, a table at rest.

    Args:
        context: the arm and the cell.
        first: the bead's first target.
        stop: one past its last.
    """
    rest = context.placed.moving is None and context.solver.form is not None and not context.window.is_fixed
    return rest and stop - first > 1 and not np.ptp(context.deposits_before[first:stop])


def find_cut(context: Context, first: int, stop: int, near: Iterable[tuple[int, int]] = ()) -> BeadCut | None:
    """Where a bead is cut.

    Args:
        context: the arm and the cell.
        first: the bead's first target.
        stop: one past its last.
        near: pairs of its targets, counted from its first, between which it may be cut; anywhere where left out.

    Returns:
        The shortest stretch that was found; None where the bead may be whole, or a search in full costs little.
    """
    if not may_be_cut(context, first, stop):
        return None
    search = _CutSearch(context, first, stop)
    ends: list[tuple[int, int]] = []
    left = set(range(BRANCHES))
    for places in search.begun_at(list(near), left):
        while left:
            search.look(places, left)
            found = {g: cut for g in left if (cut := search.cut(places, g)) is not None}
            ends += found.values()
            left.difference_update(found)
            finer = search.refined(places, left)
            if finer is None or len(finer) > MOST_PLACES:
                break
            places = finer
    if left:
        return None
    from_, to = min(a for a, _ in ends), max(b for _, b in ends)
    targets = np.searchsorted(search.place, from_, "right") - 1, np.searchsorted(search.place, to)
    return BeadCut(first + int(targets[0]), first + int(targets[1]) + 1)


class _CutSearch:
    """What is known of places on a bead: its targets, and others between targets that are far apart."""

    def __init__(self, context: Context, first: int, stop: int) -> None:
        targets = context.placed.rows(slice(first, stop))
        placed, self.place = _dense(targets)  # place of every target
        laid = np.full(len(placed.position), context.deposits_before[first])
        self.context = replace(context, placed=placed, deposits_before=laid)
        self.step = context.settings.roll_step / FINER_ROLLS
        self.sampled = rolls_around(context, self.step)
        self._stations = stations(targets, Spacing())
        self._coarse: dict[int, set[tuple[int, float]]] = {}  # by place, branches and rolls that are free
        self._known: dict[int, KnownRolls] = {}  # by place, sorted by branch and roll
        self._blocked: dict[tuple[int, int], tuple[Ints, Floats]] = {}

    def begun_at(self, near: Sequence[tuple[int, int]], branches: set[int]) -> Iterator[list[int]]:
        """Places to begin with, a few at a time: two neighbours that seem apart, then more around them."""
        at = self._stations
        for a, b in near[:MOST_NEAR] or [(0, len(self.place) - 1)]:
            pair = self._narrowed(int(self.place[a]), int(self.place[b]), branches)
            if pair is not None:
                yield [pair, pair + 1]
            if not branches:
                return
            low, high = np.searchsorted(at, a, "right") - 1 - AROUND, np.searchsorted(at, b) + AROUND
            some = [a, b, *at[max(low, 0) : high + 1].tolist()]
            yield sorted({int(self.place[i]) for i in some})

    def _narrowed(self, a: int, b: int, branches: Iterable[int]) -> int | None:
        """The first of two neighbouring places from one to the other of which no coarse sample of the roll is free."""
        some = self._apart(a, b, branches)
        while some and b - a > 1:
            middle = (a + b) // 2
            before, after = self._apart(a, middle, some), self._apart(middle, b, some)
            if len(before) >= len(after):
                b, some = middle, before
            else:
                a, some = middle, after
        return a if some else None

    def _apart(self, a: int, b: int, branches: Iterable[int]) -> list[int]:
        """Branches in which no coarse sample of the roll is free at both of two places."""
        new: Ints = np.array([i for i in (a, b) if i not in self._coarse], dtype=np.int64)
        if len(new):
            known = rolls_sampled(self.context, new, self.step * FINER_ROLLS)
            some = known.rows(known.room >= 0)
            for i in new.tolist():
                here = some.target == i
                self._coarse[i] = set(zip(some.branch[here].tolist(), some.roll[here].tolist(), strict=True))
        both = {g for g, _ in self._coarse[a] & self._coarse[b]}
        return [g for g in branches if g not in both]

    def look(self, places: Sequence[int], branches: Iterable[int]) -> None:
        """Check all rolls of places in some branches, closely."""
        new: Ints = np.array([i for i in places if i not in self._known], dtype=np.int64)
        if not len(new):
            return
        rolls = np.unique(np.append(self.sampled, _between_samples(self.context, new, self.step)))
        grid = np.meshgrid(new, np.array(sorted(branches)), rolls, indexing="ij")
        target, branch, roll = (x.ravel() for x in grid)
        looked = checked_rolls(self.context, target, roll, branch)
        known = with_rolls_between(self.context, looked, beside_free=False)
        self._known.update({int(i): known.rows(known.target == i) for i in new})

    def cut(self, places: Sequence[int], branch: int) -> tuple[int, int] | None:
        """The closest of some places between which no way leads in a branch."""
        reached = self._reached(places, branch)
        end = next((k for k, some in enumerate(reached) if not len(some)), None)
        if end is None:
            return None
        begins = (k for k in range(end, -1, -1) if not all(map(len, self._reached(places[k : end + 1], branch))))
        begin = next(begins)
        return (places[begin], places[end]) if begin < end else (places[max(end - 1, 0)], places[max(end, 1)])

    def _reached(self, places: Sequence[int], branch: int) -> list[Floats]:
        """Rolls at places that may be reached from the first of them, up to the first at which there are none."""
        out = [self._free(places[0], branch)]
        for a, b in pairwise(places):
            if not len(out[-1]):
                break
            free = self._free(b, branch)
            blocked = self._between(a, b, branch)
            circular = self.context.window.is_full
            come = roll_sectors(blocked, out[-1], circular=circular)
            out.append(free[np.isin(roll_sectors(blocked, free, circular=circular), come)])
        return out

    def refined(self, places: Sequence[int], branches: Iterable[int]) -> list[int] | None:
        """The places and those half-way between any from one of which to the next the roll may turn far; None: none."""
        new: set[int] = set()
        for g in branches:
            reached = self._reached(places, g)
            for (a, b), come, on in zip(pairwise(places), reached[:-1], reached[1:], strict=False):
                apart = np.abs(wrap(on[:, None] - come)).min(axis=1)
                if b - a > 1 and (apart > FAR_TURN).any():
                    new.add((a + b) // 2)
        return sorted({*places, *new}) if new else None

    def _free(self, place: int, branch: int) -> Floats:
        known = self._known[place]
        return known.roll[(known.branch == branch) & (known.room >= 0)]

    def _between(self, a: int, b: int, branch: int) -> Floats:
        """Rolls that the arm cannot have in a branch anywhere between two places."""
        if (a, b) not in self._blocked:
            both = np.intersect1d(self._known[a].branch, self._known[b].branch)
            one, other = (
                known.rows(np.isin(known.roll, self.sampled) & np.isin(known.branch, both))
                for known in (self._known[a], self._known[b])
            )
            blocked = np.zeros(len(one.roll), dtype=bool)
            deep = np.flatnonzero(np.isfinite(one.room) & np.isfinite(other.room) & (one.room < 0) & (other.room < 0))
            from_q = one.q[deep]
            to_q = from_q + wrap(other.q[deep] - from_q)
            way = self.context.screen.travel_bound(self.context.radius, from_q, to_q)
            blocked[deep] = -(one.room[deep] + other.room[deep]) >= MOST_DETOUR * way
            forbidden = np.flatnonzero(np.isneginf(one.room) & np.isneginf(other.room))
            blocked[forbidden] = self._forbidden_between(a, b, one.roll[forbidden], one.branch[forbidden])
            self._blocked[a, b] = one.branch[blocked], one.roll[blocked]
        of, roll = self._blocked[a, b]
        return roll[of == branch]

    def _forbidden_between(self, a: int, b: int, roll: Floats, branch: Ints) -> Bools:
        """Whether limits and margins forbid rolls (m,) all along between two places, each in a branch."""
        if not len(roll):
            return np.zeros(0, dtype=bool)
        rolls, which = np.unique(roll, return_inverse=True)
        edge = np.repeat(np.arange(a, b), 2)
        t = np.tile([0.0, 0.5], b - a)
        poses = EdgePoses.of(self.context.placed, np.arange(a, b), np.zeros((b - a, 2)))
        Ts = poses.at(edge - a, t)
        _, cost = nodes_of_poses(self.context, Ts, np.broadcast_to(rolls, (len(Ts), len(rolls))))
        allowed: Bools = np.asarray(np.isfinite(cost).any(axis=0))
        return ~allowed[branch, which]


def roll_sectors(blocked: Floats, roll: Floats, *, circular: bool) -> Ints:
    """Between which of some blocked rolls other rolls are.

    Args:
        blocked: ascending, (b,), rad.
        roll: (m,), rad.
        circular: whether what is behind the last is before the first.

    Returns:
        Numbers, (m,), alike where no blocked roll lies between.
    """
    sector: Ints = np.searchsorted(blocked, roll)
    return sector % len(blocked) if circular and len(blocked) else sector


def _between_samples(context: Context, places: Ints, step: float) -> Floats:
    """The finest rolls that limits and margins allow where they may forbid the samples on both sides, (m,), rad."""
    nodes = nodes_at_rolls(
        context.solver, context.placed.rows(places), context.window, step / FINER_ROLLS, context.limits
    )
    some: Bools = np.asarray(np.isfinite(nodes.cost).any(axis=-1))
    if not context.window.is_full:  # whose finest rolls need not be at a third of the samples' distances
        return np.asarray(nodes.rolls[some.any(axis=(0, 2))])
    every = np.arange(some.shape[1])
    before, after = every // FINER_ROLLS * FINER_ROLLS, -(-every // FINER_ROLLS) * FINER_ROLLS
    hidden = some & ~some[:, before] & ~some[:, after % some.shape[1]]
    return np.asarray(nodes.rolls[hidden.any(axis=(0, 2))])


def _dense(targets: PlacedTargets) -> tuple[PlacedTargets, Ints]:
    """A bead's targets and places between those that are far apart; and which place each target is, (t,)."""
    p, n = targets.position, targets.normal
    turn = np.arccos(np.clip(np.einsum("ti,ti->t", n[1:], n[:-1]), -1.0, 1.0))
    measure = np.maximum(np.linalg.norm(np.diff(p, axis=0), axis=1) / APART, turn / TURNED)
    parts = np.maximum(np.ceil(measure - 1e-9), 1).astype(np.int64)
    place = np.append(0, np.cumsum(parts))
    edge = np.append(np.repeat(np.arange(len(parts)), parts), len(parts) - 1)
    fraction = ((np.arange(len(edge)) - place[edge]) / parts[edge])[:, None]
    position = p[edge] + fraction * (p[edge + 1] - p[edge])
    return PlacedTargets(position, great_circle(n[edge], n[edge + 1], fraction[:, 0]), targets.reference), place
