"""The layers of a sub-volume compared with its own volume, and every layer's area against the solid itself.

    held = hold_volume(sliced)
    held.volume_mm3, held.laid_mm3      # of the sub-volume outside the body; area times thickness of its layers
    held.lines                          # what does not fit, one line each

Three questions are answered from the mesh's surface alone, without the layers' curves:

- *How large is the sub-volume outside its body?* The field F = (rho² - r(z)²) / (2 rho²) (x, y, 0) about the body's
  axis has divergence 1 outside a body of radius r(z) and is zero on it, so its flux through the mesh is the volume.
- *How large must a layer's region be?* What lies beyond a layer's surface has the region and the mesh's faces out there
  as its border. Fields without divergence that pass the surface evenly - the normal of a plane, (x, y, 0) / rho² for
  surfaces of revolution - pass the region as much as those faces: the area is a sum over faces. A lost loop, a hole
  taken for an outer loop, or a wrong loop changes the area of its own layer, however small the layer is.
- *How much do the layers hold?* The integral of the bead's thickness over each region, thin places included.

The last two differ from the first by what slicing rounds. The stack ends where a whole layer ends, above the top or
below it: that part is distinguished (`end_mm`). A bead has the section at its curves over all of its height; a sum with
the mean of its section and the next one's (the trapezoidal rule) has not. Where neither comes within MOST_OFF of the
volume a line says so, and why, where that is known.

How the fluxes are summed: `slicing.volume.solid_flux`. A layer is reported only if its area fits no surface within
REACH_MM of its
own: grazing tops move far. Layers on shoulders and end faces of a revolved body are not examined by themselves: the
field runs along them. Borders, also those that enclose no area, are examined by `slicing.volume.borders`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from ..layers.body_ends import NO_ENDS, over_ends_mm3, part_between_heights, without_body
from ..layers.layer import Layer, SlicedSubVolume
from ..layers.outside_body import region_of
from ..layers.poles import poles
from ..layers.thickness import bead_thickness
from ..mesh.solid import Floats
from ..surfaces.bodies import Body
from ..surfaces.greatest_distance import greatest_distance
from ..surfaces.offsets import Offsets
from ..surfaces.surfaces import Cylinder, Plane, Revolved, Surface
from ..warning import WRONG_LAYER, Code, Warning
from .borders import hold_borders, reaches
from .solid_flux import SolidFlux

MOST_OFF = 0.02  # of the volume that may be missing or too much
MOST_LEFT = 0.001  # of the volume that may lie beyond the last layer's upper side
AREA_SHARE, AREA_MM2 = 0.02, 0.05  # what a layer's area may be off
REACH_MM = 0.02  # how far to either side of its surface it may fit
PAST_MM = 1e-4  # beyond a layer's curves: faces that lie in its surface count as below it
STEEP = 3.0  # growth of the radius with z from which on a surface lies too flat
FINER_FACES = 4.0  # how much smaller the faces where a layer seems wrong
ALONG = 2000  # places at which thickness is taken along an arc
GRID = 60  # places a side at which it is taken where it changes in two directions


@dataclass(frozen=True, eq=False)
class HeldVolume:
    """What holding layers against their solid gives.

    Attributes:
        volume_mm3: of the sub-volume outside its body.
        laid_mm3: area times thickness, over all layers.
        end_mm3: how much of `laid_mm3` stands out above the top; below 0 what is left above the last layer.
        end_mm: how far it stands out, or is left.
        area_mm2: (k,) of each layer's region by the solid; NaN where it was not found.
        lines: one for each layer that does not fit, and one if the volumes do not.
    """

    volume_mm3: float
    laid_mm3: float
    end_mm3: float
    end_mm: float
    area_mm2: Floats
    lines: tuple[Warning, ...]


def hold_volume(sliced: SlicedSubVolume) -> HeldVolume:
    """Hold the layers of a sub-volume against its mesh.

    Args:
        sliced: the sub-volume and its layers.

    Returns:
        Volumes, areas and what does not fit.
    """
    layers, body, h = sliced.layers, sliced.body, sliced.parameters.h_layer_mm
    mesh = sliced.mesh
    flux = SolidFlux.of(mesh)
    over_ends, ends_count = 0.0, sliced.body_z_mm != NO_ENDS
    if ends_count and not layers[0].on_body:
        mesh = without_body(mesh, body, sliced.body_z_mm)
        flux = SolidFlux.of(mesh)
    elif flux.deepest(body.surface, -REACH_MM) < -REACH_MM:
        over_ends = over_ends_mm3(mesh, body, sliced.body_z_mm) if ends_count else 0.0
        mesh = without_body(mesh, body, NO_ENDS)
        flux = SolidFlux.of(mesh)
    if ends_count and layers[0].on_body:
        # the first layer ends with the body
        root = SolidFlux.of(part_between_heights(mesh, sliced.body_z_mm))
        first, rest_of = _held(sliced.name, root, layers[:1]), _held(sliced.name, flux, layers[1:])
        area, lines = np.append(first[0], rest_of[0]), (*first[1], *rest_of[1])
    else:
        area, lines = _held(sliced.name, flux, layers)
    laid = [laid_volume(layer, layers[k - 1].surface if k else None, body, h) for k, layer in enumerate(layers)]
    last = layers[-1]
    rest = flux.volume_beyond(last.surface)
    top = max(greatest_distance(last.surface, flux.mesh.vertices[flux.mesh.faces]), 0.0)
    on_body = layers[0].on_body  # then every bead lies above its curves
    end, end_mm = (last.area_mm2 * h - rest, h - top) if on_body else (-rest, -top)
    held = HeldVolume(mesh.volume + over_ends, float(sum(laid)), end, end_mm, area, lines)
    missing = held.laid_mm3 - end - held.volume_mm3
    off = min(abs(missing), abs(missing + _evened(layers, laid)))
    odd = any(line.code == Code.LAYER_AREA for line in lines)
    # a stack that ends early: of what is left above its last layer nothing lies higher than that layer is thick
    odd |= top > h and flux.volume_beyond(last.surface.offset(h)) > MOST_LEFT * held.volume_mm3
    return held if off <= MOST_OFF * held.volume_mm3 and not odd else _with_volume_line(held, sliced)


def _held(name: str, flux: SolidFlux, layers: tuple[Layer, ...]) -> tuple[Floats, tuple[Warning, ...]]:
    """Areas (k,) of layers' regions by the solid, mm², and what does not fit of their areas and borders."""
    if not layers or len(flux.mesh.faces) == 0:
        return np.full(len(layers), np.nan), ()
    area = _areas_by_solid(flux, layers)
    odd = _odd(flux, layers, area)
    if odd:  # look again, more closely
        again = [layers[k] for k in odd]
        area[odd] = _areas_by_solid(flux, again, FINER_FACES)
        odd = [odd[i] for i in _odd(flux, again, area[odd], FINER_FACES)]
    lines = tuple(_area_line(name, layers[k], float(area[k])) for k in odd)
    return area, lines + hold_borders(name, flux.mesh, layers, [_cut_at(layer) for layer in layers])


