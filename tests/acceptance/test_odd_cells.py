"""Cells of models as other people write them: what is called feasible is so to a second engine on the shapes as given.

bench/odd_cells.py looks at hundreds.
"""

from dataclasses import replace

import numpy as np
import pytest
from support.random_jobs import odd_job, own_result

from cell.case.read import load_case
from cell.job.job import prepare

witness = pytest.importorskip("support.witness")  # of coal


def feasible(folder, seeds, *, odder=False):
    """The first of some random cells that is feasible, and what its own check of motions says."""
    for seed in seeds:
        result, wrong = own_result(odd_job(np.random.default_rng(seed), folder, odder=odder))
        if result.motion is not None:
            return result, wrong
    raise AssertionError("none is feasible")


@pytest.mark.slow
@pytest.mark.parametrize("odder", [False, True])
@pytest.mark.parametrize("seeds", [[(9, k) for k in range(a, a + 8)] for a in (0, 8)])
def test_a_second_engine_finds_nothing_wrong_with_a_feasible_motion(seeds, odder, tmp_path):
    result, wrong = feasible(tmp_path, seeds, odder=odder)
    assert wrong == []
    assert witness.Witness(result).problems() == []


@pytest.mark.slow
def test_the_second_engine_sees_what_is_wrong(tmp_path):
    result, _ = feasible(tmp_path, [(9, k) for k in range(8)])
    motion = result.motion
    welding = np.flatnonzero(motion.arc == 1)
    down, onto = motion.q.copy(), motion.q.copy()
    down[len(down) // 2, 1] += np.deg2rad(70)  # the upper arm falls
    onto[welding[-1]] = motion.q[welding[0]]
    onto[welding[-1], 1] += np.deg2rad(1.0)  # 20 mm lower, where everything is welded
    assert any("floor" in line for line in witness.Witness(replace(result, motion=replace(motion, q=down))).problems())
    found = witness.Witness(replace(result, motion=replace(motion, q=onto))).problems()
    assert any("from metal" in line or "body" in line or "support" in line for line in found)


@pytest.mark.parametrize("seed", range(8))
def test_every_shape_stands_in_the_cell_as_its_own_file_has_it(seed, tmp_path):
    from support.own_shapes import shapes_off

    rng = np.random.default_rng((77, seed))
    job = prepare(load_case(odd_job(rng, tmp_path, odder=True)))
    scene = job.scene
    for _ in range(3):
        q = rng.uniform(scene.chain.lower, scene.chain.upper)
        off = shapes_off(scene, job.case, q, rng.uniform(-2, 2, 2) * scene.has_axis)
        assert max(off.values()) < 1e-6, off
