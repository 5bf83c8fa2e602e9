"""Pictures and pages of sweeps and comparisons: true to their documents, whole in themselves, alive in a browser."""

from __future__ import annotations

import io
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from support.browser import Browser

from cell.case.part_sections import Sampling
from cell.case.read import load_case, with_changes
from cell.case.sections import REASONS
from cell.cli.main import main
from cell.compare.compare import Comparison, ComparisonRow, compare_document
from cell.errors import InputError
from cell.html.comparison_page import html_compare
from cell.html.pack import unpack
from cell.html.sweep_page import html_sweep
from cell.pose_sweep.grid import Pose
from cell.pose_sweep.ranking import sweep_document
from cell.pose_sweep.variants import is_lower_bound
from cell.shipped import DEFAULT_CASE
from cell.view.sweep_map_picture import FEASIBLE, PAGE, REASON_COLOUR, colour_of, main_reason, sweep_picture
from slicing.paper.indices import Indices
from slicing.parameters import SlicingParameters

NASTY = "<script>alert(1)</script> & \"quotes\" '{{data}}'"
TILTS, TURNS = (-45.0, 0.0, 45.0, 90.0), (-180.0, -90.0, 0.0, 90.0)


def row_of(pose: Pose, reason: str | None = None, infeasible: int = 40, searched: bool = True) -> dict[str, Any]:
    row: dict[str, Any] = {**pose.columns(), "verdict": "infeasible" if reason else "feasible"}
    row["infeasible"] = infeasible if reason else 0
    row["reasons"] = {name: infeasible if name == reason else 0 for name in REASONS}
    row |= {"searched": searched, "looked_at": 143, "not_looked_at": 5 if reason and pose.E1_deg == 45.0 else 0}
    if searched:
        row |= {
            "least_clearance_mm": 9.5,
            "least_margin": {"kind": "wrist", "value": 0.5},
            "least_margin_share": 4.0,
            "least_joint_room_deg": 12.0,
            "least_joint": "A5",
            "gravity_max_deg": 40.0 - pose.E1_deg / 10,
            "time_s": None if reason else 120.0,
        }
    return row


def document_of(case: Any, **further: Any) -> dict[str, Any]:
    rows = []
    cells = further.get("cells", [{}])
    for n, cell in enumerate(cells):
        for i, e1 in enumerate(TILTS):
            for j, e2 in enumerate(TURNS):
                reason = None if (i + j + n) % 4 == 0 else REASONS[(i + 2 * j) % len(REASONS)]
                rows.append(
                    row_of(Pose(e1, e2, **cell), reason, 1 + 10 * j, searched=(i + j) % 2 == 0 or reason is None)
                )
    return sweep_document(case, rows)


CELLS = [
    {"roll": roll, "positioner": (1400.0, 0.0, 0.0, -90.0), "height_mm": h}
    for roll in ("free", "fixed:-60")
    for h in (80.0, 120.0)
]


# ---- the picture


def test_a_pose_has_the_colour_of_its_verdict_or_main_reason() -> None:
    assert colour_of(row_of(Pose(0, 0))) == FEASIBLE
    for reason in REASONS:
        all_of_them = row_of(Pose(0, 0), reason, 143)
        assert main_reason(all_of_them) == reason
        assert colour_of(all_of_them) == REASON_COLOUR[reason]
        few = np.array(colour_of(row_of(Pose(0, 0), reason, 1)))
        assert (few >= np.array(REASON_COLOUR[reason])).all()  # paler
    assert len(set(REASON_COLOUR.values()) | {FEASIBLE}) == len(REASONS) + 1
    assert set(REASON_COLOUR) == set(REASONS)


