"""Positioners of two axes, of one, of none, and endless ones."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import yaml
from support.cells.arm_models import table
from support.cells.skew_tables import skew_job

from cell.case.read import load_case, parse_case
from cell.collision.proofs.reach_radii import table_radii
from cell.collision.table_clearances import table_alone
from cell.errors import InputError
from cell.job.job import Job, prepare
from cell.job.table_winding import freedom_of
from cell.pose_sweep.grid import grid
from cell.scene.scene import case_table
from cell.scene.standalone import standalone_xml
from cell.verdict.check import check_fixed
from slicing.warning import Code


@pytest.fixture
def job(make_case: Callable[..., Path], tmp_path: Path) -> Callable[..., Job]:
    def make(model: str, name: str = "boss", **sections: Any) -> Job:
        (tmp_path / "table.xml").write_text(model, encoding="utf-8")
        positioner = {"model": "./table.xml", **sections.pop("positioner", {})}
        path = make_case(
            name, positioner=positioner, table=sections.pop("table", {"E1_deg": 0, "E2_deg": 0}), **sections
        )
        return prepare(load_case(path))

    return make


def part_as_mujoco_has_it(model: str, joints: dict[str, float], scene: Any) -> np.ndarray:
    """Pose of the table's site in the arm's base frame, by the table's model alone; the base is the world here."""
    spec = mujoco.MjSpec.from_string(model)
    alone = spec.compile()
    data = mujoco.MjData(alone)
    for name, value in joints.items():
        data.joint(name).qpos[0] = value
    mujoco.mj_kinematics(alone, data)
    T, place = np.eye(4), np.eye(4)
    T[:3, :3], T[:3, 3] = data.site("table").xmat.reshape(3, 3), data.site("table").xpos
    place[:3, 3] = 1.5, 0, 0
    place[:2, :2] = [[0, 1], [-1, 0]]
    T = place @ T
    T[:3, 3] += T[:3, 2] * 0.1  # the support
    return T


def agrees(job: Job, model: str, E1: float, E2: float, joints: dict[str, float]) -> None:
    np.testing.assert_allclose(
        job.scene.T_base_part(E1, E2), part_as_mujoco_has_it(model, joints, job.scene), atol=1e-9
    )


def test_an_endless_turn_takes_every_angle_and_is_swept_once_round(job):
    model = table(turn="")
    made = job(model)
    assert [p.E2_deg for p in grid(made.case, "90")] == [-180, -135, -90, -45, 0, 45, 90, 135]
    for deg in (180, 800, -1000):
        made.scene.check_table(0.0, np.deg2rad(deg))
    agrees(made, model, 0.5, 9.0, {"E1": 0.5, "E2": 9.0})
    with pytest.raises(InputError, match=r"E1 = 140 deg is outside the positioner's range -135 .. 135 deg$"):
        made.scene.check_table(np.deg2rad(140), 0.0)
    with pytest.raises(InputError, match=r"E1 = 400 deg is outside .*; equals 40 deg, which is inside$"):
        made.scene.check_table(np.deg2rad(400), 0.0)


@pytest.mark.parametrize(("missing", "kept"), [(0, "E2"), pytest.param(1, "E1", marks=pytest.mark.slow)])
def test_one_axis_moves_the_table_and_the_other_is_refused(job, missing, kept):
    model = table(**{("tilt", "turn")[missing]: None})
    made = job(model, positioner={"joints": [kept], "max_speed_deg_s": [90]})
    angles = [0.0, 0.0]
    angles[1 - missing] = 0.7
    agrees(made, model, *angles, {kept: 0.7})
    asked = [0.0, 0.0]
    asked[missing] = 0.5
    with pytest.raises(InputError, match=rf"E{missing + 1} = 28.6479 deg: this positioner has no such axis.*{kept}"):
        made.scene.check_table(*asked)
    assert np.rad2deg(made.drives.speed[6 + 1 - missing]) == pytest.approx(90)
    assert np.isinf(made.drives.speed[6 + missing])
    assert table_alone(made.scene, tuple(angles)).distance[0] > 0
    exported = mujoco.MjModel.from_xml_string(standalone_xml(made.scene))
    assert exported.nq == made.scene.model.nq
    assert {(p.E1_deg, p.E2_deg)[missing] for p in grid(made.case)} == {0.0}


def test_a_lone_axis_of_another_name_turns_or_tilts_by_what_it_does(job):
    for model, has in ((table(tilt=None), [False, True]), (table(turn=None), [True, False])):
        made = job(model.replace('"E1"', '"T"').replace('"E2"', '"T"'), positioner={"joints": ["T"]})
        assert made.scene.has_axis.tolist() == has


