"""The numbers in the HTML report: true to the result, few enough for a browser, and none of them lost."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.pages import document_of

from cell.failure import Contact, Failure, Kind, OverhangArea
from cell.html import check_page
from cell.html import series as html_series
from cell.html.check_page import html_report, page_data
from cell.html.drawn_path import PageBudget
from cell.html.pack import Pack, unpack
from cell.html.page_words import in_plain_words
from cell.motion.motion import Motion
from cell.verdict.result import Result, TargetVerdict
from cell.verdict.severity import worst_first


def lines_of(path: dict[str, Any], title: str) -> list[dict[str, Any]]:
    """A chart's lines; those of angles are drawn from the path's own."""
    lines = next(c["lines"] for c in path["charts"] if c["title"].startswith(title))
    q = np.rad2deg(path["q"].reshape(len(path["x"]), -1))
    return [line if "y" in line else {**line, "y": q[:, line["angle"]]} for line in lines]


def test_what_is_packed_comes_out_again() -> None:
    pack = Pack()
    document = {"a": pack.put([[1.5, np.nan], [-2, 3]], "f4"), "b": [pack.put([7, 65535], "u2"), {"n": 1}], "c": "ü"}
    out = unpack(pack.text(document))
    np.testing.assert_array_equal(out["a"], np.array([1.5, np.nan, -2, 3], dtype=np.float32))
    assert out["b"][0].tolist() == [7, 65535]
    assert (out["b"][1], out["c"]) == ({"n": 1}, "ü")


def test_the_numbers_are_those_of_a_feasible_result(good: Result, good_page: str) -> None:
    d = document_of(good_page)
    t, path, motion = d["targets"], d["path"], good.motion
    assert motion is not None
    np.testing.assert_allclose(t["position"].reshape(-1, 3) * 1e3, good.job.targets.position, atol=1e-3)
    np.testing.assert_allclose(t["normal"].reshape(-1, 3) / 32767, good.job.targets.normal, atol=2e-5)
    np.testing.assert_array_equal(t["bead"], good.job.targets.bead)
    assert not t["verdict"].any()
    q = path["q"].reshape(len(path["x"]), -1)
    np.testing.assert_allclose(q, np.concatenate([motion.q, motion.table], axis=1), atol=2e-6)
    np.testing.assert_allclose(path["x"], motion.t_s, atol=1e-4)
    for k, name in enumerate(motion.names):
        np.testing.assert_allclose(lines_of(path, name)[0]["y"], np.rad2deg(motion.q[:, k]), atol=1e-3)
    clearance = lines_of(path, "Least distance")[0]["y"]
    assert good.clearance is not None
    least = int(np.argmin(clearance))
    assert clearance[least] == pytest.approx(good.clearance.value * 1e3, abs=1e-3)
    named = [in_plain_words(good, name) for name in good.clearance.what]
    assert path["pairs"][int(path["pair"][least])] == named
    assert named[0] == "torch nozzle taper"
    assert named[1].startswith("layer ")
    assert named[1].endswith(" of SV1")
    assert good.singularity is not None
    margin = np.deg2rad(lines_of(path, good.singularity.what[0])[0]["y"][path["arc"] == 1].min())
    assert margin == pytest.approx(good.singularity.value, abs=1e-5)
    gravity = lines_of(path, "Deposition")[0]["y"]
    assert np.nanmax(gravity) == pytest.approx(np.rad2deg(good.gravity.max()), abs=0.01)


def test_targets_over_nothing_are_marked(good: Result, good_page: str, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "hanging" not in document_of(good_page)["targets"]
    monkeypatch.setattr(check_page, "targets_over_nothing", lambda job: {3: None, 7: None})
    assert np.flatnonzero(unpack(page_data(good))["targets"]["hanging"]).tolist() == [3, 7]
    # infeasible ones have that colour, and without others the legend has no line for what overhangs
    rows = list(good.rows)
    for i, left in ((3, [7]), (7, [])):
        rows[i] = TargetVerdict(Failure(Kind.OVERHANG, 4.0, 2.0, cause=OverhangArea(9.0, 0.0, (0.0, 0.0, 0.0))), None)
        marked = unpack(page_data(replace(good, rows=tuple(rows))))["targets"].get("hanging", [])
        assert np.flatnonzero(marked).tolist() == left


def test_the_tcp_speed_is_the_one_asked_for_and_a_slower_stretch_shows(good: Result, good_page: str) -> None:
    wanted = good.job.case.process.deposition_speed_mm_s
    path = document_of(good_page)["path"]
    before = lines_of(path, "TCP")[0]["y"]
    known = np.isfinite(before)
    # never faster; slower at the beads' ends and where the drives have to
    assert before[known].max() <= wanted * 1.001
    assert (before[known] > wanted * 0.985).mean() > 0.8
    motion = good.motion
    assert motion is not None
    dt = np.diff(motion.t_s)
    slowed = np.flatnonzero(motion.target[:-1] == 30)
    dt[slowed] *= 2
    slow = replace(good, motion=replace(motion, t_s=np.concatenate([[0], np.cumsum(dt)])))
    chart = next(c for c in unpack(page_data(slow))["path"]["charts"] if c["title"].startswith("TCP"))
    np.testing.assert_allclose(chart["lines"][0]["y"][slowed[:-1]], before[slowed[:-1]] / 2, rtol=0.01)
    off = [float(re.search(r"2 % for ([0-9.]+) s", note)[1]) for note in (tcp_note(path), chart["note"])]
    kept = before[slowed[:-1]] > wanted * 0.98
    assert off[1] - off[0] >= dt[slowed[:-1]][kept].sum() - 0.2


def tcp_note(path: dict[str, Any]) -> str:
    return next(c["note"] for c in path["charts"] if c["title"].startswith("TCP"))


def test_the_numbers_are_those_of_an_infeasible_result(bad: Result, bad_page: str) -> None:
    d = document_of(bad_page)
    names = [None if v == 0 else d["verdicts"][v] for v in d["targets"]["verdict"]]
    assert names == [row.reason for row in bad.rows]
    assert [r["target"] for r in d["infeasible"]] == [i for i, row in enumerate(bad.rows) if row.reason]
    q = d["path"]["q"].reshape(len(bad.rows), -1)
    for i, row in enumerate(bad.rows):
        there = row.q if row.q is not None else row.attempt
        if there is None:
            assert np.isnan(q[i, :-2]).all()
        else:
            np.testing.assert_allclose(q[i, :-2], there, atol=2e-6)


def test_a_result_without_any_configuration_has_a_page(good: Result) -> None:
    contact = Contact(("floor", "deposit/3/SV1/0"), note="whatever")
    failure = Failure(Kind.COLLISION, -2.0, 0.0, contact=contact, proved=True)
    rows = tuple(TargetVerdict(failure, None) for _ in good.rows)
    blocked = replace(good, rows=rows, clearance=None, singularity=None, sigma=None, motion=None)
    page = html_report(blocked)
    assert "floor and layer 3 of SV1: -2.0 mm, needs 0" in page
    path = document_of(page)["path"]
    assert np.isnan(lines_of(path, "A1")[0]["y"]).all()
    assert np.isnan(lines_of(path, "Least distance")[0]["y"]).all()


@pytest.mark.slow
def test_gathered_samples_keep_the_peaks_and_every_target(good: Result) -> None:
    fine = unpack(page_data(good))["path"]
    assert fine["note"] == ""
    coarse = unpack(page_data(good, PageBudget(samples=300)))["path"]
    assert len(coarse["x"]) < 0.4 * len(fine["x"])
    assert coarse["note"].startswith(f"The charts show {len(coarse['x']):,} steps for the {len(fine['x']):,} samples")
    assert set(coarse["target"][coarse["arc"] == 1]) == set(range(len(good.rows)))
    for title, peak in (("Joint speed", np.nanmax), ("wrist", np.nanmin), ("shoulder", np.nanmin)):
        for a, b in zip(lines_of(fine, title), lines_of(coarse, title), strict=True):
            assert peak(a["y"]) == pytest.approx(peak(b["y"]), abs=0.00501)


def test_the_least_clearance_is_drawn_where_it_occurs(good: Result) -> None:
    assert good.clearance is not None
    # nearer than at any sample sent: between two of them
    least = replace(good.clearance, value=0.0061, target=77, what=("torch_nozzle", "faceplate"))
    path = unpack(page_data(replace(good, clearance=least), PageBudget(samples=300)))["path"]
    shown = lines_of(path, "Least distance")[0]["y"]
    at = int(np.argmin(shown))
    assert shown[at] == pytest.approx(6.1, abs=0.0051)
    assert path["target"][at] == 77
    assert path["pairs"][int(path["pair"][at])] == ["torch nozzle", "faceplate"]
    assert "the least clearance of the motion is drawn where it occurs" in path["note"]


def test_of_many_infeasible_targets_the_worst_of_each_reason_are_listed(
    bad: Result,
) -> None:
    rows = list(bad.rows)
    listed = check_page.listed_targets(bad, 20)
    assert len(listed) == 20 < bad.infeasible
    for reason in {row.reason for row in rows} - {None}:
        own = [i for i in worst_first(bad) if rows[i].reason == reason]
        mine = [i for i in listed if rows[i].reason == reason]
        assert len(mine) >= min(len(own), 5)
        assert set(mine) == set(own[: len(mine)])
    document = unpack(page_data(bad, PageBudget(listed=20)))
    assert document["unlisted"] == bad.infeasible - 20
    assert [r["target"] for r in document["infeasible"]] == listed
    assert unpack(page_data(bad, PageBudget(listed=10_000)))["unlisted"] == 0


def many(good: Result, n: int) -> Result:
    """The result with its targets and its motion stretched to n targets and ten samples each."""
    t, motion = good.job.targets, good.motion
    assert motion is not None
    old = np.arange(len(t))
    at = np.linspace(0, len(t) - 1, n)
    near = np.rint(at).astype(np.int64)

    def between(rows: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(at, old, column) for column in rows.T], axis=1)

    targets = replace(
        t,
        **{k: getattr(t, k)[near] for k in ("sub_volume_index", "layer", "bead", "tangent", "normal", "thickness_mm")},
        position=between(t.position),
    )
    m = 10 * n
    s = np.linspace(0, len(motion.t_s) - 1, m)
    q = np.stack([np.interp(s, np.arange(len(motion.q)), c) for c in motion.q.T], axis=1)
    index = np.rint(s).astype(np.int64)
    new = np.minimum(np.arange(m) // 10, n - 1)
    longer = Motion(
        np.interp(s, np.arange(len(motion.q)), motion.t_s) * n / len(t), q, motion.table[index],
        np.ones(m, dtype=np.int64), targets.bead[new], targets.layer[new], new, motion.names,
    )  # fmt: skip
    placed = replace(good.placed, position=between(good.placed.position), normal=good.placed.normal[near])
    rows = tuple(good.rows[i] for i in near)
    job = replace(good.job, targets=targets)
    return replace(good, job=job, placed=placed, rows=rows, gravity=good.gravity[near], motion=longer)


@pytest.mark.slow
def test_fifty_thousand_targets_stay_below_five_megabytes(good: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    result = many(good, 50_000)
    # numbers that do not repeat, as worst case; and no minutes of collision detection
    noise = np.random.default_rng(0)
    found = html_series.Clearances.none

    def clearances(_: object, q: np.ndarray, __: np.ndarray) -> object:
        return replace(found(len(q)), distance=noise.uniform(0.005, 0.05, len(q)))

    monkeypatch.setattr(html_series.Checker, "clearances", clearances)
    page = html_report(result)
    assert len(page.encode()) < 5e6
    over = [Failure(Kind.JOINT_LIMIT, measure=float(v), axis="A5") for v in noise.uniform(0, 90, 50_000)]
    rows = tuple(TargetVerdict(failure, None, good.rows[0].q) for failure in over)
    assert len(html_report(replace(result, rows=rows, motion=None)).encode()) < 5e6
