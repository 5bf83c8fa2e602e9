"""Memory that is freed goes back to the system, and a check keeps nothing of a job that is gone."""

import ctypes
import gc
import os
import sys
import weakref
from pathlib import Path

import pytest
from support.jobs.layered_boss import WALL, layered_job

from cell import check
from cell.freed_memory import give_back

PIECES, BYTES = 100_000, 600  # 60 MB, larger than what Python's own allocator keeps in its arenas


def resident_mb():
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.mark.skipif(sys.platform != "linux", reason="what glibc keeps")
def test_what_was_freed_in_small_pieces_is_given_back():
    if not hasattr(ctypes.CDLL(None), "malloc_trim"):
        pytest.skip("a C library that has no malloc_trim")
    pieces = [bytes(BYTES) for _ in range(PIECES)]
    last = bytes(BYTES)  # behind them: nothing before it goes back by itself
    del pieces
    before = resident_mb()
    give_back()
    assert before - resident_mb() > 0.8 * PIECES * BYTES / 1e6
    assert len(last) == BYTES


@pytest.mark.parametrize("fixture", [[], pytest.param([WALL], marks=pytest.mark.slow)], ids=["feasible", "infeasible"])
def test_nothing_of_a_check_is_kept_once_its_job_is_gone(fixture: list[dict[str, object]]) -> None:
    job = layered_job(fixtures=fixture)
    model, scene = weakref.ref(job.scene.model), weakref.ref(job.scene)
    result = check(job)
    assert result.feasible == (not fixture)
    del job, result
    gc.collect()
    assert model() is None
    assert scene() is None
