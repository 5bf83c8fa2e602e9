"""The poses of a sweep: table angles, and what else a cell can be given to try.

    poses = grid(case, e1="-90:90:15", rolls=["free", "fixed:-60"], placements=["1400,0,0", "1550,0,0"])
    poses[0].columns()              # {"E1_deg": -90.0, ..., "roll": "free", "positioner_x_mm": 1400.0, ...}
    poses[0].applied(case)          # the case with that roll and placement

What is not asked for is not in a pose, and stays as the case has it. Degrees and millimetres.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ..case.number_lists import values_of
from ..case.read import with_changes
from ..case.roll_text import parse_roll, roll_text
from ..case.sections import Case
from ..errors import InputError
from ..job.job import Job, prepare
from ..scene.scene import table_angles

STEP_DEG = 45.0
MOST_POSES = 100_000
PLACEMENT = ("positioner_x_mm", "positioner_y_mm", "positioner_z_mm", "positioner_rz_deg")
FURTHER = ("roll", *PLACEMENT, "height_mm")  # columns beside E1 and E2

Placement = tuple[float, float, float, float]


class Pose(NamedTuple):
    """One pose of a sweep; its further entries are None where they were not asked for.

    Attributes:
        E1_deg: tilt of the table.
        E2_deg: turn of the table.
        roll: free, fixed:DEG or range:LO:HI.
        positioner: x, y, z, mm, and turn about z, deg, of the positioner.
        height_mm: of the support; where the case has none, of the part over the faceplate.
    """

    E1_deg: float
    E2_deg: float
    roll: str | None = None
    positioner: Placement | None = None
    height_mm: float | None = None

    @property
    def variant(self) -> Pose:
        """The pose without its table angles: what needs a cell of its own."""
        return self._replace(E1_deg=0.0, E2_deg=0.0)

    def columns(self) -> dict[str, Any]:
        """What was asked for, as the documents name it."""
        found: dict[str, Any] = {"E1_deg": self.E1_deg, "E2_deg": self.E2_deg}
        if self.roll is not None:
            found["roll"] = self.roll
        if self.positioner is not None:
            found.update(zip(PLACEMENT, self.positioner, strict=True))
        if self.height_mm is not None:
            found["height_mm"] = self.height_mm
        return found

    @classmethod
    def of(cls, row: dict[str, Any]) -> Pose:
        """The pose that a row of a document is of.

        Raises:
            KeyError: the row names no table angles.
        """
        place = None
        if PLACEMENT[0] in row:
            x, y, z, rz = (float(row[name]) for name in PLACEMENT)
            place = (x, y, z, rz)
        return cls(row["E1_deg"], row["E2_deg"], row.get("roll"), place, row.get("height_mm"))

    def applied(self, case: Case) -> Case:
        """A case with this pose's roll, placement and height; its table angles are the check's to set."""
        changes: dict[str, Any] = {}
        if self.roll is not None:
            changes["roll"] = parse_roll(self.roll)
        if self.positioner is not None:
            x, y, z, rz = self.positioner
            rotation = (*case.positioner.rotation_deg[:2], rz)
            update = {"position_mm": (x, y, z), "rotation_deg": rotation}
            changes["positioner"] = case.positioner.model_copy(update=update)
        if self.height_mm is not None:
            if case.support is not None:
                changes["support"] = case.support.model_copy(update={"height_mm": self.height_mm})
            else:
                position = (*case.part.position_mm[:2], self.height_mm)
                changes["part"] = case.part.model_copy(update={"position_mm": position})
        return with_changes(case, **changes)


def grid(
    case: Case,
    e1: str | None = None,
    e2: str | None = None,
    *,
    rolls: Sequence[str] = (),
    placements: Sequence[str] = (),
    height: str | None = None,
) -> list[Pose]:
    """The poses of a grid; arguments that are left out come from the case's section ``sweep``.

    Args:
        case: its positioner's ranges by 45 are the default of the angles; once round of an endless axis.
        e1: tilts, "LO:HI:STEP" or one angle, deg.
        e2: turns, the same.
        rolls: each free, fixed:DEG or range:LO:HI.
        placements: each "X,Y,Z" or "X,Y,Z,RZ", mm and deg.
        height: "LO:HI:STEP" or one height, mm.

    Returns:
        The poses; the cell's changes slowest, then E1, then E2.

    Raises:
        InputError: a text of another form, an angle outside its axis' range, or too many poses; one line.
    """
    job = prepare(case)
    asked = case.sweep
    ranges = np.rad2deg(job.scene.table_range)
    tilts = _values("--e1", e1) or asked.E1_deg or _by_step(ranges[0])
    turns = _values("--e2", e2) or asked.E2_deg or _by_step(ranges[1])
    heights: list[float | None] = [*(_values("--height", height) or asked.height_mm or ())] or [None]
    if case.support is not None and any(h is not None and h <= 0 for h in heights):
        raise InputError(f"{_origin('--height', height, case)}: the height of the support must be above 0 mm")
    for text in rolls:
        parse_roll(text)
    named: Sequence[str | None] = [*rolls] or [roll_text(roll) for roll in asked.roll] or [None]
    places: list[Placement | None] = [*([_placement(text, case) for text in placements] or _places_of(case))] or [None]
    axes = (list(dict.fromkeys(axis)) for axis in (named, places, heights, tilts, turns))
    named, places, heights, tilts, turns = axes
    count = len(named) * len(places) * len(heights) * len(tilts) * len(turns)
    if count > MOST_POSES:
        raise InputError(f"sweep: {count} poses; at most {MOST_POSES} are allowed")
    _check_angles(job, tilts, turns)
    return [Pose(a, b, r, p, h) for r, p, h, a, b in product(named, places, heights, tilts, turns)]


def _origin(option: str, text: str | None, case: Case) -> str:
    return option if text is not None else f"{case.path}: sweep"


def _check_angles(job: Job, tilts: Sequence[float], turns: Sequence[float]) -> None:
    for tilt in tilts:
        table_angles(job.scene, tilt, turns[0])
    for turn in turns:
        table_angles(job.scene, tilts[0], turn)


def _by_step(limits: np.ndarray) -> list[float]:
    if not np.isfinite(limits).all():  # an endless axis: once round
        return [float(v) for v in np.arange(-180.0, 180.0, STEP_DEG)]
    first = np.ceil(limits[0] / STEP_DEG) * STEP_DEG
    return [float(v) for v in np.arange(first, limits[1] + 1e-9, STEP_DEG)]


def _values(option: str, text: str | None) -> list[float] | None:
    if text is None:
        return None
    try:
        return values_of(text)
    except ValueError as error:
        raise InputError(f"{option}: {text!r} {error}") from None


def _placement(text: str, case: Case) -> Placement:
    try:
        values = [float(v) for v in text.split(",")]
    except ValueError:
        values = []
    if len(values) not in (3, 4) or not np.isfinite(values).all():
        raise InputError(f"--positioner: {text!r} is not X,Y,Z or X,Y,Z,RZ (mm and deg)")
    x, y, z, rz = [*values, case.positioner.rotation_deg[2]][:4]
    return x, y, z, rz


def _places_of(case: Case) -> list[Placement]:
    asked = case.sweep.positioner
    if asked is None:
        return []
    own = (*case.positioner.position_mm, case.positioner.rotation_deg[2])
    axes = (asked.x_mm, asked.y_mm, asked.z_mm, asked.rz_deg)
    return list(product(*(values or [value] for values, value in zip(axes, own, strict=True))))
