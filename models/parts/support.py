"""The support of Lettori et al. (2024), as a parametric solid: ``python models/parts/support.py [--out DIR]``.

Writes support.stl (post and sub-volumes in one), support_body.stl (the post with its bore) and support_sv1.stl to
support_sv3.stl (what is sliced, roots on the post's cylinder). Part frame, mm: z is the post's axis, the post stands on
z = 0, the sub-volumes point along +y. What was dimensioned after the paper and what was not: README.md beside this
file.

SV1 is an arm set to one side of the post, SV2 a block, SV3 a round-ended pad; all three have flat ends across y.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from solids import closed, joined, plate, quads, write

Floats = NDArray[np.float64]
SUNK = 5.0  # how far a root reaches into the post where the two are joined
STEPS = 192  # along a plate's root


@dataclass(frozen=True)
class Support:
    """Dimensions, mm and degrees; angles about z from +y towards +x.

    Attributes:
        radius: of the post.
        bore_radius: of its bore.
        height: of the post.
        arm_foot: where SV1's root begins and ends on the post, deg.
        arm_end: where its end begins and ends, x.
        arm_top: y of its end.
        arm_footprint: area of its root, mm2; gives its thickness along z.
        arm_z: of its middle.
        block_width: of SV2, along x.
        block_top: y of its end.
        block_footprint: area of its root, mm2; gives its length along z.
        block_z: of its middle.
        pad_width: of SV3, along x.
        pad_top: y of its end.
        pad_footprint: area of its root, mm2; gives its length along z.
        pad_z: of its middle.
    """

    radius: float = 30.0
    bore_radius: float = 12.0
    height: float = 110.0
    arm_foot: tuple[float, float] = (-30.0, 74.0)
    arm_end: tuple[float, float] = (-19.5, 19.5)
    arm_top: float = 81.0
    arm_footprint: float = 233.88
    arm_z: float = 95.0
    block_width: float = 10.4
    block_top: float = 54.8
    block_footprint: float = 272.86
    block_z: float = 58.0
    pad_width: float = 12.0
    pad_top: float = 37.3
    pad_footprint: float = 247.45
    pad_z: float = 20.0

    @property
    def arm_thickness(self) -> float:
        """Along z: the footprint over the arc of its root."""
        return self.arm_footprint / (self.radius * np.deg2rad(self.arm_foot[1] - self.arm_foot[0]))

    @property
    def block_half_angle(self) -> float:
        """Half of what SV2's root spans on the post, deg."""
        return float(np.rad2deg(np.arcsin(self.block_width / 2 / self.radius)))

    @property
    def block_length(self) -> float:
        """Along z: the footprint over the arc of its root."""
        return self.block_footprint / (2 * self.radius * np.deg2rad(self.block_half_angle))

    @property
    def pad_length(self) -> float:
        """Along z: straight sides as long as the footprint needs, on the polygon that stands for the round ends."""
        flat = _unrolled_area(self, 0.0)
        return self.pad_width + (self.pad_footprint - flat) / (
            2 * self.radius * np.arcsin(self.pad_width / 2 / self.radius)
        )


def _stadium(p: Support, straight: float, around: int = 192) -> Floats:
    """Outline of the pad, (around, 2) x and z about its middle; point k and point -k have the same x."""
    angle = 2 * np.pi * np.arange(around) / around
    x, z = p.pad_width / 2 * np.cos(angle), p.pad_width / 2 * np.sin(angle)
    return np.stack([x, z + straight / 2 * np.sign(np.round(z, 9))], axis=1)


def _unrolled_area(p: Support, straight: float) -> float:
    """Area of the pad's root on the unrolled post, mm2."""
    x, z = _stadium(p, straight).T
    s = p.radius * np.arcsin(x / p.radius)
    return 0.5 * abs(float(np.dot(s, np.roll(z, -1)) - np.dot(z, np.roll(s, -1))))


def arm(p: Support, sunk: float = 0.0) -> trimesh.Trimesh:
    """SV1, mm; `sunk` as in :func:`solids.plate`."""
    half = p.arm_thickness / 2
    return plate(p.radius, p.arm_foot, p.arm_end, p.arm_top, (p.arm_z - half, p.arm_z + half), STEPS, sunk)


def block(p: Support, sunk: float = 0.0) -> trimesh.Trimesh:
    """SV2, mm; `sunk` as in :func:`solids.plate`."""
    angle, x, half = p.block_half_angle, p.block_width / 2, p.block_length / 2
    levels = (p.block_z - half, p.block_z + half)
    return plate(p.radius, (-angle, angle), (-x, x), p.block_top, levels, STEPS, sunk)


def pad(p: Support, sunk: float = 0.0) -> trimesh.Trimesh:
    """SV3, mm; `sunk` as in :func:`solids.plate`."""
    x, z = _stadium(p, p.pad_length - p.pad_width).T
    root = np.sqrt(p.radius**2 - x**2)
    rings = [np.stack([x, y, z + p.pad_z], axis=1) for y in (root - sunk, np.full(len(x), p.pad_top))]
    around = len(x)
    numbers = np.arange(2 * around).reshape(2, around)
    # each cap in strips along z, so that the root's strips lie on the cylinder
    half = np.arange(1, around // 2)
    strips = np.concatenate([[[0, 0]], np.stack([half, around - half], axis=1), [[around // 2] * 2]])
    faces = [quads(np.concatenate([numbers, numbers[:, :1]], axis=1)), quads(strips), quads(strips[::-1] + around)]
    flat = np.concatenate(faces)
    flat = flat[(flat != np.roll(flat, 1, axis=1)).all(axis=1)]  # a strip that begins in a point is one triangle
    return closed(np.concatenate(rings), flat)


def body(p: Support, sides: int = 360) -> trimesh.Trimesh:
    """The post with its bore, its corners on the cylinder, mm."""
    mesh = trimesh.creation.annulus(p.bore_radius, p.radius, p.height, sections=sides)
    mesh.apply_translation([0, 0, p.height / 2])
    return mesh


def support(p: Support) -> trimesh.Trimesh:
    """Post and sub-volumes in one closed mesh, mm."""
    return joined(body(p), (make(p, SUNK) for make in (arm, block, pad)))


def main() -> None:
    """Build and write the meshes."""
    p = Support()
    whole = {"support": support(p), "support_body": body(p)}
    sub_volumes = {"support_sv1": arm(p), "support_sv2": block(p), "support_sv3": pad(p)}
    write("Build the support's meshes.", whole | sub_volumes)


if __name__ == "__main__":
    main()
