"""A part that cannot be built: which of its targets are still checked once that is known.

    judge = InfeasiblePartJudge(context, first)
    bead = judge.plan(first, stop, q_before, plan_in_full)     # .open: targets of it that were not checked
    judge.left(target)                                         # configurations that may still be asked by then

Work is counted in configurations queried and in contacts found, so that a verdict does not depend on the machine. The
budget is FLOOR (LARGE_FLOOR for parts of more than SMALL targets) and PER_TARGET for each target of the part, spent
evenly along it. Queries for beads that are not found whole are charged to it; of beads that are found whole, queries
beyond EASY for each of their targets. Within the budget the check is complete.

Beyond the budget, a bead of a part that is not known to be lost is postponed: ``plan`` gives None, and
``cell.planning.part_plan`` comes back to it if nothing else is lost: first to see whether it is cut (``bead_cut``),
then to search it in full. So is a bead that the quick search does not find and whose full search the budget does not
allow. In a part that is lost, such a bead is lost as soon as one of its targets is proved out of reach, or is free at
no roll; a few others are checked with it, and the rest is left open: neither feasible nor infeasible. Of a large part
that is lost, beads are passed over, and left open, behind those that came out neither whole nor with a lost target: one
behind the first of these, and twice as many behind each that follows.

Metres and radians.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from .bead_outcome import BeadPlan, TargetFailure
from .bead_search import BeadSearch
from .collision_free_rolls import LeastBadRoll, collision_free_rolls, free_nowhere
from .configurations import BRANCHES, nodes_at_rolls
from .context import FINER_ROLLS, Context
from .cuts.bead_cut import cut_bead, may_be_cut
from .edges.edge_check import SearchedBead, Stretch
from .neighbours.similar_bead import like
from .station_search import HIT, Ends, StationSearch
from .unreachable import unreachable

FLOOR, SMALL = 20_000, 600  # configurations asked about what cannot be welded, of parts of so many targets at most
LARGE_FLOOR = 100  # of all others
PER_TARGET = 1  # and for each of its targets
EASY = 5  # configurations that a target of a bead that comes out whole may take; what it takes beyond is charged
TRIED_FIRST = 3  # targets judged by themselves before a bead is searched in full
TARGET_WORK = 60  # configurations that it takes to judge a target by itself, about, as long as none was
LOOKED_AT = 3  # last beads of a part, or of those postponed, of which some may be looked at whether they are cut
LOOKED_AT_CLOSELY = 2  # of these, before any bead is searched in full
FEW, TOGETHER, HELD_TOGETHER = 4, 48, 384  # targets judged in one go: at least, and at most with a free and a held roll
TRAVEL_WORK = 4000  # configurations that a way round is searched with, about


@dataclass(frozen=True)
class Judged:
    """What a judge has spent, and what it knows of beads.

    Attributes:
        spent: configurations asked about what cannot be welded.
        lost: whether a bead is known not to come out whole.
        suspect: a target that was found lost, or None.
    """

    spent: float = 0.0
    lost: bool = False
    suspect: int | None = None


@dataclass(frozen=True)
class DoubtfulBead:
    """A bead that is postponed.

    Attributes:
        first: its first target.
        stop: one past its last.
        near: pairs of its targets, counted from its first, between which the quick search found no way; None where it
            was not searched.
    """

    first: int
    stop: int
    near: tuple[tuple[int, int], ...] | None


class InfeasiblePartJudge:
    """Plans the beads of a part, and keeps count of what is asked about those that are lost."""

    def __init__(
        self,
        context: Context,
        first: int,
        share: float = 1.0,
        full_searches: float = np.inf,
        *,
        cuts_known: bool = False,
    ) -> None:
        """Begin a part, or a chunk of one.

        Args:
            context: what the search needs.
            first: its first target.
            share: of what a whole part may cost whatever its size.
            full_searches: how many beads that would be postponed may be searched in full, as long as none is lost.
            cuts_known: whether it is known of these beads that no cut is found.
        """
        self._cuts_known = cuts_known
        self.doubtful: list[DoubtfulBead] = []  # that were postponed
        self._first_pass = full_searches == 0
        self.floor = share * (FLOOR if len(context.deposits_before) <= SMALL else LARGE_FLOOR)
        self.context, self.every = context, context.settings.every_target
        self.first = first
        self.full_searches = full_searches
        self._passed, self._pass_next = 0, 0  # beads left open in a row since one was searched, and how many next
        self.go_on(Judged())
        self._judged_alone = 1  # targets, and what they cost
        self._work_alone = float(BRANCHES if context.window.is_fixed else TARGET_WORK)

    @property
    def judged(self) -> Judged:
        """What has been spent and learned so far."""
        return Judged(self.spent, self.lost, self._suspect)

    def go_on(self, judged: Judged) -> None:
        """Go on from there.

        Args:
            judged: what was spent and learned.
        """
        self.spent, self.lost = judged.spent, judged.lost
        self._suspect = judged.suspect  # others near it are looked at first

    def left(self, target: int) -> float:
        """Configurations that may still be asked once the targets before this one are dealt with."""
        return np.inf if self.every else self.floor + PER_TARGET * (target - self.first) - self.spent

    def affords(self, first: int, stop: int) -> bool:
        """Whether the budget allows to search a bead in full."""
        return full_work(self.context, stop - first) <= self.left(stop)

    def affords_travel(self, stop: int) -> bool:
        """Whether the budget allows to search a way round to a bead that ends before a target."""
        return self.left(stop) >= TRAVEL_WORK

    def charge(self, before: float) -> None:
        """Count what has been asked since the context's counter stood at ``before`` without a result."""
        self.spend(before)
        self.lost = True

    def knows_lost(self, bead: BeadPlan) -> None:
        """Note that a later bead is lost; of one without a lost target, that other beads are like it."""
        self.lost = True
        self._pass_next = 0 if bead.target_failures else 1

    def spend(self, before: float) -> None:
        """Count what has been asked since the context's counter stood at ``before``."""
        self.spent += self.context.work - before

    def plan(
        self,
        first: int,
        stop: int,
        q_before: Floats | None,
        in_full: Callable[[float | None], BeadPlan],
        vain: StationSearch | None = None,
        hard: Sequence[Stretch] = (),
    ) -> BeadPlan | None:
        """Plan a bead.

        Args:
            first: its first target.
            stop: one past its last.
            q_before: where the arm comes from, (j,), rad, or None.
            in_full: searches it in full; given what it may ask once the bead is known to be lost, None without a limit.
            vain: a quick search of it that found no way.
            hard: ways of beads before it that were hard to find.

        Returns:
            The plan; None of a bead that has to be searched in full and may not be.
        """
        before = self.context.work
        if self.every:
            return in_full(None)
        bead = (
            in_full(self.left(stop))
            if self.affords(first, stop)
            else self._sparingly(first, stop, q_before, in_full, vain, hard)
        )
        if bead is None:
            self.spent += self.context.work - before
        elif bead.whole:
            self.spent += max(self.context.work - before - EASY * (stop - first), 0)
        else:
            self.charge(before)
            self._suspect = next(iter(bead.target_failures), self._suspect)
        return bead

    def _sparingly(
        self,
        first: int,
        stop: int,
        q_before: Floats | None,
        in_full: Callable[[float | None], BeadPlan],
        vain: StationSearch | None,
        hard: Sequence[Stretch],
    ) -> BeadPlan | None:
        """A bead whose search in full may cost more than is left; None: it is postponed."""
        before = self.context.work
        suspects = [] if self._suspect is None else [self._nearest(first, stop)]
        spent = self._first_pass and self.left(stop) < 0
        if self.lost or spent:  # what is out of reach is known without a search
            target_failures = unreachable(self.context, range(first, stop))
            if not target_failures and not self.lost:
                self._postpone(first, stop, None)
                return None
            if not target_failures and self._passes():
                return lost_bead(first, stop, {})
            target_failures.update(self._judged(suspects, first, stop, before) if not target_failures else {})
            if target_failures or self.left(stop) < 0:
                target_failures.update(self._judged(_spread(first, stop), first, stop, before, target_failures))
                return lost_bead(first, stop, target_failures)
        bead = SearchedBead.of(self.context, first, stop)
        search: StationSearch | None = None
        if StationSearch.suits(bead):
            search = vain or StationSearch(bead, self.context.settings.roll_step, Ends(q_before))
            most = self.left(stop) if self.lost and self.floor < FLOOR else np.inf
            stretch = search.run(most) if vain is None else None
            if stretch is not None:
                self._pass_next = 0
                return BeadPlan(first, stop, (stretch,), {}, {})
            suspects += [first + int(i) for i in most_hit(search)]
        stretch = None if self.lost else like(self.context, first, stop, hard, q_before)
        if stretch is not None:
            return BeadPlan(first, stop, (stretch,), {}, {}, hard=True)
        target_failures = {}
        if not self.lost:  # of a lost part it is known by here that none is out of reach
            some = list(dict.fromkeys(suspects))[:TRIED_FIRST]
            target_failures = unreachable(self.context, range(first, stop)) or lost_alone(self.context, some)
            if not target_failures and self.full_searches <= 0:
                self._postpone(first, stop, search)
                return None
            if not target_failures:
                self.full_searches -= 1
                near = [] if search is None or self._cuts_known else search.cut_between()
                cut = cut_bead(self.context, first, stop, near) if near else None
                return in_full(self.left(stop)) if cut is None else cut
        order = [*suspects, *_spread(first, stop)]
        target_failures.update(self._judged(order, first, stop, before, target_failures))
        self._pass_next = 0 if target_failures else max(2 * self._pass_next, 1)
        self._passed = 0
        return lost_bead(first, stop, target_failures)

    def _passes(self) -> bool:
        """Whether a bead of a large part that is lost is left open: those before it were searched without a result."""
        if not self.lost or self.floor >= FLOOR or self._passed >= self._pass_next:
            return False
        self._passed += 1
        return True

    def _postpone(self, first: int, stop: int, search: StationSearch | None) -> None:
        """Note a bead to be come back to, with a search of it that found no way."""
        self.doubtful.append(DoubtfulBead(first, stop, None if search is None else tuple(search.cut_between())))

    def _judged(
        self, order: Iterable[int], first: int, stop: int, before: float, known: dict[int, TargetFailure] | None = None
    ) -> dict[int, TargetFailure]:
        """Targets that are lost, of those that the budget allows to check one after the other."""
        out: dict[int, TargetFailure] = {}
        some = [i for i in dict.fromkeys(order) if i not in (known or {})]
        while some and (left := self.left(stop) - (self.context.work - before)) > 0:
            begun, count = self.context.work, self._as_many(left)
            out.update(lost_alone(self.context, some[:count]))
            self._judged_alone += len(some[:count])
            self._work_alone += self.context.work - begun
            some = some[count:]
        return out

    def _as_many(self, left: float) -> int:
        """Targets to be judged in one go with what is left, by what others have cost."""
        most = HELD_TOGETHER if self.context.window.is_fixed else TOGETHER
        return int(np.clip(left * self._judged_alone // self._work_alone, FEW, most))

    def _nearest(self, first: int, stop: int) -> int:
        """The target of a bead that is nearest to the last one that was lost."""
        position = self.context.placed.bead.position
        off = position[first:stop] - position[self._suspect]
        return first + int(np.argmin(np.einsum("ti,ti->t", off, off)))


def full_work(context: Context, targets: int) -> int:
    """Configurations of some targets at all rolls that a search in full may check."""
    rolls = context.window.samples(context.settings.roll_step / FINER_ROLLS)
    return targets * len(rolls) * BRANCHES


def first_cut_of(context: Context, beads: Sequence[DoubtfulBead], count: Callable[[], None]) -> BeadPlan | None:
    """One of some beads that is found to be cut, as what is known of it by then.

    What is welded later has more in its way, so LOOKED_AT_CLOSELY of the last LOOKED_AT are looked at, those of few
    targets first. It is no more than that, for of beads that are hard but can be welded these looks find nothing, and
    they cost.

    Args:
        context: what the search needs.
        beads: which.
        count: called for every bead that is looked at.

    Returns:
        The first that is found; None where there is none.
    """
    last = sorted(beads[: -LOOKED_AT - 1 : -1], key=lambda bead: bead.stop - bead.first)
    for bead in last[:LOOKED_AT_CLOSELY]:
        near = bead.near or ()
        if bead.near is None and may_be_cut(context, bead.first, bead.stop):
            searched = SearchedBead.of(context, bead.first, bead.stop)
            search = StationSearch(searched, context.settings.roll_step, Ends())
            near = () if search.run() is not None else tuple(search.cut_between())
        cut = cut_bead(context, bead.first, bead.stop, near) if near else None
        count()
        if cut is not None:
            return cut
    return None


def lost_bead(first: int, stop: int, target_failures: dict[int, TargetFailure]) -> BeadPlan:
    """The result of a bead of which some targets are lost and nothing else was checked."""
    rest = frozenset(range(first, stop)) - target_failures.keys()
    return BeadPlan(first, stop, (), {}, dict(sorted(target_failures.items())), rest)


def lost_alone(context: Context, targets: Sequence[int]) -> dict[int, TargetFailure]:
    """Targets that have no configuration at any roll, each checked by itself.

    Args:
        context: the arm and the cell.
        targets: which.

    Returns:
        What is wrong with those that have none, as a search of their bead says it; rolls between the samples are
        checked as well.
    """
    some: Ints = np.array(targets, dtype=np.int64)
    if context.window.is_fixed:
        return _without_nodes(context, some)
    step = context.settings.roll_step
    nowhere = free_nowhere(context, targets, step / FINER_ROLLS)
    out = {i: _colliding(context, best) for i, best in nowhere.items() if best is not None}
    bare = _without_nodes(context, np.array([i for i, best in nowhere.items() if best is None], dtype=np.int64))
    between = {i: lost.failure.between for i, lost in bare.items() if not lost.failure.proved}
    also = {i: float(np.deg2rad(b.roll_deg)) for i, b in between.items() if b is not None and b.collision is None}
    free = collision_free_rolls(context, also, step / FINER_ROLLS, also)
    return dict(sorted({**out, **{i: lost for i, lost in bare.items() if not free.get(i)}}.items()))


def _colliding(context: Context, best: LeastBadRoll) -> TargetFailure:
    """A target at whose every roll something collides."""
    failure = context.describe(best.clearances, 0)
    return TargetFailure(replace(failure, roll_deg=round(float(np.rad2deg(best.roll)), 3)), best.q)


def _without_nodes(context: Context, some: Ints) -> dict[int, TargetFailure]:
    """Targets without a node that is free, with why."""
    if not len(some):
        return {}
    nodes = nodes_at_rolls(
        context.solver, context.placed.rows(some), context.window, context.settings.roll_step, context.limits
    )
    found = BeadSearch(SearchedBead.apart(context, some), nodes).lost_alone()
    return {int(some[k]): lost for k, lost in found.items()}


def most_hit(search: StationSearch) -> Ints:
    """Stations of a search without a result, as targets of the bead, those first at which most was found to collide.

    Args:
        search: the search.

    Returns:
        Targets counted from the bead's first, (s,).
    """
    hits = (search.known == HIT).sum(axis=(1, 2))
    return search.at[np.argsort(-hits, kind="stable")]


def _spread(first: int, stop: int) -> Iterator[int]:
    """All targets of a bead in an order whose beginnings are spread evenly over it."""
    n = max(stop - first - 1, 1)
    bits = n.bit_length()
    for k in range(1 << bits):
        at = int(f"{k:0{bits}b}"[::-1], 2)
        if at < stop - first:
            yield first + at
