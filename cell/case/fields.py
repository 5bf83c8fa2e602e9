"""What the sections of a case file are made of: their base class and the kinds of their values.

    Support.model_validate({"radius_mm": -1})        # refused: class Support(Section) has radius_mm: Length

Every number has its range: wide enough for any cell, too narrow for what only a slip gives, and for what no computation
gets through with.
"""

from __future__ import annotations

import dataclasses
from dataclasses import is_dataclass
from typing import Annotated, Any, get_type_hints

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field
from pydantic.dataclasses import dataclass
from pydantic.fields import FieldInfo

from slicing import Meaning

from .number_lists import values_of

MOST_NAME, MOST_PATH, MOST_LIST = 200, 4096, 10_000


def number_within(low: float, high: float) -> Any:
    """What a number of a case has to lie within, both ends allowed."""
    return Field(ge=low, le=high)


Coordinate = Annotated[float, number_within(-1e5, 1e5)]  # mm; 100 m
LARGEST_ANGLE_DEG = 3600
Angle = Annotated[float, number_within(-LARGEST_ANGLE_DEG, LARGEST_ANGLE_DEG)]  # deg
Length = Annotated[float, number_within(0.001, 1e5)]  # mm, of something that is there
LEAST_SIZE_MM = 1.0  # of what stands in the cell: anything smaller was likely given in metres
LayerHeight = Annotated[float, number_within(0.01, 1000)]  # mm
BeadWidth = Annotated[float, number_within(0.05, 1000)]  # mm
Distance = Annotated[float, number_within(0, 1000)]  # mm
Tolerance = Annotated[float, number_within(1e-4, 100)]  # mm
Speed = Annotated[float, number_within(0.01, 1e5)]  # mm/s
AxisRate = Annotated[float, number_within(0.001, 1e6)]  # deg/s, deg/s2
LayerNumber = Annotated[int, number_within(0, 1_000_000)]
Count = Annotated[int, number_within(0, 1_000_000_000)]
Seconds = Annotated[float, number_within(0, 86_400)]
RightAngle = Annotated[float, number_within(0, 90)]  # an angle from a line: more than 90 would exclude everything
Vec2 = tuple[Coordinate, Coordinate]
Vec3 = tuple[Coordinate, Coordinate, Coordinate]
Angles3 = tuple[Angle, Angle, Angle]
ControllerFrame = tuple[Coordinate, Coordinate, Coordinate, Angle, Angle, Angle]  # X Y Z A B C


def _no_control(text: str) -> str:
    """Refuse characters that no name has and that some readers take for its end."""
    if any(ord(c) < 32 or ord(c) == 127 for c in text):
        raise ValueError("must be without control characters")
    return text


def _path_pieces(text: str) -> str:
    if any(len(piece.encode("utf-8", "replace")) > 255 for piece in text.split("/")):
        raise ValueError("must be the name of a file with at most 255 bytes between slashes")
    return text


Name = Annotated[str, Field(min_length=1, max_length=MOST_NAME), AfterValidator(_no_control)]
Title = Annotated[str, Field(max_length=MOST_NAME), AfterValidator(_no_control)]
FileName = Annotated[
    str, Field(min_length=1, max_length=MOST_PATH), AfterValidator(_no_control), AfterValidator(_path_pieces)
]


def _values(kind: Any) -> Any:
    return Annotated[list[kind], BeforeValidator(values_of)]


Coordinates = _values(Coordinate)  # 5, "LO:HI:STEP" or a list of them
Angles = _values(Angle)


# the sections are built when the case is first read: all in one then, not each by itself before
_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False, defer_build=True)


class Section(BaseModel):
    """A section of a case file: unknown keys and NaN are errors."""

    model_config = ConfigDict(**_STRICT, frozen=True)


# the same for a section whose keys are the fields of a dataclass of `slicing.parameters`
asked = dataclass(frozen=True, config=_STRICT)


def is_section(annotation: Any) -> bool:
    """Whether an annotation is a section: one of the models, or a dataclass."""
    return isinstance(annotation, type) and (issubclass(annotation, BaseModel) or is_dataclass(annotation))


def keys_of(section: Any) -> dict[str, FieldInfo]:
    """The keys of a section, in their order, with their descriptions."""
    if issubclass(section, BaseModel):
        return section.model_fields
    hints = get_type_hints(section, include_extras=True)
    named = [field for field in dataclasses.fields(section) if field.init]
    return {field.name: FieldInfo.from_annotated_attribute(hints[field.name], field.default) for field in named}


def description_of(field: FieldInfo) -> str:
    """The description of a key; empty where it has none."""
    return field.description or next((one.text for one in field.metadata if isinstance(one, Meaning)), "")
