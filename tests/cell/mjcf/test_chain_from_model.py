"""The chain taken from a model moves as MuJoCo moves it, however the model is written."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from support.cells.cell_models import ARM, write_case

from cell.case.read import load_case
from cell.errors import InputError
from cell.job.job import prepare
from cell.mjcf.chain_from_model import chain_of


def model_of(seed: int, joints_a_body: int) -> mujoco.MjModel:
    """Six hinges with references, anchors and axes at random, in a base that is turned, several to a body."""
    rng = np.random.default_rng(seed)

    def numbers(*size: int) -> str:
        return " ".join(f"{v:.9f}" for v in rng.normal(size=size))

    text = '<site name="tip" pos="0.1 0.2 0.3" euler="10 20 30"/>'
    names = [f"J{i}" for i in range(6)]
    for group in [names[i : i + joints_a_body] for i in range(0, 6, joints_a_body)][::-1]:
        hinges = "".join(
            f'<joint name="{n}" axis="{numbers(3)}" pos="{numbers(3)}" range="-100 100" ref="{10 * rng.normal():.6f}"/>'
            for n in group
        )
        frame = f'<frame pos="{numbers(3)}" euler="{numbers(3)}">'
        text = f'{frame}<body pos="{numbers(3)}" quat="{numbers(4)}">{hinges}<geom size="0.1"/>{text}</body></frame>'
    text = f'<body name="root" pos="{numbers(3)}" quat="{numbers(4)}"><geom size="0.1"/>{text}</body>'
    return mujoco.MjModel.from_xml_string(f'<mujoco><compiler angle="degree"/><worldbody>{text}</worldbody></mujoco>')


@pytest.mark.parametrize("joints_a_body", [1, 2, 3])
def test_forward_kinematics_is_mujocos(joints_a_body):
    for seed in range(4):
        model = model_of(seed, joints_a_body)
        chain = chain_of(model, [f"J{i}" for i in range(6)], "tip", "root")
        data = mujoco.MjData(model)
        for q in np.random.default_rng(seed).uniform(-1.7, 1.7, (5, 6)):
            data.qpos[:] = q
            mujoco.mj_kinematics(model, data)
            base = np.eye(4)
            base[:3, :3], base[:3, 3] = data.body("root").xmat.reshape(3, 3), data.body("root").xpos
            T = base @ chain.forward(q[None])[0]
            np.testing.assert_allclose(T[:3, 3], data.site("tip").xpos, atol=1e-9)
            np.testing.assert_allclose(T[:3, :3], data.site("tip").xmat.reshape(3, 3), atol=1e-9)


@pytest.mark.parametrize("name", ["E1", "E2"])
def test_a_joint_of_the_arm_that_is_called_as_the_tables_is_refused(tmp_path, name):
    """A motion would have two columns of that name."""
    assert ARM.count('"A3"') == 1
    joints = ["A1", "A2", name, "A4", "A5", "A6"]
    path = write_case(tmp_path, "cell", arm=ARM.replace('"A3"', f'"{name}"'), robot={"joints": joints})
    with pytest.raises(InputError, match=rf"robot\.joints: {name} is what an axis of the table is called"):
        prepare(load_case(path))
