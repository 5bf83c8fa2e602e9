"""A motion: where arm and table are at which time, and what is welded.

Use:

    motion.t_s, motion.q, motion.table        # (m,) s, (m, n) rad, (m, 2) rad
    motion.arc, motion.target                 # (m,) whether the arc is on, (m,) target welded or approached
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from ..errors import InputError
from ..job.build_order import BuildOrder
from .deposition_speed import HeldSpeed

ROWS = 10_000  # made into text at once


@dataclass(frozen=True, eq=False)
class Motion:
    """A checked motion.

    Attributes:
        t_s: time, strictly rising, (m,), s.
        q: the arm, (m, j), rad.
        table: E1, E2, (m, 2), rad.
        arc: 1 while welding, (m,).
        bead: bead number; on a travel that of the next bead, on the way home that of the last, (m,).
        layer: layer number within its sub-volume, (m,).
        target: the target last passed; on a travel the next target, on the way home the last, (m,).
        names: names of the joints, the columns of q.
        held_speed: how well the deposition speed is held; None where that is not known.
        home_s: duration of the ways from home and back, s; None without a home.
        order: numbers of beads and targets in files; None where they are the same.
    """

    t_s: Floats
    q: Floats
    table: Floats
    arc: Ints
    bead: Ints
    layer: Ints
    target: Ints
    names: tuple[str, ...]
    held_speed: HeldSpeed | None = None
    home_s: float | None = None
    order: BuildOrder | None = None

    def __repr__(self) -> str:
        ends = f"{self.t_s[-1] - self.t_s[0]:.1f} s" if len(self.t_s) else "0 s"
        return f"<Motion: {len(self.t_s)} rows, {ends}, axes {', '.join(self.names)}>"

    @property
    def called(self) -> tuple[Ints, Ints]:
        """Bead and target of every row as files call them, (m,) each."""
        if self.order is None:
            return self.bead, self.target
        return self.order.bead[self.bead], self.order.target[self.target]

    def columns(self) -> list[str]:
        """Names of :meth:`rows_deg`'s columns."""
        return [
            "t_s",
            *(f"{name}_deg" for name in (*self.names, "E1", "E2")),
            "arc",
            "bead",
            "layer",
            "target",
        ]

    def to_frame(self) -> dict[str, NDArray[Any]]:
        """The motion as a dict of columns, not a data frame: ``pandas.DataFrame(motion.to_frame())``.

        Returns:
            By the names of :meth:`columns`, each (m,): s, deg, and numbers of beads and targets as files have them.
        """
        beads, targets = self.called
        angles = np.rad2deg(np.concatenate([self.q, self.table], axis=1)).T
        return dict(zip(self.columns(), (self.t_s, *angles, self.arc, beads, self.layer, targets), strict=True))

    def rows_deg(self) -> list[list[Any]]:
        """The motion with angles in degrees, one row a sample."""
        return list(self.each_row_deg())

    def each_row_deg(self) -> Iterator[list[Any]]:
        """The rows of :meth:`rows_deg`, one after the other: as text they take many times the motion's memory."""
        beads, targets = self.called
        for i in range(0, len(self.t_s), ROWS):
            part = slice(i, i + ROWS)
            angles = np.rad2deg(np.concatenate([self.q[part], self.table[part]], axis=1))
            whole = np.stack([self.arc[part], beads[part], self.layer[part], targets[part]], axis=1)
            for t, row, numbers in zip(self.t_s[part].tolist(), angles.tolist(), whole.tolist(), strict=True):
                yield [f"{t:.6f}", *(f"{a:.6f}" for a in row), *map(int, numbers)]

    @property
    def welding(self) -> NDArray[np.bool_]:
        """Whether the arc burns from each row to the next, (m - 1,)."""
        return (self.arc[:-1] & self.arc[1:]).astype(bool)

    @property
    def arc_time(self) -> float:
        """Seconds of welding."""
        return float(np.diff(self.t_s)[self.welding].sum())

    @property
    def dwell_time(self) -> float:
        """Seconds of waiting with the arc off."""
        still = ~(np.diff(self.q, axis=0).any(axis=1) | np.diff(self.table, axis=0).any(axis=1))
        return float(np.diff(self.t_s)[still & ~self.welding].sum())

    @property
    def travel_time(self) -> float:
        """Seconds of moving with the arc off."""
        return float(self.t_s[-1] - self.t_s[0]) - self.arc_time - self.dwell_time


def required(motion: Motion | None) -> Motion:
    """The motion.

    Raises:
        InputError: there is none.
    """
    if motion is None:
        raise InputError("no motion: an infeasible part has none (result.feasible says so)")
    return motion


NO_MOVE = 1e-9  # m or rad: less is no way


JUMP = np.deg2rad(15.0)  # more than this between samples is another configuration, not a motion
