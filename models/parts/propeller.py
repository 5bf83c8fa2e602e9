"""The propeller of Lettori et al. (2024), as a parametric solid: ``python models/parts/propeller.py [--out DIR]``.

Writes propeller.stl (hub and blades in one), propeller_hub.stl, and propeller_blade.stl (the one blade that is sliced,
its root on the hub's cylinder). Part frame, mm: z is the hub's axis, the hub stands on z = 0, the sliced blade points
along -y. What was dimensioned after the paper and what was not: README.md beside this file.

A blade's section at radius r is an ellipse in the cylinder's unrolled plane (arc length, z), its chord at the angle of
a helix of constant pitch; the tip is crowned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from solids import closed, joined, write

Floats = NDArray[np.float64]
AROUND = 48  # corners of a blade's section


@dataclass(frozen=True)
class Propeller:
    """Dimensions, mm and degrees.

    Attributes:
        hub_radius: the cylinder the blades stand on.
        tip_radius: of the middle of a blade's tip.
        height: of the hub.
        bore_radius: of the hub's bore.
        blades: how many.
        azimuth: of the sliced blade about z, deg.
        pitch: advance of the helix in one turn.
        root_chord: of the section on the hub.
        tip_chord: of the section at the tip.
        footprint: area of the section on the hub, mm2; gives the thickness there.
        tip_thickness: of the section at the tip.
        crown: how much lower the tip's corners are than its middle.
    """

    hub_radius: float = 9.7
    tip_radius: float = 41.75
    height: float = 43.2
    bore_radius: float = 4.0
    blades: int = 5
    azimuth: float = 270.0
    pitch: float = 60.0
    root_chord: float = 28.0
    tip_chord: float = 24.75
    footprint: float = 25.37
    tip_thickness: float = 1.0
    crown: float = 0.5

    @property
    def root_thickness(self) -> float:
        """Thickness that gives the footprint to the polygon of :data:`AROUND` corners that stands for the ellipse."""
        return self.footprint / (AROUND / 8 * np.sin(2 * np.pi / AROUND) * self.root_chord)


def section(p: Propeller, radius: Floats, share: Floats, angle: Floats) -> Floats:
    """Points of a blade in space.

    Args:
        p: dimensions.
        radius: (k,) mm.
        share: place between root (0) and tip (1), (k,).
        angle: place round the section, rad: 0 and pi are the edges, (k,).

    Returns:
        (k, 3) mm.
    """
    chord = p.root_chord + share * (p.tip_chord - p.root_chord)
    thickness = p.root_thickness + share * (p.tip_thickness - p.root_thickness)
    along, across = chord / 2 * np.cos(angle), thickness / 2 * np.sin(angle)
    helix = np.arctan2(p.pitch, 2 * np.pi * radius)
    arc = along * np.cos(helix) - across * np.sin(helix)
    z = along * np.sin(helix) + across * np.cos(helix) + p.height / 2
    azimuth = np.deg2rad(p.azimuth) + arc / radius
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=-1)


def blade(p: Propeller, root_radius: float | None = None, around: int = AROUND, outward: int = 24) -> trimesh.Trimesh:
    """One blade as a closed mesh.

    Args:
        p: dimensions.
        root_radius: where it begins; on the hub unless told (further in, to be joined to the hub).
        around: points round a section, even.
        outward: rings from root to tip.

    Returns:
        The blade, mm.
    """
    angle = 2 * np.pi * np.arange(around) / around
    top = p.tip_radius - p.crown * np.cos(angle) ** 2
    start = p.hub_radius if root_radius is None else root_radius
    rings = []
    for f in np.linspace(0.0, 1.0, outward + 1):
        radius = start + f * (top - start)
        share = np.clip((radius - p.hub_radius) / (p.tip_radius - p.hub_radius), 0.0, 1.0)
        rings.append(section(p, radius, share, angle))
    i = np.arange(around)
    j = (i + 1) % around
    faces = []
    for ring in range(outward):
        a, b = ring * around, (ring + 1) * around
        faces += [np.stack([a + i, a + j, b + j], axis=1), np.stack([a + i, b + j, b + i], axis=1)]
    # caps: strips between the two faces of the blade, so that they follow the cylinder they lie on
    half = np.arange(1, around // 2)
    upper, lower = half, around - half
    cap = [[0, upper[0], lower[0]], [around // 2, lower[-1], upper[-1]]]
    for k in range(len(half) - 1):
        cap += [[upper[k], upper[k + 1], lower[k + 1]], [upper[k], lower[k + 1], lower[k]]]
    ends = np.array(cap)
    faces += [ends[:, ::-1], ends + outward * around]
    return closed(np.concatenate(rings), np.concatenate(faces))


def hub(p: Propeller, sides: int = 240) -> trimesh.Trimesh:
    """The hub with its bore, its corners on the cylinder, mm."""
    mesh = trimesh.creation.annulus(p.bore_radius, p.hub_radius, p.height, sections=sides)
    mesh.apply_translation([0, 0, p.height / 2])
    return mesh


def propeller(p: Propeller) -> trimesh.Trimesh:
    """Hub and blades in one closed mesh, mm."""
    rooted = blade(p, root_radius=(p.hub_radius + p.bore_radius) / 2)
    blades = []
    for k in range(p.blades):
        turned = rooted.copy()
        turned.apply_transform(trimesh.transformations.rotation_matrix(2 * np.pi * k / p.blades, [0, 0, 1]))
        blades.append(turned)
    return joined(hub(p), blades)


def main() -> None:
    """Build and write the three meshes."""
    p = Propeller()
    meshes = {"propeller": propeller(p), "propeller_hub": hub(p), "propeller_blade": blade(p)}
    write("Build the propeller's meshes.", meshes)


if __name__ == "__main__":
    main()
