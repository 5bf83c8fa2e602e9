"""Straight travels that are looked at together are those that are found one by one, and are as free."""

from __future__ import annotations

import numpy as np
import pytest
from support.boss_motion import boss_case
from support.searches import setup_of

from cell.planning.edge_check import Stretch
from cell.planning.part_plan import plan_part
from cell.planning.travels.straight_travels import BeadGap, straight_travels
from cell.planning.travels.travel import travel


@pytest.fixture(scope="module")
def boss(tmp_path_factory):
    job, context = setup_of(boss_case(tmp_path_factory.mktemp("straight"), roll="free"))
    plan = plan_part(context, job.targets.path)
    return context, [bead.stretches[0] for bead in plan.beads]


def gaps_of(context, stretches: list[Stretch]) -> list[BeadGap]:
    """Every bead to every other."""
    return [BeadGap(a, b, int(context.laid[a.stop - 1])) for a in stretches for b in stretches if a is not b]


def kept(context, q, stage: int, seed: int) -> float:
    """The least clearance at samples and at random places between them, m."""
    t = np.random.default_rng(seed).random((len(q) - 1, 1))
    every = np.concatenate([q, q[:-1] + t * np.diff(q, axis=0)])
    return float(context.checker.clearances(every, np.full(len(every), stage)).distance.min())


def test_they_are_what_each_is_by_itself(boss):
    context, stretches = boss
    gaps = gaps_of(context, stretches)
    ways = straight_travels(context, gaps)
    assert len(gaps) == len(ways) > 5
    assert sum(way is not None for way in ways) > 3
    for k, (gap, way) in enumerate(zip(gaps, ways, strict=True)):
        if way is None:
            continue
        alone = travel(context, gap.end, gap.start, gap.stage)
        assert isinstance(alone, tuple)
        assert np.array_equal(way[0], alone[0])
        assert way[1].distance == pytest.approx(alone[1].distance, abs=1e-9)
        assert np.array_equal(way[0][[0, -1]], [gap.end.q_targets[-1], gap.start.q_targets[0]])
        assert kept(context, way[0], gap.stage, k) >= context.settings.clearance


def test_what_stands_in_the_way_leaves_a_travel_to_the_search(boss, tmp_path):
    """A thin post half-way across: between the samples, or near them."""
    context, stretches = boss
    gap, way = next(
        (gap, way)
        for gap, way in zip(
            gaps_of(context, stretches), straight_travels(context, gaps_of(context, stretches)), strict=True
        )
        if way is not None
    )
    T = context.checker.scene.T_world_base() @ context.solver.chain.forward(way[0][len(way[0]) // 2][None])[0]
    refused = 0
    for radius, off in ((1.0, 0.0), (1.0, 9.0), (3.0, 25.0)):
        place = 1e3 * T[:3, 3] + off * T[:3, 0] + 4.0 * T[:3, 2]
        post = {"name": "post", "box": {"size_mm": [radius, radius, radius]}, "position_mm": place.tolist()}
        _, hindered = setup_of(boss_case(tmp_path, roll="free", fixtures=[post]))
        (found,) = straight_travels(hindered, [gap])
        if found is None:
            refused += 1
        else:
            assert kept(hindered, found[0], gap.stage, 0) >= hindered.settings.clearance
        if kept(hindered, way[0], gap.stage, 0) < hindered.settings.clearance:
            assert found is None
    assert refused >= 1


def test_the_wire_is_drawn_through_nothing(boss):
    context, stretches = boss
    assert context.wire is not None
    drawn = 0
    for gap, way in zip(
        gaps_of(context, stretches), straight_travels(context, gaps_of(context, stretches)), strict=True
    ):
        if way is None:
            continue
        out = np.linalg.norm(
            context.solver.chain.forward(way[0])[:, :3, 3] - context.placed.position[gap.end.stop - 1], axis=1
        )
        across = np.flatnonzero(out >= context.settings.retract - 1e-9)
        q = way[0][across[0] : across[-1] + 1]
        assert context.wire.clearances(q, np.full(len(q), gap.stage)).distance.min() > 0
        drawn += 1
    assert drawn > 3
