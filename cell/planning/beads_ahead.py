"""Beads that follow one another, searched ahead of their turn and checked together: one proof costs less than many.

    ahead = BeadsAhead(context, firsts, stop)
    bead = ahead.bead(first, q_before)          # None: it is to be planned by itself
    vain = ahead.in_vain(first, q_before)       # then: the quick search of it that found no way, if there was one

Each is searched from where the one before is expected to end. What is found is what a search of the bead by itself
finds at once, or nothing: a bead that has to avoid something, or to which the arm comes from elsewhere, is left to
that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from .bead_search import BeadPlan, BeadSearch
from .configurations import evaluate
from .context import Context
from .edge_check import CheckedEdges, SearchedBead, check_edges
from .station_search import Ends, StationSearch

TOGETHER = 1500  # targets that are looked ahead
MISSES = 2  # beads one after the other that are not found so, until nothing more is searched ahead
WASTED = 2 * TOGETHER  # targets searched ahead without use, until nothing more is


@dataclass(frozen=True, eq=False)
class _Expected:
    """A bead that is expected to be come to in a configuration."""

    q_before: Floats | None
    plan: BeadPlan


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
        self._stops = dict(zip(firsts, [*firsts[1:], stop], strict=True))
        self._expected: dict[int, _Expected] = {}
        self._misses, self._wasted = 0, 0
        self._vain: tuple[int, Floats | None, StationSearch] | None = None

    def bead(self, first: int, q_before: Floats | None) -> BeadPlan | None:
        """A bead, if it is found at once.

        Args:
            first: its first target.
            q_before: where the arm comes from, (j,), rad, or None.

        Returns:
            The whole bead, checked; None where it is to be planned by itself.
        """
        worth_it = self._misses < MISSES and self._wasted < WASTED
        if not self._expected and worth_it and self.in_vain(first, q_before) is None:
            self._search(first, q_before)
        known = self._expected.pop(first, None)
        if known is not None and _same(known.q_before, q_before):
            self._misses = 0
            self._wasted -= known.plan.stop - first
            return known.plan
        self._expected.clear()
        self._misses += 1
        return None

    def in_vain(self, first: int, q_before: Floats | None) -> StationSearch | None:
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
        context, ways = self._context, []
        begun = first
        while first in self._stops and self._stops[first] - begun <= TOGETHER:
            bead = SearchedBead.of(context, first, self._stops[first])
            if not StationSearch.suits(bead):
                break
            self._wasted += len(bead)  # until it is given out
            search = StationSearch(bead, context.settings.roll_step, Ends(q_before))
            found = search.way()
            way = self._full_way(bead, q_before) if found is None else found[1:]
            if way is None:
                self._vain = first, q_before, search
                break
            ways.append((first, q_before, *way))
            first, q_before = self._stops[first], way[1][-1]
        if not ways:
            return
        checked, last = self._checked(begun, first, [(at, roll, q) for at, _, roll, q in ways])
        for (at, before, _, _), (a, b) in zip(ways, last, strict=True):
            if all(cause is None for cause in checked.causes[a : b + 1]):
                plan = BeadPlan(at, self._stops[at], (checked.run(a, b),), {}, {})
                self._expected[at] = _Expected(before, plan)

    def _full_way(self, bead: SearchedBead, q_before: Floats | None) -> tuple[Floats, Floats] | None:
        """Rolls and configurations on the way that the full search of a bead begins with, where that costs little."""
        context = self._context
        if not context.window.is_fixed:
            return None
        # of one roll alone the nodes are few
        nodes = evaluate(context.solver, bead.placed, context.window, context.settings.roll_step, context.limits)
        return BeadSearch(bead, nodes).way(q_before)

    def _checked(
        self, begun: int, stop: int, ways: list[tuple[int, Floats, Floats]]
    ) -> tuple[CheckedEdges, list[tuple[int, int]]]:
        """The edges of ways, by first target, rolls and configurations; and the first and last edge of each."""
        together = SearchedBead.of(self._context, begun, stop)
        start = [np.arange(len(q) - 1) + first - begun for first, _, q in ways]
        roll = [np.stack([some[:-1], some[1:]], axis=1) for _, some, _ in ways]
        q = [np.stack([some[:-1], some[1:]], axis=1) for _, _, some in ways]
        checked = check_edges(together, np.concatenate(start), np.concatenate(roll), np.concatenate(q))
        ends = np.cumsum([len(some) for some in start]).tolist()
        return checked, [(end - len(some), end - 1) for some, end in zip(start, ends, strict=True)]


def _same(one: Floats | None, other: Floats | None) -> bool:
    return one is other or (one is not None and other is not None and bool((one == other).all()))
