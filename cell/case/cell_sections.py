"""The sections of a case file about the cell: arm, tool, positioner and fixtures.

    Fixture.model_validate({"name": "clamp", "box": {"size_mm": [80, 40, 20]}})

Lengths in mm and angles in degrees, as every key says.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from slicing import LengthUnit

from .fields import (
    Angle,
    Angles3,
    AxisRate,
    ControllerFrame,
    Coordinate,
    FileName,
    Length,
    Name,
    Section,
    Vec3,
)

NO_TABLE = "none"  # as positioner.model: the part stands still, on nothing that is modelled


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
        default_factory=dict,
        description="positions of the model's slides (a track, a lift), such as {RAIL: 500}; left out: likewise",
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
    """The positioner: a shipped model's name or an MJCF file, where it stands, and what its joints are called.

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
    mesh: FileName | None = Field(None, description="file of closed meshes: STL, OBJ, PLY, OFF, GLB or 3MF")
    units: LengthUnit = Field("mm", description="unit of the mesh")
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
