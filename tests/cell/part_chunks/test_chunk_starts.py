"""Where the arm comes from to each chunk, before any is planned."""

from __future__ import annotations

import numpy as np
import pytest
from support.jobs.layered_boss import context_of, layered_job

from cell.job.job import Job
from cell.part_chunks.chunk_starts import beginnings
from cell.part_chunks.chunking import Chunking
from cell.planning.part_plan import plan_part
from cell.planning.station_search import StationSearch

FEW = Chunking(0, 8)  # four chunks of ten beads


@pytest.fixture(scope="module")
def job() -> Job:
    return layered_job()


@pytest.mark.parametrize("quickly", [True, False], ids=["found quickly", "not found"])
def test_chunks_begin_where_the_arm_comes_to_when_it_is_planned_bead_after_bead(
    job: Job, quickly: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = plan_part(context_of(job), job.targets.bead)
    ends = {stretch.stop: stretch.q_targets[-1] for stretch in plan.stretches}
    if not quickly:
        monkeypatch.setattr(StationSearch, "suits", lambda _: False)
    context = context_of(job)
    chunks = FEW.chunks(job.targets, context.span)
    q_before = beginnings(context, chunks)
    assert len(q_before) == len(chunks) - 1 == 3
    for chunk, q in zip(chunks[1:], q_before, strict=True):
        assert q is not None
        # the same configuration, at a roll that a sample or two may be off
        assert np.abs(q - ends[chunk.firsts[0]]).max() < np.deg2rad(60.0)


def test_nothing_is_followed_from_target_to_target(job: Job, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise AssertionError("what is planned here is planned once more with its chunk")

    for module in ("station_search", "bead_search", "neighbours.beads_ahead"):
        monkeypatch.setattr(f"cell.planning.{module}.check_edges", refused)
    context = context_of(job)
    assert all(q is not None for q in beginnings(context, FEW.chunks(job.targets, context.span)))
