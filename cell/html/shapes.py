"""The shapes of a compiled model as triangles with normals, small enough to be sent.

    triangles = geom_triangles(model, geom)            # in the geom's frame, m
    geom_json(pack, triangles)                         # quantised, for web/scene.js

Metres.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from ik.chain import Floats

from ..arrays import Ints
from .pack import Pack

MOST_FACES = 30_000  # of one mesh; finer ones are coarsened
ROUND_SIDES = 32  # sides of a round shape
GRID = 32767
CREASE = np.cos(np.deg2rad(35.0))  # faces that meet at more are an edge
CROWDED = 64  # corners at one place, from which on those of like direction are taken together
LIKE = 8  # steps of a unit vector's component that count as one direction: about 7 deg
PAIRS = 1_000_000  # of corners at a time


@dataclass(frozen=True, eq=False)
class DrawnTriangles:
    """A surface.

    Attributes:
        vertices: (v, 3), m.
        normals: (v, 3), unit.
        faces: (f, 3).
    """

    vertices: Floats
    normals: Floats
    faces: Ints


def geom_triangles(model: mujoco.MjModel, geom: int, most_faces: int = MOST_FACES) -> DrawnTriangles | None:
    """The surface of a geom in its own frame; None for planes and what has no surface."""
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        return _mesh(model, int(model.geom_dataid[geom]), most_faces)
    make = _MAKERS.get(kind)
    return None if make is None else make(size)


def geom_json(pack: Pack, shape: DrawnTriangles) -> dict[str, Any]:
    """A surface quantised to 16 bits a coordinate and 8 a normal's."""
    low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    middle, half = (low + high) / 2, np.maximum((high - low) / 2, 1e-9)
    return {
        "middle": [round(float(v), 7) for v in middle],
        "half": [round(float(v), 7) for v in half],
        "vertices": pack.put(np.rint((shape.vertices - middle) / half * GRID).clip(-GRID, GRID), "i2"),
        "normals": pack.put(np.rint(shape.normals * 127), "i1"),
        "faces": pack.put(shape.faces, "u2" if len(shape.vertices) < 65536 else "u4"),
    }


def _mesh(model: mujoco.MjModel, mesh: int, most_faces: int) -> DrawnTriangles:
    vertices = _rows(model.mesh_vert, model.mesh_vertadr, model.mesh_vertnum, mesh).astype(np.float64)
    faces = _rows(model.mesh_face, model.mesh_faceadr, model.mesh_facenum, mesh).astype(np.int64)
    if len(faces) > most_faces:
        vertices, faces = _coarsened(vertices, faces, most_faces)
    return _creased(vertices, faces)


def _rows(values: NDArray[Any], start: NDArray[Any], count: NDArray[Any], i: int) -> NDArray[Any]:
    return values[start[i] : start[i] + count[i]]


def _coarsened(vertices: Floats, faces: Ints, most: int) -> tuple[Floats, Ints]:
    """A mesh whose vertices are gathered on a grid that is coarse enough."""
    low = vertices.min(axis=0)
    cell = float(np.ptp(vertices, axis=0).max()) / 256
    while True:
        key = np.rint((vertices - low) / cell).astype(np.int64)
        _, index = np.unique(key, axis=0, return_inverse=True)
        index = index.ravel()
        f = index[faces]
        f = f[(f[:, 0] != f[:, 1]) & (f[:, 1] != f[:, 2]) & (f[:, 2] != f[:, 0])]
        if len(f) <= most:
            break
        cell *= 1.3
    count = np.bincount(index)
    return np.stack([np.bincount(index, vertices[:, k]) for k in range(3)], axis=1) / count[:, None], f


