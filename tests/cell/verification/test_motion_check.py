"""Motions from outside: a good one passes, and everything that can be wrong with one is found, with its measure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, job_of, result_of

from cell.collision.proofs.reach_radii import table_radii
from cell.job.job import Job
from cell.motion.motion import Motion
from cell.motion.motion_file import ReadMotion
from cell.report.motion_report import finding_in_words, motion_document, motion_lines
from cell.verdict.result import Result
from cell.verification.motion_check import MotionResult, check_motion
from ik.singularity import sides


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("motion")


@pytest.fixture(scope="module")
def good(folder: Path) -> Result:
    found = result_of(boss_case(folder))
    assert found.motion is not None
    return found


def look(job: Job, motion: Motion) -> MotionResult:
    found = check_motion(job, ReadMotion(motion, np.arange(len(motion.t_s)) + 1, ()))
    # whatever is found can be said
    document = motion_document(found, "m.csv")
    assert document["verdict"] == ("infeasible" if document["findings"] else "feasible")
    assert all(finding_in_words(f) for f in found.findings)
    assert list(motion_lines(found, "m.csv"))
    return found


def of(found: MotionResult, reason: str) -> list[dict[str, Any]]:
    return [f.detail for f in found.findings if f.reason == reason]


def reasons(found: MotionResult) -> set[str]:
    return {f.reason for f in found.findings}


def rows_of(motion: Motion, rows: np.ndarray, **changes: Any) -> Motion:
    """Some of the rows; times close up."""
    columns = ("q", "table", "arc", "bead", "layer", "target")
    dt = np.diff(motion.t_s, prepend=motion.t_s[0])
    kept = {name: getattr(motion, name)[rows] for name in columns}
    return replace(motion, t_s=np.cumsum(np.maximum(dt[rows], 1e-3)), **{**kept, **changes})


def test_a_checked_motion_passes_and_is_measured_alike(good: Result) -> None:
    found = look(good.job, good.motion)
    assert found.findings == ()
    assert found.welded == len(good.job.targets)
    # of the same way, sampled otherwise
    assert found.clearance[0] == pytest.approx(good.clearance.value, abs=1e-6)
    assert found.bead_distance[0] < 5e-5
    assert np.rad2deg(found.wire_angle[0]) < 0.05
    # the law runs the drives to their limit and no further
    assert 0.8 < found.use[1].max() < 1.005
    np.testing.assert_allclose(found.held_speed.ratio, good.motion.held_speed.ratio, rtol=1e-3)


def test_a_joint_outside_its_range(good: Result, folder: Path) -> None:
    q = good.motion.q.copy()
    q[:, 5] += 2 * np.pi * np.where(q[:, 5].mean() > 0, 1, -1)
    found = look(good.job, replace(good.motion, q=q))
    if np.abs(q[:, 5]).max() < np.deg2rad(350):
        pytest.skip("A6 has a whole turn to spare")
    assert reasons(found) == {"joint_limit"}
    assert of(found, "joint_limit")[0]["axis"] == "A6"


def test_too_fast_and_too_slow(good: Result) -> None:
    fast = look(good.job, replace(good.motion, t_s=good.motion.t_s / 20))
    assert {"speed", "acceleration", "deposition"} <= {d["by"] for d in of(fast, "speed")}
    share = next(d for d in of(fast, "speed") if d["by"] == "deposition")["share"]
    assert share > 5
    slow = look(good.job, replace(good.motion, t_s=good.motion.t_s * 4))
    assert reasons(slow) == {"speed"}
    assert {d["by"] for d in of(slow, "speed")} == {"deposition"}
    assert max(d["share"] for d in of(slow, "speed")) <= 0.25


def test_a_little_too_fast_is_too_fast(good: Result) -> None:
    use = look(good.job, good.motion).use[0].max()
    a_little = look(good.job, replace(good.motion, t_s=good.motion.t_s * use / 1.05))
    assert "speed" in {d["by"] for d in of(a_little, "speed")}


def test_a_jerk_is_an_acceleration_and_no_speed(good: Result) -> None:
    # every travel between beads at an even speed: starts and stops without ramps
    m = good.motion
    dt = np.diff(m.t_s)
    group = np.cumsum(np.diff(m.welding.astype(int), prepend=0) != 0)
    turn = np.linalg.norm(np.diff(m.q, axis=0), axis=1)
    for g in np.unique(group):
        mine = group == g
        if not m.welding[mine].any() and 0 < g < group[-1]:
            dt[mine] = dt[mine].sum() / 3 * turn[mine] / turn[mine].sum()
    found = look(good.job, replace(m, t_s=np.concatenate([[0], np.cumsum(dt)])))
    assert reasons(found) == {"speed"}
    assert {d["by"] for d in of(found, "speed")} == {"acceleration"}


def test_an_arc_that_burns_at_a_standstill(good: Result, folder: Path) -> None:
    m = good.motion
    first = int(np.argmax(m.arc))
    rows = np.insert(np.arange(len(m.t_s)), first, first)
    waiting = replace(rows_of(m, rows), t_s=np.concatenate([m.t_s[: first + 1], m.t_s[first:] + 2.0]))
    found = look(good.job, waiting)
    assert reasons(found) == {"speed"}
    assert of(found, "speed")[0]["by"] == "standing still"
    assert of(found, "speed")[0]["seconds"] == pytest.approx(2.0)
    patient = job_of(boss_case(folder, "patient", process={"arc_on_s": 2.0}))
    assert look(patient, waiting).feasible


def test_off_the_bead_and_off_the_wire(good: Result) -> None:
    q = good.motion.q.copy()
    bead = (good.motion.bead == 1) & (good.motion.arc == 1)
    q[bead, 4] += np.deg2rad(0.2)
    found = look(good.job, replace(good.motion, q=q))
    kinds = {key for d in of(found, "off_bead") for key in d}
    assert {"off_mm", "off_wire_deg"} <= kinds
    rows = np.flatnonzero(bead)
    assert all(rows[0] <= f.row <= rows[-1] + 1 for f in found.findings if f.reason == "off_bead")


def test_between_rows_that_are_far_apart_the_wire_leaves_the_bead(good: Result) -> None:
    m = good.motion
    # every row is on the bead; the straight joint motion between them is not
    at_target = np.flatnonzero((m.arc == 0) | (np.diff(m.target, prepend=-1) != 0) | (np.diff(m.arc, append=0) != 0))
    found = look(good.job, rows_of(m, at_target))
    assert "off_bead" in reasons(found)


def test_a_roll_that_the_case_does_not_allow(good: Result, folder: Path) -> None:
    job = job_of(boss_case(folder, "fixed", roll={"fixed_deg": 33}))
    found = look(job, good.motion)
    assert reasons(found) == {"off_bead"}
    assert "roll_outside_deg" in of(found, "off_bead")[0]


def test_the_other_way_round_the_wrist_is_another_configuration(good: Result) -> None:
    q = good.motion.q.copy()
    bead = np.flatnonzero((good.motion.bead == 1) & (good.motion.arc == 1))
    for k in bead[len(bead) // 2 :]:
        q[k] = [*q[k, :3], q[k, 3] - np.pi * np.sign(q[k, 3]), -q[k, 4], q[k, 5] - np.pi * np.sign(q[k, 5])]
    found = look(good.job, replace(good.motion, q=q))
    ways = {d["on_the_way"] for d in of(found, "no_path")}
    assert ways == {"configuration change", "jump"}


def test_each_singularity_has_two_sides(good: Result) -> None:
    form = good.job.solver.geometry
    q = np.deg2rad([[0, -60, 110, 0, 30, 0], [0, -60, 110, 0, -30, 0]])
    assert (sides(form, q[0]) != sides(form, q[1])).tolist() == [True, False, False]
    over = np.deg2rad([[0, -60, 110, 0, 30, 0], [0, -150, 60, 0, 30, 0]])
    assert (sides(form, over[0]) != sides(form, over[1]))[2]


def test_something_in_the_way(good: Result, folder: Path) -> None:
    tcp = good.job.scene.chain.forward(good.motion.q)[:, :3, 3]
    high = tcp[np.argmax(tcp[:, 2])] * 1e3
    box = {"name": "beam", "box": {"size_mm": [40, 40, 40]}, "position_mm": [float(v) for v in high]}
    job = job_of(boss_case(folder, "beam", fixtures=[box]))
    found = look(job, good.motion)
    assert reasons(found) == {"collision"}
    assert any("beam" in d["pair"] for d in of(found, "collision"))


def test_something_in_the_way_between_two_rows(good: Result, folder: Path) -> None:
    m = good.motion
    tcp = good.job.scene.chain.forward(m.q)[:, :3, 3]
    top = tcp[np.argmax(tcp[:, 2])]
    post = {"name": "post", "box": {"size_mm": [6, 6, 6]}, "position_mm": [float(v) for v in top * 1e3]}
    job = job_of(boss_case(folder, "post", fixtures=[post]))
    far = (np.linalg.norm(tcp - top, axis=1) > 0.02) | (m.arc == 1)
    assert not far.all()
    found = look(job, rows_of(m, np.flatnonzero(far)))
    assert any("post" in d["pair"] for d in of(found, "collision"))


def test_beads_left_out_out_of_order_and_backwards(good: Result) -> None:
    m = good.motion
    without = look(good.job, rows_of(m, np.flatnonzero(m.bead != 1)))
    assert {"not_welded", "order"} <= reasons(without)
    mine = np.flatnonzero(good.job.targets.bead == 1)
    assert of(without, "not_welded") == [{"target": int(mine[0]), "to_target": int(mine[-1])}]
    assert without.welded == len(good.job.targets) - len(mine)
    bead = np.flatnonzero((m.bead == 1) & (m.arc == 1))
    order = np.arange(len(m.t_s))
    order[bead] = bead[::-1]
    back = look(good.job, replace(rows_of(m, order), t_s=m.t_s))
    assert any("goes_back_mm" in d for d in of(back, "order"))
    stops = look(good.job, rows_of(m, np.arange(bead[-1] - 8)))
    assert "not_welded" in reasons(stops)


def waiting_table(good: Result, folder: Path, seconds: float) -> tuple[Job, Motion]:
    """A motion during whose first dwell E2 goes out by 5 degrees and comes back."""
    result = result_of(boss_case(folder, f"wait{seconds:g}", process={"dwell_s": seconds}))
    m = result.motion
    k = int(np.flatnonzero((np.diff(m.q, axis=0) == 0).all(axis=1) & (m.arc[1:] == 0))[0])
    s = np.linspace(0, 1, 41)[1:-1]
    smooth = 64 * s**3 * (1 - s) ** 3  # out and back, at rest at both ends
    rows = np.insert(np.arange(len(m.t_s)), k + 1, np.full(len(s), k))
    table, t_s = m.table[rows], m.t_s[rows]
    table[k + 1 : k + 1 + len(s), 1] += np.deg2rad(5.0) * smooth
    t_s[k + 1 : k + 1 + len(s)] = m.t_s[k] + seconds * s
    return result.job, replace(rows_of(m, rows), t_s=t_s, table=table)


def test_a_table_that_turns_while_the_arm_waits(good: Result, folder: Path) -> None:
    assert look(*waiting_table(good, folder, 3.0)).feasible
    hasty = look(*waiting_table(good, folder, 0.2))
    assert reasons(hasty) == {"speed"}
    assert {(d["axis"], d["by"]) for d in of(hasty, "speed")} >= {("E2", "acceleration")}


def test_a_table_that_turns_under_the_arc(good: Result) -> None:
    table = good.motion.table.copy()
    welding = np.flatnonzero((good.motion.bead == 0) & (good.motion.arc == 1))
    table[welding, 1] += np.deg2rad(np.linspace(0, 1, len(welding)))
    found = look(good.job, replace(good.motion, table=table))
    assert "off_bead" in reasons(found)


def test_arm_and_table_may_turn_together(good: Result) -> None:
    # the same motion seen from a cell whose table stands elsewhere is another one for the arm: turning E2 by a little
    # needs the arm to follow, and a motion that follows it exactly is on the bead
    from ik import dls
    from ik.roll import RollWindow

    m, job = good.motion, good.job
    turn = np.deg2rad(2.0) * np.sin(np.linspace(0, np.pi, len(m.t_s)))
    T_part = np.array([job.scene.T_base_part(E1, E2 + d) for (E1, E2), d in zip(m.table, turn, strict=True)])
    T_old = job.scene.T_base_part(*m.table[0])
    wanted = T_part @ np.linalg.inv(T_old) @ job.scene.chain.forward(m.q)
    followed = dls.track_one(job.scene.chain, wanted, m.q, RollWindow.fixed(0.0))
    assert followed.ok.all()
    found = look(job, replace(m, q=followed.q, table=m.table + np.stack([np.zeros_like(turn), turn], axis=1)))
    assert found.bead_distance[0] < 5e-5
    assert reasons(found) <= {"speed"}  # the time law is another's


def test_nothing_on_the_table_travels_further_than_its_radius_says(good: Result) -> None:
    scene = good.job.scene
    model, data = scene.model, mujoco.MjData(scene.model)
    radius = table_radii(scene)
    moves = ~scene.arm_geom & scene.contact_bits.any(axis=0)
    rng = np.random.default_rng(0)
    places = []
    for table in (rng.uniform(*scene.table_range.T, (20, 2)) for _ in range(2)):
        corners = []
        for row in table:
            data.qpos[scene.table_qpos] = row
            mujoco.mj_kinematics(model, data)
            # the farthest corner of every geom's own box
            R = data.geom_xmat.reshape(-1, 3, 3)[moves]
            signs = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
            local = model.geom_aabb[moves, None, :3] + signs * np.minimum(model.geom_aabb[moves, None, 3:], 1.0)
            corners.append(np.einsum("gij,gkj->gki", R, local) + data.geom_xpos[moves, None])
        places.append((table, np.array(corners)))
    (a, p), (b, q) = places
    travelled = np.linalg.norm(q - p, axis=-1).max(axis=(1, 2))
    assert (travelled <= (np.abs(b - a) * radius).sum(axis=1) + 1e-9).all()
    assert travelled.max() > 0.1


def test_an_arm_without_a_spherical_wrist_is_looked_at_as_well(good: Result, folder: Path) -> None:
    job = job_of(boss_case(folder, "dls", ik={"solver": "dls"}))
    job.__dict__["solver"] = replace(job.solver, geometry=None)  # as of an arm that no closed form fits
    found = look(job, good.motion)
    assert found.feasible
    assert found.singularity[2] == "sigma"


def test_waits_are_counted_apart(good: Result, folder: Path) -> None:
    process = {"dwell_s": 5.0, "arc_on_s": 0.5, "arc_off_s": 0.25}
    found = result_of(boss_case(folder, "waits", process=process))
    m = found.motion
    beads = int(m.bead.max()) + 1
    layers = len(np.unique(m.layer))
    assert m.dwell_time == pytest.approx(5.0 * (layers - 1))
    assert m.arc_time == pytest.approx(good.motion.arc_time + 0.75 * beads)
    assert m.arc_time + m.travel_time + m.dwell_time == pytest.approx(m.t_s[-1])
    # it waits where it is retracted
    wait = np.flatnonzero((np.diff(m.q, axis=0) == 0).all(axis=1) & ~m.welding)
    tcp = found.job.scene.chain.forward(m.q)[:, :3, 3]
    for k in wait:
        last = np.flatnonzero(m.arc[:k] == 1)[-1]
        assert np.linalg.norm(tcp[k] - tcp[last]) >= found.job.case.process.retract_mm * 1e-3 - 1e-6
    assert look(found.job, m).feasible


def test_a_speed_that_one_axis_cannot_hold_has_its_reason(folder: Path) -> None:
    lazy = {"max_acceleration_deg_s2": [400.0, 0.2, 400.0, 400.0, 400.0, 400.0]}
    found = result_of(boss_case(folder, "lazy", robot=lazy))
    assert not found.feasible
    slow = [row.detail for row in found.rows if row.reason == "speed"]
    assert slow
    assert {d["axis"] for d in slow} == {"A2"}
    assert {d["by"] for d in slow} == {"acceleration"}
    assert all(d["share"] < 0.5 for d in slow)
