"""Links of which one body has several joints: MuJoCo takes the links beside it for neighbours."""

import mujoco
import numpy as np
import pytest
from support.cells.arm_models import HOME, arm

from cell.case.read import load_case
from cell.collision.checker import Checker
from cell.job.job import prepare
from slicing.warning import Code

A4 = '<joint name="A4" axis="0 0 1" range="-180 180"/>'
A3_END = 'range="-120 165"/>'
FOREARM = '<geom type="capsule" size="0.09" fromto="0 0 -0.285 0 0 -0.885"/>'
ELBOW = '<geom type="capsule" size="0.12" fromto="0 0 0 0.135 -0.035 0"/>'
UPPER_ARM = '<geom type="capsule" size="0.09" fromto="0.025 0 0.17 0.825 0 0.17"/>'


def in_one_body(text):
    """The arm with A3 and A4 in one body, link_4 welded to it."""
    assert text.count(A4) == text.count(A3_END) == 1
    assert ELBOW in text
    both = f'{A3_END}<joint name="A4" pos="0 -0.05 0" axis="-1 0 0" range="-180 180"/>'
    return text.replace(A4, "").replace(A3_END, both).replace(ELBOW, '<geom name="elbow" size="0.04"/>')


def at_home(make_case, tmp_path, text):
    (tmp_path / "arm.xml").write_text(text)
    job = prepare(load_case(make_case(robot={"model": str(tmp_path / "arm.xml")})))
    q = np.deg2rad([HOME])
    return job, Checker(job.scene, (0.0, 0.0), 0.05).clearances(q, np.zeros(1, dtype=int))


@pytest.mark.parametrize(("off", "distance"), [(0.14, 0.02), (0.1, -0.02)])
def test_links_with_two_joints_between_are_held_against_each_other(make_case, tmp_path, off, distance):
    # a ball on the upper arm, so far from the forearm's axis
    ball = f'<geom name="ball" type="sphere" size="0.03" pos="0.94 0.5 {off}"/>'
    text = arm().replace(FOREARM, FOREARM.replace("<geom", '<geom name="forearm"')).replace(UPPER_ARM, UPPER_ARM + ball)
    job, found = at_home(make_case, tmp_path, in_one_body(text))
    assert {job.scene.geom_name(g) for g in found.pair[0].tolist()} == {"ball", "forearm"}
    assert found.distance[0] == pytest.approx(distance, abs=1e-5)
    assert [w for w in job.warnings if getattr(w, "code", None) is Code.PAIR_LEFT_OUT] == []


def test_links_that_always_touch_are_left_out_and_said(make_case, tmp_path):
    hub = '<geom name="hub" type="sphere" size="0.1" pos="0.89 0 0"/>'
    job, found = at_home(make_case, tmp_path, in_one_body(arm().replace(UPPER_ARM, UPPER_ARM + hub)))
    assert found.distance[0] > 0.0
    said = [w for w in job.warnings if getattr(w, "code", None) is Code.PAIR_LEFT_OUT]
    assert len(said) == 1
    assert "hub - elbow" in said[0]


HOSE = """<body name="hose" pos="0 0 -0.9"><inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
<joint name="swing" axis="0 1 0" range="-30 30"/><geom name="hose" type="sphere" size="0.03" pos="{} 0 -0.2"/></body>"""
LINK_5 = '<body name="link_5"'
WRIST = '<geom type="capsule" size="0.06" fromto="0 0 0 0.06 0 0"/>'
GUIDE = '<geom name="guide" type="sphere" size="0.03" pos="0.065 0 -0.15"/>'


def with_hose(off, *, named=True):
    """The arm with a hose on link_4 that swings and a guide on link_5, without a key."""
    hose = HOSE.format(off) if named else HOSE.format(off).replace('<body name="hose"', "<body")
    text = arm(home=None).replace(LINK_5, hose + LINK_5).replace(WRIST, WRIST + GUIDE)
    assert "swing" in text
    assert "guide" in text
    return text


def as_mujoco_has_it(text, one, other):
    """The contact of two shapes at HOME in the model by itself, m; None where there is none."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for number, value in enumerate(HOME, start=1):
        data.joint(f"A{number}").qpos[0] = np.deg2rad(value)
    mujoco.mj_fwdPosition(model, data)
    pairs = {model.geom(one).id, model.geom(other).id}
    return next((c.dist for c in data.contact if {int(g) for g in c.geom} == pairs), None)


@pytest.mark.parametrize("named", [True, False])
def test_a_hose_that_is_held_is_held_against_the_next_link_as_where_it_swings(make_case, tmp_path, named):
    text = with_hose(-0.2, named=named)
    plain = as_mujoco_has_it(text, "hose", "guide")
    assert plain is not None
    job, found = at_home(make_case, tmp_path, text)
    assert {job.scene.geom_name(g) for g in found.pair[0].tolist()} == {"hose", "guide"}
    assert found.distance[0] == pytest.approx(plain, abs=1e-6)


def test_a_hose_that_the_model_excludes_stays_excluded(make_case, tmp_path):
    exclude = '<exclude body1="hose" body2="link_5"/><exclude body1="link_4" body2="link_6"/>'
    text = with_hose(-0.2).replace('<exclude body1="link_4" body2="link_6"/>', exclude)
    assert as_mujoco_has_it(text, "hose", "guide") is None
    job, found = at_home(make_case, tmp_path, text)
    assert {job.scene.geom_name(g) for g in found.pair[0].tolist()} != {"hose", "guide"}
