"""A check changes nothing of the scene it is given, so that threads may share it."""

from concurrent.futures import ThreadPoolExecutor

import mujoco
import numpy as np
import pytest
from support.jobs.cases import little_case

from cell.case.read import load_case
from cell.job.job import prepare
from cell.motion.motion_file import read_motion, write_motion
from cell.verdict.check import check_fixed
from cell.verification.motion_check import check_motion

POSES = [(90, 180), (90, 175), (60, 180)]


def content(model):
    out = np.empty(mujoco.mj_sizeModel(model), dtype=np.uint8)
    mujoco.mj_saveModel(model, None, out)
    return out


def verdict(result):
    least = None if result.clearance is None else result.clearance.value
    return result.feasible, result.infeasible, least, result.reasons


@pytest.mark.slow
def test_checks_in_threads_say_what_checks_one_after_the_other_say_and_leave_the_scene_as_it_was(tmp_path):
    job = prepare(load_case(little_case(tmp_path)))
    before = content(job.scene.model)
    alone = [check_fixed(job, *pose) for pose in POSES]
    write_motion(tmp_path / "m.csv", alone[0].motion)
    read = read_motion(tmp_path / "m.csv", job)
    held = check_motion(job, read).clearance
    assert (content(job.scene.model) == before).all()
    with ThreadPoolExecutor(4) as pool:
        motion = pool.submit(check_motion, job, read)
        together = list(pool.map(lambda pose: check_fixed(job, *pose), POSES))
    assert [verdict(r) for r in together] == [verdict(r) for r in alone]
    assert motion.result().clearance == held
