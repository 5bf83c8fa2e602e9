"""A bead as data. `slicing.beads.lay` makes beads of layers.

    bead.points, bead.closed, bead.rolled(7), bead.reversed()

By default every border of a layer is one bead, as in the paper, the border its centre line. The patterns that fill
a layer are in `slicing.beads.infill`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..mesh.solid import Floats


@dataclass(frozen=True, eq=False)
class Bead:
    """A run of metal that the torch lays without a stop of the arc.

    Attributes:
        points: (n, 3) mm, part frame, fine, on the layer's surface; a closed bead does not repeat its first.
        closed: whether it ends where it starts; it starts at its first point.
        kind: contour or infill.
        layer: its layer's number.
        hole: whether it runs round a hole of its layer.
        gained_mm: (n,) thickness taken over from the layer below, mm; see `slicing.beads.thickness_policy`.
        stops: numbers of points that have to become targets.
        thin: whether its place is narrower than it is.
        close_mm: length on which the beads beside it lie less than `slicing.beads.lay.CROWDED` of their pitch away,
            where the layer does not unroll.
        least_spacing: least distance of the beads beside it as a share of their pitch.
        metal: what it carries for its length, as a share of the nominal; its speed is the nominal by this.
    """

    points: Floats
    closed: bool
    kind: str
    layer: int
    hole: bool = False
    gained_mm: Floats = field(default_factory=lambda: np.zeros(0))
    stops: tuple[int, ...] = ()
    thin: bool = False
    close_mm: float = 0.0
    least_spacing: float = 1.0
    metal: float = 1.0

    def __post_init__(self) -> None:
        if len(self.gained_mm) != len(self.points):
            object.__setattr__(self, "gained_mm", np.zeros(len(self.points)))

    @property
    def length_mm(self) -> float:
        """Length of the polyline, mm."""
        ends = np.roll(self.points, -1, axis=0) if self.closed else self.points[1:]
        return float(np.sqrt(((ends - self.points[: len(ends)]) ** 2).sum(axis=1)).sum())

    @property
    def end(self) -> Floats:
        """Where it ends, (3,)."""
        return self.points[0] if self.closed else self.points[-1]

    def rolled(self, first: int) -> Bead:
        """A closed bead that starts at another of its points."""
        n = len(self.points)
        stops = tuple(sorted((k - first) % n for k in self.stops))
        return replace(
            self, points=np.roll(self.points, -first, axis=0), gained_mm=np.roll(self.gained_mm, -first), stops=stops
        )

    def reversed(self) -> Bead:
        """The bead in the opposite direction; a closed one starts at the same place."""
        order = np.arange(len(self.points))[::-1]
        order = np.roll(order, 1) if self.closed else order
        where = np.argsort(order)
        stops = tuple(sorted(int(where[k]) for k in self.stops))
        return replace(self, points=self.points[order], gained_mm=self.gained_mm[order], stops=stops)
