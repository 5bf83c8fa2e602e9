"""Solids as meshes: moved, and with their coordinates rounded."""

from __future__ import annotations

import math

import numpy as np
from manifold3d import Manifold
from scipy.spatial.transform import Rotation

from slicing.decomposition.decompose import Decomposition
from slicing.mesh.solid import Mesh, mesh_from_arrays
from slicing.warning import Code, Warning

from .cad_parts import arrays, revolved


def cylinder(radius: float, low: float, high: float, sides: int = 64, top: float | None = None) -> Manifold:
    return Manifold.cylinder(high - low, radius, radius if top is None else top, sides).translate((0, 0, low))


def box(low, high) -> Manifold:
    return Manifold.cube(tuple(np.subtract(high, low))).translate(tuple(low))


def mesh_of(solid: Manifold, motion: np.ndarray | None = None, digits: int | None = None) -> Mesh:
    vertices, faces = arrays(solid)
    if motion is not None:
        vertices = vertices @ motion[:3, :3].T + motion[:3, 3]
    return mesh_from_arrays("part", vertices if digits is None else np.round(vertices, digits), faces)


def turned(angle_deg: float, axis=(1.0, 0.0, 0.0), shift=(0.0, 0.0, 0.0)) -> np.ndarray:
    motion = np.eye(4)
    direction = np.asarray(axis) / np.linalg.norm(axis)
    motion[:3, :3], motion[:3, 3] = Rotation.from_rotvec(math.radians(angle_deg) * direction).as_matrix(), shift
    return motion


def volumes(parts: Decomposition) -> list[float]:
    return [mesh.volume for mesh in parts.sub_volumes]


def codes(parts: Decomposition) -> set[Code]:
    return {line.code for line in parts.warnings if isinstance(line, Warning)}


def shoulder(sides: int = 64) -> Manifold:
    """A shaft of 30 and 14 with a fillet of 4 between, and a wall."""
    arc = [(18 + 4 * math.cos(a), 64 + 4 * math.sin(a)) for a in np.linspace(-math.pi / 2, -math.pi, 9)]
    shaft = revolved([(0, 0), (30, 0), (30, 60), *arc, (14, 100), (0, 100)], sides)
    return shaft + box((10, -4, 10), (60, 4, 40))
