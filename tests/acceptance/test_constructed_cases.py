"""Constructed cases come out right, each with its reason: beads, travels, the order of layers, speeds."""

import numpy as np
import pytest
from support.jobs.cases import at, bosses, radial, turned

from cell.case.read import load_case
from cell.collision.checker import Checker
from cell.job.job import prepare
from cell.planning.configurations import nodes_at_rolls
from cell.verdict.check import check_fixed
from cell.verdict.words import in_words


def run(path):
    case = load_case(path)
    return check_fixed(prepare(case), case.table.E1_deg, case.table.E2_deg)


def failures(result):
    return {i: row for i, row in enumerate(result.rows) if row.reason is not None}


def free_nodes(result, i):
    """Configurations of a target that keep limits, margins and clearance, and their groups."""
    job = result.job
    here = result.placed.rows([i])
    nodes = nodes_at_rolls(job.solver, here, job.window, np.deg2rad(15), job.singularity_limits)
    index = np.argwhere(np.isfinite(nodes.cost[0]))
    q = nodes.q[0][tuple(index.T)]
    found = Checker(job.scene, result.table, 0.02).clearances(q, np.full(len(q), job.deposits_before[i]))
    free = found.distance >= 5e-3
    return q[free], index[free, 1]


def test_reachable_everywhere_but_only_with_a_flip(make_case, tmp_path):
    part = bosses(tmp_path, at(160, length=6, width=300, height=2))
    result = run(make_case(part=part, roll={"fixed_deg": -100}))
    bad = failures(result)
    assert {row.reason for row in bad.values()} == {"no_path"}
    for i, row in bad.items():
        assert row.detail["on_the_way"] == "configuration change"
        assert row.detail["from_target"] == i - 1
        assert row.attempt is not None  # it is reached by itself
        # of the configurations that both have, none goes over into another without a flip
        (qa, ga), (qb, gb) = free_nodes(result, i - 1), free_nodes(result, i)
        furthest = np.abs(qa[:, None] - qb[None]).max(axis=-1)
        assert len(qa)
        assert len(qb)
        assert furthest[ga[:, None] == gb[None]].min() > np.deg2rad(60)


def test_a_bead_through_the_wrist_singularity(make_case, tmp_path):
    part = bosses(tmp_path, at(160, length=6, width=300, height=2))
    ceiling = {"name": "ceiling", "box": {"size_mm": [600, 3000, 20]}, "position_mm": [-300, 0, 1900]}
    case = {"part": part, "table": {"E1_deg": 45, "E2_deg": 180}, "roll": {"fixed_deg": -72}, "fixtures": [ceiling]}
    result = run(make_case("far", **case, checks={"wrist_deg": 10}))
    (row,) = failures(result).values()
    assert (row.reason, row.detail["on_the_way"]) == ("no_path", "singular")
    assert row.attempt is not None  # it is at neither end that the margin is missed
    assert run(make_case("near", **case)).feasible


def test_a_travel_through_the_positioner_goes_round_it(make_case, tmp_path):
    part = bosses(tmp_path, at(20), turned(at(20), 180), length=100)
    result = run(make_case(part=part, table={"E1_deg": 60, "E2_deg": 180}, roll={"range_deg": [-90, 0]}))
    assert result.feasible
    first = int(np.flatnonzero(result.job.targets.sub_volume_index == 1)[0])
    travel = result.motion.q[(result.motion.target == first) & (result.motion.arc == 0)]
    # from 30 mm off one bead to 30 mm off the other, in steps of 2 mm out and in
    straight = travel[14] + np.linspace(0, 1, 200)[:, None] * (travel[-15] - travel[14])
    found = Checker(result.job.scene, result.table, 0.02).clearances(straight, np.full(200, result.job.laid[first - 1]))
    assert found.distance[0] >= 5e-3
    assert found.distance[-1] >= 5e-3
    assert found.distance.min() < 0
    pairs = {result.job.scene.geom_name(int(g)) for g in found.pair[found.distance < 0].ravel()}
    assert pairs & {"turn_unit", "faceplate", "tilt_arm"}


