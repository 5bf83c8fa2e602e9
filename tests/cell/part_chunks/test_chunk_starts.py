"""Where the arm comes from to each chunk, before any is planned."""

from __future__ import annotations

import numpy as np
import pytest
from support.jobs.layered_boss import WALL, context_of, layered_job

from cell.collision.checker import Checker
from cell.job.job import Job
from cell.part_chunks import chunk_starts
from cell.part_chunks.chunk_starts import beginnings
from cell.part_chunks.chunking import Chunking
from cell.planning.part_plan import plan_part

FEW = Chunking(0, 8)  # four chunks of ten beads


@pytest.fixture(scope="module")
def job() -> Job:
    return layered_job()


def test_chunks_begin_where_the_arm_comes_to_when_it_is_planned_bead_after_bead(job: Job) -> None:
    context = context_of(job)
    chunks = FEW.chunks(job.targets, context.span)
    lost, q_before = beginnings(context, chunks)
    assert not lost
    assert len(q_before) == len(chunks) - 1 == 3
    plan = plan_part(context, job.targets.bead)
    ends = {stretch.stop: stretch.q_targets[-1] for stretch in plan.stretches}
    for chunk, q in zip(chunks[1:], q_before, strict=True):
        assert q is not None
        # the same configuration, at a roll that a sample or two may be off
        assert np.abs(q - ends[chunk.firsts[0]]).max() < np.deg2rad(45.0)


def test_of_the_first_bead_nothing_is_followed_from_target_to_target(
    job: Job, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise AssertionError("planned twice")

    monkeypatch.setattr(chunk_starts, "first_bead", refused)
    context = context_of(job)
    lost, q_before = beginnings(context, FEW.chunks(job.targets, context.span))
    assert not lost
    assert all(q is not None for q in q_before)


def test_a_first_bead_that_no_quick_search_finds_a_path_of_tells_whether_the_part_is_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    job = layered_job()
    context = context_of(job)
    monkeypatch.setattr(chunk_starts.StationSearch, "cheapest_path", lambda *_: None)
    lost, q_before = beginnings(context, FEW.chunks(job.targets, context.span))
    assert not lost
    assert all(q is not None for q in q_before)
    monkeypatch.setattr(chunk_starts, "first_bead", lambda *_: None)  # postponed
    lost, _ = beginnings(context, FEW.chunks(job.targets, context.span))
    assert not lost
