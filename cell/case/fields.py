"""What the sections of a case file are made of: their base class and the kinds of their values.

    Support.model_validate({"radius_mm": -1})        # refused: class Support(Section) has radius_mm: Length

Every number has its range: wide enough for any cell, too narrow for what only a slip gives, and for what no computation
gets through with.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from .number_lists import values_of

MOST_NAME, MOST_PATH, MOST_LIST = 200, 4096, 10_000


def within(low: float, high: float) -> Any:
    """What a number of a case has to lie within, both ends allowed."""
    return Field(ge=low, le=high)


Coordinate = Annotated[float, within(-1e5, 1e5)]  # mm; 100 m
Angle = Annotated[float, within(-3600, 3600)]  # deg
Length = Annotated[float, within(0.001, 1e5)]  # mm, of something that is there
LayerHeight = Annotated[float, within(0.01, 1000)]  # mm
BeadWidth = Annotated[float, within(0.05, 1000)]  # mm
Distance = Annotated[float, within(0, 1000)]  # mm
Tolerance = Annotated[float, within(1e-4, 100)]  # mm
Speed = Annotated[float, within(0.01, 1e5)]  # mm/s
AxisRate = Annotated[float, within(0.001, 1e6)]  # deg/s, deg/s2
Count = Annotated[int, within(0, 1_000_000_000)]
Seconds = Annotated[float, within(0, 86_400)]
RightAngle = Annotated[float, within(0, 90)]  # an angle from a line: more than 90 would exclude everything
Vec2 = tuple[Coordinate, Coordinate]
Vec3 = tuple[Coordinate, Coordinate, Coordinate]
Angles3 = tuple[Angle, Angle, Angle]
ControllerFrame = tuple[Coordinate, Coordinate, Coordinate, Angle, Angle, Angle]  # X Y Z A B C


def _no_control(text: str) -> str:
    """Refuse characters that no name has and that some readers take for its end."""
    if any(ord(c) < 32 or ord(c) == 127 for c in text):
        raise ValueError("is a name without control characters")
    return text


def _path_pieces(text: str) -> str:
    if any(len(piece.encode("utf-8", "replace")) > 255 for piece in text.split("/")):
        raise ValueError("is the name of a file, at most 255 bytes between slashes")
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


class Section(BaseModel):
    """A section of a case file: unknown keys and NaN are errors."""

    # the sections are built when the case is first read: all in one then, not each by itself before
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)
