"""A part whose sub-volumes are built at table poses of their own, in one motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.cases import at, bosses
from support.indexed import three_bosses, three_case, with_table

from cell.cli.main import main
from cell.failure import ON_TRAVEL, Contact, Failure, Kind
from cell.job.job import prepare
from cell.motion.file_order import read_in_order
from cell.motion.motion_file import write_motion
from cell.report.check_document import report_document
from cell.report.check_report import pasted_poses
from cell.table_poses.table_turn import TurnSearch
from cell.verdict.as_asked import check_as_asked
from cell.verdict.check import Result, check
from cell.verification.motion_check import check_motion


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("three")


@pytest.fixture(scope="module")
def found(folder: Path) -> Result:
    return check_as_asked(prepare(three_case(folder)))


def test_every_boss_is_turned_under_the_torch(found: Result) -> None:
    assert found.feasible
    assert found.mode == "indexed"
    assert sorted(pose.sub_volume for pose in found.poses) == ["SV1", "SV2", "SV3"]
    # a third of a turn apart: at no one pose are all laid within 30 degrees of upright, at their own each is
    assert np.rad2deg(found.gravity).max() < 30
    one = check(found.job, *found.asked)
    assert np.rad2deg(one.gravity).max() > 60
    for pose in found.poses:
        assert np.rad2deg(found.gravity[pose.first : pose.stop]).max() < 30
        assert np.allclose(np.rad2deg(found.tables[pose.first : pose.stop]), (pose.E1_deg, pose.E2_deg))


def test_the_table_turns_within_its_axes_while_the_arm_stands(found: Result) -> None:
    motion, drives, scene = found.motion, found.job.drives, found.job.scene
    assert motion is not None
    turns = np.abs(np.diff(motion.table, axis=0)).max(axis=1) > 0
    assert turns.any()
    assert not np.diff(motion.q, axis=0)[turns].any()
    assert not motion.welding[turns].any()
    low, high = scene.table_range.T
    assert ((motion.table >= low - 1e-9) & (motion.table <= high + 1e-9)).all()
    dt = np.diff(motion.t_s)[:, None]
    speed = np.diff(motion.table, axis=0) / dt
    assert (np.abs(speed) <= drives.speed[-2:] * 1.001).all()
    # and an axis is as fast as its drive allows on the way
    assert (np.abs(speed) / drives.speed[-2:]).max() > 0.6
    jumps = np.abs(np.diff(speed, axis=0)) / ((dt[1:] + dt[:-1]) / 2)
    assert (jumps <= drives.acceleration[-2:] * 1.02).all()


def test_the_judge_says_the_same_of_the_motion_as_a_file(found: Result, folder: Path) -> None:
    path = folder / "motion.csv"
    assert found.motion is not None
    assert found.clearance is not None
    write_motion(path, found.motion)
    # from the case as it was: neither poses nor an order are known there
    again = check_motion(*read_in_order(path, prepare(three_case(folder))))
    assert again.findings == ()
    assert again.clearance is not None
    assert again.clearance[0] == pytest.approx(found.clearance.value, rel=0.03, abs=1e-5)


def test_found_poses_can_be_pasted_back(found: Result, folder: Path) -> None:
    import yaml

    pasted = yaml.safe_load("\n".join(pasted_poses(found)))["table"]
    assert pasted["poses"] == [pose.document() for pose in found.poses]
    again = check_as_asked(prepare(with_table(three_case(folder), pasted)))
    assert again.motion is not None
    assert found.motion is not None
    assert np.array_equal(again.motion.t_s, found.motion.t_s)
    assert np.array_equal(again.motion.q, found.motion.q)
    assert np.array_equal(again.motion.table, found.motion.table)
    assert again.motion.rows_deg() == found.motion.rows_deg()


def test_the_report_says_where_the_table_stands(found: Result) -> None:
    document = report_document(found)
    assert document["table"]["mode"] == "indexed"
    assert document["table"]["poses"] == [pose.document() for pose in found.poses]
    for row in document["rows"]:
        pose = next(p for p in found.poses if p.first <= row["index"] < p.stop)
        assert (row["E1_deg"], row["E2_deg"]) == (pose.E1_deg, pose.E2_deg)
        # the target's place is that at its own pose of the table
        T = found.job.scene.T_base_part(*np.deg2rad([row["E1_deg"], row["E2_deg"]]))
        at = T[:3, :3] @ found.job.targets.position[row["index"]] + T[:3, 3] * 1e3
        assert np.allclose(at, row["base_xyz_mm"], atol=2e-3)


def test_given_poses_that_do_not_serve_say_why(folder: Path) -> None:
    names = ("SV1", "SV2", "SV3")
    poses = [{"sub_volume": name, "E1_deg": 0, "E2_deg": 0} for name in names]
    case = with_table(three_case(folder), {"mode": "indexed", "poses": poses}, checks={"gravity_max_deg": 45})
    result = check_as_asked(prepare(case))
    assert not result.feasible
    assert result.motion is None
    # the bosses stand out level: their own measure is over the limit, and at a given pose that is proved
    assert result.reasons["gravity"] == len(result.rows)
    assert all(row.proved for row in result.rows)


def test_nothing_is_proved_of_poses_that_were_searched(folder: Path) -> None:
    far = {"position_mm": [6000, 0, 0], "rotation_deg": [0, 0, -90]}
    for mode in ("indexed", "best"):
        result = check_as_asked(prepare(with_table(three_case(folder), {"mode": mode}, positioner=far)))
        assert result.infeasible == len(result.rows)
        assert not any(row.proved for row in result.rows)


def test_the_best_fixed_pose_is_found_and_used(tmp_path: Path, make_case) -> None:
    from cell.case.read import load_case

    case = load_case(make_case(table={"E1_deg": -90, "E2_deg": 180}))
    given = check(prepare(case), -90, 180)
    best = check_as_asked(prepare(with_table(case, {"mode": "best"})))
    assert best.feasible
    assert best.mode == "best"
    assert best.gravity.max() < np.pi / 6 < given.gravity.max()
    assert check(prepare(case), *best.asked).feasible


def test_the_command_builds_with_a_table_that_indexes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = three_bosses(tmp_path, table={"E1_deg": 90, "E2_deg": 0})
    motion = tmp_path / "m.npz"
    assert main(["check", str(path), "--table", "indexed", "--motion", str(motion), "--no-remedies"]) == 0
    assert "mode: indexed, poses: [" in capsys.readouterr().out
    assert main(["check", str(path), "--table", "indexed", "--motion-in", str(motion)]) == 0
    # a table that is to stand still lets nobody choose the order
    runs = [p for p in capsys.readouterr().out.splitlines() if "feasible" in p]
    assert runs


class ShutAtHome(TurnSearch):
    """Home is in the way of every turn."""

    def search(self, q, a, b, stage):
        if (q == self.scene.home).all():
            return Failure(Kind.COLLISION, 0.0, 5.0, contact=Contact(("a", "b")), place=ON_TRAVEL)
        return super().search(q, a, b, stage)


@pytest.mark.slow
def test_the_arm_stands_aside_where_home_is_in_the_way_of_the_turn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cell.verdict.indexed.TurnSearch", ShutAtHome)
    job = prepare(three_case(tmp_path))
    result = check_as_asked(job)
    motion, home = result.motion, job.scene.home
    assert motion is not None
    turns = np.flatnonzero(np.abs(np.diff(motion.table, axis=0)).max(axis=1) > 0)
    assert len(turns)
    stood = motion.q[turns]
    aside = np.abs(stood[:, 0] - home[0])
    assert (aside > np.deg2rad(59)).all()
    assert np.allclose(stood[:, 1:], home[1:])
    # the program begins and ends at home all the same, and the judge agrees
    assert np.allclose(motion.q[[0, -1]], home)
    path = tmp_path / "aside.npz"
    write_motion(path, motion)
    assert check_motion(*read_in_order(path, prepare(three_case(tmp_path)))).findings == ()


@pytest.mark.slow
def test_neighbours_that_lock_the_torch_out_in_any_order(tmp_path: Path) -> None:
    """Two bosses of one layer, 4 mm apart: the nozzle's rim passes 5 mm over either, and 8 are asked for."""
    own = {
        "slicing": {"h_layer_mm": 6, "h_min_mm": 5, "h_max_mm": 7},
        "tool": {"dimensions": {"stick_out_mm": 5}},
        "checks": {"clearance_mm": 8},
    }
    both = bosses(tmp_path, at(34, height=6), at(46, height=6), length=80)
    result = check_as_asked(prepare(three_case(tmp_path, part=both, **own)))
    assert not result.feasible
    assert result.motion is None
    # the first of them stands, and is what locks the other out
    lost = {i: failure for i, failure in result.failures.items() if failure.reason == "collision"}
    assert set(lost) == set(result.failures)
    t = result.job.targets
    built = t.sub_volume[int(t.sub_volume_index[0])]
    assert all(t.sub_volume[int(t.sub_volume_index[i])] != built for i in lost)
    assert {layer.sub_volume for failure in lost.values() for layer in failure.locked_by} == {built}
    assert not any(row.proved for row in result.rows)
    # so it is the other way round, and each by itself is built
    for k, z in enumerate((34, 46)):
        folder = tmp_path / str(k)
        folder.mkdir()
        alone = bosses(folder, at(z, height=6), length=80)
        assert check_as_asked(prepare(three_case(folder, part=alone, **own))).feasible
    names = [t.sub_volume[k] for k in dict.fromkeys(t.sub_volume_index.tolist())]
    poses = [{"sub_volume": p.sub_volume, "E1_deg": p.E1_deg, "E2_deg": p.E2_deg} for p in result.poses]
    other = {"mode": "indexed", "poses": sorted(poses, key=lambda p: -names.index(p["sub_volume"]))}
    again = check_as_asked(prepare(three_case(tmp_path, part=both, **{**own, "table": other})))
    assert not again.feasible
    u = again.job.targets
    assert {u.sub_volume[int(u.sub_volume_index[i])] for i in again.failures} == {built}
