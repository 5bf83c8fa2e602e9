"""Verdicts: feasible motions hold under plain MuJoCo, infeasible ones carry the right reason."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest

from cell.case.read import load_case
from cell.failure import Failure, FailurePlace, Kind, Where
from cell.job.job import prepare
from cell.part_chunks.chunked_run import run_in_chunks
from cell.scene.standalone import standalone_xml
from cell.verdict import check as check_module
from cell.verdict.check import SpanVerdict, _rows, check_fixed
from cell.verdict.result import TargetVerdict


def run(path, e1=None, e2=None):
    case = load_case(path)
    return check_fixed(prepare(case), case.table.E1_deg if e1 is None else e1, case.table.E2_deg if e2 is None else e2)


def reasons(result):
    return {reason for reason, k in result.reasons.items() if k}


def independent_problems(result):
    """Every sample of a motion, looked at by plain MuJoCo calls on the written-out scene."""
    job, motion = result.job, result.motion
    model = mujoco.MjModel.from_xml_string(standalone_xml(job.scene))
    data = mujoco.MjData(model)
    names = [*motion.names, "E1", "E2"]
    address = [model.joint(name).qposadr[0] for name in names]
    base = np.linalg.inv(job.scene.T_world_base())
    T = job.targets
    for i in range(len(motion.t_s)):
        data.qpos[address] = [*motion.q[i], *motion.table[i]]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        for name, value in zip(names, data.qpos[address], strict=True):
            low, high = model.joint(name).range
            if not low - 1e-9 <= value <= high + 1e-9:
                yield f"sample {i}: {name} outside its range"
        laid = job.deposits_before[motion.target[i]]
        for contact in data.contact:
            pair = [model.geom(g).name for g in contact.geom]
            born = [int(n.split("/")[1]) for n in pair if n.startswith("deposit/")]
            if contact.dist < 0 and all(b < laid for b in born):
                yield f"sample {i}: {pair} at {contact.dist}"
        if not motion.arc[i]:
            continue
        # on the chord between two neighbouring targets of its bead
        tcp = base[:3, :3] @ data.site("tcp").xpos + base[:3, 3]
        k = motion.target[i]
        near = [j for j in (k - 1, k, k + 1) if 0 <= j < len(T) and T.bead[j] == motion.bead[i]]
        p = result.placed.position
        gap = min(_to_segment(tcp, p[a], p[b]) for a, b in pairwise(near))
        if gap > 5e-5:
            yield f"sample {i}: {gap * 1e3:.3f} mm off its bead"


def _to_segment(x, a, b):
    s = np.clip((x - a) @ (b - a) / max((b - a) @ (b - a), 1e-30), 0, 1)
    return np.linalg.norm(x - a - s * (b - a))


def test_a_feasible_motion_survives_an_independent_check(make_case):
    result = run(make_case())
    assert result.feasible
    assert list(independent_problems(result)) == []


def test_targets_are_met_exactly_and_the_wire_points_into_the_surface(make_case):
    result = run(make_case())
    chain = result.job.scene.chain
    T = chain.forward(np.array([row.q for row in result.rows]))
    assert np.abs(T[:, :3, 3] - result.placed.position).max() < 1e-6
    assert np.abs(T[:, :3, 2] + result.placed.normal).max() < 1e-6


def test_no_jump_inside_a_bead(make_case):
    motion = run(make_case()).motion
    same = (motion.bead[1:] == motion.bead[:-1]) & (motion.arc[1:] == 1) & (motion.arc[:-1] == 1)
    assert np.rad2deg(np.abs(np.diff(motion.q, axis=0))[same].max()) < 15


@pytest.mark.slow
def test_both_solvers_agree_on_the_verdict(make_case):
    # few targets: damped least squares searches every roll from every seed
    few = {"slicing": {"h_layer_mm": 3, "h_min_mm": 2, "h_max_mm": 4}, "roll": {"fixed_deg": 0}}
    a = run(make_case("a", **few, ik={"solver": "closed_form"}))
    b = run(make_case("b", **few, ik={"solver": "dls"}))
    assert a.job.solver.name != b.job.solver.name
    assert a.feasible
    assert b.feasible
    assert list(independent_problems(b)) == []


def test_an_arm_without_a_closed_form_is_checked_all_the_same(make_case, tmp_path):
    from cell.shipped import MODELS_DIR

    # A6 beside the wrist's centre: no spherical wrist any more
    text = (MODELS_DIR / "kr70_r2100" / "kr70_r2100.xml").read_text()
    text = text.replace('meshdir="', f'meshdir="{MODELS_DIR / "kr70_r2100"}/')
    assert text.count('<body name="link_6" pos="0 0 0">') == 1
    (tmp_path / "arm.xml").write_text(text.replace('name="link_6" pos="0 0 0"', 'name="link_6" pos="0 0.06 0"'))
    few = {"slicing": {"h_layer_mm": 3, "h_min_mm": 2, "h_max_mm": 4}, "roll": {"fixed_deg": 0}}
    result = run(make_case("offset", **few, robot={"model": "arm.xml"}))
    assert result.job.solver.geometry is None
    assert result.feasible
    assert result.singularity.what == ("sigma",)
    assert list(independent_problems(result)) == []
    far = run(make_case("far", **few, robot={"model": "arm.xml"}, positioner={"position_mm": [3000, 0, 0]}))
    assert reasons(far) == {"unreachable"}
    assert not any(row.proved for row in far.rows)


def test_too_far_is_unreachable_by_the_distance_too_far(make_case):
    near = run(make_case("near", positioner={"position_mm": [3000, 0, 0]}))
    far = run(make_case("far", positioner={"position_mm": [3200, 0, 0]}))
    assert reasons(near) == reasons(far) == {"unreachable"}
    gap = [f.detail["beyond_reach_mm"] - n.detail["beyond_reach_mm"] for f, n in zip(far.rows, near.rows, strict=True)]
    assert np.allclose(gap, 200, atol=20)  # almost along the line to the shoulder


def test_proved_only_where_nothing_is_left_to_look_at(make_case):
    place = {"position_mm": [3000, 0, 0]}
    fixed = run(make_case("fixed", positioner=place, roll={"fixed_deg": 0}))
    free = run(make_case("free", positioner=place))
    ranged = run(make_case("ranged", positioner=place, roll={"range_deg": [-40, 70]}))
    assert all(row.proved for result in (fixed, free, ranged) for row in result.rows)
    # damped least squares finds nothing, and proves nothing
    searched = run(make_case("dls", positioner=place, roll={"fixed_deg": 0}, ik={"solver": "dls", "seeds": 4}))
    assert not any(row.proved for row in searched.rows)
    # a collision at every sampled roll is none at every roll
    box = {"name": "oven", "box": {"size_mm": [500, 500, 300]}, "position_mm": [1500, 250, 800]}
    blocked = run(make_case("blocked", fixtures=[box]))
    assert not any(row.proved for row in blocked.rows)


@pytest.mark.parametrize(
    ("checks", "proved"), [({"wrist_deg": 5}, True), ({"wrist_deg": 0}, False), ({"shoulder_mm": 0}, False)]
)
def test_a_collision_is_proved_where_the_configurations_can_be_counted(make_case, checks, proved):
    """With A4 and A6 in line, or the wrist over A1, which no margin forbids then, endlessly many reach a target."""
    clamp = {"name": "clamp", "on": "table", "position_mm": [-120, 0, 130], "box": {"size_mm": [120, 120, 120]}}
    few = {"h_layer_mm": 3, "h_min_mm": 2, "h_max_mm": 4}
    result = run(make_case(slicing=few, roll={"fixed_deg": -60}, fixtures=[clamp], checks=checks))
    assert reasons(result) == {"collision"}
    assert {row.proved for row in result.rows} == {proved}


def test_no_proof_is_contradicted_by_a_wider_window(make_case):
    tight = run(make_case("tight", roll={"range_deg": [80, 100]}, positioner={"position_mm": [1550, 0, 0]}), -45, 0)
    for row, T in zip(tight.rows, tight.placed.Ts_base_target, strict=True):
        if row.proved:
            from ik.roll import apply_roll

            rolls = np.deg2rad(np.linspace(80, 100, 201))
            q = tight.job.solver.candidates(apply_roll(T[None], rolls)).q
            assert not np.isfinite(q[..., 0]).any() or row.reason == "singular"


def test_a_box_around_the_part_is_a_collision_that_names_it(make_case):
    box = {"name": "oven", "box": {"size_mm": [500, 500, 300]}, "position_mm": [1500, 250, 800]}
    result = run(make_case(fixtures=[box]))
    assert reasons(result) == {"collision"}
    for row in result.rows:
        assert "oven" in row.detail["pair"]
        assert row.detail["distance_mm"] < row.detail["required_mm"]


def test_the_workpiece_in_a_fixture_is_a_collision_whatever_the_arm_does(make_case):
    box = {"name": "post", "box": {"size_mm": [100, 100, 2000]}, "position_mm": [1500, 0, 0]}
    result = run(make_case(fixtures=[box]))
    assert reasons(result) == {"collision"}
    assert all(row.proved for row in result.rows)
    assert "post" in result.rows[0].detail["pair"]


def test_a_clearance_nothing_can_keep_is_a_collision(make_case):
    result = run(make_case(checks={"clearance_mm": 40}))
    assert not result.feasible
    assert reasons(result) <= {"collision", "no_path"}
    assert "collision" in reasons(result)


def test_a_margin_nothing_can_keep_is_singular(make_case):
    result = run(make_case(checks={"elbow_deg": 90}))
    assert reasons(result) == {"singular"}
    detail = result.rows[0].detail
    assert detail["singularity"] == "elbow"
    assert detail["margin"] < detail["limit"] == 90


def test_a_gravity_limit_is_its_own_reason(make_case):
    upright = run(make_case("a", checks={"gravity_max_deg": 60}))
    steep = run(make_case("b", checks={"gravity_max_deg": 10}))  # the same motion, which no limit of the arm stops
    assert upright.feasible
    assert reasons(steep) == {"gravity"}
    assert not steep.feasible
    assert steep.motion is None


def test_what_overhangs_too_far_is_wrong_with_a_part_that_the_arm_can_weld(little, monkeypatch):
    monkeypatch.setattr(check_module, "unsupported_targets", lambda job: {2: Failure(Kind.OVERHANG, 4.0, 2.0)})
    found = check_fixed(little.job, *little.asked)
    assert not found.feasible
    assert {i: failure.kind for i, failure in found.failures.items()} == {2: Kind.OVERHANG}


def test_what_is_wrong_with_a_motion_as_it_is_run_is_wrong_with_its_target(little, monkeypatch):
    hit = Failure(Kind.COLLISION, 1e-3, 5e-3, place=FailurePlace(Where.TRAVEL, from_target=2, to_target=3))

    def run_to_a_hit(*args):
        return replace(run_in_chunks(*args), failures={3: hit})

    monkeypatch.setattr(check_module, "run_in_chunks", run_to_a_hit)
    found = check_fixed(little.job, *little.asked)
    assert not found.feasible
    assert found.motion is None
    assert {i: failure.kind for i, failure in found.failures.items()} == {3: Kind.COLLISION}


@pytest.mark.parametrize(
    "lost", [TargetVerdict(Failure(Kind.GRAVITY), None), TargetVerdict(None, None, looked_at=False)]
)
def test_no_motion_is_made_of_targets_that_are_not_feasible(lost, little):
    whole = SpanVerdict(little.rows, little.motion)
    assert whole.motion is little.motion
    with pytest.raises(RuntimeError, match="1 targets"):
        SpanVerdict((*little.rows[:-1], lost), little.motion)
    with pytest.raises(RuntimeError, match="1 targets"):
        replace(whole, rows=(*little.rows[1:], lost))
    assert replace(whole, rows=(*little.rows[1:], lost), motion=None).motion is None


def test_a_bead_too_fast_for_the_joints_is_speed(make_case):
    result = run(make_case(robot={"max_speed_deg_s": [0.05] * 6}, roll={"fixed_deg": 90}))
    assert "speed" in reasons(result)


def test_growing_part_counts_only_what_is_laid(make_case, tmp_path):
    from support.jobs.cases import boss_mesh

    from cell.collision.checker import Checker

    path = make_case()
    boss_mesh(height=40).export(tmp_path / "boss.stl")
    result = run(path)
    job = result.job
    assert job.deposits_before[0] == 0
    assert job.deposits_before[-1] == job.shape.n_deposits - 1
    # the finished boss is in the way of its own first layer: that is why it must not count there
    checker = Checker(job.scene, result.table, 0.02)
    q = result.rows[0].q[None]
    assert checker.clearances(q, np.array([0])).distance[0] > 0.005
    assert checker.clearances(q, np.array([job.shape.n_deposits])).distance[0] < 0


def test_the_table_moves_the_targets_as_a_rigid_body(make_case):
    job = prepare(load_case(make_case()))
    from cell.scene.placement import place_targets

    a = place_targets(job.targets, job.scene.T_base_part(0.0, 0.0))
    b = place_targets(job.targets, job.scene.T_base_part(0.4, -1.1))
    far = np.linalg.norm(a.position[:, None] - a.position[None], axis=-1)
    assert np.allclose(far, np.linalg.norm(b.position[:, None] - b.position[None], axis=-1), atol=1e-12)
    assert np.allclose(a.normal @ a.normal.T, b.normal @ b.normal.T, atol=1e-12)


def test_roll_zero_has_x_along_the_parts_axis(make_case):
    job = prepare(load_case(make_case()))
    from cell.scene.placement import place_targets

    T_base_part = job.scene.T_base_part(0.3, 0.7)
    placed = place_targets(job.targets, T_base_part)
    T = placed.Ts_base_target
    z_part = T_base_part[:3, 2]
    assert np.allclose(T[:, :3, 2], -placed.normal)
    assert np.allclose(np.linalg.det(T[:, :3, :3]), 1)
    projected = z_part - T[:, :3, 2] * (T[:, :3, 2] @ z_part)[:, None]
    assert np.allclose(T[:, :3, 0], projected / np.linalg.norm(projected, axis=1)[:, None])


def test_a_home_in_the_way_is_told_at_a_target_that_was_not_looked_at(make_case):
    """Of a part that is lost without its last bead."""
    job = prepare(load_case(make_case()))
    last = len(job.targets) - 1
    lost = SimpleNamespace(failure=Failure(Kind.OUT_OF_REACH), attempt=None)
    bead = SimpleNamespace(stretches=[], target_failures={0: lost}, edge_failures={}, open=list(range(1, last + 1)))
    home = Failure(Kind.COLLISION, -1.0, 5.0, place=FailurePlace(Where.TO_HOME, at_home=True))
    rows = _rows(SimpleNamespace(beads=[bead], travel_failures={last: home}), {})
    assert [i for i, row in rows.items() if row.looked_at] == [0, last]
    assert rows[last].failure.kind is Kind.COLLISION
