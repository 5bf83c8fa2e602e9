"""Single changes to a case that could make it feasible, and what each does to the targets before the arm.

Use:

    for change in single_changes(start): ...       # one key of the case in one direction
    start.poses(change, 20.0, index)               # targets as the arm would see them, (n, 4, 4)
    start.changed(change, 20.0)                    # the whole case, changed: job, E1, E2

``poses`` needs no new scene, so that hundreds of changes can be screened; ``changed`` is what a verdict is asked of.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ik.chain import Floats
from ik.roll import RollWindow
from slicing import SeamPlace

from ..arrays import Ints
from ..case.read import with_changes
from ..case.sections import Case
from ..case.table_section import Table
from ..errors import InputError
from ..job.job import Job
from ..mjcf.torch import ALLOWED
from ..scene.placement import place_targets
from ..scene.scene import table_angles
from .angle_changes import PAIRS, RollFree, RollRange, RollShift, TableAngle, TablePose
from .cell_changes import (
    BlendDistance,
    DepositionSpeed,
    PartShift,
    PositionerShift,
    SeamPosition,
    StickOut,
    SupportHeight,
    stick_out,
)
from .change import Change

ANGLE_STEP = 5.0  # deg
SHIFT_STEPS = (10.0, 20.0, 40.0, 80.0, 160.0, 300.0)  # mm, of the positioner and the support
PART_STEPS = (5.0, 10.0, 20.0, 40.0, 80.0)  # mm, of the part on the table
STICK_OUT_STEPS = (2.0, 4.0, 8.0, 16.0, 25.0)  # mm
SLOWER_STEPS = (0.1, 0.25, 0.5, 0.75, 0.9)  # share taken off the deposition speed
SHARPER_STEPS = (0.25, 0.5, 0.75, 0.9)  # share taken off the rounding of corners
WIDER_STEPS = (5.0, 10.0, 20.0, 40.0, 80.0, 120.0, 180.0)  # deg, of the roll: a wider range only adds to what is there


@dataclass(frozen=True, eq=False)
class CheckedCase:
    """A case as it was checked: what changes are made to.

    Attributes:
        job: what was checked.
        E1_deg: table tilt it was checked at.
        E2_deg: table turn it was checked at.
    """

    job: Job
    E1_deg: float
    E2_deg: float
    _known: dict[tuple[float, float], Floats] = field(default_factory=dict, repr=False)
    _seams: dict[tuple[Change, float], Job] = field(default_factory=dict, repr=False)

    def angles(self, change: Change, size: float) -> tuple[float, float]:
        """Table angles after a change, deg."""
        return change.angles(self.E1_deg, self.E2_deg, size)

    def has(self, change: Change, size: float) -> bool:
        """Whether the cell has such a change at all: an axis its range, a key the values that the case file allows."""
        try:
            change.case(self.job.case, size)
        except InputError:
            return False
        e1, e2 = self.angles(change, size)
        for value, (low, high), turn in zip((e1, e2), np.rad2deg(self.job.scene.table_range), (0, 360), strict=True):
            if not any(low - 1e-9 <= v <= high + 1e-9 for v in (value, value - turn, value + turn)):
                return False
        return True

    def window(self, change: Change, size: float) -> RollWindow:
        """Allowed roll after a change, for the poses of :meth:`poses`."""
        return change.window(self.job.window, size)

    def poses(self, change: Change, size: float, index: Ints) -> tuple[Floats, Floats]:
        """Targets as the arm as it is would see them after a change.

        Args:
            change: what is changed.
            size: by how much.
            index: which targets, (n,).

        Returns:
            Frames at roll 0, (n, 4, 4), m, base frame; deposition directions, (n, 3), base frame. A longer stick-out
            shows as targets that are further out.
        """
        job, targets = self.job, self.job.targets
        T = change.moved(job, self._T_base_part(*self.angles(change, size)), size)
        placed = place_targets(replace(targets, position=targets.position[index], normal=targets.normal[index]), T)
        return change.seen(placed, size), placed.normal

    def _T_base_part(self, e1: float, e2: float) -> Floats:
        if (e1, e2) not in self._known:
            scene = self.job.scene
            self._known[e1, e2] = scene.T_base_part(*table_angles(scene, e1, e2))
        return self._known[e1, e2].copy()

    def changed(self, change: Change, size: float) -> tuple[Job, float, float]:
        """The case after a change: the job and the table angles, deg.

        Raises:
            InputError: the changed scene does not compile.
        """
        e1, e2 = self.angles(change, size)
        if change.other_targets:
            # its numbering is asked for again and again
            job = self._seams.get((change, size)) or change.applied(self.job, self.job.case, size)
            self._seams[change, size] = job
            return job, e1, e2
        case = with_changes(change.case(self.job.case, size), table=Table(E1_deg=e1, E2_deg=e2))
        return change.applied(self.job, case, size), e1, e2

    def describe(self, change: Change, size: float) -> dict[str, Any]:
        """A change as documents have it: the case's key, the value it has and the one it should have."""
        before = self.job.case
        was = change.value(before, (self.E1_deg, self.E2_deg))
        return {
            "key": change.key,
            "from": was,
            "to": change.value(change.case(before, size), self.angles(change, size)),
        }


