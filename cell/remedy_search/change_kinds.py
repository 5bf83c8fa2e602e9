"""The kinds of changes of a case: one class a kind, with its sizes, what it does, and its words.

Use:

    change = TableAngle(1, (5.0, 10.0), axis="E1")
    change.key, change.angles(90.0, 180.0, 5.0)                # "table.E1_deg", (95.0, 180.0)
    change.words(90.0, 95.0)                                   # "E1 90 -> 95"

A change is one key of a case and a direction to change it in. Sizes are in deg or mm, or the share that is taken off.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from ik.chain import Floats
from ik.roll import RollWindow, apply_roll

from ..case.read import with_changes
from ..case.seam_section import SeamSection
from ..case.sections import Case
from ..job.job import Job
from ..mjcf.torch import TorchDimensions
from ..rigid import frames
from ..scene.compose import compose
from ..scene.placement import Placed
from ..units import METRES_PER_MM
from .seam_changes import KEY, reseamed, seam_in_words, seams_value, with_seam

PAIR_STEP, PAIR_REACH = 15.0, 90.0  # deg, of both table angles together
ANGLE_SCALE, LENGTH_SCALE, SHARE_SCALE = 10.0, 20.0, 0.2  # deg, mm, share: as much of a change as one another
ROLL_SCALE = 2 * ANGLE_SCALE  # the roll is the easiest to change
Angles = tuple[float, float]  # E1, E2, deg


@dataclass(frozen=True)
class Change(ABC):
    """One key of a case and a direction to change it in.

    Attributes:
        sign: 1 or -1.
        steps: sizes to try, ascending.
        resolution: the smallest size is found to this.
        scale: what counts as much of a change as ten degrees.
        numbered: whether there are only these sizes: nothing lies between them.
        moves_no_target: whether a target by itself is to the arm what it was, so that one size is enough to screen.
        widens_to: the kind that has all that this one has, if there is one.
    """

    sign: int
    steps: tuple[float, ...]
    resolution: ClassVar[float]
    scale: ClassVar[float]
    numbered: ClassVar[bool] = False
    moves_no_target: ClassVar[bool] = False

    @property
    @abstractmethod
    def key(self) -> str:
        """The case's key."""

    @property
    def family(self) -> tuple[str, str]:
        """What one remedy is enough of: the key, and which of its directions count as different."""
        return self.key, ""

    def effort(self, size: float) -> float:
        """How much of a change a size is, to hold changes against one another."""
        return size / self.scale

    def angles(self, e1: float, e2: float, size: float) -> Angles:
        """Table angles after the change, deg."""
        return e1, e2

    def case(self, case: Case, size: float) -> Case:
        """The case with its key changed; the table's angles are not the case's and stay.

        Raises:
            InputError: the case file does not allow it.
        """
        return case

    def window(self, window: RollWindow, size: float) -> RollWindow:
        """Allowed roll after the change, for targets as ``seen`` gives them."""
        return window

    def moved(self, job: Job, T_base_part: Floats, size: float) -> Floats:
        """Pose of the part after the change, (4, 4), m, of the one at its table angles."""
        return T_base_part

    def seen(self, placed: Placed, size: float) -> Floats:
        """Targets as the arm as it is would see them, (n, 4, 4), m, base frame, at roll 0."""
        return placed.Ts_base_target

    def applied(self, job: Job, case: Case, size: float) -> Job:
        """The job of the changed case."""
        return replace(job, case=case)

    @abstractmethod
    def value(self, case: Case, angles: Angles) -> Any:
        """The key's value, as a case file has it."""

    @abstractmethod
    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence, of values."""

    @abstractmethod
    def bounds(self, job: Job, most: float) -> str:
        """How far the key was searched in words; most: the greatest size in any direction."""


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
        return _round(angles[0 if self.axis == "E1" else 1])

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
        return dict(zip(("E1_deg", "E2_deg"), map(_round, angles), strict=True))

    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence."""
        return f"E1 {was['E1_deg']:g} -> {to['E1_deg']:g} and E2 {was['E2_deg']:g} -> {to['E2_deg']:g}"

    def bounds(self, job: Job, most: float) -> str:
        """How far the grid reaches."""
        return f"E1 and E2 together by up to {PAIR_REACH:g} deg"


