"""Between samples: what lies there is found, and the bound on the arm's travel holds."""

import mujoco
import numpy as np

from cell.case.read import load_case
from cell.collision.checker import Checker
from cell.collision.proofs.between_samples import unproven_steps
from cell.collision.proofs.reach_radii import radii
from cell.job.job import prepare


def scene_of(path):
    return prepare(load_case(path)).scene


def test_no_point_of_the_arm_is_further_from_a_joint_than_its_radius(make_case):
    scene = scene_of(make_case())
    model, data = scene.model, mujoco.MjData(scene.model)
    radius = radii(scene)
    rng = np.random.default_rng(1)
    arm = np.flatnonzero(scene.arm_geom & (model.geom_contype != 0))
    for q in rng.uniform(scene.chain.lower, scene.chain.upper, (40, 6)):
        for j in range(6):
            centres = []
            for turn in (0.0, 1e-3):
                data.qpos[scene.arm_qpos] = q + turn * np.eye(6)[j]
                mujoco.mj_kinematics(model, data)
                centres.append(data.geom_xpos[arm].copy())
            moved = np.linalg.norm(centres[1] - centres[0], axis=1).max()
            assert moved <= 1e-3 * radius[j]


def test_a_plate_between_two_free_samples_is_found(make_case):
    scene = scene_of(make_case())
    tcp = (scene.T_world_base() @ scene.chain.forward(scene.home[None])[0])[:3, 3]
    plate = {"name": "plate", "box": {"size_mm": [200, 2, 200]}, "position_mm": [float(v) * 1e3 for v in tcp]}
    for fixtures, free in (([], True), ([plate], False)):
        scene = scene_of(make_case(f"plates{len(fixtures)}", fixtures=fixtures))
        checker = Checker(scene, (0.0, 0.0), 0.05)
        q = scene.home + np.deg2rad([[-10.0], [10.0]]) * np.eye(6)[0]
        deposits_laid = np.zeros(2, dtype=np.int64)
        found = checker.clearances(q, deposits_laid)
        assert found.distance.min() > 0.02  # both ends see nothing near
        step, nearest = unproven_steps(checker, radii(scene), q, deposits_laid, found)
        assert (len(step) == 0) is free
        if not free:
            assert "plate" in [scene.geom_name(int(g)) for g in nearest.pair[0]]


def test_steps_from_one_motion_to_another_are_not_looked_at(make_case):
    scene = scene_of(make_case())
    checker = Checker(scene, (0.0, 0.0), 0.05)
    folded = np.deg2rad([0.0, -60.0, 160.0, 0.0, 100.0, 0.0])  # collides
    q = np.array([scene.home, folded])
    found = checker.clearances(q, np.zeros(2, dtype=np.int64))
    assert len(unproven_steps(checker, radii(scene), q, np.zeros(2, dtype=np.int64), found, np.array([0, 1]))[0]) == 0
    assert len(unproven_steps(checker, radii(scene), q, np.zeros(2, dtype=np.int64), found)[0]) == 1


def test_standing_still_is_free_where_the_sample_is(make_case):
    scene = scene_of(make_case())
    checker = Checker(scene, (0.0, 0.0), 0.05)
    q = np.repeat(scene.home[None], 3, axis=0)
    deposits_laid = np.zeros(3, dtype=np.int64)
    assert len(unproven_steps(checker, radii(scene), q, deposits_laid, checker.clearances(q, deposits_laid))[0]) == 0
