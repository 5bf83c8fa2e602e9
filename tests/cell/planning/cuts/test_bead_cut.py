"""Beads that are cut: no way leads through them though each of their targets can be welded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, job_of
from support.jobs.walled_boss import walled_boss

from cell.collision.clearances import Clearances
from cell.job.job import Job
from cell.planning import bead_plan, infeasible_part, part_plan
from cell.planning.bead_plan import plan_bead
from cell.planning.bead_runs import BeadRun, PartPlan, PlannedRun, PostponedRun
from cell.planning.context import Context
from cell.planning.cuts.bead_cut import find_cut
from cell.planning.cuts.cut_search import roll_sectors
from cell.planning.infeasible_part import DoubtfulBead, Judged, lost_alone
from cell.planning.part_plan import BeadPlan, plan_runs
from cell.rigid import frames
from cell.scene.scene import table_angles
from cell.verdict.check import check_fixed
from ik.roll import RollWindow, roll_of, wrap

LOW_MM, HIGH_MM = 200, 240  # above the boss a wall that stops the arm, and one that it gets through below
FIRSTS = [0, 9, 20, 31, 42, 44, 46]
BEADS = list(pairwise(FIRSTS))


@pytest.fixture(scope="module")
def walled(tmp_path_factory) -> Callable[[float | None], Job]:
    """A long boss with a wall hanging over its middle, between targets that are far apart; None: without it."""
    folder = tmp_path_factory.mktemp("wall")
    return lambda above_mm: walled_boss(folder, above_mm)


def context_of(job: Job) -> Context:
    return Context.of(job, table_angles(job.scene, job.case.table.E1_deg, job.case.table.E2_deg))


@pytest.fixture
def cuts_unknown(monkeypatch) -> None:
    monkeypatch.setattr(bead_plan, "find_cut", lambda *_: None)


@pytest.mark.parametrize("above_mm", [LOW_MM, HIGH_MM])
def test_beads_below_a_wall_that_stops_the_arm_are_cut(walled, above_mm):
    context = context_of(walled(above_mm))
    assert not lost_alone(context, range(FIRSTS[-1]))  # by itself each target can be welded
    for first, stop in BEADS[-2:]:
        cut = find_cut(context, first, stop)
        assert (cut is None) == (above_mm == HIGH_MM)
        assert cut is None or first <= cut.first < cut.stop - 1 < stop


@pytest.mark.slow
def test_a_search_in_full_finds_no_way_where_a_bead_is_cut(walled, cuts_unknown):
    context = context_of(walled(LOW_MM))
    cut = find_cut(context, *BEADS[-1])
    assert cut is not None
    plan = plan_bead(context, cut.first, cut.stop, None)
    assert plan.edge_failures
    assert not plan.target_failures


SLIT, SHORT = 14, (14, 21)


class Slit:
    """A checker in whose cell one narrow stretch of the roll is free, which moves along the bead."""

    def __init__(self, real, context: Context, at: Callable[[np.ndarray], np.ndarray], half: float) -> None:
        self.real, self.context, self.at, self.half = real, context, at, half

    def __getattr__(self, name):
        return getattr(self.real, name)

    def clearances(self, q, deposits_laid, met=None):
        found = self.real.clearances(q, deposits_laid)
        T = self.context.solver.chain.forward(q)
        p, placed = T[:, :3, 3], self.context.placed
        roll = roll_of(frames(p, -T[:, :3, 2], placed.reference), T)
        off = np.abs(wrap(roll - self.at(np.linalg.norm(p - placed.position[SLIT], axis=1))))
        room = self.context.settings.clearance + 0.2 * (self.half - off)  # m: as something 0.2 m from the wire
        return Clearances(room, np.maximum(found.pair, 0), np.nan_to_num(found.position))


def with_slit(context: Context, at: Callable[[np.ndarray], np.ndarray], half_deg: float) -> Context:
    half = np.deg2rad(half_deg)
    return replace(
        context, checker=Slit(context.checker, context, at, half), screen=Slit(context.screen, context, at, half)
    )


@pytest.fixture(scope="module")
def boss(tmp_path_factory) -> Context:
    return context_of(job_of(boss_case(tmp_path_factory.mktemp("boss"))))


def test_a_narrow_stretch_that_turns_along_the_bead_is_a_way(boss):
    for turn in (0.0, 4.0):  # rad/m: 0.2 m from the wire, nearly as fast as the wire itself
        for half_deg in (0.5, 4.0):
            slit = with_slit(boss, lambda s, turn=turn: np.deg2rad(-61.3) + turn * s, half_deg)
            assert find_cut(slit, *SHORT) is None


def test_stretches_of_the_roll_far_from_one_another_cut_a_bead(boss):
    far = with_slit(boss, lambda s: np.deg2rad(np.where(s < 4e-3, -60.0, 60.0)), 10.0)
    assert find_cut(far, *SHORT) is not None
    beside = with_slit(boss, lambda s: np.deg2rad(np.where(s < 4e-3, -60.0, -50.0)), 10.0)
    assert find_cut(beside, *SHORT) is None


def test_rolls_before_the_first_blocked_one_and_behind_the_last_are_together_only_where_the_roll_is_free():
    blocked, roll = np.array([-2.0, 0.0, 2.0]), np.array([-3.0, -1.0, -0.5, 1.0, 3.0])
    before, *between, behind = roll_sectors(blocked, roll, circular=True)
    assert before == behind
    assert between[0] == between[1] != between[2]
    assert before not in between
    assert len(set(roll_sectors(blocked, roll, circular=False))) == 4
    assert len(set(roll_sectors(blocked[:0], roll, circular=True))) == 1


def test_a_roll_turns_through_the_half_turn_but_not_out_of_its_window(boss):
    across = with_slit(boss, lambda s: np.deg2rad(np.where(s < 4e-3, -170.0, 170.0)), 15.0)
    assert find_cut(across, *SHORT) is None  # 20 degrees apart
    window = RollWindow(np.deg2rad(-75.0), np.deg2rad(75.0))
    ends = with_slit(replace(boss, window=window), lambda s: np.deg2rad(np.where(s < 4e-3, -60.0, 60.0)), 15.0)
    assert find_cut(ends, *SHORT) is not None


def test_a_part_is_lost_by_a_bead_that_is_cut_without_a_search_in_full(walled, monkeypatch):
    monkeypatch.setattr(infeasible_part, "FLOOR", 0)
    searched: list[int] = []
    really = part_plan.plan_bead

    def noted(context: Context, first: int, *rest, **more) -> BeadPlan:
        searched.append(first)
        return really(context, first, *rest, **more)

    monkeypatch.setattr(part_plan, "plan_bead", noted)
    job = walled(LOW_MM)
    found = check_fixed(job, 90, 180)
    assert not found.feasible
    assert searched == []
    assert found.reasons["no_path"] == found.infeasible == 1
    (target,) = (i for i, row in enumerate(found.rows) if row.reason == "no_path")
    failure = found.rows[target].failure
    assert failure is not None
    assert failure.from_target == target - 1
    assert target not in FIRSTS
    assert not failure.proved
    assert found.not_looked_at > 0


def test_few_postponed_beads_are_looked_at_before_any_is_searched(boss, monkeypatch):
    """Of beads that are hard but can be welded all looks are in vain."""
    looked: list[int] = []
    monkeypatch.setattr(infeasible_part, "cut_bead", lambda _, first, *__: looked.append(first))
    beads = [DoubtfulBead(10 * k, 10 * k + 9 - k % 2, ((0, 5),)) for k in range(8)]
    run = BeadRun(tuple(bead.first for bead in beads), 80, None)
    postponed = PostponedRun(PartPlan((), (), {}), Judged())
    rounds: list[int] = []

    def planned(some: Sequence[BeadRun], _: Callable[[], None]) -> list[PlannedRun]:
        rounds.append(len(looked))
        first = all(one.begun is None for one in some)
        return [PlannedRun(PartPlan((), (), {}), False, postponed if first else None, tuple(beads)) for _ in some]

    plan_runs(boss, [run, run, run], planned)
    assert rounds == [0, 4, 4]  # all looks come between the first round and the searches in full, of one run and of two
    assert looked == [70, 50, 70, 50]  # of the last three the two of fewest targets, in the last two runs


def test_a_bead_that_is_cut_is_searched_at_no_finer_rolls(walled, monkeypatch):
    steps: list[float] = []
    really = bead_plan.nodes_at_rolls

    def noted(solver, placed, window, step, *rest):
        steps.append(step)
        return really(solver, placed, window, step, *rest)

    monkeypatch.setattr(bead_plan, "nodes_at_rolls", noted)
    context = context_of(walled(LOW_MM))
    plan = plan_bead(context, *BEADS[-1], None)
    assert plan.edge_failures
    assert steps == [context.settings.roll_step]
