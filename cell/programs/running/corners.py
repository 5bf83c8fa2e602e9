"""How far from its end a controller may begin to round a move.

Use:

    asked_distances(moves)                    # (m,) m, by C_DIS and C_VEL
    rounded_distances(moves, path)            # of those no more than half of the longer move at the corner

C_VEL rounds from where the TCP, as it brakes for the end, has come down to its share of the speed: at 100 % from where
it begins to brake. Of moves of axes a share is one of the way, and is not checked here.
"""

from __future__ import annotations

import numpy as np

from ik.chain import Floats

from ..program import MoveKind, Moves
from .program_path import ProgramPath

DEFAULT_SPEED = 2.0  # m/s: of a line for which none is set (KUKA: DEF_VEL_CP)
BRAKES = 2.3  # m/s^2: likewise (KUKA: DEF_ACC_CP)


def asked_distances(moves: Moves) -> Floats:
    """Distances from the ends of moves, (m,), m."""
    speed = np.nan_to_num(moves.speed, nan=DEFAULT_SPEED)
    brakes = np.minimum(np.nan_to_num(moves.acceleration, nan=BRAKES), BRAKES)
    by_speed = (moves.blend_share * speed) ** 2 / (2 * brakes)
    distances: Floats = np.where(moves.kind == MoveKind.AXES, moves.blend, np.maximum(moves.blend, by_speed))
    return distances


def rounded_distances(moves: Moves, path: ProgramPath) -> Floats:
    """The same, (m,), m, and at most half of the longer of the two lines at the corner."""
    ends = np.searchsorted(path.move, np.arange(len(moves)), side="right") - 1
    way = path.Ts_frame_tcp[ends, :3, 3] - path.begins[:, :3, 3]
    length = np.linalg.norm(way, axis=1)
    length = np.where(moves.kind == MoveKind.LINEAR, length, np.nan)  # of others it is not known here
    longer = np.fmax(length, np.append(length[1:], np.nan))
    return np.fmin(asked_distances(moves), longer / 2)
