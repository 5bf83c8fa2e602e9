"""The paper's four indices of a sliced sub-volume.

    indices(sliced, targets)          # Indices(NL=21, A_mm2=25.4, NV=242, R_rad=0.42)

NL     number of layers, the one on the body included.
A_mm2  adhesion area. Where the first layer lies on the body: its region, the footprint, and nothing above it, which
       would count the same area of the body again. Of planes: of every layer's region the part within half a layer
       (h_layer / 2) of the body, summed; the parts of two planes lie beside one another. Of the body itself, where
       it is printed as well: its footprint on the plate. A body that ends is there between its ends alone.
NV     number of robot targets, as the robot visits them: the target that closes a bead counts again.
R_rad  mean angle, along the last layer's curves, between the direction of deposition and the normal of the
       top surface: the nearest face of the mesh that looks within 60 degrees of the direction of deposition.

Source: Lettori et al. 2024, section 4, figure 12.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..layers.layer import SlicedSubVolume
from ..mesh.closest_point import closest_on_triangles
from ..mesh.solid import Floats, Ints, Mesh
from ..targets.targets import Targets
from .adhesion import area_near_body

TOP_COSINE = 0.5  # a face belongs to the top if it looks within 60 degrees of the direction of deposition
TOP_POINTS = 96  # of the last curves, evenly spaced
PAIRS_AT_ONCE = 2_000_000  # pairs of a point and a face


@dataclass(frozen=True)
class Indices:
    """NL, A, NV and R of one sub-volume; see the module."""

    NL: int
    A_mm2: float
    NV: int
    R_rad: float

    def to_dict(self) -> dict[str, float]:
        """As schema rbam-slices/1 writes it."""
        return {"NL": self.NL, "A_mm2": self.A_mm2, "NV": self.NV, "R_rad": self.R_rad}


def indices(sliced: SlicedSubVolume, targets: Targets | int) -> Indices:
    """The indices of one sub-volume.

    Args:
        sliced: the sub-volume.
        targets: its targets among those of the part (found by its name), or how many they are.

    Returns:
        The indices.

    Raises:
        ValueError: the targets know no sub-volume of that name.
    """
    if isinstance(targets, Targets):
        number = int((targets.sub_volume_index == targets.sub_volume.index(sliced.name)).sum())
    else:
        number = int(targets)
    return Indices(len(sliced.layers), adhesion_area(sliced), number, top_angle(sliced))


def adhesion_area(sliced: SlicedSubVolume) -> float:
    """A: area of the body that the layers adhere to, mm².

    Args:
        sliced: the sub-volume.

    Returns:
        mm².
    """
    if sliced.stands_on_plate or sliced.layers[0].on_body:
        return float(sliced.layers[0].area_mm2)
    within = 0.5 * sliced.parameters.h_layer_mm
    return float(sum(area_near_body(layer, sliced.body, within, sliced.body_z_mm) for layer in sliced.layers))


def top_angle(sliced: SlicedSubVolume) -> float:
    """R: mean angle between the last layer's direction of deposition and the top surface's normal, rad.

    Args:
        sliced: the sub-volume.

    Returns:
        rad. Where no face looks within 60 degrees of the direction of deposition (a tip that comes to an
        edge), the face that looks most along it is taken.
    """
    last = sliced.layers[-1]
    lengths = np.array([_length(curve.points) for curve in last.curves])
    counts = np.ceil(TOP_POINTS * lengths / lengths.sum()).astype(np.int64) + 1
    points = np.concatenate([_evenly(curve.points, int(n)) for curve, n in zip(last.curves, counts, strict=True)])
    weights = np.repeat(lengths / counts, counts)  # of a point: the length it stands for
    directions = last.surface.normals(points)
    unit = sliced.mesh.normals
    size = np.sqrt((unit**2).sum(axis=1))
    centres, radii = sliced.mesh.bounding_spheres
    mean = directions.mean(axis=0)
    # faces that can be a top face for any point, not far below the last layer
    spread = np.arccos(np.clip(directions @ (mean / np.linalg.norm(mean)), -1.0, 1.0)).max() if mean.any() else np.pi
    widest = np.cos(min(np.arccos(TOP_COSINE) + float(spread), np.pi))
    high = last.surface.distance(centres) + radii >= -1e-6
    faces = np.flatnonzero((unit @ mean >= (widest - 1e-9) * size * np.linalg.norm(mean)) & high & (size > 0))
    if len(faces) == 0:
        faces = np.flatnonzero(size > 0)
    looking = unit[faces] / size[faces, None]
    share = max(PAIRS_AT_ONCE // len(faces), 1)  # of the points: what is compared at once stays within memory
    parts = [slice(k, k + share) for k in range(0, len(points), share)]
    angles = [_angles(points[p], directions[p], looking, sliced.mesh, faces) for p in parts]
    angle = np.concatenate(angles)
    return float(angle.mean() if len(last.curves) == 1 else np.average(angle, weights=weights))


def _angles(points: Floats, directions: Floats, unit: Floats, mesh: Mesh, faces: Ints) -> Floats:
    """Angles (n,) between directions at points and the unit normals of the top faces nearest to them, rad."""
    centres, radii = mesh.bounding_spheres
    cosine = directions @ unit.T
    allowed = cosine >= TOP_COSINE
    best = np.argmax(cosine, axis=1)
    allowed[np.arange(len(points)), best] |= ~allowed.any(axis=1)
    nearest = _nearest_face(points, mesh.vertices[mesh.faces[faces]], centres[faces], radii[faces], allowed)
    return np.arccos(np.clip(cosine[np.arange(len(points)), nearest], -1.0, 1.0))


def _length(points: Floats) -> float:
    """Length of a closed polyline, mm."""
    return float(np.sqrt(((np.roll(points, -1, axis=0) - points) ** 2).sum(axis=1)).sum())


def _evenly(points: Floats, count: int) -> Floats:
    """Points evenly spaced along a closed polyline (on it, which is near enough to look up a face)."""
    loop = np.concatenate([points, points[:1]])
    length = np.append(0.0, np.cumsum(np.sqrt((np.diff(loop, axis=0) ** 2).sum(axis=1))))
    at = (np.arange(count) + 0.5) / count * length[-1]
    return np.stack([np.interp(at, length, loop[:, k]) for k in range(3)], axis=1)


def _nearest_face(points: Floats, triangles: Floats, centres: Floats, radii: Floats, allowed: np.ndarray) -> np.ndarray:
    """For each point the nearest of its allowed triangles; spheres around them leave few to examine."""
    away = np.sqrt(((points[:, None] - centres[None]) ** 2).sum(axis=2))
    surely = np.where(allowed, away + radii, np.inf).min(axis=1)
    point, face = np.nonzero(allowed & (away - radii <= surely[:, None]))
    distance = np.sqrt(((points[point] - closest_on_triangles(points[point], triangles[face])) ** 2).sum(axis=1))
    order = np.lexsort((distance, point))
    first = np.append(True, np.diff(point[order]) > 0)
    return face[order[first]]
