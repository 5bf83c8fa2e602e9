"""The sections of a case file: keys, defaults, and what is allowed.

    Case.model_validate({"part": {"sub_volumes": ["blade.stl"], "body": {"radius_mm": 20}}})

Lengths in mm and angles in degrees, as every key says. Reading files and wording errors is ``cell.case.read``'s.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from slicing import BeadParameters, Meaning, SlicingParameters

from ..printable import printable
from .controller_section import ControllerSection
from .fields import (
    MOST_LIST,
    Angle,
    Angles,
    Angles3,
    AxisRate,
    ControllerFrame,
    Coordinate,
    Coordinates,
    Count,
    Distance,
    FileName,
    Length,
    Name,
    RightAngle,
    Seconds,
    Section,
    Speed,
    Title,
    Tolerance,
    Vec2,
    Vec3,
    asked,
    within,
)
from .table_section import Table as Table

NO_PART = "none"  # as part: nothing is built
NO_TABLE = "none"  # as positioner.model: the part stands still, on nothing that is modelled
REASONS = ("unreachable", "joint_limit", "singular", "collision", "no_path", "speed", "gravity", "overhang")


class BodySection(Section):
    """The central body the sub-volumes stand on, its axis along the part's z: a cylinder, a cone or a profile."""

    radius_mm: Coordinate | None = Field(None, description="radius of the cylinder, or of the cone at z = 0")
    half_angle_deg: Annotated[float, within(-89, 89)] | None = Field(
        None, description="angle between the cone's axis and its side; above 0 it widens upwards"
    )
    profile_mm: Annotated[list[Vec2], Field(max_length=MOST_LIST)] | None = Field(
        None, description="(r, z) points of a turned body; instead of radius_mm"
    )
    axis_xy_mm: Vec2 = Field((0.0, 0.0), description="x and y of the axis in the part's frame")
    z_mm: Vec2 | None = Field(None, description="lower and upper end of the cylinder or cone along the part's z axis")
    mesh: FileName | None = Field(
        None, description="mesh of the body's own shape; left out: the cylinder, cone or profile itself"
    )

    @field_validator("z_mm")
    @classmethod
    def _ends_in_order(cls, value: Vec2 | None) -> Vec2 | None:
        if value is not None and value[0] >= value[1]:
            raise ValueError("the lower end must be below the upper end")
        return value

    @model_validator(mode="after")
    def _one_shape(self) -> BodySection:
        if (self.radius_mm is None) == (self.profile_mm is None):
            raise ValueError("needs either radius_mm (with half_angle_deg for a cone) or profile_mm")
        if self.profile_mm is not None and (self.half_angle_deg is not None or self.z_mm is not None):
            raise ValueError("profile_mm gives the whole shape; leave half_angle_deg and z_mm out")
        if self.half_angle_deg is None and self.radius_mm is not None and self.radius_mm <= 0:
            raise ValueError(f"radius_mm must be above 0, not {self.radius_mm:g}")
        return self


class Part(Section):
    """The part: its sub-volumes, its body, and where it stands on the table.

    `part: none` is short for `{absent: true}`: nothing is built, and programs are checked against the cell alone.
    """

    absent: bool = Field(
        False, description="true: nothing is built, the cell stands alone (for `rbam check --program`)"
    )
    mesh: FileName | None = Field(None, description="mesh of the whole part: body and sub-volumes are found in it; or")
    toolpath: FileName | None = Field(
        None,
        description="beads of another slicer on part.body: a table of targets (docs/formats.md), instead of meshes "
        "to slice",
    )
    toolpath_normal: Literal["up", "radial"] | None = Field(
        None,
        description="deposition direction where the toolpath has none: up (the part's z) or radial (away from that "
        "axis)",
    )
    toolpath_metal: Literal["above", "below"] = Field(
        "above",
        description="whether a bead's metal lies above its targets (these lie on the layer below) or below them "
        "(they lie on the bead's top)",
    )
    sub_volumes: list[FileName] = Field(
        default_factory=list, description="closed meshes, one for each sub-volume; they stand on part.body"
    )
    take: list[Name] = Field(
        default_factory=list,
        description="names of the sub-volumes to build (SV1, ..; BODY: only the body); empty: all",
    )
    built: list[str] = Field(
        default_factory=list,
        description="names of the sub-volumes that are built already; they stand in the cell from the start",
    )
    body: BodySection | None = Field(None, description="the round body that the sub-volumes stand on")
    units: Literal["mm", "cm", "m", "inch"] = Field("mm", description="unit of the part's meshes")
    position_mm: Vec3 = Field(
        (0.0, 0.0, 0.0), description="position of the part's frame on the support, or on the faceplate without one"
    )
    rotation_deg: Angle = Field(0.0, description="turn of the part about the table's normal")


