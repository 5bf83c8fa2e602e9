"""The case's section ``table``: where the positioner stands, for the whole run, group by group, or along the beads.

table: {E1_deg: 90, E2_deg: 180}
table: {mode: indexed, poses: [{sub_volume: SV1, layers: [0, 20], E1_deg: 90, E2_deg: 180}, ..]}
table: {mode: coordinated, axes: [E1, E2], upright_deg: 10}
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from .fields import MOST_LIST, Angle, LayerNumber, Name, Section, number_within


class TablePoseSection(Section):
    """The pose for a sub-volume, or for a run of its layers."""

    sub_volume: Name = Field(description="sub-volume that the pose is for")
    layers: tuple[LayerNumber, LayerNumber] | None = Field(
        None, description="first and last layer; left out: all of them"
    )
    E1_deg: Angle = Field(0.0, description="tilt")
    E2_deg: Angle = Field(0.0, description="turn")

    @model_validator(mode="after")
    def _first_before_last(self) -> TablePoseSection:
        if self.layers is not None and self.layers[0] > self.layers[1]:
            raise ValueError("layers needs first <= last")
        return self


class Table(Section):
    """Angles of the positioner, and how they change during the run."""

    mode: Literal["fixed", "indexed", "coordinated", "best"] = Field(
        "fixed",
        description="fixed: one pose for the whole part; indexed: one pose for each sub-volume or run of layers; "
        "coordinated: the table moves along the beads; best: one pose for the whole part, which is searched",
    )
    E1_deg: Angle = Field(0.0, description="tilt; of mode fixed, and of coordinated where E1 is not among axes")
    E2_deg: Angle = Field(0.0, description="turn; of mode fixed, and of coordinated where E2 is not among axes")
    poses: Annotated[list[TablePoseSection], Field(max_length=MOST_LIST)] = Field(
        default_factory=list,
        description="of mode indexed: poses in the order in which the layers are built, every layer once; left out: "
        "they are searched",
    )
    axes: Annotated[list[Literal["E1", "E2"]], Field(min_length=1, max_length=2)] | None = Field(
        None, description="of mode coordinated: axes that move; left out: all axes of the positioner"
    )
    upright_deg: Annotated[float, number_within(0, 180)] | None = Field(
        None, description="of mode coordinated: largest angle between the deposition direction and up; left out: 10"
    )

    @model_validator(mode="after")
    def _keys_of_mode(self) -> Table:
        if self.poses and self.mode != "indexed":
            raise ValueError(f"poses need mode: indexed, not {self.mode}")
        for key in ("axes", "upright_deg"):
            if getattr(self, key) is not None and self.mode != "coordinated":
                raise ValueError(f"{key} needs mode: coordinated, not {self.mode}")
        if self.axes is not None and len(set(self.axes)) < len(self.axes):
            raise ValueError(f"axes: {self.axes[0]} is listed twice")
        given = {"E1_deg", "E2_deg"} & self.model_fields_set
        if given and self.mode in ("indexed", "best"):
            raise ValueError(f"mode: {self.mode} has poses of its own; leave {sorted(given)[0]} out")
        return self
