"""A positioner as it was measured: the table is where the controller's chain of frames has it, at every E1 and E2."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from support.cells.cell_models import TABLE

import cell
from cell.errors import InputError
from cell.rigid import inverse, pose

# a real turntable's second axis, as published with RoboDK's calibration macro; the rest of the same kind
SKEW = {
    "root_mm_deg": [2133.49, -53.28, -89.3, -0.88, -0.13, 0.17],
    "axis_1_mm_deg": [3.0, -2.0, 421.0, 1.5, 90.4, 91.2],
    "axis_2_mm_deg": [75.581, 2.737, -5.883, 90.42, 89.373, 89.674],
    "flange_mm_deg": [0.4, -0.3, 148.0, 12.0, 0.2, -0.3],
}
ANGLES = np.deg2rad([[0, 0], [35, 0], [0, 120], [-80, -170], [110, 77]])


def turn(axis, angle_deg):
    c, s = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    out = np.eye(4)
    i, j = {"z": (0, 1), "y": (2, 0), "x": (1, 2)}[axis]
    out[i, i] = out[j, j] = c
    out[i, j], out[j, i] = -s, s
    return out


def frame(x, y, z, a, b, c):
    """A controller's frame: Rz(A) Ry(B) Rx(C), multiplied one by one."""
    out = turn("z", a) @ turn("y", b) @ turn("x", c)
    out[:3, 3] = np.array([x, y, z]) / 1000
    return out


def chain(told, E1, E2):
    """The table in the world by the controller's own chain."""
    T = frame(*told["root_mm_deg"]) @ frame(*told.get("axis_1_mm_deg", [0] * 6)) @ turn("z", np.rad2deg(E1))
    if "axis_2_mm_deg" in told:
        T = T @ frame(*told["axis_2_mm_deg"]) @ turn("z", np.rad2deg(E2))
    return T @ frame(*told["flange_mm_deg"])


def table_at(scene, E1, E2):
    data = mujoco.MjData(scene.model)
    data.qpos[scene.table_qpos] = E1, E2
    mujoco.mj_kinematics(scene.model, data)
    site = scene.sites["table"]
    return pose(data.site_xpos[site], data.site_xmat[site])


def scene_of(make_case, **positioner):
    return cell.prepare(cell.load_case(make_case(positioner=positioner))).scene


IN_FRAMES = TABLE.replace(
    '<body name="turn">', '<frame pos="0.01 0 0.02" euler="0 0 30"><body name="turn" euler="10 0 0">'
).replace("</body></body></body></worldbody>", "</body></frame></body></body></worldbody>")
REFERENCE = TABLE.replace('range="-185 185"/>', 'range="-185 185" ref="25"/>')


@pytest.mark.parametrize("model", ["kp2_hv500", TABLE, IN_FRAMES, REFERENCE])
def test_the_table_is_where_the_controllers_chain_has_it(make_case, tmp_path, model):
    if model.lstrip().startswith("<"):
        (tmp_path / "table.xml").write_text(model, encoding="utf-8")
        model = "table.xml"
    scene = scene_of(make_case, model=model, calibration=SKEW)
    for E1, E2 in ANGLES:
        np.testing.assert_allclose(table_at(scene, E1, E2), chain(SKEW, E1, E2), atol=1e-9)


def test_the_models_own_frames_leave_the_cell_as_it_is(make_case):
    """However their zero directions and heights along the axes were chosen."""
    drawn = scene_of(make_case, position_mm=[1500, 100, 0], rotation_deg=[0, 0, -90])
    gauge_1, gauge_2 = turn("z", 33), turn("z", -71)
    gauge_1[2, 3], gauge_2[2, 3] = 0.2, -0.1
    first = frame(1500, 100, 0, -90, 0, 0) @ frame(0, 0, 350, 0, 0, 0)
    # E1 turns about -y of the device, E2 about its z
    first[:3, :3] = first[:3, :3] @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    axis_2 = np.eye(4)
    axis_2[:3, :3] = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
    flange = frame(0, 0, 150, 0, 0, 0)
    told = {
        "root_mm_deg": numbers(first @ gauge_1),
        "axis_2_mm_deg": numbers(inverse(gauge_1) @ axis_2 @ gauge_2),
        "flange_mm_deg": numbers(inverse(gauge_2) @ flange),
    }
    measured = scene_of(make_case, position_mm=[1500, 100, 0], rotation_deg=[0, 0, -90], calibration=told)
    elsewhere = scene_of(make_case, position_mm=[0, 900, 0], calibration=told)
    one, two, three = (geoms_at(scene, 0.4, 1.1) for scene in (drawn, measured, elsewhere))
    np.testing.assert_allclose(two, one, atol=1e-9)
    np.testing.assert_allclose(three, one, atol=1e-9)
    assert not [line for line in measured.warnings if "calibration" in line]


def numbers(T):
    """X Y Z A B C of a frame."""
    R = T[:3, :3]
    b = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    if np.cos(b) < 1e-9:
        a, c = 0.0, np.arctan2(np.sign(-R[2, 0]) * R[0, 1], R[1, 1])
    else:
        a, c = np.arctan2(R[1, 0], R[0, 0]), np.arctan2(R[2, 1], R[2, 2])
    return [*(T[:3, 3] * 1000).tolist(), *np.rad2deg([a, b, c]).tolist()]


def geoms_at(scene, E1, E2):
    data = mujoco.MjData(scene.model)
    data.qpos[scene.table_qpos] = E1, E2
    mujoco.mj_kinematics(scene.model, data)
    return np.concatenate([data.geom_xpos, data.geom_xmat], axis=1)


def test_a_turntable_has_one_axis(make_case, tmp_path):
    one = TABLE.replace('<joint name="E1" axis="0 -1 0" range="-135 135"/>', "")
    (tmp_path / "table.xml").write_text(one, encoding="utf-8")
    told = {"root_mm_deg": [1500, 20, 340, 15, 0.3, -0.2], "flange_mm_deg": [1, -2, 155, 20, 0.1, 0.2]}
    scene = scene_of(make_case, model="table.xml", joints=["E2"], calibration=told)
    for angle in np.deg2rad([0, 50, -120]):
        np.testing.assert_allclose(table_at(scene, 0, angle), chain(told, angle, 0), atol=1e-9)


def test_frames_that_are_far_from_the_model_are_told_of(make_case):
    slip = {**SKEW, "axis_2_mm_deg": [75.581, 2.737, -5.883, 90.42, 179.373, 89.674]}
    codes = {line.code: line for line in scene_of(make_case, calibration=slip).warnings}
    assert "axis_2_mm_deg is" in codes["calibration_far"]


@pytest.mark.parametrize(
    ("positioner", "says"),
    [
        ({"calibration": {**SKEW, "axis_2_mm_deg": None}}, "axis_2_mm_deg is needed"),
        ({"joints": ["E2"], "model": "turn.xml", "calibration": SKEW}, "leave axis_2_mm_deg out"),
        ({"model": "none", "calibration": SKEW}, "the table has no axes"),
    ],
)
def test_frames_that_the_positioner_has_not_are_refused(make_case, tmp_path, positioner, says):
    (tmp_path / "turn.xml").write_text(TABLE.replace('<joint name="E1" axis="0 -1 0" range="-135 135"/>', ""), "utf-8")
    with pytest.raises(InputError, match=says):
        scene_of(make_case, **positioner)


def test_a_frame_has_six_numbers(make_case):
    with pytest.raises(InputError, match="root_mm_deg"):
        cell.load_case(make_case(positioner={"calibration": {"root_mm_deg": [1, 2, 3]}}))
