"""A good motion broken in one way each: what the check of motions has to refuse, and why it does."""

from __future__ import annotations

import csv
import io
import zipfile
from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest
from support.jobs.boss_motion import boss_case, job_of, result_of

from cell.errors import InputError
from cell.job.job import Job
from cell.motion.motion import Motion
from cell.motion.motion_file import ReadMotion, read_motion, write_motion
from cell.report.motion_report import finding_in_words
from cell.verdict.check import check_fixed
from cell.verdict.result import Result
from cell.verification.bead_order import skips
from cell.verification.bead_samples import FINE, SampledMotion, against_beads, dense
from cell.verification.bead_samples import rows_of as way_of
from cell.verification.motion_check import MotionResult, check_motion

DWELL = {"dwell_s": 3.0}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("adversarial")


@pytest.fixture(scope="module")
def good(folder: Path) -> Result:
    found = result_of(boss_case(folder, process=DWELL))
    assert found.motion is not None
    return found


@dataclass(frozen=True, eq=False)
class Chords:
    """Targets as far as beads are measured by them: mm, directions, beads."""

    position: np.ndarray
    normal: np.ndarray
    bead: np.ndarray

    def __len__(self) -> int:
        return len(self.bead)


def look(job: Job, motion: Motion) -> MotionResult:
    found = check_motion(job, ReadMotion(motion, np.arange(len(motion.t_s)) + 1, ()))
    assert all(finding_in_words(f) for f in found.findings)
    return found


def of(found: MotionResult, reason: str) -> list[dict[str, Any]]:
    return [f.detail for f in found.findings if f.reason == reason]


def rows_of(motion: Motion, rows: np.ndarray, t_s: np.ndarray, **changes: Any) -> Motion:
    kept = {name: getattr(motion, name)[rows] for name in ("q", "table", "arc", "bead", "layer", "target")}
    return replace(motion, t_s=t_s, **{**kept, **changes})


def swung(motion: Motion, degrees: float) -> Motion:
    """E2 goes out and comes back during the first dwell."""
    k = int(np.flatnonzero((np.diff(motion.q, axis=0) == 0).all(axis=1) & (motion.arc[1:] == 0))[0])
    s = np.linspace(0, 1, 41)[1:-1]
    rows = np.insert(np.arange(len(motion.t_s)), k + 1, np.full(len(s), k))
    table, t_s = motion.table[rows], motion.t_s[rows]
    table[k + 1 : k + 1 + len(s), 1] += np.deg2rad(degrees) * 64 * s**3 * (1 - s) ** 3
    t_s[k + 1 : k + 1 + len(s)] = motion.t_s[k] + DWELL["dwell_s"] * s
    return rows_of(motion, rows, t_s, table=table)


def flag() -> dict[str, Any]:
    """A small box on the table, far from what is welded."""
    return {"name": "flag", "on": "table", "box": {"size_mm": [10, 10, 10]}, "position_mm": [0, 300, 10]}


def flag_at(job: Job, table: np.ndarray) -> list[float]:
    data = mujoco.MjData(job.scene.model)
    data.qpos[job.scene.table_qpos] = table
    mujoco.mj_kinematics(job.scene.model, data)
    return [float(v) * 1e3 for v in data.geom("flag").xpos]


def test_a_table_that_turns_what_it_carries_into_the_cell(good: Result, folder: Path) -> None:
    flagged = job_of(boss_case(folder, "flag", process=DWELL, fixtures=[flag()]))
    motion = swung(good.motion, 5.0)
    assert look(flagged, motion).feasible
    there = flag_at(flagged, good.motion.table[0] + [0.0, np.deg2rad(5.0)])
    post = {"name": "post", "box": {"size_mm": [10, 10, 10]}, "position_mm": there}
    job = job_of(boss_case(folder, "post", process=DWELL, fixtures=[flag(), post]))
    assert look(job, good.motion).feasible
    found = look(job, motion)
    assert {f.reason for f in found.findings} == {"collision"}
    assert {tuple(sorted(d["pair"])) for d in of(found, "collision")} == {("flag", "post")}


def test_a_table_that_stands_in_the_cell(good: Result, folder: Path) -> None:
    flagged = job_of(boss_case(folder, "flag", fixtures=[flag()]))
    post = {"name": "post", "box": {"size_mm": [10, 10, 10]}, "position_mm": flag_at(flagged, good.motion.table[0])}
    job = job_of(boss_case(folder, "stands", process=DWELL, fixtures=[flag(), post]))
    (hit,) = of(look(job, good.motion), "collision")
    assert set(hit["pair"]) == {"flag", "post"}


