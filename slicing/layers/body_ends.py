"""Where a body ends along its axis, and what of a sub-volume lies over its ends.

    z_mm = body_ends(((20.0, 0.0), (20.0, 40.0)), CylindricalBody(20.0))    # (0.0, 40.0)
    root = part_between_heights(mesh, z_mm)  # the part of a sub-volume that has the body below it
    over_ends_mm3(mesh, CylindricalBody(20.0), z_mm)             # what lies within the radius beyond the ends

The rule: layer 0 lies on the body that is there, so it ends where the body ends. Offsets of a cylinder or a cone
continue beyond its ends; the first layers there have nothing below (`slicing.beads.overhang` reports it). The volume
within the body's radius beyond its ends is in no offset; planes contain it as far as they reach. A warning gives this
volume. The layers of strategy revolved go round the ends instead: there the end faces belong to the body's profile.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..mesh.manifold import manifold_of, triangles_of
from ..mesh.solid import Mesh
from ..surfaces.bodies import Body

NO_ENDS = (-math.inf, math.inf)
GAP_MM, GAP_SHARE = 0.1, 0.005  # how far a profile may lie below the body's surface, and as a share of the radius
FINE_MM = 0.05  # places along a profile
BEYOND_MM = 0.1  # what reaches less far over an end does not count
BODY_SIDES = 512  # sides of the body that is taken off
SHOULDER_MM = 1e-6  # below and above a point of a profile its radius is taken: it may jump there


def body_ends(profile: Sequence[tuple[float, float]], body: Body) -> tuple[float, float]:
    """Where the body that is there has the surface that a sub-volume is sliced from.

    Args:
        profile: (r, z) points of the body that is there, mm.
        body: as a strategy sees it.

    Returns:
        Lower and upper end, mm; infinite where the profile lies nowhere on that surface.
    """
    points = np.asarray(profile, dtype=np.float64)
    step = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1))
    at = np.append(0.0, np.cumsum(step))
    if at[-1] <= 0.0:
        return NO_ENDS
    fine = np.unique(np.concatenate([at, np.linspace(0.0, at[-1], min(int(at[-1] / FINE_MM) + 2, 20_000))]))
    r, z = (np.interp(fine, at, points[:, k]) for k in range(2))
    x, y = body.axis_xy_mm
    below = -body.surface.distance(np.stack([x + r, np.full(len(r), y), z], axis=1))
    there = below <= np.maximum(max(GAP_MM, body.off_mm), GAP_SHARE * r)
    if not there.any():
        return NO_ENDS
    low, high = float(z[there].min()), float(z[there].max())
    round_low, round_high = body.closes_ends  # a profile that is closed on the axis goes round its ends
    return -math.inf if round_low else low, math.inf if round_high else high


def reach_beyond(heights: np.ndarray, z_mm: tuple[float, float]) -> bool:
    """Whether heights (n,) reach over an end, mm."""
    return bool(heights.min() < z_mm[0] - BEYOND_MM or heights.max() > z_mm[1] + BEYOND_MM)


def part_between_heights(mesh: Mesh, z_mm: tuple[float, float]) -> Mesh:
    """The part of a solid between two heights.

    Args:
        mesh: closed.
        z_mm: the heights.

    Returns:
        The part; without faces where there is none.
    """
    solid = _solid(mesh)
    for height, way in ((z_mm[0], 1.0), (z_mm[1], -1.0)):
        if math.isfinite(height):
            solid = solid.trim_by_plane((0.0, 0.0, way), way * height)
    return Mesh(mesh.name, *triangles_of(solid))


def over_ends_mm3(mesh: Mesh, body: Body, z_mm: tuple[float, float]) -> float:
    """Volume of what a sub-volume has within the body's surface beyond its ends, mm³.

    Args:
        mesh: the sub-volume.
        body: the body.
        z_mm: its ends.
    """
    low, high = (float(v) for v in mesh.bounds[:, 2])
    total = 0.0
    for a, b in ((low, min(z_mm[0], high)), (max(z_mm[1], low), high)):
        if b - a > 1e-6:
            beyond = _solid(part_between_heights(mesh, (a if a > low else -math.inf, b if b < high else math.inf)))
            total += float((beyond ^ _turned(body, a - 1.0, b + 1.0)).volume())
    return total


def without_body(mesh: Mesh, body: Body, z_mm: tuple[float, float]) -> Mesh:
    """What a sub-volume has outside the body that is there.

    Args:
        mesh: the sub-volume.
        body: the body.
        z_mm: its ends; `NO_ENDS` where its surface goes on.

    Returns:
        The rest; without faces where there is none.
    """
    low, high = max(z_mm[0], float(mesh.bounds[0, 2]) - 1.0), min(z_mm[1], float(mesh.bounds[1, 2]) + 1.0)
    return Mesh(mesh.name, *triangles_of(_solid(mesh) - _turned(body, low, high)))


def closed_over(mesh: Mesh, body: Body, z_mm: tuple[float, float]) -> Body:
    """A body with its end faces where a sub-volume lies over them.

    Args:
        mesh: the sub-volume.
        body: the body.
        z_mm: its ends.
    """
    low, high = (float(v) for v in mesh.bounds[:, 2])
    return body.with_end_faces(low < z_mm[0] - BEYOND_MM, high > z_mm[1] + BEYOND_MM)


def _turned(body: Body, low: float, high: float) -> Any:
    """The body between two heights, as a solid of manifold3d."""
    import manifold3d

    surface = body.surface
    inner = np.zeros(0) if surface.is_straight else surface.chain(1e-3).z  # a cone's tip, a profile's points
    inner = np.concatenate([inner - SHOULDER_MM, inner + SHOULDER_MM])
    z = np.concatenate([[low], np.sort(inner[(inner > low) & (inner < high)]), [high]])
    radius = surface.radius_at(z)
    polygon = np.concatenate([[[0.0, low]], np.stack([radius, z], axis=1), [[0.0, high]]])
    solid = manifold3d.Manifold.revolve(manifold3d.CrossSection([polygon.tolist()]), BODY_SIDES)
    return solid.translate((float(body.axis_xy_mm[0]), float(body.axis_xy_mm[1]), 0.0))


def _solid(mesh: Mesh) -> Any:
    return manifold_of(mesh.vertices, mesh.faces, mesh.name)
