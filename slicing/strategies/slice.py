"""Slice one sub-volume: check that it stands on the body, find its footprint, build its layers.

    sliced = slice_sub_volume(mesh, CylindricalBody(20.0), SlicingParameters("nonuniform"))
    [layer.area_mm2 for layer in sliced.layers], sliced.warnings

How every strategy treats shapes that the paper does not mention:

- *180 degrees and more*: non-uniform layers are plain offsets of the body as long as they span so much, and flatten
  once they span less. Planes are cut as they are, but where the footprint faces away from the build direction the
  body is not below the beads: that is a warning. So is what hangs lower than the footprint: planes start there.
- *Full rings*: offsets of the body, each with two loops that wind round the axis; planes refuse them.
- *Loops with holes, several loops, forks*: all loops of a layer are one region, holes left out, and are laid layer by
  layer. One build direction, or one arc, serves them all: the smallest that covers them.
- *Ending on another body*: the other end is a top like any other. The mesh ends at the other body, so no curve runs
  inside that; the last bead may reach up to a layer too far, as at any top.
- *Already flat* (narrow against the body's radius): the first layer above the body is a plane.
- The stack ends where the next offset meets nothing, and a line says what is left. Planes go on to the highest point:
  what floats is cut as well.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..curves.intersect import NUDGE_MM, Curve, intersect
from ..layers.body_ends import NO_ENDS, closed_over, over_ends_mm3, part_between_heights, reach_beyond, without_body
from ..layers.layer import Body, Layer, SlicedSubVolume, require_layers, without_slivers
from ..layers.thickness import resampled
from ..mesh.solid import Floats, Mesh, PartError
from ..parameters import SlicingParameters
from ..surfaces.bodies import require_fit
from ..surfaces.greatest_distance import greatest_distance
from ..volume.layer_areas import hold_volume
from ..warning import Code, Warning
from .cylindrical import cylindrical_layers, span
from .nonuniform import nonuniform_layers
from .planar import planar_layers

THIN_SPACING_MM = 0.25  # at which beads are examined for thin places
LEAST_CAP_COSINE = 0.9  # cosine: caps of a root lie so near the body's surface; walls that lean out over it do not
GREATEST_GAP_MM = 0.1  # a root this far off the body still stands on it, or as far as the surface that is there


def slice_sub_volume(
    mesh: Mesh, body: Body, parameters: SlicingParameters, body_z_mm: tuple[float, float] = NO_ENDS
) -> SlicedSubVolume:
    """Slice a sub-volume that stands on a round body.

    Args:
        mesh: the sub-volume, part frame, mm. Its root may lie on the body or reach into it.
        body: the body.
        parameters: strategy and thicknesses.
        body_z_mm: where the body ends along its axis, from `slicing.body_ends`.

    Returns:
        Its layers.

    Raises:
        PartError: the strategy is not made for the body (`slicing.fits` is False), or the sub-volume does not
            touch the body, lies wholly inside it, or (planar) runs right round it, or the layers are without end.

    Source:
        Lettori et al. 2024, sections 3.2 and 4.
    """
    require_fit(parameters.strategy, body)
    require_layers(mesh, parameters.h_layer_mm)
    root, warnings = footprint(mesh, body, parameters.tolerance_mm)
    over = reach_beyond(np.concatenate([curve.points[:, 2] for curve in root]), body_z_mm)
    if over and body.takes_end_faces:
        body, body_z_mm = closed_over(mesh, body, body_z_mm), NO_ENDS
        root, warnings = footprint(mesh, body, parameters.tolerance_mm)
    elif over:
        root, more = footprint(_on_body(mesh, body, body_z_mm), body, parameters.tolerance_mm)
        warnings = [*more, *_over_ends(mesh, body, body_z_mm)]
    else:
        body_z_mm = NO_ENDS
    layers = tuple(_layers(mesh, body, parameters, root, body_z_mm))
    if not layers:
        raise PartError(f"{mesh.name}: thinner than one layer ({parameters.h_layer_mm} mm) outside the body")
    sliced = SlicedSubVolume(mesh.name, parameters.strategy, mesh, body, layers, (), parameters, body_z_mm=body_z_mm)
    # where thin beads are dealt with, `slicing.beads.thickness_policy` reports them
    thin = _thin_beads(sliced) if parameters.thickness == "report" else []
    held = hold_volume(sliced)
    return replace(
        sliced,
        warnings=(*mesh.warnings, *warnings, *_hanging_beads(sliced, root), *thin, *held.lines),
        volume_mm3=held.volume_mm3,
        laid_volume_mm3=held.laid_mm3,
        end_mm=held.end_mm,
    )


def _on_body(mesh: Mesh, body: Body, z_mm: tuple[float, float]) -> Mesh:
    """The part of a sub-volume that has the body below it."""
    part = part_between_heights(mesh, z_mm)
    if len(part.faces) == 0:
        raise PartError(
            f"{mesh.name}: lies wholly over the ends of the body ({body}, z {_rounded(z_mm)} mm), not on its side"
        )
    return part


def _rounded(z_mm: tuple[float, float]) -> str:
    return " .. ".join(f"{round(z, 4) + 0.0:g}" for z in z_mm)


def _over_ends(mesh: Mesh, body: Body, z_mm: tuple[float, float]) -> list[str]:
    """A warning about the volume within the body's radius beyond its ends."""
    over, whole = over_ends_mm3(mesh, body, z_mm), without_body(mesh, body, z_mm).volume
    what = f"{over:.1f} mm³ of it ({100 * over / whole:.1f} %) lie over the ends, within the body's radius"
    text = (
        f"{mesh.name}: reaches over the body's ends (z {_rounded(z_mm)} mm); layer 0 ends there. {what}:"
        " only planar layers hold them; strategy revolved lays layers round the ends"
    )
    return [Warning(Code.BODY_END, text, sub_volume=mesh.name, layer=0)]


