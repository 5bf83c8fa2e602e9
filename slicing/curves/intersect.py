"""Exact curves in which a closed triangle mesh meets a plane, a cylinder or another surface of revolution.

A triangle meets a cylinder in arcs of an ellipse, so a boss of twelve triangles must give the same curve as
one of a hundred thousand. Nothing here depends on how fine the mesh is:

    curves = intersect(mesh, Cylinder((0.0, 0.0), 21.73), tolerance_mm=0.01)

How it works. Every vertex is inside or outside the surface; every edge is solved once (a line for a plane, a
quadratic for a cylinder: it can cross twice) and its crossings are *nodes*, named (edge, which root). Walking
round a triangle one leaves the surface's inside at one node and comes back at the next: the piece of curve
between these two lies in the triangle, because both the triangle and the inside are convex. That pairing is a
matter of names and order, not of distances, so neighbours always agree and the pieces chain into closed
loops. A triangle that the whole circle falls into holds a loop without any node. A piece on a cylinder is an
arc of an ellipse parametrised by the angle about the axis, or a ruling where the triangle is vertical. Cones and
other surfaces of revolution are taken band by band in the same way: see `slicing.curves.revolved`.

A value of zero counts as inside: the surface is nudged outward by 1e-7 mm, or just past vertices that lie on
it to within the mesh's rounding. So a root cap whose vertices lie on the body is wholly below layer 0, whose
curve is then the footprint, and a flat face lying in a plane gives neither a double nor a broken loop. Pieces
run with the solid on their left seen from outside the surface: outer loops counter-clockwise, holes
clockwise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..mesh.solid import Floats, Ints, Mesh
from ..surfaces.surfaces import Cone, Cylinder, Plane, Revolved, Surface
from .cone_levels import STEEPEST, cone_curves
from .face_intervals import FaceIntervals
from .loops import Curve, assembled, chain
from .pairing import CurvePieces, pair
from .parallel_levels import NUDGE_MM, level_curves
from .revolved import round_curves

__all__ = ["NUDGE_MM", "Curve", "CurvePieces", "assembled", "chain", "intersect", "intersect_offsets", "pair"]

REACH_MM = 1e-5  # more than any rounding


def intersect(
    mesh: Mesh,
    surface: Surface,
    tolerance_mm: float = 0.01,
    nudge_mm: float = NUDGE_MM,
    faces: Ints | None = None,
) -> list[Curve]:
    """Curves in which a closed mesh meets a surface.

    Args:
        mesh: the solid, part frame, mm.
        surface: where to cut. Points of the result lie within nudge_mm (or the mesh's rounding) outside of
            it.
        tolerance_mm: greatest distance between the exact curve and the chord of two successive points.
        nudge_mm: how far outside the surface the cut is really made.
        faces: (k,) numbers of the triangles to examine; all whose extent reaches the surface when not given.

    Returns:
        Closed curves, outer loops counter-clockwise seen from outside, holes clockwise; empty if there are
        none.
    """
    way = CURVE_FINDERS[type(surface)]
    if faces is None:
        faces = way.reaching(mesh, surface, nudge_mm)
    return way.on_one(mesh, surface, tolerance_mm, nudge_mm, faces) if len(faces) else []


def intersect_offsets(
    mesh: Mesh, base: Surface, heights_mm: npt.ArrayLike, tolerance_mm: float = 0.01
) -> list[list[Curve]]:
    """Curves in which a closed mesh meets the offsets of a surface: what `intersect` gives, in one go.

    Args:
        mesh: the solid, part frame, mm.
        base: what is offset.
        heights_mm: how far outward each, ascending.
        tolerance_mm: greatest distance between the exact curve and the chord of two successive points.

    Returns:
        The curves on every offset.
    """
    return CURVE_FINDERS[type(base)].on_offsets(mesh, base, np.asarray(heights_mm, dtype=np.float64), tolerance_mm)


def _all_at_once(
    mesh: Mesh, surface: Plane | Cylinder, tolerance_mm: float, nudge_mm: float, faces: Ints
) -> list[Curve]:
    (curves,) = level_curves(mesh, surface, np.zeros(1), tolerance_mm, nudge_mm, faces)
    return curves


def _band_by_band(
    mesh: Mesh, surface: Cone | Revolved, tolerance_mm: float, nudge_mm: float, faces: Ints
) -> list[Curve]:
    near = np.unique(mesh.faces[faces])
    outside = _nudge(surface.distance(mesh.vertices[near]), nudge_mm, mesh.noise_mm)
    return round_curves(mesh, faces, surface.offset(outside), tolerance_mm)


def _offset_by_offset(mesh: Mesh, base: Surface, heights: Floats, tolerance_mm: float) -> list[list[Curve]]:
    intervals = FaceIntervals.about(mesh, base)
    return [intersect(mesh, base.offset(h), tolerance_mm, faces=intervals.at(h)) for h in heights.tolist()]


def _on_cones(mesh: Mesh, base: Cone, heights: Floats, tolerance_mm: float) -> list[list[Curve]]:
    if abs(base.slope) >= STEEPEST and len(heights):
        return cone_curves(mesh, base, heights, tolerance_mm)
    return _offset_by_offset(mesh, base, heights, tolerance_mm)


def _reach_mm(mesh: Mesh, nudge_mm: float) -> float:
    """How far outside a surface the cut may really lie."""
    return nudge_mm + REACH_MM + 2.0 * mesh.noise_mm


def _by_spheres(mesh: Mesh, surface: Surface, nudge_mm: float) -> Ints:
    """Triangles (k,) that may reach a surface, by spheres around them."""
    centres, radii = mesh.bounding_spheres
    return np.flatnonzero(np.abs(surface.distance(centres)) <= radii + _reach_mm(mesh, nudge_mm))


def _by_corners(mesh: Mesh, surface: Plane | Cylinder, nudge_mm: float) -> Ints:
    """The same where the surface's inside is convex: a triangle with all corners inside lies inside."""
    centres, radii = mesh.bounding_spheres
    height, farthest = surface.distance(mesh.vertices), _reach_mm(mesh, nudge_mm)
    low = surface.may_reach(height, farthest, float(radii.max(initial=0.0)))
    a, b, c = ((low + 2 * (height > nudge_mm).view(np.uint8)).take(corner) for corner in mesh.corners)
    faces = np.flatnonzero((a | b | c) == 3)
    return faces[np.flatnonzero(np.abs(surface.distance(centres[faces])) <= radii[faces] + farthest)]


@dataclass(frozen=True)
class _CurveFinder:
    """How curves on a kind of surface are found.

    Attributes:
        reaching: the triangles that may reach it.
        on_one: the curves on it.
        on_offsets: the curves on its offsets.
    """

    reaching: Callable[..., Ints]
    on_one: Callable[..., list[Curve]]
    on_offsets: Callable[..., list[list[Curve]]]


CURVE_FINDERS: dict[type, _CurveFinder] = {
    Plane: _CurveFinder(_by_corners, _all_at_once, level_curves),
    Cylinder: _CurveFinder(_by_corners, _all_at_once, level_curves),
    Cone: _CurveFinder(_by_spheres, _band_by_band, _on_cones),
    Revolved: _CurveFinder(_by_spheres, _band_by_band, _offset_by_offset),
}


def _nudge(heights: Floats, nudge_mm: float, noise_mm: float) -> float:
    """How far outward to cut: just past the vertices that lie on the surface to within the rounding."""
    touching = heights[(heights > 0.0) & (heights <= noise_mm)]
    return max(nudge_mm, float(touching.max()) + NUDGE_MM) if len(touching) else nudge_mm
