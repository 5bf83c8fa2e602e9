"""Faces of a mesh that cross each other, found in near-linear time and memory.

    found = crossings(mesh.vertices, mesh.faces, reach_mm=1e-5)
    found.pairs, found.points, found.depth_mm

Boxes of the faces, in the order of a space-filling curve, make a binary tree; it is walked against itself level by
level, in batches. Pairs whose boxes overlap and that share no vertex (neighbours do not count) are compared with each
other's planes, and what is left is tested exactly: two triangles cross where a side of one pierces the other. A side
that passes through the border between two faces crosses only if it pierces both, so that solids which merely touch do
not count. Both ends of a piercing side lie more than `reach_mm` off the plane: rounding is no crossing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arrays import Bools, Floats, Ints

Numbers = npt.NDArray[Any]  # of boxes (int32), and their sides (float32)

BATCH = 200_000  # pairs of boxes examined together
GRID = 2**16  # steps of the space-filling curve along an axis


@dataclass(frozen=True, eq=False)
class Crossings:
    """Pairs of faces that cross.

    Attributes:
        pairs: (k, 2) face numbers.
        points: (k, 3) a point of each crossing, mm.
        depth_mm: (k,) how far the one sticks through the other, about.
    """

    pairs: Ints
    points: Floats
    depth_mm: Floats

    def __len__(self) -> int:
        return len(self.pairs)


def crossings(vertices: Floats, faces: Ints, reach_mm: float) -> Crossings:
    """Pairs of faces without a common vertex that cross each other.

    Args:
        vertices: (n, 3) mm.
        faces: (m, 3) vertex indices.
        reach_mm: what sticks through less is rounding.

    Returns:
        The crossings, in no particular order.
    """
    order = _curve_order(vertices, faces)
    sorted_faces = faces[order]
    levels = _tree(vertices, sorted_faces)
    hits: list[_PiercedFaces] = []
    root: Numbers = np.zeros(1, dtype=np.intp)
    todo: list[tuple[int, Numbers, Numbers]] = [(len(levels) - 1, root, root)]
    while todo:
        level, i, j = todo.pop()
        if len(i) > BATCH:
            todo += [(level, i[BATCH:], j[BATCH:]), (level, i[:BATCH], j[:BATCH])]
            continue
        i, j = _overlapping(*levels[level], i, j)
        if level:
            todo.append((level - 1, *_children(i, j, levels[level - 1][0].shape[1])))
        else:
            hits.append(_pierced(vertices, sorted_faces, np.stack([i, j], axis=1)[i != j], reach_mm))
    return _gathered(_PiercedFaces.of(hits), order)


def _curve_order(vertices: Floats, faces: Ints) -> Ints:
    """Faces in the order of a space-filling curve through their centres."""
    centres = (vertices[faces[:, 0]] + vertices[faces[:, 1]] + vertices[faces[:, 2]]) / 3.0
    low = centres.min(axis=0)
    step = max(float(np.ptp(centres, axis=0).max()), 1e-300) / (GRID - 1)
    code = np.zeros(len(faces), dtype=np.int64)
    for k in range(3):
        bits = ((centres[:, k] - low[k]) / step).astype(np.int64)
        for shift, mask in ((32, 0x1F00000000FFFF), (16, 0x1F0000FF0000FF), (8, 0x100F00F00F00F00F)):
            bits = (bits | (bits << shift)) & mask
        for shift, mask in ((4, 0x10C30C30C30C30C3), (2, 0x1249249249249249)):
            bits = (bits | (bits << shift)) & mask
        code |= bits << k
    return np.argsort(code, kind="stable")


def _tree(vertices: Floats, faces: Ints) -> list[tuple[Numbers, Numbers]]:
    """Boxes ((3, n) low, (3, n) high) of the faces and of ever larger groups of them, single precision, outward."""
    corners = [vertices[faces[:, k]].T for k in range(3)]
    low = np.minimum(np.minimum(corners[0], corners[1]), corners[2])
    high = np.maximum(np.maximum(corners[0], corners[1]), corners[2])
    below = np.nextafter(low.astype(np.float32), np.float32(-np.inf))
    above = np.nextafter(high.astype(np.float32), np.float32(np.inf))
    levels = [(below, above)]
    while below.shape[1] > 1:
        if below.shape[1] % 2:
            below, above = (np.concatenate([v, v[:, -1:]], axis=1) for v in (below, above))
        below = np.minimum(below[:, ::2], below[:, 1::2])
        above = np.maximum(above[:, ::2], above[:, 1::2])
        levels.append((below, above))
    return levels


def _overlapping(low: Numbers, high: Numbers, i: Numbers, j: Numbers) -> tuple[Numbers, Numbers]:
    """Pairs of boxes that overlap; a box and itself always do."""
    for k in range(3):
        meet = low[k].take(i) <= high[k].take(j)
        meet &= low[k].take(j) <= high[k].take(i)
        rows = np.flatnonzero(meet)
        i, j = i.take(rows), j.take(rows)
    return i, j


def _children(i: Numbers, j: Numbers, size: int) -> tuple[Numbers, Numbers]:
    """Pairs of the halves of two groups, each once; `size` is how many halves there are."""
    apart = i != j
    i, j = 2 * i, 2 * j
    first = np.concatenate([i, i, i + 1, (i + 1)[apart]])
    second = np.concatenate([j, j + 1, j + 1, j[apart]])
    if len(first) and max(int(first.max()), int(second.max())) >= size:  # an odd one out has one half only
        whole = (first < size) & (second < size)
        first, second = first[whole], second[whole]
    return first, second


@dataclass(frozen=True, eq=False)
class _PiercedFaces:
    """Sides that pierce faces.

    Attributes:
        faces: (k, 2) the face that is pierced and the one whose side pierces it, in the tree's order.
        points: (k, 3) where, mm.
        depth_mm: (k,) the least of how far the side's ends lie off the plane and how far inside the face it passes.
        border: (k, 4) vertices of the side and of the face's edge that it passes through; -1 for the inside.
    """

    faces: Ints
    points: Floats
    depth_mm: Floats
    border: Ints

    @classmethod
    def of(cls, parts: list[_PiercedFaces]) -> _PiercedFaces:
        """Several as one."""
        none = cls(np.zeros((0, 2), np.int64), np.zeros((0, 3)), np.zeros(0), np.zeros((0, 4), np.int64))
        parts = [none, *parts]
        return cls(
            np.concatenate([part.faces for part in parts]),
            np.concatenate([part.points for part in parts]),
            np.concatenate([part.depth_mm for part in parts]),
            np.concatenate([part.border for part in parts]),
        )

    def __getitem__(self, rows: Ints) -> _PiercedFaces:
        return _PiercedFaces(self.faces[rows], self.points[rows], self.depth_mm[rows], self.border[rows])


def _pierced(vertices: Floats, faces: Ints, pairs: Ints, reach_mm: float) -> _PiercedFaces:
    """Sides that pierce faces, among pairs whose boxes overlap."""
    a, b = faces[pairs[:, 0]], faces[pairs[:, 1]]
    shared = np.zeros(len(pairs), dtype=bool)
    for k in range(3):
        shared |= (a == b[:, k : k + 1]).any(axis=1)
    pairs = pairs[~shared]
    for one, other in ((0, 1), (1, 0)):
        pairs = pairs[_straddles(vertices, faces[pairs[:, one]], faces[pairs[:, other]], reach_mm)]
    both = np.concatenate([pairs, pairs[:, ::-1]])
    return _PiercedFaces.of([_sides_through(vertices, faces, both, k, reach_mm) for k in range(3)])


def _unit_normals(corners: Floats) -> Floats:
    """Unit normals (n, 3) of triangles (n, 3, 3); zero for triangles without area."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.sqrt((normal**2).sum(axis=1))
    return normal / np.where(length > 0, length, 1.0)[:, None]


