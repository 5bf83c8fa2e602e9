"""Couplings that a motion of the planned joints would break are refused; all others are said.

Of random models the second opinion is MuJoCo's own: a constraint that the planned joints do not break keeps the
violation that it has, wherever they stand.
"""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from cell.errors import InputError
from cell.mjcf.couplings import check_couplings
from cell.mjcf.held_joints import hold
from cell.mjcf.held_settings import OwnPlaces
from slicing.warning import Code

OWN = OwnPlaces("robot", "arm.xml", "c.yaml")
PLANNED = ("A1", "A2", "A3")
# a palletiser's three links with the rod beside them, a finger's two joints, a body that a user drags
ARM = """<mujoco><compiler angle="degree" autolimits="true"/><worldbody>
<body name="goal" mocap="true"/><body name="base"><geom size=".1"/><site name="at_base"/>
<body name="l1"><joint name="A1" axis="0 0 1"/><geom size=".1"/><site name="at_1"/>
<body name="rod" pos="0 .2 0"><joint name="R" axis="0 1 0"/><geom type="capsule" size=".03" fromto="0 0 0 .8 0 0"/>
</body>
<body name="crank" pos="0 .3 0"><joint name="K" axis="0 1 0"/><geom size=".1"/></body>
<body name="l2"><joint name="A2" axis="0 1 0"/><geom size=".1"/>
<body name="l3" pos=".8 0 0"><joint name="A3" axis="0 1 0"/><geom size=".1"/><site name="at_3" pos="0 0 .1"/>
<body name="f1"><joint name="F1" axis="0 1 0" range="0 30"/><geom size=".02"/></body>
<body name="f2"><joint name="F2" axis="0 1 0" range="0 30"/><geom size=".02"/></body></body></body></body></body>
</worldbody>{}</mujoco>"""


def held(text: str):
    spec = mujoco.MjSpec.from_string(ARM.format(text))
    return hold(spec, PLANNED, OWN), spec


def told(text: str) -> list[str]:
    found, _ = held(text)
    return [line for line in found.warnings if line.code is Code.MODEL_ELEMENT_LEFT_OUT]


TENDON = '<tendon><fixed name="t"{}><joint joint="A2" coef="1"/><joint joint="{}" coef="1"/></fixed></tendon>'


@pytest.mark.parametrize(
    ("coupling", "words"),
    [
        ('<equality><connect body1="rod" body2="l3" anchor=".8 0 0"/></equality>', "rod is tied to l3.*A2, A3 move"),
        ('<equality><weld body1="rod" body2="l2"/></equality>', "rod is tied to l2.*A2 moves"),
        ('<equality><connect site1="at_1" site2="at_3"/></equality>', "l1 is tied to l3.*A2, A3 move"),
        ('<equality><connect body1="l3" anchor="0 0 0"/></equality>', "l3 is tied to world.*A1, A2, A3 move"),
        ('<equality><joint joint1="A3" joint2="A2" polycoef="0 -1 0 0 0"/></equality>', "A3 follows A2"),
        ('<equality><joint joint1="R" joint2="A2"/></equality>', "R follows A2"),
        ('<equality><joint joint1="A2" joint2="R"/></equality>', "R follows A2"),
        ('<equality><joint joint1="A2"/></equality>', "A2 is fixed in its place"),
        (TENDON.format("", "A3") + '<equality><tendon tendon1="t"/></equality>', "tendon t couples A2, A3"),
        (TENDON.format("", "R") + '<equality><tendon tendon1="t"/></equality>', "tendon t couples A2 "),
    ],
)
def test_couplings_that_planned_joints_would_break_are_refused(coupling, words):
    with pytest.raises(InputError, match=words):
        held(coupling)


@pytest.mark.parametrize(
    "coupling",
    [
        '<connect body1="rod" body2="l3" anchor=".8 0 0" active="false"/>',
        '<weld body1="goal" body2="l3"/>',
        '<connect body1="rod" body2="crank" anchor=".1 0 0"/>',
        '<joint joint1="F1" joint2="F2"/>',
        '<joint joint1="A3" joint2="A2" active="false"/>',
    ],
)
def test_couplings_that_hold_all_along_are_left_out_and_said(coupling):
    found, spec = held(f"<equality>{coupling}</equality>")
    (line,) = [w for w in found.warnings if w.code is Code.MODEL_ELEMENT_LEFT_OUT]
    assert "1 equality constraint" in line
    assert not len(spec.equalities)


def test_a_tendon_that_limits_planned_joints_is_said():
    (line,) = told(TENDON.format(' range="-10 10"', "A3"))
    assert "tendon t limits A2, A3" in line
    (line,) = told('<tendon><spatial name="hose" range="0 1"><site site="at_1"/><site site="at_3"/></spatial></tendon>')
    assert "hose limits A2, A3" in line
    assert told(TENDON.format("", "A3")) == []
    assert told('<tendon><fixed name="t" range="-1 1"><joint joint="F1" coef="1"/></fixed></tendon>') == []


def violation(model: mujoco.MjModel, q: np.ndarray) -> np.ndarray:
    """How far MuJoCo finds its constraints broken."""
    data = mujoco.MjData(model)
    for name, value in zip(PLANNED, q, strict=True):
        data.joint(name).qpos[0] = value
    mujoco.mj_forward(model, data)
    return data.efc_pos[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY].copy()


def test_random_ties_are_refused_where_mujoco_says_that_planned_joints_break_them():
    rng = np.random.default_rng(5)
    bodies = ["base", "l1", "l2", "l3", "rod", "crank", "f1", "f2"]
    joints = [*PLANNED, "R", "K", "F1", "F2"]
    seen = set()
    for _ in range(60):
        if rng.random() < 0.6:
            one, two = rng.choice(bodies, 2, replace=False)
            kind = rng.choice(["connect", "weld"])
            more = f' anchor="{rng.uniform(0.1, 1):.2f} .3 .2"' if kind == "connect" else ""
            tie = f'<{kind} body1="{one}" body2="{two}"{more}/>'
        else:
            one, two = rng.choice(joints, 2, replace=False)
            tie = f'<joint joint1="{one}" joint2="{two}" polycoef="0 {rng.uniform(0.3, 2):.2f} 0 0 0"/>'
        model = mujoco.MjSpec.from_string(ARM.format(f"<equality>{tie}</equality>")).compile()
        off = [violation(model, q) for q in rng.uniform(-1, 1, (6, 3))]
        broken = bool(np.ptp(np.array(off), axis=0).max() > 1e-9)
        try:
            check_couplings(model, PLANNED, OWN)
            refused = False
        except InputError:
            refused = True
        assert refused == broken, tie
        seen.add((refused, tie.split()[0]))
    assert len(seen) == 6


def test_many_joints_without_a_name_are_told_in_one_line():
    cable = '<body><joint type="ball"/><geom size=".01"/>' * 9 + "</body>" * 9
    text = ARM.format("").replace('<body name="crank"', f'{cable}<body name="crank"')
    spec = mujoco.MjSpec.from_string(text)
    lines = [w for w in hold(spec, PLANNED, OWN).warnings if "without a name" in w]
    (line,) = lines
    assert "9 joints without a name are not planned" in line
    assert "each stands as its model turns it" in line
    assert len(spec.joints) == len(PLANNED)
