"""The HTML report: one file that needs nothing, says the verdict, and opens in a browser without an error."""

import io
import os
import re
import shutil
import subprocess

import numpy as np
import pytest
from PIL import Image

from cell.check import check
from cell.cli import main
from cell.config import load_case
from cell.html import html_report
from cell.job import prepare

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"),
    *("--disable-background-networking", "--disable-component-update", "--enable-logging=stderr"),
    *("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--virtual-time-budget=5000", "--window-size=1200,1000"),
]


def result_of(path):
    case = load_case(path)
    return check(prepare(case), case.table.E1_deg, case.table.E2_deg)


@pytest.fixture
def reports(make_case):
    good = result_of(make_case("good"))
    bad = result_of(make_case("bad", positioner={"position_mm": [2600, 0, 0]}))
    return {"feasible": (good, html_report(good)), "infeasible": (bad, html_report(bad))}


@pytest.mark.parametrize("verdict", ["feasible", "infeasible"])
def test_it_is_one_file_that_says_the_verdict(reports, verdict):
    result, page = reports[verdict]
    assert result.feasible == (verdict == "feasible")
    assert verdict in page
    assert not re.search(r'(?:src|href)\s*=\s*["\']?(?:https?:)?//', page)
    assert not re.search(r"@import|url\(\s*[\"']?https?:", page)
    assert len(page) < 2_000_000


def test_names_from_the_case_are_text_and_no_markup(make_case):
    evil = "<script>alert(1)</script>"
    path = make_case()
    path.write_text(f'name: "{evil}"\n' + path.read_text())
    page = html_report(result_of(path))
    assert evil not in page
    assert "&lt;script&gt;alert(1)" in page


def test_the_command_writes_it_whole(make_case, tmp_path, capsys):
    page = tmp_path / "r.html"
    assert main(["check", str(make_case()), "--html", str(page)]) == 0
    assert page.read_text(encoding="utf-8").rstrip().endswith("</html>")
    assert main(["check", str(make_case()), "--html", str(tmp_path / "no" / "r.html")]) == 2
    assert "does not exist" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("verdict", ["feasible", "infeasible"])
def test_a_browser_opens_it_without_an_error_and_shows_something(reports, verdict, tmp_path):
    if BROWSER is None:
        if os.environ.get("CI"):
            pytest.fail("chromium is missing on CI")
        pytest.skip("no Chromium (Debian: chromium)")
    page, shot = tmp_path / "r.html", tmp_path / "shot.png"
    page.write_text(reports[verdict][1], encoding="utf-8")
    command = [BROWSER, *FLAGS, f"--user-data-dir={tmp_path / 'profile'}", f"--screenshot={shot}", page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line and "ReadPixels" not in line]
    assert console == []
    pixels = np.asarray(Image.open(io.BytesIO(shot.read_bytes())).convert("RGB"))
    # the 3D view is on the left, below the head: it is drawn, with more than a background
    view = pixels[420:900, 60:560].reshape(-1, 3)
    assert len(np.unique(view // 8, axis=0)) > 60
