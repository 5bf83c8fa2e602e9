"""The valve body of Lettori et al. (2024), as a parametric solid: ``python models/parts/valve.py [--out DIR]``.

Writes valve.stl (body and branch in one), valve_body.stl (cylinder, end flanges and bore) and valve_sv1.stl (the branch
that is sliced, its root on the body's cylinder). Part frame, mm: z is the body's axis, the body stands on z = 0, the
branch points along +x. What was dimensioned after the paper and what was not: README.md beside this file.
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
SUNK = 7.0  # how far the branch's root reaches into the body where the two are joined
AROUND = 240  # corners of a circle


@dataclass(frozen=True)
class Valve:
    """Dimensions, mm.

    Attributes:
        radius: of the body's cylinder.
        bore_radius: of its bore.
        height: of the body.
        flange: half the size of the oval end flanges along x and y.
        flange_thickness: along z.
        branch_radius: of the branch, outside.
        branch_bore_radius: inside; gives the footprint on the body (1274.80 mm2).
        branch_top: x of its flat end.
    """

    radius: float = 74.3
    bore_radius: float = 60.0
    height: float = 200.0
    flange: tuple[float, float] = (100.0, 115.0)
    flange_thickness: float = 18.0
    branch_radius: float = 28.0
    branch_bore_radius: float = 19.732
    branch_top: float = 190.0


def tube(radius: float, outer: float, inner: float, top: float, sunk: float = 0.0) -> trimesh.Trimesh:
    """A tube along x, about the x axis, from a cylinder to a flat end.

    Args:
        radius: of the cylinder.
        outer: radius of the tube outside.
        inner: and inside.
        top: x of its end.
        sunk: how far its root is carried on inward, to be joined to the cylinder.

    Returns:
        The tube, mm, closed.
    """
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    loops = []
    for r, end in ((outer, False), (outer, True), (inner, True), (inner, False)):
        y, z = r * np.cos(angle), r * np.sin(angle)
        x = np.full(AROUND, top) if end else np.sqrt(radius**2 - y**2) - sunk
        loops.append(np.stack([x, y, z], axis=1))
    number = np.arange(4 * AROUND).reshape(4, AROUND)
    number = np.concatenate([number, number[:1]])  # outside, end, inside, root
    mesh = trimesh.Trimesh(
        np.concatenate(loops), _quads(np.concatenate([number, number[:, :1]], axis=1)), process=False
    )
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def _quads(grid: Ints) -> Ints:
    """Two triangles for each cell of a grid of vertex numbers, all turned alike."""
    a, b, c, d = grid[:-1, :-1].ravel(), grid[:-1, 1:].ravel(), grid[1:, 1:].ravel(), grid[1:, :-1].ravel()
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def branch(p: Valve, sunk: float = 0.0) -> trimesh.Trimesh:
    """The branch, mm; `sunk` as in :func:`tube`."""
    mesh = tube(p.radius, p.branch_radius, p.branch_bore_radius, p.branch_top, sunk)
    mesh.apply_translation([0, 0, p.height / 2])
    return mesh


def body(p: Valve) -> trimesh.Trimesh:
    """Cylinder, flanges and bore in one closed mesh, mm."""
    whole = _upright(p.radius, p.radius, (0, p.height))
    for low in (0.0, p.height - p.flange_thickness):
        whole += _upright(*p.flange, (low, low + p.flange_thickness))
    return _mesh(whole - _upright(p.bore_radius, p.bore_radius, (-1, p.height + 1)))


def valve(p: Valve) -> trimesh.Trimesh:
    """Body and branch in one closed mesh, mm."""
    return _mesh(_solid(body(p)) + _solid(branch(p, SUNK)))


def _upright(a: float, b: float, z: tuple[float, float]) -> manifold3d.Manifold:
    """An upright elliptic cylinder of half sizes a and b, its corners on the ellipse."""
    angle = 2 * np.pi * np.arange(360) / 360
    outline = manifold3d.CrossSection([np.stack([a * np.cos(angle), b * np.sin(angle)], axis=1)])
    return outline.extrude(z[1] - z[0]).translate((0, 0, z[0]))


def _mesh(solid: manifold3d.Manifold) -> trimesh.Trimesh:
    mesh = solid.to_mesh()
    return trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


def _solid(mesh: trimesh.Trimesh) -> manifold3d.Manifold:
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.uint64))
    )
    if solid.status() != manifold3d.Error.NoError:
        raise RuntimeError(f"not a solid: {solid.status()}")
    return solid


def main() -> None:
    """Build and write the three meshes."""
    parser = argparse.ArgumentParser(description="Build the valve's meshes.")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder to write to")
    out = parser.parse_args().out
    p = Valve()
    for name, mesh in (("valve", valve(p)), ("valve_body", body(p)), ("valve_sv1", branch(p))):
        mesh.export(out / f"{name}.stl")
        size = ", ".join(f"{v:.2f}" for v in mesh.extents)
        print(f"{name}: {len(mesh.faces)} faces, {size} mm, {mesh.volume:.1f} mm3, closed: {mesh.is_watertight}")


if __name__ == "__main__":
    main()
