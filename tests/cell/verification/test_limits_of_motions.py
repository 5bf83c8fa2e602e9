"""Every limit that a motion is held against: just inside it the motion is accepted, just outside it is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from scipy.spatial import cKDTree
from support.jobs.boss_motion import NEAR_HOME, boss_case, job_of, result_of

from cell.case.read import with_changes
from cell.failure import Kind
from cell.job.job import Job
from cell.job.overhang_check import HORIZONTAL_DEG
from cell.motion.motion import Motion
from cell.motion.motion_file import ReadMotion
from cell.verdict.failure_words import failure_in_words
from cell.verdict.result import Result
from cell.verification.bead_order import FASTEST_SHARE
from cell.verification.bead_samples import FINE, against_beads, along_beads, dense
from cell.verification.bead_samples import rows_of as way_of
from cell.verification.motion_check import MotionResult, check_motion

LEAD_MM = 4.0
SECTIONS: dict[str, Any] = {
    "beads": {"lead_out_mm": LEAD_MM},
    "process": {"least_speed_share": 0.0},
    "robot": NEAR_HOME,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("limits")


@pytest.fixture(scope="module")
def good(folder: Path) -> Result:
    found = result_of(boss_case(folder, **SECTIONS))
    assert found.motion is not None
    return found


def asked(job: Job, **checks: float) -> Job:
    """The same job with other limits that the motion alone is held against."""
    return replace(job, case=with_changes(job.case, checks=job.case.checks.model_copy(update=checks)))


def prepared(folder: Path, **checks: float) -> Job:
    """The same part with other limits."""
    return job_of(boss_case(folder, "asked", checks=checks, **SECTIONS))


def look(job: Job, motion: Motion) -> MotionResult:
    return check_motion(job, ReadMotion(motion, np.arange(len(motion.t_s)) + 1, ()))


def reasons(found: MotionResult) -> set[str]:
    return {f.reason for f in found.findings}


def rows_of(motion: Motion, rows: np.ndarray, t_s: np.ndarray, **changes: Any) -> Motion:
    kept = {name: getattr(motion, name)[rows] for name in ("q", "table", "arc", "bead", "layer", "target")}
    return replace(motion, t_s=t_s, **{**kept, **changes})


def test_how_far_off_upright_beads_are_laid(good: Result) -> None:
    scene = good.job.scene
    data = mujoco.MjData(scene.model)
    data.qpos[scene.table_qpos] = good.motion.table[0]
    mujoco.mj_kinematics(scene.model, data)
    up = good.job.targets.normal @ data.site("part").xmat.reshape(3, 3)[2]
    steepest = float(np.rad2deg(np.arccos(np.clip(up, -1.0, 1.0))).max())
    assert look(asked(good.job, gravity_max_deg=steepest + 0.05), good.motion).feasible
    found = look(asked(good.job, gravity_max_deg=steepest - 0.05), good.motion)
    assert reasons(found) == {"gravity"}
    assert max(f.failure.measure for f in found.findings) == pytest.approx(steepest, abs=1e-3)


def test_targets_past_the_horizontal_are_counted_as_by_a_check(folder: Path) -> None:
    # where the table makes some of a bead's targets hang, its last ones among them
    result = result_of(boss_case(folder, "level", table={"E1_deg": 2, "E2_deg": 60}))
    assert result.motion is not None
    (line,) = (str(warning) for warning in result.warnings if "past the horizontal" in str(warning))
    hang = np.rad2deg(result.gravity) > HORIZONTAL_DEG
    assert 0 < hang.sum() < len(hang)
    assert hang[np.flatnonzero(np.diff(result.job.targets.bead, append=-1))].any()
    assert line in [str(warning) for warning in look(result.job, result.motion).warnings]


@pytest.mark.parametrize("side", ["lower", "upper"])
def test_both_ends_of_a_joints_range(good: Result, side: str) -> None:
    job, chain = good.job, good.job.scene.chain
    sign, joint = (1.0, 2) if side == "upper" else (-1.0, 1)
    end = float((sign * good.motion.q[:, joint]).max())

    def ends_at(value: float) -> MotionResult:
        ends = getattr(chain, side).copy()
        ends[joint] = sign * value
        scene = replace(job.scene, chain=replace(chain, **{side: ends}))
        return look(replace(job, scene=scene), good.motion)

    assert ends_at(end + 1e-4).feasible
    found = ends_at(end - np.deg2rad(0.1))
    assert reasons(found) == {"joint_limit"}
    assert {f.failure.axis for f in found.findings} == {f"A{joint + 1}"}
    assert max(f.failure.measure for f in found.findings) == pytest.approx(0.1, abs=0.01)


def test_how_near_the_wrist_comes_to_its_singularity(good: Result, folder: Path) -> None:
    m = good.motion
    welding = np.flatnonzero(m.arc == 1)
    least = float(np.rad2deg(np.abs(m.q[welding, 4])).min())
    assert look(prepared(folder, wrist_deg=least - 0.1), m).feasible
    found = look(prepared(folder, wrist_deg=least + 0.1), m)
    assert reasons(found) == {"singular"}
    assert min(f.failure.measure for f in found.findings) == pytest.approx(least, abs=0.05)


def test_how_far_off_the_bead_the_tcp_is(good: Result) -> None:
    q = good.motion.q.copy()
    q[:, 0] += 2e-4
    turned = replace(good.motion, q=q)
    off = look(asked(good.job, off_bead_mm=10.0), turned).bead_distance[0] * 1e3
    assert 0.1 < off < 1.0
    inside, outside = (
        look(asked(good.job, off_bead_mm=share * off, off_wire_deg=1.0), turned) for share in (1.02, 0.98)
    )
    assert Kind.OFF_BEAD not in {f.failure.kind for f in inside.findings}
    assert Kind.OFF_BEAD in {f.failure.kind for f in outside.findings}


@pytest.mark.parametrize(
    ("axis", "turn"), [(5, 0.02), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((0, 2e-4), (3, -0.01)))]
)
def test_the_distance_reported_is_that_from_the_bead(good: Result, axis: int, turn: float) -> None:
    """Against points 10 um apart on the bead's stretches next to the row's target."""
    q = good.motion.q.copy()
    q[:, axis] += turn
    job, m = good.job, replace(good.motion, q=q)
    fine = dense(job, m, way_of(job, m), FINE, m.welding)
    target = m.target[fine.row]
    seen = np.zeros(len(target))
    for k in np.unique(target):
        mine = np.flatnonzero(target == k)
        away = cKDTree(points_near(job, k)).query(fine.Ts_part_tcp[mine, :3, 3])[0]
        seen[mine] = away
    on = against_beads(job, fine, target)
    np.testing.assert_allclose(on.bead_distance, seen, rtol=1e-3, atol=5e-6)
    found = look(job, m)
    assert found.bead_distance[0] == on.bead_distance.max()
    assert found.bead_distance[1] == fine.row[on.bead_distance.argmax()] + 1
    off = [f.failure.measure for f in found.findings if f.failure.kind is Kind.OFF_BEAD]
    assert max(off) == pytest.approx(seen.max() * 1e3, abs=5e-3)


def points_near(job: Job, k: int) -> np.ndarray:
    """Points on the stretches of a bead next to target k, (m, 3), m."""
    t = job.targets
    ends = [
        (t.position[e] * 1e-3, t.position[e + 1] * 1e-3)
        for e in (k - 1, k, k + 1)
        if 0 <= e < len(t) - 1 and t.bead[e] == t.bead[e + 1] == t.bead[k]
    ]
    return np.concatenate(
        [a + np.linspace(0, 1, int(np.linalg.norm(b - a) / 1e-5) + 2)[:, None] * (b - a) for a, b in ends]
    )


@pytest.mark.parametrize(
    ("turn", "limits"),
    [
        *[(0.005, (0.05, 0.05)), (0.02, (0.6, 3.0))],
        *(pytest.param(*one, marks=pytest.mark.slow) for one in ((0.02, (0.05, 0.05)), (0.005, (0.6, 3.0)))),
    ],
)
def test_what_is_too_far_from_the_place_that_fits_best_is_wrong(good: Result, turn, limits) -> None:
    """Whatever figure it is reported by: no sample over a limit is left out."""
    q = good.motion.q.copy()
    q[:, 5] += turn
    job, m = asked(good.job, off_bead_mm=limits[0], off_wire_deg=limits[1]), replace(good.motion, q=q)
    fine = dense(job, m, way_of(job, m), FINE, m.welding)
    on = against_beads(job, fine, m.target[fine.row])
    assert (on.judged_distance >= on.bead_distance).all()
    wrong = (on.judged_distance * 1e3 > limits[0] + 1e-5) | (np.rad2deg(on.wire_angle) > limits[1] + 1e-5)
    told = np.zeros(len(m.t_s), dtype=bool)
    for f in look(job, m).findings:
        if f.failure.kind in (Kind.OFF_BEAD, Kind.OFF_WIRE):
            told[f.row - 1 : f.to_row] = True
    assert set(np.flatnonzero(told)) >= set(fine.row[wrong])
    assert wrong.any() == told.any()


@pytest.mark.parametrize(("back_mm", "wrong"), [(0.04, False), (0.08, True)])
def test_how_far_a_bead_may_go_back(good: Result, back_mm: float, wrong: bool) -> None:
    """Half way on a step the TCP goes back a little, of what counts as rounding."""
    job, m = good.job, good.motion
    bead = np.flatnonzero((m.bead == 1) & (m.arc == 1))
    k = int(bead[len(bead) // 2])
    tcp = job.scene.chain.forward(m.q[[k, k + 1]])[:, :3, 3]
    back = back_mm * 1e-3 / float(np.linalg.norm(tcp[1] - tcp[0]))
    assert back < 0.5
    share = np.array([0.5, 0.5 - back])
    rows = np.insert(np.arange(len(m.t_s)), k + 1, [k, k])
    q, t_s = m.q[rows], m.t_s[rows].copy()
    q[k + 1 : k + 3] += share[:, None] * (m.q[k + 1] - m.q[k])
    t_s[k + 1 :] += 1.0
    t_s[k + 1 : k + 3] = m.t_s[k] + [0.4, 0.8]
    found = look(job, rows_of(m, rows, t_s, q=q))
    gone = [f.detail["goes_back_mm"] for f in found.findings if "goes_back_mm" in f.detail]
    assert gone == ([pytest.approx(back_mm, abs=0.01)] if wrong else [])


def test_a_bead_that_is_cut_short_where_it_comes_back_to_its_start(good: Result) -> None:
    """The arc runs on over the start of the bead: from the first pass over that place to the last one in one step."""
    job, m = good.job, good.motion
    progress = against_beads(job, way_of(job, m), m.target).progress
    bead = np.flatnonzero((m.bead == 1) & (m.arc == 1))
    whole = float(along_beads(job)[job.targets.bead == 1].max())
    first = bead[progress[bead] <= 0.5e-3 * LEAD_MM]
    last = bead[progress[bead] >= whole - 0.5e-3 * LEAD_MM]
    rows = np.concatenate([np.arange(bead[0]), first, last, np.arange(bead[-1] + 1, len(m.t_s))])
    dt = np.diff(m.t_s, prepend=m.t_s[0])[rows]
    found = look(job, rows_of(m, rows, np.cumsum(np.maximum(dt, 0.02))))
    skipped = [f.detail["skips_mm"] for f in found.findings if "skips_mm" in f.detail]
    assert skipped == [pytest.approx(1e3 * whole - LEAD_MM, abs=1.5)]


@pytest.mark.parametrize(("short_mm", "left"), [(0.04, 0), (0.1, 1)])
def test_how_much_of_a_bead_may_be_left_out_at_its_end(good: Result, short_mm: float, left: int) -> None:
    """The arc goes off a little before the last target."""
    job, m = good.job, good.motion
    end = np.flatnonzero((m.bead == 1) & (m.arc == 1))[-1]
    tcp = job.scene.chain.forward(m.q[[end - 1, end]])[:, :3, 3]
    q, share = m.q.copy(), short_mm * 1e-3 / float(np.linalg.norm(tcp[1] - tcp[0]))
    assert share < 1.0
    q[end] += share * (q[end - 1] - q[end])
    found = look(job, replace(m, q=q))
    missing = [f for f in found.findings if f.failure.kind is Kind.NOT_WELDED]
    assert len(missing) == left
    assert found.welded == len(job.targets) - left


@pytest.mark.parametrize(("share", "wrong"), [(0.98, False), (1.02, True)])
def test_how_fast_a_bead_may_be_laid(good: Result, share: float, wrong: bool) -> None:
    m = good.motion
    dt = np.diff(m.t_s)
    dt[m.welding] /= share * FASTEST_SHARE * float(np.nanmax(m.held_speed.ratio))
    found = look(good.job, replace(m, t_s=np.concatenate([[0.0], np.cumsum(dt)])))
    kinds = {f.failure.kind for f in found.findings}
    assert (Kind.DEPOSITION_SPEED in kinds) == wrong
    fast = [f.failure for f in found.findings if f.failure.kind is Kind.DEPOSITION_SPEED]
    assert all("of the deposition speed reached; limit 105 %" in failure_in_words(one) for one in fast)