def test_the_picture_has_a_field_for_every_pose_and_marks_the_papers() -> None:
    case = load_case(DEFAULT_CASE)
    document = document_of(case)
    image = Image.open(io.BytesIO(sweep_picture(document))).convert("RGB")
    pixels = np.asarray(image).reshape(-1, 3)
    for row in document["poses"]:
        share = (pixels == np.array(colour_of(row))).all(axis=1).sum()
        assert share > 800, row
    assert tuple(pixels[0]) == PAGE
    bare = np.asarray(Image.open(io.BytesIO(sweep_picture({**document, "marks": []}))).convert("RGB"))
    assert bare.shape != np.asarray(image).shape  # the legend names the paper's poses
    # E2 = 180 stands at -180: on a map without it the mark is left out
    assert document["marks"][0]["E2_deg"] == 180


def test_further_axes_are_panels_up_to_a_number() -> None:
    case = load_case(DEFAULT_CASE)
    one = Image.open(io.BytesIO(sweep_picture(document_of(case))))
    four = Image.open(io.BytesIO(sweep_picture(document_of(case, cells=CELLS))))
    assert four.height > one.height
    with pytest.raises(InputError, match="at most"):
        sweep_picture(document_of(case, cells=[{"height_mm": float(h)} for h in range(30)]))


# ---- the file


def test_the_pages_need_nothing_else_and_are_the_same_for_the_same() -> None:
    case = load_case(DEFAULT_CASE)
    document = document_of(case, cells=CELLS)
    for page in (html_sweep(case, document), html_compare(comparison())):
        assert not re.search(r"https?://|//\w+\.\w+/|@import|url\(|\bsrc=", page.split('id="data"')[0])
        assert not re.search(r"https?://|\bfetch\(|XMLHttpRequest|WebSocket|\bimport\b.*\bfrom\b", page)
        assert "default-src 'none'" in page
        assert "{{" not in page
    assert html_sweep(case, document) == html_sweep(case, document)
    data = re.search(r'id="data">(.*?)</script>', html_sweep(case, document), re.DOTALL)
    assert data is not None
    assert unpack(data[1])["poses"] == json.loads(json.dumps(document["poses"]))


def test_what_comes_from_the_case_is_escaped() -> None:
    case = with_changes(load_case(DEFAULT_CASE), name=NASTY)
    page = html_sweep(case, sweep_document(case, document_of(case)["poses"]))
    assert "<script>alert" not in page
    assert page.count("&lt;script&gt;alert(1)&lt;/script&gt;") == 2
    other = html_compare(comparison(NASTY))
    assert "<script" not in other.replace('<script type="module">', "")
    assert other.count("&lt;script&gt;") >= 3


def comparison(name: str = "boss") -> dict[str, Any]:
    figures = {
        "planar": (21, 15.0, 130, 0.1),
        "cylindrical": (19, 25.0, 175, 0.04),
        "nonuniform": (21, 25.0, 143, 0.16),
        "conical": (20, 24.0, 150, 0.05),
        "revolved": (20, 24.5, 151, 0.05),
    }
    laid = {"overhang_deg": 37.0, "metal_share": 1.06}
    rows = tuple(ComparisonRow(s, Indices(*v), **laid) for s, v in figures.items())
    paper = tuple(ComparisonRow(s, Indices(v[0] + 1, v[1] / 2, v[2] + 9, v[3])) for s, v in figures.items())
    broken = (rows[0].__class__("planar", None, f"{name}: planes do not fit"), *rows[1:])
    settings = SlicingParameters("planar", 1.73, 1.39, 2.2), Sampling()
    one = Comparison(name, rows, *settings, paper=paper[:3])
    return compare_document(name, [one, Comparison("second", broken, *settings)])


def test_the_comparison_shows_every_figure_with_the_papers_beside() -> None:
    page = html_compare(comparison())
    for text in ("130", "(139)", "25.00", "(12.50)", "cannot", "boss: planes do not fit"):
        assert text in page
    assert page.count('class="bar-of"') == 2 * 5 * 5
    # overhang angle and metal laid, of all but the one that cannot slice
    assert page.count("<td>37</td>") == page.count("<td>106%</td>") == 9
    swatches = set(re.findall(r'class="swatch" data-strategy="(\w+)"', page))
    assert all(f'[data-strategy="{strategy}"]' in page.split("</style>")[0] for strategy in swatches)
    assert len(swatches) == 5
    widths = [float(v) for v in re.findall(r"width:([\d.]+)%", page)]
    assert max(widths) <= 100
    assert min(widths) == 0


