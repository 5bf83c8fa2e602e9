"""Reasons and their measures, each against a formula of its own."""

import json

import mujoco
import numpy as np
import pytest
from support.cells.arms import OPW, kr70_model

from cell.case.read import load_case
from cell.cli.main import main
from cell.job.job import prepare
from cell.mjcf.torch import TorchDimensions, tcp_of_dimensions
from cell.scene.standalone import standalone_xml
from cell.verdict.all_reasons import ORDER, all_reasons
from cell.verdict.check import check_fixed
from ik.roll import apply_roll

FEW = {"slicing": {"h_layer_mm": 3, "h_min_mm": 2, "h_max_mm": 4}}
FIXED = {"roll": {"fixed_deg": 0}}


def run(path):
    case = load_case(path)
    return check_fixed(prepare(case), case.table.E1_deg, case.table.E2_deg)


def flange_poses(result, roll_deg):
    """Flange poses of all targets at a roll, by the torch's own closed form."""
    Ts = apply_roll(result.placed.Ts_base_target, np.full(len(result.rows), np.deg2rad(roll_deg)))
    return Ts @ np.linalg.inv(tcp_of_dimensions(TorchDimensions()))


def test_unreachable_is_the_wrist_centres_distance_from_the_reach(make_case):
    result = run(make_case(**FEW, **FIXED, positioner={"position_mm": [3000, 0, 0]}))
    flange = flange_poses(result, 0)
    wrist = flange[:, :3, 3] - 0.185 * flange[:, :3, 2]
    # the arm turns towards it; what is left is the plane through A1
    shoulder = np.hypot(np.hypot(wrist[:, 0], wrist[:, 1]) - 0.175, wrist[:, 2] - 0.575)
    beyond = shoulder - (0.89 + np.hypot(1.035, 0.05))
    for row, measure in zip(result.rows, beyond, strict=True):
        assert row.reason == "unreachable"
        assert row.detail["beyond_reach_mm"] == pytest.approx(1e3 * measure, abs=0.01)


def test_joint_limit_is_the_least_any_configuration_is_over(make_case):
    opw = pytest.importorskip("py_opw_kinematics")
    from scipy.spatial.transform import RigidTransform

    result = run(make_case(**FEW, roll={"fixed_deg": -90}, table={"E1_deg": -45, "E2_deg": 0}))
    over = [i for i, row in enumerate(result.rows) if row.reason == "joint_limit"]
    assert over
    robot = opw.Robot(opw.KinematicModel(**OPW), degrees=True)
    solved = robot.reach(RigidTransform.from_matrix(flange_poses(result, -90)[over]))
    low, high = np.rad2deg(kr70_model().jnt_range.T)
    for i, branches in zip(over, np.asarray(solved.joints), strict=True):
        q = branches[np.isfinite(branches).all(axis=1)]
        turns = q[:, None] + 360.0 * np.arange(-2, 3)[:, None]  # (branch, turn, axis)
        excess = np.maximum(np.maximum(low - turns, turns - high), 0).min(axis=1)
        best = excess[np.argmin(excess.max(axis=1))]
        assert result.rows[i].detail["over_deg"] == pytest.approx(best.max(), abs=2e-3)
        assert result.rows[i].detail["axis"] == f"A{np.argmax(best) + 1}"


def points(model, data, q):
    """Shoulder, elbow and wrist centre, and the Jacobian of the TCP, by MuJoCo alone."""
    data.qpos[[model.joint(f"A{k}").qposadr[0] for k in range(1, 7)]] = q
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    jac = np.zeros((6, model.nv))
    mujoco.mj_jacSite(model, data, jac[:3], jac[3:], model.site("tcp").id)
    anchors = [data.xanchor[model.joint(f"A{k}").id].copy() for k in (2, 3, 5)]
    return anchors, jac[:, [model.joint(f"A{k}").dofadr[0] for k in range(1, 7)]]


@pytest.mark.parametrize(
    ("key", "limit"),
    [("elbow_deg", 90), ("wrist_deg", 89.9), pytest.param("shoulder_mm", 3000, marks=pytest.mark.slow)],
)
def test_singular_is_the_angle_or_distance_it_says(key, limit, make_case):
    result = run(make_case(**FEW, **FIXED, checks={key: limit}))
    model = mujoco.MjModel.from_xml_string(standalone_xml(result.job.scene))
    data = mujoco.MjData(model)
    scale = sum(np.linalg.norm(model.body(f"link_{k}").pos) for k in range(2, 7))
    seen = 0
    for row in result.rows:
        assert row.reason == "singular"
        (shoulder, elbow, wrist), jac = points(model, data, row.attempt)
        d = row.detail
        if key == "elbow_deg":
            a, b = elbow - shoulder, wrist - elbow
            angle = np.rad2deg(np.arccos(a @ b / np.linalg.norm(a) / np.linalg.norm(b)))
            margin = min(angle, 180 - angle)
        elif key == "wrist_deg":
            margin = np.rad2deg(abs(np.arcsin(np.sin(row.attempt[4]))))
        else:
            margin = 1e3 * np.hypot(*wrist[:2])  # the arm stands at the world's origin
        assert d["singularity"] == key.split("_")[0]
        assert d["margin"] == pytest.approx(margin, abs=2e-3)
        assert d["limit"] == pytest.approx(limit)
        jac[:3] /= scale
        assert d["smallest_singular_value"] == pytest.approx(np.linalg.svd(jac)[1][-1], abs=1e-5)
        seen += 1
    assert seen