def _straddles(vertices: Floats, plane: Ints, other: Ints, reach_mm: float) -> Bools:
    """Whether the triangles `other` have corners well on both sides of the planes of the triangles `plane`."""
    corners = vertices[plane]
    height = np.einsum("nkc,nc->nk", vertices[other] - corners[:, :1], _unit_normals(corners))
    return (height.max(axis=1) > reach_mm) & (height.min(axis=1) < -reach_mm)


def _sides_through(vertices: Floats, faces: Ints, pairs: Ints, k: int, reach_mm: float) -> _PiercedFaces:
    """Where the k-th side of the second face of each pair pierces the first."""
    corners = vertices[faces[pairs[:, 0]]]
    normal = _unit_normals(corners)
    start, end = faces[pairs[:, 1], k], faces[pairs[:, 1], (k + 1) % 3]
    p, q = (((vertices[v] - corners[:, 0]) * normal).sum(axis=1) for v in (start, end))
    off = np.minimum(np.abs(p), np.abs(q))
    rows = np.flatnonzero((p * q < 0) & (off > reach_mm))
    pairs, corners, normal, start, end = pairs[rows], corners[rows], normal[rows], start[rows], end[rows]
    share = (p[rows] / (p[rows] - q[rows]))[:, None]
    points = vertices[start] + share * (vertices[end] - vertices[start])
    inside = np.stack([_inside_by(corners, normal, points, e) for e in range(3)], axis=1)
    nearest = np.argmin(inside, axis=1)
    least, second = np.sort(inside, axis=1)[:, :2].T
    face = faces[pairs[:, 0]]
    each = np.arange(len(pairs))
    one, other = face[each, nearest], face[each, (nearest + 1) % 3]
    ends = (np.minimum(start, end), np.maximum(start, end), np.minimum(one, other), np.maximum(one, other))
    border = np.stack(ends, axis=1)
    border[least > reach_mm] = -1
    depth = np.where(least > reach_mm, np.minimum(off[rows], least), off[rows])
    return _PiercedFaces(pairs, points, depth, border)[np.flatnonzero((least > -reach_mm) & (second > reach_mm))]


