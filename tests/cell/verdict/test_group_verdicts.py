"""Verdicts on groups at poses of the table: who works them out changes nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.jobs.indexed import three_case, with_table

from cell.errors import InputError
from cell.job.job import prepare
from cell.job.table_groups import table_groups
from cell.processes.worker_pool import working
from cell.verdict import group_verdicts
from cell.verdict.by_table_mode import check
from cell.verdict.group_verdicts import GroupTrial, GroupVerdicts, place_of
from cell.verdict.result import Result


def alike(one: Result, other: Result) -> None:
    """Two verdicts are the same to the bit."""
    assert one.poses == other.poses
    assert one.asked == other.asked
    assert (one.clearance, one.singularity, one.sigma) == (other.clearance, other.singularity, other.sigma)
    for a, b in zip(one.rows, other.rows, strict=True):
        assert a.failure == b.failure
        assert np.array_equal(a.q, b.q)
    assert (one.motion is None) == (other.motion is None)
    if one.motion is not None and other.motion is not None:
        for name in ("t_s", "q", "table", "arc", "target"):
            assert np.array_equal(getattr(one.motion, name), getattr(other.motion, name))


@pytest.mark.slow
def test_the_verdict_does_not_depend_on_how_many_processes_work_it_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cell.table_poses.parallel_poses.LARGE", 0)
    # a wall that some of the poses are in the way of, and one that nothing gets past
    wall = {"name": "wall", "box": {"size_mm": [40, 40, 700]}, "position_mm": [1280, 0, 350]}
    shut = {"name": "shut", "box": {"size_mm": [900, 900, 20]}, "position_mm": [1500, 0, 1900]}
    for mode, fixtures in (("indexed", []), ("indexed", [wall]), ("best", []), ("indexed", [shut])):
        job = prepare(with_table(three_case(tmp_path), {"mode": mode}, fixtures=fixtures))
        alone = check(job)
        alike(check(job, processes=2), alone)


def test_an_error_counts_only_where_its_trial_is_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = prepare(three_case(tmp_path))
    home = place_of(job.scene.start)
    group = table_groups(job)[0]
    trials = [GroupTrial(group, (0.0, 0.1 * k), home, home) for k in range(3)]
    seen: list[GroupTrial] = []

    def said(_job, trial, _progress):
        seen.append(trial)
        if trial is trials[1]:
            raise InputError("one line")
        return trial.pose

    class Two:
        processes = 2

        def run(self, function, shared, items, tick):
            return [function(shared, item, tick) for item in items]

    monkeypatch.setattr(group_verdicts, "_verdict", said)
    monkeypatch.setattr(group_verdicts, "pool_for_poses", lambda job: Two())
    verdicts = GroupVerdicts(job)
    verdicts.look_ahead(trials)
    assert seen == trials
    assert verdicts.of(trials[2]) == trials[2].pose
    with pytest.raises(InputError, match="one line"):
        verdicts.of(trials[1])
    assert seen == trials  # each is worked out once
    assert [len(some) for some in verdicts.first_alone(trials)] == [1, 2]


def test_without_workers_nothing_is_worked_out_before_it_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    job = prepare(three_case(tmp_path))
    home = place_of(job.scene.start)
    seen: list[GroupTrial] = []
    monkeypatch.setattr(group_verdicts, "_verdict", lambda job, trial, progress: seen.append(trial))
    verdicts = GroupVerdicts(job)
    verdicts.look_ahead(GroupTrial(group, (0.0, 0.0), home, home) for group in table_groups(job))
    assert not seen
    with working(2):  # a part of so few targets is worked out in this process all the same
        verdicts.look_ahead(GroupTrial(group, (0.0, 0.0), home, home) for group in table_groups(job))
    assert not seen