class Support(Section):
    """A cylinder between the faceplate and the part."""

    radius_mm: Length = Field(description="radius of the cylinder")
    height_mm: Length = Field(description="height of the part above the faceplate")


@asked
class Slicing(SlicingParameters):
    """How the layers are cut.

    Its other keys are stated in ``slicing.parameters``.
    """

    body: Annotated[
        Literal["planar"] | None,
        Meaning("planar: the body is printed as well, as the first sub-volume BODY, in planar layers across its axis"),
    ] = None


class Sampling(Section):
    """How the layers' curves become targets."""

    chord_tolerance_mm: Tolerance = Field(
        0.3, description="largest distance between the bead and the straight line from target to target"
    )
    min_segment_mm: Annotated[float, within(0.01, 1e5)] = Field(
        3.0, description="least distance between two targets of a bead"
    )


@asked
class BeadsSection(BeadParameters):
    """Which beads a layer is laid in, where they start, and in which order.

    Its keys, overlap and seam and all others, are stated in ``slicing.parameters``.
    """


class Roll(Section):
    """Angles allowed about the wire."""

    fixed_deg: Angle | None = Field(None, description="one angle; or")
    range_deg: tuple[Angle, Angle] | None = Field(
        None, description="lowest and highest angle; every angle between them is allowed"
    )

    @model_validator(mode="after")
    def _one_of(self) -> Roll:
        if (self.fixed_deg is None) == (self.range_deg is None):
            raise ValueError("must be free, {fixed_deg: ..} or {range_deg: [low, high]}")
        if self.range_deg is not None and not 0 <= self.range_deg[1] - self.range_deg[0] <= 360:
            raise ValueError("range_deg needs low <= high, at most 360 apart")
        return self


class Robot(Section):
    """The arm: a shipped model's name or an MJCF file, where it stands, and what its joints are called."""

    model: FileName = Field("kr70_r2100", description="name of a shipped model, or an MJCF file")
    position_mm: Vec3 = Field((0.0, 0.0, 0.0), description="position of its base in the cell's world")
    rotation_deg: Angles3 = Field(
        (0.0, 0.0, 0.0), description="rotation of its base about x, y, z of the world, in this order"
    )
    joints: Annotated[list[Name], Field(min_length=1, max_length=50)] = Field(
        ["A1", "A2", "A3", "A4", "A5", "A6"],
        description="names of the joints from the base to the flange: six or seven hinges with ranges",
    )
    held_deg: dict[str, Angle] = Field(
        default_factory=dict,
        description="angles of the model's other hinges; left out: as in its key home, else at zero",
    )
    held_mm: dict[str, Coordinate] = Field(
        default_factory=dict, description="positions of the model's slides (a track, a lift); left out: likewise"
    )
    flange: Name = Field("flange", description="site that the tool is mounted on")
    base: Name = Field("base_link", description="body whose frame the report's base_* values are given in")
    home_deg: list[Angle] | None = Field(
        None, description="joint angles where a motion starts and ends; left out: the MJCF's key home, if it has one"
    )
    max_speed_deg_s: list[AxisRate] | None = Field(
        None, description="largest speed of each joint; needed where the MJCF does not have them"
    )
    max_acceleration_deg_s2: list[AxisRate] | None = Field(
        None, description="largest acceleration of each joint; left out: the MJCF's, else full speed in half a second"
    )


