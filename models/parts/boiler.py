"""The boiler of Lettori et al. (2024), as a parametric solid: ``python models/parts/boiler.py [--out DIR]``.

Writes boiler.stl (drum and sub-volumes in one), boiler_body.stl (the drum) and boiler_sv1.stl, boiler_sv2.stl (what is
sliced, roots on the drum's cylinder). Part frame, mm: z is the drum's axis, the drum stands on z = 0, the sub-volumes
point along +y. What was dimensioned after the paper and what was not: README.md beside this file.

SV1 is a nozzle with a bore, SV2 a duct that widens from almost the drum's width to the part's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from solids import joined, plate, tube, write

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
    """SV1, a tube along y, mm; `sunk` as in :func:`solids.tube`."""
    mesh = tube(p.radius, p.nozzle_radius, p.nozzle_bore_radius, p.nozzle_top, AROUND, sunk)
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 0, 1]))
    mesh.apply_translation([0, 0, p.nozzle_z])
    return mesh


def duct(p: Boiler, sunk: float = 0.0) -> trimesh.Trimesh:
    """SV2, a plate across z, mm; `sunk` as in :func:`solids.plate`."""
    angle, x, half = p.duct_half_angle, p.duct_width / 2, p.duct_thickness / 2
    return plate(p.radius, (-angle, angle), (-x, x), p.duct_top, (p.duct_z - half, p.duct_z + half), STEPS, sunk)


def body(p: Boiler, sides: int = 360) -> trimesh.Trimesh:
    """The drum, its corners on the cylinder, mm."""
    mesh = trimesh.creation.cylinder(p.radius, p.height, sections=sides)
    mesh.apply_translation([0, 0, p.height / 2])
    return mesh


def boiler(p: Boiler) -> trimesh.Trimesh:
    """Drum and sub-volumes in one closed mesh, mm."""
    return joined(body(p), [nozzle(p, SUNK), duct(p, SUNK)])


def main() -> None:
    """Build and write the meshes."""
    p = Boiler()
    meshes = {"boiler": boiler(p), "boiler_body": body(p), "boiler_sv1": nozzle(p), "boiler_sv2": duct(p)}
    write("Build the boiler's meshes.", meshes)


if __name__ == "__main__":
    main()