def _creased(vertices: Floats, faces: Ints) -> DrawnTriangles:
    """A mesh with normals that are smooth but for its sharp edges; a vertex on one becomes several."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    weighted = np.cross(b - a, c - a)
    flat = weighted / np.maximum(np.linalg.norm(weighted, axis=1), 1e-30)[:, None]
    # MuJoCo may keep a place more than once
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    corner = place.ravel()[faces].ravel()
    unit, at, weight = _units(corner, np.repeat(weighted, 3, axis=0), np.repeat(flat, 3, axis=0))
    sums = _smooth_sums(at, weight)[unit]
    normals = sums / np.maximum(np.linalg.norm(sums, axis=1), 1e-30)[:, None]
    key = np.column_stack([corner, np.rint(normals * 100).astype(np.int64)])
    _, first, index = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return DrawnTriangles(vertices[faces.ravel()[first]], normals[first], index.reshape(-1, 3))


def _units(corner: Ints, weighted: Floats, flat: Floats) -> tuple[Ints, Ints, Floats]:
    """Faces' corners, each by itself; where many meet, as about a cap's middle, those of like direction as one.

    Args:
        corner: place of each corner, (c,).
        weighted: normal of its face, as long as twice its area, (c, 3).
        flat: the same of length 1, (c, 3).

    Returns:
        The unit of each corner, (c,), and of each unit its place, (u,), and the sum of its normals, (u, 3).
    """
    crowded = np.bincount(corner)[corner] > CROWDED
    like = np.where(crowded[:, None], np.rint(flat * LIKE).astype(np.int64), 0)
    own = np.where(crowded, -1, np.arange(len(corner)))
    key, first, unit = np.unique(np.column_stack([corner, own, like]), axis=0, return_index=True, return_inverse=True)
    sums = np.stack([np.bincount(unit.ravel(), weighted[:, k], len(key)) for k in range(3)], axis=1)
    return unit.ravel().astype(np.int64), corner[first], sums.astype(np.float64)


def _smooth_sums(at: Ints, weight: Floats) -> Floats:
    """Of each unit the sum over those at its place that meet it at less than a sharp edge, (u, 3).

    Args:
        at: place of each unit, (u,), ascending.
        weight: sum of its normals, (u, 3).
    """
    direction = weight / np.maximum(np.linalg.norm(weight, axis=1), 1e-30)[:, None]
    count = np.bincount(at)
    end = np.cumsum(count)
    sums = np.empty_like(weight)
    pairs = np.cumsum(count**2)
    first = 0
    while first < len(count):  # a few places at a time: memory in proportion to the faces
        last = max(int(np.searchsorted(pairs, (pairs[first - 1] if first else 0) + PAIRS, side="right")), first + 1)
        low, high = int(end[first] - count[first]), int(end[last - 1])
        mates = count[at[low:high]]
        mine = np.repeat(np.arange(low, high), mates)
        step = np.arange(len(mine)) - np.repeat(np.cumsum(mates) - mates, mates)
        other = (end - count)[at[mine]] + step
        smooth = np.einsum("ij,ij->i", direction[mine], direction[other]) > CREASE
        sums[low:high] = np.stack(
            [np.bincount(mine - low, np.where(smooth, weight[other, k], 0.0), high - low) for k in range(3)], axis=1
        )
        first = last
    return sums


def _box(size: Floats) -> DrawnTriangles:
    vertices: list[Floats] = []
    normals: list[Floats] = []
    faces: list[tuple[int, int, int]] = []
    for axis in range(3):
        u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
        for side in (1.0, -1.0):
            out = side * np.eye(3)[axis]
            k = len(vertices)
            vertices += [(out + a * u + b * side * v) * size for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            normals += [out] * 4
            faces += [(k, k + 1, k + 2), (k, k + 2, k + 3)]
    return DrawnTriangles(np.array(vertices), np.array(normals), np.array(faces))


def _revolved(profile: Floats, normals: Floats) -> DrawnTriangles:
    """A surface of revolution about z.

    Args:
        profile: (r, z) from the bottom up, (k, 2), m.
        normals: theirs, (r, z), (k, 2); a repeated point is a sharp edge.
    """
    angle = 2 * np.pi * np.arange(ROUND_SIDES) / ROUND_SIDES
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    k = len(profile)

    def turned(rz: Floats) -> Floats:
        xy = rz[:, None, :1] * ring
        z = np.broadcast_to(rz[:, None, 1:], (k, ROUND_SIDES, 1))
        return np.concatenate([xy, z], axis=2).reshape(-1, 3)

    i, j = np.arange(k - 1)[:, None] * ROUND_SIDES, np.arange(ROUND_SIDES)
    a, b = i + j, i + (j + 1) % ROUND_SIDES
    quads = np.stack([a, b, b + ROUND_SIDES, a, b + ROUND_SIDES, a + ROUND_SIDES], axis=2).reshape(-1, 3)
    return DrawnTriangles(turned(profile), turned(normals), quads)


def _cylinder(size: Floats) -> DrawnTriangles:
    r, h = size[:2]
    profile = np.array([(0, -h), (r, -h), (r, -h), (r, h), (r, h), (0, h)])
    return _revolved(profile, np.array([(0, -1), (0, -1), (1, 0), (1, 0), (0, 1), (0, 1)], dtype=np.float64))


def _capsule(size: Floats) -> DrawnTriangles:
    r, h = size[:2]
    angle = np.linspace(-np.pi / 2, np.pi / 2, 13)
    angle = np.insert(angle, 6, 0.0)
    out = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return _revolved(out * r + np.where(np.arange(14) < 7, -h, h)[:, None] * np.array([0, 1]), out)


def _ellipsoid(size: Floats) -> DrawnTriangles:
    angle = np.linspace(-np.pi / 2, np.pi / 2, 17)
    out = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ball = _revolved(out, out)
    normals = ball.normals / size
    return DrawnTriangles(ball.vertices * size, normals / np.linalg.norm(normals, axis=1)[:, None], ball.faces)


def _sphere(size: Floats) -> DrawnTriangles:
    return _ellipsoid(np.repeat(size[0], 3))


_MAKERS: dict[int, Callable[[Floats], DrawnTriangles]] = {
    int(mujoco.mjtGeom.mjGEOM_BOX): _box,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): _cylinder,
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): _capsule,
    int(mujoco.mjtGeom.mjGEOM_SPHERE): _sphere,
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): _ellipsoid,
}
