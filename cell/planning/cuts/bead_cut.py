"""Where a bead is cut: it can be welded on either side of a place, but no motion leads across.

    cut = find_cut(context, first, stop, near)
    cut.first, cut.stop              # targets among which no way leads from the first to the last; None: none was found
    bead = cut_bead(context, first, stop, near)      # the bead with why it is lost

A bead can be infeasible though each of its targets can be welded: obstacles leave some rolls free on one half of the
bead and other rolls on the other half. Finding that out by an exhaustive search takes hundreds of times as long as
finding a path. Here the bead is examined at places at most ``APART`` from one another. All rolls of each place are
checked closely (``collision_free_rolls``). Between two places a roll is blocked if limits or margins forbid it, or if
the arm penetrates at both places by more than it travels from one to the other. Blocked rolls separate the free rolls
of one place from those of the next: the roll would have to turn through one of them. The rolls that can be reached from
the first place are followed from place to place in every branch, and places are added where the roll may turn past the
obstacle. A branch is cut where no roll is reached.

This is a search and not a proof: depths of penetration are taken from the collision engine. Metres and radians.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ...failure import Failure, FailurePlace, Kind, Where
from ..bead_outcome import BeadPlan
from ..bead_search import BeadSearch
from ..configurations import BRANCHES, nodes_at_rolls
from ..context import Context
from ..edges.edge_check import SearchedBead
from .cut_search import CutSearch

SEARCHED = 12  # targets among which a cut is searched as well, to say why it is one
MOST_PLACES = 24  # that are looked at of each stretch in which a bead may be cut


@dataclass(frozen=True)
class BeadCut:
    """Targets among which no motion leads from the first to the last.

    Attributes:
        first: the first of them.
        stop: one past the last.
    """

    first: int
    stop: int


def cut_bead(context: Context, first: int, stop: int, near: Iterable[tuple[int, int]] = ()) -> BeadPlan | None:
    """The result of a bead that is cut: why no motion leads on there; its other targets are left open.

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
    """Whether cuts can be searched on a bead: the roll is free, the arm has a closed form, and the table stands.

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
    search = CutSearch(context, first, stop)
    seem: dict[int, list[int]] = {}  # by branch places between which no way seems to lead
    for places in search.begun_at(list(near)):
        while True:
            left = [g for g in range(BRANCHES) if g not in seem]
            seem.update({g: places for g in left if search.cut(places, g) is not None})
            if len(seem) == BRANCHES:  # among more places they may be closer
                seem = {g: some if search.cut(places, g) is None else places for g, some in seem.items()}
                cuts = search.confirmed(seem)
                if len(cuts) == BRANCHES:
                    return _cut_of(search, first, list(cuts.values()))
                seem = {g: seem[g] for g in cuts}
            finer = search.refined(places, [g for g in range(BRANCHES) if g not in seem])
            if finer is None or len(finer) > MOST_PLACES:
                break
            places = finer
    return None


def _cut_of(search: CutSearch, first: int, ends: Sequence[tuple[int, int]]) -> BeadCut:
    """Targets that have all pairs of places between them."""
    from_, to = min(a for a, _ in ends), max(b for _, b in ends)
    targets = np.searchsorted(search.place, from_, "right") - 1, np.searchsorted(search.place, to)
    return BeadCut(first + int(targets[0]), first + int(targets[1]) + 1)
