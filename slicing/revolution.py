"""Find the axis a mesh is turned about: candidate directions, centres by consensus, least squares on corners.

1. Directions: the coordinate axes, normals of large flats (end faces), and cross products of normals drawn at
   random by area (two facets of one cylinder give its axis).
2. Across each direction, facets of one cylinder have planes at one distance h from its axis: m·c = m·p + h, with
   outward direction m and a point c of the facet. Three facets give the centre p and h; the facets that agree
   are the cylinder, whatever else the part is made of (random sample consensus).
3. The best are refined by least squares on the cylinder's outer corners (tilt, place, radius), and the axis
   with the largest turned surface wins.

    axis = find_axis(mesh.vertices, mesh.faces, noise_mm=mesh.noise_mm)
    axis.to_z @ point                        # homogeneous: the axis becomes z
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from slicing.decompose_bands import HALF_FACET_RAD, LEAST_TURN, FoundBand, facets_of, find_bands, fit_band
from slicing.part import Bools, Floats, Ints

SAMPLES = 1500  # facets looked at while searching
PAIRS = 600
TRIPLES = 400
DIRECTIONS = 14
REFINED = 4  # candidates worth a least-squares fit
SAME_DISTANCE = 4e-3  # of the part's reach: facets of one cylinder
ACROSS = 0.05  # cosine: a normal across the direction
ROUNDS = 8
LEVEL = 1e-6  # z of a direction that is level
STARTING_TURN = 0.1  # share of the directions in which a cylinder must be seen before the axis is fitted
SEARCHED = 8  # bands looked at on the way
CORNERS = 0.05  # least share of a cylinder's vertices to fit it to


@dataclass(frozen=True, eq=False)
class Axis:
    """An axis and what is turned about it.

    Attributes:
        point: (3,) a point of the axis, mm.
        direction: (3,) unit.
        bands: cylinders and cones about it, in the frame in which it is z.
        area_mm2: of the cylinders.
        spread_mm: how far the cylinder's corners stray from it (standard deviation).
    """

    point: Floats
    direction: Floats
    bands: tuple[FoundBand, ...] = ()
    area_mm2: float = 0.0
    spread_mm: float = 0.0

    @property
    def to_z(self) -> Floats:
        """(4, 4) rigid motion that takes the axis to z, its point nearest to the origin to the origin.

        The least rotation that does so; none if the axis is parallel to z.
        """
        turn = rotation_to_z(self.direction)
        foot = self.point - (self.point @ self.direction) * self.direction
        motion = np.eye(4)
        motion[:3, :3], motion[:3, 3] = turn, -turn @ foot
        return motion


def rotation_to_z(direction: Floats) -> Floats:
    """Least rotation (3, 3) that makes a unit direction (3,) parallel to z, either way; of a level one, +x or +y up."""
    level = abs(float(direction[2])) < LEVEL
    leading = float(direction[int(np.abs(direction[:2]).argmax())]) if level else float(direction[2])
    up = direction if leading >= 0 else -direction
    x, y, z = up
    return np.array(
        [[1 - x * x / (1 + z), -x * y / (1 + z), -x], [-x * y / (1 + z), 1 - y * y / (1 + z), -y], [x, y, z]]
    )


def find_axis(
    vertices: Floats,
    faces: Ints,
    noise_mm: float,
    point: Floats | None = None,
    direction: Floats | None = None,
    least_turn: float = LEAST_TURN,
) -> Axis | None:
    """The axis with the largest cylinders about it.

    Args:
        vertices: (n, 3) mm.
        faces: (m, 3), outward.
        noise_mm: rounding of the coordinates.
        point: (3,) a point of the axis where it is known, mm.
        direction: (3,) unit, where it is known.
        least_turn: share of the directions about the axis that its cylinders must face.

    Returns:
        The axis, fitted to the mesh (near what was given), or None if no cylinder is there.
    """
    rng = np.random.default_rng(0)
    if point is not None and direction is not None:
        axis = _refined(vertices, faces, Axis(point, direction), noise_mm, least_turn)
        return axis if axis.area_mm2 > 0 else None
    sample = _sample(vertices, faces, rng)
    corners = vertices[faces[sample]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.sqrt((normal**2).sum(axis=1))[:, None]
    ways = _directions(normal, rng) if direction is None else direction[None]
    trials: list[tuple[float, float, int, Floats]] = []
    for way in ways:
        centre, score = _centre(corners.mean(axis=1), normal, way, point, rng)
        trials.append((-round(score, 6), -round(abs(float(way[2])), 6), len(trials), centre))
    found = []
    trials.sort(key=lambda trial: trial[:3])
    for score, _, k, centre in trials[:REFINED]:
        if score < 0 and score <= 0.3 * trials[0][0]:
            found.append(_refined(vertices, faces, Axis(centre, ways[k]), noise_mm, least_turn))
    found = [axis for axis in found if axis.area_mm2 > 0]
    if not found:
        return None
    most = max(axis.area_mm2 for axis in found)
    # as good as equal: the one nearest to z
    return max((a for a in found if a.area_mm2 >= 0.98 * most), key=lambda a: round(abs(float(a.direction[2])), 6))


def _sample(vertices: Floats, faces: Ints, rng: np.random.Generator) -> Ints:
    """Face numbers drawn by area, so that each stands for the same area."""
    area = facets_of(vertices, faces).area
    steps = (np.arange(SAMPLES) + rng.random(SAMPLES)) / SAMPLES
    total = np.cumsum(area)
    return np.searchsorted(total, steps * total[-1]).clip(max=len(faces) - 1).astype(np.int64)


def _directions(normal: Floats, rng: np.random.Generator) -> Floats:
    """Candidate directions (k, 3): the coordinate axes first, then those with most faces along or across."""
    first, second = rng.integers(0, len(normal), (2, PAIRS))
    cross = np.cross(normal[first], normal[second])
    length = np.sqrt((cross**2).sum(axis=1))
    cross = cross[length > 0.1] / length[length > 0.1, None]
    flats = normal[rng.integers(0, len(normal), PAIRS // 3)]
    drawn = np.concatenate([cross, flats])
    across = np.abs(drawn @ normal.T)
    score = (across < ACROSS / 2).sum(axis=1) + 0.2 * (across > 1 - 1e-4).sum(axis=1)
    chosen = [*np.eye(3)[::-1]]
    for k in np.argsort(-score, kind="stable"):
        if len(chosen) == DIRECTIONS:
            break
        if np.abs(np.array(chosen) @ drawn[k]).max() < 1 - 1e-6:  # not one that is there
            chosen.append(drawn[k])
    return np.array(chosen)


def _centre(
    middles: Floats, normal: Floats, way: Floats, point: Floats | None, rng: np.random.Generator
) -> tuple[Floats, float]:
    """The centre (3,) of the best cylinder along a direction, and its share of the sampled area."""
    turn = rotation_to_z(way)
    facing = normal @ turn.T
    lateral = np.abs(facing[:, 2]) < ACROSS
    nothing = (np.zeros(3), 0.0)
    if lateral.sum() < 3:
        return nothing
    outward = facing[lateral, :2] / np.hypot(facing[lateral, 0], facing[lateral, 1])[:, None]
    flat = (middles[lateral] @ turn.T)[:, :2]
    along = (outward * flat).sum(axis=1)
    drawn = rng.integers(0, len(along), (TRIPLES, 3))
    system = np.concatenate([outward[drawn], np.ones((TRIPLES, 3, 1))], axis=2)  # m·p + h = m·c
    if point is not None:
        centres = np.repeat((turn @ point)[None, :2], TRIPLES, axis=0)
        distances = along[drawn[:, 0]] - outward[drawn[:, 0]] @ centres[0]
    else:
        solvable = np.abs(np.linalg.det(system)) > 0.05
        solved = np.linalg.solve(system[solvable], along[drawn[solvable]][..., None])[..., 0]
        centres, distances = solved[:, :2], solved[:, 2]
    reach = float(np.ptp(flat, axis=0).max())
    good = (distances > 0.005 * reach) & (distances < reach)
    if not good.any():
        return nothing
    centres, distances = centres[good], distances[good]
    score = _agreeing(outward, flat, along, centres, distances, SAME_DISTANCE * reach).sum(axis=1)
    best = int(score.argmax())
    return turn.T @ np.append(centres[best], 0.0), float(score[best]) / len(middles)


def _agreeing(outward: Floats, flat: Floats, along: Floats, centres: Floats, distances: Floats, window: float) -> Bools:
    """Which facets (k, n) belong to each of k cylinders."""
    gap = along[None] - centres @ outward.T - distances[:, None]
    tangent = np.stack([-outward[:, 1], outward[:, 0]], axis=1)
    aside = (tangent * flat).sum(axis=1)[None] - centres @ tangent.T
    return (np.abs(gap) <= window) & (np.abs(aside) <= np.tan(HALF_FACET_RAD) * distances[:, None])


def _measured(vertices: Floats, faces: Ints, point: Floats, direction: Floats, least_turn: float) -> Axis:
    """An axis with the bands about it."""
    axis = Axis(np.asarray(point, dtype=np.float64), np.asarray(direction, dtype=np.float64))
    motion = axis.to_z
    bands = find_bands(vertices @ motion[:3, :3].T + motion[:3, 3], faces)
    area = sum(f.band.area_mm2 for f in bands if f.is_round(least_turn))
    return Axis(axis.point, axis.direction, tuple(bands), area)


def _refined(vertices: Floats, faces: Ints, axis: Axis, noise_mm: float, least_turn: float) -> Axis:
    """Gauss-Newton on the outer corners of the largest cylinder, over place, tilt and radius."""
    spread, members = 0.0, np.zeros(0, dtype=np.int64)
    for k in range(ROUNDS):
        motion = axis.to_z
        if k in (0, 3):  # which faces are its facets: once near, once about the true axis
            found = find_bands(vertices @ motion[:3, :3].T + motion[:3, 3], faces, SEARCHED)
            # a rough start sees only stretches of the cylinder
            cylinders = [f for f in found if f.is_round(least_turn if k else STARTING_TURN)]
            if not cylinders:
                return axis
            members = max(cylinders, key=lambda f: f.band.area_mm2).faces
            used, compact = np.unique(faces[members], return_inverse=True)
        corners = vertices[used] @ motion[:3, :3].T + motion[:3, 3]
        band = fit_band(corners, compact.reshape(-1, 3), members).band
        away = np.hypot(corners[:, 0], corners[:, 1])
        gap = away - band.middle_radius
        # first the whole facets, then ever closer to the corners, which lie on the true cylinder
        depth = max(2.0 * band.flat_mm * 0.4**k, 4 * noise_mm, 1e-7 * band.middle_radius)
        near = gap >= -depth
        if near.sum() < max(6, CORNERS * len(near)):
            break  # rough: what is left is chance
        step = _step(corners[near], away[near], gap[near])
        spread = float(np.std(gap[near]))
        back = motion[:3, :3].T
        middle = axis.point + back[:, 2] * float(corners[near, 2].mean() - (motion[:3, :3] @ axis.point)[2])
        direction = back @ np.array([step[2], step[3], 1.0])
        axis = Axis(middle + back @ np.array([step[0], step[1], 0.0]), direction / np.linalg.norm(direction))
    final = _measured(vertices, faces, axis.point, axis.direction, least_turn)
    return Axis(final.point, final.direction, final.bands, final.area_mm2, spread)


def _step(corners: Floats, away: Floats, gap: Floats) -> Floats:
    """Least-squares step (4,): shift in x, y at the corners' middle height, and tilt in x, y."""
    unit = corners[:, :2] / away[:, None]
    height = corners[:, 2] - corners[:, 2].mean()
    columns = np.column_stack([unit, unit * height[:, None], np.ones(len(away))])
    return np.linalg.lstsq(columns, gap, rcond=None)[0][:4]
