"""The metal that beads lay compared with the metal that their layers need, and its mass.

    metal = layer_metal(sliced, beads, pitch_mm=3.75)      # by layer
    metal[3].share                                         # 0.97: three in a hundred are missing there
    beads = with_metal(sliced, beads, parameters)          # varied within what the process can do

A bead with neighbours a pitch away on either side fills a pitch of its layer: its section is pitch times thickness. At
the nominal speed every bead lays that much metal per length. A layer needs its thickness integrated over its region
(`slicing.volume.layer_areas.laid_volume`). The two differ where beads stand alone or at the edge of a region, or where
a whole number of beads does not fit the wall. A process that can vary the metal per length evens that out
(`BeadParameters.metal_share`): the torch moves more slowly or faster there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..layers.layer import SlicedSubVolume
from ..parameters import BeadParameters
from ..volume.layer_areas import laid_volume
from ..warning import Code, Warning
from .bead import Bead

TOLD = 0.05  # share of a layer's metal that may be missing or too much before a warning says so
NEXT_TO_NOTHING = 0.05  # of the layer that takes most: such last layers are reported by volume, not by share


@dataclass(frozen=True)
class LayerMetal:
    """Metal of one layer.

    Attributes:
        layer: its number.
        wanted_mm3: what the layer takes.
        laid_mm3: what its beads lay.
    """

    layer: int
    wanted_mm3: float
    laid_mm3: float

    @property
    def share(self) -> float:
        """Metal laid divided by metal needed; 1 where none is needed."""
        return self.laid_mm3 / self.wanted_mm3 if self.wanted_mm3 > 0 else 1.0

    def to_dict(self) -> dict[str, float]:
        """As rbam-slices/1 writes it."""
        return {"layer": self.layer, "wanted_mm3": self.wanted_mm3, "laid_mm3": self.laid_mm3, "share": self.share}


def wanted_mm3(sliced: SlicedSubVolume, layer: int) -> float:
    """Metal that a layer needs, mm³: its thickness integrated over its region."""
    if sliced.stands_on_plate:
        return sliced.layers[layer].area_mm2 * sliced.parameters.h_layer_mm
    below = sliced.layers[layer - 1].surface if layer else None
    return laid_volume(sliced.layers[layer], below, sliced.body, sliced.parameters.h_layer_mm)


def bead_mm3(sliced: SlicedSubVolume, bead: Bead, pitch_mm: float) -> float:
    """Metal that a bead lays, mm³: pitch times thickness along it, times the bead's share of the nominal metal."""
    thickness = sliced.thickness_at(bead.layer, bead.points) + bead.gained_mm
    ends = np.roll(bead.points, -1, axis=0) if bead.closed else bead.points[1:]
    step = np.sqrt(((ends - bead.points[: len(ends)]) ** 2).sum(axis=1))
    after = np.roll(thickness, -1)[: len(ends)]
    return float(pitch_mm * bead.metal * (0.5 * (thickness[: len(ends)] + after) * step).sum())


def layer_metal(sliced: SlicedSubVolume, beads: Sequence[Bead], pitch_mm: float) -> tuple[LayerMetal, ...]:
    """Metal by layer.

    Args:
        sliced: the sub-volume.
        beads: all that are laid of it.
        pitch_mm: what a bead fills.

    Returns:
        One entry a layer.
    """
    laid = [0.0] * len(sliced.layers)
    for bead in beads:
        laid[bead.layer] += bead_mm3(sliced, bead, pitch_mm)
    return tuple(LayerMetal(k, wanted_mm3(sliced, k), mm3) for k, mm3 in enumerate(laid))


def with_metal(sliced: SlicedSubVolume, beads: Sequence[Bead], parameters: BeadParameters) -> tuple[Bead, ...]:
    """Beads that lay as much metal as their layer needs, within the limits of the process.

    Args:
        sliced: the sub-volume.
        beads: all that are laid of it.
        parameters: `metal_share` says what can be done; None: nothing.

    Returns:
        The beads; those of one layer carry the same.
    """
    if parameters.metal_share is None:
        return tuple(beads)
    low, high = parameters.metal_share
    given = [1.0 / m.share if m.share > 0 else 1.0 for m in layer_metal(sliced, beads, parameters.pitch_mm)]
    return tuple(replace(bead, metal=min(max(given[bead.layer], low), high)) for bead in beads)


def metal_lines(name: str, metal: Sequence[LayerMetal], parameters: BeadParameters) -> list[str]:
    """A warning about layers in which more or less metal is laid than they need.

    Args:
        name: of the sub-volume.
        metal: from `layer_metal`.
        parameters: the beads'.

    Returns:
        One line, or none.
    """
    off = [m for m in metal if abs(m.share - 1.0) > TOLD]
    if not off:
        return []
    least = NEXT_TO_NOTHING * max(m.wanted_mm3 for m in metal)
    full, bare = [m for m in off if m.wanted_mm3 >= least], [m for m in off if m.wanted_mm3 < least]
    worst = max(full or bare, key=lambda m: abs(math.log(max(m.share, 1e-9))))
    most = f", layer {worst.layer} the most ({100 * worst.share:.0f} %)" if full else ""
    if bare:
        # a share of next to nothing says little: how much metal it is says more
        heaviest = max(bare, key=lambda m: m.laid_mm3)
        most += (
            f"; {len(bare)} of them need{'s' * (len(bare) == 1)} almost no metal: layer {heaviest.layer} needs"
            f" {heaviest.wanted_mm3:.3g} mm³ and gets {heaviest.laid_mm3:.3g} mm³"
        )
    whole = sum(m.laid_mm3 for m in metal) / max(sum(m.wanted_mm3 for m in metal), 1e-300)
    why = " (pattern contour lays only the borders)" if parameters.pattern == "contour" else ""
    text = (
        f"{name}: the beads lay {100 * whole:.0f} % of the metal that the layers need{why};"
        f" {len(off)} of {len(metal)} layers are off by more than {100 * TOLD:.0f} %{most}"
    )
    return [Warning(Code.DEPOSIT_SHARE, text, sub_volume=name, layer=worst.layer)]


def mass_g(volume_mm3: float, density_g_cm3: float) -> float:
    """Mass of a volume, g."""
    return volume_mm3 * density_g_cm3 * 1e-3


def wire_m(volume_mm3: float, wire_diameter_mm: float) -> float:
    """Length of wire that makes a volume, m."""
    return volume_mm3 / (0.25 * math.pi * wire_diameter_mm**2) * 1e-3


def share_of(metal: Sequence[LayerMetal]) -> float:
    """Metal laid as a share of the metal that the layers need.

    Args:
        metal: of each layer.

    Returns:
        The share; 1 where nothing is needed.
    """
    wanted = sum(m.wanted_mm3 for m in metal)
    return sum(m.laid_mm3 for m in metal) / wanted if wanted > 0 else 1.0


def metal_document(metal: Sequence[LayerMetal], density_g_cm3: float, wire_diameter_mm: float) -> dict[str, float]:
    """Volume, mass and wire length of the metal of beads.

    Args:
        metal: by layer.
        density_g_cm3: of the metal.
        wire_diameter_mm: of the wire.

    Returns:
        Plain numbers.
    """
    laid = sum(m.laid_mm3 for m in metal)
    return {
        "laid_mm3": laid,
        "wanted_mm3": sum(m.wanted_mm3 for m in metal),
        "share": share_of(metal),
        "mass_g": mass_g(laid, density_g_cm3),
        "wire_m": wire_m(laid, wire_diameter_mm),
    }
