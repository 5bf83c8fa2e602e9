"""The case's section ``table``: where the positioner stands, for the whole run, group by group, or along the beads.

table: {E1_deg: 90, E2_deg: 180}
table: {mode: indexed, poses: [{sub_volume: SV1, layers: [0, 20], E1_deg: 90, E2_deg: 180}, ..]}
table: {mode: coordinated, axes: [E1, E2], upright_deg: 10}
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from .fields import MOST_LIST, Angle, LayerNumber, Name, Section, within


class TablePoseSection(Section):
    """The pose for a sub-volume, or for a run of its layers."""

    sub_volume: Name = Field(description="whose layers")
    layers: tuple[LayerNumber, LayerNumber] | None = Field(None, description="first and last; all where left out")
    E1_deg: Angle = Field(0.0, description="tilt")
    E2_deg: Angle = Field(0.0, description="turn")

    @model_validator(mode="after")
    def _first_before_last(self) -> TablePoseSection:
        if self.layers is not None and self.layers[0] > self.layers[1]:
            raise ValueError("layers needs first <= last")
        return self


class Table(Section):
    """Angles of the positioner, and whether they change."""

    mode: Literal["fixed", "indexed", "coordinated", "best"] = Field(
        "fixed",
        description="fixed: one pose for the whole run; indexed: one for each sub-volume or run of layers; "
        "coordinated: the table moves along the beads; best: one for the whole run, which is searched",
    )
    E1_deg: Angle = Field(0.0, description="tilt; with fixed, and where a coordinated axis is not among axes")
    E2_deg: Angle = Field(0.0, description="turn; likewise")
    poses: Annotated[list[TablePoseSection], Field(max_length=MOST_LIST)] = Field(
        default_factory=list,
        description="of indexed, in the order in which they are built; every layer once; searched where left out",
    )
    axes: Annotated[list[Literal["E1", "E2"]], Field(min_length=1, max_length=2)] | None = Field(
        None, description="of coordinated: which axes move; all that the positioner has where left out"
    )
    upright_deg: Annotated[float, within(0, 180)] | None = Field(
        None, description="of coordinated: how far off up the deposition direction may be; 10 where left out"
    )

    @model_validator(mode="after")
    def _keys_of_mode(self) -> Table:
        if self.poses and self.mode != "indexed":
            raise ValueError(f"poses go with mode: indexed, not with {self.mode}")
        for key in ("axes", "upright_deg"):
            if getattr(self, key) is not None and self.mode != "coordinated":
                raise ValueError(f"{key} goes with mode: coordinated, not with {self.mode}")
        if self.axes is not None and len(set(self.axes)) < len(self.axes):
            raise ValueError(f"axes: {self.axes[0]} is listed twice")
        given = {"E1_deg", "E2_deg"} & self.model_fields_set
        if given and self.mode in ("indexed", "best"):
            raise ValueError(f"mode: {self.mode} has poses of its own; {sorted(given)[0]} does not go with it")
        return self
