"""A change of a case that could make it feasible: one key in one direction, by a size.

Use:

    change = TableAngle(1, (5.0, 10.0), axis="E1")             # the kinds: angle_changes, cell_changes
    change.key, change.angles(90.0, 180.0, 5.0)                # "table.E1_deg", (95.0, 180.0)
    change.words(90.0, 95.0)                                   # "E1 90 -> 95"

Sizes are in deg or mm, or the share that is taken off.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from ik.chain import Floats
from ik.roll import RollWindow

from ..case.sections import Case
from ..job.job import Job
from ..scene.placement import PlacedTargets

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
        other_targets: whether the changed case has other targets on the same beads. To the arm each is what one was
            before, so that one size is enough to screen.
    """

    sign: int
    steps: tuple[float, ...]
    resolution: ClassVar[float]
    scale: ClassVar[float]
    numbered: ClassVar[bool] = False
    other_targets: ClassVar[bool] = False

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

    def seen(self, placed: PlacedTargets, size: float) -> Floats:
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


def rounded_for_case(value: float) -> float:
    """A value as a case file is given it."""
    return round(value, 3) + 0.0
