"""The way of the arm through every bead.

    planner = Planner(solver, placed, stage, window, limits, checker, settings)
    plan = planner.bead(0, 14, None)  # BeadPlan: what can be run through, what cuts it, what is missing
    # cell.travel.travel(planner, ...): from the end of one bead to the start of the next

A bead is searched on its nodes first and checked for collisions where the way leads (and where it fails, everywhere at
that target); then followed densely between its targets. What turns out impossible is blocked and the search goes on.
A bead that does not come out whole is searched once more with the roll sampled finer. Metres, radians, seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from ik.candidates import Solver
from ik.chain import Floats
from ik.roll import RollWindow
from ik.singularity import SingularityLimits

from .bead import BeadPlan, BeadSearch
from .between import radii
from .collision import Checker, Clearances, Ints
from .follow import Steps
from .nodes import evaluate
from .place import METRES_PER_MM, Placed

FINER = 3  # times as many rolls where a bead does not come out whole


@dataclass(frozen=True)
class Settings:
    """What a plan keeps to.

    Attributes:
        clearance: least distance of everything from everything, m.
        speed: deposition speed, m/s.
        travel_speed: TCP speed of retracting and approaching, m/s.
        retract: way out along the normal before travelling, m.
        roll_step: distance of the roll's samples, rad.
        steps: density of the checks.
    """

    clearance: float
    speed: float
    travel_speed: float
    retract: float
    roll_step: float
    steps: Steps = field(default_factory=Steps)


@dataclass(frozen=True, eq=False)
class Planner:
    """What the search of every bead needs.

    Attributes:
        solver: the arm.
        placed: the targets.
        stage: deposits already laid when a target is welded, (n,).
        window: allowed roll.
        limits: singularity margins to keep.
        checker: collision detection at the table pose.
        settings: what to keep to.
        radius: from ``cell.between.radii``, (j,), m.
    """

    solver: Solver
    placed: Placed
    stage: Ints
    window: RollWindow
    limits: SingularityLimits
    checker: Checker
    settings: Settings
    radius: Floats

    @classmethod
    def of(
        cls,
        solver: Solver,
        placed: Placed,
        stage: Ints,
        window: RollWindow,
        limits: SingularityLimits,
        checker: Checker,
        settings: Settings,
    ) -> Planner:
        """A planner for the checker's scene; the attributes say what is what."""
        return cls(solver, placed, stage, window, limits, checker, settings, radii(checker.scene))

    def bead(self, first: int, stop: int, q_before: Floats | None) -> BeadPlan:
        """Plan one bead.

        Args:
            first: its first target.
            stop: one past its last.
            q_before: where the arm comes from, (j,), rad, or None.

        Returns:
            The plan.
        """
        plan = self._search(first, stop, q_before, self.settings.roll_step)
        if plan.whole or self.window.is_fixed:
            return plan
        finer = self._search(first, stop, q_before, self.settings.roll_step / FINER)
        return finer if finer.lost < plan.lost else plan

    def _search(self, first: int, stop: int, q_before: Floats | None, roll_step: float) -> BeadPlan:
        here = slice(first, stop)
        placed = replace(self.placed, position=self.placed.position[here], normal=self.placed.normal[here])
        nodes = evaluate(self.solver, placed, self.window, roll_step, self.limits)
        return BeadSearch(self, nodes, placed, self.stage[here], first).run(q_before)

    def describe(self, found: Clearances, k: int) -> dict[str, Any]:
        """A collision in words and figures."""
        scene = self.checker.scene
        pair = [scene.geom_name(int(g)) for g in found.pair[k] if g >= 0]
        return {
            "pair": pair,
            "distance_mm": round(float(found.distance[k]) / METRES_PER_MM, 3),
            "required_mm": round(self.settings.clearance / METRES_PER_MM, 3),
            "world_xyz_mm": [round(float(v) / METRES_PER_MM, 2) for v in found.position[k]],
        }
