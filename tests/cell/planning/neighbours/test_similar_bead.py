"""A bead on the way of one below it that was hard to find: as free as any, and never taken on trust."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.jobs.walled_boss import walled_boss

from cell.failure import Failure, Kind
from cell.planning import infeasible_part
from cell.planning.bead_outcome import BeadPlan
from cell.planning.bead_plan import plan_bead
from cell.planning.context import Context
from cell.planning.infeasible_part import InfeasiblePartJudge
from cell.planning.neighbours import similar_bead
from cell.planning.neighbours.similar_bead import last_hard, like
from cell.planning.station_search import StationSearch
from cell.scene.scene import table_angles

ABOVE_MM = 230  # of a wall over the boss: beads get through below it, some of them with a turn of the roll alone
HARD = (20, 31)  # the bead that only the finest search finds


@pytest.fixture(scope="module")
def walled(tmp_path_factory) -> Context:
    """A long boss below a wall."""
    job = walled_boss(tmp_path_factory.mktemp("wall"), ABOVE_MM)
    return Context.of(job, table_angles(job.scene, 90, 180))


@pytest.fixture(scope="module")
def hard(walled) -> BeadPlan:
    """The bead that was hard to find."""
    plan = plan_bead(walled, *HARD, None)
    assert plan.whole
    assert plan.hard
    return plan


def lifted(context: Context, by_mm: float) -> Context:
    """The same with every target further out, as of a layer above; or below, where negative."""
    placed = context.placed
    return replace(context, placed=replace(placed, position=placed.position + 1e-3 * by_mm * placed.normal))


@pytest.mark.parametrize("by_mm", [0.0, -1.5])
def test_a_bead_is_found_on_the_way_of_a_hard_one_beside_it(walled, hard, by_mm):
    context = lifted(walled, by_mm)
    stretch = like(context, *HARD, [hard.stretches[0]], None)
    assert stretch is not None
    assert (stretch.first, stretch.stop) == HARD
    # the wire stands on every target, in its direction
    Ts, placed = context.solver.chain.forward(stretch.q_targets), context.placed.rows(slice(*HARD))
    assert np.abs(Ts[:, :3, 3] - placed.position).max() < 1e-6
    assert np.abs(Ts[:, :3, 2] + placed.normal).max() < 1e-6
    # free between the samples as well
    for t in (0.0, 0.3, 0.7):
        between = stretch.q[:-1] + t * np.diff(stretch.q, axis=0)
        true = context.checker.clearances(between, context.deposits_before[stretch.edge[:-1]]).distance
        assert true.min() >= context.settings.kept - 1e-7


def test_no_way_is_taken_of_which_an_edge_does_not_hold(walled, hard, monkeypatch):
    really, asked = similar_bead.check_edges, []

    def broken(bead, start, roll, q):
        found = really(bead, start, roll, q)
        asked.append(len(start))
        return replace(found, causes=[*found.causes[:-1], Failure(Kind.COLLISION)])

    monkeypatch.setattr(similar_bead, "check_edges", broken)
    assert like(walled, *HARD, [hard.stretches[0]], None) is None
    assert asked


def test_what_stands_far_off_is_not_taken_for_like_it(walled, hard):
    assert like(walled, *HARD, [], None) is None
    far = similar_bead.MOST_APART
    for other, found in ((0.5 * far, True), (1.5 * far, False)):
        placed = walled.placed
        position = placed.position.copy()
        position[20:31] += other * placed.normal[20:31]
        rest = replace(hard.stretches[0], first=0)  # the way, as if it were that of another bead
        at = np.concatenate([placed.position[20:31], position[11:]])
        moved = replace(walled, placed=replace(placed, position=at))
        assert (similar_bead._Guess.of(similar_bead.SearchedBead.of(moved, *HARD), rest).apart <= far) == found


def test_the_roll_is_that_of_the_nearest_place_laid_either_way_round():
    line = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
    value = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    share = np.array([0.0, 0.1, 0.25, 0.4, 0.6, 0.9, 1.0])
    at = np.stack([np.interp(4 * share, value, line[:, i]) for i in range(3)], axis=1)
    apart, found = similar_bead._nearest(
        at + np.array([0.0, 0.0, 0.3]), line, value
    )  # a closed one: both ends are near its seam
    assert apart == pytest.approx(0.3)
    assert found == pytest.approx(4 * share)
    apart, found = similar_bead._nearest(at, line[::-1], value[::-1])
    assert found != pytest.approx(4 * share)  # much as far along it, which is elsewhere


def test_it_is_asked_for_where_the_quick_search_finds_none_and_a_search_in_full_costs_too_much(
    walled, hard, monkeypatch
):
    monkeypatch.setattr(StationSearch, "run", lambda *_: None)
    for known, as_hard in ((last_hard([hard]), True), ([], False)):
        judge, full = InfeasiblePartJudge(walled, 0), []
        judge.spent = 1e9
        monkeypatch.setattr(infeasible_part, "cut_bead", lambda *_: None)
        bead = judge.plan(*HARD, None, lambda _, full=full: full.append(1) or replace(hard, hard=False), hard=known)
        assert bead is not None
        assert bead.whole
        assert (bead.hard, not full) == (as_hard, as_hard)
        assert not judge.lost
    assert last_hard([replace(hard, hard=False)]) == []


def test_of_long_beads_every_target_is_told_how_far_the_other_bead_is() -> None:
    x = np.linspace(0.0, 3.0, 2000)
    line = np.column_stack([x, 0.0 * x, 0.0 * x])
    at = np.column_stack([x[::2] + 3e-4, 0.002 + 0.001 * np.sin(x[::2]), 0.0 * x[::2]])
    far, value = similar_bead._nearest(at, line, 0.5 * x)
    np.testing.assert_allclose(far, at[:, 1], atol=1e-12)
    np.testing.assert_allclose(value, 0.5 * at[:, 0], atol=1e-12)
