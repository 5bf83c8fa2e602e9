"""The HTML report: whole in itself, true to the result, and alive in a real browser.

Browser tests drive Chromium over its DevTools protocol (package ``websockets``). Without either they are skipped, but
on CI that is a failure.
"""

from __future__ import annotations

import base64
import hashlib
import io
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from support.browser import Browser, wait_for

from cell.case.read import load_case, with_changes
from cell.case.sections import REASONS
from cell.failure import AT_TARGET, ON_BEAD, Contact, Failure, Kind
from cell.html import check_page
from cell.html import series as html_series
from cell.html import shapes as html_shapes
from cell.html.check_page import html_report, page_data
from cell.html.drawn_path import PageBudget
from cell.html.pack import Pack, unpack
from cell.html.page_words import in_plain_words, what_went_wrong, worst
from cell.job.job import prepare
from cell.motion.deposition_speed import speed_document
from cell.motion.motion import Motion
from cell.remedy_search.search import Remedy
from cell.shipped import DEFAULT_CASE
from cell.verdict.check import check_fixed
from cell.verdict.result import Result, TargetVerdict
from cell.verdict.severity import severity, worst_first

NASTY = "<script>alert(1)</script> & \"quotes\" '{{data}}'"


@pytest.fixture(scope="module")
def good() -> Result:
    found = check_fixed(prepare(load_case(DEFAULT_CASE)), 90, 180)
    assert found.feasible
    return found


@pytest.fixture(scope="module")
def bad(good: Result) -> Result:
    found = check_fixed(good.job, -45, 0)
    assert not found.feasible
    return found


@pytest.fixture(scope="module")
def hit(good: Result) -> Result:
    """The feasible result with two targets said to collide, one with the table in the way of everything."""
    failure = Failure(Kind.COLLISION, -2.0, 5.0, contact=Contact(("torch_nozzle", "deposit/3/SV1/0")))
    rows = list(good.rows)
    rows[40] = TargetVerdict(failure, None, rows[40].q)
    rows[41] = TargetVerdict(failure, None)
    return replace(good, rows=tuple(rows), motion=None)


@pytest.fixture(scope="module")
def good_page(good: Result) -> str:
    return html_report(good)


@pytest.fixture(scope="module")
def bad_page(bad: Result) -> str:
    return html_report(bad)