def _layers(
    mesh: Mesh,
    body: Body,
    parameters: SlicingParameters,
    root: list[Curve],
    body_z_mm: tuple[float, float],
) -> list[Layer]:
    if parameters.strategy == "planar":
        return planar_layers(mesh, body, parameters, root, body_z_mm)
    if parameters.strategy == "nonuniform":
        return nonuniform_layers(mesh, body.as_cylinder(), parameters, root)
    if parameters.strategy in ("cylindrical", "conical", "revolved"):
        return cylindrical_layers(mesh, body, parameters, root)  # offsets of the body, whatever its kind
    raise NotImplementedError(f"no layers are made for strategy {parameters.strategy}")


def footprint(mesh: Mesh, body: Body, tolerance_mm: float) -> tuple[list[Curve], list[str]]:
    """Layer 0's curves: where the sub-volume meets the body.

    Args:
        mesh: the sub-volume.
        body: the body.
        tolerance_mm: of the sampled curves.

    Returns:
        The curves on the body's surface, and warnings.

    Raises:
        PartError: the sub-volume does not touch the body, or lies wholly inside it.
    """
    heights = body.surface.distance(mesh.vertices)
    if heights.max() <= NUDGE_MM + mesh.noise_mm:
        outermost = greatest_distance(body.surface, mesh.vertices[mesh.faces])
        if outermost <= NUDGE_MM + mesh.noise_mm:
            raise PartError(
                f"{mesh.name}: lies wholly inside the body ({body});"
                f" its outermost point is {max(-outermost, 0.0):.3f} mm below the body's surface"
            )
    gap = least_distance(mesh, body) if heights.min() > 0 else 0.0
    most = max(GREATEST_GAP_MM, body.off_mm)
    if gap > most:
        raise PartError(
            f"{mesh.name}: does not touch the body ({body}): the gap is {gap:.3f} mm; at most {most:g} mm is allowed"
        )
    lift = max(_root_lift(mesh, body, heights), gap + NUDGE_MM)
    curves = intersect(mesh, body.surface, tolerance_mm, nudge_mm=lift)
    if body.rounding_mm > 0.0 and len(curves) > 1:  # slits along the profile's bends are no holes
        whole = intersect(mesh, body.surface, tolerance_mm, nudge_mm=max(lift, body.rounding_mm))
        curves = whole if 0 < len(whole) < len(curves) else curves
    curves = without_slivers(curves)  # a side tangent to the body touches it along a line
    if not curves:
        raise PartError(f"{mesh.name}: touches the body only in points or lines; a footprint is needed")
    if lift > 1e-3:
        return curves, [f"{mesh.name}: the root is up to {lift:.3f} mm off the body; layer 0 lies at the root"]
    return curves, []