def _inside_by(corners: Floats, normal: Floats, points: Floats, edge: int) -> Floats:
    """How far inside an edge of its triangle a point lies, mm (n,)."""
    along = corners[:, (edge + 1) % 3] - corners[:, edge]
    length = np.sqrt((along**2).sum(axis=1))
    inward = np.cross(normal, along) / np.where(length > 0, length, 1.0)[:, None]
    return ((points - corners[:, edge]) * inward).sum(axis=1)


def _gathered(hits: _PiercedFaces, order: Ints) -> Crossings:
    """One crossing a pair of faces, at its deepest point, by the faces' own numbers."""
    at_border = hits.border[:, 0] >= 0
    rows = np.flatnonzero(at_border)
    if len(rows):
        # through a border counts if the faces on both sides of it are pierced
        _, group = np.unique(hits.border[rows], axis=0, return_inverse=True)
        pierced = np.unique(np.stack([group.reshape(-1), hits.faces[rows, 0]], axis=1), axis=0)
        sides = np.bincount(pierced[:, 0])
        at_border[rows] = sides[group.reshape(-1)] < 2
    hits = hits[np.flatnonzero(~at_border)]
    pairs = np.sort(order[hits.faces], axis=1)
    deepest = np.lexsort((-hits.depth_mm, pairs[:, 1], pairs[:, 0]))
    pairs = pairs[deepest]
    first = np.ones(len(pairs), dtype=bool)
    first[1:] = (pairs[1:] != pairs[:-1]).any(axis=1)
    return Crossings(pairs[first], hits.points[deepest[first]], hits.depth_mm[deepest[first]])
