"""What would help: for every group of infeasible targets the smallest change that makes it feasible, checked.

    for remedy in remedies(result): print(remedy.sentence)     # E1 -45 -> -31 (checked: whole part feasible)

One thing is changed at a time (``cell.remedy_search.changes``), and both table angles together where no single thing
helps. Hundreds of changes are screened by kinematics alone (``cell.remedy_search.screening``), which settles from what
size on a change can help. From there sizes grow until the verdict's own checker agrees on some of the group's beads;
halving between the last size that fails and the first that holds finds the smallest to the change's resolution. What is
said has been through ``cell.verdict.check`` on the whole part. A smaller size that holds between larger ones that do
not can be missed.
"""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Ints
from ..case.read import with_changes
from ..case.sections import Checks
from ..failure import Kind, Where
from ..job.job import Job
from ..progress import Progress, counted_progress
from ..verdict.check import check_fixed
from ..verdict.result import Result
from .angle_changes import RollFree, RollRange
from .bead_trial import first_failure
from .change import Change
from .changes import CheckedCase, seam_changes, single_changes, table_pose_change
from .remedy import Remedy
from .screening import Screening, size_between
from .seam_changes import counterparts, seam_places
from .table_modes import nothing_moving, other_mode
from .target_groups import TargetGroup, target_groups

MOST_GROUPS = 4  # searched; the largest
CHECKS_WHOLE, CHECKS_GROUP = 8, 2  # whole checks that a search may cost
FEWER_CHECKS_FROM = 600  # targets; larger parts get fewer whole checks
CHECKS_OPEN = 2  # of a part that was lost before all of it was checked
UNTIMED_FACTOR = 4  # so many times more whole checks where there is no limit of time
TRIALS = 6  # sizes tried on some beads for each whole check
TRIES = 5  # growing sizes of one change
GROW = 1.9
SHOWN = 3  # remedies for the part as a whole
TRIED_FIRST = 3  # beads that are tried before the whole part
OVERHANG = Kind.OVERHANG.reason


def remedies(
    result: Result, progress: Progress | None = None, seconds: float = np.inf, shown: int = SHOWN
) -> Iterator[Remedy]:
    """Search changes of the case that make it feasible.

    Args:
        result: an infeasible verdict; a feasible one yields nothing.
        progress: called with how far it is.
        seconds: processor time after which nothing further is tried (so a busy machine gives the same answer);
            infinite: more changes are tried.
        shown: largest number of changes for the whole part.

    Yields:
        First changes that help the whole part, then the smallest change for each group; each as soon as it is known.
    """
    found = target_groups(result.job.targets, [None if row.failure is None else row.reason for row in result.rows])
    if not found:
        return
    if all(group.reason == OVERHANG for group in found) and not result.job.overhanging_beads:
        yield _of_the_part_alone(result)
        return
    if result.moved is not None:
        # single changes are searched at one pose of the table: of one that moves they would say nothing
        yield other_mode(result, progress, time.process_time() + seconds) or nothing_moving(result)
        return
    whole = np.sort(np.concatenate([group.targets for group in found]))
    # of targets that are samples of more, each would be a group by itself
    parts = found[:MOST_GROUPS] if len(found) > 1 and not result.not_looked_at else []
    with counted_progress(progress, "what would help", CHECKS_WHOLE + CHECKS_GROUP * len(parts)) as count:
        search = _RemedySearch(result, parts, count, time.process_time() + seconds)
        reasons = {group.reason for group in found}
        reason = found[0].reason if len(found) == 1 or (result.not_looked_at and len(reasons) == 1) else None
        best = search.run(whole, reason, shown, CHECKS_WHOLE)
        if not any(remedy.checked == "part" for remedy in best):
            moving = other_mode(result, None, search.deadline)
            best = best if moving is None else [moving, *(remedy for remedy in best if remedy.change)]
        yield from best
        known = {remedy.change["key"] for remedy in best if remedy.change and remedy.checked == "part"}
        for group in parts:
            yield from _unless_known(search.run(group.targets, group.reason, 1, CHECKS_GROUP), best, bool(known))


