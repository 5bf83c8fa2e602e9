"""Where a part is cut: whole beads, whole layers where they are not too long, by the part alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.job.job import WORTH_A_START
from cell.part_chunks.chunking import Chunk, Chunking, pool_for_chunks
from cell.planning.context import Span
from cell.processes.worker_pool import working
from slicing import Targets


def targets_of(layers: list[list[int]]) -> Targets:
    """Targets whose layers have beads of so many targets."""
    beads = [(layer, count) for layer, counts in enumerate(layers) for count in counts]
    path = np.repeat(np.arange(len(beads)), [count for _, count in beads])
    n = len(path)
    rows = np.zeros((n, 3))
    layer = np.array([layer for layer, _ in beads])[path]
    none = np.zeros(n, dtype=np.int64)
    return Targets(("SV1",), none, layer, path, rows, rows, rows, np.ones(n), np.zeros(len(beads), dtype=bool))


def cuts(layers: list[list[int]], whole: int, least: int) -> list[int]:
    targets = targets_of(layers)
    chunks = Chunking(whole, least).chunks(targets, Span(0, len(targets), None, None))
    return [chunk.stop for chunk in chunks]


def test_a_small_part_is_one_chunk() -> None:
    assert cuts([[5, 5]] * 10, 101, 20) == [100]
    assert cuts([[5, 5]] * 10, 100, 20) == [20, 40, 60, 80, 100]


def test_a_chunk_ends_with_a_layer_and_none_is_short() -> None:
    assert cuts([[5, 4], [7], [20], [6, 1]], 0, 10) == [16, 43]
    assert cuts([[5, 4], [7], [20], [6, 6]], 0, 10) == [16, 36, 48]


def test_a_long_layer_is_cut_at_a_bead() -> None:
    assert cuts([[10] * 8], 0, 10) == [20, 40, 60, 80]
    assert cuts([[10] * 7 + [9]], 0, 10) == [20, 40, 60, 79]
    assert cuts([[79]], 0, 10) == [79]


@pytest.mark.parametrize(("copied", "targets", "jobs"), [(False, -1, 1), (False, 0, 2), (True, -1, 2)])
def test_processes_that_begin_with_nothing_start_for_a_large_part_alone(
    copied: bool, targets: int, jobs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("may_fork", "at_rest"):
        monkeypatch.setattr(f"cell.processes.worker_pool.{name}", lambda: copied)
    half = WORTH_A_START // 2
    chunks = [Chunk((100,), 100 + half), Chunk((100 + half,), 100 + WORTH_A_START + targets)]
    assert pool_for_chunks(chunks).processes == 1
    with working(2) as mine:
        assert pool_for_chunks(chunks).processes == jobs
        assert not mine.workers()


beads = st.lists(st.lists(st.integers(1, 12), min_size=1, max_size=4), min_size=1, max_size=12)


@given(beads, st.integers(1, 30), st.data())
def test_every_bead_is_in_one_chunk_and_no_chunk_is_short(
    layers: list[list[int]], least: int, data: st.DataObject
) -> None:
    targets = targets_of(layers)
    starts = np.flatnonzero(np.diff(targets.bead, prepend=-1)).tolist()
    first = data.draw(st.sampled_from(starts))
    span = Span(first, len(targets), None, None)
    chunks = Chunking(0, least).chunks(targets, span)
    assert [i for chunk in chunks for i in chunk.firsts] == [i for i in starts if i >= first]
    ends = [first, *(chunk.stop for chunk in chunks)]
    assert [chunk.firsts[0] for chunk in chunks] == ends[:-1]
    assert ends[-1] == span.stop
    if len(chunks) > 1:
        assert min(np.diff(ends)) >= least
