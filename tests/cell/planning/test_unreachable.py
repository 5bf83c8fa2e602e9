"""Targets proved out of reach, many together: those of which each by itself is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.jobs.layered_boss import context_of, layered_job

from cell.failure import Kind
from cell.planning.context import Context
from cell.planning.unreachable import unreachable

MANY = 1300
FAR = np.random.default_rng(4).random(MANY) < 0.3


@pytest.fixture(scope="module")
def context() -> Context:
    """Many targets of a boss, one after the other and again, some of them 100 m away."""
    context = context_of(layered_job())
    placed = context.placed.rows(np.arange(MANY) % len(context.placed.position))
    return replace(context, placed=replace(placed, position=placed.position + np.where(FAR[:, None], 100.0, 0.0)))


@pytest.mark.parametrize("targets", [range(500, 530), [1022, 3, 1025], range(MANY), []])
def test_targets_are_proved_out_of_reach_that_are_far_away_and_no_others(context: Context, targets) -> None:
    found = unreachable(context, targets)
    assert list(found) == [i for i in targets if FAR[i]]
    assert all(lost.failure.proved and lost.failure.kind is Kind.UNREACHABLE for lost in found.values())
