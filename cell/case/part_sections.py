"""The sections of a case file about the part: its meshes and body, what it stands on, layers, targets and beads.

    Part.model_validate({"sub_volumes": ["blade.stl"], "body": {"radius_mm": 20}})

The keys of `slicing` and `beads` are stated in ``slicing.parameters``.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from slicing import BeadParameters, LengthUnit, Meaning, SlicingParameters

from .fields import (
    LEAST_SIZE_MM,
    MOST_LIST,
    Angle,
    Coordinate,
    FileName,
    Length,
    Name,
    Section,
    Tolerance,
    Vec2,
    Vec3,
    asked,
    number_within,
)

NO_PART = "none"  # as part: nothing is built


class BodySection(Section):
    """The central body the sub-volumes stand on, its axis along the part's z: a cylinder, a cone or a profile."""

    radius_mm: Coordinate | None = Field(None, description="radius of the cylinder, or of the cone at z = 0")
    half_angle_deg: Annotated[float, number_within(-89, 89)] | None = Field(
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
        False,
        description="true, or `part: none`: nothing is built, the cell stands alone (for `rbam check --program`)",
    )
    mesh: FileName | None = Field(None, description="mesh of the whole part: body and sub-volumes are found in it")
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
    units: LengthUnit = Field("mm", description="unit of the part's meshes")
    position_mm: Vec3 = Field(
        (0.0, 0.0, 0.0), description="position of the part's frame on the support, or on the faceplate without one"
    )
    rotation_deg: Angle = Field(0.0, description="turn of the part about the table's normal")


class Support(Section):
    """A cylinder between the faceplate and the part."""

    radius_mm: Length = Field(description="radius of the cylinder")
    height_mm: Length = Field(description="height of the part above the faceplate")

    @model_validator(mode="after")
    def _in_mm(self) -> Support:
        largest = max(2 * self.radius_mm, self.height_mm)
        if largest < LEAST_SIZE_MM:
            raise ValueError(f"is at most {largest:g} mm large; lengths are in mm, not in m")
        return self


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
    min_segment_mm: Annotated[float, number_within(0.01, 1e5)] = Field(
        3.0, description="least distance between two targets of a bead"
    )


@asked
class BeadsSection(BeadParameters):
    """Which beads a layer is laid in, where they start, and in which order.

    Its keys, overlap and seam and all others, are stated in ``slicing.parameters``.
    """
