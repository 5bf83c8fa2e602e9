"""Flat regions whose faces lie on one another: concave polygons that a program divided as fans, mended.

    mesh = unfolded(mesh)

A fan from a corner of a concave polygon leaves the polygon and comes back: two neighbours lie in one plane and look
opposite ways. Their sum bounds the right solid, but sections run out along the fold and back. The faces of such a plane
are replaced by others within the same border; no vertex moves and the volume stays.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from .closing import repaired
from .mesh_edges import MeshEdges
from .solid import Bools, Floats, Ints, Mesh

SAME_PLANE = 1e-6  # 1 - cosine of the angle between faces of one plane
SAME_AREA = 1e-9  # share by which the new faces may differ from the old ones' sum


def unfolded(mesh: Mesh) -> Mesh:
    """A mesh without faces that are folded back onto their neighbours in one plane.

    Args:
        mesh: closed and oriented.

    Returns:
        The same mesh where there are none, or where their plane's border is no polygon; else one with other faces
        there, which is reported.
    """
    length = np.sqrt((mesh.normals**2).sum(axis=1))
    thin = _thickness(mesh, length) <= 8.0 * mesh.noise_mm  # slivers have no plane of their own
    pairs = MeshEdges.of(len(mesh.vertices), mesh.faces).pairs() // 3
    normal = mesh.normals / np.where(length > 0, length, 1.0)[:, None]
    cosine = (normal[pairs[:, 0]] * normal[pairs[:, 1]]).sum(axis=1)
    thick = ~thin[pairs].any(axis=1)
    if not thin.any() and not (cosine[thick] < SAME_PLANE - 1.0).any():
        return mesh
    alike = [pairs[thick & (np.abs(cosine) > 1.0 - SAME_PLANE)], _through_slivers(mesh, pairs, thin, normal)]
    label = _planes(len(mesh.faces), np.concatenate(alike))
    middle = np.stack([np.bincount(label[~thin], weights=mesh.normals[~thin, k]) for k in range(3)], axis=1)
    against = ~thin & ((normal * middle[np.minimum(label, len(middle) - 1)]).sum(axis=1) < 0)
    if not against.any():
        return mesh
    planes = np.unique(label[against]).tolist()
    gone: Bools = np.zeros(len(mesh.faces), dtype=bool)
    new: list[Ints] = []
    for plane in planes:
        rows = np.flatnonzero(label == plane)
        found = _divided_anew(mesh, rows, mesh.normals[rows].sum(axis=0))
        if found is not None:
            gone[rows] = True
            new.append(found)
    if not new:
        return mesh
    faces = np.concatenate([mesh.faces[~gone], *new])
    if not MeshEdges.of(len(mesh.vertices), faces).is_surface:
        return mesh
    detail = (
        f"{mesh.name}: divided {len(new)} flat regions anew whose faces fold back onto one another (concave polygons)"
    )
    line = repaired(f"{detail}; the volume is the same")
    used, compact = np.unique(faces, return_inverse=True)
    compact = compact.reshape(-1, 3).astype(np.int64)
    return replace(mesh, vertices=mesh.vertices[used], faces=compact, warnings=(*mesh.warnings, line))


def _thickness(mesh: Mesh, twice_area: Floats) -> Floats:
    """Least height (m,) of every face, mm."""
    corners = mesh.vertices[mesh.faces]
    longest = np.sqrt(((np.roll(corners, -1, axis=1) - corners) ** 2).sum(axis=2)).max(axis=1)
    least: Floats = twice_area / np.where(longest > 0, longest, 1.0)
    return least


def _through_slivers(mesh: Mesh, pairs: Ints, thin: Bools, normal: Floats) -> Ints:
    """Pairs (k, 2) of faces in one plane with nothing but slivers between them, and of these slivers and a face."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    m = len(mesh.faces)
    both, one = thin[pairs].all(axis=1), thin[pairs].any(axis=1) & ~thin[pairs].all(axis=1)
    graph = coo_array((np.ones(int(both.sum()), dtype=bool), tuple(pairs[both].T)), shape=(m, m))
    cluster = connected_components(graph, directed=False)[1]
    beside: dict[int, list[int]] = {}
    for a, b in pairs[one].tolist():
        sliver, face = (a, b) if thin[a] else (b, a)
        beside.setdefault(int(cluster[sliver]), []).append(face)
    slivers: dict[int, list[int]] = {}
    for sliver in np.flatnonzero(thin).tolist():
        slivers.setdefault(int(cluster[sliver]), []).append(sliver)
    found: list[list[int]] = [[0, 0]]
    for number, faces in beside.items():
        groups: list[list[int]] = []
        for face in faces:
            for group in groups:
                if _in_plane(mesh, normal, group[0], face):
                    group.append(face)
                    break
            else:
                groups.append([face])
        largest = max(groups, key=len)
        if len(largest) > 1:
            found += [[largest[0], other] for other in (*largest[1:], *slivers[number])]
    return np.array(found, dtype=np.int64)


def _in_plane(mesh: Mesh, normal: Floats, face: int, other: int) -> bool:
    """Whether two faces lie in one plane."""
    away = mesh.vertices[mesh.faces[other]] - mesh.vertices[mesh.faces[face, 0]]
    flat = np.abs(away @ normal[face]).max() <= 8.0 * mesh.noise_mm
    return bool(flat and abs(normal[face] @ normal[other]) > 1.0 - SAME_PLANE)


def _planes(count: int, pairs: Ints) -> Ints:
    """Which plane each face (count,) belongs to, by neighbours (k, 2) in one plane."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(pairs), dtype=bool), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _divided_anew(mesh: Mesh, rows: Ints, normal: Floats) -> Ints | None:
    """Other faces (k, 3) within the border of some of one plane; None if that is no polygon."""
    import manifold3d  # heavy: only where faces are folded

    loops = _border(mesh.faces[rows])
    twice = float(np.sqrt(normal @ normal))
    if not loops or twice <= 0.0:
        return None
    u = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    u /= np.sqrt(u @ u)
    frame = np.stack([u, np.cross(normal / twice, u)], axis=1)
    origin = mesh.vertices[loops[0][0]]
    if np.abs((mesh.vertices[mesh.faces[rows]] - origin) @ (normal / twice)).max() > 8.0 * mesh.noise_mm:
        return None  # nearly flat is not flat
    flat = [np.ascontiguousarray((mesh.vertices[loop] - origin) @ frame) for loop in loops]
    local: Any = np.asarray(manifold3d.triangulate(flat)).reshape(-1, 3)
    places = np.concatenate(flat)
    a, b, c = (places[local[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    if abs(float(np.abs(area).sum()) - twice) > max(SAME_AREA, SAME_PLANE) * twice:
        return None
    return np.concatenate(loops)[local]


def _border(faces: Ints) -> list[Ints]:
    """Loops of vertices about faces, in their sense; none where the border forks."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    sides = set(zip(start.tolist(), end.tolist(), strict=True))
    open_sides = [(a, b) for a, b in sides if (b, a) not in sides]
    after = dict(open_sides)
    if len(after) < len(open_sides):
        return []
    loops: list[Ints] = []
    while after:
        first, at = after.popitem()
        loop = [first]
        while at in after:
            loop.append(at)
            at = after.pop(at)
        if at != first:
            return []
        loops.append(np.array(loop, dtype=np.int64))
    return loops