@dataclass(frozen=True)
class _Roll(Change):
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
            return {"fixed_deg": _round(case.roll.fixed_deg)}
        return {"range_deg": [_round(v) for v in case.roll.range_deg or ()]}

    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence."""
        return f"roll {_roll_words(was)} -> {_roll_words(to)}"

    def bounds(self, job: Job, most: float) -> str:
        """Rolls are searched all round."""
        return "any roll" if job.window.is_fixed else "wider rolls up to free"


@dataclass(frozen=True)
class RollShift(_Roll):
    """A roll held elsewhere."""

    family = ("roll", "shift")

    def _section(self, low: float, high: float, size: float) -> Any:
        return {"fixed_deg": half_turn(low + self.sign * size)}

    def seen(self, placed: Placed, size: float) -> Floats:
        """As a turn of the targets, so that all sizes share one window."""
        return apply_roll(placed.Ts_base_target, np.array(np.deg2rad(self.sign * size)))


@dataclass(frozen=True)
class RollRange(_Roll):
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
class RollFree(_Roll):
    """Any roll."""

    resolution = 180.0
    family = ("roll", "free")

    def window(self, window: RollWindow, size: float) -> RollWindow:
        """All rolls."""
        return RollWindow.free()


@dataclass(frozen=True)
class _Length(Change):
    """A length of the cell, which makes another scene."""

    resolution, scale = 5.0, LENGTH_SCALE
    name: ClassVar[str]

    def applied(self, job: Job, case: Case, size: float) -> Job:
        """The job in the changed scene."""
        return replace(job, case=case, scene=compose(case, job.shape))

    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence."""
        return f"{self.name} {was:g} -> {to:g} mm"

    def bounds(self, job: Job, most: float) -> str:
        """The greatest size."""
        return f"{self.name} by up to {most:g} mm"


@dataclass(frozen=True)
class _Shift(_Length):
    """A place moved along "x", "y" or "z"."""

    axis: str

    @property
    def family(self) -> tuple[str, str]:
        """Each axis by itself."""
        return self.key, self.axis

    def by(self, size: float) -> Floats:
        """The shift, (3,), mm."""
        return self.sign * size * np.array([self.axis == axis for axis in "xyz"])

    def to(self, at: tuple[float, float, float], size: float) -> tuple[float, float, float]:
        """A place after the shift, mm."""
        x, y, z = (value + self.sign * size * (self.axis == n) for value, n in zip(at, "xyz", strict=True))
        return x, y, z

    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence."""
        axis, a, b = next((n, a, b) for n, a, b in zip("xyz", was, to, strict=True) if a != b)
        return f"{self.name} {axis} {a:g} -> {b:g} mm"


@dataclass(frozen=True)
class PositionerShift(_Shift):
    """The positioner elsewhere in the cell."""

    key, name = "positioner.position_mm", "positioner"

    def case(self, case: Case, size: float) -> Case:
        """The case with the positioner elsewhere."""
        at = self.to(case.positioner.position_mm, size)
        return with_changes(case, positioner=case.positioner.model_copy(update={"position_mm": at}))

    def moved(self, job: Job, T_base_part: Floats, size: float) -> Floats:
        """Shifted along the world's axes."""
        T_base_part[:3, 3] += job.scene.T_world_base()[:3, :3].T @ (self.by(size) * METRES_PER_MM)
        return T_base_part

    def value(self, case: Case, angles: Angles) -> Any:
        """The place, mm."""
        return [_round(v) for v in case.positioner.position_mm]


@dataclass(frozen=True)
class PartShift(_Shift):
    """The part elsewhere on the table."""

    key, name = "part.position_mm", "part"

    def case(self, case: Case, size: float) -> Case:
        """The case with the part elsewhere."""
        at = self.to(case.part.position_mm, size)
        return with_changes(case, part=case.part.model_copy(update={"position_mm": at}))

    def moved(self, job: Job, T_base_part: Floats, size: float) -> Floats:
        """Shifted along the table's axes: the part's own are turned against them."""
        turn = np.deg2rad(job.case.part.rotation_deg)
        c, s = np.cos(turn), np.sin(turn)
        shift = self.by(size) * METRES_PER_MM
        T_base_part[:3, 3] += T_base_part[:3, :3] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ shift
        return T_base_part

    def value(self, case: Case, angles: Angles) -> Any:
        """The place, mm."""
        return [_round(v) for v in case.part.position_mm]


@dataclass(frozen=True)
class SupportHeight(_Length):
    """A higher or lower support."""

    key, name = "support.height_mm", "support height"

    def case(self, case: Case, size: float) -> Case:
        """The case with another support; one without a support stays."""
        if case.support is None:
            return case
        height = case.support.height_mm + self.sign * size
        return with_changes(case, support=case.support.model_copy(update={"height_mm": height}))

    def moved(self, job: Job, T_base_part: Floats, size: float) -> Floats:
        """Shifted along the support."""
        T_base_part[:3, 3] += T_base_part[:3, 2] * self.sign * size * METRES_PER_MM
        return T_base_part

    def value(self, case: Case, angles: Angles) -> Any:
        """The height, mm."""
        return None if case.support is None else _round(case.support.height_mm)


