"""A part in chunks: verdict and motion do not depend on who computes them, and hold as those of one chunk do."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from support.jobs.layered_boss import WALL, context_of, found_in, layered_job, mark

from cell.job.job import Job
from cell.motion.motion_file import ReadMotion
from cell.part_chunks.chunked_plan import plan_in_chunks
from cell.part_chunks.chunking import USUAL, Chunking, Shared
from cell.planning.part_plan import plan_part
from cell.processes.work_round import Aside
from cell.processes.worker import Tick
from cell.processes.worker_pool import WorkerPool
from cell.verdict.check import SpanVerdict
from cell.verdict.result import NOT_LOOKED_AT
from cell.verification.motion_check import check_motion

FEW = Chunking(0, 8)  # four chunks of ten beads


@pytest.fixture(scope="module")
def job() -> Job:
    return layered_job()


@pytest.fixture(scope="module")
def lost() -> Job:
    return layered_job(fixtures=[WALL])


@pytest.fixture(scope="module")
def alone(job: Job) -> SpanVerdict:
    return found_in(job, FEW)


def test_a_part_in_one_chunk_is_planned_as_ever(job: Job) -> None:
    shared = Shared.of(job, context_of(job))
    chunks = USUAL.chunks(job.targets, shared.context.span)
    assert len(chunks) == 1
    plan, other = plan_in_chunks(shared, chunks).plan, plan_part(context_of(job), job.targets.bead)
    assert len(plan.travels) == len(other.travels) == len(plan.beads) - 1
    for one, two in zip(plan.stretches, other.stretches, strict=True):
        assert (one.q == two.q).all()
    for way, way_other in zip(plan.travels, other.travels, strict=True):
        assert (way.q == way_other.q).all()


def test_chunks_make_one_motion_that_holds(job: Job, alone: SpanVerdict) -> None:
    assert len(FEW.chunks(job.targets, context_of(job).span)) == 4
    whole = found_in(job, USUAL)
    assert alone.motion is not None
    assert whole.motion is not None
    # no dearer than bead after bead: within a second a chunk
    assert alone.motion.t_s[-1] < whole.motion.t_s[-1] + 3.0
    judged = check_motion(job, ReadMotion(alone.motion, np.arange(len(alone.motion.t_s)), ()))
    assert judged.feasible
    assert judged.clearance is not None
    assert alone.clearance is not None
    # the least of the whole way is among the chunks' own, and as near as the judge finds it
    assert alone.clearance.value == pytest.approx(judged.clearance[0], rel=0.04, abs=2e-4)
    assert alone.singularity is not None
    assert judged.singularity is not None
    assert alone.singularity.value == pytest.approx(judged.singularity[0], rel=0.02)


class Posted(WorkerPool):
    """Sends everything as to a worker and back, and calls the last item first."""

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
        there = pickle.loads(pickle.dumps(shared))
        if meanwhile is not None:
            meanwhile()
        found = {k: function(there, pickle.loads(pickle.dumps(items[k])), tick or int) for k in range(len(items))[::-1]}
        return [pickle.loads(pickle.dumps(found[k])) for k in range(len(items))]


@pytest.mark.parametrize("which", ["job", pytest.param("lost", marks=pytest.mark.slow)])
def test_what_is_sent_away_comes_back_the_same(
    which: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = request.getfixturevalue(which)
    here = mark(found_in(job, FEW))
    monkeypatch.setattr("cell.part_chunks.chunking.pool", lambda **_: Posted(2))
    assert mark(found_in(job, FEW)) == here


@pytest.mark.slow
@pytest.mark.parametrize("which", ["job", "lost"])
def test_the_number_of_processes_changes_nothing(
    which: str, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of processes that begin with nothing; copies are compared in `tests/cell/cli/test_process_count.py`."""
    monkeypatch.setattr("cell.processes.worker_pool.may_fork", lambda: False)
    monkeypatch.setattr("cell.part_chunks.chunking.WORTH_A_START", 0)
    job = request.getfixturevalue(which)
    here = found_in(job, FEW)
    assert (here.motion is None) == (which == "lost")
    assert {mark(found_in(job, FEW, jobs)) for jobs in (2, 3)} == {mark(here)}


@pytest.mark.slow
def test_a_lost_part_is_lost_in_chunks_for_the_same_reasons(lost: Job) -> None:
    whole, chunked = found_in(lost, USUAL), found_in(lost, FEW)
    assert any(row.reason is not None for row in whole.rows)
    for one, other in zip(whole.rows, chunked.rows, strict=True):
        if one.looked_at and other.looked_at:
            assert one.reason == other.reason
        # what is left open is said to be, never that it can be built
        assert other.looked_at or other.reason == NOT_LOOKED_AT
    assert chunked.motion is None
