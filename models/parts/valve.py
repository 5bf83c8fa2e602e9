"""The valve body of Lettori et al. (2024), as a parametric solid: ``python models/parts/valve.py [--out DIR]``.

Writes valve.stl (body and branch in one), valve_body.stl (cylinder, end flanges and bore) and valve_sv1.stl (the branch
that is sliced, its root on the body's cylinder). Part frame, mm: z is the body's axis, the body stands on z = 0, the
branch points along +x. What was dimensioned after the paper and what was not: README.md beside this file.
"""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np
import trimesh
from solids import joined, mesh_of, tube, write

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


def branch(p: Valve, sunk: float = 0.0) -> trimesh.Trimesh:
    """The branch, mm; `sunk` as in :func:`solids.tube`."""
    mesh = tube(p.radius, p.branch_radius, p.branch_bore_radius, p.branch_top, AROUND, sunk)
    mesh.apply_translation([0, 0, p.height / 2])
    return mesh


def body(p: Valve) -> trimesh.Trimesh:
    """Cylinder, flanges and bore in one closed mesh, mm."""
    whole = _upright(p.radius, p.radius, (0, p.height))
    for low in (0.0, p.height - p.flange_thickness):
        whole += _upright(*p.flange, (low, low + p.flange_thickness))
    return mesh_of(whole - _upright(p.bore_radius, p.bore_radius, (-1, p.height + 1)))


def valve(p: Valve) -> trimesh.Trimesh:
    """Body and branch in one closed mesh, mm."""
    return joined(body(p), [branch(p, SUNK)])


def _upright(a: float, b: float, z: tuple[float, float]) -> manifold3d.Manifold:
    """An upright elliptic cylinder of half sizes a and b, its corners on the ellipse."""
    angle = 2 * np.pi * np.arange(360) / 360
    outline = manifold3d.CrossSection([np.stack([a * np.cos(angle), b * np.sin(angle)], axis=1)])
    return outline.extrude(z[1] - z[0]).translate((0, 0, z[0]))


def main() -> None:
    """Build and write the three meshes."""
    p = Valve()
    write("Build the valve's meshes.", {"valve": valve(p), "valve_body": body(p), "valve_sv1": branch(p)})


if __name__ == "__main__":
    main()
