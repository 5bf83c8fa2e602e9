"""What a section of a case says of a model's joints that are not planned.

own = OwnPlaces("robot", "arm.xml", "blade.case.yaml", held_mm={"RAIL": 500})
own.held_mm, own.error(".model: ..")     # their places; an error that names the case file and the section
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from ..errors import InputError


@dataclass(frozen=True)
class OwnPlaces:
    """What a section of a case says of the joints that are not planned.

    Attributes:
        section: "robot", "tool" or "positioner".
        model: the section's model, for messages.
        where: the case file, for messages.
        held_deg: places of hinges by name, deg.
        held_mm: places of slides by name, mm.
    """

    section: str
    model: str
    where: str
    held_deg: Mapping[str, float] = field(default_factory=dict)
    held_mm: Mapping[str, float] = field(default_factory=dict)

    def error(self, text: str) -> InputError:
        """An error that names the case file."""
        return InputError(f"{self.where}: {self.section}{text}")
