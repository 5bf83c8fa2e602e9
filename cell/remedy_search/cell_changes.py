"""Changes of lengths in the cell, of the process, and of seams.

Use:

    SupportHeight(1, (10.0, 20.0)).words(120.0, 130.0)         # "support height 120 -> 130 mm"
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from ik.chain import Floats
from slicing import SeamPlace

from ..case.read import with_changes
from ..case.sections import Case
from ..collision.model_copies import discard_spare
from ..job.job import Job
from ..mjcf.torch import TorchDimensions
from ..rigid import frames
from ..scene.compose import compose
from ..scene.placement import PlacedTargets
from ..units import METRES_PER_MM
from .change import LENGTH_SCALE, ROLL_SCALE, SHARE_SCALE, Angles, Change, rounded_for_case
from .seam_changes import KEY, reseamed, seam_in_words, seams_value, with_seam


@dataclass(frozen=True)
class _Length(Change):
    """A length of the cell, which makes another scene."""

    resolution, scale = 5.0, LENGTH_SCALE
    name: ClassVar[str]

    def applied(self, job: Job, case: Case, size: float) -> Job:
        """The job in the changed scene."""
        discard_spare(
            job.scene.model
        )  # of a large cell it would be there beside all that the next one is compiled from
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
        return [rounded_for_case(v) for v in case.positioner.position_mm]


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
        return [rounded_for_case(v) for v in case.part.position_mm]


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
        return None if case.support is None else rounded_for_case(case.support.height_mm)


@dataclass(frozen=True)
class StickOut(_Length):
    """A longer wire."""

    key, name = "tool.dimensions.stick_out_mm", "stick-out"
    resolution, scale = 1.0, LENGTH_SCALE / 10

    def case(self, case: Case, size: float) -> Case:
        """The case with a longer wire."""
        dimensions = {**case.tool.dimensions, "stick_out_mm": stick_out(case) + self.sign * size}
        return with_changes(case, tool=case.tool.model_copy(update={"dimensions": dimensions}))

    def seen(self, placed: PlacedTargets, size: float) -> Floats:
        """As targets that are further out."""
        return frames(placed.position + placed.normal * size * METRES_PER_MM, placed.normal, placed.reference)

    def value(self, case: Case, angles: Angles) -> Any:
        """The wire's free length, mm."""
        return rounded_for_case(stick_out(case))


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
        return rounded_for_case(case.process.deposition_speed_mm_s)

    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence."""
        return f"deposition speed {was:g} -> {to:g} mm/s"

    def bounds(self, job: Job, most: float) -> str:
        """The least share."""
        return f"deposition speed down to {100 * (1 - most):.0f} %"


@dataclass(frozen=True)
class BlendDistance(Change):
    """Corners that are rounded less; sizes are shares of the distance, which is not worth a finer search."""

    key = "process.blend_mm"
    resolution, scale, numbered = 0.01, 10 * SHARE_SCALE, True

    def case(self, case: Case, size: float) -> Case:
        """The case with corners rounded less."""
        blend = round(case.process.blend_mm * (1 + self.sign * size), 6)
        return with_changes(case, process=case.process.model_copy(update={"blend_mm": blend}))

    def value(self, case: Case, angles: Angles) -> Any:
        """The distance, mm."""
        return rounded_for_case(case.process.blend_mm)

    def words(self, was: Any, to: Any) -> str:
        """The change as part of a sentence."""
        return f"rounding of corners {was:g} -> {to:g} mm"

    def bounds(self, job: Job, most: float) -> str:
        """The least share."""
        return f"rounding of corners down to {100 * (1 - most):.0f} %"


@dataclass(frozen=True)
class SeamPosition(Change):
    """The seams of a sub-volume elsewhere; sizes number the places, which change as little as some roll."""

    sub_volume: str
    choices: tuple[SeamPlace, ...]
    key = KEY
    resolution, scale, numbered, other_targets = 1.0, ROLL_SCALE, True, True

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
