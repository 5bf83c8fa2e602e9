"""Layers that lock the torch out: later beads that cannot be welded only because of them.

    plan = with_lockouts(job, context, plan)
    plan.beads[3].target_failures[17].failure.locked_by      # (LaidLayer("SV1", 0), ..)

The bead or the travel is planned once more without these layers, and only targets that can then be welded are reported
as locked out. Layers of another sub-volume are named if leaving these out is enough, and of them as few of the last as
are enough. In an infeasible part that is not checked completely, these trials may query LOCKOUTS configurations in all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Ints
from ..failure import Failure, Kind, LaidLayer
from .bead_outcome import BeadPlan
from .bead_plan import plan_bead
from .bead_runs import PartPlan
from .bead_search import BeadSearch
from .configurations import nodes_at_rolls
from .context import Context
from .edges.edge_check import SearchedBead
from .infeasible_part import full_work
from .travels.travel import travel

if TYPE_CHECKING:
    from ..job.job import Job

MOST_TRIED_AGAIN = 12  # beads and travels that are tried again
TRIED_FIRST = 3  # targets of a bead checked by themselves before it is searched
LOCKOUTS = 5_000  # configurations that trials may ask about, unless every target is to be checked
FEWER = 5  # share of a travel's attempts: each is tried several times


@dataclass(frozen=True)
class _DepositNames:
    """Deposits by name."""

    names: tuple[str, ...]
    numbers: tuple[Ints, ...]

    def of(self, sub_volume: int, deposits_laid: int) -> list[int]:
        """Deposits of a sub-volume among those laid by then, as they were laid."""
        return [d for d in self.numbers[sub_volume].tolist() if d < deposits_laid]

    def named(self, deposits: list[int]) -> tuple[LaidLayer, ...]:
        """Deposits as a report names them."""
        named = {
            d: LaidLayer(name, layer)
            for name, numbers in zip(self.names, self.numbers, strict=True)
            for layer, d in enumerate(numbers.tolist())
        }
        return tuple(named[d] for d in deposits)


def with_lockouts(job: Job, context: Context, plan: PartPlan) -> PartPlan:
    """The plan, with the layers named that keep the torch out where it failed.

    Args:
        job: the part.
        context: what the plan was made with.
        plan: from ``cell.planning.part_plan.plan_part``.

    Returns:
        The plan; ``locked_by`` is set of collisions that go away without those layers.
    """
    layers = _DepositNames(job.targets.sub_volume, job.deposits)
    beads, travel_failures = list(plan.beads), dict(plan.travel_failures)
    known: list[int] = []
    left, every = MOST_TRIED_AGAIN, context.settings.every_target or not any(bead.open for bead in beads)
    most = np.inf if every else context.work + LOCKOUTS
    for k, bead in enumerate(beads):
        failed = _collided(bead)
        if failed and left and context.work < most:
            left -= 1
            trial, target = _bead_trial(bead, failed, most), min(failed)
            found, known = _blame(job, context, layers, target, int(context.deposits_before[target]), trial, known)
            beads[k] = _noted(bead, found, layers.named(known))
    for target in sorted(plan.travel_failures):
        if left and context.work < most and travel_failures[target].kind is Kind.COLLISION:
            left -= 1
            deposits_laid = int(context.laid[_leaves(travel_failures[target])])
            found, known = _blame(job, context, layers, target, deposits_laid, _travel_trial(plan, target), known)
            if found:
                travel_failures[target] = replace(travel_failures[target], locked_by=layers.named(known))
    return replace(plan, beads=tuple(beads), travel_failures=travel_failures)


def _collided(bead: BeadPlan) -> set[int]:
    lost = {i for i, m in bead.target_failures.items() if m.failure.kind is Kind.COLLISION}
    return lost | {i for i, failure in bead.edge_failures.items() if failure.kind is Kind.COLLISION}


def _leaves(failure: Failure) -> int:
    """The target that a travel leaves."""
    assert failure.from_target is not None
    return failure.from_target


def _noted(bead: BeadPlan, targets: set[int], locked_by: tuple[LaidLayer, ...]) -> BeadPlan:
    def noted(i: int, failure: Failure) -> Failure:
        return replace(failure, locked_by=locked_by) if i in targets else failure

    target_failures = {i: replace(m, failure=noted(i, m.failure)) for i, m in bead.target_failures.items()}
    return replace(
        bead,
        target_failures=target_failures,
        edge_failures={i: noted(i, failure) for i, failure in bead.edge_failures.items()},
    )


@dataclass(frozen=True)
class _LayerTrial:
    """A failed bead or travel planned again without layers: its weldable targets, and a quick test for any."""

    works: Callable[[Context], set[int]]
    may_work: Callable[[Context], bool]


def _bead_trial(bead: BeadPlan, failed: set[int], most: float) -> _LayerTrial:
    # searching a bead without a result is expensive: a few targets by themselves show most of it
    tried_first = sorted(failed)[:: max(len(failed) // TRIED_FIRST, 1)][:TRIED_FIRST]

    def works(context: Context) -> set[int]:
        if context.work + full_work(context, bead.stop - bead.first) > most:
            return set()
        again = plan_bead(context, bead.first, bead.stop, None)
        return failed - again.target_failures.keys() - again.edge_failures.keys() - again.open

    return _LayerTrial(works, lambda context: context.work < most and _stand_free(context, tried_first))


def _stand_free(context: Context, targets: Sequence[int]) -> bool:
    """Whether some targets each have a configuration that is free, at the sampled rolls."""
    window, step = context.window, context.settings.roll_step
    for i in targets:
        nodes = nodes_at_rolls(context.solver, context.placed.rows([i]), window, step, context.limits)
        if BeadSearch(SearchedBead.apart(context, np.array([i])), nodes).lost_alone():
            return False
    return True


def _travel_trial(plan: PartPlan, target: int) -> _LayerTrial:
    start = next(s for s in plan.stretches if s.first == target)
    end = next(s for s in plan.stretches if s.stop - 1 == plan.travel_failures[target].from_target)

    def works(context: Context) -> set[int]:
        few = replace(context.settings, travel_attempts=max(context.settings.travel_attempts // FEWER, 1))
        way = travel(replace(context, settings=few), end, start, int(context.laid[end.stop - 1]))
        return set() if isinstance(way, Failure) else {target}

    return _LayerTrial(works, lambda context: bool(works(context)))


def _blame(
    job: Job,
    context: Context,
    layers: _DepositNames,
    target: int,
    deposits_laid: int,
    trial: _LayerTrial,
    known: list[int],
) -> tuple[set[int], list[int]]:
    """What can be welded without some layers, and these layers; layers that helped elsewhere are tried first."""
    own = int(job.targets.sub_volume_index[target])
    others = [layers.of(s, deposits_laid) for s in range(len(layers.names)) if s != own]
    together = sorted(d for some in others for d in some)
    for some in (known, *others, together, list(range(deposits_laid))):
        laid = [d for d in some if d < deposits_laid]
        if not laid or not trial.may_work(context.without(laid)):
            continue
        # of the last as few as are enough: how many of the first can stay is found by halving
        keep, drop = 0, len(laid)
        while drop - keep > 1 and some is not known:
            middle = (keep + drop) // 2
            keep, drop = (middle, drop) if trial.may_work(context.without(laid[middle:])) else (keep, middle)
        for without in (laid[keep:], laid):
            found = trial.works(context.without(without))
            if found:
                return found, without
    return set(), known