@dataclass(frozen=True)
class StickOut(_Length):
    """A longer wire."""

    key, name = "tool.dimensions.stick_out_mm", "stick-out"
    resolution, scale = 1.0, LENGTH_SCALE / 10

    def case(self, case: Case, size: float) -> Case:
        """The case with a longer wire."""
        dimensions = {**case.tool.dimensions, "stick_out_mm": stick_out(case) + self.sign * size}
        return with_changes(case, tool=case.tool.model_copy(update={"dimensions": dimensions}))

    def seen(self, placed: Placed, size: float) -> Floats:
        """As targets that are further out."""
        return frames(placed.position + placed.normal * size * METRES_PER_MM, placed.normal, placed.reference)

    def value(self, case: Case, angles: Angles) -> Any:
        """The wire's free length, mm."""
        return _round(stick_out(case))


@dataclass(frozen=True)
class DepositionSpeed(Change):
    """A slower deposition; sizes are shares of the speed."""

    key = "process.deposition_speed_mm_s"
    resolution, scale = 0.01, SHARE_SCALE

    def case(self, case: Case, size: float) -> Case:
        """The case with another speed."""
        speed = case.process.deposition_speed_mm_s * (1 + self.sign * size)
        return with_changes(case, process=case.process.model_copy(update={"deposition_speed_mm_s": speed}))

    def applied(self, job: Job, case: Case, size: float) -> Job:
        """The job with the speed at every target."""
        speed = np.full(len(job.targets), case.process.deposition_speed_mm_s)
        return replace(job, case=case, targets=replace(job.targets, speed_mm_s=speed))

    def value(self, case: Case, angles: Angles) -> Any:
        """The speed, mm/s."""
        return _round(case.process.deposition_speed_mm_s)

    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence."""
        return f"deposition speed {was:g} -> {to:g} mm/s"

    def bounds(self, job: Job, most: float) -> str:
        """The least share."""
        return f"deposition speed down to {1 - most:.0%}"


@dataclass(frozen=True)
class Blend(Change):
    """Corners that are rounded less; sizes are shares of the distance, which is not worth a finer search."""

    key = "process.blend_mm"
    resolution, scale, numbered = 0.01, 10 * SHARE_SCALE, True

    def case(self, case: Case, size: float) -> Case:
        """The case with corners rounded less."""
        blend = round(case.process.blend_mm * (1 + self.sign * size), 6)
        return with_changes(case, process=case.process.model_copy(update={"blend_mm": blend}))

    def value(self, case: Case, angles: Angles) -> Any:
        """The distance, mm."""
        return _round(case.process.blend_mm)

    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence."""
        return f"rounding of corners {was:g} -> {to:g} mm"

    def bounds(self, job: Job, most: float) -> str:
        """The least share."""
        return f"rounding of corners down to {1 - most:.0%}"


@dataclass(frozen=True)
class Seam(Change):
    """The seams of a sub-volume elsewhere; sizes number the places, which change as little as some roll."""

    sub_volume: str
    choices: tuple[SeamSection, ...]
    key = KEY
    resolution, scale, numbered, moves_no_target = 1.0, ROLL_SCALE, True, True

    @property
    def family(self) -> tuple[str, str]:
        """Each sub-volume by itself."""
        return self.key, self.sub_volume

    def case(self, case: Case, size: float) -> Case:
        """The case with a place of seams more."""
        return with_seam(case, self.choices[round(size)])

    def applied(self, job: Job, case: Case, size: float) -> Job:
        """The job with other targets on the same beads."""
        return reseamed(job, self.choices[round(size)])

    def value(self, case: Case, angles: Angles) -> Any:
        """The places of seams."""
        return seams_value(case)

    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence."""
        return seam_in_words(to)

    def bounds(self, job: Job, most: float) -> str:
        """How many places."""
        return f"seams of {self.sub_volume} at {len(self.steps)} other places"


def stick_out(case: Case) -> float:
    """The wire's free length, mm."""
    return case.tool.dimensions.get("stick_out_mm", TorchDimensions().stick_out_mm)


def half_turn(angle: float) -> float:
    """An angle in (-180, 180]."""
    return 180.0 - (180.0 - angle) % 360.0


def _round(value: float) -> float:
    return round(value, 3) + 0.0


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
