"""What the tests of this room share."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cell.case.read import load_case
from cell.failure import Contact, Failure, Kind
from cell.html.check_page import html_report
from cell.job.job import prepare
from cell.shipped import DEFAULT_CASE
from cell.verdict.check import check_fixed
from cell.verdict.result import Result, TargetVerdict


@pytest.fixture(scope="session")
def good() -> Result:
    found = check_fixed(prepare(load_case(DEFAULT_CASE)), 90, 180)
    assert found.feasible
    return found


@pytest.fixture(scope="session")
def bad(good: Result) -> Result:
    found = check_fixed(good.job, -45, 0)
    assert not found.feasible
    return found


@pytest.fixture(scope="session")
def hit(good: Result) -> Result:
    """The feasible result with two targets said to collide, one with the table in the way of everything."""
    failure = Failure(Kind.COLLISION, -2.0, 5.0, contact=Contact(("torch_nozzle", "deposit/3/SV1/0")))
    rows = list(good.rows)
    rows[40] = TargetVerdict(failure, None, rows[40].q)
    rows[41] = TargetVerdict(failure, None)
    return replace(good, rows=tuple(rows), motion=None)


@pytest.fixture(scope="session")
def good_page(good: Result) -> str:
    return html_report(good)


@pytest.fixture(scope="session")
def bad_page(bad: Result) -> str:
    return html_report(bad)
