"""Clearances against MuJoCo's distance of every pair, one by one: nothing within reach is missed."""

from dataclasses import replace
from itertools import product

import mujoco
import numpy as np
import pytest
from support.boss_motion import boss_case, job_of

from cell.collision.checker import Checker
from cell.scene.compose import compose
from cell.scene.placement import place
from ik.roll import apply_roll

TABLE = (np.deg2rad(90.0), np.deg2rad(-180.0))
SAME = 1e-4  # m that the two ways of MuJoCo may differ


def near_the_part(job, count, rng):
    """Configurations with the torch at, near and in the part, and some anywhere, (m, 6), rad."""
    placed = place(job.targets, job.scene.T_base_part(*TABLE)).rows(rng.integers(len(job.targets), size=count))
    Ts = apply_roll(placed.Ts_base_target, rng.uniform(-np.pi, np.pi, count))
    Ts[:, :3, 3] += rng.uniform(-0.03, 0.03, (count, 3)) + 0.02 * placed.normal
    q = job.solver.candidates(Ts).q.reshape(-1, 6)
    q = q[np.isfinite(q[:, 0])]
    chain = job.scene.chain
    return np.concatenate([q[rng.permutation(len(q))[:count]], rng.uniform(chain.lower, chain.upper, (20, 6))])


def one_by_one(scene, q, stage, reach):
    """The least distance of anything of the arm from anything that is not, (m,), m; infinite beyond reach."""
    model, data = scene.model, mujoco.MjData(scene.model)
    data.qpos[scene.table_qpos] = TABLE
    type_, affinity = scene.contact_bits
    there = (scene.deposit_of_geom < stage) & scene.contact_bits.any(axis=0)
    arm, other = np.flatnonzero(there & scene.arm_geom), np.flatnonzero(there & ~scene.arm_geom)
    base = model.body(scene.case.robot.base).id
    pairs = [
        (g, h)
        for g, h in product(arm.tolist(), other.tolist())
        if (type_[g] & affinity[h] or type_[h] & affinity[g]) and model.geom_bodyid[h] != base
    ]
    out = np.full(len(q), np.inf)
    for i, row in enumerate(q):
        data.qpos[scene.arm_qpos] = row
        mujoco.mj_kinematics(model, data)
        for g, h in pairs:
            apart = np.linalg.norm(data.geom_xpos[g] - data.geom_xpos[h])
            if apart > model.geom_rbound[g] + model.geom_rbound[h] + reach and model.geom_rbound[h] > 0:
                continue
            distance = mujoco.mj_geomDistance(model, data, g, h, reach, None)
            if distance < reach:
                out[i] = min(out[i], distance)
    return out


@pytest.mark.parametrize("few", [256, 3], ids=["in one body", "in many bodies"])
@pytest.mark.parametrize("reach", [0.05, 0.01])
def test_nothing_within_reach_is_missed(tmp_path, few, reach):
    job = job_of(boss_case(tmp_path, roll="free"))
    job = replace(job, scene=compose(job.case, job.shape, few))
    scene = job.scene
    names = [scene.model.body(b).name for b in range(scene.model.nbody)]
    assert any(name.startswith("pieces_") for name in names) == (few == 3)
    q = near_the_part(job, 150, np.random.default_rng(5))
    for stage in (1, scene.n_deposits):
        found = Checker(scene, TABLE, reach).clearances(q, np.full(len(q), stage))
        true = one_by_one(scene, q, stage, reach)
        seen = np.isfinite(true)
        assert (true[seen] > SAME).sum() > 5
        assert (true[seen] < -SAME).sum() > 10
        assert np.all(found.distance[seen] <= true[seen] + SAME)
        # what is nearer than that is the arm to itself
        own = scene.arm_geom[found.pair].all(axis=1)
        alike = np.isclose(found.distance, true, atol=SAME) | (~seen & np.isinf(found.distance))
        # a penetration's depth is measured in two ways
        assert np.all(alike | own | (true < 0))
