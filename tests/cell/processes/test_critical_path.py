"""How long a round takes by processor time: what waits for others begins when they are done."""

from __future__ import annotations

import pytest

from cell.processes.critical_path import CriticalPath


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Processor time of this process, s."""
    now = [5.0]
    monkeypatch.setattr("cell.processes.critical_path.time.process_time", lambda: now[0])
    return now


def test_a_worker_that_has_more_to_do_is_waited_for(clock: list[float]) -> None:
    path = CriticalPath(0.0)
    path.given("w", [])
    path.came("w", 0, 2.0)
    path.given("w", [])
    path.came("w", 1, 1.0)
    clock[0] += 2.5
    path.done_here(2)
    path.wait_for_all()
    assert path.waited == pytest.approx(0.5)
    # and not for less
    path.wait_for([0, 2])
    assert path.waited == pytest.approx(0.5)


def test_a_task_begins_when_those_that_it_waits_for_are_done(clock: list[float]) -> None:
    path = CriticalPath(0.0)
    path.given("w", [])
    path.came("w", "a", 1.0)
    clock[0] += 4.0
    path.done_here("b")
    # the worker had nothing to do from 1 to 4
    path.given("w", ["a", "b"])
    path.came("w", "c", 1.0)
    path.wait_for(["a"])
    assert path.waited == 0.0
    path.wait_for(["c"])
    assert path.waited == pytest.approx(1.0)
    # this process' clock stands at 5 now
    path.done_here("d")
    path.given("v", ["d"])
    path.came("v", "e", 1.0)
    path.wait_for_all()
    assert path.waited == pytest.approx(2.0)


def test_of_a_start_what_passed_meanwhile_does_not_count(clock: list[float]) -> None:
    for before, waited in ((0.5, 1.5), (3.0, 1.2)):
        path = CriticalPath(before)
        path.given("w", [])
        path.came("w", 0, 2.0, start=0.8)
        path.wait_for_all()
        assert path.waited == pytest.approx(waited)
