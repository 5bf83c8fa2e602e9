"""What a bead is, and what decides how layers become beads (`slicing.beads.lay`).

    parameters = BeadParameters("zigzag", width_mm=5.0)
    bead.points, bead.closed, bead.rolled(7), bead.reversed()

By default every border of a layer is one bead, as in the paper, the border its centre line. The patterns that fill
a layer are `slicing.beads.infill`'s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ..mesh.solid import Floats, PartError

PATTERNS = ("contour", "contour_parallel", "zigzag")
SEAMS = ("aligned", "spread", "chosen")
ORDERS = ("given", "short")
BORDERS = ("centre", "edge")
THIN_WALLS = ("middle", "border")


@dataclass(frozen=True)
class SeamPlace:
    """A place for the seams of some closed beads, whatever those of all others are.

    Attributes:
        sub_volume: whose beads; None: all sub-volumes'.
        layers: first and last layer of these; None: all of them.
        angle_deg: the angle about the body's axis, or
        xyz_mm: a point of the part frame.
    """

    sub_volume: str | None = None
    layers: tuple[int, int] | None = None
    angle_deg: float | None = None
    xyz_mm: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        if (self.angle_deg is None) == (self.xyz_mm is None):
            raise PartError("seams: each needs one of angle_deg, xyz_mm")

    def is_for(self, sub_volume: str, layer: int) -> bool:
        """Whether a layer's beads start here."""
        mine = self.sub_volume is None or self.sub_volume == sub_volume
        return mine and (self.layers is None or self.layers[0] <= layer <= self.layers[1])


@dataclass(frozen=True)
class BeadParameters:
    """How layers become beads. The defaults are the paper's: the borders alone, seams one above the other.

    Attributes:
        pattern: contour (borders alone), contour_parallel or zigzag.
        width_mm: of a bead.
        overlap: of neighbouring beads, as a share of the width.
        border: whether a layer's border is the centre line of its outermost bead or that bead's edge; None:
            centre for pattern contour, edge for those that fill.
        thin_walls: pattern contour with the border as centre line: what is laid where a wall is thinner than one and a
            half pitches: middle (one bead along its middle) or border (its two borders, one beside the other, as the
            paper's propeller blade).
        contours: rounds along the border before zigzag lines fill the rest (0: none).
        contours_first: whether borders are laid before what is within them.
        angle_deg: of zigzag lines, against the way round the body (on planes: across z).
        angle_step_deg: added to the angle from layer to layer.
        metal_share: least and greatest metal that a bead may carry for its length, as a share of the nominal, by going
            more slowly or faster; None: all carry the nominal (`slicing.beads.deposition`).
        seam: where closed beads start: aligned (near the seam below), spread (far from it) or chosen.
        seam_angle_deg: chosen place, the angle about the body's axis, or
        seam_xyz_mm: a point of the part frame.
        seams: places of some beads' own, the last that fits a bead goes.
        alternate: whether every other layer runs the other way round.
        order: of the beads in a layer: given (as found), or short (little travel); None: given for pattern
            contour, short for those that fill.
        overhang_mm: how far a layer may stand out over what lies below it before a warning tells of it; None: half a
            bead (`slicing.beads.overhang`).
        lead_in_mm: how far before its start an arc begins (see `slicing.beads.leads`).
        lead_out_mm: how far it runs on past its end.
    """

    pattern: str = "contour"
    width_mm: float = 5.0
    overlap: float = 0.25
    border: str | None = None
    thin_walls: str = "border"
    contours: int = 1
    contours_first: bool = True
    angle_deg: float = 0.0
    angle_step_deg: float = 90.0
    metal_share: tuple[float, float] | None = None
    seam: str = "aligned"
    seam_angle_deg: float | None = None
    seam_xyz_mm: tuple[float, float, float] | None = None
    seams: tuple[SeamPlace, ...] = ()
    alternate: bool = False
    order: str | None = None
    overhang_mm: float | None = None
    lead_in_mm: float = 0.0
    lead_out_mm: float = 0.0

    def __post_init__(self) -> None:
        named: list[tuple[str, tuple[str | None, ...]]] = [("pattern", PATTERNS), ("seam", SEAMS)]
        named += [("order", (*ORDERS, None)), ("border", (*BORDERS, None)), ("thin_walls", THIN_WALLS)]
        for key, allowed in named:
            if getattr(self, key) not in allowed:
                names = ", ".join(name for name in allowed if name)
                raise PartError(f"{key}: {getattr(self, key)!r} unknown; allowed: {names}")
        for key in ("width_mm", "overlap", "angle_deg", "angle_step_deg", "lead_in_mm", "lead_out_mm"):
            if not math.isfinite(getattr(self, key)):
                raise PartError(f"{key}: {getattr(self, key)} is not allowed; a number is needed")
        if self.width_mm <= 0:
            raise PartError(f"width_mm: {self.width_mm} is not allowed; a number above 0 is needed")
        if not 0 <= self.overlap <= 0.9:
            raise PartError(f"overlap: {self.overlap} is not allowed; a share of the width within 0 .. 0.9 is needed")
        if self.contours < 0 or min(self.lead_in_mm, self.lead_out_mm) < 0:
            raise PartError("contours, lead_in_mm, lead_out_mm: must not be below 0")
        if self.metal_share is not None and not 0.0 < self.metal_share[0] <= 1.0 <= self.metal_share[1] < math.inf:
            raise PartError(f"metal_share: {list(self.metal_share)} is not allowed; needs 0 < least <= 1 <= greatest")
        places = (self.seam_angle_deg is not None) + (self.seam_xyz_mm is not None)
        if places != (self.seam == "chosen"):
            raise PartError("seam: chosen needs one of seam_angle_deg, seam_xyz_mm; they go with chosen alone")

    @property
    def pitch_mm(self) -> float:
        """Distance of neighbouring beads."""
        return self.width_mm * (1.0 - self.overlap)

    @property
    def first_mm(self) -> float:
        """How far inside the border the outermost bead runs."""
        border = self.border or ("centre" if self.pattern == "contour" else "edge")
        return 0.0 if border == "centre" else 0.5 * self.width_mm

    @property
    def short(self) -> bool:
        """Whether beads are put in an order of little travel."""
        return (self.order or ("given" if self.pattern == "contour" else "short")) == "short"


@dataclass(frozen=True, eq=False)
class Bead:
    """What the torch lays in one go.

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
        """The same bead the other way; a closed one starts at the same place."""
        order = np.arange(len(self.points))[::-1]
        order = np.roll(order, 1) if self.closed else order
        where = np.argsort(order)
        stops = tuple(sorted(int(where[k]) for k in self.stops))
        return replace(self, points=self.points[order], gained_mm=self.gained_mm[order], stops=stops)