def _root_lift(mesh: Mesh, body: Body, heights: Floats) -> float:
    """How far off the body to take the footprint so that the root cap lies below it.

    A root cut by a body that was itself a mesh has corners up to a facet's sagitta off the cylinder. Faces
    that look squarely at the axis with all corners within the greatest gap are the cap; the cut goes just past
    its highest corner.
    """
    close, over = np.abs(heights) <= max(GREATEST_GAP_MM, body.off_mm), heights > 0.01 * NUDGE_MM
    if not (close & over).any():
        return NUDGE_MM
    a, b, c = ((close + 2 * over.view(np.uint8)).take(corner) for corner in mesh.corners)
    rows = np.flatnonzero(((a & b & c) & 1) + ((a | b | c) & 2) == 3)  # all close, one of them over
    corners = mesh.corners[:, rows]
    radial = body.surface.normals(mesh.vertices[corners].mean(axis=0))
    normals = mesh.normals[rows]
    cap = (normals * radial).sum(axis=1) < -LEAST_CAP_COSINE * np.sqrt((normals**2).sum(axis=1))
    return NUDGE_MM + float(heights[corners[:, cap]].max(initial=0.0))


def least_distance(mesh: Mesh, body: Body) -> float:
    """Least distance of a mesh's surface from the body's, mm; 0 where it reaches inside.

    Args:
        mesh: the sub-volume.
        body: the body.

    Returns:
        The gap, mm, never negative.
    """
    return body.surface.least_distance(mesh.vertices[mesh.faces])


def _hanging_beads(sliced: SlicedSubVolume, root: list[Curve]) -> list[str]:
    """Lines if planes are to be laid where the body is not below them, or would have to be."""
    if sliced.strategy != "planar":
        return []
    surface, vertices, lines = sliced.body.surface, sliced.mesh.vertices, []
    _, width = span(root, surface.axis_point)
    if width > np.pi + 1e-9:
        lines.append(
            f"{sliced.name}: its footprint spans {np.degrees(width):.0f} degrees of the body; beyond 90 degrees from"
            " the build direction planar beads have no body below them (cylindrical and nonuniform beads do)"
        )
    first = sliced.layers[0].surface
    lowest = min(float(first.distance(curve.points).min()) for curve in root)
    outside = vertices[surface.distance(vertices) > GREATEST_GAP_MM]
    below = lowest - float(first.distance(outside).min()) if len(outside) else 0.0
    if below > sliced.parameters.h_layer_mm:
        lines.append(
            f"{sliced.name}: reaches {below:.2f} mm lower than its footprint along the build direction; planes start"
            " at the footprint, and the metal below them is left out"
        )
    return lines


def _thin_beads(sliced: SlicedSubVolume) -> list[str]:
    """A line for every layer with places thinner than h_min: how much of the path, and how thin."""
    least, lines = sliced.parameters.h_min_mm, []
    for layer in sliced.layers:
        if layer.thickness_mm[0] >= least - 1e-6:
            continue
        thin = total = 0.0
        for curve in layer.curves:
            points = resampled(curve.points, layer.surface, THIN_SPACING_MM)
            over = sliced.thickness_at(layer.index, points) - (least - 1e-6)
            after = np.roll(over, -1)
            # of a stretch that crosses the limit, the part before or after the crossing
            share = np.clip(np.minimum(over, after) / np.minimum(-np.abs(over - after), -1e-12), 0.0, 1.0)
            thin, total = thin + curve.length_mm * float(share.mean()), total + curve.length_mm
        lines.append(
            f"{sliced.name}: layer {layer.index}: the bead is thinner than h_min {least:g} mm along {thin:.1f} of"
            f" {total:.1f} mm (least {layer.thickness_mm[0]:.3f} mm)"
        )
    return lines
