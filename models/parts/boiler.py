"""The boiler of Lettori et al. (2024), as a parametric solid: ``python models/parts/boiler.py [--out DIR]``.

Writes boiler.stl (drum and sub-volumes in one), boiler_body.stl (the drum) and boiler_sv1.stl, boiler_sv2.stl (what is
sliced, roots on the drum's cylinder). Part frame, mm: z is the drum's axis, the drum stands on z = 0, the sub-volumes
point along +y. What was dimensioned after the paper and what was not: README.md beside this file.

SV1 is a nozzle with a bore, SV2 a duct that widens from almost the drum's width to the part's.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import manifold3d
import numpy as np
import trimesh
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
SUNK = 5.0  # how far a root reaches into the drum where the two are joined
AROUND = 192  # corners of a circle
STEPS = 240  # along the duct's root


@dataclass(frozen=True)
class Boiler:
    """Dimensions, mm and degrees.

    Attributes:
        radius: of the drum.
        height: of the drum.
        nozzle_radius: of SV1, outside.
        nozzle_bore_radius: inside; gives the footprint on the drum (315.76 mm2).
        nozzle_top: y of its flat end.
        nozzle_z: of its axis.
        duct_half_angle: half of what SV2's root spans on the drum, deg.
        duct_width: of its flat end, along x.
        duct_top: y of its end.
        duct_footprint: area of its root, mm2; gives its thickness along z.
        duct_z: of its middle.
    """

    radius: float = 37.2
    height: float = 200.0
    nozzle_radius: float = 10.5
    nozzle_bore_radius: float = 3.293
    nozzle_top: float = 54.4
    nozzle_z: float = 150.0
    duct_half_angle: float = 74.4
    duct_width: float = 100.0
    duct_top: float = 119.8
    duct_footprint: float = 2623.23
    duct_z: float = 70.0

    @property
    def duct_thickness(self) -> float:
        """Along z: the footprint over the arc of its root."""
        return self.duct_footprint / (2 * self.radius * np.deg2rad(self.duct_half_angle))


def nozzle(p: Boiler, sunk: float = 0.0) -> trimesh.Trimesh:
    """SV1, a tube along y.

    Args:
        p: dimensions.
        sunk: how far its root is carried on inward, to be joined to the drum.

    Returns:
        The tube, mm, closed.
    """
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    outer, inner = p.nozzle_radius, p.nozzle_bore_radius
    loops = []
    for r, end in ((outer, False), (outer, True), (inner, True), (inner, False)):
        x, z = r * np.cos(angle), r * np.sin(angle)
        y = np.full(AROUND, p.nozzle_top) if end else np.sqrt(p.radius**2 - x**2) - sunk
        loops.append(np.stack([x, y, z + p.nozzle_z], axis=1))
    number = np.arange(4 * AROUND).reshape(4, AROUND)
    number = np.concatenate([number, number[:1]])  # outside, end, inside, root
    return _closed(np.concatenate(loops), _quads(np.concatenate([number, number[:, :1]], axis=1)))


def duct(p: Boiler, sunk: float = 0.0) -> trimesh.Trimesh:
    """SV2, a plate across z from the drum to a flat end.

    Args:
        p: dimensions.
        sunk: how far its root is carried on towards the axis, to be joined to the drum.

    Returns:
        The plate, mm, closed.
    """
    angle = np.deg2rad(np.linspace(-p.duct_half_angle, p.duct_half_angle, STEPS + 1))
    around = np.stack([np.sin(angle), np.cos(angle)], axis=1)
    across = np.linspace(-p.duct_width / 2, p.duct_width / 2, STEPS + 1)
    rows = [p.radius * around, np.stack([across, np.full(STEPS + 1, p.duct_top)], axis=1)]
    if sunk > 0:
        rows.insert(0, (p.radius - sunk) * around)
    plan = np.concatenate(rows)
    levels = (p.duct_z - p.duct_thickness / 2, p.duct_z + p.duct_thickness / 2)
    vertices = np.concatenate([np.column_stack([plan, np.full(len(plan), z)]) for z in levels])
    number = np.arange(len(vertices)).reshape(2, len(rows), STEPS + 1)
    grids = [number[1], number[0, ::-1]]  # across z, across the root and the end, across the sides
    grids += [number[:, -1].T, number[:, 0].T[::-1], number[:, :, -1], number[::-1, :, 0]]
    return _closed(vertices, np.concatenate([_quads(grid) for grid in grids]))


def _quads(grid: Ints) -> Ints:
    """Two triangles for each cell of a grid of vertex numbers, all turned alike."""
    a, b, c, d = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel(), grid[1:, 1:].ravel(), grid[1:, :-1].ravel()
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _closed(vertices: Floats, faces: Ints) -> trimesh.Trimesh:
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def body(p: Boiler, sides: int = 360) -> trimesh.Trimesh:
    """The drum, its corners on the cylinder, mm."""
    mesh = trimesh.creation.cylinder(p.radius, p.height, sections=sides)
    mesh.apply_translation([0, 0, p.height / 2])
    return mesh


def boiler(p: Boiler) -> trimesh.Trimesh:
    """Drum and sub-volumes in one closed mesh, mm."""
    mesh = (_solid(body(p)) + _solid(nozzle(p, SUNK)) + _solid(duct(p, SUNK))).to_mesh()
    return trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


def _solid(mesh: trimesh.Trimesh) -> manifold3d.Manifold:
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.uint64))
    )
    if solid.status() != manifold3d.Error.NoError:
        raise RuntimeError(f"not a solid: {solid.status()}")
    return solid


def main() -> None:
    """Build and write the meshes."""
    parser = argparse.ArgumentParser(description="Build the boiler's meshes.")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder to write to")
    out = parser.parse_args().out
    p = Boiler()
    for name, mesh in (("", boiler(p)), ("_body", body(p)), ("_sv1", nozzle(p)), ("_sv2", duct(p))):
        mesh.export(out / f"boiler{name}.stl")
        size = ", ".join(f"{v:.2f}" for v in mesh.extents)
        print(f"boiler{name}: {len(mesh.faces)} faces, {size} mm, {mesh.volume:.1f} mm3, closed: {mesh.is_watertight}")


if __name__ == "__main__":
    main()
