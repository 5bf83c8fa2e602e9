"""What a check writes, the check of motions accepts, with the same least clearance."""

import numpy as np
import pytest
from support.cells.cell_models import write_case
from support.jobs.random_jobs import own_motion, own_result, random_job


def test_a_bead_that_is_run_back_to_is_the_same_bead_in_its_own_motion(make_case):
    beads = {"pattern": "zigzag", "width_mm": 3.6, "lead_in_mm": 0.75, "lead_out_mm": 0.3}
    assert own_motion(make_case(beads=beads, process={"least_speed_share": 0.0})) == []


def test_targets_at_one_place_are_passed_at_one_time(make_case):
    beads = {"pattern": "contour_parallel", "width_mm": 5, "lead_in_mm": 2, "lead_out_mm": 2}
    path = make_case(beads=beads, sampling={"min_segment_mm": 5}, process={"least_speed_share": 0.0})
    assert own_motion(path) == []


@pytest.mark.slow
def test_where_nothing_comes_near_no_least_clearance_is_told(tmp_path):
    """A wire so long that all else stays away: proofs look further than clearances are known."""
    torch = (
        '<mujoco><worldbody><body><geom type="cylinder" size="0.03" fromto="0 0 0.05 0 0 0.4"/>'
        '<geom type="cylinder" size="0.012" fromto="0 0 0.42 0.3 0 0.42"/>'
        '<geom name="wire" type="cylinder" size="0.0006" fromto="0.3 0 0.42 0.4 0 0.42"/>'
        '<site name="tcp" pos="0.4 0 0.42" euler="0 90 0"/></body></worldbody></mujoco>'
    )
    result, wrong = own_result(write_case(tmp_path, "long", torch=torch, floor=False))
    assert wrong == []
    assert result.motion is not None
    assert result.clearance is None


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_random_own_motions_are_feasible_and_as_near(seed, tmp_path):
    for k in range(20):
        wrong = own_motion(random_job(np.random.default_rng((seed, k)), tmp_path), ("csv", "npz")[k % 2])
        if wrong is not None:
            break
    assert wrong == []
