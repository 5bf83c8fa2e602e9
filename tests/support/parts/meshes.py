"""Solids with known sections."""

from __future__ import annotations

import manifold3d
import numpy as np

from slicing.layers.layer import CylindricalBody
from slicing.mesh.solid import Mesh, mesh_from_arrays

R = 20.0  # radius of the body under most of the bosses


BODY = CylindricalBody(R)


def from_manifold(solid: manifold3d.Manifold, name: str = "SV") -> Mesh:
    out = solid.to_mesh64()
    return mesh_from_arrays(name, np.asarray(out.vert_properties)[:, :3], np.asarray(out.tri_verts))


def box(low=(10.0, -6.0, -8.0), high=(40.0, 6.0, 8.0), name: str = "box") -> Mesh:
    return from_manifold(box_solid(low, high), name)


def box_solid(low, high) -> manifold3d.Manifold:
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    return manifold3d.Manifold.cube(tuple(high - low)).translate(tuple(low))


def prism(polygon, low_z: float, high_z: float, name: str = "prism") -> Mesh:
    """A polygon in xy, counter-clockwise, extruded along z."""
    section = manifold3d.CrossSection([[tuple(map(float, p)) for p in polygon]])
    return from_manifold(manifold3d.Manifold.extrude(section, high_z - low_z).translate((0, 0, low_z)), name)


def subdivided(mesh: Mesh, times: int) -> Mesh:
    """Every triangle in four, again and again: the same solid."""
    vertices, faces = mesh.vertices, mesh.faces
    for _ in range(times):
        start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        n = len(vertices)
        keys, edge = np.unique(np.minimum(start, end) * n + np.maximum(start, end), return_inverse=True)
        middle = n + edge.reshape(-1, 3)
        vertices = np.concatenate([vertices, 0.5 * (vertices[keys // n] + vertices[keys % n])])
        a, b, c = faces.T
        ab, bc, ca = middle.T
        faces = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return mesh_from_arrays(mesh.name, vertices, faces)


def grid_block(where, nu: int, nv: int, nw: int, name: str) -> Mesh:
    """A block of nu x nv x nw cells whose corners `where(u, v, w)` (arrays in [0, 1]) places in space."""
    u, v, w = np.meshgrid(*(np.linspace(0, 1, k + 1) for k in (nu, nv, nw)), indexing="ij")
    number = np.arange(u.size).reshape(u.shape)
    quads = []
    for axis in range(3):
        for side in (0, -1):
            plane = np.take(number, side, axis=axis)
            if (side == 0) == (axis != 1):
                plane = plane.T
            quads.append(
                np.stack([plane[:-1, :-1], plane[1:, :-1], plane[1:, 1:], plane[:-1, 1:]], axis=-1).reshape(-1, 4)
            )
    quad = np.concatenate(quads)
    faces = np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
    used, faces = np.unique(faces, return_inverse=True)
    points = np.stack(where(u.ravel(), v.ravel(), w.ravel()), axis=1)[used]
    return mesh_from_arrays(name, points, faces.reshape(-1, 3))


def sector(half_angle: float, inner: float, outer: float, low_z: float, high_z: float, n: int = 12) -> Mesh:
    """Between two half planes through the axis and two cylinders (faceted, corners on them)."""

    def where(u, v, w):
        r, angle = inner + (outer - inner) * u, half_angle * (2 * v - 1)
        return r * np.cos(angle), r * np.sin(angle), low_z + (high_z - low_z) * w

    return grid_block(where, 1, n, 1, "sector")


def blade(nu: int = 24, nv: int = 24, thickness: float = 3.0, inner: float = R, outer: float = 52.0) -> Mesh:
    """A twisted blade, lens-shaped in section, its root exactly on the body, its tip on a cylinder."""

    def where(u, v, w):
        r = inner + (outer - inner) * u
        chord, twist = 24.0 + 12.0 * u * (1 - u), 0.9 - 0.6 * u
        along = chord * (v - 0.5)
        across = thickness * (1 - 0.5 * u) * (w - 0.5) * (0.15 + 0.85 * np.sin(np.pi * v))
        tangential = along * np.cos(twist) - across * np.sin(twist)
        height = along * np.sin(twist) + across * np.cos(twist)
        angle = tangential / r
        return r * np.cos(angle), r * np.sin(angle), height

    return grid_block(where, nu, nv, 2, "blade")


def ring(inner: float, outer: float, low_z: float, high_z: float, n: int = 40) -> Mesh:
    """A faceted ring about the axis; between its polygons its top and bottom are flat."""
    tube = manifold3d.Manifold.cylinder(high_z - low_z, outer, outer, n)
    bore = manifold3d.Manifold.cylinder(high_z - low_z + 2, inner, inner, n).translate((0, 0, -1))
    return from_manifold((tube - bore).translate((0, 0, low_z)), "ring")


def rotated(mesh: Mesh, angle: float) -> Mesh:
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    return mesh_from_arrays(mesh.name, mesh.vertices @ turn.T, mesh.faces)


def box_section(width: float, height: float, radius: float) -> float:
    """Area of the section of a box (width across, height along z) by a cylinder about z."""
    return radius * 2 * np.arcsin(width / (2 * radius)) * height
