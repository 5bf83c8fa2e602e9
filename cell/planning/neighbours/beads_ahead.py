"""Beads that follow one another, searched ahead of their turn and checked together: one proof costs less than many.

    ahead = BeadsAhead(context, firsts, stop)
    bead = ahead.bead(first, q_before)          # None: it is to be planned by itself
    failed = ahead.failed_search(first, q_before)  # then: the quick search of it that found no path, if there was one
    way = ahead.travel(last, bead)              # None: it is to be searched

Each bead is searched from where the one before is expected to end. The result is what the first attempt of a search of
the bead by itself would find, or none. Beads that have to avoid an obstacle, or that the arm comes to from another
configuration, are left to that search, and so are travels that do not go straight.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ik import closed_form
from ik.chain import Floats
from ik.roll import apply_roll

from ..bead_outcome import BeadPlan
from ..bead_search import BeadSearch
from ..configurations import nodes_at_rolls
from ..context import Context
from ..edges.edge_check import CheckedEdges, SearchedBead, Stretch, check_edges
from ..station_search import BESIDE, Ends, StationSearch
from ..stations import StationNodes, held_rolls_price
from ..travels.straight_travels import BeadGap, straight_travels
from ..travels.travel import TravelPath

TOGETHER = 1500  # targets that are looked ahead
MISSES = 2  # usual limit of beads one after the other that are not found so
STATIONS_TOGETHER = 400  # targets of beads whose stations are worked out at a time
WASTED = 2 * TOGETHER  # targets searched ahead without use, until nothing more is


@dataclass(frozen=True, eq=False)
class _ExpectedBead:
    """A bead that is expected to be come to in a configuration."""

    q_before: Floats | None
    plan: BeadPlan


@dataclass(frozen=True, eq=False)
class _KnownTravel:
    """A travel that is free."""

    gap: BeadGap
    path: TravelPath


class BeadsAhead:
    """The beads of one run."""

    def __init__(self, context: Context, firsts: tuple[int, ...], stop: int) -> None:
        """Nothing is searched yet.

        Args:
            context: what the search needs.
            firsts: first target of each bead.
            stop: one past the last target of the last.
        """
        self._context = context
        self._whole_span = firsts[:1] == (context.span.first,) and stop == context.span.stop
        self._not_straight: dict[int, BeadGap] = {}  # gaps that no straight travel was found across, by the same
        self._home: list[_KnownTravel] = []  # from the arm's home and back to it
        self._stops = dict(zip(firsts, [*firsts[1:], stop], strict=True))
        self._expected: dict[int, _ExpectedBead] = {}
        self._together: list[BeadPlan] = []  # beads between which travels have not been checked
        self._travels: dict[int, _KnownTravel] = {}  # by the first target of the bead that they lead to
        self._misses, self._wasted = 0, 0
        self._alone, self._pause = 0, 1  # beads found alone since nothing is searched ahead, and after how many it is
        self._vain: tuple[int, Floats | None, StationSearch] | None = None
        self._nodes: dict[int, StationNodes] = {}  # of beads that have not been come to, by their first target
        self.doubtful = False  # whether many travels are expected not to be straight
        self.most_misses = MISSES  # beads one after the other that are not found so, until nothing more is searched

    def bead(self, first: int, q_before: Floats | None) -> BeadPlan | None:
        """A bead, if it is found at once.

        Args:
            first: its first target.
            q_before: where the arm comes from, (j,), rad, or None.

        Returns:
            The whole bead, checked; None where it is to be planned by itself.
        """
        worth_it = self._misses < self.most_misses and self._wasted < WASTED
        if not self._expected and worth_it and self.failed_search(first, q_before) is None:
            self._search(first, q_before)
        known = self._expected.pop(first, None)
        if known is not None and _same(known.q_before, q_before):
            self._misses, self._pause = 0, 1
            self._wasted -= known.plan.stop - first
            return known.plan
        self._expected.clear()
        self._misses += 1
        return None

    def found_alone(self) -> None:
        """A bead was found whole by itself. After some of these, beads are searched ahead again."""
        if self._misses < self.most_misses:
            return
        self._alone += 1
        if self._alone >= self._pause:
            self._alone, self._pause, self._misses = 0, 2 * self._pause, self.most_misses - 1

    def can_leave(self, last: Stretch | None, bead: BeadPlan) -> bool:
        """Whether it is known that the torch can be drawn back from a bead: a travel leads on from it.

        Args:
            last: what is welded before the bead; None where that is not known.
            bead: the bead.
        """
        self._find_travels(last, bead)
        known = self._travels.get(bead.stop)
        return known is not None and bead.whole and known.gap.end is bead.stretches[0]

    def travel(self, last: Stretch, bead: BeadPlan) -> TravelPath | None:
        """The travel to a bead from what was welded last, if it is known."""
        self._find_travels(last, bead)
        known = self._travels.pop(bead.first, None)
        if known is None or not bead.whole:
            return None
        return known.path if known.gap.end is last and known.gap.start is bead.stretches[0] else None

    def no_straight_travel(self, last: Stretch, bead: BeadPlan) -> bool:
        """Whether it is known that no straight travel as far out as the case asks for leads to a whole bead."""
        gap = self._not_straight.get(bead.first)
        return gap is not None and gap.end is last and gap.start is bead.stretches[0]

    @property
    def gaps_not_straight(self) -> int:
        """How many gaps are known across which no such travel leads."""
        return len(self._not_straight)

    def home_travels(self, beads: Sequence[BeadPlan]) -> tuple[TravelPath | None, TravelPath | None]:
        """The ways from home to the first bead and from the last one back, where they are known: found beside travels.

        Args:
            beads: all of the run as they are planned; a way to or from a stretch that is none of theirs does not count.
        """
        out = back = None
        for known in self._home:
            if beads[0].whole and known.gap.start is beads[0].stretches[0]:
                out = known.path
            if beads[-1].whole and known.gap.end is beads[-1].stretches[0]:
                back = known.path
        return out, back

    def _find_travels(self, last: Stretch | None, bead: BeadPlan) -> None:
        """The travels between beads that were searched together, and to the first of them, where that has come."""
        if not self._together or self._together[0] is not bead:
            return
        ends = [last, *(plan.stretches[0] for plan in self._together)]
        laid = self._context.laid
        gaps = [BeadGap(a, b, int(laid[a.stop - 1])) for a, b in pairwise(ends) if a is not None and b is not None]
        gaps += self._home_gaps()
        self._together = []
        for gap, path in zip(gaps, straight_travels(self._context, gaps, doubtful=self.doubtful), strict=True):
            if path is not None and gap.end is not None and gap.start is not None:
                self._travels[gap.start.first] = _KnownTravel(gap, path)
            elif path is not None:
                self._home.append(_KnownTravel(gap, path))
            elif gap.end is not None and gap.start is not None:
                self._not_straight[gap.start.first] = gap

    def _home_gaps(self) -> list[BeadGap]:
        """Between the arm's home and beads that were searched together, where they are all of a span."""
        span, beads, gaps = self._context.span, self._together, []
        if self._whole_span and span.start is not None and beads[0].first == span.first:
            gaps.append(BeadGap(None, beads[0].stretches[0], self._context.begun))
        if self._whole_span and span.end is not None and beads[-1].stop == span.stop:
            gaps.append(BeadGap(beads[-1].stretches[0], None, int(self._context.laid[span.stop - 1])))
        return gaps

    def failed_search(self, first: int, q_before: Floats | None) -> StationSearch | None:
        """The quick search of a bead that found no way, which need not be done again.

        Args:
            first: its first target.
            q_before: where the arm comes from, (j,), rad, or None.

        Returns:
            The search; None where there was none.
        """
        if self._vain is None or self._vain[0] != first or not _same(self._vain[1], q_before):
            return None
        return self._vain[2]

    def _search(self, first: int, q_before: Floats | None) -> None:
        """Search beads from one on, each from the end of the one before, and check them together."""
        context, paths = self._context, []
        begun, step, beads = first, context.settings.roll_step, self._beads_from(first)
        self._nodes = {at: nodes for at, nodes in self._nodes.items() if at >= first}
        come_from = q_before
        searched: Iterable[tuple[SearchedBead, StationNodes]] = self._with_nodes(beads)
        if q_before is None and len(beads) > 1:
            nodes = StationNodes.of_each(beads, step)
            come_from, searched = self._suited_beginning(beads, nodes), zip(beads, nodes, strict=True)
            self._nodes = {bead.first: known for bead, known in zip(beads, nodes, strict=True)}
        for bead, known in searched:
            self._wasted += len(bead)  # until it is given out
            search = StationSearch(bead, step, Ends(come_from), nodes=known)
            found = search.cheapest_path()
            path = self._full_way(search, q_before) if found is None else found[1:]
            if path is None:
                if come_from is q_before:
                    self._vain = bead.first, q_before, search
                break
            paths.append((bead.first, q_before, *path))
            first, q_before = self._stops[bead.first], path[1][-1]
            come_from = q_before
        if not paths:
            return
        checked, last = self._checked(begun, first, [(at, roll, q) for at, _, roll, q in paths])
        for (at, before, _, _), (a, b) in zip(paths, last, strict=True):
            if all(cause is None for cause in checked.causes[a : b + 1]):
                plan = BeadPlan(at, self._stops[at], (checked.run(a, b),), {}, {})
                self._expected[at] = _ExpectedBead(before, plan)
        self._together = []
        for at, *_ in paths:
            if at not in self._expected:
                break
            self._together.append(self._expected[at].plan)

    def _suited_beginning(self, beads: list[SearchedBead], nodes: list[StationNodes]) -> Floats | None:
        """Where the first of beads begins best for all of them, (j,), rad, if it is not known where the arm comes from.

        What follows begins near where the bead before ends: a short bead's own preference may be expensive for the long
        ones after it. Rolls beside the one that it prefers are tried, in its branch.
        """
        context = self._context
        step, window = context.settings.roll_step, context.window
        path = None if window.is_fixed else StationSearch(beads[0], step, Ends(), nodes=nodes[0]).cheapest_path()
        if path is None:
            return None
        branch, roll, _ = path
        rolls = roll[0] + BESIDE * step
        rolls = rolls if window.is_full else np.clip(rolls, window.low, window.high)
        best = rolls[int(np.argmin(held_rolls_price(beads, nodes, branch, rolls, step)))]
        assert context.solver.form is not None
        q = closed_form.solve_branch(context.solver.form, apply_roll(nodes[0].Ts[0], best), branch)
        return None if np.isnan(q).any() else q

    def _with_nodes(self, beads: list[SearchedBead]) -> Iterator[tuple[SearchedBead, StationNodes]]:
        """Beads with the nodes of their stations, which are worked out for some of them at a time, and once."""
        for k, bead in enumerate(beads):
            if bead.first not in self._nodes:
                ends = np.cumsum([len(other) for other in beads[k:]])
                some = beads[k : k + int(np.searchsorted(ends, STATIONS_TOGETHER)) + 1]
                nodes = StationNodes.of_each(some, self._context.settings.roll_step)
                self._nodes.update({one.first: known for one, known in zip(some, nodes, strict=True)})
            yield bead, self._nodes[bead.first]

    def _beads_from(self, first: int) -> list[SearchedBead]:
        """Beads from one on that are searched together."""
        begun, beads = first, []
        while first in self._stops and self._stops[first] - begun <= TOGETHER:
            bead = SearchedBead.of(self._context, first, self._stops[first])
            if not StationSearch.suits(bead):
                break
            beads.append(bead)
            first = self._stops[first]
        return beads

    def _full_way(self, search: StationSearch, q_before: Floats | None) -> tuple[Floats, Floats] | None:
        """Rolls and configurations on the way that the full search of a bead begins with, where that costs little.

        Args:
            search: the quick search of it, which found no way.
            q_before: where the arm comes from, (j,), rad, or None.
        """
        bead, context = search.bead, self._context
        if not context.window.is_fixed or search.shut:
            return None
        # of one roll alone the nodes are few
        nodes = nodes_at_rolls(context.solver, bead.placed, context.window, context.settings.roll_step, context.limits)
        return BeadSearch(bead, nodes).first_path(q_before)

    def _checked(
        self, begun: int, stop: int, paths: list[tuple[int, Floats, Floats]]
    ) -> tuple[CheckedEdges, list[tuple[int, int]]]:
        """The edges of ways, by first target, rolls and configurations; and the first and last edge of each."""
        together = SearchedBead.of(self._context, begun, stop)
        start = [np.arange(len(q) - 1) + first - begun for first, _, q in paths]
        roll = [np.stack([some[:-1], some[1:]], axis=1) for _, some, _ in paths]
        q = [np.stack([some[:-1], some[1:]], axis=1) for _, _, some in paths]
        checked = check_edges(together, np.concatenate(start), np.concatenate(roll), np.concatenate(q))
        ends = np.cumsum([len(some) for some in start]).tolist()
        return checked, [(end - len(some), end - 1) for some, end in zip(start, ends, strict=True)]


def _same(one: Floats | None, other: Floats | None) -> bool:
    return one is other or (one is not None and other is not None and bool((one == other).all()))
