"""Chunks that are run while others are still planned, by processes that would wait for them.

    ahead = RunsAhead(shared)
    ahead.next_task(planned, here=True)   # as cell.processes.work_round.Aside; .done(task, result)
    ahead.join_of(k, before, bead)        # how the first bead of chunk k follows on what was welded before
    ahead.run_of(k, run)                  # what became of the chunk when it was run

As long as no bead is lost and no travel missing, the part is likely to be run as its chunks are planned: each is joined
to the one before and run. What was done ahead counts only where the plan came out with the same beads and ways, to the
object; otherwise it is done again. So it changes nothing but the time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..failure import Failure
from ..planning.assemble import RunBeads
from ..planning.bead_outcome import BeadPlan
from ..planning.bead_plan import reduced_budget
from ..planning.bead_runs import PartPlan, PlannedRun
from ..planning.edges.edge_check import Stretch
from ..planning.travels.home import (
    FoundHomeTravels,
    FoundHomeWay,
    HomeTravels,
    search_from_home,
    search_to_home,
)
from ..planning.travels.travel import TravelPath
from ..processes.work_round import Task
from ..processes.worker import Tick
from .chunk_run import ChunkRun, run_chunk
from .chunking import Shared
from .joins import JoinedBead, join_to, turns_between

FROM_HOME, TO_HOME = "from home", "to home"
# what the arm is too near to at home, and the way or why there is none: without the bead, which need not be sent back
_FoundWay = tuple[Failure | None, TravelPath | Failure | None]


@dataclass(frozen=True, eq=False)
class _PlannedChunk:
    """A chunk as it was planned.

    Attributes:
        before: what is welded last before it; None where nothing is.
        plan: its plan.
        home: the ways from home and back that belong to it; None where the part is not run from home.
    """

    before: Stretch | None
    plan: PartPlan
    home: HomeTravels | None

    def run(self, join: JoinedBead | None) -> RunBeads | None:
        """What is run if its first bead follows as it was planned; None where that does not."""
        ways, before = self.plan.travels, None
        if self.before is not None and join is not None:
            if join.bead is not None or join.way is None or isinstance(join.way, Failure):
                return None
            ways, before = (join.way, *ways), (self.before.first, self.before.stop - 1)
        return RunBeads(tuple(self.plan.stretches), ways, before, self.home)


@dataclass(frozen=True, eq=False)
class _Ahead:
    """What was done of a chunk."""

    join: JoinedBead | None
    run: ChunkRun | None


class RunsAhead:
    """What is done ahead of its turn for one part."""

    def __init__(self, shared: Shared) -> None:
        """Nothing is done yet.

        Args:
            shared: the part and what it is planned with.
        """
        span = shared.context.span
        self._goes_home = span.start is not None or span.end is not None
        self._home: dict[str, FoundHomeWay | None] = {}  # ways that are searched; None until one has come
        self._chunks: dict[int, _PlannedChunk] = {}  # that are run
        self._found: dict[int, _Ahead] = {}

    def next_task(self, planned: Sequence[PlannedRun | None], *, here: bool) -> Task | None:
        """What can be done by now.

        Args:
            planned: the chunks, in order; None of those that are not planned yet.
            here: in this process, which begins with the last chunks; others begin with the first.

        Returns:
            It; None where nothing can be.
        """
        if not all(one is None or _holds(one) for one in planned):
            return None
        n = len(planned)
        ends = {FROM_HOME: (0, _searched_from_home), TO_HOME: (n - 1, _searched_to_home)} if self._goes_home else {}
        for way, (k, search) in ends.items():
            one = planned[k]
            if one is not None and way not in self._home:
                self._home[way] = None
                return Task(way, search, one.plan.beads[0 if way == FROM_HOME else -1], (k,))
        found = {k: self._chunk(k, planned) for k in range(n) if k not in self._chunks}
        known = {k: chunk for k, chunk in found.items() if chunk is not None}
        if not known:
            return None
        k = max(known) if here else min(known)
        self._chunks[k] = known[k]
        at_end = [way for way, (end, _) in ends.items() if end == k]
        return Task(("run", k), _run_ahead, known[k], (*range(max(k - 1, 0), k + 1), *at_end))

    def done(self, task: Task, result: object) -> None:
        """Take what came of such a task."""
        if isinstance(task.key, str) and isinstance(result, tuple):
            self._home[task.key] = FoundHomeWay(task.item, *result)
        elif isinstance(result, _Ahead) and isinstance(task.key, tuple):
            self._found[task.key[1]] = result

    @property
    def home(self) -> FoundHomeTravels | None:
        """The travels from home and back, if both were searched."""
        out, back = self._home.get(FROM_HOME), self._home.get(TO_HOME)
        return None if out is None or back is None else FoundHomeTravels(out, back)

    def join_of(self, k: int, before: Stretch, bead: BeadPlan) -> JoinedBead | None:
        """How the first bead of a chunk follows on what was welded before; None where that is not known.

        Args:
            k: which chunk.
            before: what is welded last before it.
            bead: its first bead.
        """
        found = self._found.get(k)
        if found is None or self._chunks[k].before is not before or self._chunks[k].plan.beads[0] is not bead:
            return None
        return found.join

    def run_of(self, k: int, run: RunBeads) -> ChunkRun | None:
        """What became of a chunk when it was run; None where that is not known.

        Args:
            k: which chunk.
            run: its beads and the ways to them as the plan of the part has them.
        """
        found = self._found.get(k)
        if found is None or found.run is None:
            return None
        was = self._chunks[k].run(found.join)
        return found.run if was is not None and _is_same(was, run) else None

    def _chunk(self, k: int, planned: Sequence[PlannedRun | None]) -> _PlannedChunk | None:
        """A chunk that can be run by now as it was planned."""
        mine, before, last = planned[k], planned[k - 1] if k else None, None
        if mine is None or (k and before is None):
            return None
        if before is not None:
            last = before.plan.stretches[-1]
            if turns_between(last, mine.plan).any():
                return None
        if not self._goes_home:
            return _PlannedChunk(last, mine.plan, None)
        paths: dict[str, TravelPath | None] = {FROM_HOME: None, TO_HOME: None}
        for way, end in zip(paths, (0, len(planned) - 1), strict=True):
            if end == k:
                found = self._home.get(way)
                if found is None or isinstance(found.way, Failure):
                    return None
                paths[way] = found.way
        return _PlannedChunk(last, mine.plan, HomeTravels(*paths.values()))


def _holds(one: PlannedRun) -> bool:
    """Whether nothing of a chunk is known that keeps the part from being run as it was planned."""
    return not one.lost and one.postponed is None and one.plan.whole


def _is_same(one: RunBeads, other: RunBeads) -> bool:
    """Whether two runs have the same beads and ways, to the object."""
    homes = [(run.home.out, run.home.back) if run.home is not None else None for run in (one, other)]
    same_home = homes[0] is homes[1] is None or (
        homes[0] is not None and homes[1] is not None and _are_same(homes[0], homes[1])
    )
    return (
        same_home
        and one.before == other.before
        and _are_same(one.stretches, other.stretches)
        and _are_same(one.travels, other.travels)
    )


def _are_same(some: Sequence[object], others: Sequence[object]) -> bool:
    return len(some) == len(others) and all(a is b for a, b in zip(some, others, strict=True))


def _searched_from_home(shared: Shared, first: BeadPlan, _: Tick) -> _FoundWay:
    found = search_from_home(shared.context, first)
    return found.at_home, found.way


def _searched_to_home(shared: Shared, last: BeadPlan, _: Tick) -> _FoundWay:
    found = search_to_home(shared.context, last)
    return found.at_home, found.way


def _run_ahead(shared: Shared, chunk: _PlannedChunk, _: Tick) -> _Ahead:
    """Join a chunk to the one before and run it, if it follows as it was planned."""
    join = None
    if chunk.before is not None:
        join = join_to(reduced_budget(shared.context), chunk.before, chunk.plan.beads[0])
    run = chunk.run(join)
    return _Ahead(join, None if run is None else run_chunk(shared, run))
