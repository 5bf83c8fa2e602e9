"""Clearances against MuJoCo's distance of every pair, one by one: nothing within reach is missed."""

from dataclasses import replace
from itertools import product

import mujoco
import numpy as np
import pytest
from support.cells.cell_models import TORCH, write_case
from support.jobs.boss_motion import boss_case, job_of

from cell.case.read import load_case
from cell.collision.checker import Checker
from cell.job.job import prepare
from cell.scene.compose import compose
from cell.scene.placement import place_targets
from ik.roll import apply_roll

TABLE = (np.deg2rad(90.0), np.deg2rad(-180.0))
SAME = 1e-4  # m that the two ways of MuJoCo may differ


def near_the_part(job, count, rng):
    """Configurations with the torch at, near and in the part, and some anywhere, (m, 6), rad."""
    placed = place_targets(job.targets, job.scene.T_base_part(*TABLE)).rows(rng.integers(len(job.targets), size=count))
    Ts = apply_roll(placed.Ts_base_target, rng.uniform(-np.pi, np.pi, count))
    Ts[:, :3, 3] += rng.uniform(-0.03, 0.03, (count, 3)) + 0.02 * placed.normal
    q = job.solver.candidates(Ts).q.reshape(-1, 6)
    q = q[np.isfinite(q[:, 0])]
    chain = job.scene.chain
    return np.concatenate([q[rng.permutation(len(q))[:count]], rng.uniform(chain.lower, chain.upper, (20, 6))])


def one_by_one(scene, q, deposits_laid, reach):
    """The least distance of anything of the arm from anything that is not, (m,), m; infinite beyond reach."""
    model, data = scene.model, mujoco.MjData(scene.model)
    data.qpos[scene.table_qpos] = TABLE
    type_, affinity = scene.contact_bits
    there = (scene.deposit_of_geom < deposits_laid) & scene.contact_bits.any(axis=0)
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


@pytest.mark.parametrize(
    ("few", "reach"),
    [(256, 0.05), (3, 0.01), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((256, 0.01), (3, 0.05)))],
)
def test_nothing_within_reach_is_missed(tmp_path, few, reach):
    job = job_of(boss_case(tmp_path, roll="free"))
    job = replace(job, scene=compose(job.case, job.shape, few))
    scene = job.scene
    names = [scene.model.body(b).name for b in range(scene.model.nbody)]
    assert any(name.startswith("pieces_") for name in names) == (few == 3)
    q = near_the_part(job, 150, np.random.default_rng(5))
    for deposits_laid in (1, scene.n_deposits):
        found = Checker(scene, TABLE, reach).clearances(q, np.full(len(q), deposits_laid))
        true = one_by_one(scene, q, deposits_laid, reach)
        seen = np.isfinite(true)
        assert (true[seen] > SAME).sum() > 5
        assert (true[seen] < -SAME).sum() > 10
        assert np.all(found.distance[seen] <= true[seen] + SAME)
        # what is nearer than that is the arm to itself
        own = scene.arm_geom[found.pair].all(axis=1)
        alike = np.isclose(found.distance, true, atol=SAME) | (~seen & np.isinf(found.distance))
        # a penetration's depth is measured in two ways
        assert np.all(alike | own | (true < 0))


def test_what_is_laid_is_each_configurations_own(tmp_path):
    """Configurations with more and less of the part laid, in one call, see what a call for each sees."""
    job = job_of(boss_case(tmp_path, roll="free"))
    scene, rng = job.scene, np.random.default_rng(6)
    q = near_the_part(job, 250, rng)
    laid = rng.choice([0, 1, scene.n_deposits], len(q))
    checker = Checker(scene, TABLE, 0.05)
    alone = [checker.clearances(q[i : i + 1], laid[i : i + 1]).distance[0] for i in range(len(q))]
    assert checker.clearances(q, laid).distance == pytest.approx(alone, abs=SAME)
    bare, whole = (checker.clearances(q, np.full(len(q), n)).distance for n in (0, scene.n_deposits))
    matters = bare > whole + SAME
    assert (matters & (laid == 0)).sum() >= 3
    assert (matters & (laid == scene.n_deposits)).sum() >= 3
    within = checker.pairs_within(q, laid, 0.05)
    assert np.array_equal(np.unique(within.row), np.flatnonzero(np.array(alone) < 0.05))


@pytest.mark.slow
def test_small_shapes_in_one_another_are_found_from_however_far_is_looked(tmp_path):
    """Of small shapes that penetrate MuJoCo's distance is off by a share of how far it looks."""
    pytest.importorskip("coal")
    from support.oracles import second_engine as engine

    tip = '<body><geom name="tip" type="cylinder" size="0.0004 0.0002" pos="0 0 0.6"/></body>'
    torch = TORCH.replace("</worldbody>", f"{tip}</worldbody>")
    rng = np.random.default_rng(2)
    off = deep = 0
    for k in range(3):
        # where the tip is at home, some fixture as small as it; the joints shake by less than a millimetre
        scene = prepare(load_case(write_case(tmp_path, f"bare{k}", torch=torch))).scene
        at = _tip(scene, scene.home).geom_xpos[scene.model.geom("tip").id] * 1e3
        speck = {"name": "speck", "position_mm": at.tolist(), "rotation_deg": rng.uniform(-180, 180, 3).tolist()}
        speck["cylinder"] = {"radius_mm": 0.7, "height_mm": (0.02, 0.1, 0.4)[k]}
        scene = prepare(load_case(write_case(tmp_path, f"speck{k}", torch=torch, fixtures=[speck]))).scene
        tip_, speck_ = (scene.model.geom(name).id for name in ("tip", "speck"))
        shapes = [engine.shape_of(scene.model, g) for g in (tip_, speck_)]
        checker = Checker(scene, TABLE, 0.3)
        for _ in range(150):
            q = scene.home + rng.uniform(-1, 1, 6) * (3e-4, 3e-4, 3e-4, 3e-4, 1e-3, 3.0)
            data = _tip(scene, q)
            poses = [engine.placed(data, g) for g in (tip_, speck_)]
            true = engine.signed_distance(shapes[0], poses[0], shapes[1], poses[1])
            if -np.inf < true < -1e-4:
                deep += 1
                assert checker.clearances(q[None], np.array([0])).distance[0] < 0
                off += checker.pairs_within(q[None], np.array([0]), 0.3).distance.min() >= 0
    assert deep > 30
    assert off > 10  # else the test says nothing


def _tip(scene, q):
    data = mujoco.MjData(scene.model)
    data.qpos[scene.arm_qpos] = q
    mujoco.mj_kinematics(scene.model, data)
    return data
