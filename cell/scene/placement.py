"""Targets on the table: from the part frame in millimetres to the arm's base frame in metres.

The one place where millimetres become metres::

    placed = place(targets, T_base_part)          # slicing.targets.targets.Targets -> Placed
    placed.Ts_base_target                         # (n, 4, 4), roll 0

A target's frame has z along the wire (into the part: minus the deposition direction) and, at roll 0, x along the
part's z axis projected across the wire (along the part's x axis where the two are parallel).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats
from slicing import Targets

from ..arrays import Ints
from ..errors import InputError
from ..rigid import frames
from ..units import METRES_PER_MM

UNIT_LENGTH = 1e-3  # what a normal's length may be off one


@dataclass(frozen=True, eq=False)
class Placed:
    """Targets in the arm's base frame.

    Attributes:
        position: (n, 3), m.
        normal: outward normal of the slicing surface, the deposition direction, (n, 3).
        reference: the part's z axis, (3,), and its x axis, (3,), for roll 0.
    """

    position: Floats
    normal: Floats
    reference: tuple[Floats, Floats]

    @property
    def Ts_base_target(self) -> Floats:
        """Target frames at roll 0, (n, 4, 4), m."""
        return frames(self.position, self.normal, self.reference)

    def rows(self, index: slice | Ints | list[int]) -> Placed:
        """Some of the targets."""
        return Placed(self.position[index], self.normal[index], self.reference)


def place(targets: Targets, T_base_part: Floats) -> Placed:
    """Bring targets into the base frame.

    Args:
        targets: part frame, mm.
        T_base_part: pose of the part in the base frame, (4, 4), m.

    Returns:
        Placed targets.

    Raises:
        InputError: a target is not finite or has no normal.
    """
    check_targets(targets)
    R, p = T_base_part[:3, :3], T_base_part[:3, 3]
    return Placed(
        position=targets.position * METRES_PER_MM @ R.T + p,
        normal=targets.normal @ R.T,
        reference=(R[:, 2], R[:, 0]),
    )


def check_targets(targets: Targets) -> None:
    """Refuse targets that no pose can be made of.

    Raises:
        InputError: which, and what it lacks.
    """
    bad = ~np.isfinite(targets.position).all(axis=1)
    if bad.any():
        i = int(np.argmax(bad))
        raise InputError(f"target {i}: position {np.array2string(targets.position[i])} is not finite")
    length = np.linalg.norm(targets.normal, axis=1)
    bad = ~(np.abs(length - 1.0) < UNIT_LENGTH)  # written so that NaN is refused as well
    if bad.any():
        i = int(np.argmax(bad))
        raise InputError(f"target {i}: has no normal: a unit vector is needed, its length is {length[i]:g}")
