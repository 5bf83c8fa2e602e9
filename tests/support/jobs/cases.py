"""Small cases that check in about a second."""

from __future__ import annotations

from pathlib import Path

import mujoco  # noqa: F401  (pytester forgets modules that its tests import first, and these load once a process)
import numpy as np
import trimesh


def boss_mesh(length: float = 12.0, width: float = 8.0, height: float = 5.0, radius: float = 20.0):
    """A box on a cylinder of ``radius`` about z, pointing along -x; its foot is inside the cylinder."""
    box = trimesh.creation.box((height + 4.0, length, width))
    box.apply_translation([-(radius - 4.0 + (height + 4.0) / 2), 0.0, 20.0])
    return box


LITTLE = """
name: boss
part: {sub_volumes: [boss.stl], body: {radius_mm: 9, z_mm: [0, 40]}}
support: {radius_mm: 8, height_mm: 100}
positioner: {position_mm: [1500, 0, 0], rotation_deg: [0, 0, -90]}
table: {E1_deg: 90, E2_deg: 180}
"""


def little_case(folder: Path) -> Path:
    """A low box on a cylinder, on the side that is up at E1 = 90, E2 = 180 deg."""
    box = trimesh.creation.box((8.0, 8.0, 12.0))
    box.apply_translation((-9.0, 0.0, 20.0))
    box.export(folder / "boss.stl")
    path = folder / "boss.case.yaml"
    path.write_text(LITTLE, encoding="utf-8")
    return path


def bosses(tmp_path, *meshes, length=320):
    """Sub-volumes in the order of deposition, on a post of radius 20."""
    names = []
    for i, mesh in enumerate(meshes):
        names.append(f"boss{i}.stl")
        mesh.export(tmp_path / names[-1])
    return {"sub_volumes": names, "body": {"radius_mm": 20, "z_mm": [0, length]}}


def at(z, **size):
    mesh = boss_mesh(**{"length": 8, "width": 8, "height": 3, **size})
    mesh.apply_translation([0, 0, z - 20])
    return mesh


def turned(mesh, angle_deg):
    mesh.apply_transform(trimesh.transformations.rotation_matrix(np.deg2rad(angle_deg), [0, 0, 1]))
    return mesh


def radial(name, r, z, deg=20.0):
    """A thin wall on a vertical plane through the arm's first axis."""
    middle, a = sum(r) / 2, np.deg2rad(deg)
    return {
        "name": name,
        "box": {"size_mm": [r[1] - r[0], 10, z[1] - z[0]]},
        "position_mm": [float(middle * np.cos(a)), float(middle * np.sin(a)), sum(z) / 2],
        "rotation_deg": [0, 0, deg],
    }
