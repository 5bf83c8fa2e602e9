"""Whether one of the last beads of a part cannot be welded: examined before much is spent on the others.

    found = loss_ahead(context, last_beads(firsts, stop))
    found.lost                    # a bead that cannot be welded, as what is known of it by then; None: none was found
    found.not_cut                 # beads that were looked at in vain

The last beads have the most obstacles. A quick search of a few of them costs a fraction of one search for a travel. If
it finds no path for a bead, the targets are checked by themselves, and the bead is tested for a cut. The result depends
on the beads alone, not on what is planned before them, and is kept as long as the context.

Metres and radians.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from weakref import WeakKeyDictionary

from .bead_outcome import BeadPlan
from .context import Context
from .cuts.bead_cut import cut_bead, may_be_cut
from .edges.edge_check import SearchedBead
from .infeasible_part import (
    LOOKED_AT,
    LOOKED_AT_CLOSELY,
    TRIED_FIRST,
    lost_alone,
    lost_bead,
    most_hit,
)
from .station_search import Ends, StationSearch
from .unreachable import unreachable

MOST_TARGETS = 300  # of a bead that is looked at: the quick search of one of more is no small matter
Beads = tuple[tuple[int, int], ...]  # the first target of each, and one past its last


@dataclass(frozen=True, eq=False)
class LossAhead:
    """The result for the last beads.

    Attributes:
        lost: one that cannot be welded; None where none was found.
        not_cut: those of which it was looked whether they are cut, and no cut was found.
    """

    lost: BeadPlan | None = None
    not_cut: Beads = ()


_known: WeakKeyDictionary[Context, dict[Beads, LossAhead]] = WeakKeyDictionary()


def last_beads(firsts: Sequence[int], stop: int) -> Beads:
    """The last beads of a part, as many as are looked at.

    Args:
        firsts: the first target of each of its beads.
        stop: one past the last target.
    """
    return tuple(pairwise([*firsts[-LOOKED_AT:], stop]))


def loss_ahead(context: Context, beads: Beads) -> LossAhead:
    """Whether one of the last beads is found to be lost.

    Args:
        context: what the search needs.
        beads: from :func:`last_beads`.

    Returns:
        What was found.
    """
    known = _known.setdefault(context, {})
    if beads not in known:
        known[beads] = _looked_for(context, beads)
    return known[beads]


def _looked_for(context: Context, beads: Beads) -> LossAhead:
    not_cut: list[tuple[int, int]] = []
    for first, stop in sorted(beads, key=lambda bead: (bead[1] - bead[0], -bead[0])):
        if stop - first > MOST_TARGETS or not may_be_cut(context, first, stop):
            continue
        search = StationSearch(SearchedBead.of(context, first, stop), context.settings.roll_step, Ends())
        if search.run() is not None:
            continue
        failures = unreachable(context, range(first, stop))
        failures = failures or lost_alone(context, [first + int(i) for i in most_hit(search)[:TRIED_FIRST]])
        if failures:
            return LossAhead(lost_bead(first, stop, failures))
        near = search.cut_between()
        if not near or len(not_cut) == LOOKED_AT_CLOSELY:
            continue
        cut = cut_bead(context, first, stop, near)
        if cut is not None:
            return LossAhead(cut)
        not_cut.append((first, stop))
    return LossAhead(None, tuple(not_cut))