@pytest.mark.slow
def test_a_wall_is_gone_round_and_a_closed_room_is_no_path(make_case, tmp_path):
    part = bosses(tmp_path, at(20), at(600), length=620)
    walls = [radial("wall", (900, 1500), (10, 2600)), radial("lintel", (1500, 2700), (395, 2600))]
    roof = {"name": "roof", "box": {"size_mm": [1400, 2400, 20]}, "position_mm": [300, 0, 1600]}
    case = {"part": part, "roll": {"range_deg": [-180, 0]}}
    open_, again = (run(make_case("open", **case, fixtures=walls)) for _ in range(2))
    assert open_.feasible
    assert np.array_equal(open_.motion.q, again.motion.q)  # the search repeats itself
    assert open_.clearance.value >= 5e-3
    closed = run(make_case("closed", **case, fixtures=[*walls, roof], process={"travel_attempts": 60}))
    first, target, last = failures(closed)
    assert closed.rows[first].detail["at_home"]  # under the roof there is no room for that
    assert closed.rows[last].detail["at_home"]
    row = closed.rows[target]
    assert (row.reason, row.detail["on_the_way"]) == ("no_path", "collision")
    assert row.detail["travel"]
    assert row.detail["from_target"] == target - 1
    assert row.detail["to_target"] == target
    assert set(row.detail["pair"]) & {"wall", "lintel", "roof"}
    assert "blocked_by_layers" not in row.detail


def test_layers_that_lock_the_torch_out_are_named(make_case, tmp_path):
    tall, low = at(20, height=24), at(36)
    fixed = {"fixed_deg": -60}
    locked = run(make_case("tall_first", part=bosses(tmp_path, tall, low, length=60), roll=fixed))
    bad = failures(locked)
    assert {row.reason for row in bad.values()} == {"collision"}
    t = locked.job.targets
    layers = len(locked.job.sliced[0].layers)
    for i, row in bad.items():
        assert t.sub_volume_index[i] == 1
        named = row.detail["blocked_by_layers"]
        assert {x["sub_volume"] for x in named} == {"SV1"}
        assert named[-1]["layer"] == layers - 1
        assert "locked out by SV1 layers" in in_words(row)
        # without them there is nothing in the way, with them there is
        q, deposits_laid = row.attempt[None], locked.job.deposits_before[i : i + 1]
        gone = {x["layer"] for x in named}
        assert Checker(locked.job.scene, locked.table, 0.02, gone).clearances(q, deposits_laid).distance[0] >= 5e-3
        assert Checker(locked.job.scene, locked.table, 0.02).clearances(q, deposits_laid).distance[0] < 5e-3
    assert min(x["layer"] for x in named) > 0  # the first layers may stay
    assert run(make_case("low_first", part=bosses(tmp_path, low, tall, length=60), roll=fixed)).feasible


def test_an_axis_too_slow_is_named(make_case):
    result = run(make_case(robot={"max_speed_deg_s": [0.01, 100, 100, 100, 100, 100]}, roll={"fixed_deg": -60}))
    slow = [row for row in failures(result).values() if row.reason == "speed"]
    assert slow
    for row in slow:
        assert row.detail["axis"] == "A1"
        assert row.detail["needed_deg_s"] > row.detail["allowed_deg_s"] == 0.01


def test_a_slower_bead_is_held_against_its_own_speed(make_case):
    slow_axis = {"robot": {"max_speed_deg_s": [0.1, 100, 100, 100, 100, 100]}, "roll": {"fixed_deg": -60}}
    assert {row.reason for row in failures(run(make_case(**slow_axis))).values()} == {"speed"}
    process = {"speed_by_thickness": [[1.0, 0.1], [2.0, 0.1]], "deposition_speed_mm_s": 8.0}
    assert run(make_case("slow", **slow_axis, process=process)).feasible