def document_of(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="text/plain" id="data">(.*?)</script>', page, re.DOTALL)
    assert found
    return unpack(found[1])


def lines_of(path: dict[str, Any], title: str) -> list[dict[str, Any]]:
    """A chart's lines; those of angles are drawn from the path's own."""
    lines = next(c["lines"] for c in path["charts"] if c["title"].startswith(title))
    q = np.rad2deg(path["q"].reshape(len(path["x"]), -1))
    return [line if "y" in line else {**line, "y": q[:, line["angle"]]} for line in lines]


# ---- the file


def test_the_page_needs_nothing_else(good_page: str, bad_page: str) -> None:
    for page in (good_page, bad_page):
        assert not re.search(r"https?://|//\w+\.\w+/|@import|url\(|\bsrc=", page.split('id="data"')[0])
        assert not re.search(r"https?://|\bfetch\(|XMLHttpRequest|WebSocket|\bimport\b.*\bfrom\b", page)
        assert "{{" not in page
        assert len(page.encode()) < 2e6


def test_only_the_pages_own_script_may_run_and_nothing_may_be_loaded(good_page: str) -> None:
    script = re.search(r'<script type="module">(.*?)</script>', good_page, re.DOTALL)
    assert script
    digest = base64.b64encode(hashlib.sha256(script[1].encode()).digest()).decode()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', good_page)
    assert policy
    assert f"script-src 'sha256-{digest}'" in policy[1]
    assert "default-src 'none'" in policy[1]


def test_the_same_result_gives_the_same_page(bad: Result, bad_page: str) -> None:
    assert html_report(bad) == bad_page


def test_what_comes_from_the_case_is_escaped(bad: Result, bad_page: str) -> None:
    job = replace(bad.job, case=with_changes(bad.job.case, name=NASTY), warnings=(f"mesh {NASTY}: holes",))
    page = html_report(replace(bad, job=job))
    assert "<script>alert" not in page
    assert page.count("<script") == bad_page.count("<script")
    assert page.count("&lt;script&gt;alert(1)&lt;/script&gt; &amp; &quot;quotes&quot; &#x27;{{data}}&#x27;") == 3
    assert document_of(page)["case"] == NASTY


# ---- the numbers


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


def test_targets_over_nothing_are_marked(good: Result, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "hanging" not in unpack(page_data(good))["targets"]
    monkeypatch.setattr(check_page, "targets_over_nothing", lambda job: {3: None, 7: None})
    assert np.flatnonzero(unpack(page_data(good))["targets"]["hanging"]).tolist() == [3, 7]


def test_the_tcp_speed_is_the_one_asked_for_and_a_slower_stretch_shows(good: Result, good_page: str) -> None:
    wanted = good.job.case.process.deposition_speed_mm_s
    path = document_of(good_page)["path"]
    before = lines_of(path, "TCP")[0]["y"]
    known = np.isfinite(before)
    # never faster; slower at the beads' ends and where the drives have to
    assert before[known].max() <= wanted * 1.001
    assert (before[known] > wanted * 0.995).mean() > 0.8
    motion = good.motion
    assert motion is not None
    dt = np.diff(motion.t_s)
    slowed = np.flatnonzero(motion.target[:-1] == 30)
    dt[slowed] *= 2
    slow = replace(good, motion=replace(motion, t_s=np.concatenate([[0], np.cumsum(dt)])))
    chart = next(c for c in unpack(page_data(slow))["path"]["charts"] if c["title"].startswith("TCP"))
    np.testing.assert_allclose(chart["lines"][0]["y"][slowed[:-1]], before[slowed[:-1]] / 2, rtol=0.01)
    off = [float(re.search(r"1% for ([0-9.]+) s", note)[1]) for note in (tcp_note(path), chart["note"])]
    kept = before[slowed[:-1]] > wanted * 0.99
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


def test_a_collision_is_said_in_words(hit: Result) -> None:
    assert what_went_wrong(hit, hit.rows[40]) == "torch nozzle and layer 3 of SV1: -2.0 mm, needs 5"


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


# ---- shapes and words


def enclosed(shape: html_shapes.DrawnTriangles) -> float:
    """Volume within a closed surface whose faces are counter-clockwise seen from outside."""
    a, b, c = (shape.vertices[shape.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


@pytest.mark.parametrize(
    ("geom", "volume"),
    [
        ('type="box" size="0.1 0.2 0.3"', 8 * 0.1 * 0.2 * 0.3),
        ('type="cylinder" size="0.1 0.3"', np.pi * 0.1**2 * 0.6),
        ('type="capsule" size="0.1 0.3"', np.pi * 0.1**2 * 0.6 + 4 / 3 * np.pi * 0.1**3),
        ('type="sphere" size="0.2"', 4 / 3 * np.pi * 0.2**3),
        ('type="ellipsoid" size="0.1 0.2 0.3"', 4 / 3 * np.pi * 0.1 * 0.2 * 0.3),
        ('type="mesh" mesh="m"', 0.5 * 0.4 * 0.3),
    ],
)
def test_a_geoms_surface_is_closed_and_its_normals_point_outward(geom: str, volume: float) -> None:
    corners = " ".join(f"{x} {y} {z}" for x in (0, 0.5) for y in (0, 0.4) for z in (0, 0.3))
    xml = f'<mujoco><asset><mesh name="m" vertex="{corners}"/></asset><worldbody><geom {geom}/></worldbody></mujoco>'
    shape = html_shapes.geom_triangles(mujoco.MjModel.from_xml_string(xml), 0)
    assert shape is not None
    assert enclosed(shape) == pytest.approx(volume, rel=0.03)
    np.testing.assert_allclose(np.linalg.norm(shape.normals, axis=1), 1, atol=1e-9)
    a, b, c = (shape.vertices[shape.faces[:, k]] for k in range(3))
    out = np.cross(b - a, c - a)
    size = np.linalg.norm(out, axis=1)
    for k in range(3):  # a corner's normal is its face's, give or take its roundness
        along = np.einsum("ij,ij->i", out, shape.normals[shape.faces[:, k]])
        assert (along >= np.cos(np.deg2rad(30)) * size - 1e-12).all()


def name_of_mesh(model: mujoco.MjModel, geom: int) -> str:
    mesh = int(model.geom_dataid[geom])
    return "" if mesh < 0 else model.mesh(mesh).name


def test_a_plane_has_no_surface_and_a_fine_mesh_is_coarsened(good: Result) -> None:
    model = good.job.scene.model
    assert html_shapes.geom_triangles(model, model.geom("floor").id) is None
    geom = next(g for g in range(model.ngeom) if name_of_mesh(model, g) == "robot/link_2_orange")
    fine = html_shapes.geom_triangles(model, geom)
    coarse = html_shapes.geom_triangles(model, geom, 1000)
    assert fine is not None
    assert coarse is not None
    assert len(coarse.faces) <= 1000 < len(fine.faces)
    assert enclosed(coarse) == pytest.approx(enclosed(fine), rel=0.15)


def test_the_worst_target_is_named_on_top(bad: Result, bad_page: str) -> None:
    i = worst(bad)
    assert i is not None
    assert bad.rows[i].reason == "unreachable"
    over = [r.detail["beyond_reach_mm"] for r in bad.rows if r.reason == "unreachable"]
    assert bad.rows[i].detail["beyond_reach_mm"] == max(over)
    assert f"{bad.infeasible} of {len(bad.rows)} targets cannot be welded" in bad_page
    assert f'data-target="{i}"' in bad_page


def test_what_would_help_is_on_top_and_escaped(bad: Result, bad_page: str) -> None:
    reached = [i for i, row in enumerate(bad.rows) if row.reason == "joint_limit"]
    whole = np.flatnonzero([row.reason is not None for row in bad.rows])
    found = [
        Remedy(whole, None, {}, "part", 0, "roll fixed:-60 -> free (checked: whole part feasible)"),
        Remedy(np.array(reached), "joint_limit", None, None, 3, NASTY),
    ]
    page = html_report(bad, found)
    header = page[: page.index("</header>")]
    assert "<li>roll fixed:-60 → free (checked: whole part feasible)</li>" in header
    assert f"<li>for {len(reached)} targets (joint limit, SV1/0 to 20): &lt;script&gt;" in header
    assert 'class="help" hidden' in bad_page
    assert 'class="help" hidden' not in page


def test_the_header_says_how_far_the_speed_is_held(good: Result, good_page: str) -> None:
    assert good.motion is not None
    assert good.motion.held_speed is not None
    held = speed_document(good.motion.held_speed, good.job.targets.bead)
    header = good_page[: good_page.index("</header>")]
    assert held["slowed"]
    assert f"held to {100 * held['least_share']:.0f} % or more" in header
    assert f'data-target="{held["from_target"]}"' in header
    assert "travelling" in header


def test_every_reason_has_its_place_in_the_order_and_its_words() -> None:
    failures = [Failure(kind, place=place) for kind in Kind for place in (AT_TARGET, ON_BEAD)]
    rows = {failure.reason: TargetVerdict(failure, None) for failure in failures}
    assert set(REASONS) <= set(rows)
    assert len({severity(rows[reason]) for reason in REASONS}) == len(REASONS)
    contact = Contact(("a", "b"))
    deep, near = (TargetVerdict(Failure(Kind.COLLISION, mm, 5.0, contact=contact), None) for mm in (-9.0, 4.0))
    assert severity(deep) > severity(near)


# ---- the page in a browser


@pytest.fixture(scope="module")
def pages(
    good_page: str, bad_page: str, bad: Result, hit: Result, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    job = replace(bad.job, case=with_changes(bad.job.case, name=NASTY), warnings=(NASTY,))
    made = {"good": good_page, "bad": bad_page, "hit": html_report(hit), "nasty": html_report(replace(bad, job=job))}
    for name, page in made.items():
        (folder / f"{name}.html").write_text(page, encoding="utf-8")
    return {name: folder / f"{name}.html" for name in made}


def test_an_infeasible_page_opens_and_its_table_is_true(
    browser: Browser, bad: Result, bad_page: str, tmp_path: Path
) -> None:
    page = tmp_path / "bad.html"
    page.write_text(bad_page, encoding="utf-8")
    browser.open(page, 320, 240)
    assert browser.problems() == []
    assert browser.js("document.getElementById('trouble').hidden")
    head = browser.js("[...document.querySelectorAll('#table th')].map((h) => h.textContent.trim())")
    place, off_upright = (next(k for k, name in enumerate(head) if name.startswith(n)) for n in ("x, y, z", "Gravity"))
    rows = browser.js(
        "[...document.querySelectorAll('#table tbody tr')]"
        ".map((r) => [Number(r.dataset.target), [...r.cells].map((cell) => cell.textContent)])"
    )
    assert len(rows) == min(bad.infeasible, 100)
    for target, cells in rows:
        base_mm = [float(v) for v in cells[place].replace("\u2212", "-").split(",")]
        np.testing.assert_allclose(base_mm, bad.placed.position[target] * 1e3, atol=0.51)
        assert float(cells[off_upright]) == pytest.approx(np.rad2deg(bad.gravity[target]), abs=0.051)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["good", "bad", "hit", "nasty"])
def test_a_page_opens_without_complaint(browser: Browser, pages: dict[str, Path], name: str) -> None:
    browser.open(pages[name], 1200, 800)
    image = browser.pixels()
    assert image.std() > 10
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 500
    assert browser.problems() == []
    assert browser.js("document.getElementById('trouble').hidden")
    if name == "nasty":
        assert browser.js("document.querySelector('h1').firstChild.data.trim()") == NASTY


@pytest.mark.slow
def test_the_page_moves_the_arm_as_mujoco_does(browser: Browser, pages: dict[str, Path], good: Result) -> None:
    browser.open(pages["good"])
    motion, model = good.motion, good.job.scene.model
    assert motion is not None
    data = mujoco.MjData(model)
    site = model.site(good.job.case.tool.tcp).id
    for k in (0, 700, 2000, len(motion.t_s) - 1):
        data.qpos[good.job.scene.arm_qpos], data.qpos[good.job.scene.table_qpos] = motion.q[k], motion.table[k]
        mujoco.mj_kinematics(model, data)
        found = browser.js(f"rbam.scrub({motion.t_s[k] + 1e-6}), [rbam.cell.world, [rbam.cell.tcpMatrix()]]")
        np.testing.assert_allclose(np.array(found[0])[1:, 12:15], data.xpos[1:], atol=1e-5)
        np.testing.assert_allclose(found[1][0][12:15], data.site_xpos[site], atol=1e-5)
    # the wire's end is on the bead
    for i in (0, 30, 142):
        browser.js(f"rbam.jump({i})")
        point = browser.js("rbam.cell.tcpInPart().point")
        np.testing.assert_allclose(np.array(point) * 1e3, good.job.targets.position[i], atol=0.02)


@pytest.mark.slow
def test_the_view_turns_with_the_mouse(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["good"])
    for view in ("part", "cell"):
        browser.click(f"input[value={view}] + span")
        x, y = browser.middle("#view")
        before, azimuth = browser.pixels(), browser.js("rbam.viewer.camera.azimuth")
        browser.mouse("mousePressed", x, y, held=True)
        for k in range(1, 13):
            browser.mouse("mouseMoved", x + 8 * k, y + 3 * k, held=True)
        browser.mouse("mouseReleased", x + 96, y + 36)
        assert browser.js("rbam.viewer.camera.azimuth") != azimuth
        assert np.abs(browser.pixels() - before).mean() > 1, view
    assert browser.problems() == []


@pytest.mark.slow
def test_the_slider_moves_the_arm_the_beads_and_the_cursors(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["good"])
    browser.click("input[value=torch] + span")
    state = "[rbam.cell.tcpMatrix().slice(12, 15), rbam.viewer.laid, document.querySelector('.cursor').style.left]"
    whole, late = browser.pixels(), browser.js(state)
    browser.js(
        "{const s = document.getElementById('time'); s.value = s.max * 0.3; s.dispatchEvent(new Event('input'))}"
    )
    early = browser.js(state)
    assert np.linalg.norm(np.subtract(early[0], late[0])) > 0.01
    assert early[1] < late[1]
    assert float(early[2].rstrip("%")) == pytest.approx(30, abs=0.1)
    assert np.abs(browser.pixels() - whole).mean() > 1
    browser.click("#on")
    assert browser.js("rbam.viewer.laid") == early[1] + 1
    browser.click("#play")
    browser.settle()
    assert browser.js("rbam.x") > 0
    assert browser.js("rbam.playing")


@pytest.mark.slow
def test_a_chart_under_the_cursor_leads_the_view(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["good"])
    x, y = browser.middle(".chart:nth-of-type(3) .plot")
    browser.mouse("mouseMoved", x, y)
    half = browser.js("Number(document.getElementById('time').max) / 2")
    assert browser.js("rbam.x") == pytest.approx(half, rel=0.02)
    assert browser.js("document.querySelectorAll('.chart').length") == 15
    assert "°" in browser.js("document.querySelector('.chart .value').textContent")


@pytest.mark.slow
def test_an_infeasible_target_is_jumped_to(browser: Browser, pages: dict[str, Path], bad: Result) -> None:
    browser.open(pages["bad"])
    rows = "[...document.querySelectorAll('#table tbody tr')]"
    assert browser.js(f"{rows}.length") == min(bad.infeasible, 100)
    row = browser.js(f"{rows}.findIndex((r) => r.cells[2].textContent.includes('joint limit'))")
    i = int(browser.js(f"{rows}[{row}].dataset.target"))
    before = browser.pixels()
    browser.click(f"#table tbody tr:nth-child({row + 1})")
    assert browser.js("rbam.viewer.chosen") == i
    assert browser.js("document.querySelector('.chosen').dataset.target") == str(i)
    assert np.abs(browser.pixels() - before).mean() > 1
    # it is in the middle, with the wire of the attempt on it
    target = bad.job.targets.position[i]
    np.testing.assert_allclose(np.array(browser.js("rbam.cell.tcpInPart().point")) * 1e3, target, atol=0.02)
    part = bad.job.scene
    assert bad.rows[i].attempt is not None
    data = mujoco.MjData(part.model)
    data.qpos[part.table_qpos] = bad.table
    mujoco.mj_kinematics(part.model, data)
    site = part.model.site("part").id
    world = data.site_xmat[site].reshape(3, 3) @ target / 1e3 + data.site_xpos[site]
    assert np.linalg.norm(np.array(browser.js("rbam.viewer.camera.lookat")) - world) < 2e-3


@pytest.mark.slow
def test_the_table_sorts_and_filters(browser: Browser, pages: dict[str, Path], bad: Result) -> None:
    browser.open(pages["bad"])
    targets = "[...document.querySelectorAll('#table tbody tr')].map((r) => Number(r.dataset.target))"
    all_of_them = [i for i, row in enumerate(bad.rows) if row.reason]
    assert browser.js(targets)[0] == worst(bad)
    browser.click("#table th:first-child button")
    assert browser.js(targets) == all_of_them[:100]
    browser.click("#table th:first-child button")
    assert browser.js(targets) == all_of_them[::-1][:100]
    assert browser.js("document.querySelector('#table th').ariaSort") == "descending"
    browser.click(".chip[data-reason=unreachable]")
    assert len(browser.js(targets)) == bad.reasons["unreachable"]
    browser.click(".chip[data-reason=unreachable]")
    browser.click("#more")
    assert len(browser.js(targets)) == bad.infeasible


@pytest.mark.slow
def test_what_collides_is_red(browser: Browser, pages: dict[str, Path]) -> None:
    def red(image: np.ndarray) -> int:
        return int(((image[..., 0] > 110) & (image[..., 1] < 60) & (image[..., 2] < 60)).sum())

    browser.open(pages["hit"])
    browser.click("input[value=torch] + span")
    browser.js("document.getElementById('show-targets').click()")
    browser.js("rbam.jump(39, false)")
    before = red(browser.pixels())
    browser.js("rbam.jump(40, false)")
    assert red(browser.pixels()) > before + 500
    browser.js("rbam.jump(41, false)")  # it has no configuration
    assert "home" in browser.js("document.getElementById('now').textContent")


@pytest.mark.slow
def test_a_phone_gets_no_sideways_scrolling_and_night_is_dark(browser: Browser, pages: dict[str, Path]) -> None:
    for name in ("good", "bad"):
        browser.open(pages[name], width=360, height=740)
        assert browser.js("document.documentElement.scrollWidth") <= 360
        assert browser.pixels().std() > 10
    light = browser.pixels("body").mean()
    browser.open(pages["bad"], width=360, height=740, theme="dark")
    assert browser.pixels("body").mean() < light - 100


@pytest.mark.slow
def test_it_prints_with_the_view_as_a_still(browser: Browser, pages: dict[str, Path]) -> None:
    browser.open(pages["bad"], theme="dark")
    browser.js("addEventListener('afterprint', () => (window.printed = document.getElementById('still').src))")
    pdf = base64.b64decode(browser("Page.printToPDF", preferCSSPageSize=True)["data"])
    assert pdf.startswith(b"%PDF")
    still = wait_for(lambda: browser.js("window.printed"), 10)
    from PIL import Image

    image = np.asarray(Image.open(io.BytesIO(base64.b64decode(still.split(",")[1]))))
    assert image.shape == (1000, 1900, 4)
    assert image[..., :3].std() > 10
