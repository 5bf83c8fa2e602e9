"""Links of which one body has several joints: MuJoCo takes the links beside it for neighbours."""

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
