"""Cells of models as other people write them: what is called feasible is so to a second engine on the shapes as given.

bench/soundness/odd_cells.py looks at hundreds.
"""

from dataclasses import replace

import numpy as np
import pytest
from support.cells.cell_models import ARM, TABLE, write_case
from support.jobs.random_jobs import odd_job, own_result

from cell.case.read import load_case
from cell.job.job import prepare

pytest.importorskip("coal")
from support.oracles import witness


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


@pytest.mark.slow
def test_the_second_engine_sees_a_wire_too_near_to_what_its_torch_clears(tmp_path):
    result, wrong = own_result(write_case(tmp_path, "wire"))
    assert wrong == []
    seen = witness.Witness(result)
    assert seen.problems() == []
    row, q = seen.samples()
    middle = len(row) // 2
    seen._pose(q[middle, :-2], q[middle, -2:])
    (wire,) = seen.torch.wires
    beside = np.eye(4)
    beside[:3, 3] = wire.T[:3, 3] + 0.003 * wire.T[:3, 0] + 0.0055 * wire.T[:3, 2]  # 3 mm off the wire's end
    pin = witness.Solid("pin", "fixed", 0, "", witness.coal.Sphere(1e-4), 1e-4, T=beside)
    seen.fixed.append(pin)
    assert any("wire" in line and "pin" in line for line in seen.problems())


@pytest.mark.parametrize("seed", [*range(3), *(pytest.param(k, marks=pytest.mark.slow) for k in range(3, 8))])
def test_every_shape_stands_in_the_cell_as_its_own_file_has_it(seed, tmp_path):
    from support.cells.own_shapes import shapes_off

    rng = np.random.default_rng((77, seed))
    job = prepare(load_case(odd_job(rng, tmp_path, odder=True)))
    scene = job.scene
    for _ in range(3):
        q = rng.uniform(scene.chain.lower, scene.chain.upper)
        off = shapes_off(scene, job.case, q, rng.uniform(-2, 2, 2) * scene.has_axis)
        assert max(off.values()) < 1e-6, off


def test_bodies_that_a_model_fuses_carry_tool_and_part_where_they_were(tmp_path):
    """Of a model compiled by itself a site's place is told in the body that it is fused into."""
    from support.cells.own_shapes import shapes_off

    turned = '<body name="{}" pos="0.02 0.01 {}" euler="0.1 0.3 0.2">{}</body>'
    flange = '<site name="flange" pos="0.185 0 0" quat="0.7071067811865476 0 0.7071067811865475 0"/>'
    place = '<site name="table" pos="0 0 0.15"/>'
    arm = ARM.replace(flange, turned.format("tool0", 0, flange))
    table = TABLE.replace(place, turned.format("top", 0.05, place))
    fused = [text.replace("<compiler ", '<compiler fusestatic="true" discardvisual="true" ') for text in (arm, table)]
    parts = []
    for name, (a, t) in {"plain": (arm, table), "fused": fused}.items():
        job = prepare(load_case(write_case(tmp_path, name, arm=a, table=t)))
        scene = job.scene
        assert max(shapes_off(scene, job.case, scene.home, np.array([0.5, 1.0])).values()) < 1e-6
        parts.append(scene.T_base_part(0.5, 1.0))
    assert np.allclose(*parts, atol=1e-9)