def single_changes(start: CheckedCase, *, slower: bool = False, sharper: bool = False) -> list[Change]:
    """The changes that are worth trying on a case.

    Args:
        start: what would be changed.
        slower: whether a slower deposition is one of them, where the case has one speed for all.
        sharper: whether corners that are rounded less are.

    Returns:
        Changes without the sizes that the cell does not have.
    """
    found: list[Change] = [*_rolls(start.job.window), *_table_angles(start.job), *_lengths(start.job.case)]
    if slower and not start.job.case.process.speed_by_thickness:
        found.append(DepositionSpeed(-1, SLOWER_STEPS))
    if sharper:
        found.append(BlendDistance(-1, SHARPER_STEPS))
    if start.job.solver.form is None:
        found = [replace(change, steps=_growing(change.steps)) for change in found]
    trimmed = [replace(change, steps=tuple(s for s in change.steps if start.has(change, s))) for change in found]
    return [change for change in trimmed if change.steps]


def _growing(steps: tuple[float, ...]) -> tuple[float, ...]:
    """Some of many sizes, each almost twice the one before: solving without a closed form takes its time."""
    kept: list[float] = []
    for size in steps:
        if not kept or size >= 1.9 * kept[-1] or size == steps[-1]:
            kept.append(size)
    return tuple(kept)


def _rolls(window: RollWindow) -> Iterator[Change]:
    if window.is_full:
        return
    for sign in (-1, 1):
        if window.is_fixed:
            yield RollShift(sign, _angles(180.0))
        width = float(np.rad2deg(window.high - window.low))
        yield RollRange(sign, tuple(s for s in WIDER_STEPS if s <= 355.0 - width))
    yield RollFree(1, (180.0,))


def _table_angles(job: Job) -> Iterator[Change]:
    for axis in np.array(["E1", "E2"])[job.scene.has_axis].tolist():
        for sign in (-1, 1):
            yield TableAngle(sign, _angles(180.0), axis)


def seam_changes(places: Mapping[str, tuple[SeamPlace, ...]]) -> list[Change]:
    """Seams elsewhere, one change a sub-volume."""
    return [SeamPosition(1, tuple(map(float, range(len(p)))), name, p) for name, p in places.items() if p]


def table_pose_change(start: CheckedCase) -> TablePose | None:
    """Both table angles together; None where the table has not both."""
    if not start.job.scene.has_axis.all():
        return None
    change = TablePose(1, tuple(float(i) for i in range(len(PAIRS))))
    steps = tuple(s for s in change.steps if start.has(change, s))
    return replace(change, steps=steps) if steps else None


def _lengths(case: Case) -> Iterator[Change]:
    # a positioner that was measured stands where it stands: its position_mm moves nothing
    for axis in "xyz" if case.positioner.calibration is None else "":
        for sign in (-1, 1):
            steps: tuple[float, ...] = SHIFT_STEPS
            if axis == "z" and sign < 0 and case.floor:  # not into the floor
                steps = tuple(s for s in steps if s <= case.positioner.position_mm[2])
            yield PositionerShift(sign, steps, axis)
    if case.support is not None:
        yield SupportHeight(-1, tuple(s for s in SHIFT_STEPS if s < case.support.height_mm))
        yield SupportHeight(1, SHIFT_STEPS)
    else:
        # a support would not move with the part
        for axis in "xy":
            for sign in (-1, 1):
                yield PartShift(sign, PART_STEPS, axis)
    if case.tool.model == "cmt_torch":
        most = ALLOWED["stick_out_mm"][1] - stick_out(case)
        yield StickOut(1, tuple(s for s in STICK_OUT_STEPS if s <= most))


def _angles(most: float) -> tuple[float, ...]:
    return tuple(float(v) for v in np.arange(ANGLE_STEP, most + 1e-9, ANGLE_STEP))
