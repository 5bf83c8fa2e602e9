"""Verdicts on groups of layers at poses of the table, several worked out side by side before they are asked for.

    verdicts = GroupVerdicts(job)
    verdicts.look_ahead(trials)               # where there are workers; else nothing is done until it is asked for
    verdicts.of(trial)                        # a SpanVerdict; None where the pose cannot serve

A verdict depends on its trial alone, so that looking ahead changes nothing but the time: results that are not needed
are left aside. Radians and metres.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from ik.chain import Floats

from ..errors import InputError
from ..job.job import Job
from ..job.table_groups import TableGroup
from ..planning.context import Context, Span
from ..processes.worker import Tick
from ..progress import Progress, counted_progress
from ..table_poses.parallel_poses import pool_for_poses
from ..table_poses.suited_poses import serves
from ..table_poses.table_turn import Angles
from .check import SpanVerdict, check_span, off_upright

Place = tuple[float, ...] | None


@dataclass(frozen=True)
class GroupTrial:
    """A group at a pose of the table.

    Attributes:
        group: whose targets.
        pose: E1, E2, rad.
        start: where the arm comes from, rad; None where that is not known.
        end: where it goes to, likewise.
        screened: whether a look at single targets comes first, which may say that the pose cannot serve.
    """

    group: TableGroup
    pose: Angles
    start: Place
    end: Place
    screened: bool = False

    def context(self, job: Job) -> Context:
        """What it is planned with."""
        start, end = (None if place is None else np.array(place) for place in (self.start, self.end))
        return Context.of(job, self.pose, span=Span(self.group.first, self.group.stop, start, end))


def place_of(q: Floats | None) -> Place:
    """Where the arm stands, as trials have it."""
    return None if q is None else tuple(q.tolist())


class GroupVerdicts:
    """The verdicts on trials of one job; each is worked out once."""

    def __init__(self, job: Job, progress: Progress | None = None) -> None:
        """Begin without any.

        Args:
            job: from ``cell.job.job.prepare``, its layers in the order in which they are built.
            progress: called with how far each is.
        """
        self._job, self._progress = job, progress
        self._known: dict[GroupTrial, SpanVerdict | InputError | None] = {}

    @property
    def processes(self) -> int:
        """Processes among which trials are shared out."""
        return pool_for_poses(self._job).processes

    def first_alone(self, trials: Iterable[GroupTrial]) -> Iterator[Sequence[GroupTrial]]:
        """Trials of which one is wanted: the first by itself, then as many at once as there are workers, checked.

        Args:
            trials: the best first; taken only as far as they are asked for.

        Yields:
            Some of them.
        """
        left, count = iter(trials), 1
        while some := list(islice(left, count)):
            self.look_ahead(some)
            yield some
            count = self.processes

    def of(self, trial: GroupTrial) -> SpanVerdict | None:
        """The verdict on a trial.

        Args:
            trial: which.

        Returns:
            The verdict; None where the trial is screened and the pose cannot serve.

        Raises:
            InputError: it cannot be worked out; one line.
        """
        if trial not in self._known:
            self._known[trial] = _verdict(self._job, trial, self._progress)
        found = self._known[trial]
        if isinstance(found, InputError):
            raise found
        return found

    def look_ahead(self, trials: Iterable[GroupTrial]) -> None:
        """Work out the verdicts on trials side by side, where there are workers and several to work out.

        Args:
            trials: that are likely to be asked for, the likeliest first.
        """
        if self.processes <= 1:
            return
        new = [trial for trial in dict.fromkeys(trials) if trial not in self._known]
        if len(new) > 1:
            with counted_progress(self._progress, "table poses ahead", len(new)) as count:
                self._known.update(
                    zip(new, pool_for_poses(self._job).run(_worked_out, self._job, new, count), strict=True)
                )


def _worked_out(job: Job, trial: GroupTrial, tick: Tick) -> SpanVerdict | InputError | None:
    """In a worker; an error counts only if the trial is asked for."""
    try:
        found: SpanVerdict | InputError | None = _verdict(job, trial, None)
    except InputError as error:
        found = error
    tick()
    return found


def _verdict(job: Job, trial: GroupTrial, progress: Progress | None) -> SpanVerdict | None:
    if trial.screened and not serves(job, trial.group, trial.pose):
        return None
    context = trial.context(job)
    return check_span(job, context, off_upright(job, context.placed), progress)
