"""Cylinders and cones about the z axis, found in a mesh: which of its faces are turned about the axis.

A turned face is a facet of a cylinder or a cone about z: its plane touches the axis's circle squarely, within
half the angle of the coarsest polygon that still passes for round. Facets of one cylinder share their plane's
distance from the axis however the mesh is cut up, so they are gathered by (slope, distance) into *bands*:

    bands = find_bands(PartFaces.of(vertices, faces, 1e-6))          # frame: z is the axis; the largest first
    bands[0].band.radius_low, bands[0].coverage(0.0, 10.0)

Bores look inward and do not matter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..mesh.mesh_edges import neighbours
from ..mesh.solid import Bools, Floats, Ints
from .bands import HALF_FACET_RAD, Band, FoundBand
from .robust_line import Line, fit_line

FEW_SIDES_RAD = np.deg2rad(23.0)  # one of 8 where nothing finer is
STEEPEST = 0.1  # least radial part of a turned face's normal: cones up to 84° from the axis
SLOPE_WINDOW_RAD = np.deg2rad(2.5)
CYLINDER_RAD = np.deg2rad(1.0)
WINDOW_SHARE = 4e-3  # of the part's greatest radius: bands closer than this are one
HINTED_TURN = 0.2  # where the radius is given
MOST_BANDS = 200
LEAST_SHARE = 2e-5  # of the turned faces: bands smaller than this are not looked for
COPLANAR_RAD = np.deg2rad(0.03)  # neighbours that bend less are of one plane
COPLANAR_SHARE = 1e-5  # of the extent: neighbours farther off one plane are two planes, however rounded
WITHIN_FACET = 0.02  # what a corner counts that is on one facet alone


@dataclass(frozen=True, eq=False)
class PartFaces:
    """The faces of a part, and which of them lie in one plane.

    Attributes:
        vertices: (n, 3) mm.
        faces: (m, 3), outward.
        plane: (m,) one number for all neighbours of one plane.
        noise_mm: rounding of the coordinates.
        half_facet_rad: half the angle of the coarsest polygon that passes for round.
    """

    vertices: Floats
    faces: Ints
    plane: Ints
    noise_mm: float
    half_facet_rad: float = HALF_FACET_RAD

    @staticmethod
    def of(vertices: Floats, faces: Ints, noise_mm: float) -> PartFaces:
        """Number the planes of a mesh."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        corners = vertices[faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        a, b = neighbours(len(vertices), faces)
        size = np.sqrt((normal**2).sum(axis=1))
        # how far one's middle lies off the other's plane, as an angle and in mm
        off = np.abs((normal[a] * (corners[b].mean(axis=1) - corners[a].mean(axis=1))).sum(axis=1))
        off /= np.maximum(size[a], 1e-300)
        bend = np.sqrt((np.cross(normal[a], normal[b]) ** 2).sum(axis=1)) / np.maximum(size[a] * size[b], 1e-300)
        # rounding makes no plane of the facets of a finely drawn cylinder
        rounded = min(2 * noise_mm, COPLANAR_SHARE * float(np.ptp(vertices, axis=0).max()))
        flat = ((bend < COPLANAR_RAD) | (off < rounded)) & ((normal[a] * normal[b]).sum(axis=1) >= 0)
        graph = coo_array((np.ones(int(flat.sum())), (a[flat], b[flat])), shape=(len(faces), len(faces)))
        return PartFaces(vertices, faces, connected_components(graph, directed=False)[1].astype(np.int64), noise_mm)

    def moved(self, motion: Floats) -> PartFaces:
        """The same elsewhere: a rigid motion (4, 4)."""
        return replace(self, vertices=self.vertices @ motion[:3, :3].T + motion[:3, 3])

    @property
    def extent(self) -> float:
        """Greatest extent, mm."""
        return float(np.ptp(self.vertices, axis=0).max())


@dataclass(frozen=True, eq=False)
class Facets:
    """Faces seen from the z axis: azimuth unit vector (m, 2), slope (m,), distance (m,) of the plane, area."""

    outward: Floats
    slope: Floats
    distance: Floats
    area: Floats
    centroid: Floats


def facets_of(vertices: Floats, faces: Ints) -> Facets:
    """Faces seen from the z axis.

    Args:
        vertices: (n, 3) mm, z the axis.
        faces: (m, 3).

    Returns:
        Per face; `distance` is that of the plane's horizontal line at the centroid's height, mm.
    """
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.sqrt((normal**2).sum(axis=1))
    across = np.hypot(normal[:, 0], normal[:, 1])
    outward = normal[:, :2] / np.maximum(across, 1e-300)[:, None]
    centroid = corners.mean(axis=1)
    distance = (outward * centroid[:, :2]).sum(axis=1)
    return Facets(outward, np.arctan2(normal[:, 2], across), distance, 0.5 * length, centroid)


