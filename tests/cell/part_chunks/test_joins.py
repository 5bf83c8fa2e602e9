"""Chunks joined: nothing is changed without need, whole turns are turned back, lost travels searched again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.jobs.layered_boss import context_of, layered_job

from cell.failure import ON_TRAVEL, Failure, Kind
from cell.job.job import Job
from cell.part_chunks.chunked_plan import join_chunks
from cell.part_chunks.chunking import Shared
from cell.part_chunks.joins import join_to, turned_to_chunk_before
from cell.planning.bead_outcome import BeadPlan
from cell.planning.bead_runs import HomePaths, PartPlan
from cell.planning.context import Context
from cell.planning.part_plan import plan_part
from cell.planning.travels import home
from cell.planning.travels.home import FoundHomeTravels, with_home

CUT = 4  # beads of the first chunk


@pytest.fixture(scope="module")
def job() -> Job:
    return layered_job()


@pytest.fixture(scope="module")
def context(job: Job) -> Context:
    return context_of(job)


@pytest.fixture(scope="module")
def plan(job: Job, context: Context) -> PartPlan:
    return plan_part(context, job.targets.bead)


def halves(plan: PartPlan) -> list[PartPlan]:
    """A plan as if it had been made in two chunks."""
    return [PartPlan(plan.beads[:CUT], plan.travels[: CUT - 1], {}), PartPlan(plan.beads[CUT:], plan.travels[CUT:], {})]


def same(one: PartPlan, other: PartPlan) -> bool:
    ways = zip(one.travels, other.travels, strict=True)
    beads = zip(one.stretches, other.stretches, strict=True)
    return all(np.array_equal(a.q, b.q) for a, b in ways) and all(np.array_equal(a.q, b.q) for a, b in beads)


def turned(plan: PartPlan, turn: np.ndarray) -> PartPlan:
    """All of a plan with joints turned, rad."""
    beads = [
        replace(b, stretches=tuple(replace(s, q=s.q + turn, q_targets=s.q_targets + turn) for s in b.stretches))
        for b in plan.beads
    ]
    return PartPlan(tuple(beads), tuple(way._replace(q=way.q + turn) for way in plan.travels), {})


def test_a_plan_cut_in_two_is_joined_as_it_was(job: Job, context: Context, plan: PartPlan) -> None:
    assert same(join_chunks(Shared.of(job, context), halves(plan)).plan, plan)


def test_a_chunk_a_whole_turn_off_is_turned_back(job: Job, context: Context, plan: PartPlan) -> None:
    a, b = halves(plan)
    turn = np.zeros(6)
    last = a.stretches[-1]
    # towards where A6 has room, so that turning it back is within its limits
    turn[5] = -2 * np.pi if b.stretches[0].q[0, 5] > 0 else 2 * np.pi
    off = turned(b, turn)
    back = turned_to_chunk_before(context, last, off)
    for one, other in zip(back.stretches, b.stretches, strict=True):
        np.testing.assert_allclose(one.q, other.q, atol=1e-12)
        np.testing.assert_allclose(one.q_targets, other.q_targets, atol=1e-12)
    for way, way_other in zip(back.travels, b.travels, strict=True):
        np.testing.assert_allclose(way.q, way_other.q, atol=1e-12)
    joined = join_chunks(Shared.of(job, context), [a, off]).plan
    assert np.abs(joined.travels[CUT - 1].q - plan.travels[CUT - 1].q).max() < 1e-9
    # no joint is turned out of its limits
    chain = context.solver.chain
    tight = replace(chain, lower=np.minimum(off.stretches[0].q.min(axis=0), last.q.min(axis=0)) - 1e-9)
    tight = replace(tight, upper=np.where(np.arange(6) == 5, off.stretches[0].q.max(axis=0) + 1.0, chain.upper))
    if turn[5] < 0:
        narrow = replace(context, solver=replace(context.solver, chain=tight))
        assert turned_to_chunk_before(narrow, last, off) is off


def test_a_turn_of_a_joint_with_one_turn_is_none(context: Context, plan: PartPlan) -> None:
    a, b = halves(plan)
    assert turned_to_chunk_before(context, a.stretches[-1], b) is b


def test_what_cannot_be_left_is_stuck_and_the_bead_stays(job: Job, context: Context, plan: PartPlan) -> None:
    a, b = halves(plan)
    last = a.stretches[-1]
    into = last.q_targets[-1].copy()
    into[1] += np.deg2rad(25.0)  # the arm leans into the part
    buried = replace(last, q_targets=np.concatenate([last.q_targets[:-1], into[None]]))
    few = replace(context, settings=replace(context.settings, travel_attempts=10))
    join = join_to(few, buried, b.beads[0])
    assert isinstance(join.way, Failure)
    assert join.bead is None
    beads = (*a.beads[:-1], replace(a.beads[-1], stretches=(buried,)))
    found = join_chunks(Shared.of(job, few), [replace(a, beads=beads), b]).plan
    assert list(found.travel_failures) == [b.beads[0].first]
    assert found.travel_failures[b.beads[0].first].place.from_target == a.beads[-1].stop - 1
    assert len(found.travels) == len(plan.travels) - 1


def test_a_travel_that_few_attempts_did_not_find_is_searched_again(job: Job, context: Context, plan: PartPlan) -> None:
    a, b = halves(plan)
    travel_failures = {bead.first: Failure(Kind.COLLISION, place=ON_TRAVEL) for bead in (b.beads[2], b.beads[4])}
    travels = tuple(way for k, way in enumerate(b.travels) if k not in (1, 3))
    found = join_chunks(Shared.of(job, context), [a, PartPlan(b.beads, travels, travel_failures)]).plan
    assert not found.travel_failures
    assert same(found, plan)
    # not where a bead is lost: there it helps nobody
    lost = replace(a.beads[0], open=frozenset([a.beads[0].first]))
    some = PartPlan((lost, *a.beads[1:]), a.travels, {})
    left = join_chunks(Shared.of(job, context), [some, PartPlan(b.beads, travels, travel_failures)]).plan
    assert left.travel_failures == travel_failures


def test_ways_home_are_found_with_the_joints_and_count_for_the_beads_they_were_found_for(
    job: Job, context: Context, plan: PartPlan, monkeypatch: pytest.MonkeyPatch
) -> None:
    joined = join_chunks(Shared.of(job, context), halves(plan))
    assert joined.home is not None
    apart = with_home(context, plan)[1]
    searched: list[int] = []
    search = home.search_home_travels

    def counted(context: Context, first: BeadPlan, last: BeadPlan, *known: HomePaths) -> FoundHomeTravels:
        searched.append(last.first)
        return search(context, first, last, *known)

    monkeypatch.setattr(home, "search_home_travels", counted)
    found = with_home(context, joined.plan, joined.home)[1]
    assert not searched
    assert found is not None
    assert apart is not None
    for way, other in ((found.out, apart.out), (found.back, apart.back)):
        assert way is not None
        assert other is not None
        assert np.array_equal(way.q, other.q)
    # another last bead, though it is like it, or a part that is not whole: they are searched
    beads = joined.plan.beads
    others = replace(joined.plan, beads=(*beads[:-1], replace(beads[-1])))
    with_home(context, others, joined.home)
    lost = replace(beads[1], open=frozenset([beads[1].first]))
    with_home(context, replace(joined.plan, beads=(beads[0], lost, *beads[2:])), joined.home)
    assert searched == [beads[-1].first] * 2
    # of a part that is lost they are not looked for with the joints
    a, b = halves(plan)
    assert join_chunks(Shared.of(job, context), [replace(a, beads=(a.beads[0], lost, *a.beads[2:])), b]).home is None
