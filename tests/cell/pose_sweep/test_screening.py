"""Poses settled without a search: what screening says is what a check says."""

import numpy as np
import pytest

from cell.case.read import load_case
from cell.case.sections import REASONS
from cell.job.job import prepare
from cell.planning.configurations import nodes_at_rolls, reasons
from cell.planning.context import settings_of
from cell.remedy_search.bead_trial import first_failure
from cell.scene.placement import place_targets
from cell.table_poses.hopeless_poses import screen, screen_all, targets_far_apart
from cell.verdict.check import check_fixed


@pytest.mark.slow
@pytest.mark.parametrize("roll", ["free", {"fixed_deg": -60}, {"range_deg": [-30, 30]}])
def test_screening_never_says_more_than_a_check(make_case, roll):
    job = prepare(load_case(make_case(roll=roll, checks={"gravity_max_deg": 100})))
    settled = 0
    for e1, e2 in [(0, 0), (90, 0), (-135, -180), (-90, 90), (90, -135), (135, 90), (45, 0)]:
        found = screen(job, e1, e2)
        if found is None:
            continue
        settled += 1
        result = check_fixed(job, e1, e2)
        assert not result.feasible
        assert 0 < found.infeasible <= min(result.infeasible, found.looked_at)
        assert found.infeasible == sum(found.reasons.values())
        assert set(found.reasons) <= set(REASONS)
    assert settled


@pytest.mark.parametrize("roll", [{"fixed_deg": -60}, pytest.param({"range_deg": [-70, -50]}, marks=pytest.mark.slow)])
def test_poses_screened_together_are_screened_as_each_by_itself(make_case, roll):
    job = prepare(load_case(make_case(roll=roll)))
    poses = [(e1, e2) for e1 in (-135.0, -30.0, 45.0, 90.0) for e2 in (-180.0, -90.0, 30.0, 120.0)]
    together = screen_all(job, poses)
    assert together == [screen(job, *pose) for pose in poses]
    assert together[::-1] == screen_all(job, poses[::-1])
    assert None in together
    assert len({tuple(found.reasons) for found in together if found is not None}) > 1
    assert screen_all(job, []) == []


@pytest.mark.parametrize("roll", [{"fixed_deg": -60}, {"range_deg": [-60, 60]}])
def test_reasons_of_many_targets_are_those_of_each(make_case, roll):
    job = prepare(load_case(make_case(roll=roll, checks={"wrist_deg": 70})))
    step, told = settings_of(job).roll_step, set()
    for e1, e2 in [(120, -90), (0, 0), (90, 0)]:
        placed = place_targets(job.targets, job.scene.T_base_part(*np.deg2rad([e1, e2])))
        nodes = nodes_at_rolls(job.solver, placed, job.window, step, job.singularity_limits)
        dead = np.flatnonzero(~np.isfinite(nodes.cost).any(axis=(1, 2, 3)))
        found = reasons(job.solver, placed.Ts_base_target[dead], job.window, step)
        assert found == [nodes.why_not(i)[0].reason for i in dead]
        told |= set(found)
    assert told == {"unreachable", "joint_limit", "singular"}


def test_screening_lets_a_feasible_pose_pass_and_sees_a_table_in_the_floor(make_case):
    assert screen(prepare(load_case(make_case())), 90, 180) is None
    job = prepare(load_case(make_case(positioner={"position_mm": [1500, 0, -900]})))
    found = screen(job, 90, 180)
    assert found is not None
    assert found.reasons == {"collision": len(job.targets)}
    assert found.looked_at == len(job.targets)


@pytest.mark.slow
def test_screening_and_check_agree_about_a_table_by_itself(make_case):
    # it hangs down past the faceplate's rim: at E2 = 0 into the tilting arm, at the other turns beside it
    flag = {"name": "flag", "box": {"size_mm": [20, 20, 300]}, "position_mm": [0, 300, -100], "on": "table"}
    job = prepare(load_case(make_case(fixtures=[flag])))
    settled = {}
    for turn in (-180, -90, 0, 90):
        found, result = screen(job, 90, turn), check_fixed(job, 90, turn)
        alone = result.rows[0].detail.get("note") == "the table and what stands on it, in any pose of the arm"
        settled[turn] = found is not None and found.infeasible == found.looked_at == len(job.targets)
        assert alone <= settled[turn]  # what a check says at once is not searched for
        assert found is None or not result.feasible
        probed = first_failure(job, 90, turn, [0], None)
        assert (len(probed) == len(job.targets)) >= alone
        if alone:
            assert {"flag"} < set(result.rows[0].detail["pair"])
    assert settled[0]
    assert not all(settled.values())


def test_screening_sees_targets_that_a_fixture_covers(make_case):
    lid = {"name": "lid", "box": {"size_mm": [20, 30, 30]}, "position_mm": [-42, 0, 120], "on": "table"}
    job = prepare(load_case(make_case(fixtures=[lid], roll={"fixed_deg": -60})))
    found = screen(job, 90, 180)
    assert found is not None
    assert found.reasons == {"collision": found.infeasible}
    result = check_fixed(job, 90, 180)
    assert found.infeasible <= result.reasons["collision"]


def test_targets_looked_at_first_are_far_apart():
    rng = np.random.default_rng(3)
    points = np.concatenate([rng.normal(0, 0.1, (50, 3)), rng.normal(0, 0.1, (50, 3)) + 100, [[0, 500, 0]]])
    normals = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    some = targets_far_apart(points, normals, 3)
    assert len(some) == 3
    assert {int(i // 50) for i in some} == {0, 1, 2}
    assert len(targets_far_apart(points[:2], normals[:2], 32)) == 2