def test_collision_is_the_deepest_contact_of_plain_mujoco(make_case):
    box = {"name": "oven", "box": {"size_mm": [500, 500, 300]}, "position_mm": [1500, 250, 800]}
    result = run(make_case(**FEW, **FIXED, fixtures=[box]))
    model = mujoco.MjModel.from_xml_string(standalone_xml(result.job.scene))
    data = mujoco.MjData(model)
    table = [model.joint(name).qposadr[0] for name in ("E1", "E2")]
    joints = [model.joint(f"A{k}").qposadr[0] for k in range(1, 7)]
    deposits = [model.geom(g).name.startswith("deposit/") for g in range(model.ngeom)]
    for i, row in enumerate(result.rows):
        assert row.reason == "collision"
        data.qpos[table], data.qpos[joints] = result.table, row.attempt
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        laid = [not any(deposits[g] for g in c.geom) for c in data.contact]
        worst = min((c for c, ok in zip(data.contact, laid, strict=True) if ok), key=lambda c: c.dist)
        if result.job.deposits_before[i] == 0 or row.detail["distance_mm"] < -50:
            assert row.detail["distance_mm"] == pytest.approx(1e3 * worst.dist, abs=0.01)
            assert set(row.detail["pair"]) == {model.geom(g).name for g in worst.geom}
            assert row.detail["world_xyz_mm"] == pytest.approx(1e3 * worst.pos, abs=0.1)


@pytest.mark.parametrize(
    "changes",
    [
        {"positioner": {"position_mm": [3000, 0, 0]}, "roll": "free"},
        {"roll": {"range_deg": [-100, -40]}, "table": {"E1_deg": -45, "E2_deg": 0}},
        {"roll": {"fixed_deg": 0}, "checks": {"elbow_deg": 90}},
        {"roll": {"fixed_deg": 0}, "checks": {"clearance_mm": 40}},
    ],
)
def test_all_reasons_account_for_every_candidate(changes, make_case):
    result = run(make_case(**FEW, **changes))
    found = all_reasons(result)
    rolls = len(result.job.window.samples(np.deg2rad(result.job.case.ik.roll_step_deg)))
    bad = [i for i, row in enumerate(result.rows) if row.reason is not None]
    assert bad
    assert sorted(found) == bad
    for i in bad:
        entries = {entry.reason: entry for entry in found[i]}
        assert sum(entry.candidates for entry in found[i]) == 8 * rolls
        assert [r for r in ORDER if r in entries] == [entry.reason for entry in found[i]]
        row = result.rows[i]
        if row.reason in ORDER:
            # the target's reason is that of its best candidate: of the last test that any of them gets to
            assert found[i][-1].reason == row.reason
            # two places of one pair may be equally near: which of them is told is nobody's concern
            ours, theirs = found[i][-1].document(), {**row.detail, "reason": row.reason}
            left_out = {"candidates", "roll_deg", "world_xyz_mm"}
            assert {k: ours[k] for k in ours.keys() - left_out} == {k: theirs[k] for k in theirs.keys() - left_out}
        else:
            assert entries["free"].candidates > 0


def test_the_command_shows_all_reasons(make_case, tmp_path, capsys):
    path, out = make_case(**FEW, **FIXED, checks={"elbow_deg": 90}), tmp_path / "r.json"
    assert main(["check", str(path), "--all-reasons", "--no-remedies", "--json", str(out)]) == 1
    rows = json.loads(out.read_text())["rows"]
    assert all({"reason", "candidates"} <= set(entry) for row in rows for entry in row["all_reasons"])
    assert "candidates" in capsys.readouterr().out
    assert main(["check", str(path), "--no-remedies", "--json", str(out)]) == 1
    assert all("all_reasons" not in row for row in json.loads(out.read_text())["rows"])


@pytest.mark.parametrize(
    "changes",
    [
        {"roll": {"fixed_deg": -90}, "table": {"E1_deg": -45, "E2_deg": 0}},
        {
            "fixtures": [
                {"name": "lid", "box": {"size_mm": [10, 300, 300]}, "position_mm": [-78, 0, 120], "on": "table"}
            ]
        },
        {"checks": {"wrist_deg": 80}, "roll": {"fixed_deg": 0}},
    ],
    ids=["joint limits", "collision", "singularity"],
)
def test_an_attempt_is_kept_without_the_other_candidates_of_its_bead(make_case, changes):
    """Of a bead of 300 targets with a free roll these are 6 MB and more, of each bead that is lost."""
    attempts = [row.attempt for row in run(make_case(**changes)).rows if row.attempt is not None and row.reason]
    assert attempts
    assert all(q.base is None for q in attempts)