def test_the_commands_write_pages(make_case: Any, tmp_path: Path) -> None:
    page, picture = tmp_path / "m.html", tmp_path / "m.png"
    argv = ["--e1", "0", "--e2", "0", "--jobs", "1", "--html", str(page), "--picture", str(picture)]
    assert main(["sweep", str(make_case()), *argv]) in (0, 1)
    assert page.read_text(encoding="utf-8").rstrip().endswith("</html>")
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["compare", str(make_case()), "--html", str(page)]) == 0
    assert "rbam compare" in page.read_text(encoding="utf-8")
    assert main(["compare", str(make_case()), "--html", str(tmp_path / "no" / "c.html")]) == 2


# ---- the pages in a browser


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("pages")
    case = load_case(DEFAULT_CASE)
    nasty = with_changes(case, name=NASTY)
    made = {
        "plain": html_sweep(case, document_of(case)),
        "cells": html_sweep(case, document_of(case, cells=CELLS)),
        "nasty": html_sweep(nasty, document_of(nasty)),
        "none": html_sweep(case, sweep_document(case, [row_of(Pose(0.0, 0.0), "collision")])),
        "compare": html_compare(comparison()),
    }
    for name, page in made.items():
        (folder / f"{name}.html").write_text(page, encoding="utf-8")
    return {name: folder / f"{name}.html" for name in made}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plain", "cells", "nasty", "none", "compare"])
def test_a_page_opens_without_complaint(browser: Browser, pages: dict[str, Path], name: str) -> None:
    for width, theme in ((1200, "light"), (400, "dark")):
        browser.open(pages[name], width, 800, theme)
        image = browser.pixels("body")
        assert image.std() > 10
        assert browser.js("document.documentElement.scrollWidth") <= width
        assert browser.problems() == []
        assert (image.mean() > 128) == (theme == "light")
    if name != "compare":
        assert browser.js("document.getElementById('trouble').hidden")
        assert browser.pixels("#map").std() > 10


def click_on_pose(browser: Browser, i: int) -> None:
    browser.middle("#map")
    x, y = browser.js(f"(([x, y]) => {{ const b = document.getElementById('map').getBoundingClientRect();"
                      f"return [b.x + x, b.y + y] }})(rbam.map.middleOf({i}))")  # fmt: skip
    browser.mouse("mousePressed", x, y, held=True)
    browser.mouse("mouseReleased", x, y)


@pytest.mark.slow
def test_a_click_on_the_map_shows_the_pose_and_how_to_check_it(browser: Browser, pages: dict[str, Path]) -> None:
    document = document_of(load_case(DEFAULT_CASE))
    browser.open(pages["plain"])
    before = browser.pixels("#map")
    for i, row in enumerate(document["poses"]):
        click_on_pose(browser, i)
        assert browser.js("rbam.chosen") == i
        text = browser.js("document.getElementById('pose').textContent")
        assert row["verdict"] in text
        command = browser.js("document.getElementById('command').textContent")
        assert command == f"rbam check --e1 {row['E1_deg']:g} --e2 {row['E2_deg']:g} --roll fixed:-60"
        if row["rank"]:
            assert f"{row['rank']} of" in text
            assert "9.5 mm" in text
        else:
            assert f"{row['infeasible']} of the 143" in text or f"{row['infeasible']} of 143" in text
        if i == 5:
            assert np.abs(browser.pixels("#map") - before).mean() > 0.1
    click_on_pose(browser, 5)
    browser.js("document.getElementById('map').focus()")
    for key, at in (("ArrowUp", 9), ("ArrowRight", 10), ("ArrowDown", 6), ("ArrowLeft", 5)):
        browser("Input.dispatchKeyEvent", type="keyDown", key=key, code=key)
        assert browser.js("rbam.chosen") == at
    assert browser.problems() == []


