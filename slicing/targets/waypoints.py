"""The ways from bead to bead as points: retract along the normal, across, approach along the normal.

    for way in travels(targets, retract_mm=30.0, axis_xy_mm=(0.0, 0.0)): way.to_target, way.position

The path leads from the end of a bead out along its normal by the retract, straight across to the point at the same
distance above the next start, and in. If the two beads lie far apart round the axis, it leads round the axis outside
all metal instead of through the body. These are waypoints for programs written from the targets; `rbam check` plans and
proves its own travels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..mesh.solid import Floats
from .targets import Targets

STRAIGHT_RAD = math.radians(30.0)  # farther round than this the way goes round the axis
STEP_RAD = math.radians(15.0)


@dataclass(frozen=True, eq=False)
class Travel:
    """The path to a bead from the one before.

    Attributes:
        to_target: number of the bead's first target.
        position: (n, 3) waypoints between the two beads, part frame, mm.
        normal: (n, 3) unit, against which the torch points there.
        tangent: (n, 3) unit, the way on from each.
    """

    to_target: int
    position: Floats
    normal: Floats
    tangent: Floats


def travels(targets: Targets, retract_mm: float, axis_xy_mm: tuple[float, float] = (0.0, 0.0)) -> list[Travel]:
    """Paths between the beads of a part.

    Args:
        targets: of the part.
        retract_mm: how far out along the normal.
        axis_xy_mm: of the body.

    Returns:
        One a bead but the first, in order.
    """
    if len(targets) == 0:
        return []
    axis = np.append(axis_xy_mm, 0.0)
    away = np.hypot(*(targets.position - axis)[:, :2].T)
    outside = float(away.max()) + retract_mm
    starts = np.flatnonzero(np.diff(targets.bead)) + 1
    return [_way(targets, int(start), retract_mm, axis, outside) for start in starts]


def _way(targets: Targets, start: int, retract_mm: float, axis: Floats, outside: float) -> Travel:
    ends = targets.position[[start - 1, start]]
    normals = targets.normal[[start - 1, start]]
    out = ends + retract_mm * normals
    turn = [math.atan2(p[1], p[0]) for p in out - axis]
    round_by = (turn[1] - turn[0] + math.pi) % (2 * math.pi) - math.pi
    position, normal = out, normals
    if abs(round_by) > STRAIGHT_RAD:
        count = math.ceil(abs(round_by) / STEP_RAD)
        share = np.linspace(0.0, 1.0, count + 1)
        at = turn[0] + share * round_by
        # chords between the points stay outside as well
        radius = outside / math.cos(0.5 * abs(round_by) / count)
        radial = np.stack([np.cos(at), np.sin(at), 0.0 * at], axis=1)
        height = out[0, 2] + share * (out[1, 2] - out[0, 2])
        arc = axis + radius * radial + height[:, None] * [0.0, 0.0, 1.0]
        position = np.concatenate([out[:1], arc, out[1:]])
        normal = np.concatenate([normals[:1], radial, normals[1:]])
    onward = np.diff(np.concatenate([position, ends[1:]]), axis=0)
    length = np.sqrt((onward**2).sum(axis=1))[:, None]
    tangent = np.where(length > 1e-9, onward / np.maximum(length, 1e-9), -normal)
    return Travel(start, position, normal, tangent)
