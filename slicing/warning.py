"""Warnings that a program can tell apart: a code beside the text.

    told = Warning(Code.LAYER_AREA, "SV1, layer 3: its area is 4 % too small", sub_volume="SV1", layer=3)
    told.code, told.sub_volume, told.layer, str(told)

A warning is its text, so it prints, joins and sorts like any other line.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Any, Self


class Code(StrEnum):
    """What a warning is about. In alphabetical order."""

    BEAD_OVER_ITSELF = "bead_over_itself"
    BEAD_SPLIT = "bead_split"
    BEAD_SUNK = "bead_sunk"
    BEAD_THICKNESS = "bead_thickness"
    BODY_AXIS = "body_axis"
    BODY_COLLAR = "body_collar"
    BODY_END = "body_end"
    BODY_POLYGON = "body_polygon"
    BODY_RADIUS = "body_radius"
    BODY_RIVAL = "body_rival"
    BODY_SMALL = "body_small"
    BODY_STEP = "body_step"
    BODY_UNLIKE = "body_unlike"
    BODY_VOLUME = "body_volume"
    CALIBRATION_FAR = "calibration_far"
    CONCAVE_BODY = "concave_body"
    CONCAVE_FIXTURE = "concave_fixture"
    DEPOSIT_SHARE = "deposit_share"
    FIXTURE_SMALL = "fixture_small"
    FIXTURE_SUNK = "fixture_sunk"
    FLOATING_PIECE = "floating_piece"
    HOME_UNKNOWN = "home_unknown"
    JOINT_HELD = "joint_held"
    LAYER_AREA = "layer_area"
    LAYER_LENGTH = "layer_length"
    LAYER_LOOPS = "layer_loops"
    LAYER_SEAM = "layer_seam"
    LAYER_VOLUME = "layer_volume"
    LEFT_ON_ENDS = "left_on_ends"
    LINK_WITHOUT_SHAPES = "link_without_shapes"
    MARGINS_APPROXIMATE = "margins_approximate"
    MARGINS_NOT_COUNTED = "margins_not_counted"
    MESH_FILE = "mesh_file"
    MESH_REPAIRED = "mesh_repaired"
    MESH_UNITS = "mesh_units"
    MODEL_ELEMENT_LEFT_OUT = "model_element_left_out"
    OTHER = "other"
    OVERHANG = "overhang"
    PAIR_LEFT_OUT = "pair_left_out"
    PART_ABSENT = "part_absent"
    PART_NOT_ON_SUPPORT = "part_not_on_support"
    PAST_HORIZONTAL = "past_horizontal"
    POLYGON_NOT_FLAT = "polygon_not_flat"
    PROGRAM_BEAD_CUT = "program_bead_cut"
    PROGRAM_CUT = "program_cut"
    PROGRAM_DENSE = "program_dense"
    PROGRAM_DOUBT = "program_doubt"
    PROGRAM_FRAME = "program_frame"
    PROGRAM_MEMORY = "program_memory"
    PROGRAM_PASSED_OVER = "program_passed_over"
    PROGRAM_TABLE = "program_table"
    SHORT_RETRACT = "short_retract"
    SLIVERS = "slivers"
    SUB_VOLUME_ABSENT = "sub_volume_absent"
    TABLE_WITHOUT_SHAPE = "table_without_shape"
    TOOLPATH_COLUMNS = "toolpath_columns"
    TOOLPATH_KEYS = "toolpath_keys"
    TOOLPATH_NOT_SLICED = "toolpath_not_sliced"
    WIRE_SHAPE = "wire_shape"


WRONG_LAYER = frozenset(
    {Code.LAYER_AREA, Code.LAYER_LENGTH, Code.LAYER_LOOPS}
)  # what makes a layer unfit for a verdict


class Warning(str):
    """One line of text with what it is about.

    Attributes:
        code: what it is about.
        sub_volume: the sub-volume it is about; empty where it is about the whole part or the cell.
        layer: the layer it is about; None where it is about no single one.
    """

    code: Code
    sub_volume: str
    layer: int | None

    def __new__(cls, code: Code, text: str, *, sub_volume: str = "", layer: int | None = None) -> Self:
        """Make a warning.

        Args:
            code: what it is about.
            text: one line: what was found, what follows from it, and the key to set if there is one.
            sub_volume: the sub-volume it is about.
            layer: the layer it is about.
        """
        made = super().__new__(cls, text)
        made.code, made.sub_volume, made.layer = Code(code), sub_volume, layer
        return made

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle with the code."""
        return _again, (str(self.code), str(self), self.sub_volume, self.layer)

    def document(self) -> dict[str, Any]:
        """As it stands in a JSON document."""
        return {"code": str(self.code), "sub_volume": self.sub_volume, "layer": self.layer, "text": str(self)}


def _again(code: str, text: str, sub_volume: str, layer: int | None) -> Warning:
    return Warning(Code(code), text, sub_volume=sub_volume, layer=layer)


def typed(line: str) -> Warning:
    """A line as a typed warning; a line without a code gets the code ``other``.

    Args:
        line: a warning, or a line of text.
    """
    return line if isinstance(line, Warning) else Warning(Code.OTHER, line)
