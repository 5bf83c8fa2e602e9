"""Layers as data: curves on surfaces.

    body = CylindricalBody(radius_mm=20.0)

A layer is numbered from 0 at the body. Its curves are the borders of its region on its surface.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..curves.intersect import Curve
from ..mesh.solid import Floats, Mesh, PartError
from ..parameters import SlicingParameters
from ..surfaces.bodies import STRATEGIES, Body, ConicalBody, CylindricalBody, RevolvedBody
from ..surfaces.surfaces import Surface
from .thickness import bead_thickness, thickness_range

__all__ = [
    "STRATEGIES",
    "Body",
    "ConicalBody",
    "CylindricalBody",
    "Layer",
    "RevolvedBody",
    "SlicedSubVolume",
    "SlicingParameters",
    "make_layer",
    "require_layers",
    "without_slivers",
]


SLIVER_MM = 0.004  # mean width of a loop that no bead is laid for
MOST_LAYERS = 10_000  # more are a wrong unit, and take hours


@dataclass(frozen=True, eq=False)
class Layer:
    """One layer.

    Attributes:
        index: 0 for the first one.
        surface: what its curves lie on; the outward normal is the direction of deposition.
        curves: its borders, outer loops counter-clockwise seen from outside.
        area_mm2: of its region on its surface, holes left out.
        thickness_mm: least and greatest thickness of the bead along its curves.
    """

    index: int
    surface: Surface
    curves: tuple[Curve, ...]
    area_mm2: float
    thickness_mm: tuple[float, float]

    @property
    def on_body(self) -> bool:
        """Whether it lies on the body itself, as every first layer does that is not a plane."""
        return self.index == 0 and not self.surface.is_flat


@dataclass(frozen=True, eq=False)
class SlicedSubVolume:
    """A sub-volume and its layers.

    Attributes:
        name: of the sub-volume.
        strategy: planar, cylindrical, nonuniform, conical or revolved.
        mesh: what was sliced.
        body: what it stands on.
        layers: from the body outward.
        warnings: one line each; what was repaired in the mesh, beads thinner than the process can lay, and
            the like.
        parameters: what was asked for.
        stands_on_plate: it is the body itself, laid on the plate or the support, not on a body.
        volume_mm3: of the sub-volume outside its body; NaN where it was not compared with its layers.
        laid_volume_mm3: area times thickness over all layers.
        end_mm: how far the last layer stands out above the sub-volume's top; below 0 what is left above it.
        body_z_mm: where the body ends along z; infinite where it does not within the sub-volume.
    """

    name: str
    strategy: str
    mesh: Mesh
    body: Body
    layers: tuple[Layer, ...]
    warnings: tuple[str, ...] = ()
    parameters: SlicingParameters = field(default_factory=SlicingParameters)
    stands_on_plate: bool = False
    volume_mm3: float = math.nan
    laid_volume_mm3: float = math.nan
    end_mm: float = math.nan
    body_z_mm: tuple[float, float] = (-math.inf, math.inf)

    @property
    def faces_itself(self) -> bool:
        """Whether a layer's beads may stand higher than one another, as those on the two sides of a groove."""
        return self.strategy == "revolved" and self.body.has_grooves

    def metal_below_mm(self, layer: int) -> float:
        """How far below its surface a layer's metal begins, mm; 0 where it lies upon its surface.

        Args:
            layer: its number, from 0.
        """
        if self.strategy != "planar" or self.stands_on_plate:
            return 0.0
        if layer == 0:
            return self.parameters.h_layer_mm
        return self.layers[layer].surface.level - self.layers[layer - 1].surface.level

    def thickness_at(self, layer: int, points: Floats) -> Floats:
        """Thickness of the bead at points of a layer.

        Args:
            layer: its number, from 0.
            points: on the layer, (n, 3), mm, part frame.

        Returns:
            (n,) mm, down to the layer below.
        """
        if self.stands_on_plate:
            return np.full(len(points), self.parameters.h_layer_mm)
        below = self.layers[layer - 1].surface if layer > 0 else None
        return bead_thickness(points, self.layers[layer].surface, below, self.body, self.parameters.h_layer_mm)


def require_layers(mesh: Mesh, h_layer_mm: float) -> None:
    """Refuse layers so thin that there would be too many of them.

    Args:
        mesh: what is to be sliced.
        h_layer_mm: thickness of a layer.

    Raises:
        PartError: more than MOST_LAYERS would fit into the mesh's bounds.
    """
    extent = float(np.sqrt((np.ptp(mesh.bounds, axis=0) ** 2).sum()))
    if extent > MOST_LAYERS * h_layer_mm:
        raise PartError(
            f"{mesh.name}: h_layer_mm {h_layer_mm:g} is too thin for a part {extent:.4g} mm large;"
            f" at most {MOST_LAYERS:,} layers are cut; is the mesh in another unit?"
        )


def without_slivers(curves: list[Curve]) -> list[Curve]:
    """The curves without outer loops of a negligible area.

    A layer that just reaches the top of a solid meets it in loops a few micrometres wide: no metal a bead is laid for.

    Args:
        curves: of a layer.

    Returns:
        Those that are wider than SLIVER_MM in the mean, holes, and what goes right round the axis.
    """
    return [
        curve
        for curve in curves
        if not curve.closed or curve.hole or curve.winding or 2 * abs(curve.area_mm2) > SLIVER_MM * curve.length_mm
    ]


def make_layer(
    index: int, surface: Surface, curves: list[Curve], below: Surface | None, body: Body, h_layer_mm: float
) -> Layer:
    """A layer with its area and the range of its thickness.

    Args:
        index: its number.
        surface: its surface.
        curves: its curves, at least one.
        below: the surface of the layer below; None for the first layer.
        body: what the sub-volume stands on.
        h_layer_mm: the nominal thickness.

    Returns:
        The layer.
    """
    thickness = thickness_range([curve.points for curve in curves], surface, below, body, h_layer_mm)
    return Layer(index, surface, tuple(curves), sum(curve.area_mm2 for curve in curves), thickness)
