"""What may be asked of slicing: every parameter's name, default, range and meaning, stated here and nowhere else.

    SlicingParameters("nonuniform", h_layer_mm=1.73, h_min_mm=1.39, h_max_mm=2.2)
    BeadParameters("zigzag", width_mm=5.0, seams=(SeamPlace(sub_volume="SV2", angle_deg=120.0),))

The sections `slicing` and `beads` of a case file are these classes: a parameter that is added here is a key there, with
its line in the case reference. No arrays are needed to read them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal

from annotated_types import Ge, Le

from .annotations import Meaning, documented, require_allowed
from .errors import PartError

Angle = Annotated[float, Ge(-3600), Le(3600)]  # deg
Distance = Annotated[float, Ge(0), Le(1000)]  # mm
Height = Annotated[float, Ge(0.01), Le(1000)]  # mm, of a layer
Coordinate = Annotated[float, Ge(-1e5), Le(1e5)]  # mm
Point = tuple[Coordinate, Coordinate, Coordinate]
LayerNumber = Annotated[int, Ge(0), Le(1_000_000)]

Strategy = Literal["planar", "cylindrical", "nonuniform", "conical", "revolved"]
Pattern = Literal["contour", "contour_parallel", "zigzag"]

LengthUnit = Literal["mm", "cm", "m", "inch"]  # of a mesh file
UNITS_MM: dict[str, float] = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "inch": 25.4}  # how many mm each is


@documented
@dataclass(frozen=True)
class SlicingParameters:
    """How the layers are cut."""

    strategy: Annotated[
        Strategy,
        Meaning(
            "kind of layers; conical needs a conical body, revolved a profile, planar any body, the others a cylinder"
        ),
    ] = "nonuniform"
    h_layer_mm: Annotated[Height, Meaning("preferred thickness of a layer")] = 1.73
    h_min_mm: Annotated[Height, Meaning("least thickness that the process can lay")] = 1.39
    h_max_mm: Annotated[Height, Meaning("greatest thickness that the process can lay")] = 2.2
    tolerance_mm: Annotated[
        float, Ge(1e-4), Le(100), Meaning("largest distance between a layer's chords and its exact curve")
    ] = 0.01
    thickness: Annotated[
        Literal["report", "trim", "merge"],
        Meaning(
            "for beads outside h_min_mm .. h_max_mm: only a warning, end the bead there, or let the layer "
            "above lay the metal"
        ),
    ] = "report"

    def __post_init__(self) -> None:
        require_allowed(self)
        if not self.h_min_mm <= self.h_layer_mm <= self.h_max_mm:
            heights = f"{self.h_min_mm:g}, {self.h_layer_mm:g}, {self.h_max_mm:g}"
            raise PartError(f"needs h_min_mm <= h_layer_mm <= h_max_mm (they are {heights})")


@documented
@dataclass(frozen=True)
class SeamPlace:
    """A place for the seams of some closed beads; the last place that fits a bead counts."""

    __pydantic_config__: ClassVar[dict[str, Any]] = {"extra": "forbid"}  # of entries in a case file

    sub_volume: Annotated[str | None, Meaning("sub-volume that the place is for; all of them where left out")] = None
    layers: Annotated[tuple[LayerNumber, LayerNumber] | None, Meaning("first and last layer; all where left out")] = (
        None
    )
    angle_deg: Annotated[Angle | None, Meaning("place of the seams as an angle about the body's axis")] = None
    xyz_mm: Annotated[Point | None, Meaning("place of the seams as a point of the part instead")] = None

    def __post_init__(self) -> None:
        require_allowed(self)
        if (self.angle_deg is None) == (self.xyz_mm is None):
            raise PartError("seams: a place needs one of angle_deg, xyz_mm")
        if self.layers is not None and self.layers[0] > self.layers[1]:
            raise PartError("layers: needs first <= last")

    def is_for(self, sub_volume: str, layer: int) -> bool:
        """Whether a layer's beads start here.

        Args:
            sub_volume: its name.
            layer: number of the layer, from 0.
        """
        mine = self.sub_volume is None or self.sub_volume == sub_volume
        return mine and (self.layers is None or self.layers[0] <= layer <= self.layers[1])


@documented
@dataclass(frozen=True)
class BeadParameters:
    """Which beads a layer is laid in, where they start, and in which order."""

    pattern: Annotated[
        Pattern, Meaning("contour: only the layers' borders (as in the paper); the others fill the layer as well")
    ] = "contour"
    width_mm: Annotated[float, Ge(0.05), Le(1000), Meaning("width of a bead")] = 5.0
    overlap: Annotated[float, Ge(0), Le(0.9), Meaning("overlap of neighbouring beads, as a share of the width")] = 0.25
    border: Annotated[
        Literal["centre", "edge"] | None,
        Meaning(
            "whether a layer's border is the centre line or the edge of its outer bead; default: centre "
            "for contour, else edge"
        ),
    ] = None
    thin_walls: Annotated[
        Literal["middle", "border"],
        Meaning(
            "of pattern contour, where a wall is thinner than 1.5 pitches: one bead in its middle, or both borders"
        ),
    ] = "middle"
    contours: Annotated[int, Ge(0), Le(1000), Meaning("of pattern zigzag: number of rounds along the border")] = 1
    contours_first: Annotated[bool, Meaning("whether the borders are laid before the infill, or after it")] = True
    angle_deg: Annotated[
        Angle, Meaning("angle of zigzag lines to the direction round the body (planes: to the direction across z)")
    ] = 0.0
    angle_step_deg: Annotated[Angle, Meaning("angle added to angle_deg from one layer to the next")] = 90.0
    metal_share: Annotated[
        tuple[Annotated[float, Ge(0.01), Le(1)], Annotated[float, Ge(1), Le(100)]] | None,
        Meaning(
            "least and greatest metal per length that a bead may carry, as a share of the nominal amount; the "
            "speed changes for it; none: always the nominal amount"
        ),
    ] = None
    seam: Annotated[
        Literal["aligned", "spread", "chosen"],
        Meaning("where closed beads start: near the seam below, far from it, or at a chosen place"),
    ] = "aligned"
    seam_angle_deg: Annotated[Angle | None, Meaning("of seam: chosen, the place as an angle about the body's axis")] = (
        None
    )
    seam_xyz_mm: Annotated[Point | None, Meaning("of seam: chosen, the place as a point of the part instead")] = None
    seams: Annotated[tuple[SeamPlace, ...], Meaning("places of the seams of single sub-volumes or layers")] = ()
    alternate: Annotated[bool, Meaning("whether every other layer is laid in the opposite direction")] = False
    order: Annotated[
        Literal["given", "short"] | None,
        Meaning("order of a layer's beads: as cut, or with little travel; default: given for contour, else short"),
    ] = None
    lead_in_mm: Annotated[
        Distance,
        Meaning(
            "length of a closed bead before its seam; of an open bead the arc starts this far inside it, runs back to "
            "its start, and then forward"
        ),
    ] = 0.0
    lead_out_mm: Annotated[
        Distance, Meaning("length of closed beads past the seam; an open bead runs back by it at its end")
    ] = 0.0

    def __post_init__(self) -> None:
        require_allowed(self)
        places = (self.seam_angle_deg is not None) + (self.seam_xyz_mm is not None)
        if self.seam == "chosen" and places != 1:
            raise PartError("seam: chosen needs one of seam_angle_deg, seam_xyz_mm")
        if self.seam != "chosen" and places:
            raise PartError("seam_angle_deg and seam_xyz_mm go with seam: chosen")

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