class Torch(Section):
    """The tool: a shipped model's name or an MJCF file; for cmt_torch its dimensions."""

    model: FileName = Field("cmt_torch", description="name of a shipped model, or an MJCF file")
    tcp: Name = Field("tcp", description="site at the end of the wire, its z in the direction of wire feed")
    wire: list[Name] = Field(["torch_wire"], description="geoms of the wire; only they may touch the part")
    dimensions: dict[str, Coordinate] = Field(
        default_factory=dict, description="dimensions of cmt_torch, see its README"
    )
    held_deg: dict[str, Angle] = Field(
        default_factory=dict, description="angles of the tool's hinges, see robot.held_deg"
    )
    held_mm: dict[str, Coordinate] = Field(
        default_factory=dict, description="positions of the tool's slides, see robot.held_mm"
    )


class Calibration(Section):
    """The positioner as it was measured: the controller's frames, each [X, Y, Z, A, B, C] in mm and deg.

    Each axis turns about the z of its frame: root, axis 1, E1, axis 2, E2, flange.
    """

    root_mm_deg: ControllerFrame = Field(
        description="frame of the positioner's root in the cell's world; KUKA: MACHINE_DEF[n].ROOT"
    )
    axis_1_mm_deg: ControllerFrame = Field(
        (0.0,) * 6, description="frame of the first axis in the root; KUKA: $ET1_TA1KR"
    )
    axis_2_mm_deg: ControllerFrame | None = Field(
        None, description="frame of the second axis in the first at E1 = 0; KUKA: $ET1_TA2A1"
    )
    flange_mm_deg: ControllerFrame | None = Field(
        None, description="frame of the table in the last axis; KUKA: $ET1_TFLA3; left out: the model's"
    )


class Positioner(Section):
    """The table: a shipped model's name or an MJCF file, where it stands, and what its joints are called.

    `positioner: none` is short for `{model: none}`: the part stands still, its frame at position_mm.
    """

    model: FileName = Field(
        "kp2_hv500", description="name of a shipped model, or an MJCF file; none: the part stands still"
    )
    position_mm: Vec3 = Field((1500.0, 0.0, 0.0), description="position of its base in the cell's world")
    rotation_deg: Angles3 = Field(
        (0.0, 0.0, 0.0), description="rotation of its base about x, y, z of the world, in this order"
    )
    joints: Annotated[list[Name], Field(max_length=2)] = Field(
        ["E1", "E2"],
        description="names of the joints, tilt first, then turn; one name for a single axis, [] for a fixed table; a "
        "hinge without range is endless",
    )
    table: Name = Field("table", description="site on the faceplate, its z along the faceplate's normal")
    calibration: Calibration | None = Field(
        None, description="measured frames of the axes and the table; left out: those of the model"
    )
    held_deg: dict[str, Angle] = Field(
        default_factory=dict, description="angles of the model's other hinges, see robot.held_deg"
    )
    held_mm: dict[str, Coordinate] = Field(
        default_factory=dict, description="positions of the model's slides, see robot.held_mm"
    )
    max_speed_deg_s: list[AxisRate] | None = Field(
        None,
        description="largest speed of each of joints; left out: the MJCF's; without either there is no limit",
    )
    max_acceleration_deg_s2: list[AxisRate] | None = Field(
        None,
        description="largest acceleration of each of joints; left out: the MJCF's, else full speed in half a second",
    )

    @model_validator(mode="before")
    @classmethod
    def _none_has_no_joints(cls, value: object) -> object:
        if isinstance(value, dict) and value.get("model") == NO_TABLE:
            return {"joints": [], **value}
        return value

    @model_validator(mode="after")
    def _joints_of_none(self) -> Positioner:
        if self.model == NO_TABLE and self.joints:
            raise ValueError("with model: none leave joints out")
        if len(set(self.joints)) < len(self.joints):
            raise ValueError(
                f"joints: {self.joints[0]} is listed twice; the second {self.joints[0]} does not turn the table"
            )
        return self


class Box(Section):
    """A box fixture."""

    size_mm: tuple[Length, Length, Length] = Field(description="lengths along x, y, z")


class CylinderFixture(Section):
    """An upright cylinder fixture."""

    radius_mm: Length = Field(description="radius of the cylinder")
    height_mm: Length = Field(description="height along z")


