"""The whole case, and its sections about the run: roll, checks, process, sweep and what is expected.

    Case.model_validate({"part": {"sub_volumes": ["blade.stl"], "body": {"radius_mm": 20}}})

Lengths in mm and angles in degrees, as every key says. ``cell.case.read`` reads the files and words the errors.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from ..printable import printable
from .cell_sections import NO_TABLE, Fixture, Positioner, Robot, Torch
from .controller_section import ControllerSection
from .fields import (
    Angle,
    Angles,
    Coordinates,
    Count,
    Distance,
    FileName,
    RightAngle,
    Seconds,
    Section,
    Speed,
    Title,
    number_within,
)
from .part_sections import NO_PART, BeadsSection, Part, Sampling, Slicing, Support
from .table_section import Table

REASONS = ("unreachable", "joint_limit", "singular", "collision", "no_path", "speed", "gravity", "overhang")


class Roll(Section):
    """Angles allowed about the wire."""

    fixed_deg: Angle | None = Field(None, description="one angle")
    range_deg: tuple[Angle, Angle] | None = Field(
        None, description="lowest and highest angle; every angle between them is allowed"
    )

    @model_validator(mode="after")
    def _one_of(self) -> Roll:
        if (self.fixed_deg is None) == (self.range_deg is None):
            raise ValueError("must be free, {fixed_deg: -60} or {range_deg: [-90, 90]}, with angles of your own")
        if self.range_deg is not None and not 0 <= self.range_deg[1] - self.range_deg[0] <= 360:
            raise ValueError("range_deg needs low <= high, at most 360 apart")
        return self


class Checks(Section):
    """Clearances, margins and limits that a target has to keep."""

    clearance_mm: Distance = Field(5.0, description="least distance between the arm with its torch and everything else")
    wrist_deg: RightAngle = Field(5.0, description="least angle of A5 from the pose in which A4 and A6 are in line")
    elbow_deg: RightAngle = Field(5.0, description="least angle of the elbow from stretched or folded flat")
    shoulder_mm: Annotated[float, number_within(0, 1e4)] = Field(
        50.0, description="least distance of the wrist's centre from the axis of A1"
    )
    sigma: Annotated[float, number_within(0, 10)] = Field(
        0.02, description="least singular value of the Jacobian; only for arms without a spherical wrist"
    )
    off_bead_mm: Distance = Field(0.05, description="motions from files: largest distance of the TCP from the bead")
    off_wire_deg: Annotated[float, number_within(0, 180)] = Field(
        0.05, description="motions from files: largest angle between the wire and the direction of the target"
    )
    gravity_max_deg: Annotated[float, number_within(0, 180)] | None = Field(
        None, description="largest angle between the deposition direction and up; null: no limit"
    )
    overhang_mm: Distance | None = Field(
        None,
        description="largest overhang of a layer (of another slicer's: of a bead) over what lies below it; null: a "
        "warning above half a bead",
    )
    every_target: bool = Field(
        False,
        description="check every target of a part that cannot be built, however long it takes (`--every-target`)",
    )


class Ik(Section):
    """How configurations are searched."""

    solver: Literal["auto", "closed_form", "dls"] = Field(
        "auto", description="closed form where the arm has one, else damped least squares (dls)"
    )
    roll_step_deg: Annotated[float, number_within(0.5, 90)] = Field(
        15.0, description="step between the rolls that are tried"
    )
    seeds: Annotated[int, number_within(1, 256)] = Field(
        16, description="number of start configurations of least squares for each target"
    )


class Process(Section):
    """Speeds and moves of the deposition."""

    deposition_speed_mm_s: Speed = Field(8.0, description="speed of the TCP along a bead")
    travel_speed_mm_s: Speed = Field(
        100.0,
        description="speed limit of the TCP on a travel as long as it is within retract_mm of the end of the bead that "
        "it leaves, and once it is within retract_mm of the start of the next; between these only the axes limit it, "
        "also where it passes over beads; motions and programs from outside are not held to it",
    )
    retract_mm: Annotated[float, number_within(0.01, 1e4)] = Field(
        30.0, description="distance by which the torch draws back from a bead before it travels"
    )
    blend_mm: Annotated[float, number_within(0, 1000)] = Field(
        1.0,
        description="distance before and after a corner of a bead at which the controller rounds it (KUKA: C_DIS); "
        "below 0.01 it stops in the corner",
    )
    least_speed_share: Annotated[float, number_within(0, 1)] = Field(
        0.5, description="least share of the deposition speed over any 5 mm of a bead; a lower speed is infeasible"
    )
    dwell_s: Seconds = Field(0.0, description="wait between the layers of a sub-volume, with the torch retracted")
    arc_on_s: Seconds = Field(0.0, description="wait at the start of a bead while the arc is struck")
    arc_off_s: Seconds = Field(0.0, description="wait at the end of a bead while the crater is filled")
    travel_attempts: Annotated[int, number_within(1, 1_000_000)] = Field(
        3000, description="number of configurations tried for a travel where the direct ones are not free"
    )
    density_g_cm3: Annotated[float, number_within(0.01, 100)] = Field(7.85, description="density of the metal")
    wire_diameter_mm: Annotated[float, number_within(0.01, 100)] = Field(1.2, description="diameter of the wire")
    speed_by_thickness: list[tuple[Distance, Speed]] | None = Field(
        None,
        description="rows [thickness_mm, speed_mm_s] by growing thickness, interpolated; instead of "
        "deposition_speed_mm_s",
    )

    @field_validator("speed_by_thickness")
    @classmethod
    def _thickness_grows(cls, value: list[tuple[float, float]] | None) -> list[tuple[float, float]] | None:
        if value is not None and not value:
            raise ValueError("needs at least one row [thickness_mm, speed_mm_s]")
        if value is not None and any(a[0] >= b[0] for a, b in pairwise(value)):
            raise ValueError("thickness must grow from row to row")
        return value


class Placements(Section):
    """Grid of positions of the positioner; keys that are left out stay as in the case."""

    x_mm: Coordinates | None = Field(None, description="x in the cell's world")
    y_mm: Coordinates | None = Field(None, description="y in the cell's world")
    z_mm: Coordinates | None = Field(None, description="z in the cell's world")
    rz_deg: Angles | None = Field(None, description="rotation about the world's z axis")


class Mark(Section):
    """A table pose to point out on a map."""

    E1_deg: Angle = Field(description="tilt")
    E2_deg: Angle = Field(description="turn")
    label: Title = Field(description="name on the map")


class Sweep(Section):
    """Grid of `rbam sweep`: each value is a number, a list or a text LO:HI:STEP; options of the command win."""

    E1_deg: Angles | None = Field(None, description="tilts; left out: the axis' range in steps of 45")
    E2_deg: Angles | None = Field(None, description="turns; left out: the axis' range in steps of 45")
    roll: list[Literal["free"] | Roll] = Field(default_factory=list, description="rolls to try instead of the case's")
    positioner: Placements | None = None
    height_mm: Coordinates | None = Field(
        None, description="heights of the support; without one, heights of the part above the faceplate"
    )
    marks: list[Mark] = Field(default_factory=list, description="poses to mark on the map")


class Expect(Section):
    """Verdict that pytest expects of the case."""

    verdict: Literal["feasible", "infeasible"] = Field(description="feasible or infeasible")
    infeasible: Count | None = Field(None, description="number of infeasible targets")
    reasons: dict[str, Count] | list[str] | None = Field(
        None, description="number of targets by reason, or only the reasons"
    )

    @field_validator("reasons")
    @classmethod
    def _known(cls, value: dict[str, int] | list[str] | None) -> dict[str, int] | list[str] | None:
        unknown = set(value or ()) - set(REASONS)
        if unknown:
            raise ValueError(f"unknown reason {sorted(unknown)[0]!r}; known are {', '.join(REASONS)}")
        return value


class Case(Section):
    """A whole case: part, slicing, cell, process and checks. docs/cases.md lists the keys."""

    extends: FileName | None = Field(
        None, description="case file that this one changes; name, description and expect are not taken from it"
    )
    name: Title | None = Field(None, description="name of the case in reports")
    description: str | None = Field(None, description="a sentence for reports")
    part: Part
    support: Support | None = None
    slicing: Slicing = Slicing()
    sampling: Sampling = Sampling()
    beads: BeadsSection = BeadsSection()
    roll: Literal["free"] | Roll = "free"
    table: Table = Table()
    robot: Robot = Robot()
    tool: Torch = Torch()
    positioner: Positioner = Positioner()
    fixtures: list[Fixture] = Field(default_factory=list)
    floor: bool = Field(True, description="whether a floor lies at z = 0, which nothing may touch")
    checks: Checks = Checks()
    ik: Ik = Ik()
    process: Process = Process()
    controller: ControllerSection = ControllerSection()
    sweep: Sweep = Sweep()
    expect: Expect | None = None

    _path: Path = Path("case.yaml")
    _read_from: tuple[Path, ...] = ()

    @field_validator("positioner", mode="before")
    @classmethod
    def _short_positioner(cls, value: object) -> object:
        return {"model": NO_TABLE} if value == NO_TABLE else value

    @field_validator("part", mode="before")
    @classmethod
    def _short_part(cls, value: object) -> object:
        return {"absent": True} if value == NO_PART else value

    @field_validator("expect", mode="before")
    @classmethod
    def _short_expectation(cls, value: object) -> object:
        return {"verdict": value} if isinstance(value, str) else value

    @property
    def path(self) -> Path:
        """The file the case was read from."""
        return self._path

    @property
    def read_from(self) -> tuple[Path, ...]:
        """The case files it was read from: its own, then those it extends; empty where it was made from data."""
        return self._read_from

    @property
    def title(self) -> str:
        """The case's name, or its file's."""
        return self.name or printable(self._path.name.removesuffix(".yaml").removesuffix(".case"))

    def path_of(self, name: str) -> Path:
        """A file that the case names, relative to the case file.

        Args:
            name: as the case has it.

        Returns:
            Its path.
        """
        return self._path.parent / name