def turned_faces(skin: PartFaces, facets: Facets) -> Bools:
    """Which faces (m,) are facets of outward-looking cylinders and cones about z.

    A face counts if all its corners lie within half a facet of where its plane is nearest to the axis. Small
    faces of a large flat do so as well, so a plane must pass as a whole.
    """
    corners = skin.vertices[skin.faces][:, :, :2]
    ahead = (corners * facets.outward[:, None]).sum(axis=2)
    aside = corners[:, :, 1] * facets.outward[:, None, 0] - corners[:, :, 0] * facets.outward[:, None, 1]
    square = (np.abs(aside) <= np.tan(skin.half_facet_rad) * ahead).all(axis=1)
    turned = square & (np.cos(facets.slope) > STEEPEST) & (facets.distance > 0) & (facets.area > 0)
    total = np.bincount(skin.plane, facets.area)
    failing = np.bincount(skin.plane, facets.area * ~turned)
    return turned & (failing <= 0.1 * total)[skin.plane]


def _numbered(keys: Floats) -> Ints:
    """One number (m,) for each different row of whole numbers (m, k)."""
    order = np.lexsort(keys.T)
    new = np.append(False, (np.diff(keys[order], axis=0) != 0).any(axis=1))
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.cumsum(new)
    return number


def find_bands(skin: PartFaces, most: int = MOST_BANDS, share: float = 0.0) -> list[FoundBand]:
    """Cylinders and cones about z that look outward.

    Args:
        skin: of the part, z the axis.
        most: how many to look for.
        share: of the largest round one: smaller ones are not looked for.

    Returns:
        Bands, the largest first.
    """
    vertices, faces = skin.vertices, skin.faces
    facets = facets_of(vertices, faces)
    left = np.flatnonzero(turned_faces(skin, facets))
    reach = float(np.hypot(vertices[:, 0], vertices[:, 1]).max())
    window = WINDOW_SHARE * reach
    least = LEAST_SHARE * float(facets.area[left].sum())
    offset = facets.distance * np.cos(facets.slope) + facets.centroid[:, 2] * np.sin(facets.slope)
    cell = _numbered(np.round(np.column_stack([facets.slope / SLOPE_WINDOW_RAD, offset / window])))
    bands: list[FoundBand] = []
    taken = np.zeros(len(faces), dtype=bool)
    largest = 0.0
    while len(left) and len(bands) < most:
        area = facets.area[left]
        chosen = _heaviest(facets.slope[left], offset[left], area, cell[left], window)
        members = left[chosen]
        if area[chosen].sum() < max(least, share * largest):
            break
        band = fit_band(skin, members) if _goes_about(facets, members) else None
        taken[members if band is None else band.faces] = True
        if band is not None and band.turn >= HINTED_TURN:
            bands.append(band)  # what strayed into it may be another's
            largest = max(largest, band.band.area_mm2) if band.is_body(least_share=0.0) else largest
        else:
            taken[members] = True
        left = left[~taken[left]]
    return sorted(bands, key=lambda found: -found.band.area_mm2)


def _goes_about(facets: Facets, members: Ints) -> bool:
    """Some faces look into enough directions about z to be a body's."""
    outward = facets.outward[members]
    twelfths = np.floor((np.arctan2(outward[:, 1], outward[:, 0]) / np.pi + 1) * 12).astype(np.int64)
    return len(np.unique(twelfths)) >= 24 * HINTED_TURN * 0.5


def _heaviest(slope: Floats, offset: Floats, area: Floats, cell: Ints, window: float) -> Bools:
    """The faces around the place of (slope, offset) that holds the largest area."""
    near = cell == int(np.bincount(cell, area).argmax())
    for _ in range(3):  # the heaviest cell may hold only part of the band: move to where the area is
        weight = area[near] / area[near].sum()
        middle = float((weight * slope[near]).sum()), float((weight * offset[near]).sum())
        here = (np.abs(slope - middle[0]) <= SLOPE_WINDOW_RAD) & (np.abs(offset - middle[1]) <= window)
        near = here if here.any() else near
    return near


