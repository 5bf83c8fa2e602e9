"""What would help: for every group of infeasible targets the smallest change that makes it feasible, checked.

    for remedy in remedies(result): print(remedy.sentence)     # E1 -45 -> -31 (checked: whole part feasible)

One thing is changed at a time (``cell.changes``), and both table angles together where no single thing helps. Hundreds
of changes are screened by kinematics alone (``cell.screening``), which settles from what size on a change can help.
From there sizes grow until the verdict's own checker agrees on some of the group's beads; halving between the last size
that fails and the first that holds finds the smallest to the knob's resolution. What is said has been through
``cell.check`` on the whole part. A smaller size that holds between larger ones that do not can be missed.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import IO, Any

import numpy as np

from .changes import Knob, Start, in_words, knobs, pair_knob
from .check import CLEARANCE_REACH, Result, check, settings_of
from .collision import Checker, Ints
from .groups import Group, groups
from .job import Job
from .place import place
from .plan import plan_bead
from .progress import Bar
from .scene import table_angles
from .screening import Screening, between
from .setup import Setup

MOST_GROUPS = 4  # searched; the largest
CHECKS_WHOLE, CHECKS_GROUP = 8, 2  # whole checks that a search may cost
LARGE = 600  # targets from which on parts get fewer of them
TRIES = 5  # growing sizes of one knob
GROW = 1.6
SHOWN = 3  # remedies for the part as a whole
PROBES = 3  # beads that are tried before the whole part
_WIDER = {"low": "wider", "high": "wider"}  # of these one is enough


@dataclass(frozen=True, eq=False)
class Remedy:
    """A change that helps, or that none was found.

    Attributes:
        targets: what it helps, ascending.
        reason: what these are infeasible for; None for all infeasible targets together.
        change: ``key``, ``from``, ``to`` in the case's terms; None where none was found.
        checked: "part" where the whole part is feasible with it, "group" where these targets are; None without one.
        left: targets of the part that are infeasible with it.
        sentence: all this in words.
        effort: how much of a change it is.
    """

    targets: Ints
    reason: str | None
    change: dict[str, Any] | None
    checked: str | None
    left: int
    sentence: str
    effort: float = np.inf

    def document(self) -> dict[str, Any]:
        """As the report has it."""
        return {
            "targets": [int(i) for i in self.targets],
            "reason": self.reason,
            "change": self.change,
            "checked": self.checked,
            "infeasible_left": self.left,
            "sentence": self.sentence,
        }


def remedies(result: Result, progress: IO[str] | None = None) -> Iterator[Remedy]:
    """Search what would help.

    Args:
        result: an infeasible verdict; of a feasible one nothing comes.
        progress: where to show a bar, if that is a terminal.

    Yields:
        First what helps the part as a whole, then each group's smallest change; each as soon as it is known.
    """
    found = groups(result.job.targets, [row.reason for row in result.rows])
    if not found:
        return
    whole = np.sort(np.concatenate([group.targets for group in found]))
    parts = found[:MOST_GROUPS] if len(found) > 1 else []
    with Bar(progress, "what would help", CHECKS_WHOLE + CHECKS_GROUP * len(parts)) as bar:
        search = _Search(result, parts, bar)
        reason = found[0].reason if len(found) == 1 else None
        best = search.run(whole, reason, SHOWN, CHECKS_WHOLE)
        yield from best
        known = {remedy.change["key"] for remedy in best if remedy.change and remedy.checked == "part"}
        for group in parts:
            yield from _unless_known(search.run(group.targets, group.reason, 1, CHECKS_GROUP), best, bool(known))


def _unless_known(own: list[Remedy], best: list[Remedy], mended: bool) -> Iterator[Remedy]:
    """A group's own remedies, less those that were said of the whole part already."""
    said = [remedy.change for remedy in best]
    for remedy in own:
        if remedy.change is None and mended:
            continue  # what helps the whole part helps this group
        if remedy.change is None or remedy.change not in said:
            yield remedy