def _of_the_part_alone(result: Result) -> Remedy:
    """That layers overhang whatever the cell is like; another slicer's beads may have the table or a fixture below."""
    bad = np.array(sorted(result.failures), dtype=np.int64)
    sentence = (
        "no roll, table pose, placement, seam, stick-out, speed or rounding changes how far a layer overhangs;"
        " another slicing.strategy or another part may, or a larger checks.overhang_mm allows it"
    )
    return Remedy(bad, OVERHANG, None, None, len(bad), sentence)


def _unless_known(own: list[Remedy], best: list[Remedy], mended: bool) -> Iterator[Remedy]:
    """A group's own remedies, less those that were said of the whole part already."""
    said = [remedy.change for remedy in best]
    for remedy in own:
        if remedy.change is None and mended:
            continue  # what helps the whole part helps this group
        if remedy.change is None or remedy.change not in said:
            yield remedy


@dataclass(eq=False)
class _ChangeTrial:
    """How far a change has been turned.

    Attributes:
        change: which.
        fails: a size that is too small.
        size: the next one to try; infinite where none is left.
        creep: steps of the resolution to grow by, where what stands in the way shows in the whole part alone.
        left: sizes that may still be tried.
    """

    change: Change
    fails: float
    size: float
    creep: int = 0
    left: int = TRIES


