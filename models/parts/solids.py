"""What the builders of the parts share: plates and tubes on a cylinder, joining, writing.

    whole = joined(body, [branch])            # one closed mesh
    write("Build the valve's meshes.", {"valve": whole, "valve_body": body})

Lengths in mm, z along the axis of the part's body. The builders beside this file are run as scripts, so that they find
it by its name.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping
from pathlib import Path

import manifold3d
import numpy as np
import trimesh
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def plate(
    radius: float,
    foot: tuple[float, float],
    end: tuple[float, float],
    top: float,
    z: tuple[float, float],
    steps: int,
    sunk: float = 0.0,
) -> trimesh.Trimesh:
    """A plate across z from a cylinder to a flat end.

    Args:
        radius: of the cylinder.
        foot: where the root begins and ends, deg from +y towards +x.
        end: where the end begins and ends, x.
        top: y of the end.
        z: of the two faces.
        steps: along the root.
        sunk: how far its root is carried on towards the axis, to be joined to the cylinder.

    Returns:
        The plate, mm, closed.
    """
    angle = np.deg2rad(np.linspace(*foot, steps + 1))
    around = np.stack([np.sin(angle), np.cos(angle)], axis=1)
    rows = [radius * around, np.stack([np.linspace(*end, steps + 1), np.full(steps + 1, top)], axis=1)]
    if sunk > 0:
        rows.insert(0, (radius - sunk) * around)
    plan = np.concatenate(rows)
    vertices = np.concatenate([np.column_stack([plan, np.full(len(plan), level)]) for level in z])
    number = np.arange(len(vertices)).reshape(2, len(rows), steps + 1)
    grids = [number[1], number[0, ::-1]]  # across z, across the root and the end, across the sides
    grids += [number[:, -1].T, number[:, 0].T[::-1], number[:, :, -1], number[::-1, :, 0]]
    return closed(vertices, np.concatenate([quads(grid) for grid in grids]))


def tube(radius: float, outer: float, inner: float, top: float, around: int, sunk: float = 0.0) -> trimesh.Trimesh:
    """A tube about the x axis, from a cylinder about z to a flat end.

    Args:
        radius: of the cylinder.
        outer: radius of the tube outside.
        inner: and inside.
        top: x of its end.
        around: corners of its circles.
        sunk: how far its root is carried on inward, to be joined to the cylinder.

    Returns:
        The tube, mm, closed.
    """
    angle = 2 * np.pi * np.arange(around) / around
    loops = []
    for r, end in ((outer, False), (outer, True), (inner, True), (inner, False)):
        y, z = r * np.cos(angle), r * np.sin(angle)
        x = np.full(around, top) if end else np.sqrt(radius**2 - y**2) - sunk
        loops.append(np.stack([x, y, z], axis=1))
    number = np.arange(4 * around).reshape(4, around)
    number = np.concatenate([number, number[:1]])  # outside, end, inside, root
    return closed(np.concatenate(loops), quads(np.concatenate([number, number[:, :1]], axis=1)))


def quads(grid: Ints) -> Ints:
    """Two triangles for each cell of a grid of vertex numbers, all turned alike."""
    a, b, c, d = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel(), grid[1:, 1:].ravel(), grid[1:, :-1].ravel()
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def closed(vertices: Floats, faces: Ints) -> trimesh.Trimesh:
    """A closed mesh, turned so that its faces look outward."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def solid(mesh: trimesh.Trimesh) -> manifold3d.Manifold:
    """A mesh as a solid.

    Raises:
        RuntimeError: it is none.
    """
    made = manifold3d.Manifold(
        manifold3d.Mesh64(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.uint64))
    )
    if made.status() != manifold3d.Error.NoError:
        raise RuntimeError(f"not a solid: {made.status()}")
    return made


def mesh_of(made: manifold3d.Manifold) -> trimesh.Trimesh:
    """A solid as a mesh."""
    mesh = made.to_mesh()
    return trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


def joined(body: trimesh.Trimesh, others: Iterable[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Body and what stands on it in one closed mesh."""
    whole = solid(body)
    for other in others:
        whole += solid(other)
    return mesh_of(whole)


def write(description: str, meshes: Mapping[str, trimesh.Trimesh]) -> None:
    """Write meshes as STL into the folder that ``--out`` names, by default the builders' own.

    Args:
        description: of the script.
        meshes: by file name without its ending.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder to write to")
    out = parser.parse_args().out
    for name, mesh in meshes.items():
        mesh.export(out / f"{name}.stl")
        size = ", ".join(f"{v:.2f}" for v in mesh.extents)
        print(f"{name}: {len(mesh.faces)} faces, {size} mm, {mesh.volume:.1f} mm3, closed: {mesh.is_watertight}")
