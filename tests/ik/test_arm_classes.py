"""Verdicts on arms whose frames are rounded, and on arms whose margins do not count."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.cells.arm_models import arm

from cell.case.read import load_case
from cell.collision.proofs.reach_radii import radii
from cell.job.job import prepare
from cell.verdict.check import check_fixed
from cell.verdict.result import Result
from slicing.warning import Code

ROUNDED = f"{np.rad2deg(1.5708):.12g}"  # a right angle as exporters of URDF write it


@pytest.fixture
def checked(make_case: Callable[..., Path], tmp_path: Path) -> Callable[..., Result]:
    def run(model: str, **sections: Any) -> Result:
        (tmp_path / "arm.xml").write_text(model, encoding="utf-8")
        job = prepare(load_case(make_case(robot={"model": "./arm.xml"}, **sections)))
        return check_fixed(job, job.case.table.E1_deg, job.case.table.E2_deg)

    return run


def test_rounded_frames_change_neither_verdict_nor_proof(checked):
    strict = {"checks": {"wrist_deg": 85}, "roll": {"fixed_deg": 180}}
    exact, rounded = (checked(arm(right=right), **strict) for right in ("90", ROUNDED))
    assert exact.job.solver.form.off is None
    assert 0 < rounded.job.solver.form.off.length < 1e-4
    assert exact.reasons == rounded.reasons
    assert exact.reasons["singular"] > 0
    for a, b in zip(exact.rows, rounded.rows, strict=True):
        assert (a.reason, a.proved) == (b.reason, b.proved) or (a.reason, b.proved) == ("collision", False)
    assert not any(w.code == Code.MARGINS_NOT_COUNTED for w in rounded.job.warnings)


def test_a_motion_of_an_arm_with_rounded_frames_is_on_the_bead_of_the_arm_as_it_is(checked):
    result = checked(arm(right=ROUNDED))
    assert result.feasible
    Ts = result.job.scene.chain.forward(np.array([row.q for row in result.rows]))
    assert np.abs(Ts[:, :3, 3] - result.placed.position).max() < 1e-7


def test_an_arm_without_a_spherical_wrist_is_told_by_how_much(checked):
    bent = arm().replace('pos="0 0 -1.035"', 'pos="0.04 0 -1.035"')
    result = checked(bent, ik={"roll_step_deg": 90, "seeds": 2})
    told = [w for w in result.job.warnings if w.code == Code.MARGINS_NOT_COUNTED]
    assert len(told) == 1
    assert "A4, A5, A6 pass the point nearest to all three at 20 mm" in told[0]
    assert not any(row.proved for row in result.rows if row.reason == "unreachable")


@pytest.mark.parametrize("right", ["90.05", "90.1"])
def test_an_arm_further_off_keeps_the_margins_of_the_one_next_to_it_and_is_told(checked, right):
    few = {"ik": {"seeds": 4, "solver": "dls"}, "roll": {"fixed_deg": 180}}
    exact, off = (checked(arm(right=r), checks={"wrist_deg": 85}, **few) for r in ("90", right))
    assert [w.code for w in off.job.warnings if "margins" in w] == [Code.MARGINS_APPROXIMATE]
    assert exact.reasons["singular"] == off.reasons["singular"] > 0
    assert not any(row.proved for row in off.rows)


def test_a_cell_moved_and_turned_as_a_whole_gives_the_same_targets_and_verdict(make_case, tmp_path):
    turned = {
        "robot": {"position_mm": [200, -300, 150], "rotation_deg": [0, 0, 70]},
        "positioner": {
            "position_mm": [200 + 1500 * math.cos(math.radians(70)), -300 + 1500 * math.sin(math.radians(70)), 150],
            "rotation_deg": [0, 0, -20],
        },
    }
    a, b = (prepare(load_case(make_case(floor=False, **{k: dict(v) for k, v in s.items()}))) for s in ({}, turned))
    np.testing.assert_allclose(a.scene.T_base_part(0.4, 0.9), b.scene.T_base_part(0.4, 0.9), atol=1e-9)
    one, two = (check_fixed(job, 90, 180) for job in (a, b))
    assert one.reasons == two.reasons
    assert one.clearance.value == pytest.approx(two.clearance.value, abs=2e-3)


def test_two_joints_of_one_body_move_and_bound_what_they_carry_as_those_of_two(make_case, tmp_path):
    two = arm()
    heavy = '<inertial pos="0 0 0" mass="5" diaginertia="0.1 0.1 0.1"/>'
    head, tail = two.split(f'<body name="link_6" euler="0 -90 0">{heavy}')
    inside, rest = tail.split("</body>", 1)
    one = f'{head}<frame euler="0 -90 0">{inside}</frame>{rest}'.replace('body2="link_6"', 'body2="link_5"')
    scenes = []
    for name, text in (("one", one), ("two", two)):
        (tmp_path / f"{name}.xml").write_text(text, encoding="utf-8")
        scenes.append(prepare(load_case(make_case(name, robot={"model": f"./{name}.xml"}))).scene)
    fused, apart = scenes
    q = np.random.default_rng(0).uniform(-1, 1, (20, 6))
    np.testing.assert_allclose(fused.chain.forward(q), apart.chain.forward(q), atol=1e-9)
    assert (radii(fused) >= radii(apart) - 1e-9).all()
