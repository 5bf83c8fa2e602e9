"""Changes of angles: of the table, and of the roll about the wire.

Use:

    TablePose(1, (0.0, 1.0)).angles(90.0, 180.0, 0.0)          # the grid's first pose beside E1 = 90, E2 = 180 deg
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ik.chain import Floats
from ik.roll import RollWindow, apply_roll

from ..case.read import with_changes
from ..case.sections import Case
from ..job.job import Job
from ..scene.placement import PlacedTargets
from .change import ANGLE_SCALE, ROLL_SCALE, Angles, Change, rounded_for_case

PAIR_STEP, PAIR_REACH = 15.0, 90.0  # deg, of both table angles together


@dataclass(frozen=True)
class TableAngle(Change):
    """One angle of the table: "E1" or "E2"."""

    axis: str
    resolution, scale = 1.0, ANGLE_SCALE

    @property
    def key(self) -> str:
        """The case's key."""
        return f"table.{self.axis}_deg"

    def angles(self, e1: float, e2: float, size: float) -> Angles:
        """Table angles after the change, deg."""
        by = self.sign * size
        return (e1 + by, e2) if self.axis == "E1" else (e1, half_turn(e2 + by))

    def value(self, case: Case, angles: Angles) -> Any:
        """The angle, deg."""
        return rounded_for_case(angles[0 if self.axis == "E1" else 1])

    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence."""
        return f"{self.axis} {was:g} -> {to:g}"

    def bounds(self, job: Job, most: float) -> str:
        """The axis' range."""
        low, high = np.rad2deg(job.scene.table_range[0 if self.axis == "E1" else 1])
        turns = np.isfinite([low, high]).all()
        return f"{self.axis} {low:g} .. {high:g} deg" if turns else f"{self.axis} all round"


@dataclass(frozen=True)
class TablePose(Change):
    """Both table angles together, on a grid; sizes number the grid's poses, the nearest first."""

    resolution, scale, numbered = 1.0, ANGLE_SCALE, True
    key = "table"

    def angles(self, e1: float, e2: float, size: float) -> Angles:
        """Table angles after the change, deg."""
        d1, d2 = PAIRS[round(size)]
        return e1 + d1, half_turn(e2 + d2)

    def value(self, case: Case, angles: Angles) -> Any:
        """Both angles, deg."""
        return dict(zip(("E1_deg", "E2_deg"), map(rounded_for_case, angles), strict=True))

    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence."""
        return f"E1 {was['E1_deg']:g} -> {to['E1_deg']:g} and E2 {was['E2_deg']:g} -> {to['E2_deg']:g}"

    def bounds(self, job: Job, most: float) -> str:
        """How far the grid reaches."""
        return f"E1 and E2 together by up to {PAIR_REACH:g} deg"


@dataclass(frozen=True)
class _RollChange(Change):
    """Another roll about the wire."""

    resolution, scale = 1.0, ROLL_SCALE
    key = "roll"

    def case(self, case: Case, size: float) -> Case:
        """The case with another roll."""
        low, high = (
            (0.0, 0.0) if isinstance(case.roll, str) else case.roll.range_deg or (case.roll.fixed_deg or 0.0,) * 2
        )
        return with_changes(case, roll="free" if isinstance(case.roll, str) else self._section(low, high, size))

    def _section(self, low: float, high: float, size: float) -> Any:
        return "free"

    def value(self, case: Case, angles: Angles) -> Any:
        """The section of the case."""
        if isinstance(case.roll, str):
            return case.roll
        if case.roll.fixed_deg is not None:
            return {"fixed_deg": rounded_for_case(case.roll.fixed_deg)}
        return {"range_deg": [rounded_for_case(v) for v in case.roll.range_deg or ()]}

    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence."""
        return f"roll {_roll_words(was)} -> {_roll_words(to)}"

    def bounds(self, job: Job, most: float) -> str:
        """Rolls are searched all round."""
        return "any roll" if job.window.is_fixed else "wider rolls up to free"


@dataclass(frozen=True)
class RollShift(_RollChange):
    """A roll held elsewhere."""

    family = ("roll", "shift")

    def _section(self, low: float, high: float, size: float) -> Any:
        return {"fixed_deg": half_turn(low + self.sign * size)}

    def seen(self, placed: PlacedTargets, size: float) -> Floats:
        """As a turn of the targets, so that all sizes share one window."""
        return apply_roll(placed.Ts_base_target, np.array(np.deg2rad(self.sign * size)))


@dataclass(frozen=True)
class RollRange(_RollChange):
    """A roll that may move further down (sign -1) or up; more than one that is held elsewhere."""

    scale = ROLL_SCALE / 1.5
    family = ("roll", "wider")  # one end widened is enough

    def _section(self, low: float, high: float, size: float) -> Any:
        return {"range_deg": [low - size * (self.sign < 0), high + size * (self.sign > 0)]}

    def window(self, window: RollWindow, size: float) -> RollWindow:
        """The wider window."""
        by = float(np.deg2rad(size))
        return RollWindow(window.low - by * (self.sign < 0), window.high + by * (self.sign > 0))


@dataclass(frozen=True)
class RollFree(_RollChange):
    """Any roll."""

    resolution = 180.0
    family = ("roll", "free")

    def window(self, window: RollWindow, size: float) -> RollWindow:
        """All rolls."""
        return RollWindow.free()


def half_turn(angle: float) -> float:
    """An angle in (-180, 180]."""
    return 180.0 - (180.0 - angle) % 360.0


def _roll_words(value: Any) -> str:
    if value == "free":
        return "free"
    if "fixed_deg" in value:
        return f"fixed:{value['fixed_deg']:g}"
    return "range:{:g}:{:g}".format(*value["range_deg"])


def _pairs() -> list[Angles]:
    values = np.arange(-PAIR_REACH, PAIR_REACH + 1, PAIR_STEP)
    both = [(float(a), float(b)) for a in values for b in values if a and b]
    return sorted(both, key=lambda p: (max(abs(p[0]), abs(p[1])), abs(p[0]) + abs(p[1])))


PAIRS = _pairs()  # changes of E1 and E2, deg
