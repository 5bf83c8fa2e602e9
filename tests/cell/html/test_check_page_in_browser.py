"""The HTML report in a real browser.

Browser tests drive Chromium over its DevTools protocol (package ``websockets``). Without either they are skipped, but
on CI that is a failure.
"""

from __future__ import annotations

import base64
import io
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
from support.browser import Browser, wait_for
from support.pages import NASTY

from cell.case.read import with_changes
from cell.html.check_page import html_report
from cell.html.page_words import worst
from cell.verdict.result import Result


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
