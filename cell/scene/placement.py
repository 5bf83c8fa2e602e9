"""Targets on the table: from the part frame in millimetres to the arm's base frame in metres.

The one place where millimetres become metres::

    placed = place_targets(targets, T_base_part)          # slicing.targets.targets.Targets -> PlacedTargets
    placed.Ts_base_target                         # (n, 4, 4), roll 0

A target's frame has z along the wire (into the part: minus the deposition direction) and, at roll 0, x along the
part's z axis projected across the wire (along the part's x axis where the two are parallel).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ik.chain import Floats
from slicing import Targets

from ..arrays import Ints
from ..errors import InputError
from ..rigid import frames, inverse
from ..units import METRES_PER_MM
from .table_kinematics import TableKinematics

UNIT_LENGTH = 1e-3  # what a normal's length may be off one


@dataclass(frozen=True, eq=False)
class MovingTable:
    """A table that moves along the beads.

    Attributes:
        kinematics: of its axes.
        tables: E1, E2 at each target, (n, 2), rad; on the way to the next they change evenly.
        bead: the targets in the part frame, in which the beads stand still.
    """

    kinematics: TableKinematics
    tables: Floats
    bead: PlacedTargets


@dataclass(frozen=True, eq=False)
class PlacedTargets:
    """Targets in the arm's base frame.

    Attributes:
        position: (n, 3), m.
        normal: outward normal of the slicing surface, the deposition direction, (n, 3).
        reference: the part's z axis, (3,), and its x axis, (3,), for roll 0; of a table that moves, those of a table at
            zero.
        moving: how the table moves; None where it stands.
    """

    position: Floats
    normal: Floats
    reference: tuple[Floats, Floats]
    moving: MovingTable | None = None

    @property
    def Ts_base_target(self) -> Floats:
        """Target frames at roll 0, (n, 4, 4), m."""
        if self.moving is not None:
            return self.moving.kinematics.poses(self.moving.tables) @ self.moving.bead.Ts_base_target
        return frames(self.position, self.normal, self.reference)

    @property
    def bead(self) -> PlacedTargets:
        """The targets where their beads stand still: in the base frame, or in the part's where the table moves."""
        return self if self.moving is None else self.moving.bead

    def rows(self, index: slice | Ints | list[int]) -> PlacedTargets:
        """Some of the targets."""
        moving = self.moving
        if moving is not None:
            moving = replace(moving, tables=moving.tables[index], bead=moving.bead.rows(index))
        return PlacedTargets(self.position[index], self.normal[index], self.reference, moving)

    def tables(self, target: Ints, fraction: Floats | None = None) -> Floats:
        """Table angles at targets, or at fractions of the way from them to the next.

        Args:
            target: (m,).
            fraction: of the way, (m,); 0 where left out.

        Returns:
            (m, 2), rad; (m, 0) where the table stands.
        """
        if self.moving is None:
            return np.empty((len(target), 0))
        E = self.moving.tables
        if fraction is None:
            return E[target]
        after = np.minimum(target + 1, len(E) - 1)
        return E[target] + fraction[:, None] * (E[after] - E[target])

    def axes(self, q: Floats, target: Ints, fraction: Floats | None = None) -> Floats:
        """Configurations (m, j) with the axes of a table that moves along, (m, j) or (m, j + 2), rad."""
        return q if self.moving is None else np.concatenate([q, self.tables(target, fraction)], axis=1)

    def carried(self, Ts: Floats, tables: Floats) -> Floats:
        """Poses (m, 4, 4) where the beads stand still as they are in the base frame at table angles."""
        return Ts if self.moving is None else self.moving.kinematics.poses(tables) @ Ts

    def seen(self, Ts: Floats, tables: Floats) -> Floats:
        """Poses (m, 4, 4) in the base frame as they are where the beads stand still, at table angles."""
        return Ts if self.moving is None else inverse(self.moving.kinematics.poses(tables)) @ Ts


def place_targets(targets: Targets, T_base_part: Floats) -> PlacedTargets:
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
    return PlacedTargets(
        position=targets.position * METRES_PER_MM @ R.T + p,
        normal=targets.normal @ R.T,
        reference=(R[:, 2], R[:, 0]),
    )


def place_on_moving_table(targets: Targets, kinematics: TableKinematics, tables: Floats) -> PlacedTargets:
    """Bring targets into the base frame, each at table angles of its own.

    Args:
        targets: part frame, mm.
        kinematics: of the table.
        tables: E1, E2 at each target, (n, 2), rad.

    Returns:
        Placed targets.

    Raises:
        InputError: a target is not finite or has no normal.
    """
    bead = place_targets(targets, np.eye(4))
    Ts = kinematics.poses(tables)
    R = kinematics.T_base_part[:3, :3]
    return PlacedTargets(
        position=(Ts[:, :3, :3] @ bead.position[..., None])[..., 0] + Ts[:, :3, 3],
        normal=(Ts[:, :3, :3] @ bead.normal[..., None])[..., 0],
        reference=(R[:, 2], R[:, 0]),
        moving=MovingTable(kinematics, tables, bead),
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