@pytest.mark.slow
def test_further_axes_are_chosen_by_selectors(browser: Browser, pages: dict[str, Path]) -> None:
    document = document_of(load_case(DEFAULT_CASE), cells=CELLS)
    browser.open(pages["cells"])
    before = browser.pixels("#map")
    for axis, value in (("roll", "fixed:-60"), ("height_mm", "120 mm")):
        browser.js(f"{{const s = document.getElementById('axis-{axis}'); s.value = '{value}';"
                   "s.dispatchEvent(new Event('change'))}")  # fmt: skip
    chosen = document["poses"][browser.js("rbam.chosen")]
    assert (chosen["roll"], chosen["height_mm"]) == ("fixed:-60", 120.0)
    assert browser.js("rbam.map.at.size") == len(TILTS) * len(TURNS)
    assert np.abs(browser.pixels("#map") - before).mean() > 1
    text = browser.js("document.getElementById('case-file').textContent")
    assert "support: {height_mm: 120}" in text
    assert "position_mm: [1400, 0, 0]" in text
    assert browser.js("document.getElementById('command').textContent").endswith("--roll fixed:-60")
    for by in ("least_clearance_mm", "gravity_max_deg", "time_s"):
        browser.js(
            f"{{const s = document.getElementById('colour'); s.value = '{by}'; s.dispatchEvent(new Event('change'))}}"
        )
        assert browser.pixels("#map").std() > 5
    assert browser.problems() == []


@pytest.mark.slow
def test_the_table_sorts_filters_and_leads_to_the_map(browser: Browser, pages: dict[str, Path]) -> None:
    document = document_of(load_case(DEFAULT_CASE))
    poses = document["poses"]
    browser.open(pages["plain"])
    listed = "[...document.querySelectorAll('#table tbody tr')].map((r) => Number(r.dataset.pose))"
    by_rank = sorted(range(len(poses)), key=lambda i: (poses[i]["rank"] is None, poses[i]["rank"] or i))
    assert browser.js(listed) == by_rank
    # what was settled early, and what was not checked throughout, is a lower bound, and says so
    counts = browser.js("[...document.querySelectorAll('#table tbody tr')].map((r) => r.cells[3].textContent)")
    assert ["+ of" in text for text in counts] == [is_lower_bound(poses[i]) for i in by_rank]
    assert any(poses[i]["searched"] and is_lower_bound(poses[i]) for i in by_rank)
    browser.click("#table th:nth-child(2) button")
    assert browser.js(listed) == sorted(range(len(poses)), key=lambda i: poses[i]["E1_deg"])
    browser.click("#feasible-only")
    assert set(browser.js(listed)) == {i for i, row in enumerate(poses) if row["rank"]}
    browser.click("#table tbody tr:nth-child(2) td")
    assert browser.js("rbam.chosen") == browser.js(listed)[1]
    assert browser.js("document.querySelector('.chosen').dataset.pose") == str(browser.js("rbam.chosen"))


@pytest.mark.slow
def test_a_case_file_of_the_page_is_one_that_can_be_checked(
    browser: Browser, pages: dict[str, Path], tmp_path: Path
) -> None:
    browser.open(pages["cells"])
    path = tmp_path / "pose.case.yaml"
    path.write_text(browser.js("document.getElementById('case-file').textContent"), encoding="utf-8")
    case = load_case(path)
    chosen = document_of(load_case(DEFAULT_CASE), cells=CELLS)["poses"][browser.js("rbam.chosen")]
    expected = Pose.of(chosen).applied(load_case(DEFAULT_CASE))
    assert case.positioner == expected.positioner
    assert case.support == expected.support
    assert case.part.sub_volumes[0].endswith("propeller_blade.stl")
    assert (case.table.E1_deg, case.table.E2_deg) == (chosen["E1_deg"], chosen["E2_deg"])