def test_two_joints_in_one_body_are_both_planned(job):
    both = '<joint name="T" axis="0 1 0" range="-90 90"/>'
    model = table(tilt=None, more=both)
    made = job(model, positioner={"joints": ["T", "E2"]})
    agrees(made, model, 0.4, -1.0, {"T": 0.4, "E2": -1.0})
    assert table_radii(made.scene)[1] >= 0.1, "the support is that high"
    with pytest.raises(InputError, match="T carries E2; list the joint that carries the other first"):
        job(model, positioner={"joints": ["E2", "T"]})


def test_joints_that_do_not_carry_the_table_are_refused(job):
    with pytest.raises(InputError, match="no joint named 'A1'; it has E1, E2"):
        job(table(), positioner={"joints": ["A1", "E2"]})
    with pytest.raises(InputError, match="listed twice"):
        job(table(), positioner={"joints": ["E2", "E2"]})


BENCH = """<mujoco><compiler angle="degree"/><worldbody><geom name="slab" type="box" size="0.2 0.2 0.15"
pos="0 0 0.15"/><frame pos="0 0 0.3" euler="0 0 20"><site name="table" euler="0 0 50"/></frame></worldbody></mujoco>"""


def test_a_fixed_bench_carries_the_part_and_touches_nothing_by_itself(job):
    made = job(BENCH, positioner={"joints": []})
    agrees(made, BENCH, 0.0, 0.0, {})
    assert table_alone(made.scene, (0.0, 0.0)).distance[0] >= 0
    result = check_fixed(made, 0.0, 0.0)
    assert result.feasible
    assert not result.motion.table.any()
    with pytest.raises(InputError, match="E2 = 10 deg: this positioner has no such axis"):
        check_fixed(made, 0.0, 10.0)


@pytest.mark.parametrize("positioner", [{"joints": []}, {"joints": ["E2"]}])
def test_what_stands_in_the_part_is_found_on_any_table(job, positioner):
    model = BENCH if not positioner["joints"] else table(tilt=None)
    block = {"name": "block", "box": {"size_mm": [20, 20, 20]}, "position_mm": [1500, 0, 380]}
    if positioner["joints"]:
        block["position_mm"] = [1500, 0, 580]
    result = check_fixed(job(model, positioner=positioner, fixtures=[block]), 0.0, 0.0)
    assert not result.feasible
    assert set(result.rows[0].detail["pair"]) == {"block", "support"}


def test_none_is_a_table_that_stands_still_and_is_told(make_case):
    path = make_case(table={"E1_deg": 0, "E2_deg": 0})
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    path.write_text(yaml.safe_dump({**content, "positioner": "none"}), encoding="utf-8")
    made = prepare(load_case(path))
    assert made.scene.T_base_part(0, 0)[:3, 3] == pytest.approx([1.5, 0, 0.1])
    assert any(w.code == Code.TABLE_WITHOUT_SHAPE for w in made.warnings)
    part = {"sub_volumes": ["b.stl"], "body": {"radius_mm": 20}}
    with pytest.raises(InputError, match="with model: none leave joints out"):
        parse_case({"part": part, "positioner": {"model": "none", "joints": ["E1"]}})
    changed = path.with_name("moved.case.yaml")
    changed.write_text("extends: boss.case.yaml\npositioner: {position_mm: [1200, 0, 0]}\n", encoding="utf-8")
    assert load_case(changed).positioner.model == "none"


def test_joints_that_are_called_the_other_way_round_are_refused(job):
    """What a case and a program call E1 would be the model's E2."""
    swapped = table().replace('"E1"', '"x"').replace('"E2"', '"E1"').replace('"x"', '"E2"')
    with pytest.raises(InputError, match="E2 carries E1, so it is E1 in a case, in reports and in programs"):
        job(swapped, positioner={"joints": ["E2", "E1"]})


def test_what_a_case_says_of_an_axis_that_its_mode_moves_need_not_be_in_the_range(tmp_path: Path) -> None:
    """0, as where it is left out, is no angle of this axis, and no whole turn away from one."""
    far = 'range="400 640"'
    moving = skew_job(tmp_path, far, table={"mode": "coordinated"})
    E1, E2 = case_table(moving.case, moving.scene)
    assert E1 == 0.0
    assert np.rad2deg(E2) == pytest.approx(400)
    freedom = freedom_of(moving.case, moving.scene)
    assert np.rad2deg([freedom.low[1], freedom.high[1]]) == pytest.approx([400, 640])
    searched = skew_job(tmp_path, far, table={"mode": "best"})  # as its program is read
    assert np.rad2deg(case_table(searched.case, searched.scene)) == pytest.approx((0, 400))
    standing = skew_job(tmp_path, far)
    with pytest.raises(InputError, match="E2 = 0 deg is outside"):
        case_table(standing.case, standing.scene)
    with pytest.raises(InputError, match="E2 = 0 deg is outside"):
        skew_job(tmp_path, far, table={"mode": "coordinated", "axes": ["E1"]})
