"""A cell while it is put together: what each body belongs to, and what the models' elements are called in it.

Use:

    assembly = CellAssembly(surroundings(case), case)     # cell.scene.equipment fills it
    assembly.piece["link_3"]                        # BodyOwner.ROBOT
    assembly.name(BodyOwner.TOOL, "sites", "tcp")       # its name in the cell
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

import mujoco
import numpy as np

from ik.chain import Floats
from slicing import Warning

from ..case.sections import Case
from ..mjcf.names import Names


class BodyOwner(IntEnum):
    """What a body of the cell belongs to."""

    SURROUNDINGS = 0
    ROBOT = 1
    TOOL = 2
    POSITIONER = 3
    SUPPORT = 4
    PART = 5
    FIXTURE = 6


@dataclass(eq=False)
class CellAssembly:
    """A cell while it is put together.

    Attributes:
        world: the cell so far.
        case: the case.
        piece: by body name, what it belongs to.
        names: what the models' elements are called in the cell.
        held: bodies of the arm from which joints were taken that are not planned.
        on_table: bodies of fixtures that stand on the table.
        warnings: what was left out, one line each.
        table: position and quaternion of the table's site in its body, m.
    """

    world: mujoco.MjSpec
    case: Case
    piece: dict[str, BodyOwner] = field(default_factory=dict)
    names: dict[BodyOwner, Names] = field(default_factory=dict)
    held: set[str] = field(default_factory=set)
    on_table: set[str] = field(default_factory=set)
    warnings: list[Warning] = field(default_factory=list)
    table: tuple[Floats, Floats] = field(default_factory=lambda: (np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])))

    @property
    def wires(self) -> set[str]:
        """The wire's shapes, as they are called in the cell."""
        return {self.names[BodyOwner.TOOL].geoms[wire] for wire in self.case.tool.wire}

    def name(self, piece: BodyOwner, kind: str, own: str) -> str:
        """What a model's element is called in the cell; its own name where the model has no such element."""
        found: dict[str, str] = getattr(self.names[piece], kind)
        return found.get(own, own)


def one_line(error: Exception) -> str:
    """MuJoCo's messages, which span several lines, in one."""
    return " ".join(str(error).split())
