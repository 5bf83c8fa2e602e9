"""A part whose sub-volumes are built at table poses of their own, in one motion."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.jobs.indexed import corner, three_bosses, three_case, with_table

from cell.case.read import load_case
from cell.cli.main import main
from cell.failure import ON_TRAVEL, Contact, Failure, Kind
from cell.job.job import prepare
from cell.motion.file_order import read_in_order
from cell.motion.motion_file import write_motion
from cell.report.check_document import report_document
from cell.report.check_report import pasted_poses
from cell.table_poses.layer_order import shortest_order
from cell.table_poses.table_turn import TurnSearch
from cell.verdict.by_table_mode import check
from cell.verdict.check import check_fixed
from cell.verdict.indexed import _Build
from cell.verdict.order_search import OrderSearch
from cell.verdict.result import Result
from cell.verification.motion_check import check_motion


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("three")


@pytest.fixture(scope="module")
def found(folder: Path) -> Result:
    return check(prepare(three_case(folder)))


def test_every_boss_is_turned_under_the_torch(found: Result) -> None:
    assert found.feasible
    assert found.mode == "indexed"
    assert sorted(pose.sub_volume for pose in found.poses) == ["SV1", "SV2", "SV3"]
    # a third of a turn apart: at no one pose are all laid within 30 degrees of upright, at their own each is
    assert np.rad2deg(found.gravity).max() < 30
    one = check_fixed(found.job, *found.asked)
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


@pytest.mark.slow
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


def test_a_part_whose_table_cannot_turn_in_between_is_infeasible(
    found: Result, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    met = Failure(Kind.COLLISION, -4.0, 0.0, place=ON_TRAVEL, contact=Contact(pair=("post", "floor")))
    poses = [pose.document() for pose in found.poses]
    job = prepare(with_table(three_case(folder), {"mode": "indexed", "poses": poses}))
    monkeypatch.setattr(TurnSearch, "search", lambda *_: met)
    result = check(job)
    assert not result.feasible
    assert list(result.failures) == [pose.first for pose in result.poses[1:]]
    assert {row.detail["from_target"] for row in result.rows if row.failure} == {
        pose.first - 1 for pose in result.poses[1:]
    }


def test_the_least_clearance_is_that_of_the_turns_too(found: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    near = SimpleNamespace(distance=np.array([1e-3]), pair=np.array([[0, 1]]))
    laid = []

    def least(*given: Any) -> Any:
        laid.append(set(given[3].tolist()))
        return None, near

    monkeypatch.setattr("cell.verdict.indexed.least_between_samples", least)
    poses = [pose.document() for pose in found.poses]
    result = check(prepare(with_table(found.job.case, {"mode": "indexed", "poses": poses})))
    assert result.feasible
    assert found.clearance is not None
    assert result.clearance is not None
    assert result.clearance.value == 1e-3 < found.clearance.value
    # with all that is laid before
    assert laid == [{int(result.job.deposits_before[pose.first])} for pose in result.poses[1:]]


@pytest.mark.slow
def test_found_poses_can_be_pasted_back(found: Result, folder: Path) -> None:
    import yaml

    pasted = yaml.safe_load("\n".join(pasted_poses(found)))["table"]
    assert pasted["poses"] == [pose.document() for pose in found.poses]
    again = check(prepare(with_table(three_case(folder), pasted)))
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
    result = check(prepare(case))
    assert not result.feasible
    assert result.motion is None
    # the bosses stand out level: their own measure is over the limit, and at a given pose that is proved
    assert result.reasons["gravity"] == len(result.rows)
    assert all(row.proved for row in result.rows)


@pytest.mark.parametrize("mode", ["indexed", pytest.param("best", marks=pytest.mark.slow)])
def test_nothing_is_proved_of_poses_that_were_searched(folder: Path, mode: str) -> None:
    far = {"position_mm": [6000, 0, 0], "rotation_deg": [0, 0, -90]}
    result = check(prepare(with_table(three_case(folder), {"mode": mode}, positioner=far)))
    assert result.infeasible == len(result.rows)
    assert not any(row.proved for row in result.rows)


@pytest.mark.slow
def test_the_best_fixed_pose_is_found_and_used(tmp_path: Path, make_case) -> None:
    case = load_case(make_case(table={"E1_deg": -90, "E2_deg": 180}))
    given = check_fixed(prepare(case), -90, 180)
    best = check(prepare(with_table(case, {"mode": "best"})))
    assert best.feasible
    assert best.mode == "best"
    assert best.gravity.max() < np.pi / 6 < given.gravity.max()
    assert check_fixed(prepare(case), *best.asked).feasible


@pytest.mark.slow
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
    """Home is in the way of every turn, and so is all that is nearer to the part."""

    def search(self, q, a, b, deposits_laid):
        home = self.scene.home
        if (q == home).all() or (q[1:] != home[1:]).any():
            return Failure(Kind.COLLISION, 0.0, 5.0, contact=Contact(("a", "b")), place=ON_TRAVEL)
        return super().search(q, a, b, deposits_laid)


class AtHomeAlone(TurnSearch):
    """Every place but home is in the way of every turn."""

    def search(self, q, a, b, deposits_laid):
        if (q != self.scene.home).any():
            return Failure(Kind.COLLISION, 0.0, 5.0, contact=Contact(("a", "b")), place=ON_TRAVEL)
        return super().search(q, a, b, deposits_laid)


@pytest.mark.slow
def test_the_arm_stands_nearer_than_at_home_where_that_is_clear_of_the_turn(
    found: Result, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    motion = found.motion
    assert motion is not None
    turning = np.abs(np.diff(motion.table, axis=0)).max(axis=1) > 0
    stood = motion.q[np.flatnonzero(turning & ~np.append(False, turning[:-1]))]
    home = found.job.scene.home
    assert len(stood) == len(found.poses) - 1
    assert (np.abs(stood - home).max(axis=1) > np.deg2rad(20)).all()
    assert np.allclose(motion.q[[0, -1]], home)
    monkeypatch.setattr("cell.verdict.indexed.TurnSearch", AtHomeAlone)
    from_home = check(prepare(three_case(folder)))
    assert from_home.motion is not None
    turning = np.abs(np.diff(from_home.motion.table, axis=0)).max(axis=1) > 0
    assert np.allclose(from_home.motion.q[:-1][turning], home)
    # the beads are what they are, and take as long; the rest is shorter
    for a, b in zip(from_home.rows, found.rows, strict=True):
        assert np.array_equal(a.q, b.q)
    assert motion.arc_time == pytest.approx(from_home.motion.arc_time, abs=1e-3)
    assert motion.t_s[-1] < from_home.motion.t_s[-1] - 1.0 * len(stood)
    assert motion.home_s == pytest.approx(from_home.motion.home_s, abs=1e-3)


@pytest.mark.slow
def test_the_arm_stands_aside_where_home_is_in_the_way_of_the_turn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cell.verdict.indexed.TurnSearch", ShutAtHome)
    job = prepare(three_case(tmp_path))
    result = check(job)
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
@pytest.mark.parametrize("face_first", [False, True])
def test_blocks_that_lock_the_torch_out_of_one_another_in_any_order_are_refused_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, face_first: bool
) -> None:
    built: list[_Build] = []

    class Counted(_Build):
        def __init__(self, *args) -> None:
            super().__init__(*args)
            built.append(self)

    monkeypatch.setattr("cell.verdict.indexed._Build", Counted)
    job = prepare(load_case(corner(tmp_path, face_first=face_first)))
    search = OrderSearch(job)
    first = (search.needs[0][0, 1], search.needs[1][0, 0])
    assert first == (0, 0)  # neither may have laid anything before the other has begun
    assert shortest_order(job.layers, search.seconds, search.needs) is None
    result = check(job)
    assert not result.feasible
    assert len(built) == 1  # there is no other order, and none is tried
    # as they stand: the second is locked out of all of its layers, by layers of the first from its lowest one on
    assert {row.reason for row in result.rows} == {None, "collision"}
    lost = [row.failure for row in result.rows if row.failure is not None]
    t = job.targets
    assert {int(t.layer[i]) for i in result.failures} == set(range(job.layers[1]))
    assert {int(t.sub_volume_index[i]) for i in result.failures} == {1}
    for failure in lost:
        assert {one.sub_volume for one in failure.locked_by} == {"SV1"}
        assert not failure.proved  # at another pose it may be free
        assert "deposit" in failure.pair[0] + failure.pair[1]
        assert failure.document()["blocked_by_layers"]
    assert min(one.layer for failure in lost for one in failure.locked_by) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["shaft.stl", "face.stl"])
def test_either_of_these_blocks_alone_can_be_built(tmp_path: Path, name: str) -> None:
    assert check(prepare(load_case(corner(tmp_path, take=name)))).feasible
