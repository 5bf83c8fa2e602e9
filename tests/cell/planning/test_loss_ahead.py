"""A part that is lost by one of its last beads: seen before travels are searched round what is in the way."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support.jobs.layered_boss import context_of, layered_job

from cell.failure import ON_TRAVEL, Failure, Kind
from cell.job.job import Job
from cell.part_chunks.chunked_plan import plan_in_chunks
from cell.part_chunks.chunking import Chunking, Shared
from cell.planning import infeasible_part, loss_ahead, part_plan
from cell.planning.bead_outcome import BeadPlan
from cell.planning.bead_runs import BeadRun, PartPlan, PlannedRun
from cell.planning.edges.edge_check import SearchedBead, Stretch
from cell.planning.infeasible_part import InfeasiblePartJudge
from cell.planning.loss_ahead import LossAhead, last_beads
from cell.planning.neighbours import beads_ahead
from cell.planning.part_plan import plan_part, plan_runs
from cell.planning.station_search import Ends, StationSearch
from cell.planning.travels.straight_travels import BeadGap, straight_travels
from cell.planning.travels.travel import _TravelSearch

FOUR = Chunking(0, 8)


@pytest.fixture(scope="module")
def job() -> Job:
    return layered_job()


def out_of_reach(job: Job, layer: int) -> Job:
    """The same with a layer that no arm reaches."""
    t = job.targets
    return replace(job, targets=replace(t, position=t.position + np.where(t.layer[:, None] == layer, 1e5, 0.0)))


@pytest.fixture
def no_straight_travel(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """No travel is straight; the targets before which a way round is searched."""
    searched: list[int] = []
    really = _TravelSearch._around

    def noted(search: _TravelSearch, *legs: object) -> object:
        assert search.start is not None
        searched.append(search.start.first)
        return really(search, *legs)  # type: ignore[arg-type]

    straight = _TravelSearch._straight

    def none(search: _TravelSearch, *legs: object) -> object:
        straight(search, *legs)  # type: ignore[arg-type]
        search.failure = search.failure or Failure(Kind.COLLISION, place=ON_TRAVEL)
        return None

    monkeypatch.setattr(_TravelSearch, "_around", noted)
    monkeypatch.setattr(_TravelSearch, "_straight", none)
    monkeypatch.setattr(beads_ahead, "straight_travels", lambda _, gaps, **__: [None] * len(gaps))
    monkeypatch.setattr(part_plan, "straight_travel", lambda *_: None)
    monkeypatch.setattr("cell.part_chunks.joins.straight_travel", lambda *_: None)
    return searched


def planned(job: Job, chunking: Chunking | None) -> PartPlan:
    context = context_of(job)
    if chunking is None:
        return plan_part(context, job.targets.bead)
    return plan_in_chunks(Shared.of(job, context), chunking.chunks(job.targets, context.span)).plan


@pytest.mark.parametrize("chunking", [None, FOUR], ids=["one chunk", "four"])
def test_no_way_round_is_searched_where_a_last_bead_is_lost(job, no_straight_travel, monkeypatch, chunking):
    monkeypatch.setattr(infeasible_part, "SMALL", 0)
    plan = planned(out_of_reach(job, int(job.targets.layer.max())), chunking)
    assert no_straight_travel == []
    assert plan.beads[-1].target_failures
    assert not plan.travel_failures
    led_to = plan.beads[1:-1]
    assert all(bead.stretches and bead.open == {bead.first} for bead in led_to)  # each can be welded


def test_a_small_budget_is_left_for_travels_of_a_small_part_that_is_lost(job, no_straight_travel):
    planned(out_of_reach(job, int(job.targets.layer.max())), None)
    assert no_straight_travel


@pytest.mark.slow
def test_all_ways_round_are_searched_of_a_part_that_is_not_lost(job, no_straight_travel):
    plan = planned(job, None)
    firsts = [bead.first for bead in plan.beads]
    assert all(bead.whole for bead in plan.beads)
    assert sorted(set(no_straight_travel)) == firsts[1:]
    assert len(plan.travels) == len(firsts) - 1


def test_every_target_asks_for_every_travel(job, no_straight_travel, monkeypatch):
    monkeypatch.setattr(part_plan, "loss_ahead", lambda *_: pytest.fail("the last beads are come to in any case"))
    lost = out_of_reach(job, int(job.targets.layer.max()))
    context = context_of(lost)
    every = replace(context, settings=replace(context.settings, every_target=True))
    plan = plan_part(every, lost.targets.bead)
    assert sorted(set(no_straight_travel)) == [bead.first for bead in plan.beads[1:-1]]


def test_the_last_beads_are_looked_at_once_and_only_where_it_matters(job, no_straight_travel, monkeypatch):
    looked: list[tuple[tuple[int, int], ...]] = []
    monkeypatch.setattr(part_plan, "loss_ahead", lambda _, beads: looked.append(beads) or LossAhead())
    plan = planned(job, None)
    last = tuple((bead.first, bead.stop) for bead in plan.beads[-infeasible_part.LOOKED_AT :])
    assert looked == [last]
    monkeypatch.undo()
    monkeypatch.setattr(part_plan, "loss_ahead", lambda _, beads: looked.append(beads) or LossAhead())
    planned(job, None)
    assert len(looked) == 1  # where all travels are straight, nothing is looked at


def test_what_is_found_ahead_is_kept_with_the_context(job, monkeypatch):
    looks: list[int] = []
    really = loss_ahead._looked_for
    monkeypatch.setattr(loss_ahead, "_looked_for", lambda *given: looks.append(1) or really(*given))
    lost = out_of_reach(job, int(job.targets.layer.max()))
    context = context_of(lost)
    firsts = np.flatnonzero(np.diff(lost.targets.bead, prepend=-1)).tolist()
    beads = last_beads(firsts, len(lost.targets))
    found = [loss_ahead.loss_ahead(context, beads) for _ in range(2)]
    assert found[0].lost is not None
    assert found[0].lost.first in firsts[-3:]
    assert found[0] is found[1]
    assert looks == [1]
    assert loss_ahead.loss_ahead(context_of(job), beads).lost is None


def test_a_bead_that_comes_out_whole_was_not_lost(job):
    """Then all runs are planned again as if nothing had been looked at."""
    whole = PartPlan((BeadPlan(0, 3, (), {}, {}), BeadPlan(3, 6, (), {}, {})), (), {})
    lost = BeadPlan(3, 6, (), {}, {}, frozenset(range(3, 6)))
    asked: list[list[tuple[tuple[int, int], ...]]] = []

    def planner(runs: Sequence[BeadRun], _: Callable[[], None]) -> Iterator[PlannedRun]:
        asked.append([run.last for run in runs])
        ahead = lost if runs[0].last else None
        return [PlannedRun(whole, ahead is not None, None, (), ahead)]  # type: ignore[return-value]

    run = BeadRun((0, 3), 6, None, last=((3, 6),))
    assert plan_runs(context_of(job), [run], planner) == [whole]  # type: ignore[arg-type]
    assert asked == [[((3, 6),)], [()]]


def test_a_loss_that_one_run_sees_ahead_is_told_in_the_run_that_it_belongs_to(job):
    lost = BeadPlan(3, 6, (), {}, {}, frozenset([4, 5]))
    here = PartPlan((BeadPlan(0, 3, (), {}, {}),), (), {})
    there = PartPlan((BeadPlan(3, 6, (), {}, {}, frozenset(range(3, 6))),), (), {})

    def planner(runs: Sequence[BeadRun], _: Callable[[], None]) -> list[PlannedRun]:
        return [PlannedRun(here, True, None, (), lost), PlannedRun(there, False, None)]

    plans = plan_runs(context_of(job), [BeadRun((0,), 3, None), BeadRun((3,), 6, None)], planner)
    assert plans[1].beads == (lost,)


def test_straight_travels_are_the_same_where_few_samples_are_looked_at_first(job):
    context = context_of(job)
    stretches: list[Stretch] = planned(job, None).stretches
    gaps = [BeadGap(a, b, int(context.laid[a.stop - 1])) for a, b in pairwise(stretches)]
    usual, doubtful = straight_travels(context, gaps), straight_travels(context, gaps, doubtful=True)
    assert any(path is not None for path in usual)
    for a, b in zip(usual, doubtful, strict=True):
        assert (a is None) == (b is None)
        assert a is None or b is None or np.array_equal(a.q, b.q)
    wide = replace(context, settings=replace(context.settings, clearance=0.024))
    found = [straight_travels(wide, gaps, doubtful=doubtful) for doubtful in (False, True)]
    assert [path is None for path in found[0]] == [path is None for path in found[1]]


def test_a_quick_search_ends_when_it_has_asked_what_it_may(job):
    context = context_of(job)
    bead = SearchedBead.of(context, 0, 4)

    def search() -> StationSearch:
        return StationSearch(bead, context.settings.roll_step, Ends())

    assert search().run() is not None
    assert search().run(-1.0) is None


def test_of_a_large_part_that_is_lost_beads_are_passed_over_more_and_more(job, monkeypatch):
    """As long as those that are searched come out neither whole nor with a target that is lost."""
    monkeypatch.setattr(infeasible_part, "SMALL", 0)
    searched: list[int] = []
    context = context_of(job)

    def judge_of() -> InfeasiblePartJudge:
        judge = InfeasiblePartJudge(context, 0)
        judge.lost = True
        monkeypatch.setattr(judge, "left", lambda _: 100.0)
        return judge

    class Vain(StationSearch):
        def run(self, most: float = np.inf) -> None:
            searched.append(self.bead.first)

    monkeypatch.setattr(infeasible_part, "StationSearch", Vain)
    monkeypatch.setattr(InfeasiblePartJudge, "_judged", lambda *_: {})
    judge = judge_of()
    beads = [(4 * k, 4 * k + 4) for k in range(10)]
    for first, stop in beads:
        judge.plan(first, stop, None, lambda _: pytest.fail("searched in full"))
    assert searched == [0, 8, 20]  # one is passed over, then two, then four
    searched.clear()
    failure = infeasible_part.TargetFailure(Failure(Kind.COLLISION, place=ON_TRAVEL), None)  # type: ignore[arg-type]
    monkeypatch.setattr(InfeasiblePartJudge, "_judged", lambda *_: {3: failure})
    judge = judge_of()
    for first, stop in beads:
        judge.plan(first, stop, None, lambda _: pytest.fail("searched in full"))
    assert len(searched) <= len(beads)
    assert judge._pass_next == 0
    searched.clear()
    monkeypatch.setattr(InfeasiblePartJudge, "_judged", lambda *_: {})
    judge = judge_of()
    judge.knows_lost(BeadPlan(40, 44, (), {41: failure.failure}, {}, frozenset([42])))  # cut: as if it was the first
    for first, stop in beads:
        judge.plan(first, stop, None, lambda _: pytest.fail("searched in full"))
    assert searched == [4, 16, 36]
    judge.knows_lost(BeadPlan(40, 44, (), {}, {41: failure}, frozenset([42])))
    assert judge._pass_next == 0


def test_of_beads_that_are_found_at_once_nothing_else_is_looked_at(job, monkeypatch):
    for name in ("unreachable", "lost_alone", "cut_bead"):
        monkeypatch.setattr(loss_ahead, name, lambda *_: pytest.fail("the quick search has found it"))
    firsts = np.flatnonzero(np.diff(job.targets.bead, prepend=-1)).tolist()
    found = loss_ahead.loss_ahead(context_of(job), last_beads(firsts, len(job.targets)))
    assert found.lost is None
    assert found.not_cut == ()
