"""What the sections of a case file are made of: their base class and the kinds of their values.

Support.model_validate({"radius_mm": -1})        # refused: class Support(Section) has radius_mm: Positive
"""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from .ranges import values_of

Vec2 = tuple[float, float]
Vec3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Values = Annotated[list[float], BeforeValidator(values_of)]  # 5, "LO:HI:STEP" or a list of them
RightAngle = Annotated[float, Field(ge=0, le=90)]  # an angle from a line: more than 90 would exclude everything


class Section(BaseModel):
    """A section of a case file: unknown keys and NaN are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
