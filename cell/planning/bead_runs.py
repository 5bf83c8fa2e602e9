"""Runs of beads that are planned one after the other, and their plans: the data that processes exchange.

    run = BeadRun(firsts, stop, q_before)       # the task
    planned.plan, planned.lost, planned.postponed      # a PlannedRun: what became of it
    plan.beads, plan.travels                    # a PartPlan, of a run or of the whole part

Metres, radians, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from ik.chain import Floats

from ..failure import Failure
from .bead_outcome import BeadPlan
from .edges.edge_check import Stretch
from .infeasible_part import DoubtfulBead, Judged
from .loss_ahead import Beads
from .travels.travel import TravelPath

HomePaths = tuple[TravelPath | None, TravelPath | None]  # from home to the first bead, and from the last one back


@dataclass(frozen=True, eq=False)
class PartPlan:
    """The plan of a part, or of a run of its beads.

    Attributes:
        beads: in order.
        travels: to each whole bead from the one before.
        travel_failures: failures of travels, by the target that begins a bead to which none leads.
        home: straight ways from home to the first bead and from the last one back, where they were found beside the
            travels.
    """

    beads: tuple[BeadPlan, ...]
    travels: tuple[TravelPath, ...]
    travel_failures: dict[int, Failure]
    home: HomePaths = (None, None)

    @property
    def whole(self) -> bool:
        """Whether all of it can be run through."""
        return not self.travel_failures and all(bead.whole for bead in self.beads)

    @property
    def stretches(self) -> list[Stretch]:
        """All that can be run through, in order."""
        return [stretch for bead in self.beads for stretch in bead.stretches]


@dataclass(frozen=True, eq=False)
class PostponedRun:
    """A run up to its first postponed bead.

    Attributes:
        plan: of the beads before it.
        judged: what was spent on these, and what was learned.
    """

    plan: PartPlan
    judged: Judged


@dataclass(frozen=True, eq=False)
class BeadRun:
    """Beads to be planned one after the other.

    Attributes:
        firsts: first target of each.
        stop: one past the last target of the last.
        q_before: where the arm comes from, (j,), rad, or None.
        reduced: whether travels are searched with few attempts from the beginning.
        share: of what the whole part may cost where it is lost.
        begun: where to go on; None: at the first bead.
        full_searches: how many postponed beads may be searched in full, from there on.
        lost: whether the part is known to be lost.
        last: the last beads of the part, looked at before a travel is searched; those of other runs may be among them.
    """

    firsts: tuple[int, ...]
    stop: int
    q_before: Floats | None
    reduced: bool = False
    share: float = 1.0
    begun: PostponedRun | None = None
    full_searches: int = 0
    lost: bool = False
    last: Beads = ()

    @property
    def done(self) -> int:
        """How many of the beads are planned already."""
        return 0 if self.begun is None else len(self.begun.plan.beads)

    @property
    def beads_left(self) -> int:
        """How many beads are to be planned."""
        return len(self.firsts) - self.done

    @property
    def targets_left(self) -> int:
        """How many targets these have."""
        return self.stop - self.firsts[self.done]


@dataclass(frozen=True, eq=False)
class PlannedRun:
    """The plan of a run.

    Attributes:
        plan: of its beads; of a run that went on from a postponed one, up to the next.
        lost: whether a bead is known not to come out whole.
        postponed: the run up to the first bead that was postponed; None where none was.
        doubtful: the beads that were postponed.
        ahead: a bead of this run or a later one that was found to be lost before it was come to.
        not_cut: beads of which it was looked ahead in vain whether they are cut.
    """

    plan: PartPlan
    lost: bool
    postponed: PostponedRun | None
    doubtful: tuple[DoubtfulBead, ...] = ()
    ahead: BeadPlan | None = None
    not_cut: Beads = ()

    def has(self, bead: BeadPlan) -> bool:
        """Whether a bead is one of this run."""
        return any(bead.first == other.first for other in self.plan.beads)

    def with_bead(self, bead: BeadPlan) -> PlannedRun:
        """The same with a bead that is known to be lost in the place of one that was left open."""
        beads = tuple(bead if bead.first == other.first else other for other in self.plan.beads)
        return replace(self, plan=replace(self.plan, beads=beads), lost=True)
