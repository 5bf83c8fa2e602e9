"""A program begins and ends at the arm's home: the ways there and back are part of the verdict and of the motion."""

from __future__ import annotations

import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.jobs.boss_motion import boss_case as three_layers
from support.jobs.boss_motion import job_of, result_of
from support.jobs.cases import radial
from support.jobs.searches import setup_of

from cell.collision.checker import Checker
from cell.errors import InputError
from cell.failure import ON_TRAVEL, Contact, Failure, Kind
from cell.html.check_page import html_report
from cell.job.job import Job
from cell.motion.motion_file import ReadMotion
from cell.planning.neighbours import beads_ahead
from cell.planning.neighbours.beads_ahead import BeadsAhead
from cell.planning.part_plan import plan_part
from cell.planning.travels import home as home_module
from cell.planning.travels.straight_travels import BeadGap, straight_travels
from cell.planning.travels.travel import TravelPath, travel
from cell.report.check_document import report_document
from cell.report.check_report import report_lines
from cell.shipped import MODELS_DIR
from cell.verdict.check import check_fixed
from cell.verdict.result import Result
from cell.verdict.words import in_words
from cell.verification.motion_check import check_motion

FREE = {"roll": {"range_deg": [-90, 90]}}
ONE_LAYER = {"slicing": {"h_layer_mm": 5, "h_min_mm": 4, "h_max_mm": 6}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("home")


@pytest.fixture(scope="module")
def good(folder: Path) -> Result:
    found = result_of(three_layers(folder))
    assert found.motion is not None
    return found


def boss_case(folder: Path, name: str, **sections: Any) -> Path:
    """A boss of one layer."""
    return three_layers(folder, name, **{**ONE_LAYER, **sections})


def bad(result: Result) -> dict[int, dict[str, Any]]:
    assert {row.reason for row in result.rows} == {None, "no_path"}
    return {i: row.detail for i, row in enumerate(result.rows) if row.reason}


def test_ways_found_beside_the_travels_are_those_that_are_searched_by_themselves(folder: Path) -> None:
    job, context = setup_of(three_layers(folder, "beside"))
    plan = plan_part(context, job.targets.bead)
    assert all(path is not None for path in plan.home)
    found = home_module.search_home_travels(context, plan.beads[0], plan.beads[-1])
    for known, path in zip(plan.home, (found.out.way, found.back.way), strict=True):
        assert isinstance(path, TravelPath)
        assert known is not None
        np.testing.assert_array_equal(known.q, path.q)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(home_module, "travel", None)  # nothing is searched any more
        _, home = home_module.with_home(context, plan)
    assert home is not None
    assert (home.out, home.back) == plan.home
    # of beads that begin and end elsewhere they do not count
    turned = [
        replace(bead, stretches=tuple(replace(s, q=s.q + 1e-9, q_targets=s.q_targets + 1e-9) for s in bead.stretches))
        for bead in plan.beads
    ]
    with pytest.MonkeyPatch.context() as patch:
        asked: list[bool] = []
        patch.setattr(home_module, "travel", lambda _, end, start, laid: asked.append(end is None) or travel_back)
        travel_back = found.back
        home_module.with_home(context, replace(plan, beads=tuple(turned)))
    assert asked == [True, False]


def test_a_way_to_a_bead_that_has_changed_is_searched_again(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What leads to one stretch is not taken for another, wherever that begins."""
    job, context = setup_of(three_layers(folder, "changed"))
    firsts = np.flatnonzero(np.diff(job.targets.bead, prepend=-1)).tolist()
    ahead, beads, q_before = BeadsAhead(context, tuple(firsts), len(job.targets.bead)), [], None
    for first in firsts:
        bead = ahead.bead(first, q_before)
        assert bead is not None
        beads.append(bead)
        q_before = bead.stretches[0].q_targets[-1]
    assert ahead.home_travels(beads) == (None, None)
    asked: list[BeadGap] = []
    monkeypatch.setattr(
        beads_ahead,
        "straight_travels",
        lambda of, gaps, **more: asked.extend(gaps) or straight_travels(of, gaps, **more),
    )
    assert ahead.can_leave(None, beads[0])
    # on the way back all of the part stands there
    (laid_out,) = (gap.deposits_laid for gap in asked if gap.end is None)
    (laid_back,) = (gap.deposits_laid for gap in asked if gap.start is None)
    assert (laid_out, laid_back) == (0, job.scene.n_deposits)
    out, back = ahead.home_travels(beads)
    assert out is not None
    assert back is not None
    first, last = (replace(bead, stretches=(replace(bead.stretches[0]),)) for bead in (beads[0], beads[-1]))
    assert ahead.home_travels([first, *beads[1:]]) == (None, back)
    assert ahead.home_travels([*beads[:-1], last]) == (out, None)
    assert BeadsAhead(context, tuple(firsts[:-1]), firsts[-1]).home_travels(beads[:-1]) == (None, None)


def test_the_motion_begins_and_ends_at_home(good: Result) -> None:
    m, home = good.motion, good.job.scene.home
    assert m is not None
    np.testing.assert_allclose(np.rad2deg(home), [0, -90, 90, 0, 0, 0], atol=1e-9)
    np.testing.assert_array_equal(m.q[[0, -1]], [home, home])
    weld = np.flatnonzero(m.arc)
    out, back = slice(0, weld[0] + 1), slice(weld[-1], len(m.q))
    assert (m.target[: weld[0]] == 0).all()
    assert (m.target[weld[-1] :] == len(good.rows) - 1).all()
    assert m.home_s == pytest.approx(m.t_s[weld[0]] + m.t_s[-1] - m.t_s[weld[-1]])
    motion = report_document(good)["motion"]
    assert motion["home_s"] == round(m.home_s, 3)
    assert motion["home_s"] < motion["travel_s"]
    assert motion["arc_on_s"] + motion["travel_s"] + motion["dwell_s"] == pytest.approx(motion["time_s"], abs=2e-3)
    facts = next(line for line in report_lines(good) if hasattr(line, "columns"))
    assert any("s from home and back)" in str(cell) for cell in facts.columns[1].cells)
    # nothing of the part is there on the way out, all of it on the way back
    checker = Checker(good.job.scene, good.table, 0.05)
    for rows, laid in ((out, 0), (back, good.job.scene.n_deposits)):
        found = checker.clearances(m.q[rows], np.full(len(m.q[rows]), laid))
        assert found.distance.min() >= 5e-3
    assert good.clearance is not None
    assert html_report(good, [])


def test_a_check_from_outside_agrees(good: Result) -> None:
    m = good.motion
    assert m is not None
    found = check_motion(good.job, ReadMotion(m, np.arange(len(m.t_s)) + 1, ()))
    assert found.feasible
    assert found.use.max() <= 1.001


def arm(folder: Path, name: str, change: Any) -> str:
    """A copy of the arm with its MJCF changed; its name for the case."""
    shutil.copytree(MODELS_DIR / "kr70_r2100", folder / name)
    path = folder / name / "kr70_r2100.xml"
    text = change(path.read_text())
    assert text != path.read_text()
    path.write_text(text)
    return f"{name}/kr70_r2100.xml"


def test_another_home_and_none(folder: Path) -> None:
    there = [30.0, -100.0, 110.0, 10.0, 20.0, -30.0]
    moved = result_of(boss_case(folder, "moved", robot={"home_deg": there}))
    assert moved.motion is not None
    np.testing.assert_allclose(np.rad2deg(moved.motion.q[[0, -1]]), [there, there], atol=1e-9)
    without = arm(folder, "homeless", lambda text: re.sub(r'<key name="home".*?/>', "", text))
    nowhere = result_of(boss_case(folder, "nowhere", robot={"model": without}))
    assert nowhere.motion is not None
    assert nowhere.motion.home_s is None
    assert nowhere.motion.arc[[0, -1]].tolist() == [1, 1]
    assert report_document(nowhere)["motion"]["home_s"] is None


def test_a_home_that_the_arm_does_not_have_is_refused(folder: Path) -> None:
    with pytest.raises(InputError, match=r"robot.home_deg: A2 = 70 deg is outside -175 .. 60 deg"):
        job_of(boss_case(folder, "far", robot={"home_deg": [0, 70, 0, 0, 0, 0]}))
    with pytest.raises(InputError, match=r"robot.home_deg: has 5 values for 6 joints"):
        job_of(boss_case(folder, "few", robot={"home_deg": [0, 0, 0, 0, 0]}))
    narrow = arm(
        folder,
        "narrow",
        lambda text: text.replace('name="A3" axis="0 1 0" range="-120 165"', 'name="A3" axis="0 1 0" range="-120 80"'),
    )
    with pytest.raises(InputError, match=r"the key home of narrow/kr70_r2100.xml \(robot.home_deg replaces it\)"):
        job_of(boss_case(folder, "narrow", robot={"model": narrow}))


def test_something_at_home_is_said_so(good: Result, folder: Path) -> None:
    tcp = good.job.scene.chain.forward(good.job.scene.home[None])[0, :3, 3] * 1e3
    post = {"name": "post", "box": {"size_mm": [30, 30, 30]}, "position_mm": [float(v) for v in tcp]}
    result = result_of(boss_case(folder, "post", fixtures=[post]))
    found = bad(result)
    last = len(result.rows) - 1
    assert set(found) == {0, last}
    assert (found[0]["from"], found[0]["to_target"], found[0]["travel"]) == ("home", 0, True)
    assert (found[last]["from_target"], found[last]["to"]) == (last, "home")
    for i in (0, last):
        assert found[i]["at_home"]
        assert "post" in found[i]["pair"]
        assert in_words(result.rows[i]).startswith("the arm at home: ")
    # elsewhere the same arm has a home
    assert result_of(boss_case(folder, "aside", fixtures=[post], robot={"home_deg": [60, -90, 90, 0, 0, 0]})).feasible


@pytest.mark.slow
def test_a_home_shut_off_from_the_part_has_no_path(folder: Path) -> None:
    walls = [radial(f"wall{a}", (480, 2600), (10, 3200), a) for a in (80, -80)]
    roof = {"name": "roof", "box": {"size_mm": [2600, 2600, 20]}, "position_mm": [-1000, 0, 2000]}
    case = {"robot": {"home_deg": [180, -90, 90, 0, 0, 0]}, "process": {"travel_attempts": 60}}
    result = result_of(boss_case(folder, "shut", fixtures=[*walls, roof], **case))
    found = bad(result)
    assert set(found) == {0, len(result.rows) - 1}
    for i, way in ((0, "way from home: "), (len(result.rows) - 1, "way home: ")):
        assert found[i]["on_the_way"] == "collision"
        assert {"wall80", "wall-80", "roof"} & set(found[i]["pair"])
        assert in_words(result.rows[i]).startswith(way)


@pytest.mark.parametrize("shut", ["out", pytest.param("back", marks=pytest.mark.slow)])
def test_a_bead_begins_or_ends_elsewhere_where_home_is_else_not_reached(
    shut: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job: Job = job_of(three_layers(folder, f"else_{shut}", **FREE))
    asked = []

    def refusing(setup: Any, end: Any, start: Any, deposits_laid: int) -> Any:
        """No way for the configuration that was asked for first."""
        if (end is None) if shut == "out" else (start is None):
            q = start.q_targets[0] if shut == "out" else end.q_targets[-1]
            asked.append(q)
            if len(asked) == 1:
                return Failure(Kind.COLLISION, 0.0, 5.0, contact=Contact(("a", "b")), place=ON_TRAVEL)
        return travel(setup, end, start, deposits_laid)

    monkeypatch.setattr(BeadsAhead, "home_travels", lambda *_: (None, None))
    monkeypatch.setattr(home_module, "travel", refusing)
    result = check_fixed(job, 90, 180)
    assert result.motion is not None
    assert len(asked) > 1
    weld = np.flatnonzero(result.motion.arc)
    used = result.motion.q[weld[0 if shut == "out" else -1]]
    assert np.abs((used - asked[0] + np.pi) % (2 * np.pi) - np.pi).max() > np.deg2rad(39)
    # the ways to and from it have been made anew: nothing jumps, and what is outside agrees
    assert np.rad2deg(np.abs(np.diff(result.motion.q, axis=0)).max()) < 6
    assert check_motion(job, ReadMotion(result.motion, np.arange(len(result.motion.t_s)) + 1, ())).feasible


def only_bead(job: Job) -> Job:
    """The job with its first bead alone."""
    t, n = job.targets, int((job.targets.bead == 0).sum())
    names = ("sub_volume_index", "layer", "bead", "position", "normal", "tangent", "thickness_mm", "speed_mm_s")
    some = {name: getattr(t, name)[:n] for name in names}
    return replace(job, targets=replace(t, closed=t.closed[:1], **some), beads=())


@pytest.mark.parametrize("shut", [pytest.param("out", marks=pytest.mark.slow), "back"])
def test_an_only_bead_that_is_begun_or_ended_elsewhere_gets_both_ways_anew(
    shut: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first bead is the last one as well: the way that was free leads to where it is no longer."""
    job = only_bead(job_of(boss_case(folder, f"only_{shut}", **FREE)))
    asked = []

    def refusing(setup: Any, end: Any, start: Any, deposits_laid: int) -> Any:
        if (end is None) if shut == "out" else (start is None):
            asked.append(start.q_targets[0] if shut == "out" else end.q_targets[-1])
            if len(asked) == 1:
                return Failure(Kind.COLLISION, 0.0, 5.0, contact=Contact(("a", "b")), place=ON_TRAVEL)
        return travel(setup, end, start, deposits_laid)

    monkeypatch.setattr(BeadsAhead, "home_travels", lambda *_: (None, None))
    monkeypatch.setattr(home_module, "travel", refusing)
    result = check_fixed(job, 90, 180)
    motion = result.motion
    assert motion is not None
    assert len(asked) > 1
    weld = np.flatnonzero(motion.arc)
    used = motion.q[weld[0 if shut == "out" else -1]]
    assert np.abs((used - asked[0] + np.pi) % (2 * np.pi) - np.pi).max() > np.deg2rad(39)
    np.testing.assert_allclose(motion.q[[0, -1]], [job.scene.home] * 2, atol=1e-9)
    assert np.rad2deg(np.abs(np.diff(motion.q, axis=0)).max()) < 6
    assert check_motion(job, ReadMotion(motion, np.arange(len(motion.t_s)) + 1, ())).feasible