class Fixture(Section):
    """Something that stands in the cell: one of box, cylinder or mesh."""

    name: Name = Field(description="name in reports")
    box: Box | None = None
    cylinder: CylinderFixture | None = None
    mesh: FileName | None = Field(None, description="file of a closed mesh")
    units: Literal["mm", "cm", "m", "inch"] = Field("mm", description="unit of the mesh")
    position_mm: Vec3 = Field((0.0, 0.0, 0.0), description="position of its centre (of a mesh: of the mesh's origin)")
    rotation_deg: Angles3 = Field((0.0, 0.0, 0.0), description="rotation about x, y, z, in this order")
    on: Literal["floor", "table"] = Field(
        "floor", description="what it stands on: position and rotation are given in that frame, and it moves with it"
    )

    @model_validator(mode="after")
    def _one_shape(self) -> Fixture:
        if sum(shape is not None for shape in (self.box, self.cylinder, self.mesh)) != 1:
            raise ValueError("needs exactly one of box, cylinder, mesh")
        return self


class Checks(Section):
    """Clearances, margins and limits that a target has to keep."""

    clearance_mm: Distance = Field(5.0, description="least distance between the arm with its torch and everything else")
    wrist_deg: RightAngle = Field(5.0, description="least angle of A5 from the pose in which A4 and A6 are in line")
    elbow_deg: RightAngle = Field(5.0, description="least angle of the elbow from stretched or folded flat")
    shoulder_mm: Annotated[float, within(0, 1e4)] = Field(
        50.0, description="least distance of the wrist's centre from the axis of A1"
    )
    sigma: Annotated[float, within(0, 10)] = Field(
        0.02, description="least singular value of the Jacobian; only for arms without a spherical wrist"
    )
    off_bead_mm: Distance = Field(0.05, description="motions from files: largest distance of the TCP from the bead")
    off_wire_deg: Annotated[float, within(0, 180)] = Field(
        0.05, description="motions from files: largest angle of the wire to its direction"
    )
    gravity_max_deg: Annotated[float, within(0, 180)] | None = Field(
        None, description="largest angle between the deposition direction and up; null: no limit"
    )
    overhang_mm: Distance | None = Field(
        None, description="largest overhang of a layer over what lies below it; null: a warning above half a bead"
    )
    every_target: bool = Field(
        False,
        description="check every target of a part that cannot be built, however long that takes (`rbam check --all`)",
    )


class Ik(Section):
    """How configurations are searched."""

    solver: Literal["auto", "closed_form", "dls"] = Field(
        "auto", description="closed form where the arm has one, else damped least squares (dls)"
    )
    roll_step_deg: Annotated[float, within(0.5, 90)] = Field(15.0, description="step between the rolls that are tried")
    seeds: Annotated[int, within(1, 256)] = Field(
        16, description="number of start configurations of least squares for each target"
    )


class Process(Section):
    """Speeds and moves of the deposition."""

    deposition_speed_mm_s: Speed = Field(8.0, description="speed of the TCP along a bead")
    travel_speed_mm_s: Speed = Field(100.0, description="speed of the TCP while it leaves and approaches the part")
    retract_mm: Annotated[float, within(0.01, 1e4)] = Field(
        30.0, description="distance by which the torch draws back from a bead before it travels"
    )
    blend_mm: Annotated[float, within(0, 1000)] = Field(
        1.0,
        description="distance before and after a corner of a bead at which the controller rounds it (KUKA: C_DIS); "
        "below 0.01 it stops in the corner",
    )
    least_speed_share: Annotated[float, within(0, 1)] = Field(
        0.5, description="least share of the deposition speed over any 5 mm of a bead; a lower speed is infeasible"
    )
    dwell_s: Seconds = Field(0.0, description="wait between the layers of a sub-volume, with the torch retracted")
    arc_on_s: Seconds = Field(0.0, description="wait at the start of a bead while the arc is struck")
    arc_off_s: Seconds = Field(0.0, description="wait at the end of a bead while the crater is filled")
    travel_attempts: Annotated[int, within(1, 1_000_000)] = Field(
        3000, description="number of configurations tried for a travel where the direct ones are not free"
    )
    density_g_cm3: Annotated[float, within(0.01, 100)] = Field(7.85, description="density of the metal")
    wire_diameter_mm: Annotated[float, within(0.01, 100)] = Field(1.2, description="diameter of the wire")
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
        """A file that the case names, relative to the case file."""
        return self._path.parent / name