def test_a_workpiece_that_reaches_into_the_positioners_own_arm(good: Result, folder: Path) -> None:
    scene = good.job.scene
    data = mujoco.MjData(scene.model)
    data.qpos[scene.table_qpos] = good.motion.table[0]
    mujoco.mj_kinematics(scene.model, data)
    table = data.site(scene.case.positioner.table)
    inside = table.xmat.reshape(3, 3).T @ (data.geom("tilt_arm").xpos - table.xpos) * 1e3
    low = {**flag(), "position_mm": [float(v) for v in inside]}
    job = job_of(boss_case(folder, "low", process=DWELL, fixtures=[low]))
    assert {tuple(sorted(d["pair"])) for d in of(look(job, good.motion), "collision")} == {("flag", "tilt_arm")}
    result = check_fixed(job, job.case.table.E1_deg, job.case.table.E2_deg)
    assert not result.feasible
    assert {row.reason for row in result.rows} == {"collision"}
    assert set(result.rows[0].detail["pair"]) == {"flag", "tilt_arm"}


def test_large_cells_are_looked_at_with_the_table_as_well(good: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cell.collision.checker.MANY_GEOMS", 10)
    assert look(good.job, swung(good.motion, 5.0)).feasible


def test_a_way_back_in_short_steps_is_a_way_back(good: Result) -> None:
    m = good.motion
    bead = np.flatnonzero((m.bead == 1) & (m.arc == 1))
    k = int(bead[len(bead) // 2])
    tcp = good.job.scene.chain.forward(m.q[[k, k + 1]])[:, :3, 3]
    length_mm = float(np.linalg.norm(tcp[1] - tcp[0]) * 1e3)
    there = np.linspace(0, 1, int(np.ceil(length_mm / 0.02)))[1:]
    f = np.concatenate([there[:-1], there[::-1], [0.0], there[:-1]])
    rows = np.insert(np.arange(len(m.t_s)), k + 1, np.full(len(f), k))
    q, t_s = m.q[rows], m.t_s[rows]
    q[k + 1 : k + 1 + len(f)] += f[:, None] * (m.q[k + 1] - m.q[k])
    duration = 3 * (m.t_s[k + 1] - m.t_s[k])
    t_s[k + 1 :] += duration - (m.t_s[k + 1] - m.t_s[k])
    t_s[k + 1 : k + 1 + len(f)] = m.t_s[k] + duration * np.arange(1, len(f) + 1) / (len(f) + 1)
    found = look(good.job, rows_of(m, rows, t_s, q=q))
    (back,) = [d["goes_back_mm"] for d in of(found, "order")]
    assert back == pytest.approx(length_mm, abs=0.05)


def test_progress_without_a_way_is_a_skip(good: Result) -> None:
    job, m = good.job, good.motion
    fine = dense(job, m, way_of(job, m), FINE, m.welding)
    on = against_beads(job, fine, m.target[fine.row])
    bead = m.bead[fine.row]
    assert skips(fine, on, bead) == []
    k = int(np.flatnonzero(bead == 1)[50])
    leap = np.where((bead == 1) & (np.arange(len(bead)) > k), 12e-3, 0.0)
    (found,) = skips(fine, replace(on, progress=on.progress + leap), bead)
    assert found.reason == "order"
    assert found.detail["skips_mm"] == pytest.approx(12.0, abs=0.25)
    assert "12" in finding_in_words(found)


def test_where_a_bead_runs_back_on_itself_a_bow_between_rows_is_no_skip() -> None:
    # 5 mm out and 4 mm back; between rows the wire bows by up to 0.02 mm, nearer to the way back here and there
    position = np.array([[0.0, 0, 0], [0, 5, 0], [0, 1, 0]])
    targets = Chords(position, np.tile([1.0, 0, 0], (3, 1)), np.zeros(3, dtype=int))
    along = np.linspace(0.0, 9.0, 181)
    y = np.where(along <= 5, along, 10 - along)
    Ts = np.tile(np.eye(4), (len(along), 1, 1))
    Ts[:, :3, 2] = [-1.0, 0, 0]
    Ts[:, :3, 3] = 1e-3 * np.stack([np.zeros_like(y), y, np.zeros_like(y)], axis=1)
    target = (along > 5).astype(int)
    # off the chord that the row names by 0.02 mm where its neighbour's end is nearer by 0.015
    position[2, 2] = 0.015
    Ts[along < 5, 2, 3] = 2e-5
    job = SimpleNamespace(targets=targets)
    way = SampledMotion(np.arange(len(along)), np.zeros((len(along), 8)), Ts, np.tile(np.eye(4), (len(along), 1, 1)))
    on = against_beads(job, way, target)
    assert on.progress == pytest.approx(along * 1e-3, abs=5e-5)
    assert skips(way, on, np.zeros(len(along), dtype=int)) == []
    # a torch that does go over to the way back is told of, by what the rows name
    over = against_beads(job, way, np.where(along > 3, 1, 0))
    assert [f.detail["skips_mm"] for f in skips(way, over, np.zeros(len(along), dtype=int))] == [
        pytest.approx(3.9, abs=0.1)
    ]


@pytest.mark.parametrize(("at_full_speed", "rows"), [(True, {1}), (False, set())])
def test_a_motion_starts_from_rest(good: Result, at_full_speed: bool, rows: set[int]) -> None:
    m = good.motion
    u = np.linspace(0, 1, 31)[:-1]
    # 9 degrees of A1 in 0.3 s: braked from 60 deg/s, or in a second smoothly from rest
    way = -9.0 * (1 - u) ** 2 if at_full_speed else -9.0 * (1 - u**3 * (10 - 15 * u + 6 * u**2))
    time = 0.3 if at_full_speed else 1.0
    # it stands at home for a moment, so that no corner is to be rounded there
    index = np.concatenate([np.zeros(len(u) + 1, dtype=int), np.arange(len(m.t_s))])
    q, arc = m.q[index], m.arc[index]
    q[: len(u), 0] += np.deg2rad(way)
    arc[: len(u)] = 0
    found = look(good.job, rows_of(m, index, np.concatenate([time * u, [time], time + 0.1 + m.t_s]), q=q, arc=arc))
    assert {f.row for f in found.findings if f.detail.get("by") == "acceleration"} == rows


def test_an_arc_that_burns_in_one_place_on_the_way(good: Result) -> None:
    m = good.motion
    bead = np.flatnonzero((m.bead == 1) & (m.arc == 1))
    k = int(bead[len(bead) // 2])
    rows = np.insert(np.arange(len(m.t_s)), k + 1, k)
    t_s = m.t_s[rows]
    t_s[k + 1 :] += 0.3
    found = look(good.job, rows_of(m, rows, t_s))
    still = [d for d in of(found, "speed") if d["by"] == "standing still"]
    assert [d["seconds"] for d in still] == [pytest.approx(0.3, abs=1e-6)]
    assert still[0]["limit_s"] == 0.0


def test_a_bead_that_is_welded_twice(good: Result) -> None:
    m = good.motion
    last = np.flatnonzero((m.bead == m.bead.max()) & (m.arc == 1))
    rows = np.concatenate([np.arange(len(m.t_s)), last[::-1][1:], last[1:]])
    arc = m.arc[rows]
    arc[len(m.t_s) : len(m.t_s) + len(last) - 1] = 0
    t_s = np.concatenate([m.t_s, m.t_s[-1] + 0.2 * np.arange(1, 2 * len(last) - 1)])
    found = look(good.job, rows_of(m, rows, t_s, arc=arc))
    number = int(m.bead.max())
    assert {"bead": number, "after_bead": number} in of(found, "order")


@pytest.mark.parametrize("count", [1, 2])
def test_an_arc_off_the_bead(good: Result, count: int) -> None:
    m = good.motion
    travel = np.flatnonzero((m.bead == 1) & (m.arc == 0))
    arc = m.arc.copy()
    arc[travel[len(travel) // 2 :][:count]] = 1
    found = look(good.job, replace(m, arc=arc))
    assert of(found, "order")  # the bead is begun twice
    if count == 2:
        assert any(d.get("off_mm", 0) > 10 for d in of(found, "off_bead"))


def travel_to(motion: Motion, bead: int) -> np.ndarray:
    """Rows of the travel to a bead; those of the way home name the last one as well."""
    rows = np.flatnonzero((motion.bead == bead) & (motion.arc == 0))
    return rows[rows < np.flatnonzero(motion.arc)[-1]]


def dragged(motion: Motion) -> Motion:
    """Without retraction: the torch slides back along the bead that it has just laid, and to the start of the next."""
    q = motion.q.copy()
    for bead in range(1, int(motion.bead.max()) + 1):
        travel = travel_to(motion, bead)
        laid = np.flatnonzero((motion.bead == bead - 1) & (motion.arc == 1))
        back = np.concatenate([motion.q[laid[::-1]], motion.q[travel[-1] + 1][None]])
        at = np.linspace(0, len(back) - 1, len(travel) + 2)[1:-1]
        q[travel] = np.stack([np.interp(at, np.arange(len(back)), column) for column in back.T], axis=1)
    return replace(motion, q=q)


@pytest.mark.slow
def test_a_wire_that_is_drawn_through_what_was_laid(good: Result, folder: Path) -> None:
    short = job_of(boss_case(folder, "short", process={**DWELL, "retract_mm": 1.0}))
    hits = of(look(short, dragged(good.motion)), "collision")
    drawn = [d["pair"] for d in hits if set(d["pair"]) & set(short.case.tool.wire)]
    assert drawn
    assert all(any(name.startswith(("deposit/", "body/")) for name in pair) for pair in drawn)
    # as long as it is asked for the wire comes out of the layer, which is 2.2 mm, before it goes across
    result = result_of(boss_case(folder, "short", process={**DWELL, "retract_mm": 1.0}))
    assert result.feasible
    assert look(short, result.motion).feasible
    model, data = result.job.scene.model, mujoco.MjData(result.job.scene.model)
    wire = model.geom(short.case.tool.wire[0]).id
    m, names = result.motion, [model.geom(g).name for g in range(model.ngeom)]
    tcp = result.job.scene.chain.forward(m.q)[:, :3, 3]
    for bead in range(1, int(m.bead.max()) + 1):
        travel = travel_to(m, bead)
        ends = tcp[[travel[0] - 1, travel[-1] + 1]]
        far = travel[(np.linalg.norm(tcp[travel, None] - ends, axis=2) > 4.3e-3).all(axis=1)]
        laid = [g for g, n in enumerate(names) if n.startswith("deposit/") and int(n.split("/")[1]) < bead]
        for k in far:
            data.qpos[result.job.scene.arm_qpos], data.qpos[result.job.scene.table_qpos] = m.q[k], m.table[k]
            mujoco.mj_kinematics(model, data)
            assert all(mujoco.mj_geomDistance(model, data, wire, g, 0.1, np.zeros(6)) > 0 for g in laid)


def test_columns_are_known_by_their_names(good: Result, tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    write_motion(path, good.motion)
    table = list(csv.reader(path.open()))
    turned = [[*row[::-1], "note" if i == 0 else "any, thing"] for i, row in enumerate(table)]
    text = io.StringIO()
    csv.writer(text, lineterminator="\r\n").writerows(turned)
    (tmp_path / "other.csv").write_bytes(b"\xef\xbb\xbf" + text.getvalue().encode())
    a, b = (read_motion(p, good.job).motion for p in (path, tmp_path / "other.csv"))
    for name in ("t_s", "q", "table", "arc", "bead", "layer", "target"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_archives_that_hold_no_numbers(good: Result, tmp_path: Path) -> None:
    path = tmp_path / "m.npz"

    def refused(said: str) -> None:
        with pytest.raises(InputError) as caught:
            read_motion(path, good.job)
        assert said in str(caught.value)
        assert "\n" not in str(caught.value)

    write_motion(path, good.motion)
    columns = dict(np.load(path))
    n = len(columns["t_s"])

    class Trap:
        def __reduce__(self) -> tuple[Any, ...]:
            return (pytest.fail, ("unpickled",))

    np.savez(path, **{**columns, "A1_deg": np.array([Trap()] * n, dtype=object)})
    refused("not an npz of arrays")
    np.savez(path, **{**columns, "A1_deg": columns["A1_deg"] + 1j})
    refused("A1_deg does not hold numbers (holds complex128)")
    np.savez(path, **{**columns, "t_s": np.zeros(n, dtype=[("a", float)])})
    refused("t_s does not hold numbers")
    np.savez(path, **{**columns, "t_s": np.arange(n).astype("datetime64[s]")})
    refused("t_s does not hold numbers")
    np.savez(path, **{**columns, "A2_deg": np.full(n, np.nan)})
    refused("row 1: A2_deg is not a finite number")
    np.savez(path, **{**columns, "target": np.full(n, 1e300)})
    refused("target")
    with path.open("wb") as file:
        np.save(file, np.zeros(3))
    refused("not an npz of arrays")
    path.write_bytes(b"\x80\x04N.")  # a pickle
    refused("not an npz of arrays")
    with zipfile.ZipFile(path, "w") as archive:
        # a header that promises more than there is
        head = io.BytesIO()
        np.lib.format.write_array_header_1_0(head, {"descr": "<f8", "fortran_order": False, "shape": (10**13,)})
        archive.writestr("t_s.npy", head.getvalue())
    refused("not an npz of arrays")
    write_motion(path, good.motion)
    whole = path.read_bytes()
    path.write_bytes(whole[:60] + bytes(40) + whole[100:])  # damaged inside a column
    refused("not an npz of arrays")
    path.write_bytes(whole)
    with pytest.raises(InputError, match="a motion is at most"):
        read_motion(path, good.job, most_bytes=1000)


def test_a_motion_that_is_too_long_is_refused_before_it_fills_the_memory(good: Result) -> None:
    rows = way_of(good.job, good.motion)
    with pytest.raises(InputError, match="the motion is too long: it takes"):
        dense(good.job, good.motion, rows, FINE, np.ones(len(rows.q) - 1, dtype=bool), most=500)