def _evened(layers: tuple[Layer, ...], laid: list[float]) -> float:
    """What the trapezoidal rule adds to the sum of beads, mm³."""
    upper, lower = layers[1:], layers[:-1]
    mean = [
        volume / layer.area_mm2 if layer.area_mm2 > 0 else 0.0 for volume, layer in zip(laid[1:], upper, strict=True)
    ]
    half = [0.5 * t * (b.area_mm2 - a.area_mm2) for t, a, b in zip(mean, upper, lower, strict=True)]
    if layers[0].on_body:
        # the first bead was counted at the root, the last one as what stands out above the top
        thick = laid[0] / layers[0].area_mm2
        return sum(half) - thick * (layers[0].area_mm2 - layers[-1].area_mm2)
    return sum(half)


def _area_line(name: str, layer: Layer, by_solid: float) -> Warning:
    return Warning(
        Code.LAYER_AREA,
        f"{name}: layer {layer.index}: its curves enclose {layer.area_mm2:.2f} mm², but the solid's section there is"
        f" {by_solid:.2f} mm²: the layer is wrong",
        sub_volume=name,
        layer=layer.index,
    )


def _with_volume_line(held: HeldVolume, sliced: SlicedSubVolume) -> HeldVolume:
    """The same with a line about the volumes, and why, where that is known."""
    share = 100.0 * (held.laid_mm3 / held.volume_mm3 - 1.0)
    why = []
    where = "above the top" if held.end_mm >= 0 else "below the top"
    why.append(f"the stack ends {abs(held.end_mm):.2f} mm {where} ({100 * held.end_mm3 / held.volume_mm3:+.1f} %)")
    wrong = {line.layer for line in held.lines if line.code in WRONG_LAYER}
    if wrong:
        why.append(f"{len(wrong)} layers are wrong" if len(wrong) > 1 else "1 layer is wrong")
    elif sliced.body_z_mm != NO_ENDS:
        why.append("some of it lies over the body's ends")
    elif sliced.strategy == "planar":
        why.append("the first planes run into the body")
    else:
        why.append("its sections change within a layer's thickness")
    line = Warning(
        Code.LAYER_VOLUME,
        f"{sliced.name}: area times thickness of the layers is {held.laid_mm3:.6g} mm³, the sub-volume has"
        f" {held.volume_mm3:.6g} mm³ ({share:+.1f} %): {'; '.join(why)}",
        sub_volume=sliced.name,
    )
    return HeldVolume(held.volume_mm3, held.laid_mm3, held.end_mm3, held.end_mm, held.area_mm2, (*held.lines, line))


