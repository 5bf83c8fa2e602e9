"""Chunks run ahead of their turn: the same is found, and what does not fit the plan any more does not count."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.jobs.layered_boss import WALL, context_of, found_in, layered_job, mark

from cell.job.job import Job
from cell.part_chunks.chunked_plan import plan_in_chunks
from cell.part_chunks.chunking import Chunking, Shared
from cell.part_chunks.runs_ahead import RunsAhead
from cell.planning.assemble import RunBeads
from cell.planning.part_plan import PlannedRun, PostponedRun
from cell.planning.travels.home import HomeTravels
from cell.processes.work_round import Aside
from cell.processes.worker import Tick
from cell.processes.worker_pool import WorkerPool
from cell.verdict.check import check_span

FEW = Chunking(0, 8)  # four chunks of ten beads


@pytest.fixture(scope="module")
def job() -> Job:
    return layered_job()


@pytest.fixture(scope="module")
def shared(job: Job) -> Shared:
    return Shared.of(job, context_of(job))


@pytest.fixture(scope="module")
def planned(shared: Shared) -> list[PlannedRun]:
    """The chunks, each planned."""
    found: list[PlannedRun] = []

    class Kept(WorkerPool):
        def run(self, function: Any, *given: Any, **_: Any) -> list[Any]:
            got = super().run(function, *given)
            found.extend(one for one in got if isinstance(one, PlannedRun))
            return got

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("cell.part_chunks.chunked_plan.pool_for_chunks", lambda _: Kept(1))
        plan_in_chunks(shared, FEW.chunks(shared.job.targets, shared.context.span))
    assert len(found) == 4
    return found


class Eager(WorkerPool):
    """Does all that can be done aside as soon as it can be, and sends everything as to a worker and back."""

    def __init__(self, order: Sequence[int], aside: list[Any]) -> None:
        """As the chunks are planned, and where the names of what is done aside go."""
        super().__init__(2)
        self.order, self.aside = order, aside

    def get_ready(self, shared: object, count: int, *, copies: bool = True) -> None:
        """Nobody has to."""

    def run(
        self,
        function: Any,
        shared: Any,
        items: Any,
        tick: Tick | None = None,
        sizes: Sequence[float] | None = None,
        meanwhile: Callable[[], object] | Aside | None = None,
    ) -> list[Any]:
        there, found = pickle.loads(pickle.dumps(shared)), [None] * len(items)

        def done(function: Any, item: Any) -> Any:
            return pickle.loads(pickle.dumps(function(there, pickle.loads(pickle.dumps(item)), tick or int)))

        first = [done(function, items[0])] if isinstance(meanwhile, Aside) else []  # which is there already
        if meanwhile is not None:
            meanwhile()
        for k in self.order if len(items) == len(self.order) else range(len(items)):
            found[k] = first.pop() if k == 0 and first else done(function, items[k])
            while isinstance(meanwhile, Aside) and (task := meanwhile.next_task(found, here=True)) is not None:
                self.aside.append(task.key)
                meanwhile.done(task, done(task.function, task.item))
        return found


@pytest.mark.parametrize("order", [pytest.param((0, 1, 2, 3), marks=pytest.mark.slow), (3, 1, 0, 2)])
def test_what_is_run_ahead_is_what_is_found_in_turn(
    job: Job, order: tuple[int, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    here = mark(found_in(job, FEW))
    aside: list[Any] = []
    in_turn: list[object] = []
    monkeypatch.setattr("cell.part_chunks.chunking.pool", lambda **_: Eager(order, aside))
    monkeypatch.setattr("cell.part_chunks.chunked_run.run_chunk", lambda *given: in_turn.append(given))
    assert mark(found_in(job, FEW)) == here
    # each once, and nothing again
    assert sorted(map(str, aside)) == [*(f"('run', {k})" for k in range(4)), "from home", "to home"]
    assert not in_turn


@pytest.mark.slow
def test_nothing_is_run_ahead_of_a_part_that_is_not_run(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    aside: list[Any] = []
    monkeypatch.setattr("cell.part_chunks.chunking.pool", lambda **_: Eager((0, 1, 2, 3), aside))
    lost = layered_job(fixtures=[WALL])
    assert found_in(lost, FEW).motion is None
    steep = layered_job(checks={"gravity_max_deg": 10})
    for angle in (np.deg2rad(9.0), np.deg2rad(11.0)):
        assert not aside
        found = check_span(steep, context_of(steep), np.full(len(steep.targets), angle), None, FEW)
        assert (found.motion is None) == (angle > np.deg2rad(10.0))
        assert bool(aside) == (found.motion is not None)
        aside.clear()


def test_an_error_ahead_comes_up_in_its_turn(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    class Blind(Eager):
        """All that is done aside fails."""

        def run(self, *given: Any, **named: Any) -> list[Any]:
            aside = named.get("meanwhile", given[5] if len(given) > 5 else None)
            if isinstance(aside, Aside):
                monkeypatch.setattr(aside, "done", lambda *_: None)
            return super().run(*given, **named)

    here = mark(found_in(job, FEW))
    monkeypatch.setattr("cell.part_chunks.chunking.pool", lambda **_: Blind((0, 1, 2, 3), []))
    assert mark(found_in(job, FEW)) == here


def ahead_of(shared: Shared, planned: Sequence[PlannedRun | None]) -> RunsAhead:
    """All that can be done with these plans."""
    ahead = RunsAhead(shared)
    while (task := ahead.next_task(planned, here=True)) is not None:
        ahead.done(task, task.function(shared, task.item, int))
    return ahead


def runs_of(ahead: RunsAhead, planned: Sequence[PlannedRun]) -> list[RunBeads]:
    """What is run of chunks that follow as they were planned."""
    assert ahead.home is not None
    out: list[RunBeads] = []
    for k, one in enumerate(planned):
        ways, before = one.plan.travels, None
        if k:
            last = planned[k - 1].plan.stretches[-1]
            join = ahead.join_of(k, last, one.plan.beads[0])
            assert join is not None
            ways, before = (join.way, *ways), (last.first, last.stop - 1)  # type: ignore[assignment]
        home = HomeTravels(ahead.home.out.way if k == 0 else None, ahead.home.back.way if k == 3 else None)  # type: ignore[arg-type]
        out.append(RunBeads(tuple(one.plan.stretches), ways, before, home))
    return out


def test_what_was_run_counts_for_the_same_beads_and_ways_alone(shared: Shared, planned: list[PlannedRun]) -> None:
    ahead = ahead_of(shared, planned)
    runs = runs_of(ahead, planned)
    for k, run in enumerate(runs):
        assert ahead.run_of(k, run) is not None
        assert ahead.run_of(k, replace(run, stretches=run.stretches[:-1])) is None
        copied = replace(run.stretches[0])
        assert ahead.run_of(k, replace(run, stretches=(copied, *run.stretches[1:]))) is None
        assert ahead.run_of(k, replace(run, travels=(run.travels[0]._replace(), *run.travels[1:]))) is None
        assert ahead.run_of(k, replace(run, before=(0, 1))) is None
        assert ahead.run_of(k, replace(run, home=None)) is None
    first, last = runs[0].home, runs[3].home
    assert first is not None
    assert last is not None
    assert first.out is not None
    assert last.back is not None
    assert ahead.run_of(0, replace(runs[0], home=HomeTravels(first.out._replace(), None))) is None
    assert ahead.run_of(3, replace(runs[3], home=HomeTravels(None, last.back._replace()))) is None


def test_a_join_counts_for_the_same_ends_alone(shared: Shared, planned: list[PlannedRun]) -> None:
    ahead = ahead_of(shared, planned)
    last, bead = planned[0].plan.stretches[-1], planned[1].plan.beads[0]
    assert ahead.join_of(1, last, bead) is not None
    assert ahead.join_of(1, replace(last), bead) is None
    assert ahead.join_of(1, last, replace(bead)) is None
    assert ahead_of(shared, [None] * 4).join_of(1, last, bead) is None


def test_a_chunk_waits_for_what_it_is_made_from(shared: Shared, planned: list[PlannedRun]) -> None:
    def keys(some: Sequence[PlannedRun | None]) -> list[Any]:
        ahead, out = RunsAhead(shared), []
        while (task := ahead.next_task(some, here=False)) is not None:
            out.append((task.key, task.after))
        return out

    a, b, c, d = planned
    out, back = ("from home", (0,)), ("to home", (3,))
    assert keys([None, None, None, None]) == []
    # those at the ends wait for the ways home, which are not given here
    assert keys([a, None, c, None]) == [out]
    assert keys([None, b, None, d]) == [back]
    assert keys([a, b, None, None]) == [out, (("run", 1), (0, 1))]
    assert keys([a, None, c, d]) == [out, back]
    assert keys([a, b, c, d]) == [out, back, (("run", 1), (0, 1)), (("run", 2), (1, 2))]
    for some, k, way in (([a, None, None, None], 0, "from home"), ([None, None, c, d], 3, "to home")):
        found = RunsAhead(shared)
        task = found.next_task(some, here=True)
        assert task is not None
        assert task.key == way
        found.done(task, task.function(shared, task.item, int))
        assert found.home is None  # until both are known
        end = found.next_task(some, here=True)
        assert end is not None
        assert (end.key, end.after) == (("run", k), (*range(max(k - 1, 0), k + 1), way))
    # this process begins with the last, others with the first
    for here, k in ((True, 2), (False, 1)):
        ahead = RunsAhead(shared)
        tasks = [ahead.next_task([a, b, c, None], here=here) for _ in range(2)]
        assert [None if task is None else task.key for task in tasks] == ["from home", ("run", k)]


def test_nothing_is_done_once_something_is_lost_postponed_or_turned(shared: Shared, planned: list[PlannedRun]) -> None:
    a, b, _, d = planned
    assert a.plan.whole
    for other in (
        replace(d, lost=True),
        replace(d, postponed=PostponedRun(d.plan, None)),  # type: ignore[arg-type]
        replace(d, plan=replace(d.plan, travel_failures={d.plan.beads[1].first: None})),  # type: ignore[dict-item]
    ):
        assert RunsAhead(shared).next_task([a, b, None, other], here=True) is None
    # a chunk that is to be turned by whole turns is turned first
    turn = np.eye(shared.context.solver.chain.n)[-1] * 2 * np.pi
    first, *rest = b.plan.beads
    stretch = replace(first.stretches[0], q_targets=first.stretches[0].q_targets + turn)
    turned = replace(b, plan=replace(b.plan, beads=(replace(first, stretches=(stretch,)), *rest)))
    for second, key in ((turned, None), (b, ("run", 1))):
        ahead = RunsAhead(shared)
        tasks = [ahead.next_task([a, second, None, None], here=True) for _ in range(2)]
        assert [task and task.key for task in tasks] == ["from home", key]
