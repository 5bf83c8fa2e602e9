"""The entries of a case's ``beads.seams``: where some closed beads start, whatever all others do.

seams: [{sub_volume: SV2, layers: [3, 7], angle_deg: 120}]
"""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from .fields import Angle, Name, Section, Vec3, within

LayerNumber = Annotated[int, within(0, 1_000_000)]


class SeamSection(Section):
    """A place for the seams of some closed beads; the last entry that fits a bead goes."""

    sub_volume: Name | None = Field(None, description="whose beads; all sub-volumes' where left out")
    layers: tuple[LayerNumber, LayerNumber] | None = Field(None, description="first and last; all where left out")
    angle_deg: Angle | None = Field(None, description="angle about the body's axis, or")
    xyz_mm: Vec3 | None = Field(None, description="a point of the part")

    @model_validator(mode="after")
    def _one_place(self) -> SeamSection:
        if (self.angle_deg is None) == (self.xyz_mm is None):
            raise ValueError("needs one of angle_deg, xyz_mm")
        if self.layers is not None and self.layers[0] > self.layers[1]:
            raise ValueError("layers needs first <= last")
        return self
