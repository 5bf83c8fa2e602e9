"""A motion as data: what replay shows and what a program is written from.

    motion.t_s, motion.q, motion.arc, motion.target       # one row a sample
    motion.columns(), motion.rows_deg()                   # the contract of --motion

Times come from the deposition speed while the arc burns and from joint speeds on travels. Radians and seconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ik.chain import Floats

from .collision import Clearances, Ints
from .place import METRES_PER_MM

if TYPE_CHECKING:
    from .bead import Stretch
    from .job import Job


@dataclass(frozen=True, eq=False)
class Motion:
    """A checked motion.

    Attributes:
        t_s: time, (m,), s.
        q: the arm, (m, j), rad.
        table: E1, E2, (m, 2), rad.
        arc: 1 while welding, (m,).
        bead: bead number, of a travel the one it leads to, (m,).
        layer: layer number within its sub-volume, (m,).
        target: the target last passed, of a travel the one it leads to, (m,).
        names: columns of q.
    """

    t_s: Floats
    q: Floats
    table: Floats
    arc: Ints
    bead: Ints
    layer: Ints
    target: Ints
    names: tuple[str, ...]

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

    def rows_deg(self) -> list[list[Any]]:
        """The motion with angles in degrees, one row a sample."""
        angles = np.rad2deg(np.concatenate([self.q, self.table], axis=1))
        return [
            [f"{t:.4f}", *(f"{a:.6f}" for a in row), int(arc), int(bead), int(layer), int(target)]
            for t, row, arc, bead, layer, target in zip(
                self.t_s, angles, self.arc, self.bead, self.layer, self.target, strict=True
            )
        ]

    @property
    def arc_time(self) -> float:
        """Seconds of welding."""
        return float(np.diff(self.t_s)[(self.arc[:-1] & self.arc[1:]).astype(bool)].sum())


def assemble(
    job: Job,
    table: tuple[float, float],
    stretches: Sequence[Stretch],
    travels: Sequence[tuple[Floats, Floats, Clearances]],
) -> Motion:
    """Put beads and travels together.

    Args:
        job: the job.
        table: E1, E2, rad.
        stretches: one a bead, in order.
        travels: from each bead to the next.

    Returns:
        The motion.
    """
    speed = job.case.process.deposition_speed_mm_s * METRES_PER_MM
    q, dt, arc, target = [], [], [], []
    for i, stretch in enumerate(stretches):
        if i:
            way, times, _ = travels[i - 1]
            # its ends are the beads' own samples
            q.append(way[1:-1])
            dt.append(times)
            arc.append(np.zeros(len(way) - 2, dtype=np.int64))
            target.append(np.full(len(way) - 2, stretch.first))
        q.append(stretch.q)
        dt.append(np.linalg.norm(np.diff(stretch.position, axis=0), axis=1) / speed)
        arc.append(np.ones(len(stretch.q), dtype=np.int64))
        target.append(stretch.edge + (stretch.fraction >= 1.0))
    where = np.concatenate(target)
    rows = np.concatenate(q)
    return Motion(
        t_s=np.concatenate([[0.0], np.cumsum(np.concatenate(dt))]),
        q=rows,
        table=np.tile(table, (len(rows), 1)),
        arc=np.concatenate(arc),
        bead=job.targets.path[where],
        layer=job.targets.layer[where],
        target=where,
        names=job.scene.chain.names,
    )
