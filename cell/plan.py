"""The way of the arm through every bead and from bead to bead.

    plan = plan_part(setup, path)             # path (n,): bead of each target
    plan.beads[0].stretches                   # what can be run through; cuts and missing say what cannot
    plan.travels, plan.stuck                  # between the beads

A bead that does not come out whole is searched once more with the roll sampled finer. Metres, radians, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import IO, Any

import numpy as np

from ik.chain import Floats

from .bead import BeadPlan, BeadSearch, Stretch
from .collision import Ints
from .nodes import evaluate
from .progress import Bar
from .setup import Setup
from .travel import Way, travel

FINER = 3  # times as many rolls where a bead does not come out whole


@dataclass(frozen=True, eq=False)
class PartPlan:
    """What became of a part.

    Attributes:
        beads: in order.
        travels: to each whole bead from the one before.
        stuck: targets that begin a bead to which no travel leads, with why.
    """

    beads: tuple[BeadPlan, ...]
    travels: tuple[Way, ...]
    stuck: dict[int, dict[str, Any]]

    @property
    def stretches(self) -> list[Stretch]:
        """All that can be run through, in order."""
        return [stretch for bead in self.beads for stretch in bead.stretches]


def plan_part(setup: Setup, path: Ints, progress: IO[str] | None = None) -> PartPlan:
    """Plan bead after bead and the travels between them.

    Args:
        setup: what the search needs.
        path: bead of each target, (n,), ascending.
        progress: where to show a bar, if that is a terminal.

    Returns:
        The plan.
    """
    firsts = np.flatnonzero(np.diff(path, prepend=-1)).tolist()
    beads: list[BeadPlan] = []
    travels: list[Way] = []
    stuck: dict[int, dict[str, Any]] = {}
    last: Stretch | None = None
    with Bar(progress, "beads", len(firsts)) as bar:
        for first, stop in zip(firsts, [*firsts[1:], len(path)], strict=True):
            bead = plan_bead(setup, first, stop, None if last is None else last.q_targets[-1])
            beads.append(bead)
            if last is not None and bead.whole:
                # the layer under the torch counts as laid
                way = travel(setup, last, bead.stretches[0], int(setup.laid[last.stop - 1]))
                if isinstance(way, dict):
                    stuck[first] = {"from_target": last.stop - 1, "travel": True, **way}
                else:
                    travels.append(way)
            last = bead.stretches[-1] if bead.stretches else last
            bar.advance()
    return PartPlan(tuple(beads), tuple(travels), stuck)


def plan_bead(setup: Setup, first: int, stop: int, q_before: Floats | None) -> BeadPlan:
    """Plan one bead.

    Args:
        setup: what the search needs.
        first: its first target.
        stop: one past its last.
        q_before: where the arm comes from, (j,), rad, or None.

    Returns:
        The plan.
    """
    plan = _search(setup, first, stop, q_before, setup.settings.roll_step)
    if setup.window.is_fixed or not plan.may_be_mended:
        return plan
    finer = _search(setup, first, stop, q_before, setup.settings.roll_step / FINER)
    return finer if finer.lost < plan.lost else plan


def _search(setup: Setup, first: int, stop: int, q_before: Floats | None, roll_step: float) -> BeadPlan:
    here = slice(first, stop)
    placed = replace(setup.placed, position=setup.placed.position[here], normal=setup.placed.normal[here])
    nodes = evaluate(setup.solver, placed, setup.window, roll_step, setup.limits)
    return BeadSearch(setup, nodes, placed, setup.stage[here], first).run(q_before)