def fit_band(skin: PartFaces, members: Ints) -> FoundBand | None:
    """The cylinder or cone on which most of some faces' corners lie, with the faces that belong to it.

    Args:
        skin: of the part, z the axis.
        members: (k,) numbers of faces about as far from the axis, at about one slope.

    Returns:
        The band; None where no face lies on it.
    """
    triangles = skin.faces[members]
    facets = facets_of(skin.vertices, triangles)
    corners = skin.vertices[triangles]
    heights, radii = corners[..., 2], np.hypot(corners[..., 0], corners[..., 1])
    used, weight = ridge_weights(triangles, skin.plane[members], facets.area)
    corner = skin.vertices[used]
    line = _line(facets, (corner[:, 2], np.hypot(corner[:, 0], corner[:, 1])), weight, skin.noise_mm)
    off = line.off(heights, radii)
    slack = 3 * line.width
    on = (off <= slack).all(axis=1) & ~_beside((triangles, skin.plane[members]), heights, np.abs(off) <= slack)
    if not on.any():
        return None
    heights, radii, off, area = heights[on], radii[on], off[on], facets.area[on]
    low, high = float(heights.min()), float(heights.max())
    over = max(float(off.max()), 0.0)
    first, last = line.level + line.slope * low, line.level + line.slope * high
    # as a share of the radius there: a cone's facets are flat by more where it is wider
    depth = 1.0 - facets.distance[on] / (line.level + line.slope * facets.centroid[on, 2])
    order = np.argsort(depth)
    flat = float(depth[order][np.searchsorted(np.cumsum(area[order]), 0.5 * area.sum()).clip(max=len(order) - 1)])
    flat *= 0.5 * (first + last)
    band = Band(low, high, first, last, max(flat, 0.0), float(area.sum()), over if over > 2 * line.width else 0.0)
    ends, turn = (heights.min(axis=1), heights.max(axis=1)), _turn(corners[on])
    return FoundBand(band, members[on], *ends, area, turn, line.width, line.share, skin.half_facet_rad)


def _beside(facets: tuple[Ints, Ints], heights: Floats, close: Bools) -> Bools:
    """Facets below or above a band whose ridges lie off it, as those of a narrower cone of the same slope do.

    Args:
        facets: (k, 3) vertex numbers of faces, and the plane (k,) of each.
        heights: (k, 3) of their corners, mm.
        close: (k, 3) which corners lie on the band.

    Returns:
        Which of them (k,).
    """
    triangles, plane = facets
    _, number = np.unique(triangles, return_inverse=True)
    number, most = number.reshape(-1), int(plane.max()) + 1
    planes = np.bincount(np.unique(number * most + np.repeat(plane, 3)) // most)
    ridge = (planes[number] >= 2).reshape(-1, 3)
    there = np.bincount(plane, ridge.any(axis=1)) > 0
    on = np.bincount(plane, (ridge & close).any(axis=1)) > 0
    if not (there & ~on)[plane].any() or not on[plane].any():
        return np.zeros(len(plane), dtype=bool)
    low, high = heights[on[plane]].min(), heights[on[plane]].max()
    middle = heights.mean(axis=1)
    return (there & ~on)[plane] & ((middle < low) | (middle > high))


def ridge_weights(triangles: Ints, plane: Ints, area: Floats) -> tuple[Ints, Floats]:
    """Weights of faces' corners: their areas, but next to nothing within a facet or where a wall cuts it.

    A corner is on the round surface where facets meet. Elsewhere on a facet it lies inside of it.

    Args:
        triangles: (k, 3) vertex numbers.
        plane: (k,) of each.
        area: (k,) of each.

    Returns:
        Numbers (n,) of the corners, and their weights (n,).
    """
    used, number = np.unique(triangles, return_inverse=True)
    number = number.reshape(-1)
    most = int(plane.max()) + 1
    pairs = np.unique(number * most + np.repeat(plane, 3))
    planes = np.bincount(pairs // most, minlength=len(used))
    weight: Floats = np.bincount(number, np.repeat(area, 3), minlength=len(used)).astype(np.float64)
    return used, weight * np.where(planes >= 2, 1.0, WITHIN_FACET)


def _line(facets: Facets, profile: tuple[Floats, Floats], weight: Floats, noise_mm: float) -> Line:
    """The meridian of a band: upright where as many corners lie on an upright one."""
    heights, radii = profile
    rise = -float(np.tan(_median(facets.slope, facets.area)))
    middle = 0.5 * (float(heights.min()) + float(heights.max()))
    level = float(np.median(facets.distance))
    reach = max(float(np.ptp(radii)), 0.02 * level, 8 * noise_mm)
    floor = max(4 * noise_mm, 1e-6 * level)
    # a slope that is not told from none is none
    slopes = (0.0, rise if abs(rise) > 1e-4 else 1e-4) if abs(rise) < np.tan(2 * CYLINDER_RAD) else (rise,)
    line = fit_line(heights - middle, radii, weight, slopes, (0.5 * reach, floor))
    return replace(line, level=line.level - line.slope * middle)


def _median(values: Floats, weight: Floats) -> float:
    """Weighted median."""
    order = np.argsort(values)
    total = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(total, 0.5 * total[-1]).clip(max=len(order) - 1)])


def _turn(corners: Floats) -> float:
    """Share of 24 directions about z in which triangles (k, 3, 3) are: their corners, middles of sides and centres."""
    places = np.concatenate([corners, 0.5 * (corners + np.roll(corners, 1, axis=1)), corners.mean(axis=1)[:, None]], 1)
    azimuth = np.arctan2(places[..., 1], places[..., 0])
    return len(np.unique(np.floor(azimuth * (12 / np.pi)).astype(np.int64).clip(-12, 11))) / 24
