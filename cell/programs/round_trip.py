"""What was written against what was meant: a program read back, run, and laid over the checked motion.

    gap = compared(job, motion, written, run)          # run: of the program that was read back
    gap.position, gap.angle, gap.move                  # the greatest deviation, and on which move
    difference_of(written.program, again)              # what differs between two programs, or None

Every row of the motion is held against the move that it lies on: on a line the TCP's place and orientation in the part
and the table's axes, on a move of axes those and all axes. Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ..job.job import Job
from ..motion.motion import Motion
from ..rigid import inverse
from .cell_frames import T_table_part, tables_seen_from_base
from .from_motion import PointThinning, ProgramOfMotion
from .program import Happens, Program
from .running.interpolation import angles_between
from .running.simulate import SimulatedProgram

OFF, TURNED = 0.05e-3, float(np.deg2rad(0.05))  # m and rad beyond what thinning was allowed
SAME_PLACE = 1e-6  # m and rad: digits that a text leaves out
SAME_SPEED = 1e-5  # m/s and shares, likewise


@dataclass(frozen=True)
class Gap:
    """How far a program's motion is off another.

    Attributes:
        position: greatest distance of the TCP, m.
        angle: greatest angle of its orientation, or of an axis of the table, rad.
        move: on which move the worse of both is, against what is allowed.
        row: row of the motion there.
        seconds: how much longer the program takes.
    """

    position: float
    angle: float
    move: int
    row: int
    seconds: float

    def share(self, thinning: PointThinning) -> float:
        """Of what is allowed: above 1 the program is not the motion."""
        return max(self.position / (OFF + thinning.chord), self.angle / (TURNED + thinning.angle))


def compared(job: Job, motion: Motion, written: ProgramOfMotion, run: SimulatedProgram) -> Gap:
    """Lay a program that was read back over the motion that it was made of.

    Args:
        job: both are of.
        motion: the checked motion.
        written: the program of it.
        run: what was read back, run; as many moves.

    Returns:
        The greatest deviation.
    """
    wanted, found = _Poses.of(job, motion), _Poses.of(job, run.motion)
    begins = np.concatenate([[0], written.row[:-1]])
    first = np.searchsorted(run.move, np.arange(len(written.row) + 1))
    off, turned = np.zeros(len(motion.t_s)), np.zeros(len(motion.t_s))
    owner = np.searchsorted(written.row, np.arange(len(motion.t_s)))
    for k, (a, b) in enumerate(zip(begins.tolist(), written.row.tolist(), strict=True)):
        rows = np.arange(a + 1, b + 1) if k else np.array([b])
        way = np.arange(max(first[k] - 1, 0), first[k + 1])
        if not len(way):
            off[rows] = np.inf  # the arm does not get there
            continue
        off[rows], turned[rows] = wanted.against(rows, found, way)
    worst = int(np.argmax(np.maximum(off / (OFF + written.thinning.chord), turned / (TURNED + written.thinning.angle))))
    longer = float(np.ptp(run.motion.t_s) - np.ptp(motion.t_s))
    return Gap(float(off.max()), float(turned.max()), int(min(owner[worst], len(written.row) - 1)), worst, longer)


@dataclass(frozen=True, eq=False)
class _Poses:
    """A motion's rows, seen from the part.

    Attributes:
        p: the TCP, (m, 3), m.
        R: its orientation, (m, 3, 3).
        axes: the arm's and the table's, (m, j + 2), rad.
    """

    p: Floats
    R: Floats
    axes: Floats

    @classmethod
    def of(cls, job: Job, motion: Motion) -> _Poses:
        table = tables_seen_from_base(job.scene, motion.table) @ T_table_part(job.scene)
        T = inverse(table) @ job.scene.chain.forward(motion.q)
        return cls(T[:, :3, 3], T[:, :3, :3], np.concatenate([motion.q, motion.table], axis=1))

    def against(self, rows: Floats, other: _Poses, way: Floats) -> tuple[Floats, Floats]:
        """Distances, m, and angles, rad, of some rows from another motion's rows that follow one another."""
        p, a = other.p[way], other.axes[way]
        if len(way) == 1:
            share, k = np.zeros(len(rows)), np.zeros(len(rows), dtype=np.int64)
            after = k
        else:
            # place and axes together say where on the way a row is: either alone may stand still
            here = np.concatenate([self.p[rows], 0.1 * self.axes[rows]], axis=1)
            there = np.concatenate([p, 0.1 * a], axis=1)
            chord = np.diff(there, axis=0)
            size = np.maximum((chord**2).sum(axis=1), 1e-30)
            since = here[:, None] - there[:-1]
            f = np.clip((since * chord).sum(axis=2) / size, 0.0, 1.0)
            k = np.argmin(np.linalg.norm(since - f[:, :, None] * chord, axis=2), axis=1)
            share, after = f[np.arange(len(rows)), k], k + 1
        share_ = share[:, None]
        place = p[k] + share_ * (p[after] - p[k])
        off = np.linalg.norm(self.p[rows] - place, axis=1)
        R = other.R[way]
        near = np.where(share[:, None, None] < 0.5, R[k], R[after])
        turned = angles_between(self.R[rows], near)
        step = angles_between(R[k], R[after]) * np.minimum(share, 1 - share)
        table = np.abs(self.axes[rows] - a[k] - share_ * (a[after] - a[k]))[:, -2:].max(axis=1)
        return off, np.maximum(np.maximum(turned - step, 0.0), table)


def difference_of(one: Program, other: Program) -> tuple[int, str] | None:
    """What differs between a program and what was read back of its text.

    Args:
        one: as it was meant.
        other: as it was read.

    Returns:
        The move and what differs there; None where nothing does, but for the digits of the text.
    """
    a, b = one.moves, other.moves
    if len(a) != len(b):
        return min(len(a), len(b)) - 1, f"{len(b)} moves were read back, {len(a)} were written"
    for name, slack in (
        ("kind", 0.0),
        ("joints", SAME_PLACE),
        ("external", SAME_PLACE),
        ("speed", SAME_SPEED),
        ("axis_share", SAME_SPEED),
        ("blend", SAME_PLACE),
    ):
        x, y = np.asarray(getattr(a, name), dtype=float), np.asarray(getattr(b, name), dtype=float)
        told = np.isfinite(x)
        off = np.where(told, np.abs(np.nan_to_num(x) - np.nan_to_num(y, nan=np.inf)), 0.0)
        bad = off > slack if off.ndim == 1 else (off > slack).any(axis=1)
        if bad.any():
            return int(np.argmax(bad)), f"{name} is {y[int(np.argmax(bad))]}, written was {x[int(np.argmax(bad))]}"
    mine, theirs = (_happens(program) for program in (one, other))
    for k, pair in enumerate(zip(mine, theirs, strict=False)):
        if pair[0][:2] != pair[1][:2] or abs(pair[0][2] - pair[1][2]) > 1e-3:
            return mine[k][
                1
            ], f"{theirs[k][0]} before move {theirs[k][1]}, written was {mine[k][0]} before {mine[k][1]}"
    if len(mine) != len(theirs):
        return len(a) - 1, f"{len(theirs)} events were read back, {len(mine)} were written"
    return None


def _happens(program: Program) -> list[tuple[str, int, float]]:
    """What happens where; layers are not looked at, whose calls may be comments."""
    return [
        (event.kind.value, event.before, event.seconds)
        for event in program.events
        if event.kind in (Happens.ARC_ON, Happens.ARC_OFF, Happens.WAIT)
    ]
