"""Clearances, with the range of roll about each configuration in which the tool stays in collision.

    seen, held = with_blocked_rolls(context, axes, deposits_laid)     # clearances of m configurations
    held.turn, held.room                                   # (m,) rad and (m,) m

A change of roll turns the tool about the wire, alike in every branch of the arm. If a shape of the tool is nearer than
the clearance, the missing distance divided by the shape's distance from the wire is an angle: no smaller turn frees it.
Depths of penetration are taken from the collision engine. Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..collision.clearances import Clearances
from .context import Context


@dataclass(frozen=True, eq=False)
class BlockedRolls:
    """Of what moves with the TCP, in m configurations.

    Attributes:
        turn: of the roll to either side within which it does not keep the clearance, (m,), rad; 0 where it does.
        room: its own least clearance less what is asked for, (m,), m, where that is negative; 0 elsewhere.
        flipped: the same of all pairs but those of links that A4 and A5 carry, (m,), m: of what stands alike in every
            configuration with the same A1 to A3 at this roll.
    """

    turn: Floats
    room: Floats
    flipped: Floats


def with_blocked_rolls(context: Context, axes: Floats, deposits_laid: Ints) -> tuple[Clearances, BlockedRolls]:
    """Check configurations.

    Args:
        context: the cell and what is to be kept.
        axes: of the arm, and of the table where it moves, (m, n), rad.
        deposits_laid: deposits laid, (m,).

    Returns:
        The nearest pair of each, and what holds the tool.
    """
    screen, least = context.screen, context.settings.clearance
    rows: list[Ints] = []
    pairs: list[Ints] = []
    rooms: list[Floats] = []

    def met(row: int, pair: Ints, distance: Floats) -> None:
        rows.append(np.full(len(distance), row))
        pairs.append(pair.copy())
        rooms.append(distance - least)

    seen = screen.clearances(axes, deposits_laid, met)
    held = BlockedRolls(*np.zeros((3, len(axes))))
    if rows:
        row, pair, room = np.concatenate(rows), np.concatenate(pairs), np.concatenate(rooms)
        mine = np.flatnonzero((room < 0) & screen.of_tool(pair))
        np.maximum.at(held.turn, row[mine], -room[mine] / context.tool_radius[pair[mine]].min(axis=1))
        np.minimum.at(held.room, row[mine], room[mine])
        alike = np.flatnonzero((room < 0) & ~context.wrist_geom[pair].any(axis=1))
        np.minimum.at(held.flipped, row[alike], room[alike])
    return seen, held
