"""Where the axis of a turned part may be: candidates voted for by the faces that are curved round something.

Faces of a round body have neighbours that turn away from them by a facet's angle, outward. Only these vote, so that
flats do not, however large they are; and concave fillets do not. Directions come from the edges between such faces,
from pairs and triples of their normals, from end faces and from the coordinate axes. A direction is worth what the
faces at one slope about it hold in the weakest of the directions that a round body must face: flats face two.

Across a direction, facets of one cylinder or cone have planes at one distance h from its axis: m·c - k z = m·p + h,
with outward direction m, a point c of the facet at height z, and its slope k. Three facets give the centre p and h;
the facets that agree are the surface, whatever else the part is made of (random sample consensus).

    for candidate in candidates(vertices, faces, None, None): candidate.point, candidate.direction
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Bools, Floats, Ints
from ..mesh.mesh_edges import neighbours
from .bands import HALF_FACET_RAD
from .turned_faces import COPLANAR_RAD, FEW_SIDES_RAD

SAMPLES = 1500  # faces examined
FROM_CURVED, FROM_PATCHES = 0.45, 0.35  # shares drawn from the curved ones by area, and evenly over their patches
PAIRS, TRIPLES = 160, 300
EDGE_DIRECTIONS, FLAT_DIRECTIONS, DIRECTIONS = 12, 8, 18
LEAST_BEND_RAD, MOST_BEND = np.deg2rad(0.15), 2.1  # of half a facet
SAME_DIRECTION = 1 - 1.5e-4  # cosine of 1 degree
SAME_DISTANCE = 4e-3  # of the part's reach: facets of one surface
ACROSS = 0.05  # cosine: facets of one slope
ROWS = 201  # of slopes, as cosines from -1 to 1
UPRIGHT = 100  # number of the slope 0
FINE, COARSE = 1, 5  # rows on either side that are one slope
STEEP = 0.9  # cosine: normals nearer to the axis are no body's sides
CLUSTERED = 3000  # edges and flats examined
SLOPES_TRIED = 2  # of a direction
LEVEL = 1e-6  # z of a direction that is level


@dataclass(frozen=True)
class Roundness:
    """What passes for round while candidates are weighed.

    Attributes:
        half_facet_rad: half the angle of the coarsest polygon.
        azimuths: directions about the axis that are distinguished.
        unfaced: how many of them a body need not face.
    """

    half_facet_rad: float
    azimuths: int
    unfaced: int

    def azimuth_of(self, outward: Floats) -> Ints:
        """Numbers (n,) of the azimuths that vectors (n, 2) or longer point to."""
        turn = np.arctan2(outward[:, 1], outward[:, 0]) / np.pi + 1
        return np.floor(turn * self.azimuths / 2).astype(np.int64) % self.azimuths


MANY_SIDES = Roundness(HALF_FACET_RAD, 24, 12)
FEW_SIDES = Roundness(FEW_SIDES_RAD, 8, 2)  # a box faces four, a hexagon's flats are wider


@dataclass(frozen=True, eq=False)
class AxisCandidate:
    """An axis that may be the part's.

    Attributes:
        point: (3,) of it, mm.
        direction: (3,) unit.
        score: share of the sampled area that agrees.
    """

    point: Floats
    direction: Floats
    score: float


@dataclass(frozen=True, eq=False)
class _VotingFaces:
    """Faces that vote: normals, middles, and the patch each belongs to."""

    normal: Floats
    middle: Floats
    patch: Ints


def rotation_to_z(direction: Floats) -> Floats:
    """Least rotation (3, 3) that makes a unit direction (3,) parallel to z, either way; of a level one, +x or +y up."""
    level = abs(float(direction[2])) < LEVEL
    leading = float(direction[int(np.abs(direction[:2]).argmax())]) if level else float(direction[2])
    up = direction if leading >= 0 else -direction
    x, y, z = up
    return np.array(
        [[1 - x * x / (1 + z), -x * y / (1 + z), -x], [-x * y / (1 + z), 1 - y * y / (1 + z), -y], [x, y, z]]
    )


def candidates(
    vertices: Floats, faces: Ints, hint: tuple[Floats | None, Floats | None], kind: Roundness = MANY_SIDES
) -> list[AxisCandidate]:
    """Axes that may be the part's, the best first.

    Args:
        vertices: (n, 3) mm.
        faces: (m, 3), outward.
        hint: a point (3,) of the axis, mm, and its direction (3,), unit, where they are known.
        kind: what passes for round.

    Returns:
        The candidates; none if nothing is curved.
    """
    rng = np.random.default_rng(0)
    point, direction = hint
    mesh = _Curvature.of(vertices, faces, kind)
    sample = mesh.sample(rng)
    ways = mesh.directions(sample, rng, kind) if direction is None else direction[None]
    found = []
    for way in ways:
        for slope, _ in _roundness(sample, way, kind):
            centre, score = _centre(sample, (way, slope), point, (rng, kind))
            if score > 0:
                found.append(AxisCandidate(centre, way, score))
    return sorted(found, key=lambda one: (-round(one.score, 6), -round(abs(float(one.direction[2])), 6)))


@dataclass(frozen=True, eq=False)
class _Curvature:
    """A mesh's faces and how they turn from one to the next."""

    normal: Floats
    area: Floats
    middle: Floats
    curved: Bools
    patch: Ints
    patch_area: Floats
    edge_direction: Floats
    edge_weight: Floats

    @staticmethod
    def of(vertices: Floats, faces: Ints, kind: Roundness) -> _Curvature:
        """Find edges between faces that turn outward by a facet's angle, and patches of faces that such edges join."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        corners = vertices[faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.sqrt((normal**2).sum(axis=1))
        normal, area, middle = normal / np.maximum(length, 1e-300)[:, None], 0.5 * length, corners.mean(axis=1)
        a, b = neighbours(len(vertices), faces)
        bend = np.arctan2(
            np.sqrt((np.cross(normal[a], normal[b]) ** 2).sum(axis=1)), (normal[a] * normal[b]).sum(axis=1)
        )
        across = middle[b] - middle[a]
        convex = (across * (normal[a] - normal[b])).sum(axis=1) < 0
        bent = (bend >= LEAST_BEND_RAD) & (bend <= MOST_BEND * kind.half_facet_rad) & convex
        curved = np.zeros(len(faces), dtype=bool)
        curved[a[bent]] = curved[b[bent]] = True
        joined = bent | (bend < COPLANAR_RAD)
        graph = coo_array((np.ones(int(joined.sum())), (a[joined], b[joined])), shape=(len(faces), len(faces)))
        patch = connected_components(graph, directed=False)[1].astype(np.int64)
        run = np.cross(normal[a[bent]], normal[b[bent]])
        run = run / np.maximum(np.sqrt((run**2).sum(axis=1)), 1e-300)[:, None]
        patch_area = np.bincount(patch, area)[patch]
        weight = np.minimum(area[a[bent]], area[b[bent]])
        return _Curvature(normal, area, middle, curved, patch, patch_area, run, weight)

    def sample(self, rng: np.random.Generator) -> _VotingFaces:
        """Faces drawn by area, most of them from the curved ones; of a large patch fewer than its share."""
        numbers = []
        even = self.area / np.sqrt(self.patch_area)
        for weight, share in (
            (self.area * self.curved, FROM_CURVED),
            (even * self.curved, FROM_PATCHES),
            (even * ~self.curved, 1 - FROM_CURVED - FROM_PATCHES),
        ):
            total = np.cumsum(weight)
            count = round(SAMPLES * share)
            if total[-1] <= 0:
                continue
            steps = (np.arange(count) + rng.random(count)) / count
            drawn = np.searchsorted(total, steps * total[-1]).clip(max=len(total) - 1)
            numbers.append(drawn.astype(np.int64))
        chosen = np.concatenate(numbers)
        return _VotingFaces(self.normal[chosen], self.middle[chosen], self.patch[chosen])

    def directions(self, sample: _VotingFaces, rng: np.random.Generator, kind: Roundness) -> Floats:
        """Directions (k, 3): the coordinate axes first, then those about which the most is round."""
        n, where = sample.normal, rng.integers(0, len(sample.normal), (3, PAIRS))
        beside = _same_patch(sample.patch, where[0], rng)
        third = _same_patch(sample.patch, where[0], rng)
        pairs = [np.cross(n[where[0]], n[where[1]]), np.cross(n[where[0]], n[beside])]
        triples = [np.cross(n[where[0]] - n[beside], n[beside] - n[third])]
        flats = _clusters(self.normal[~self.curved], self.area[~self.curved], FLAT_DIRECTIONS)
        edges = _clusters(self.edge_direction, self.edge_weight, EDGE_DIRECTIONS)
        drawn = np.concatenate([*pairs, *triples])
        length = np.sqrt((drawn**2).sum(axis=1))
        drawn = np.concatenate([edges, flats, drawn[length > 0.02] / length[length > 0.02, None]])
        worth = np.array([_roundness(sample, way, kind)[0][1] for way in drawn])
        chosen = [*np.eye(3)[::-1]]
        for k in np.argsort(-np.round(worth, 9), kind="stable"):
            if len(chosen) == DIRECTIONS or worth[k] <= 0:
                break
            if np.abs(np.array(chosen) @ drawn[k]).max() < SAME_DIRECTION:
                chosen.append(drawn[k])
        return np.array(chosen)


def _same_patch(patch: Ints, chosen: Ints, rng: np.random.Generator) -> Ints:
    """For each chosen member of a sample another one of its patch, at random."""
    order = np.argsort(patch, kind="stable")
    first = np.searchsorted(patch[order], patch[chosen], side="left")
    last = np.searchsorted(patch[order], patch[chosen], side="right")
    return order[first + np.floor(rng.random(len(chosen)) * (last - first)).astype(np.int64)]


def _clusters(direction: Floats, weight: Floats, most: int) -> Floats:
    """Mean directions (k, 3), either way, of the heaviest bundles within half a degree."""
    means: list[Floats] = []
    left = np.argsort(-weight, kind="stable")[:CLUSTERED]
    direction, weight = direction[left], weight[left]
    while len(weight) and len(means) < most:
        # the heaviest of some: the bundle with the most weight about it
        some = direction[:64]
        near = np.abs(some @ direction.T) > np.cos(np.deg2rad(0.5))
        best = int((near @ weight).argmax())
        members = near[best]
        towards = direction[members] * np.sign(direction[members] @ some[best])[:, None]
        mean = weight[members] @ towards
        means.append(mean / max(float(np.linalg.norm(mean)), 1e-300))
        direction, weight = direction[~members], weight[~members]
    return np.array(means).reshape(-1, 3)


def _roundness(sample: _VotingFaces, way: Floats, kind: Roundness) -> list[tuple[float, float]]:
    """The slopes at which most faces go round a direction, and what they hold, counting none of too few azimuths."""
    turn = rotation_to_z(way)
    facing, many = sample.normal @ turn.T, kind.azimuths
    azimuth = kind.azimuth_of(facing)
    row = np.round((facing[:, 2] + 1) * (ROWS // 2)).astype(np.int64)
    level = np.abs(facing[:, 2]) < STEEP
    held = np.bincount((row * many + azimuth)[level], minlength=ROWS * many).reshape(ROWS, many)
    below = np.concatenate([np.zeros((COARSE + 1, many)), np.cumsum(held, axis=0)])
    below = np.concatenate([below, np.repeat(below[-1:], COARSE, axis=0)])
    total = np.zeros(ROWS)
    for about in (FINE, COARSE):  # the sharper the better
        rows = COARSE + np.arange(ROWS)
        near = below[rows + about + 1] - below[rows - about]
        weakest = np.partition(near, kind.unfaced, axis=1)[:, kind.unfaced]
        total += np.minimum(near, 4 * weakest[:, None]).sum(axis=1)
    best = int(total.argmax())
    apart = np.where(np.abs(np.arange(ROWS) - best) > 2 * COARSE, total, 0)
    chosen = [best, int(apart.argmax()), UPRIGHT][: SLOPES_TRIED + (abs(best - UPRIGHT) > 2 * COARSE)]
    return [(k / (ROWS // 2) - 1.0, float(total[k])) for k in dict.fromkeys(chosen)]


def _centre(
    sample: _VotingFaces,
    along_slope: tuple[Floats, float],
    point: Floats | None,
    by: tuple[np.random.Generator, Roundness],
) -> tuple[Floats, float]:
    """The centre (3,) of the best surface of a slope about a direction, and the share of the sample that agrees."""
    (way, slope), (rng, kind) = along_slope, by
    turn, nothing = rotation_to_z(way), (np.zeros(3), 0.0)
    facing = sample.normal @ turn.T
    lateral = (np.abs(facing[:, 2] - slope) <= ACROSS) & (np.abs(facing[:, 2]) < STEEP)
    if lateral.sum() < 3:
        return nothing
    across = np.hypot(facing[lateral, 0], facing[lateral, 1])
    outward = facing[lateral, :2] / across[:, None]
    middle = sample.middle[lateral] @ turn.T
    rise = 0.0 if abs(slope) < ACROSS / 2 else -facing[lateral, 2] / across
    flat, along = middle[:, :2], (outward * middle[:, :2]).sum(axis=1) - rise * middle[:, 2]
    drawn = rng.integers(0, len(along), (TRIPLES, 3))
    near = _same_patch(sample.patch[lateral], drawn[:, 0], rng), _same_patch(sample.patch[lateral], drawn[:, 0], rng)
    drawn[::2, 1], drawn[::2, 2] = near[0][::2], near[1][::2]
    system = np.concatenate([outward[drawn], np.ones((TRIPLES, 3, 1))], axis=2)  # m·p + h = m·c - k z
    if point is not None:
        centres = np.repeat((turn @ point)[None, :2], TRIPLES, axis=0)
        distances = along[drawn[:, 0]] - outward[drawn[:, 0]] @ centres[0]
    else:
        solvable = np.abs(np.linalg.det(system)) > 1e-3
        if not solvable.any():
            return nothing
        solved = np.linalg.solve(system[solvable], along[drawn[solvable]][..., None])[..., 0]
        centres, distances = solved[:, :2], solved[:, 2]
    reach = float(np.ptp(flat, axis=0).max())
    inside = ((centres > flat.min(axis=0)) & (centres < flat.max(axis=0))).all(axis=1)
    if not inside.any():
        return nothing
    centres, distances = centres[inside], distances[inside]
    agreeing = _agreeing(outward, flat, along, (centres, distances), (SAME_DISTANCE * reach, kind.half_facet_rad))
    number = kind.azimuth_of(outward)
    faced = np.stack([(agreeing[:, number == k]).sum(axis=1) for k in range(kind.azimuths)], axis=1)
    usual = np.sort(faced, axis=1)[:, kind.unfaced]
    # a stretch of a cylinder counts a little, one that goes round counts in full
    score = np.minimum(faced, 4 * usual[:, None]).sum(axis=1) + 0.05 * faced.sum(axis=1)
    best = int(score.argmax())
    return turn.T @ np.append(centres[best], 0.0), float(score[best]) / len(sample.normal)


def _agreeing(
    outward: Floats, flat: Floats, along: Floats, axes: tuple[Floats, Floats], within: tuple[float, float]
) -> Bools:
    """Which facets (k, n) belong to each of k surfaces, within so many mm and half a facet's angle."""
    (centres, distances), (window, half_facet_rad) = axes, within
    gap = along[None] - centres @ outward.T - distances[:, None]
    tangent = np.stack([-outward[:, 1], outward[:, 0]], axis=1)
    aside = (tangent * flat).sum(axis=1)[None] - centres @ tangent.T
    ahead = (outward * flat).sum(axis=1)[None] - centres @ outward.T
    return (np.abs(gap) <= window) & (np.abs(aside) <= np.tan(half_facet_rad) * ahead)
