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
from ..planning.bead_outcome import BeadPlan
from ..planning.bead_plan import reduced_budget
from ..planning.bead_runs import BeadRun, PartPlan, PlannedRun
from ..planning.context import Context
from ..planning.edges.edge_check import Stretch
from ..planning.loss_ahead import last_beads
from ..planning.part_plan import plan_part, plan_run, plan_runs, travel_failure
from ..planning.travels.home import FoundHomeTravels, search_home_travels
from ..planning.travels.travel import TravelPath
from ..processes.work_round import Aside, Task
from ..processes.worker import Tick
from ..processes.worker_pool import WorkerPool
from ..progress import Progress
from .chunk_starts import beginnings
from .chunking import Chunk, Shared, pool_for_chunks
from .joins import JoinedBead, join_to, same_end, turned_to_chunk_before
from .runs_ahead import RunsAhead


@dataclass(frozen=True, eq=False)
class ChunkedPlan:
    """The plan of a part.

    Attributes:
        plan: the plan.
        home: the travels from home and back, where they are known by then.
        ahead: chunks that have been run already, as they were planned.
    """

    plan: PartPlan
    home: FoundHomeTravels | None = None
    ahead: RunsAhead | None = None


class _BesidePlanning(Aside):
    """What is done beside the planning of chunks: where the arm comes from to each, and runs ahead."""

    early = 1  # a worker plans the first chunk before that is known of the others
    both_ends = True  # what is laid by then is much the same in neighbours, and so are the covers of it

    def __init__(self, shared: Shared, chunks: Sequence[Chunk], meanwhile: Callable[[], object] | None) -> None:
        self.ahead, self._worth_it = RunsAhead(shared), False
        self._context, self._chunks, self._meanwhile = shared.context, chunks, meanwhile
        share, start, last = 1 / len(chunks), shared.context.span.start, last_beads(chunks[-1].firsts, chunks[-1].stop)
        self.runs = [BeadRun(chunk.firsts, chunk.stop, start, reduced=True, share=share, last=last) for chunk in chunks]

    def __call__(self) -> None:
        q_before = beginnings(self._context, self._chunks)
        self.runs[1:] = [replace(run, q_before=q) for run, q in zip(self.runs[1:], q_before, strict=True)]
        self._worth_it = self._meanwhile is None or bool(self._meanwhile())

    def next_task(self, found: Sequence[PlannedRun | None], *, here: bool) -> Task | None:
        return self.ahead.next_task(found, here=here) if self._worth_it else None

    def done(self, task: Task, result: object) -> None:
        self.ahead.done(task, result)


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
        meanwhile: what this process does first while workers plan, where the part has several chunks; tells whether
            a plan that holds is going to be run.

    Returns:
        The plan; of a part in one chunk, what ``plan_part`` gives, and no travels from home.
    """
    context = shared.context
    if len(chunks) == 1:
        return ChunkedPlan(plan_part(context, shared.job.targets.bead, progress))
    workers = pool_for_chunks(chunks)
    workers.get_ready(shared, len(chunks))  # before a bar is shown, which has a thread of its own
    beside = _BesidePlanning(shared, chunks, meanwhile)

    def planned(some: Sequence[BeadRun], count: Tick) -> list[PlannedRun]:
        if some is not beside.runs:
            return workers.run(_planned, shared, some, count, [run.targets_left for run in some])
        return workers.run(_planned, shared, some, count, None, beside)

    return join_chunks(shared, plan_runs(context, beside.runs, planned, progress), workers, beside.ahead)


def join_chunks(
    shared: Shared,
    plans: Sequence[PartPlan],
    workers: WorkerPool | None = None,
    ahead: RunsAhead | None = None,
) -> ChunkedPlan:
    """Make plans of chunks the plan of the part.

    Args:
        shared: the part and what it is planned with.
        plans: of its chunks, in order.
        workers: who planned them; this process where left out.
        ahead: chunks that were joined and run as they were planned.

    Returns:
        The plan.
    """
    return _Joining(shared, plans, workers or WorkerPool(1), ahead or RunsAhead(shared)).plan()


def _planned(shared: Shared, run: BeadRun, tick: Tick) -> PlannedRun:
    return plan_run(shared.context, run, tick)


def _joined(shared: Shared, ends: tuple[Stretch, BeadPlan], _: Tick) -> JoinedBead:
    return join_to(reduced_budget(shared.context), *ends)


def _joined_straight(shared: Shared, ends: tuple[Stretch, BeadPlan], _: Tick) -> JoinedBead:
    return join_to(shared.context, *ends, straight=True)


class _Joining:
    """Chunks made one plan."""

    def __init__(self, shared: Shared, plans: Sequence[PartPlan], workers: WorkerPool, ahead: RunsAhead) -> None:
        self.shared, self.context, self.workers, self.ahead = shared, shared.context, workers, ahead
        self.beads: list[BeadPlan] = []
        self.travels: dict[int, TravelPath] = {}  # by the first target of the bead that they lead to
        self.travel_failures: dict[int, Failure] = {}
        self.joins: list[int] = []  # the first bead of each chunk after the first that is to be led to
        self.chunk: dict[int, int] = {}  # the chunks that they begin
        lost = not all(bead.whole for plan in plans for bead in plan.beads)
        self.straight = lost and not self.context.settings.every_target  # travels that are looked for alone
        for n, plan in enumerate(plans):
            if plan.stretches and any(bead.stretches for bead in self.beads):
                plan = turned_to_chunk_before(self.context, self._before(len(self.beads)), plan)
            begins = next((k for k, bead in enumerate(plan.beads) if bead.stretches), None)
            if begins is not None and plan.beads[begins].whole and any(bead.stretches for bead in self.beads):
                self.joins.append(len(self.beads) + begins)
                self.chunk[self.joins[-1]] = n
            self.travels.update(_travels_of(plan))
            self.beads += plan.beads
            self.travel_failures.update(plan.travel_failures)

    def plan(self) -> ChunkedPlan:
        """The plan of the part."""
        span, first, last, home = self.context.span, self.beads[0], self.beads[-1], self.ahead.home

        def search_travels() -> None:
            """While workers lead from chunk to chunk, which seldom changes the part's last bead."""
            nonlocal home
            if not self.travel_failures and all(bead.whole for bead in self.beads):
                home = search_home_travels(self.context, first, last)

        goes_home = span.start is not None or span.end is not None
        befores = {k: self._before(k) for k in self.joins}
        joins = {k: self.ahead.join_of(self.chunk[k], befores[k], self.beads[k]) for k in self.joins}
        open_ = [k for k, join in joins.items() if join is None]
        ends = [(befores[k], self.beads[k]) for k in open_]
        joined = _joined_straight if self.straight else _joined
        aside = search_travels if goes_home and home is None else None
        joins.update(zip(open_, self.workers.run(joined, self.shared, ends, meanwhile=aside), strict=True))
        reduced = reduced_budget(self.context)
        for k, join in joins.items():
            # one that led on from another end is found once more
            self._continue_at(k, reduced, join if self._before(k) is befores[k] else None)
        if all(bead.whole for bead in self.beads):
            self._search_on()
        travels = tuple(self.travels[bead.first] for bead in self.beads if bead.first in self.travels)
        plan = PartPlan(tuple(self.beads), travels, dict(sorted(self.travel_failures.items())))
        return ChunkedPlan(plan, home, self.ahead)

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
            join = join or join_to(context, last, bead, straight=self.straight)
            self.travel_failures.pop(bead.first, None)
            self.travels.pop(bead.first, None)
            if isinstance(join.way, Failure):
                self.travel_failures[bead.first] = travel_failure(join.way, last, bead.first)
            elif join.way is not None:
                self.travels[bead.first] = join.way
            else:
                bead = replace(bead, open=frozenset([bead.first]))
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