class _RemedySearch:
    """Holds what has been learned about changes: what screening says, and every whole check."""

    def __init__(self, result: Result, found: list[TargetGroup], count: Callable[[], None], deadline: float) -> None:
        """Screen all changes.

        Args:
            result: the verdict.
            found: its groups.
            count: called after every whole check.
            deadline: when to stop, by ``time.process_time``.
        """
        self.result, self.count, self.deadline = result, count, deadline
        # a changed case that fails is not checked any further
        job = replace(result.job, case=with_changes(result.job.case, checks=_reduced_budget(result.job.case.checks)))
        self.start = CheckedCase(job, *result.asked)
        self.bad = set(result.failures)
        slow = any(row.reason == "speed" for row in result.rows)
        cut = any(f.rounded and f.where is Where.BEAD for f in result.failures.values())
        self.changes = [
            *seam_changes(seam_places(result.job, result.rows)),
            *single_changes(self.start, slower=slow, sharper=cut),
        ]
        good = [i for i in range(len(result.rows)) if i not in self.bad]
        must = [int(i) for group in found for i in group.targets[[0, len(group.targets) // 2, -1]]]
        self.screening = Screening(self.start, sorted(self.bad), good, must)
        self.screening.add(self.changes)
        self.checked: dict[tuple[Change, float], set[int]] = {}
        self.unseen: dict[tuple[Change, float], int] = {}  # how many targets of these were not checked
        self.left = self.tries = 0

    @property
    def spent(self) -> bool:
        """Whether nothing further is to be tried."""
        return self.left <= 0 or self.tries <= 0 or time.process_time() > self.deadline

    def _has_time(self) -> bool:
        """Whether a whole check would end in time; if not, nothing further is tried."""
        if time.process_time() + self.result.seconds <= self.deadline:
            return True
        self.left = 0
        return False

    def run(self, wanted: Ints, reason: str | None, want: int, checks: int) -> list[Remedy]:
        """The smallest changes that make some targets feasible.

        Args:
            wanted: the targets; all infeasible ones ask for the whole part.
            reason: what they are infeasible for.
            want: how many different changes.
            checks: whole checks it may cost.

        Returns:
            Remedies, those that mend the whole part first, then by effort; one without a change where none was found.
        """
        n = len(self.result.rows)
        checks *= 1 if np.isfinite(self.deadline) else UNTIMED_FACTOR
        self.left = checks if n <= FEWER_CHECKS_FROM else max(checks * FEWER_CHECKS_FROM // n, 2)
        if self.result.not_looked_at:
            self.left = min(self.left, CHECKS_OPEN)
        self.tries = TRIALS * self.left
        entire = len(wanted) == len(self.bad)
        found = self._best(self.changes, wanted, entire, reason, want)
        if entire and not found:
            found = self._freed(wanted, reason)
        pair = table_pose_change(self.start)
        if entire and not found and pair is not None:
            self.screening.add([pair])
            found = self._best([pair], wanted, entire, reason, 1)
        found.sort(key=lambda r: (r.checked != "part", r.effort))
        return found[:want] or [self._nothing(wanted, reason, entire)]

    def _best(
        self, choice: Iterable[Change], wanted: Ints, entire: bool, reason: str | None, want: int
    ) -> list[Remedy]:
        """Remedies, the least effort tried first, until no effort left can be less than what is found."""
        found: dict[tuple[str, str], Remedy] = {}
        tried_first = self._beads_tried_first(wanted)
        queue: list[tuple[float, int, _ChangeTrial]] = []
        for n, change in enumerate(choice):
            fails, size = self.screening.border(change, None if entire else wanted)
            if np.isfinite(size):
                tries = len(change.steps) if change.other_targets else TRIES
                heapq.heappush(queue, (change.effort(size), n, _ChangeTrial(change, fails, size, left=tries)))
        while queue and not self.spent:
            effort, n, trial = heapq.heappop(queue)
            efforts = sorted(r.effort for r in found.values())
            if len(efforts) >= want and effort >= efforts[want - 1]:
                break
            kind = trial.change.family
            if kind in found and found[kind].effort <= effort:
                continue
            if isinstance(trial.change, RollFree) and RollRange.family in found:
                continue  # of these one is enough
            holds = self._try(trial, wanted, entire, tried_first)
            if holds is not None:
                found[kind] = self._remedy(trial.change, holds, wanted, reason)
            elif np.isfinite(trial.size):
                heapq.heappush(queue, (trial.change.effort(trial.size), n, trial))
        return list(found.values())

    def _freed(self, wanted: Ints, reason: str | None) -> list[Remedy]:
        """The greatest change of the roll, should the search have ended before it: a free one."""
        free = next((change for change in self.changes if isinstance(change, RollFree)), None)
        if free is None or not self.screening.allowed(free, None):
            return []
        if (free, free.steps[0]) not in self.checked and not self._has_time():
            return []
        if self._blame(free, free.steps[0], wanted, True):
            return []
        return [self._remedy(free, free.steps[0], wanted, reason)]

    def _try(self, trial: _ChangeTrial, wanted: Ints, entire: bool, tried_first: list[int]) -> float | None:
        """The smallest size that the checker agrees to, if the trial's size is large enough; else it is made larger.

        Some beads decide about sizes, the whole part about the last one; a bead that it fails at joins them.
        """
        change, size = trial.change, trial.size
        enough = self._known_to_hold(change, wanted, entire)
        if size >= enough:
            return enough
        self.tries -= 1
        if self._promises(change, size, wanted, entire, tried_first) and self._has_time():
            if not trial.creep:
                size = self._refined(change, trial.fails, size, wanted, entire, tried_first)
            blame = self._blame(change, size, wanted, entire)
            if not blame:
                return size
            bead = int(self._numbering(change, size).targets.bead[min(blame)])
            trial.creep = 2 * trial.creep or int(bead in tried_first or self._bead_holds(change, size, bead))
            if bead not in tried_first:
                tried_first.insert(0, bead)
        trial.fails, trial.left = size, trial.left - 1
        larger = self._larger(trial, None if entire else wanted) if trial.left else np.inf
        trial.size = min(larger, enough)
        return None

    def _known_to_hold(self, change: Change, wanted: Ints, entire: bool) -> float:
        """The smallest size of which a whole check has said so already; infinite if there is none."""
        known = [size for k, size in self.checked if k == change and not self._blame(k, size, wanted, entire)]
        return min(known, default=np.inf)

    def _larger(self, trial: _ChangeTrial, wanted: Ints | None) -> float:
        """The next size to try, infinite where there is none."""
        change, size = trial.change, trial.fails
        crept = size + trial.creep * change.resolution
        if trial.creep and not change.numbered and crept <= change.steps[-1] and self.start.has(change, crept):
            return crept
        enough = size if change.numbered else GROW * size
        allowed = self.screening.allowed(change, wanted)
        return min((s for s in allowed if s > size and (s >= enough or s == change.steps[-1])), default=np.inf)

    def _bead_holds(self, change: Change, size: float, bead: int) -> bool:
        return not first_failure(*self.start.changed(change, size), [bead], None)

    def _refined(
        self, change: Change, fails: float, holds: float, wanted: Ints, entire: bool, tried_first: list[int]
    ) -> float:
        if change.numbered:
            return holds
        while holds - fails > change.resolution * 1.001 and time.process_time() < self.deadline:
            middle = size_between(change, fails, holds)
            if self._promises(change, middle, wanted, entire, tried_first):
                holds = middle
            else:
                fails = middle
        return holds

    def _promises(self, change: Change, size: float, wanted: Ints, entire: bool, tried_first: list[int]) -> bool:
        """Whether a change makes some beads feasible: their targets that are wanted, or all of them."""
        if (change, size) in self.checked:
            return not self._blame(change, size, wanted, entire)
        if not self.start.has(change, size):
            return False
        job, e1, e2 = self.start.changed(change, size)
        mine = None if entire else counterparts(self.start.job, self._numbering(change, size), wanted)
        return not first_failure(job, e1, e2, tried_first, mine)

    def _blame(self, change: Change, size: float, wanted: Ints, entire: bool) -> set[int]:
        """Targets that are infeasible with a change though they are wanted, by a whole check."""
        if (change, size) not in self.checked:
            self.left -= 1
            self.count()
            found = check_fixed(*self.start.changed(change, size))
            # what was not checked is not mended either
            self.checked[change, size] = {i for i, row in enumerate(found.rows) if row.reason is not None}
            self.unseen[change, size] = found.not_looked_at
        bad = self.checked[change, size]
        return bad if entire else bad & counterparts(self.start.job, self._numbering(change, size), wanted)

    def _numbering(self, change: Change, size: float) -> Job:
        """A job whose targets are numbered as those of a changed case."""
        return self.start.changed(change, size)[0] if change.other_targets else self.start.job

    def _beads_tried_first(self, wanted: Ints) -> list[int]:
        beads = np.unique(self.result.job.targets.bead[wanted])
        return [int(b) for b in beads[np.unique(np.linspace(0, len(beads) - 1, TRIED_FIRST).round().astype(int))]]

    def _remedy(self, change: Change, size: float, wanted: Ints, reason: str | None) -> Remedy:
        bad, unseen = self.checked[change, size], self.unseen[change, size]
        document = self.start.describe(change, size)
        said = "whole part feasible" if not bad else f"{_these(wanted)} feasible, {len(bad) - unseen} of the part not"
        said += f", {unseen} not checked" if unseen else ""
        sentence = f"{change.words(document['from'], document['to'])} (checked: {said})"
        return Remedy(
            wanted, reason, document, "group" if bad else "part", len(bad) - unseen, sentence, change.effort(size)
        )

    def _nothing(self, wanted: Ints, reason: str | None, entire: bool) -> Remedy:
        bounds = "; ".join(dict.fromkeys(_bounds(self.start, change, self.changes) for change in self.changes))
        what = "the whole part" if entire else _these(wanted)
        cut = " before the search was cut off (--remedies searches longer)" if self.spent else ""
        sentence = f"no single change found that mends {what}{cut}; searched: {bounds}"
        return Remedy(wanted, reason, None, None, len(self.bad), sentence)


def _reduced_budget(checks: Checks) -> Checks:
    """The same without asking for every target of a part that is lost."""
    return checks.model_copy(update={"every_target": False}) if checks.every_target else checks


def _these(targets: Ints) -> str:
    return "this target" if len(targets) == 1 else f"these {len(targets)} targets"


def _bounds(start: CheckedCase, change: Change, every: list[Change]) -> str:
    """How far a key was searched, in words."""
    return change.bounds(start.job, max(k.steps[-1] for k in every if k.key == change.key))
