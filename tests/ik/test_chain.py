"""Forward kinematics and Jacobians against MuJoCo, py-opw-kinematics and differences."""

import mujoco
import numpy as np
import pytest
from support.cells.arms import (
    JOINTS,
    OPW,
    kr70,
    kr70_model,
    random_class_arm,
    replaced,
    sampled,
    seven_joint_arm,
    welder,
)

from ik.chain import MANY, rotation_about, skew
from ik.dls_kernel import ColumnChain, jacobian, solve_damped


def mujoco_state(q):
    """Pose of the flange and its Jacobian in the base's frame, by MuJoCo."""
    model = kr70_model()
    data = mujoco.MjData(model)
    for name, angle in zip(JOINTS, q, strict=True):
        data.joint(name).qpos = angle
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    base = data.body("base_link").xmat.reshape(3, 3)
    T = np.eye(4)
    T[:3, :3] = base.T @ data.site("flange").xmat.reshape(3, 3)
    T[:3, 3] = base.T @ (data.site("flange").xpos - data.body("base_link").xpos)
    J = np.zeros((6, model.nv))
    mujoco.mj_jacSite(model, data, J[:3], J[3:], model.site("flange").id)
    columns = [model.joint(name).dofadr[0] for name in JOINTS]
    J = J[:, columns]
    J[:3], J[3:] = base.T @ J[:3], base.T @ J[3:]
    return T, J


def test_forward_and_jacobian_are_mujocos():
    chain = kr70()
    q = sampled(chain, 60, seed=1)
    Ts, Js = chain.forward_and_jacobian(q)
    for row, T, J in zip(q, Ts, Js, strict=True):
        T_mujoco, J_mujoco = mujoco_state(row)
        np.testing.assert_allclose(T, T_mujoco, atol=1e-12)
        np.testing.assert_allclose(J, J_mujoco, atol=1e-12)


def test_the_flange_stands_where_the_data_sheet_says():
    T = kr70().forward(np.deg2rad([[0, -90, 90, 0, 0, 0.0]]))[0]
    np.testing.assert_allclose(T[:3, 3], [1.395, 0, 1.515], atol=1e-12)
    np.testing.assert_allclose(T[:3, 2], [1, 0, 0], atol=1e-12)


def test_forward_is_that_of_py_opw_kinematics():
    opw = pytest.importorskip("py_opw_kinematics")
    robot = opw.Robot(opw.KinematicModel(**OPW), degrees=True)
    q = sampled(kr70(), 100, seed=2)
    theirs = np.array([robot.forward(tuple(np.rad2deg(row))).as_matrix() for row in q])
    np.testing.assert_allclose(kr70().forward(q), theirs, atol=1e-9)


@pytest.mark.parametrize("arm", [kr70, welder, seven_joint_arm, lambda: random_class_arm(np.random.default_rng(3))])
def test_jacobian_is_the_derivative(arm):
    chain, h = arm(), 1e-6
    q = sampled(chain, 20, seed=3)
    T, J = chain.forward_and_jacobian(q)
    for j in range(chain.n):
        step = np.zeros(chain.n)
        step[j] = h
        dT = (chain.forward(q + step) - chain.forward(q - step)) / (2 * h)
        spin = dT[:, :3, :3] @ T[:, :3, :3].transpose(0, 2, 1)
        np.testing.assert_allclose(J[:, :3, j], dT[:, :3, 3], atol=1e-8)
        np.testing.assert_allclose(skew(J[:, 3:, j]), spin, atol=1e-8)


@pytest.mark.parametrize("arm", [kr70, welder, seven_joint_arm, lambda: random_class_arm(np.random.default_rng(4))])
def test_columns_are_the_same_kinematics(arm):
    chain = arm()
    q = sampled(chain, 30, seed=4)
    T, J = chain.forward_and_jacobian(q)
    columns = ColumnChain.of(chain, unit=0.5)
    tool, axes, points = columns.frames(q.T)
    c, s = np.cos(columns.tool_roll), np.sin(columns.tool_roll)
    np.testing.assert_allclose(0.5 * tool.p.T, T[:, :3, 3], atol=1e-12)
    np.testing.assert_allclose((c * tool.x + s * tool.y).T, T[:, :3, 0], atol=1e-12)
    np.testing.assert_allclose(tool.z.T, T[:, :3, 2], atol=1e-12)
    mine = jacobian(tool, axes, points, 6)
    turn = np.stack([tool.x, tool.y, tool.z])  # (3, 3, m), rows are the tool's axes
    np.testing.assert_allclose(0.5 * mine[:3].transpose(2, 0, 1), J[:, :3], atol=1e-12)
    np.testing.assert_allclose(mine[3:], np.einsum("rim,min->rnm", turn, J[:, 3:]), atol=1e-12)


def test_damped_steps_minimise_their_sum():
    rng = np.random.default_rng(5)
    A, b, damping = rng.normal(size=(6, 7, 40)), rng.normal(size=(6, 40)), rng.uniform(1e-3, 1, 40)
    x = solve_damped(A, b, damping)
    for k in range(40):
        J = A[:, :, k]
        normal = J.T @ J + damping[k] * np.eye(7)
        np.testing.assert_allclose(normal @ x[:, k], J.T @ b[:, k], atol=1e-9)


def test_a_chain_needs_unit_axes_and_finite_limits():
    with pytest.raises(ValueError, match="unit axis"):
        replaced(kr70(), axes=2 * kr70().axes)
    with pytest.raises(ValueError, match="limits"):
        replaced(kr70(), upper=np.full(6, np.inf))
    with pytest.raises(ValueError, match="limits"):
        replaced(kr70(), upper=kr70().lower)


def test_rotation_about_an_axis_keeps_it():
    axis = np.array([1.0, 2.0, -2.0]) / 3
    R = rotation_about(axis, np.array([0.3, -2.0]))
    np.testing.assert_allclose(R @ axis, np.stack([axis, axis]), atol=1e-15)
    np.testing.assert_allclose(np.trace(R, axis1=1, axis2=2), 1 + 2 * np.cos([0.3, -2.0]), atol=1e-15)


@pytest.mark.parametrize("seed", range(6))
def test_many_configurations_stand_where_each_stands_alone(seed):
    rng = np.random.default_rng(seed)
    chain = [kr70(), seven_joint_arm()][seed] if seed < 2 else random_class_arm(rng, bent_wrist=seed >= 4)
    if seed % 2:  # axes and frames that are askew
        turn = rotation_about(np.array([0.6, 0.0, 0.8]), rng.uniform(0.2, 3.0, chain.n))
        origins = chain.origins.copy()
        origins[:, :3, :3] = origins[:, :3, :3] @ turn
        chain = replaced(chain, origins=origins, axes=np.einsum("nij,nj->ni", turn, chain.axes))
    q = sampled(chain, MANY + 7, seed)
    R, p = chain.frames(q)
    for k in range(0, len(q), 9):
        one = chain.frames(q[k : k + 1])
        np.testing.assert_allclose(R[k], one[0][0], atol=1e-14)
        np.testing.assert_allclose(p[k], one[1][0], atol=1e-14)
