"""A wire far from the part is not looked at, and nothing is missed by that."""

import pickle

import numpy as np
import pytest
from support.jobs.cases import little_case

from cell.case.read import load_case
from cell.collision.checker import NEVER, Checker
from cell.collision.wire import WIRE_REACH, wire_checker
from cell.job.job import prepare


@pytest.mark.parametrize("seed", range(4))
def test_where_a_wire_is_not_looked_at_nothing_of_the_part_is_within_reach(tmp_path, seed):
    job, rng = prepare(load_case(little_case(tmp_path))), np.random.default_rng(seed)
    scene = job.scene
    table = tuple(rng.uniform(*scene.table_range.T))
    wire = wire_checker(Checker(scene, table, 0.05))
    assert wire is not None
    every = Checker(wire.scene, table, WIRE_REACH, pair_gap=NEVER)
    # all round the part's pieces, from in them to some centimetres away
    part = np.flatnonzero(wire.scene.contact_bits[1])
    there = every.posed().geom_xpos[rng.choice(part, 600)] + rng.normal(size=(600, 3)) * rng.choice(
        [0.01, 0.05], (600, 1)
    )
    base, chain = scene.T_world_base(), scene.chain
    Ts = np.tile(np.eye(4), (600, 1, 1))
    turn = np.linalg.qr(rng.normal(size=(600, 3, 3)))[0]
    Ts[:, :3, :3] = turn * np.sign(np.linalg.det(turn))[:, None, None]
    Ts[:, :3, 3] = (there - base[:3, 3]) @ base[:3, :3]
    q, ok = job.solver.next_to(Ts, rng.uniform(chain.lower, chain.upper, (600, chain.n)))
    q = np.concatenate([q[ok], rng.uniform(chain.lower, chain.upper, (100, chain.n))])
    deposits_laid = rng.integers(0, scene.n_deposits + 1, len(q))
    wanted, count = every.clearances(q, deposits_laid), every.asked.count
    for one in (wire, pickle.loads(pickle.dumps(wire))):
        before = one.asked.count
        found = one.clearances(q, deposits_laid)
        assert (np.isfinite(found.distance) == np.isfinite(wanted.distance)).all()
        near = np.isfinite(wanted.distance)
        np.testing.assert_allclose(found.distance[near], wanted.distance[near], atol=1e-6)
        assert one.asked.count - before < count
    far = wanted.distance[near]
    assert near.sum() > 30
    assert far.max() > 0.8 * WIRE_REACH  # some of them hardly within reach
