"""Where a program's points put the table's axes: an endless one turns by the shorter way, whatever number stands there.

    table = table_ends(program.moves, job)    # (m, 2) rad, E1 and E2 at the end of every move
    axis, move, turn = half_turns(program.moves, job)[0]

An endless axis (KUKA: $AXIS_TYPE = 5) counts modulo 360 degrees and turns by half a turn at most in one move: from 300
to 20 it turns on by 80 degrees, not back by 280. Half a turn exactly may go either way. Radians.

Source: KUKA, "The file $MACHINE.DAT" (KR C2), on $AXIS_TYPE: such an axis turns modulo 360 degrees, and by 180 degrees
at most in a single motion block.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ...job.job import Job
from ...scene.scene import Scene, case_table
from ..program import Moves

OPEN = np.deg2rad(0.5)  # from half a turn, within which either way may be the shorter one
TOLD = np.deg2rad(0.001)  # that the way taken is off the way the numbers say


def endless_axes(scene: Scene) -> NDArray[np.bool_]:
    """Which of E1, E2 turn without end, (2,)."""
    return np.asarray(scene.has_axis & ~np.isfinite(scene.table_range).all(axis=1))


def table_ends(moves: Moves, job: Job) -> Floats:
    """E1, E2 at the end of every move, (m, 2), rad.

    Args:
        moves: of the program.
        job: its table. An axis that is never given stands where the case has it.
    """
    given = _given(moves, job)
    for k in np.flatnonzero(endless_axes(job.scene)).tolist():
        given[:, k] = np.unwrap(given[:, k])
    return given


def half_turns(moves: Moves, job: Job) -> list[tuple[int, int, float]]:
    """Moves of an endless axis by half a turn, which may go either way.

    Returns:
        Axis (0, 1), move, and the turn, rad.
    """
    turn = np.abs(np.diff(table_ends(moves, job), axis=0))
    found = (turn > np.pi - OPEN) & endless_axes(job.scene)
    return [(int(k), int(move) + 1, float(turn[move, k])) for move, k in np.argwhere(found)]


def shorter_turns(moves: Moves, job: Job) -> list[tuple[int, int, float, float]]:
    """Moves that turn an endless axis otherwise than their numbers say.

    Returns:
        Axis (0, 1), move, the turn that the numbers say and the one that is made, rad.
    """
    said, made = (np.diff(angles, axis=0) for angles in (_given(moves, job), table_ends(moves, job)))
    return [
        (int(k), int(move) + 1, float(said[move, k]), float(made[move, k]))
        for move, k in np.argwhere(np.abs(said - made) > TOLD)
    ]


def _given(moves: Moves, job: Job) -> Floats:
    """The numbers of the points."""
    stands = np.array(case_table(job.case, job.scene))
    return np.where(np.isfinite(moves.external), moves.external, stands)
