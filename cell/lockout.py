"""Layers that lock the torch out: what cannot be welded only because of what was welded before.

    plan = with_lockouts(job, setup, plan)
    plan.beads[3].missing[17].detail["blocked_by_layers"]     # [{"sub_volume": "SV1", "layer": 0}, ..]

It is tried out: the bead or the travel is planned once more without these layers, and only what succeeds then is said
to be locked out by them. Named are layers of another sub-volume where those are enough, and of these as few of the last
as are enough.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from .bead import BeadPlan
from .nodes import evaluate
from .plan import PartPlan, plan_bead
from .setup import Setup
from .travel import travel

if TYPE_CHECKING:
    from .job import Job

MOST = 12  # beads and travels that are tried again
PROBES = 3  # targets of a bead looked at by themselves before it is searched
FEWER = 5  # share of a travel's attempts: each is tried several times


@dataclass(frozen=True)
class _Layers:
    """Deposits by name."""

    names: tuple[str, ...]
    first: tuple[int, ...]
    count: int

    def of(self, sub_volume: int, stage: int) -> list[int]:
        """Deposits of a sub-volume laid by a stage."""
        ends = [*self.first[1:], self.count]
        return list(range(self.first[sub_volume], min(ends[sub_volume], stage)))

    def words(self, deposits: list[int]) -> list[dict[str, Any]]:
        """Deposits as a report names them."""
        where = np.searchsorted(self.first, deposits, side="right") - 1
        return [
            {"sub_volume": self.names[s], "layer": d - self.first[s]}
            for s, d in zip(where.tolist(), deposits, strict=True)
        ]


def with_lockouts(job: Job, setup: Setup, plan: PartPlan) -> PartPlan:
    """The plan with the layers named that lock the torch out of what failed.

    Args:
        job: the part.
        setup: what the plan was made with.
        plan: from ``cell.plan.plan_part``.

    Returns:
        The plan; ``blocked_by_layers`` is added to details of collisions that go away without those layers.
    """
    layers = _Layers(tuple(s.name for s in job.sliced), job.shape.first_deposit, job.shape.n_deposits)
    beads, stuck = list(plan.beads), dict(plan.stuck)
    known: list[int] = []
    left = MOST
    for k, bead in enumerate(beads):
        failed = _collided(bead)
        if failed and left:
            left -= 1
            trial, target = _bead_trial(bead, failed), min(failed)
            found, known = _blame(job, setup, layers, target, int(setup.stage[target]), trial, known)
            beads[k] = _noted(bead, found, layers.words(known))
    for target in sorted(plan.stuck):
        if left and stuck[target]["on_the_way"] == "collision":
            left -= 1
            stage = int(setup.laid[stuck[target]["from_target"]])
            found, known = _blame(job, setup, layers, target, stage, _travel_trial(plan, target), known)
            if found:
                stuck[target] = {**stuck[target], "blocked_by_layers": layers.words(known)}
    return PartPlan(tuple(beads), plan.travels, stuck)


def _collided(bead: BeadPlan) -> set[int]:
    missing = {i for i, m in bead.missing.items() if m.reason == "collision"}
    return missing | {i for i, detail in bead.cuts.items() if detail["on_the_way"] == "collision"}


def _noted(bead: BeadPlan, targets: set[int], words: list[dict[str, Any]]) -> BeadPlan:
    note = {"blocked_by_layers": words}
    missing = {i: replace(m, detail={**m.detail, **note}) if i in targets else m for i, m in bead.missing.items()}
    cuts = {i: {**detail, **note} if i in targets else detail for i, detail in bead.cuts.items()}
    return replace(bead, missing=missing, cuts=cuts)


@dataclass(frozen=True)
class _Trial:
    """How to try a failed thing again in a setup: which of its targets come out, and a quick look whether they may."""

    works: Callable[[Setup], set[int]]
    may_work: Callable[[Setup], bool]


def _bead_trial(bead: BeadPlan, failed: set[int]) -> _Trial:
    # a bead is dear to search in vain: a few targets by themselves say most of it
    probes = sorted(failed)[:: max(len(failed) // PROBES, 1)][:PROBES]

    def works(setup: Setup) -> set[int]:
        again = plan_bead(setup, bead.first, bead.stop, None)
        return failed - again.missing.keys() - again.cuts.keys()

    return _Trial(works, lambda setup: all(_has_configuration(setup, i) for i in probes))


def _has_configuration(setup: Setup, i: int) -> bool:
    """Whether a target by itself has a configuration that is free."""
    here = slice(i, i + 1)
    placed = setup.placed.rows(here)
    nodes = evaluate(setup.solver, placed, setup.window, setup.settings.roll_step, setup.limits)
    q = nodes.q[np.isfinite(nodes.cost)]
    found = setup.screen.clearances(q, np.full(len(q), setup.stage[i]))
    return bool((found.distance >= setup.settings.clearance).any())


def _travel_trial(plan: PartPlan, target: int) -> _Trial:
    start = next(s for s in plan.stretches if s.first == target)
    end = next(s for s in plan.stretches if s.stop - 1 == plan.stuck[target]["from_target"])

    def works(setup: Setup) -> set[int]:
        few = replace(setup.settings, travel_attempts=max(setup.settings.travel_attempts // FEWER, 1))
        way = travel(replace(setup, settings=few), end, start, int(setup.laid[end.stop - 1]))
        return set() if isinstance(way, dict) else {target}

    return _Trial(works, lambda setup: bool(works(setup)))


def _blame(
    job: Job, setup: Setup, layers: _Layers, target: int, stage: int, trial: _Trial, known: list[int]
) -> tuple[set[int], list[int]]:
    """What works without some layers, and those layers; what is known of others is tried first, and kept where not."""
    own = int(job.targets.sub_volume_index[target])
    others = [layers.of(s, stage) for s in range(len(layers.names)) if s != own]
    together = sorted(d for some in others for d in some)
    for some in (known, *others, together, list(range(stage))):
        laid = [d for d in some if d < stage]
        if not laid or not trial.may_work(setup.without(laid)):
            continue
        # of the last as few as are enough: how many of the first can stay is found by halving
        keep, drop = 0, len(laid)
        while drop - keep > 1 and some is not known:
            middle = (keep + drop) // 2
            keep, drop = (middle, drop) if trial.may_work(setup.without(laid[middle:])) else (keep, middle)
        for without in (laid[keep:], laid):
            found = trial.works(setup.without(without))
            if found:
                return found, without
    return set(), known


def in_words(blocked: list[dict[str, Any]]) -> str:
    """Layers in a few words: "SV1 layers 3-12, SV2 layer 0"."""
    by_name: dict[str, list[int]] = {}
    for layer in blocked:
        by_name.setdefault(layer["sub_volume"], []).append(layer["layer"])
    words = []
    for name, numbers in by_name.items():
        runs = np.split(np.array(numbers), np.flatnonzero(np.diff(numbers) > 1) + 1)
        text = ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
        words.append(f"{name} layer{'s' if len(numbers) > 1 else ''} {text}")
    return ", ".join(words)
