"""What was written against what was meant: a program read back, run, and laid over the checked motion.

    gap = compared(job, motion, written, run)          # run: of the program that was read back
    gap.position, gap.angle, gap.move                  # the greatest deviation, and on which move
    difference_of(written.program, again)              # what differs between two programs, or None

Every row of the motion is compared with the move that it lies on: the TCP's place and orientation in the part, and the
table's axes. Metres and radians.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ik.chain import Floats

from ..arrays import Ints
from ..job.job import Job
from ..motion.motion import Motion
from ..rigid import inverse
from ..scene.site_frames import T_table_part
from .cell_frames import tables_seen_from_base
from .from_motion import PointThinning, ProgramOfMotion
from .program import EventKind, MoveKind, Program
from .running.interpolation import angles_between
from .running.simulate import SimulatedProgram

OFF, TURNED = 0.05e-3, float(np.deg2rad(0.05))  # m and rad beyond what thinning was allowed
LEVER = 0.1  # m: what a radian of an axis counts for where a row is looked for on a way
CLOSER = 2  # times that a place on a chord is looked for again on the curve
SAME_PLACE = 1e-6  # m and rad: digits that a text leaves out
SAME_SPEED = 1e-5  # m/s and shares, likewise


@dataclass(frozen=True)
class ProgramDeviation:
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


def compared(job: Job, motion: Motion, written: ProgramOfMotion, run: SimulatedProgram) -> ProgramDeviation:
    """Lay a program that was read back over the motion that it was made of.

    Args:
        job: both are of.
        motion: the checked motion.
        written: the program of it.
        run: what was read back, run; as many moves.

    Returns:
        The greatest deviation.
    """
    wanted, found = _PosesInPart.of(job, motion), _PosesInPart.of(job, run.motion)
    begins = np.concatenate([[0], written.row[:-1]])
    first = np.searchsorted(run.move, np.arange(len(written.row) + 1))
    # the step of the other motion that each row lies on, by its ends
    steps, there = np.zeros((2, len(motion.t_s)), dtype=np.int64), np.ones(len(motion.t_s), dtype=bool)
    owner = np.searchsorted(written.row, np.arange(len(motion.t_s)))
    for k, (a, b) in enumerate(zip(begins.tolist(), written.row.tolist(), strict=True)):
        rows = np.arange(a + 1, b + 1) if k else np.array([b])
        way = np.arange(max(first[k] - 1, 0), first[k + 1])
        there[rows] = len(way) > 0  # or the arm does not get there
        if len(way):
            steps[:, rows] = wanted.nearest_steps(rows, found, way)
    off, turned = wanted.against(job, found, steps, written.program.moves.kind[owner.clip(max=len(written.row) - 1)])
    off, turned = np.where(there, off, np.inf), np.where(there, turned, 0.0)
    worst = int(np.argmax(np.maximum(off / (OFF + written.thinning.chord), turned / (TURNED + written.thinning.angle))))
    longer = float(np.ptp(run.motion.t_s) - np.ptp(motion.t_s))
    return ProgramDeviation(
        float(off.max()), float(turned.max()), int(min(owner[worst], len(written.row) - 1)), worst, longer
    )


@dataclass(frozen=True, eq=False)
class _PosesInPart:
    """Where a motion's rows are, seen from the part.

    Attributes:
        p: the TCP, (m, 3), m.
        R: its orientation, (m, 3, 3).
        axes: the arm's and the table's, (m, j + 2), rad.
    """

    p: Floats
    R: Floats
    axes: Floats

    @classmethod
    def of(cls, job: Job, motion: Motion) -> _PosesInPart:
        return cls.at(job, np.concatenate([motion.q, motion.table], axis=1))

    @classmethod
    def at(cls, job: Job, axes: Floats) -> _PosesInPart:
        table = tables_seen_from_base(job.scene, axes[:, -2:]) @ T_table_part(job.scene)
        T = inverse(table) @ job.scene.chain.forward(axes[:, :-2])
        return cls(T[:, :3, 3], T[:, :3, :3], axes)

    @property
    def place(self) -> Floats:
        """Place and axes together, (m, j + 5): they say where on a way a row is, and either alone may stand still."""
        return np.concatenate([self.p, LEVER * self.axes], axis=1)

    def nearest_steps(self, rows: Ints, other: _PosesInPart, way: Ints) -> Ints:
        """Of another motion's rows that follow one another the two that each of some rows lies between, (2, k)."""
        if len(way) == 1:
            return np.full((2, len(rows)), way[0])
        here, there = self.place[rows], other.place[way]
        chord = np.diff(there, axis=0)
        since = here[:, None] - there[:-1]
        f = _shares(since, chord)
        k = np.argmin(np.linalg.norm(since - f[:, :, None] * chord, axis=2), axis=1)
        return np.stack([way[k], way[k + 1]])

    def against(self, job: Job, other: _PosesInPart, steps: Ints, kind: Ints) -> tuple[Floats, Floats]:
        """Distances and angles of all rows from steps of another motion.

        Between its rows that motion has its axes on straight lines. On a move of axes the TCP goes on a curve then;
        where a row is on it is found on the chord first. On a line the TCP is on the chord.

        Args:
            job: both are of.
            other: the other motion.
            steps: the rows of it that each row lies between, (2, m).
            kind: of the moves that they are on, (m,).

        Returns:
            (m,), m, and (m,), rad.
        """
        a, b = other.axes[steps[0]], other.axes[steps[1]]
        start, chord = other.place[steps[0]], other.place[steps[1]] - other.place[steps[0]]
        share = on_chord = _shares(self.place - start, chord)
        at = _PosesInPart.at(job, a + share[:, None] * (b - a))
        for _ in range(CLOSER):
            share = np.clip(share + _shares(self.place - at.place, chord, low=-1.0), 0.0, 1.0)
            at = _PosesInPart.at(job, a + share[:, None] * (b - a))
        line = other.p[steps[0]] + on_chord[:, None] * chord[:, :3]
        p = np.where((kind == MoveKind.AXES)[:, None], at.p, line)
        table = np.abs(self.axes - at.axes)[:, -2:].max(axis=1)
        return np.linalg.norm(self.p - p, axis=1), np.maximum(angles_between(self.R, at.R), table)


def _shares(since: Floats, chord: Floats, low: float = 0.0) -> Floats:
    """How far along chords places are that are given from where these begin, as a share of them, (..)."""
    size = np.maximum((chord**2).sum(axis=-1), 1e-30)
    out: Floats = np.clip((since * chord).sum(axis=-1) / size, low, 1.0)
    return out


def difference_of(one: Program, other: Program) -> tuple[int, str] | None:
    """What differs between a program and the one read back from its text.

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
        reported = np.isfinite(x)
        off = np.where(reported, np.abs(np.nan_to_num(x) - np.nan_to_num(y, nan=np.inf)), 0.0)
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
    """What happens where; layers are not checked, whose calls may be comments."""
    return [
        (event.kind.value, event.before, event.seconds)
        for event in program.events
        if event.kind in (EventKind.ARC_ON, EventKind.ARC_OFF, EventKind.WAIT)
    ]
