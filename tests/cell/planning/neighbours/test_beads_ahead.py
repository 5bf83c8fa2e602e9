"""Beads that are searched ahead of their turn are those that are found one by one, and are as free."""

from dataclasses import replace

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case
from support.jobs.searches import setup_of

from cell import DEFAULT_CASE, load_case, prepare
from cell.planning.bead_plan import plan_bead
from cell.planning.context import Context
from cell.planning.edges.edge_check import SearchedBead
from cell.planning.neighbours.beads_ahead import BeadsAhead
from cell.planning.station_search import Ends, StationSearch


@pytest.fixture(scope="module", params=["free", {"fixed_deg": 0.0}], ids=["free", "held"])
def boss(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("ahead")
    return setup_of(boss_case(folder, roll=request.param, sampling={"min_segment_mm": 2.0}))


def beads_of(job):
    firsts = tuple(np.flatnonzero(np.diff(job.targets.bead, prepend=-1)).tolist())
    return firsts, [*firsts[1:], len(job.targets.bead)]


def test_they_are_what_each_is_by_itself(boss):
    job, context = boss
    firsts, stops = beads_of(job)
    ahead, q_before = BeadsAhead(context, firsts, stops[-1]), None
    asked = context.asked
    for first, stop in zip(firsts, stops, strict=True):
        found = ahead.bead(first, q_before)
        assert found is not None
        assert found.whole
        assert (found.first, found.stop) == (first, stop)
        # the first one begins where it suits the others as well
        alone = plan_bead(context, first, stop, found.stretches[0].q_targets[0] if q_before is None else q_before)
        (one,), (other,) = found.stretches, alone.stretches
        for name in ("q_targets", "roll", "q", "edge", "fraction", "position", "margin"):
            assert (getattr(one, name) == getattr(other, name)).all(), name
        # free between the samples as well
        for t in (0.0, 0.4, 0.8):
            between = one.q[:-1] + t * np.diff(one.q, axis=0)
            true = context.checker.clearances(between, context.deposits_before[one.edge[:-1]]).distance
            true = np.minimum(true, context.checker.reach)
            assert (np.minimum(one.kept[:-1], context.checker.reach) <= true + 1e-7).all()
        assert (one.kept[:-1] >= context.settings.kept).all()
        q_before = one.q_targets[-1]
    assert context.asked > asked


@pytest.mark.slow
def test_beads_at_which_the_wrist_swings_are_found_ahead_too():
    """The propeller at a pose where some beads pass close by the wrist's singularity: no quick way leads along them."""
    job = prepare(load_case(DEFAULT_CASE))
    context = Context.of(job, (np.deg2rad(-60.0), np.deg2rad(90.0)))
    firsts, stops = beads_of(job)
    ahead, q_before, swinging = BeadsAhead(context, firsts, stops[-1]), None, 0
    for first, stop in zip(firsts[:8], stops, strict=False):
        found = ahead.bead(first, q_before)
        alone = plan_bead(context, first, stop, q_before)
        assert alone.whole
        assert found is not None
        (one,), (other,) = found.stretches, alone.stretches
        for name in ("q_targets", "roll", "q", "edge", "fraction", "position", "margin"):
            assert getattr(one, name) == pytest.approx(getattr(other, name), abs=1e-12), name
        quick = StationSearch(SearchedBead.of(context, first, stop), context.settings.roll_step, Ends(q_before))
        swinging += quick.cheapest_path() is None
        assert not quick.shut
        q_before = one.q_targets[-1]
    assert 0 < swinging < 8


def test_a_bead_that_is_come_to_from_elsewhere_is_left_to_a_search_of_its_own(boss):
    job, context = boss
    firsts, stops = beads_of(job)
    ahead = BeadsAhead(context, firsts, stops[-1])
    first = ahead.bead(firsts[0], None)
    assert first is not None
    end = first.stretches[0].q_targets[-1]
    assert ahead.bead(firsts[1], end + 0.3) is None


def test_a_bead_that_is_not_free_is_not_given_out(boss):
    job, context = boss
    firsts, stops = beads_of(job)
    given = []
    for clearance in np.arange(0.0125, 0.0185, 0.0005).tolist():
        narrow = replace(context, settings=replace(context.settings, clearance=clearance))
        ahead, q_before, count = BeadsAhead(narrow, firsts, stops[-1]), None, 0
        for first in firsts:
            found = ahead.bead(first, q_before)
            if found is None:
                break
            count += 1
            (one,) = found.stretches
            near = context.checker.clearances(one.q, context.deposits_before[one.edge]).distance
            assert near.min() >= clearance
            q_before = one.q_targets[-1]
        given.append(count)
    assert given[0] == len(firsts)
    assert given[-1] == 0


def test_a_search_in_vain_is_not_done_again(boss):
    job, context = boss
    firsts, stops = beads_of(job)
    narrow = Context.of(job, context.checker.table, replace(context.settings, clearance=0.1))  # more than there is
    ahead = BeadsAhead(narrow, firsts, stops[-1])
    assert ahead.bead(firsts[0], None) is None
    search = ahead.failed_search(firsts[0], None)
    assert search is not None
    asked = narrow.asked
    assert search.cheapest_path() is None  # of what it knows by now nothing is asked again
    assert ahead.bead(firsts[0], None) is None
    assert narrow.asked == asked
    assert ahead.failed_search(firsts[1], None) is None
    assert ahead.failed_search(firsts[0], np.zeros(6)) is None
    full, quick = (plan_bead(narrow, firsts[0], stops[0], None, quickly=quickly) for quickly in (False, True))
    assert full.target_failures.keys() == quick.target_failures.keys()
    assert full.edge_failures.keys() == quick.edge_failures.keys()


def test_where_a_station_is_shut_no_way_is_whole(boss):
    job, context = boss
    firsts, stops = beads_of(job)
    shut = 0
    for clearance in np.arange(0.0125, 0.1, 0.005).tolist():
        narrow = Context.of(job, context.checker.table, replace(context.settings, clearance=clearance))
        for first, stop in zip(firsts, stops, strict=True):
            quick = StationSearch(SearchedBead.of(narrow, first, stop), context.settings.roll_step, Ends())
            if quick.cheapest_path() is None and quick.shut and context.window.is_fixed:
                shut += 1
                assert plan_bead(narrow, first, stop, None, quickly=False).target_failures
    assert (shut > 5) == context.window.is_fixed