class _Search:
    """Holds what has been learned about changes: what screening says, and every whole check."""

    def __init__(self, result: Result, found: list[Group], bar: Bar) -> None:
        """Screen all changes.

        Args:
            result: the verdict.
            found: its groups.
            bar: advances by one a whole check.
        """
        self.result, self.bar = result, bar
        self.start = Start(result.job, *result.asked)
        self.bad = {i for i, row in enumerate(result.rows) if row.reason is not None}
        slow = any(row.reason == "speed" for row in result.rows)
        self.knobs = knobs(self.start, slower=slow)
        good = [i for i in range(len(result.rows)) if i not in self.bad]
        must = [int(i) for group in found for i in group.targets[[0, len(group.targets) // 2, -1]]]
        self.screening = Screening(self.start, sorted(self.bad), good, must)
        self.screening.add(self.knobs)
        self.checked: dict[tuple[Knob, float], set[int]] = {}
        self.left = 0

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
        self.left = checks if n <= LARGE else max(checks * LARGE // n, 2)
        entire = len(wanted) == len(self.bad)
        found = self._best(self.knobs, wanted, entire, reason, want)
        pair = pair_knob(self.start)
        if entire and not found and pair is not None:
            self.screening.add([pair])
            found = self._best([pair], wanted, entire, reason, 1)
        found.sort(key=lambda r: (r.checked != "part", r.effort))
        return found[:want] or [self._nothing(wanted, reason, entire)]

    def _best(self, choice: Iterable[Knob], wanted: Ints, entire: bool, reason: str | None, want: int) -> list[Remedy]:
        """Remedies by the least effort that screening allows, until nothing can be better than what is found."""
        border = {knob: self.screening.border(knob, None if entire else wanted) for knob in choice}
        order = sorted((k for k in border if np.isfinite(border[k][1])), key=lambda k: k.effort(border[k][1]))
        found: dict[tuple[str, str], Remedy] = {}
        for knob in order:
            efforts = sorted(r.effort for r in found.values())
            if self.left <= 0 or (len(efforts) >= want and knob.effort(border[knob][1]) >= efforts[want - 1]):
                break
            kind = (knob.key, _WIDER.get(knob.how, knob.how))
            if knob.how == "free" and (knob.key, "wider") in found:
                continue
            if kind in found and found[kind].effort <= knob.effort(border[knob][1]):
                continue
            size = self._smallest(knob, wanted, entire, *border[knob])
            if size is None:
                continue
            remedy = self._remedy(knob, size, wanted, reason)
            if kind not in found or remedy.effort < found[kind].effort:
                found[kind] = remedy
        return list(found.values())

    def _smallest(self, knob: Knob, wanted: Ints, entire: bool, fails: float, size: float) -> float | None:
        """The smallest size that the checker agrees to, growing from where screening allows it.

        Some beads decide about sizes, the whole part about the last one; a bead that it fails at joins them.
        """
        probes = self._probes(wanted)
        allowed = self.screening.allowed(knob, None if entire else wanted)
        enough = self._known_to_hold(knob, wanted, entire)
        creep = 0  # what stands in the way shows in the whole part alone, so that a few sizes more may do
        for _ in range(TRIES):
            if size >= enough:
                return enough
            if self._promises(knob, size, wanted, entire, probes):
                if not creep:
                    size = self._refined(knob, fails, size, wanted, entire, probes)
                if self.left <= 0:
                    break
                blame = self._blame(knob, size, wanted, entire)
                if not blame:
                    return size
                bead = int(self.result.job.targets.path[min(blame)])
                creep = 2 * creep or int(bead in probes or self._bead_holds(knob, size, bead))
                probes.insert(0, bead)
            fails = size
            larger = self._larger(knob, allowed, size, creep)
            if larger is None:
                break
            size = larger
        return enough if np.isfinite(enough) else None

    def _known_to_hold(self, knob: Knob, wanted: Ints, entire: bool) -> float:
        """The smallest size of which a whole check has said so already; infinite if there is none."""
        known = [size for k, size in self.checked if k == knob and not self._blame(k, size, wanted, entire)]
        return min(known, default=np.inf)

    def _larger(self, knob: Knob, allowed: list[float], size: float, creep: int) -> float | None:
        """The next size to try, None where there is none."""
        if creep and knob.unit != "pose" and size + creep * knob.resolution <= knob.steps[-1]:
            return size + creep * knob.resolution
        enough = size if knob.unit == "pose" else GROW * size
        larger = [s for s in allowed if s > size and (s >= enough or s == knob.steps[-1])]
        return larger[0] if larger else None

    def _bead_holds(self, knob: Knob, size: float, bead: int) -> bool:
        return not _lost(*self.start.changed(knob, size), [bead], None)

    def _refined(self, knob: Knob, fails: float, holds: float, wanted: Ints, entire: bool, probes: list[int]) -> float:
        if knob.unit == "pose":
            return holds
        while holds - fails > knob.resolution * 1.001:
            middle = between(knob, fails, holds)
            if self._promises(knob, middle, wanted, entire, probes):
                holds = middle
            else:
                fails = middle
        return holds

    def _promises(self, knob: Knob, size: float, wanted: Ints, entire: bool, probes: list[int]) -> bool:
        """Whether a change makes some beads feasible: their targets that are wanted, or all of them."""
        if (knob, size) in self.checked:
            return not self._blame(knob, size, wanted, entire)
        job, e1, e2 = self.start.changed(knob, size)
        lost = _lost(job, e1, e2, probes, None if entire else set(wanted.tolist()))
        return not lost

    def _blame(self, knob: Knob, size: float, wanted: Ints, entire: bool) -> set[int]:
        """Targets that are infeasible with a change though they are wanted, by a whole check."""
        if (knob, size) not in self.checked:
            self.left -= 1
            self.bar.advance()
            found = check(*self.start.changed(knob, size))
            self.checked[knob, size] = {i for i, row in enumerate(found.rows) if row.reason is not None}
        bad = self.checked[knob, size]
        return bad if entire else bad & set(wanted.tolist())

    def _probes(self, wanted: Ints) -> list[int]:
        beads = np.unique(self.result.job.targets.path[wanted])
        return [int(b) for b in beads[np.unique(np.linspace(0, len(beads) - 1, PROBES).round().astype(int))]]

    def _remedy(self, knob: Knob, size: float, wanted: Ints, reason: str | None) -> Remedy:
        bad = self.checked[knob, size]
        change = self.start.describe(knob, size)
        if not bad:
            said = "whole part feasible"
        else:
            said = f"these {len(wanted)} targets feasible, {len(bad)} of the part are not"
        sentence = f"{in_words(change)} (checked: {said})"
        return Remedy(wanted, reason, change, "group" if bad else "part", len(bad), sentence, knob.effort(size))

    def _nothing(self, wanted: Ints, reason: str | None, entire: bool) -> Remedy:
        bounds = "; ".join(dict.fromkeys(_bounds(self.start, knob, self.knobs) for knob in self.knobs))
        what = "the whole part" if entire else f"these {len(wanted)} targets"
        cut = " (cut off: this part is large)" if self.left <= 0 else ""
        sentence = f"no single change found that mends {what}{cut}; searched: {bounds}"
        return Remedy(wanted, reason, None, None, len(self.bad), sentence)


def _lost(job: Job, E1_deg: float, E2_deg: float, beads: Iterable[int], wanted: set[int] | None) -> set[int]:
    """Infeasible targets of the first of some beads that has wanted ones among them (None: any); empty if none has."""
    table = table_angles(job.scene, E1_deg, E2_deg)
    placed, settings = place(job.targets, job.scene.T_base_part(*table)), settings_of(job)
    checker = Checker(job.scene, table, max(CLEARANCE_REACH, 2 * settings.clearance))
    if checker.table_alone().distance[0] < 0.0:
        return set(range(len(job.targets)))
    setup = Setup.of(job.solver, placed, job.stage, job.laid, job.window, job.singularity_limits, checker, settings)
    for bead in beads:
        first, stop = np.searchsorted(job.targets.path, [bead, bead + 1]).tolist()
        plan = plan_bead(setup, first, stop, None)
        lost = {*plan.missing, *plan.cuts}
        if wanted is not None:
            lost &= wanted
        if lost:
            return lost
    return set()


def _bounds(start: Start, knob: Knob, every: list[Knob]) -> str:
    """How far a key was searched, in words."""
    if knob.key == "roll":
        return "any roll" if start.job.window.is_fixed else "wider rolls up to free"
    same = [k for k in every if k.key == knob.key]
    if knob.key.startswith("table"):
        k = 0 if knob.key.endswith("E1_deg") else 1
        low, high = np.rad2deg(start.job.scene.table_range[k])
        return f"{'E1' if k == 0 else 'E2'} {low:g} .. {high:g} deg"
    most = max(k.steps[-1] for k in same)
    name = knob.key.split(".")[-1].removesuffix("_mm").removesuffix("_mm_s").replace("_", " ")
    if knob.unit == "share":
        return f"{name} down to {1 - most:.0%}"
    if knob.key == "positioner.position_mm" or knob.key == "part.position_mm":
        name = knob.key.split(".")[0]
    return f"{name} by up to {most:g} mm"
