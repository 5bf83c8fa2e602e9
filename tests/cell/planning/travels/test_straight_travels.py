"""Straight travels that are looked at together are those that are found one by one, and are as free."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case
from support.jobs.searches import setup_of

from cell.collision.clearances import Clearances
from cell.planning.edges.edge_check import Stretch
from cell.planning.part_plan import plan_part
from cell.planning.travels.straight_travels import BeadGap, _kept, straight_travels
from cell.planning.travels.travel import TravelPath, travel


@pytest.fixture(scope="module")
def boss(tmp_path_factory):
    job, context = setup_of(boss_case(tmp_path_factory.mktemp("straight"), roll="free"))
    plan = plan_part(context, job.targets.bead)
    return context, [bead.stretches[0] for bead in plan.beads]


def second_half(bead: Stretch) -> Stretch:
    """A bead as if it began in its middle."""
    k = len(bead.q_targets) // 2
    return replace(bead, first=bead.first + k, q_targets=bead.q_targets[k:], roll=bead.roll[k:])


def gaps_of(context, stretches: list[Stretch]) -> list[BeadGap]:
    """Every bead to every other, and to the middle of every other."""
    pairs = [(a, b) for a in stretches for b in stretches if a is not b]
    pairs += [(a, second_half(b)) for a, b in pairs]
    return [BeadGap(a, b, int(context.laid[a.stop - 1])) for a, b in pairs]


def kept(context, q, deposits_laid: int, seed: int) -> float:
    """The least clearance at samples and at random places between them, m."""
    t = np.random.default_rng(seed).random((len(q) - 1, 1))
    every = np.concatenate([q, q[:-1] + t * np.diff(q, axis=0)])
    return float(context.checker.clearances(every, np.full(len(every), deposits_laid)).distance.min())


def assert_holds(checker, way, deposits_laid: int) -> None:
    """What is said to be kept at samples and between them is kept."""
    t = np.linspace(0, 1, 8)
    for k, (a, b) in enumerate(pairwise(way.q)):
        every = a + t[:, None] * (b - a)
        true = checker.clearances(every, np.full(len(every), deposits_laid)).distance
        true = np.where(np.isfinite(true), true, np.inf)
        assert true.min() >= way.kept[k] - 1e-6
        assert true[0] >= way.low[k] - 1e-6
    assert np.isneginf(way.kept[-1])


def test_ways_from_home_and_back_are_what_each_is_by_itself(boss):
    """And beside them all travels between beads are the same to the bit."""
    context, stretches = boss
    gaps = gaps_of(context, stretches)
    homes = [BeadGap(None, bead, context.begun) for bead in stretches]
    homes += [BeadGap(bead, None, int(context.laid[bead.stop - 1])) for bead in stretches]
    assert context.span.start is not None
    ways = straight_travels(context, gaps + homes)
    for one, other in zip(ways[: len(gaps)], straight_travels(context, gaps), strict=True):
        assert (one is None) == (other is None)
        assert one is None or np.array_equal(one.q, other.q)
    found = 0
    for k, (gap, way) in enumerate(zip(homes, ways[len(gaps) :], strict=True)):
        if way is None:
            continue
        found += 1
        alone = travel(context, gap.end, gap.start, gap.deposits_laid)
        assert isinstance(alone, TravelPath)
        assert np.array_equal(way.q, alone.q)
        assert np.array_equal(way.q[-1], context.span.end if gap.start is None else gap.start.q_targets[0])
        assert np.array_equal(way.q[0], context.span.start if gap.end is None else gap.end.q_targets[-1])
        assert kept(context, way.q, gap.deposits_laid, k) >= context.settings.clearance
        assert_holds(context.checker, way, gap.deposits_laid)
    assert found > 2


def test_they_are_what_each_is_by_itself(boss):
    context, stretches = boss
    gaps = gaps_of(context, stretches)
    ways = straight_travels(context, gaps)
    assert len(gaps) == len(ways) > 5
    assert sum(way is not None for way in ways) > 3
    looks = 0
    for k, (gap, way) in enumerate(zip(gaps, ways, strict=True)):
        if way is None:
            continue
        alone = travel(context, gap.end, gap.start, gap.deposits_laid)
        assert isinstance(alone, tuple)
        assert np.array_equal(way[0], alone[0])
        seen = np.isfinite(way.clearances.distance)
        looks += int(seen.sum())
        assert (way.clearances.distance[seen] >= alone.clearances.distance[seen] - 1e-6).all()
        assert (way.low <= np.minimum(alone.clearances.distance, context.checker.reach) + 1e-9).all()
        assert np.array_equal(way[0][[0, -1]], [gap.end.q_targets[-1], gap.start.q_targets[0]])
        assert kept(context, way[0], gap.deposits_laid, k) >= context.settings.clearance
        assert_holds(context.checker, way, gap.deposits_laid)
    assert looks > 3


def widest_step(context, gaps: list[BeadGap]) -> tuple[BeadGap, np.ndarray, np.ndarray]:
    """The travel whose TCP goes furthest from one sample to the next: its gap, samples and the pose half-way there."""
    found = []
    for gap, way in zip(gaps, straight_travels(context, gaps), strict=True):
        if way is not None:
            place = context.solver.chain.forward(way[0])[:, :3, 3]
            step = np.linalg.norm(np.diff(place, axis=0), axis=1)
            k = int(np.argmax(step))
            found.append((step[k], gap, way[0], (way[0][k] + way[0][k + 1]) / 2))
    _, gap, q, halfway = max(found, key=lambda one: one[0])
    T = context.checker.scene.T_world_base() @ context.solver.chain.forward(halfway[None])[0]
    return gap, q, T


def post_at(place: np.ndarray) -> dict[str, object]:
    """A fixture of a millimetre, which samples of a travel may well pass by."""
    return {"name": "post", "box": {"size_mm": [1.0, 1.0, 1.0]}, "position_mm": (1e3 * place).tolist()}


@pytest.mark.slow
def test_a_way_with_room_at_its_samples_is_taken_only_if_it_is_free_between_them(boss):
    context, stretches = boss
    chain, least, rng = context.solver.chain, context.settings.clearance, np.random.default_rng(2)
    ends = np.concatenate([way[0] for way in straight_travels(context, gaps_of(context, stretches)) if way is not None])
    begin = ends[rng.integers(0, len(ends), 300)]
    goal = np.clip(begin + rng.normal(scale=0.25, size=begin.shape), chain.lower, chain.upper)
    ways = [(np.stack(way), 2) for way in zip(begin, goal, strict=True)]
    t = np.linspace(0, 1, 60)[:, None]
    taken = missed = 0
    for (q, deposits_laid), found in zip(ways, _kept(context.checker, context, ways, 2 * least, least), strict=True):
        every = q[0] + t * (q[1] - q[0])
        true = context.checker.clearances(every, np.full(len(every), deposits_laid)).distance
        if found is None:
            missed += true[[0, -1]].min() >= 2 * least and true.min() < least
            continue
        taken += 1
        assert true[[0, -1]].min() >= 2 * least
        assert true.min() >= least - 1e-9
    assert taken > 30
    assert missed > 3


@pytest.mark.slow
def test_a_travel_with_little_room_is_left_to_the_search(boss, tmp_path):
    context, stretches = boss
    gap, q, T = widest_step(context, gaps_of(context, stretches))
    least = context.settings.clearance
    for below in np.arange(0.0, 0.03, 0.0005).tolist():
        _, hindered = setup_of(boss_case(tmp_path, roll="free", fixtures=[post_at(T[:3, 3] + below * T[:3, 2])]))
        near = min(kept(hindered, q, gap.deposits_laid, seed) for seed in range(10))
        if 1.5 * least < near < 1.8 * least:
            break
    else:
        pytest.fail("no such place")
    at_samples = hindered.checker.clearances(q, np.full(len(q), gap.deposits_laid)).distance.min()
    assert (straight_travels(hindered, [gap]) == [None]) == (at_samples < 2 * least)


def test_the_wire_is_drawn_through_nothing(boss):
    """Hardly drawn back, it would be drawn through what has just been laid."""
    context, stretches = boss
    assert context.wire is not None
    free = refused = 0
    for retract in (1e-3, context.settings.retract):
        low = replace(context, settings=replace(context.settings, retract=retract))
        gaps = gaps_of(low, stretches)
        for gap, way in zip(gaps, straight_travels(low, gaps), strict=True):
            refused += way is None
            if way is None:
                continue
            place = low.solver.chain.forward(way[0])[:, :3, 3]
            up = np.linalg.norm(place - low.placed.position[gap.end.stop - 1], axis=1) >= retract - 1e-9
            down = np.linalg.norm(place - low.placed.position[gap.start.first], axis=1) >= retract - 1e-9
            across = np.flatnonzero(up & down)
            q = way[0][across[0] : across[-1] + 1]
            every = np.concatenate([q, (q[1:] + q[:-1]) / 2])
            assert context.wire.clearances(every, np.full(len(every), gap.deposits_laid)).distance.min() > 0
            free += 1
    assert free > 3
    assert refused > 3


def test_between_two_samples_no_more_is_kept_than_the_travel_between_them_leaves():
    radius, checker = np.array([1.0, 0.5]), SimpleNamespace(reach=0.15)
    q = np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 0.2]])
    seen = replace(Clearances.none(3), distance=np.array([0.08, 0.06, 0.4]))
    way = TravelPath.of(checker, radius, q, seen)
    assert way.low == pytest.approx([0.08, 0.06, 0.15])  # no more than was looked out to
    # half of what both ends have, less half of the 0.1 m that things come nearer on each step
    assert way.kept[:-1] == pytest.approx([0.02, 0.055])
    assert way.kept[-1] == -np.inf
