"""The arm's own kinematics leaves MuJoCo's data as MuJoCo's does."""

import mujoco
import numpy as np

from cell.case.read import load_case
from cell.collision import checker as collision
from cell.collision.arm_poses import ArmPoses
from cell.collision.checker import Checker
from cell.collision.table_clearances import table_alone
from cell.job.job import prepare


def test_poses_are_mujocos(make_case):
    scene = prepare(load_case(make_case())).scene
    model, mine, theirs = scene.model, mujoco.MjData(scene.model), mujoco.MjData(scene.model)
    mujoco.mj_kinematics(model, mine)
    q = np.random.default_rng(3).uniform(scene.chain.lower, scene.chain.upper, (300, 6))
    hard = scene.contact_bits.any(axis=0)
    for row, _ in zip(q, ArmPoses(scene).put(mine, q), strict=True):
        theirs.qpos[scene.arm_qpos] = row
        mujoco.mj_kinematics(model, theirs)
        for name in ("xpos", "xmat", "xipos", "ximat"):
            assert np.allclose(getattr(mine, name), getattr(theirs, name), atol=1e-12)
        for name in ("geom_xpos", "geom_xmat"):
            assert np.allclose(getattr(mine, name)[hard], getattr(theirs, name)[hard], atol=1e-12)


def test_clearances_are_the_same_either_way(make_case, monkeypatch):
    scene = prepare(load_case(make_case())).scene
    q = np.random.default_rng(4).uniform(scene.chain.lower, scene.chain.upper, (200, 6))
    deposits_laid = np.arange(200) % 3
    plain = Checker(scene, (0.4, -1.0), 0.05).clearances(q, deposits_laid)
    monkeypatch.setattr(collision, "MANY_GEOMS", 0)
    quick = Checker(scene, (0.4, -1.0), 0.05)
    quick.clearances(q[::-1], deposits_laid)  # puts the arm elsewhere, which must not matter
    found = quick.clearances(q, deposits_laid)
    assert np.isfinite(plain.distance).any()
    assert np.allclose(plain.distance, found.distance, atol=1e-9)


def test_what_stands_on_the_table_is_not_the_arms_affair(make_case):
    post = {"name": "post", "box": {"size_mm": [20, 20, 20]}, "position_mm": [1500, 270, 375]}  # in the boss' way
    scene = prepare(load_case(make_case(fixtures=[post]))).scene
    checker = Checker(scene, (np.pi / 2, -np.pi), 0.005)
    assert table_alone(scene, (np.pi / 2, -np.pi)).distance[0] < 0
    assert checker.clearances(scene.home[None], np.array([99])).distance[0] > 0
