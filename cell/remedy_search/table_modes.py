"""Other ways for the table to move that would help: indexing, moving along the beads, further off up.

    for trial in mode_trials(result): ...     # the least change first
    trial.key, trial.was, trial.to            # "table.mode", "fixed", "indexed"
    trial.holds()                             # the whole part checked

Each is a case of its own, prepared and checked like any other: nothing of the verdict at hand is taken over. A table
that indexes is only checked where each sub-volume has a pose that passes the screening.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from slicing import Toolpath

from ..arrays import Ints
from ..case.read import with_changes
from ..case.sections import Case
from ..case.table_section import Table
from ..job.job import Job, prepare
from ..job.table_groups import table_groups
from ..progress import Progress, counted_progress
from ..table_poses.suited_poses import suited_poses
from ..verdict.by_table_mode import check
from ..verdict.result import Result
from .remedy import Remedy

WIDER_DEG = (15.0, 20.0, 30.0, 45.0, 60.0, 90.0, 180.0)  # upright_deg
MODE_EFFORT, POSES_EFFORT, UPRIGHT_SCALE = 100.0, 50.0, 10.0  # as much of a change as one another; deg


@dataclass(frozen=True, eq=False)
class ModeTrial:
    """A case whose table moves another way.

    Attributes:
        key: of the case that is changed.
        was: its value.
        to: the one that it gets.
        effort: how much of a change that is, as ``cell.remedy_search.change`` has it.
        case: the changed case.
        given: beads that the job was prepared with, if they are not the case's own.
    """

    key: str
    was: Any
    to: Any
    effort: float
    case: Case
    given: Toolpath | None

    @property
    def words(self) -> str:
        """The change as part of a sentence."""
        unit = " deg" if self.key.endswith("_deg") else ""
        name = self.key.removesuffix("_deg")
        if self.key == "table.poses":
            return "table.poses left out, so that poses are searched"
        return f"{name} {_plain(self.was)} -> {_plain(self.to)}{unit}"

    def holds(self) -> bool:
        """Whether the whole part is feasible with it."""
        job = prepare(self.case, self.given)
        if self.case.table.mode == "indexed" and not _has_poses(job):
            return False
        return check(job).feasible


def mode_trials(result: Result) -> Iterator[ModeTrial]:
    """What is worth trying of an infeasible verdict, the least change first.

    Args:
        result: of any mode.

    Yields:
        Trials; nothing is checked yet.
    """
    job = result.job
    case, table = job.case, job.case.table
    if not job.scene.has_axis.any():
        return
    held = {"E1_deg": result.asked[0], "E2_deg": result.asked[1]}
    mode = result.mode
    searched = with_changes(case, table=Table(mode="indexed"))
    if mode == "indexed" and table.poses:
        was = [pose.model_dump() for pose in table.poses]
        yield ModeTrial("table.poses", was, [], POSES_EFFORT, searched, job.given)
    if mode == "coordinated":
        yield from _wider(result)
    if mode != "indexed" and len(np.unique(job.targets.sub_volume_index)) > 1:
        yield ModeTrial("table.mode", mode, "indexed", MODE_EFFORT, searched, job.given)
    if mode != "coordinated":
        own = held if mode == "fixed" else {}
        along = with_changes(case, table=Table(mode="coordinated", **own))
        yield ModeTrial("table.mode", mode, "coordinated", 2 * MODE_EFFORT, along, job.given)


def other_mode(result: Result, progress: Progress | None, deadline: float) -> Remedy | None:
    """Another way for the table to move with which the whole part is feasible; None where none was found in time."""
    trials = list(mode_trials(result))
    with counted_progress(progress, "what would help", len(trials)) as count:
        for trial in trials:
            if time.process_time() + result.seconds > deadline:
                return None
            holds = trial.holds()
            count()
            if holds:
                change = {"key": trial.key, "from": trial.was, "to": trial.to}
                sentence = f"{trial.words} (checked: whole part feasible)"
                return Remedy(_infeasible(result), _one_reason(result), change, "part", 0, sentence, trial.effort)
    return None


def nothing_moving(result: Result) -> Remedy:
    """That no other way for the table to move was found."""
    keys = ", ".join(
        dict.fromkeys(f"{trial.key} {trial.to}" if trial.to else trial.key for trial in mode_trials(result))
    )
    sentence = f"no other way for the table to move found that mends the whole part; tried: {keys or 'none'}"
    bad = _infeasible(result)
    return Remedy(bad, _one_reason(result), None, None, len(bad), sentence)


def _infeasible(result: Result) -> Ints:
    return np.array([i for i, row in enumerate(result.rows) if row.failure is not None], dtype=np.int64)


def _one_reason(result: Result) -> str | None:
    reasons = {row.reason for row in result.rows if row.failure is not None}
    return reasons.pop() if len(reasons) == 1 else None


def _wider(result: Result) -> Iterator[ModeTrial]:
    """Further off up, from what is known to be needed on."""
    case = result.job.case
    table = case.table
    was = 10.0 if table.upright_deg is None else table.upright_deg
    proved = [row.failure for row in result.rows if row.failure is not None and row.failure.proved]
    least = max([was, *(f.measure for f in proved if f.reason == "gravity" and f.measure is not None)])
    for deg in WIDER_DEG:
        if deg > was and deg >= least:
            wider = with_changes(case, table=table.model_copy(update={"upright_deg": deg}))
            yield ModeTrial("table.upright_deg", was, deg, (deg - was) / UPRIGHT_SCALE, wider, result.job.given)


def _has_poses(job: Job) -> bool:
    return all(suited_poses(job, group) for group in table_groups(job))


def _plain(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
