"""The HTML report: whole in itself, true to the result, and alive in a real browser.

Browser tests drive Chromium over its DevTools protocol (package ``websockets``). Without either they are skipped, but
on CI that is a failure.
"""

from __future__ import annotations

import base64
import hashlib
import re
from dataclasses import replace

import numpy as np
from support.pages import NASTY, document_of

from cell.case.read import with_changes
from cell.case.sections import REASONS
from cell.failure import AT_TARGET, ON_BEAD, Contact, Failure, Kind
from cell.html.check_page import html_report
from cell.html.page_words import what_went_wrong, worst
from cell.motion.deposition_speed import speed_document
from cell.remedy_search.search import Remedy
from cell.verdict.result import Result, TargetVerdict
from cell.verdict.severity import severity


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


def test_a_collision_is_said_in_words(hit: Result) -> None:
    assert what_went_wrong(hit, hit.rows[40]) == "torch nozzle and layer 3 of SV1: -2.0 mm, needs 5"


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
    assert f"kept to {100 * held['least_share']:.0f} % or more" in header
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