def _cut_at(layer: Layer) -> float:
    """How far outside its surface a layer's curves lie (a root that stands off the body), and a little more."""
    height = layer.surface.distance(np.concatenate([curve.points for curve in layer.curves]))
    middle = len(height) // 2
    return max(float(np.partition(height, middle)[middle]), 0.0) + PAST_MM


def _areas_by_solid(flux: SolidFlux, layers: Sequence[Layer], finer: float = 1.0) -> Floats:
    """Areas (k,) of layers' regions by the solid, mm²; NaN where a surface lies too flat across the axis."""
    area = np.full(len(layers), np.nan)
    steep = [k for k, layer in enumerate(layers) if not _runs_along(layer.surface, layer)]
    area[steep] = flux.areas_on([layers[k].surface.offset(_cut_at(layers[k])) for k in steep], finer)
    return area


@singledispatch
def _runs_along(surface: Offsets, layer: Layer) -> bool:
    """Whether the field runs along a layer's surface somewhere."""
    return False


@_runs_along.register(Revolved)
def _(surface: Revolved, layer: Layer) -> bool:
    """On shoulders and end faces it does."""
    z = np.concatenate([curve.points[:, 2] for curve in layer.curves])
    chain = surface.chain(1e-3)
    step = np.diff(np.stack([chain.r, chain.z], axis=1), axis=0)
    # a shoulder or an end face is as high as its layer but for rounding; a layer over a pole has no border there
    lower, upper = poles(layer)
    low, high = -np.inf if lower else z.min() - PAST_MM, np.inf if upper else z.max() + PAST_MM
    near = (chain.z[1:] >= low) & (chain.z[:-1] <= high)
    return bool((near & (np.abs(step[:, 0]) > STEEP * np.abs(step[:, 1]))).any())


def _odd(flux: SolidFlux, layers: Sequence[Layer], by_solid: Floats, finer: float = 1.0) -> list[int]:
    """The layers (numbers in the list) whose area fits no section of the solid near their surface."""
    own = np.array([layer.area_mm2 for layer in layers])
    slack = AREA_SHARE * np.maximum(own, by_solid) + AREA_MM2
    odd = np.flatnonzero(np.abs(own - by_solid) > slack).tolist()  # not where it is NaN
    steps = [[by * REACH_MM for by in reaches(layers[k])] for k in odd]
    offsets = [
        layers[k].surface.offset(at + step)
        for k, by in zip(odd, steps, strict=True)
        for at in [_cut_at(layers[k])]
        for step in by
    ]
    near = np.split(flux.areas_on(offsets, finer), np.cumsum([len(by) for by in steps])[:-1]) if odd else []
    found = []
    for k, areas in zip(odd, near, strict=True):
        low, high = min(areas.min(), by_solid[k]) - slack[k], max(areas.max(), by_solid[k]) + slack[k]
        if not low <= own[k] <= high:
            found.append(k)
    return found


