"""Postponed beads: searched in full when the rest of the part is planned."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.jobs.layered_boss import context_of, layered_job

from cell.job.job import Job
from cell.part_chunks.chunked_plan import plan_in_chunks
from cell.part_chunks.chunking import Chunking, Shared
from cell.planning import infeasible_part, part_plan
from cell.planning.bead_outcome import BeadPlan
from cell.planning.bead_runs import BeadRun, PartPlan, PlannedRun, PostponedRun
from cell.planning.infeasible_part import Judged, lost_bead
from cell.planning.neighbours.beads_ahead import BeadsAhead
from cell.planning.part_plan import plan_part, plan_runs
from cell.planning.station_search import StationSearch

FOUR = Chunking(0, 8)  # four chunks of ten beads
EMPTY = PartPlan((), (), {})


@pytest.fixture(scope="module")
def job() -> Job:
    return layered_job()


def planned(job: Job, chunking: Chunking | None) -> PartPlan:
    context = context_of(job)
    if chunking is None:
        return plan_part(context, job.targets.bead)
    return plan_in_chunks(Shared.of(job, context), chunking.chunks(job.targets, context.span)).plan


def same(one: PartPlan, two: PartPlan) -> bool:
    stretches = zip(one.stretches, two.stretches, strict=True)
    travels = zip(one.travels, two.travels, strict=True)
    return (
        [(bead.first, bead.stop, bead.whole) for bead in one.beads]
        == [(bead.first, bead.stop, bead.whole) for bead in two.beads]
        and all(np.array_equal(a.q, b.q) for a, b in stretches)
        and all(np.array_equal(a.q, b.q) for a, b in travels)
        and one.travel_failures == two.travel_failures
    )


def out_of_reach(job: Job, *layers: int) -> Job:
    """The same with layers that no arm reaches, which is known without a search."""
    t = job.targets
    off = np.where(np.isin(t.layer, layers)[:, None], 1e5, 0.0)
    return replace(job, targets=replace(t, position=t.position + off))


@pytest.fixture
def every_bead_postponed(monkeypatch: pytest.MonkeyPatch) -> Callable[..., list[int]]:
    """Let every bead be postponed, and note which are searched in full."""

    def make(*, no_budget: bool) -> list[int]:
        monkeypatch.setattr(BeadsAhead, "bead", lambda *_: None)
        monkeypatch.setattr(StationSearch, "suits", lambda *_: False)
        if no_budget:
            monkeypatch.setattr(infeasible_part, "FLOOR", 0)
        searched: list[int] = []
        really = part_plan.plan_bead

        def noted(context: object, first: int, *rest: object, **more: object) -> BeadPlan:
            searched.append(first)
            return really(context, first, *rest, **more)  # type: ignore[arg-type]

        monkeypatch.setattr(part_plan, "plan_bead", noted)
        return searched

    return make


@pytest.mark.parametrize("chunking", [None, pytest.param(FOUR, marks=pytest.mark.slow)], ids=["one chunk", "four"])
def test_postponed_beads_are_planned_as_they_would_have_been_at_once(job, every_bead_postponed, chunking):
    at_once = every_bead_postponed(no_budget=False)
    plan = planned(job, chunking)
    assert all(bead.whole for bead in plan.beads)
    firsts = [bead.first for bead in plan.beads]
    assert sorted(at_once) == firsts
    later = every_bead_postponed(no_budget=True)
    assert same(planned(job, chunking), plan)
    assert sorted(later) == firsts


def test_where_a_bead_is_lost_postponed_ones_are_never_searched_in_full(job, every_bead_postponed):
    searched = every_bead_postponed(no_budget=True)
    plan = planned(out_of_reach(job, int(job.targets.layer.max())), None)
    assert searched == []
    assert plan.beads[-1].target_failures
    assert all(not bead.whole and bead.open and not bead.stretches for bead in plan.beads[:-1])


def test_the_first_bead_of_several_chunks_is_postponed_like_any_other(job, every_bead_postponed):
    searched = every_bead_postponed(no_budget=True)
    plan = planned(out_of_reach(job, int(job.targets.layer.max())), FOUR)
    assert searched == []
    assert plan.beads[-1].target_failures
    assert not plan.beads[0].whole
    assert plan.beads[0].open
    assert all(bead.whole for bead in planned(job, FOUR).beads)
    assert sorted(searched) == [bead.first for bead in plan.beads]


def run_of(name: int, beads: int = 8) -> BeadRun:
    return BeadRun(tuple(range(100 * name, 100 * name + beads)), 100 * name + beads, None)


def up_to(done: int) -> PostponedRun:
    beads = tuple(BeadPlan(k, k + 1, (), {}, {}) for k in range(done))
    return PostponedRun(PartPlan(beads, (), {}), Judged())


class Planner:
    """Answers of a planner, round by round, and what it was asked."""

    def __init__(self, *answers: Sequence[PlannedRun]) -> None:
        self.answers = list(answers)
        self.asked: list[list[tuple[int, int, int, bool]]] = []

    def __call__(self, runs: Sequence[BeadRun], count: Callable[[], None]) -> list[PlannedRun]:
        self.asked.append([(run.firsts[0], run.done, run.full_searches, run.lost) for run in runs])
        return list(self.answers.pop(0))


def test_runs_without_postponed_beads_are_planned_once(job):
    planner = Planner([PlannedRun(EMPTY, False, None), PlannedRun(EMPTY, True, None)])
    assert plan_runs(context_of(job), [run_of(0), run_of(1)], planner) == [EMPTY, EMPTY]
    assert planner.asked == [[(0, 0, 0, False), (100, 0, 0, False)]]


def test_a_loss_in_one_run_settles_the_postponed_beads_of_all_others(job):
    first = PartPlan((), (), {})
    planner = Planner([PlannedRun(first, False, up_to(2)), PlannedRun(EMPTY, True, None)])
    assert plan_runs(context_of(job), [run_of(0), run_of(1)], planner)[0] is first
    assert len(planner.asked) == 1


def test_a_postponed_bead_that_is_cut_loses_the_part_without_a_search(job, monkeypatch):
    left_open, cut = lost_bead(0, 10, {}), lost_bead(0, 10, {})
    doubtful = SimpleNamespace(first=0, stop=10)
    first = PlannedRun(PartPlan((left_open,), (), {}), False, up_to(0), (doubtful,))
    planner = Planner([first, PlannedRun(EMPTY, False, None)])
    monkeypatch.setattr(part_plan, "first_cut_of", lambda *_: cut)
    (bead,) = plan_runs(context_of(job), [run_of(0), run_of(1)], planner)[0].beads
    assert bead is cut
    assert len(planner.asked) == 1


def test_postponed_beads_are_searched_in_rounds_of_more_and_more_until_one_is_lost(job):
    planner = Planner(
        [PlannedRun(EMPTY, False, up_to(1)), PlannedRun(EMPTY, False, None), PlannedRun(EMPTY, False, up_to(2))],
        [PlannedRun(EMPTY, False, up_to(4))],
        [PlannedRun(EMPTY, False, up_to(3)), PlannedRun(EMPTY, False, up_to(5))],
        [PlannedRun(EMPTY, False, up_to(6)), PlannedRun(EMPTY, True, None)],
        [PlannedRun(EMPTY, True, None)],
    )
    plan_runs(context_of(job), [run_of(0), run_of(1), run_of(2)], planner)
    assert planner.asked[1:] == [
        [(200, 2, 1, False)],  # of all runs one bead alone: if it is lost, so is the part
        [(0, 1, 1, False), (200, 4, 1, False)],
        [(0, 3, 2, False), (200, 5, 2, False)],
        [(0, 6, 8, True)],  # what is left of it is judged as in a part that is lost
    ]


def test_of_many_runs_no_bead_is_searched_in_full_once_one_is_lost(job, every_bead_postponed, monkeypatch):
    searched, really = every_bead_postponed(no_budget=True), part_plan.plan_bead

    def lost(context: object, first: int, stop: int, *rest: object, **more: object) -> BeadPlan:
        really(context, first, stop, *rest, **more)  # type: ignore[arg-type]
        return lost_bead(first, stop, {})

    monkeypatch.setattr(part_plan, "plan_bead", lost)
    plan = planned(job, FOUR)
    assert len(searched) == 1
    assert not any(bead.whole for bead in plan.beads if bead.first in searched)


def test_behind_lost_layers_beads_are_searched_together_again(job, monkeypatch):
    monkeypatch.setattr(infeasible_part, "FLOOR", 0)
    alone: list[int] = []
    really = infeasible_part.InfeasiblePartJudge.plan

    def noted(judge, first, *rest):
        alone.append(first)
        return really(judge, first, *rest)

    monkeypatch.setattr(infeasible_part.InfeasiblePartJudge, "plan", noted)
    plan = planned(out_of_reach(job, 2, 3), None)
    lost = [bead.first for bead in plan.beads if not bead.whole]
    behind = [bead.first for bead in plan.beads if bead.first > max(lost)]
    assert len(behind) > 4
    assert len(set(alone) & set(behind)) <= 2
