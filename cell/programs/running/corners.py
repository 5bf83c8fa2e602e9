"""How far from its end a controller may begin to round a move.

Use:

    asked_distances(moves)                    # (m,) m, by C_DIS and C_VEL
    rounded_distances(moves, path)            # of those no more than half of the longer move at the corner
    corner_reach(moves, 6, 7, before, after)  # how far the corner between moves 6 and 7 reaches into either

At a corner between a move of axes and a line each move has its own measure: $APO.CPTP says how far the rounding reaches
into the move of axes, whatever word the line has, and C_DIS, C_VEL or C_ORI how far it reaches into the line. Of two
moves of axes with C_PTP the first is left by the $APO.CPTP that holds at the first, and the second is joined by the
$APO.CPTP that holds at the second (robot-forum.com, threads 14422 and 41364).

C_VEL rounds from where the TCP, as it brakes for the end, has come down to its share of the speed: at 100 % from where
it begins to brake. Of moves of axes a share is one of the way, and is not checked here.
"""

from __future__ import annotations

from dataclasses import dataclass

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


@dataclass(frozen=True, eq=False)
class CornerSide:
    """A move at a corner, from the corner outwards.

    Attributes:
        s: length of its way, (m,), ascending from 0: of the axes, rad, of a move of axes and of a line that only turns
            the tool; of the TCP, m, of any other.
        away: distance of the TCP from the corner, (m,), m.
        way: length of the TCP's way, m.
    """

    s: Floats
    away: Floats
    way: float

    def within(self, distance: float) -> float:
        """Length up to which the TCP is within a distance, m, of the corner."""
        last = int(np.flatnonzero(self.away <= distance)[-1])
        if last + 1 == len(self.s):
            return float(self.s[-1])
        share = (distance - self.away[last]) / (self.away[last + 1] - self.away[last])
        return float(self.s[last] + share * (self.s[last + 1] - self.s[last]))

    def of_half(self, share: float) -> float:
        """Length of a share of half the way."""
        return share * float(self.s[-1]) / 2


def corner_reach(moves: Moves, i: int, k: int, before: CornerSide, after: CornerSide) -> tuple[float, float]:
    """How far the rounding of a corner reaches into the moves at it, of which not both are in one run.

    Args:
        moves: of the program.
        i: the move whose words round the corner: the one that ends there, or one that stays there.
        k: the move that leaves it.
        before: the move that leads there.
        after: move k.

    Returns:
        Length of the one before, and of the one after, in the units of the two sides.
    """
    distance = float(asked_distances(moves)[i])
    half = max(before.way, after.way) / 2
    if moves.kind[i] == MoveKind.AXES:
        joined = distance if distance > 0 else float(np.nan_to_num(moves.line_corner[i], nan=half))
        begins = max(before.within(min(distance, half)), before.of_half(float(moves.blend_share[i])))
        return begins, max(after.within(min(joined, half)), after.of_half(share_of_axes(moves, i, k)))
    begins, ends = (side.within(min(distance, half)) for side in (before, after))
    if moves.kind[k] == MoveKind.AXES:
        ends = max(ends, after.of_half(_joined_share(moves, k)))
    return begins, ends


def share_of_axes(moves: Moves, i: int, k: int) -> float:
    """Share of half its way over which a move of axes i is left, or move k joined (C_PTP): the larger."""
    share = float(moves.blend_share[i])
    return max(share, _joined_share(moves, k)) if share > 0 else 0.0


def _joined_share(moves: Moves, k: int) -> float:
    """Share of half of move k up to which the corner before it reaches into it by C_PTP."""
    share = float(moves.axes_corner[k])
    return share if share == share else 1.0