def laid_volume(layer: Layer, below: Surface | None, body: Body, h_layer_mm: float) -> float:
    """The integral of a bead's thickness over its layer's region.

    Args:
        layer: the layer.
        below: the surface of the layer below; None for the first layer.
        body: what the sub-volume stands on.
        h_layer_mm: the nominal thickness.

    Returns:
        mm³.
    """
    least, most = layer.thickness_mm
    if most - least <= 1e-6:
        return layer.area_mm2 * most
    return _laid(layer.surface, layer, below, body, h_layer_mm)


@singledispatch
def _laid(surface: Offsets, layer: Layer, below: Surface | None, body: Body, h_layer_mm: float) -> float:
    """Where thickness may be anything: its mean over the region."""
    return layer.area_mm2 * _mean_thickness(surface, layer, below, body, h_layer_mm)


@_laid.register(Plane)
@_laid.register(Cylinder)
def _(surface: Plane | Cylinder, layer: Layer, below: Surface | None, body: Body, h_layer_mm: float) -> float:
    """Where it depends on the way across the axis alone, as on straight bodies: a boundary integral of its integral."""
    straight = body.surface.is_straight and (below is None or below.is_straight)
    if not straight or any(curve.winding for curve in layer.curves):
        return layer.area_mm2 * _mean_thickness(surface, layer, below, body, h_layer_mm)
    flat = [surface.unrolled(curve.points) for curve in layer.curves]
    along = np.concatenate([loop[:, 0] for loop in flat])
    s = np.linspace(along.min(), along.max(), ALONG)
    points = surface.lifted(np.stack([s, np.zeros(len(s))], axis=1))
    thickness = bead_thickness(points, surface, below, body, h_layer_mm)
    total = np.append(0.0, np.cumsum(0.5 * (thickness[1:] + thickness[:-1]) * np.diff(s)))
    laid = plain = 0.0
    for loop in flat:
        after = np.roll(loop, -1, axis=0)
        rise = after[:, 1] - loop[:, 1]
        ends = [np.interp(p, s, total) for p in (loop[:, 0], 0.5 * (loop[:, 0] + after[:, 0]), after[:, 0])]
        laid += float(((ends[0] + 4.0 * ends[1] + ends[2]) / 6.0 * rise).sum())
        plain += float((0.5 * (loop[:, 0] + after[:, 0]) * rise).sum())
    return laid / plain * layer.area_mm2 if plain > 0 else 0.0


@singledispatch
def _mean_thickness(surface: Offsets, layer: Layer, below: Surface | None, body: Body, h_layer_mm: float) -> float:
    """Mean thickness over a region: along its borders."""
    border = np.concatenate([curve.points for curve in layer.curves])
    return float(bead_thickness(border, layer.surface, below, body, h_layer_mm).mean())


@_mean_thickness.register(Plane)
def _(surface: Plane, layer: Layer, below: Surface | None, body: Body, h_layer_mm: float) -> float:
    """On a plane: on a grid."""
    import shapely

    region = region_of([surface.unrolled(curve.points) for curve in layer.curves])
    low_u, low_v, high_u, high_v = region.bounds
    step = (np.arange(GRID) + 0.5) / GRID
    u, v = np.meshgrid(low_u + step * (high_u - low_u), low_v + step * (high_v - low_v))
    inside = shapely.contains_xy(region, u.ravel(), v.ravel())
    points = surface.lifted(np.stack([u.ravel()[inside], v.ravel()[inside]], axis=1))
    if len(points) == 0:
        points = np.concatenate([curve.points for curve in layer.curves])
    return float(bead_thickness(points, surface, below, body, h_layer_mm).mean())
