"""Joints that are not planned stand where the key home has them, or where the case says; all of them are told."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from support.cells.arm_models import arm, table

from cell.case.read import load_case
from cell.errors import InputError
from cell.job.job import prepare
from cell.mjcf.held_joints import hold
from cell.mjcf.held_settings import OwnPlaces
from cell.scene.scene import Scene
from slicing.warning import Code

TREE = """<mujoco><compiler angle="radian" eulerseq="zyx"/><worldbody><body pos="1 2 0" euler="0.3 0.2 0.1">
<joint name="h1" axis="1 2 0" pos="0.1 0 0.2" ref="0.4"/><joint name="p1" axis="0 0 1" pos="0 0.3 0"/>
<joint name="h2" type="slide" axis="0 1 1" ref="0.05"/><joint name="p2" axis="1 0 0" ref="-0.2"/>
<joint type="hinge" axis="0 1 0" pos="0.2 0 0"/><geom size="0.1"/>
<frame pos="0 1 0" euler="0.5 0 0.2"><body name="b" pos="0 0 1" axisangle="0 1 0 0.7"><joint name="b1" type="ball"/>
<geom size="0.1"/><body><joint name="p3" axis="0 1 0.5"/><geom size="0.1"/><site name="end" pos="0.3 0 0.5"/></body>
</body></frame></body></worldbody>
<actuator><position joint="h1"/></actuator>
<keyframe><key name="home" qpos="0.9 0.1 -0.3 0.2 0.6 0.8 0.6 0 0 -0.4"/></keyframe></mujoco>"""
PLANNED = ["p1", "p2", "p3"]


def test_a_model_with_joints_taken_out_moves_as_with_them_held_at_home():
    whole = mujoco.MjSpec.from_string(TREE).compile()
    spec = mujoco.MjSpec.from_string(TREE)
    held = hold(spec, PLANNED, OwnPlaces("robot", "tree.xml", "c.yaml"))
    for key in list(spec.keys):
        spec.delete(key)
    bare = spec.compile()
    assert bare.njnt == 3
    assert len(held.warnings) == 4
    assert held.home == pytest.approx({"p1": 0.1, "p2": 0.2, "p3": -0.4})
    a, b = mujoco.MjData(whole), mujoco.MjData(bare)
    for q in np.random.default_rng(0).uniform(-3, 3, (20, 3)):
        a.qpos[:] = whole.key("home").qpos
        for name, value in zip(PLANNED, q, strict=True):
            a.joint(name).qpos[0] = b.joint(name).qpos[0] = value
        mujoco.mj_kinematics(whole, a)
        mujoco.mj_kinematics(bare, b)
        np.testing.assert_allclose(a.site("end").xpos, b.site("end").xpos, atol=1e-12)
        np.testing.assert_allclose(a.site("end").xmat, b.site("end").xmat, atol=1e-12)


@pytest.fixture
def composed(make_case: Callable[..., Path], tmp_path: Path) -> Callable[..., Scene]:
    def compose(arm: str | None = None, table: str | None = None, **sections: Any) -> Scene:
        for name, text in (("robot", arm), ("positioner", table)):
            if text is not None:
                (tmp_path / f"{name}.xml").write_text(text, encoding="utf-8")
                sections.setdefault(name, {}).setdefault("model", f"./{name}.xml")
        return prepare(load_case(make_case(**sections))).scene

    return compose


TRACK = '<joint name="RAIL" type="slide" axis="0 1 0" range="-2 2"/>'


def told(scene: Scene) -> str:
    return "\n".join(w for w in scene.warnings if w.code == Code.JOINT_HELD)


def test_a_track_stands_where_the_key_home_has_it_and_is_told(composed):
    scene = composed(arm(under=TRACK, before=(2.0,)))
    assert scene.T_world_base()[:3, 3] == pytest.approx([0, 2, 0])
    assert "RAIL is not planned; it stands at 2000 mm (key home)" in told(scene)
    assert np.rad2deg(scene.home) == pytest.approx([0, -90, 90, 0, 0, 0])


def test_a_stated_place_goes_before_the_key(composed):
    scene = composed(arm(under=TRACK, before=(2.0,)), robot={"held_mm": {"RAIL": -500}})
    assert scene.T_world_base()[1, 3] == pytest.approx(-0.5)
    assert "-500 mm (the case)" in told(scene)


def test_without_a_key_a_track_stands_at_zero_and_the_missing_home_is_told(composed):
    scene = composed(arm(under=TRACK, before=(2.0,), key="rest"))
    assert scene.T_world_base()[1, 3] == 0.0
    assert "no key home; it stands at 0 mm" in told(scene)
    assert any(w.code == Code.HOME_UNKNOWN and "'rest'" in w for w in scene.warnings)


def test_a_third_axis_of_a_positioner_is_held_and_told(composed):
    lift = '<joint name="LIFT" type="slide" axis="0 0 1" range="0.1 0.5"/>'
    with pytest.raises(InputError, match=r"LIFT is not planned and would stand at 0 mm.*held_mm"):
        composed(table=table(more=lift))
    low, high = (composed(table=table(more=lift), positioner={"held_mm": {"LIFT": mm}}) for mm in (100, 400))
    up = (high.T_base_part(0, 0.3) - low.T_base_part(0, 0.3))[:3, 3]
    assert up == pytest.approx([0, 0, 0.3])
    assert "LIFT is not planned; it stands at 400 mm (the case)" in told(high)


@pytest.mark.parametrize(
    ("robot", "why"),
    [
        ({"held_deg": {"RAIL": 3}}, "RAIL is not a hinge; its key is held_mm"),
        ({"held_deg": {"A1": 3}}, "A1 is planned"),
        ({"held_mm": {"TRACK": 3}}, "no joint 'TRACK'; the joints that are not planned are RAIL"),
        ({"held_mm": {"RAIL": 2001}}, "outside its range -2000 .. 2000"),
        ({"joints": ["A1", "A2", "A3", "A4", "A5", "B6"]}, "no joint named 'B6'; it has RAIL, A1"),
        ({"base": "link_2"}, "link_2 is moved by joint A2"),
    ],
)
def test_what_cannot_be_held_is_refused(composed, robot, why):
    with pytest.raises(InputError, match=why):
        composed(arm(under=TRACK, before=(2.0,)), robot=robot)


def test_a_joint_that_follows_a_planned_one_is_refused(composed):
    mimic = '<equality><joint joint1="RAIL" joint2="A2" polycoef="0 1 0 0 0"/></equality>'
    with pytest.raises(InputError, match="joint RAIL follows A2"):
        composed(arm(under=TRACK, before=(2.0,), extra=mimic))


def test_a_home_of_more_than_half_a_turn_stays_as_it_is(composed):
    scene = composed(arm(home=(0, -90, 90, 0, 0, 270)))
    assert np.rad2deg(scene.home[5]) == pytest.approx(270)


def test_a_home_outside_the_joint_limits_is_refused(composed):
    with pytest.raises(InputError, match=r"key home.*A6 = 400 deg is outside -350 .. 350"):
        composed(arm(home=(0, -90, 90, 0, 0, 400)))


def test_arms_of_other_than_six_or_seven_axes_are_refused(composed):
    with pytest.raises(InputError, match=r"robot.joints: has 5 joints; six or seven are needed"):
        composed(arm(), robot={"joints": ["A1", "A2", "A3", "A4", "A5"]})


def test_a_track_among_the_planned_joints_is_refused_with_its_key(composed):
    joints = ["RAIL", "A1", "A2", "A3", "A4", "A5", "A6"]
    with pytest.raises(InputError, match=r"RAIL is not a hinge.*robot.held_mm"):
        composed(arm(under=TRACK, before=(2.0,)), robot={"joints": joints, "max_speed_deg_s": [100] * 7})


def test_a_flange_is_where_its_site_is_however_it_is_written(composed):
    plain = arm()
    flange = '<site name="flange" pos="0 0 -0.185" euler="180 0 0"/>'
    framed = '<frame pos="0 0 -0.1" euler="90 0 0"><site name="flange" pos="0 -0.085 0" euler="90 0 0"/></frame>'
    assert plain.count(flange) == 1
    one, two = (composed(text).chain.T_last_tcp for text in (plain, plain.replace(flange, framed)))
    spec = mujoco.MjSpec.from_string(plain.replace(flange, framed)).compile()
    bare = mujoco.MjSpec.from_string(plain).compile()
    np.testing.assert_allclose(spec.site("flange").pos, bare.site("flange").pos, atol=1e-12)
    np.testing.assert_allclose(np.abs(spec.site("flange").quat), np.abs(bare.site("flange").quat), atol=1e-12)
    np.testing.assert_allclose(one, two, atol=1e-9)


LOOSE = """<mujoco><compiler alignfree="{}"/><worldbody><body name="a"><joint name="A"/><geom size=".1"/></body>
<body name="f" pos="1 0 0" euler="0 0 30"><freejoint/><geom name="g" type="box" size=".1 .2 .3" pos=".3 .2 .1"
euler="10 20 30"/></body><body name="m" mocap="true" pos="0 3 0" euler="20 0 0"><geom name="h" pos=".2 0 0" size=".1"/>
</body></worldbody><keyframe><key name="home" qpos="0 2 1 0.5 .5 .5 .5 .5"{}/></keyframe></mujoco>"""


@pytest.mark.parametrize("align", ["true", "false"])
@pytest.mark.parametrize(("dragged", "lines"), [("", 1), (' mpos="1 2 3" mquat="0 1 0 0"', 2)])
def test_loose_and_dragged_bodies_stand_where_the_key_home_has_them(align, dragged, lines):
    text = LOOSE.format(align, dragged)
    whole, spec = mujoco.MjModel.from_xml_string(text), mujoco.MjSpec.from_string(text)
    held = hold(spec, ["A"], OwnPlaces("robot", "loose.xml", "c.yaml"))
    assert len(held.warnings) == lines
    for key in list(spec.keys):
        spec.delete(key)
    for body in spec.bodies:
        body.mocap = False
    bare = spec.compile()
    at, here = mujoco.MjData(whole), mujoco.MjData(bare)
    mujoco.mj_resetDataKeyframe(whole, at, 0)
    for data in (at, here):
        mujoco.mj_kinematics(data.model, data)
    for name in ("g", "h"):
        np.testing.assert_allclose(here.geom(name).xpos, at.geom(name).xpos, atol=1e-9)
        np.testing.assert_allclose(here.geom(name).xmat, at.geom(name).xmat, atol=1e-9)
