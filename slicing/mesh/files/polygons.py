"""Triangles of the polygons that mesh files hold: each divided as it is, never as a fan that leaves it.

    found = triangulated(points, [4, 6], [0, 1, 2, 3, 4, 5, 6, 7, 8, 9], "part.obj")
    found.vertices, found.faces, found.lines

A polygon whose fan from its first corner stays within it keeps that fan. Any other, above all a concave one, is divided
in its own plane (Newell's normal). A polygon whose border crosses itself has no inside and is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Floats, Ints, PartError
from ...warning import Code, Warning

FLAT_SHARE = 1e-9  # of a polygon's doubled area: a fan's triangle must look its way by more
SAME_AREA = 1e-6  # share by which the triangles of a polygon may differ from it
WARPED_SHARE = 1e-3  # of its extent: a corner farther off a polygon's plane is reported


@dataclass(frozen=True, eq=False)
class Triangles:
    """What a file holds, in its own unit.

    Attributes:
        vertices: (n, 3) positions.
        faces: (m, 3) vertex indices.
        lines: what was odd about the file, one line each.
        unit: the unit that the file states; None where it states none.
    """

    vertices: Floats
    faces: Ints
    lines: tuple[str, ...] = ()
    unit: str | None = None


def triangulated(points: Floats, count: Sequence[int] | Ints, corners: Sequence[int] | Ints, name: str) -> Triangles:
    """Triangles of polygons.

    Args:
        points: (n, 3) vertices.
        count: (p,) how many corners each polygon has.
        corners: (sum of count,) their vertex indices, polygon after polygon.
        name: for the messages.

    Returns:
        The vertices and the triangles, in the order of the polygons; lines about polygons that are not flat, or have
        fewer than three corners.

    Raises:
        PartError: an index out of range, or a polygon whose border crosses itself.
    """
    sizes, index = np.asarray(count, dtype=np.int64), np.asarray(corners, dtype=np.int64)
    if len(index) and (index.min() < 0 or index.max() >= len(points)):
        raise PartError(f"{name}: a face names a vertex outside 0 .. {len(points) - 1}")
    first = np.cumsum(sizes) - sizes
    faces: list[Ints] = []
    owner: list[Ints] = []
    warped: list[float] = []
    for size in np.unique(sizes[sizes > 2]).tolist():
        rows = np.flatnonzero(sizes == size)
        polygons = index[first[rows][:, None] + np.arange(size)]
        fan = np.stack([np.broadcast_to(polygons[:, :1], (len(rows), size - 2)), polygons[:, 1:-1], polygons[:, 2:]], 2)
        divided = np.zeros(len(rows), dtype=bool)
        if size > 3:
            divided = ~_fans_within(points, fan)
            warped += _warped(points, polygons).tolist()
        faces.append(fan[~divided].reshape(-1, 3))
        owner.append(np.repeat(rows[~divided], size - 2))
        for row, polygon in zip(rows[divided].tolist(), polygons[divided], strict=True):
            own = _divided(points, polygon, f"{name}: polygon {row + 1} of {len(sizes)}")
            faces.append(own)
            owner.append(np.full(len(own), row))
    lines: list[str] = []
    if warped:
        lines.append(
            Warning(
                Code.POLYGON_NOT_FLAT,
                f"{name}: {len(warped)} polygons are not flat: their corners are up to {max(warped):.3g} (in the file's"
                " unit) off their planes; they were divided into triangles, which another program may do differently",
            )
        )
    if (sizes < 3).any():
        few = int((sizes < 3).sum())
        lines.append(Warning(Code.MESH_REPAIRED, f"{name}: dropped {few} faces of fewer than three corners"))
    if not faces:
        return Triangles(points, np.zeros((0, 3), dtype=np.int64), tuple(lines))
    order = np.argsort(np.concatenate(owner), kind="stable")
    return Triangles(points, np.concatenate(faces)[order], tuple(lines))


def _newell(corners: Floats) -> Floats:
    """Normals (p, 3) of polygons (p, k, 3), twice as long as they are large."""
    from_first = corners - corners[:, :1]
    normal: Floats = np.cross(from_first, np.roll(from_first, -1, axis=1)).sum(axis=1)
    return normal


def _fans_within(points: Floats, fan: Ints) -> np.ndarray:
    """Whether the fans (p, k - 2, 3) of polygons look one way all over; true of polygons without area or numbers."""
    a, b, c = (points[fan[:, :, k]] for k in range(3))
    with np.errstate(invalid="ignore", over="ignore"):
        each = np.cross(b - a, c - a)
        normal = each.sum(axis=1)
        length2 = (normal**2).sum(axis=1)
        least = (each * normal[:, None]).sum(axis=2).min(axis=1)
        # the fan goes round its first corner by less than a half turn where every corner is convex
        turn = np.cross(b[:, :-1] - a[:, :-1], c[:, 1:] - a[:, 1:]) if fan.shape[1] > 1 else each
        convex = (turn * normal[:, None]).sum(axis=2).min(axis=1) >= -FLAT_SHARE * length2
        within: np.ndarray = ((least > FLAT_SHARE * length2) & convex) | ~(length2 > 0) | ~np.isfinite(length2)
    return within


def _warped(points: Floats, polygons: Ints) -> Floats:
    """How far corners lie off the planes of those polygons (p, k) that are visibly not flat."""
    corners = points[polygons]
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        normal = _newell(corners)
        normal /= np.sqrt((normal**2).sum(axis=1))[:, None]
        height = ((corners - corners.mean(axis=1)[:, None]) * normal[:, None]).sum(axis=2)
        off, extent = np.abs(height).max(axis=1), np.ptp(corners, axis=1).max(axis=1)
        found: Floats = off[off > WARPED_SHARE * extent]
    return found


def _divided(points: Floats, polygon: Ints, name: str) -> Ints:
    """Triangles (k, 3) of one polygon, divided in its own plane."""
    import manifold3d  # heavy: only where a polygon is not convex

    corners = points[polygon]
    normal = _newell(corners[None])[0]
    twice = float(np.sqrt(normal @ normal))
    u = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    u /= np.sqrt(u @ u)
    flat = np.stack([(corners - corners[0]) @ u, (corners - corners[0]) @ np.cross(normal / twice, u)], axis=1)
    local = np.asarray(manifold3d.triangulate([np.ascontiguousarray(flat)])).reshape(-1, 3)
    a, b, c = (flat[local[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    if len(local) != len(polygon) - 2 or abs(np.abs(area).sum() - twice) > SAME_AREA * twice:
        at = ", ".join(f"{v:.6g}" for v in corners[0])
        raise PartError(
            f"{name} (a corner at ({at}) in the file's unit) has a border that crosses itself; it has no inside"
        )
    return polygon[local]
