"""The plan of a part whose chunks are planned side by side.

    plan = plan_in_chunks(Shared(job, context), Chunking(), progress)

There are three steps, each with the same result however many processes there are.
The chunks are planned, each from a beginning that was chosen before (see
``cell.part_chunks.chunk_starts``). The chunks are joined: from the end of each to the beginning of the next, and on
until a bead ends as it was planned. Travels are searched with few attempts up to here; where nothing but travels stops
the part, those that were not found are searched with all attempts, in order, until one is not found for good.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ..failure import Failure
from ..job.job import Job
from ..planning.bead_outcome import BeadPlan
from ..planning.bead_plan import reduced_budget
from ..planning.context import Context
from ..planning.edges.edge_check import Stretch
from ..planning.part_plan import BeadRun, PartPlan, PlannedRun, plan_part, plan_run, plan_runs, travel_failure
from ..planning.travels.home import FoundHomeTravels, search_home_travels
from ..planning.travels.travel import TravelPath
from ..processes.worker import Tick
from ..processes.worker_pool import WorkerPool
from ..progress import Progress
from .chunk_starts import beginnings
from .chunking import Chunk, pool_for_chunks
from .joins import JoinedBead, join_to, same_end, turned_to_chunk_before


@dataclass(frozen=True, eq=False)
class Shared:
    """What every chunk needs.

    Attributes:
        job: the part.
        context: what it is planned with.
    """

    job: Job
    context: Context

    @classmethod
    def of(cls, job: Job, context: Context) -> Shared:
        """Without what only reports ask for: it is sent to other processes."""
        return cls(replace(job, sliced=(), beads=()), context)


@dataclass(frozen=True, eq=False)
class ChunkedPlan:
    """The plan of a part.

    Attributes:
        plan: the plan.
        home: the travels from home and back, where they are known by then.
    """

    plan: PartPlan
    home: FoundHomeTravels | None = None


def plan_in_chunks(
    shared: Shared,
    chunks: Sequence[Chunk],
    progress: Progress | None = None,
    meanwhile: Callable[[], object] | None = None,
) -> ChunkedPlan:
    """Plan a part chunk by chunk, side by side where there are workers.

    Args:
        shared: the part and what it is planned with.
        chunks: from :class:`cell.part_chunks.chunking.Chunking`.
        progress: called with how far it is.
        meanwhile: what this process does first while workers plan, where the part has several chunks.

    Returns:
        The plan; of a part in one chunk, what ``plan_part`` gives, and no travels from home.
    """
    context = shared.context
    if len(chunks) == 1:
        return ChunkedPlan(plan_part(context, shared.job.targets.bead, progress))
    workers = pool_for_chunks(chunks)
    workers.get_ready(shared, len(chunks), copies=False)
    known, q_before = beginnings(context, chunks)
    workers.get_ready(shared, len(chunks))  # before a bar is shown, which has a thread of its own
    share = 1 / len(chunks)
    runs = [
        BeadRun(
            chunk.firsts, chunk.stop, q, known if chunk is chunks[0] else None, True, share, lost=not known.bead.whole
        )
        for chunk, q in zip(chunks, q_before, strict=True)
    ]

    def planned(some: Sequence[BeadRun], count: Tick) -> list[PlannedRun]:
        aside = meanwhile if some is runs else None
        return workers.run(_planned, shared, some, count, [run.targets_left for run in some], aside)

    return join_chunks(shared, plan_runs(runs, planned, progress), workers)


def join_chunks(shared: Shared, plans: Sequence[PartPlan], workers: WorkerPool | None = None) -> ChunkedPlan:
    """Make plans of chunks the plan of the part.

    Args:
        shared: the part and what it is planned with.
        plans: of its chunks, in order.
        workers: who planned them; this process where left out.

    Returns:
        The plan.
    """
    return _Joining(shared, plans, workers or WorkerPool(1)).plan()


def _planned(shared: Shared, run: BeadRun, tick: Tick) -> PlannedRun:
    return plan_run(shared.context, run, tick)


def _joined(shared: Shared, ends: tuple[Stretch, BeadPlan], _: Tick) -> JoinedBead:
    return join_to(reduced_budget(shared.context), *ends)


class _Joining:
    """Chunks made one plan."""

    def __init__(self, shared: Shared, plans: Sequence[PartPlan], workers: WorkerPool) -> None:
        self.shared, self.context, self.workers = shared, shared.context, workers
        self.beads: list[BeadPlan] = []
        self.travels: dict[int, TravelPath] = {}  # by the first target of the bead that they lead to
        self.travel_failures: dict[int, Failure] = {}
        self.joins: list[int] = []  # the first bead of each chunk after the first that is to be led to
        for plan in plans:
            if plan.stretches and any(bead.stretches for bead in self.beads):
                plan = turned_to_chunk_before(self.context, self._before(len(self.beads)), plan)
            begins = next((k for k, bead in enumerate(plan.beads) if bead.stretches), None)
            if begins is not None and plan.beads[begins].whole and any(bead.stretches for bead in self.beads):
                self.joins.append(len(self.beads) + begins)
            self.travels.update(_travels_of(plan))
            self.beads += plan.beads
            self.travel_failures.update(plan.travel_failures)

    def plan(self) -> ChunkedPlan:
        """The plan of the part."""
        home: list[FoundHomeTravels] = []
        span, first, last = self.context.span, self.beads[0], self.beads[-1]

        def search_travels() -> None:
            """While workers lead from chunk to chunk, which seldom changes the part's last bead."""
            if not self.travel_failures and all(bead.whole for bead in self.beads):
                home.append(search_home_travels(self.context, first, last))

        befores = {k: self._before(k) for k in self.joins}
        ends = [(befores[k], self.beads[k]) for k in self.joins]
        goes_home = span.start is not None or span.end is not None
        found = self.workers.run(_joined, self.shared, ends, meanwhile=search_travels if goes_home else None)
        reduced = reduced_budget(self.context)
        for k, join in zip(self.joins, found, strict=True):
            # one that led on from another end is found once more
            self._continue_at(k, reduced, join if self._before(k) is befores[k] else None)
        if all(bead.whole for bead in self.beads):
            self._search_on()
        travels = tuple(self.travels[bead.first] for bead in self.beads if bead.first in self.travels)
        plan = PartPlan(tuple(self.beads), travels, dict(sorted(self.travel_failures.items())))
        return ChunkedPlan(plan, home[0] if home else None)

    def _search_on(self) -> None:
        """Search travels that were not found with all attempts, as long as the part may be whole."""
        self.joins = []  # from here on a chunk is led to like any other bead
        for k, bead in enumerate(self.beads):
            if bead.first in self.travel_failures:
                self._continue_at(k, self.context, None)
                if bead.first in self.travel_failures:
                    break

    def _before(self, k: int) -> Stretch:
        """What is welded last before a bead."""
        return next(bead.stretches[-1] for bead in reversed(self.beads[:k]) if bead.stretches)

    def _continue_at(self, k: int, context: Context, join: JoinedBead | None) -> None:
        """Lead to a bead, and on to those after it until one ends as it was planned, or with the chunk."""
        begun = k
        while k < len(self.beads) and (k == begun or k not in self.joins):
            bead = self.beads[k]
            if not bead.whole:
                if bead.stretches:
                    return  # what comes after it was led to from there
                k += 1
                continue
            last = self._before(k)
            join = join or join_to(context, last, bead)
            self.travel_failures.pop(bead.first, None)
            self.travels.pop(bead.first, None)
            if isinstance(join.way, Failure):
                self.travel_failures[bead.first] = travel_failure(join.way, last, bead.first)
            else:
                self.travels[bead.first] = join.way
            new = join.bead or bead
            self.beads[k] = new
            if same_end(new, bead):
                return
            join = None
            k += 1


def _travels_of(plan: PartPlan) -> dict[int, TravelPath]:
    """The travels of a plan by the first target of the bead that they lead to."""
    travels = iter(plan.travels)
    out: dict[int, TravelPath] = {}
    begun = False
    for bead in plan.beads:
        if begun and bead.whole and bead.first not in plan.travel_failures:
            out[bead.first] = next(travels)
        begun = begun or bool(bead.stretches)
    return out
